"""`make stability`: the long form of all cases, where the stable step ends, and the figure of that.

What is in the tables already is skipped, so that a run that was stopped goes on, and parts can be run apart.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path


def main() -> int:
    """Do one of the three."""
    parser = argparse.ArgumentParser(prog="python -m stability", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/stability"), help="folder of tables and figure")
    parts = parser.add_subparsers(dest="part", required=True)
    cases = parts.add_parser("cases", help="run the hard cases")
    cases.add_argument("--form", choices=("short", "long"), default="long", help="size of the cases")
    cases.add_argument("--only", nargs="+", default=[], metavar="TEXT", help="cases whose name contains one of these")
    cases.add_argument("--again", action="store_true", help="run cases whose rows are there already, too")
    onset = parts.add_parser("onset", help="run the same scenes at steps around the stable one and above")
    onset.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="seeds of every scene")
    parts.add_parser("figure", help="draw the figure of the onset from its table")
    arguments = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    arguments.out.mkdir(parents=True, exist_ok=True)
    # Figures bring in Matplotlib and the package of measures, the others YADE: each only where it is asked for.
    if arguments.part == "cases":
        from smarticles.verification.hard.table import run_cases  # noqa: PLC0415

        good = run_cases(arguments.out, form=arguments.form, only=arguments.only, again=arguments.again)
        return 0 if good else 1
    if arguments.part == "onset":
        from smarticles.verification.hard.onset import run_onset  # noqa: PLC0415

        run_onset(arguments.out, arguments.seeds)
    else:
        from smarticles.verification.hard.figure import draw_onset  # noqa: PLC0415

        print(draw_onset(arguments.out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
