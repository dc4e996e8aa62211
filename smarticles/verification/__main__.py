"""`python -m smarticles.verification PART`: what `smarticles verify` and `make stability` compute, part by part.

`known DIR` computes all known answers on an engine: verification.csv, absent.csv, trajectories.csv, clumps.csv and
versions.json, which `smarticles verify` judges and draws in another process. The other parts are those of `make
stability`; what is in their tables already is skipped, so that a run that was stopped goes on, and parts can be run
apart.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from dem.errors import RunError
from smarticles.verification.hands.kinds import ENGINES

STABILITY = {"yade": Path("results/stability"), "links": Path("results/stability/links")}
# On YADE bits are the same on one thread only.
THREADS = {"yade": (1,), "links": (1,)}


def main(argv: Sequence[str] | None = None) -> int:
    """Do one of the parts.

    Args:
        argv: the arguments; by default those of this process.

    Returns:
        The exit status.
    """
    arguments = _parser().parse_args(argv)
    os.environ["OMP_NUM_THREADS"] = "1"
    try:
        return _done(arguments)
    except RunError as error:
        print(error, file=sys.stderr)
        return 1


def _done(arguments: argparse.Namespace) -> int:
    # Figures bring in Matplotlib and the package of measures, the others YADE: each only where it is asked for.
    out: Path = arguments.out or STABILITY[arguments.engine]
    if arguments.part == "figure":
        from smarticles.verification.figures import draw_onset  # noqa: PLC0415

        print(draw_onset(out))
        return 0
    from smarticles.verification import tables  # noqa: PLC0415

    out.mkdir(parents=True, exist_ok=True)
    if arguments.part == "known":
        tables.compute_known(out, arguments.engine)
    elif arguments.part == "cases":
        good = tables.run_cases(out, arguments.engine, form=arguments.form, only=arguments.only, again=arguments.again)
        return 0 if good else 1
    elif arguments.part == "kills":
        from smarticles.verification.hard.kills import run_kills  # noqa: PLC0415

        with tempfile.TemporaryDirectory() as scratch:
            threads, number = arguments.threads or THREADS[arguments.engine], arguments.number
            return 0 if run_kills(out, Path(scratch), arguments.engine, threads=threads, number=number) else 1
    else:
        from smarticles.verification.hard.onset import run_onset  # noqa: PLC0415

        run_onset(out, arguments.engine, arguments.seeds)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m smarticles.verification", description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True)
    known = parts.add_parser("known", help="compute the known answers")
    known.add_argument("out", type=Path, metavar="DIR", help="folder of the tables")
    cases = parts.add_parser("cases", help="run the hard cases")
    cases.add_argument("--form", choices=("short", "long"), default="long", help="size of the cases")
    cases.add_argument("--only", nargs="+", default=[], metavar="TEXT", help="cases whose name contains one of these")
    cases.add_argument("--again", action="store_true", help="run cases whose rows are there already, too")
    onset = parts.add_parser("onset", help="run the same scenes at steps around the stable one and above")
    onset.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="seeds of every scene")
    kills = parts.add_parser("kills", help="kill runs at random moments, resume them, and compare bits")
    kills.add_argument("--threads", type=int, nargs="+", help="numbers of threads (default: those with the same bits)")
    kills.add_argument("--number", type=int, default=50, help="kills on each (default: %(default)s)")
    figure = parts.add_parser("figure", help="draw the figure of the onset from its table")
    for part in (known, cases, onset, kills, figure):
        part.add_argument("--engine", choices=ENGINES, default="yade", help="what computes (default: yade)")
    for part in (cases, onset, kills, figure):
        part.add_argument("--out", type=Path, help="folder of tables and figure")
    return parser


if __name__ == "__main__":
    sys.exit(main())
