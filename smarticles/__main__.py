"""Run the console command: `python -m smarticles`."""

import sys

from smarticles.main import main

sys.exit(main())
