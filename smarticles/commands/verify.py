"""verify: known answers, computed on this machine and compared with theory."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

from dem.errors import RunError
from smarticles.layout import columns, told_results
from smarticles.parsing import Commands


def add(commands: Commands) -> None:
    """Add the command."""
    verify = commands.add(
        "verify",
        run_verify,
        summary="known answers: is the physics right on this machine",
        text="""
Small simulations through the engine that runs use, whose answer is on paper: free fall, rebound, oblique
impact, sliding and rolling, a stack, a smarticle on its tip, free spin, hinges under load, a pendulum. Each
quantity is compared with theory; each error must be within a tolerance that is argued in the table.
Trajectories are repeated at several time steps: their order of convergence must be the scheme's. And a
smarticle is thrown flat at the floor with more and more spheres: what a flat impact is not.

Takes a minute or two. DIR gets verification.csv, absent.csv (what has no meaning on the engine, and why),
orders.csv, trajectories.csv, clumps.csv, verification.md and figures; with --engine both, DIR/yade and
DIR/links do. Exit status 1 if an answer is not as it must be.""",
        examples="""\
  smarticles verify --out verification
  smarticles verify --engine links --out verification
""",
    )
    verify.add_argument(
        "--engine", choices=("yade", "links", "both"), default="yade", help="what computes (default: yade)"
    )
    verify.add_argument("--out", type=Path, required=True, metavar="DIR", help="directory for tables and figures")


def run_verify(arguments: argparse.Namespace) -> int:
    """`smarticles verify`."""
    from studies.framework.provenance import make_folder  # noqa: PLC0415

    both = arguments.engine == "both"
    failed = [
        line
        for engine in (("yade", "links") if both else (arguments.engine,))
        for line in _verified(
            make_folder(arguments.out / engine if both else arguments.out), engine, arguments.command_line
        )
    ]
    if failed:
        sys.stdout.flush()
        msg = f"{len(failed)} known answer(s) not met; first: {failed[0]}"
        raise RunError(msg)
    return 0


def _verified(folder: Path, engine: str, command: str) -> list[str]:
    """Compute, tell and draw; what is not met, one line each."""
    from smarticles.verification.report import report_verification, told_checks, told_orders  # noqa: PLC0415

    _compute(folder, engine)
    report = report_verification(folder, command=command)
    told = [*columns(*told_orders(report.orders)).splitlines(), "", *report.told]
    print()
    print(told_results(columns(*told_checks(report.checks)), told, report.files, folder))
    return [f"{line}; see {folder / 'verification.md'} and `smarticles doctor`" for line in report.failed]


def _compute(folder: Path, engine: str) -> None:
    """Compute the tables in a process of its own: YADE and what draws never meet in one."""
    command = [sys.executable, "-m", "smarticles.verification", "known", "--engine", engine, str(folder.resolve())]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    child = subprocess.run(command, stderr=subprocess.PIPE, text=True, env=environment, check=False)
    if child.returncode:
        lines = child.stderr.strip().splitlines() or [f"the computing process ended with status {child.returncode}"]
        raise RunError(lines[-1])
