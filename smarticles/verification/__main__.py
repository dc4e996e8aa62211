"""`python -m smarticles.verification DIR`: compute all known answers; tables into a folder that exists.

Writes verification.csv, trajectories.csv and clumps.csv, and versions.json; progress goes to standard output. What
draws and judges them is another process, see `smarticles.verification.report`; `smarticles verify` runs both.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

import pandas as pd

from dem.engine.yade.library import yade_version
from dem.errors import RunError
from dem.record.files import write_json, write_text
from dem.run.run import versions
from smarticles.verification.answer import Case, Ladder
from smarticles.verification.catalogue import CASES, LADDERS
from smarticles.verification.known.clumps import flat_impacts

T = TypeVar("T")


def rows_of_case(case: Case) -> list[dict[str, object]]:
    """One row per check."""
    return [
        {
            "case": case.name,
            "quantity": check.quantity,
            "unit": check.unit,
            "theory [unit]": check.theory,
            "measured [unit]": check.measured,
            "error [1]": check.error,
            "tolerance [1]": check.tolerance,
            "ok": check.ok,
            "error relative to [unit]": check.scale or abs(check.theory),
            "about": case.about,
            "source": case.theory,
            "reason of the tolerance": check.reason,
        }
        for check in case.measure()
    ]


def rows_of_ladder(ladder: Ladder) -> list[dict[str, object]]:
    """One row per time step."""
    return [
        {
            "ladder": ladder.name,
            "quantity": ladder.quantity,
            "unit": ladder.unit,
            "time step [s]": step,
            "error [unit]": error,
            "size of the motion [unit]": ladder.size,
            "order of the scheme [1]": ladder.order,
            "about": ladder.about,
            "why": ladder.why,
        }
        for step, error in zip(ladder.steps, ladder.errors(ladder.steps), strict=True)
    ]


_CLUMP_COLUMNS = {
    "rows": "rows [1]",
    "pitch": "pitch [1]",
    "spheres": "spheres [1]",
    "contacts": "contacts [1]",
    "nominal": "restitution asked for [1]",
    "parallel": "restitution, n in parallel [1]",
    "theory": "restitution, n in parallel and tilt [1]",
    "measured": "restitution measured [1]",
    "at_scene_step": "restitution at the scene's time step [1]",
    "theory_contact": "contact time, theory [s]",
    "measured_contact": "contact time measured [s]",
    "single_contact": "contact time of one elastic contact [s]",
    "theory_sunk": "depth at rest, theory [m]",
    "measured_sunk": "depth at rest measured [m]",
    "step": "time step of the scene [s]",
}


def compute(folder: Path) -> None:
    """Run everything.

    Args:
        folder: where the tables go.

    Raises:
        RunError: YADE is not installed, or a disk is full.
    """
    write_json(folder / "versions.json", versions(("yade", yade_version())))
    _write(folder / "verification.csv", [row for case in CASES for row in _timed(case.name, rows_of_case, case)])
    _write(folder / "trajectories.csv", [row for one in LADDERS for row in _timed(one.name, rows_of_ladder, one)])
    impacts = _timed("flat impacts over the number of spheres", flat_impacts)
    _write(
        folder / "clumps.csv", [{_CLUMP_COLUMNS[key]: value for key, value in asdict(one).items()} for one in impacts]
    )


def _timed(name: str, run: Callable[..., list[T]], *arguments: object) -> list[T]:
    begun = time.perf_counter()
    found = run(*arguments)
    print(f"{time.perf_counter() - begun:6.1f} s  {name}", flush=True)
    return found


def _write(path: Path, rows: list[dict[str, object]]) -> None:
    write_text(path, pd.DataFrame(rows).to_csv(index=False, float_format="%.10g"))


def main() -> int:
    """Compute into the folder that the command line names."""
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        print(
            "python -m verification DIR: DIR must be a folder; `smarticles verify --out DIR` makes it", file=sys.stderr
        )
        return 2
    try:
        compute(Path(sys.argv[1]))
    except RunError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
