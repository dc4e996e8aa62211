"""`python -m smarticles` is `smarticles`."""

import sys

from smarticles.main import main

sys.exit(main())
