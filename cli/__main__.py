"""`python -m cli` is `smarticles`."""

import sys

from cli.main import main

sys.exit(main())
