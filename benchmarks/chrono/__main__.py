"""The paper's own engine, Project Chrono, beside links: `python -m benchmarks.chrono --driver PROGRAM --out DIR`.

A pile per seed and protocol is poured once, on links; both engines take its poses, let it rest, and change its shape or
swing its barbs by the motors' rule, friction and wall of that protocol. What Chrono simulated becomes a run directory
that is measured like any other. One simulation after the other; what is done is not done again, so that the same
command goes on where it was stopped. `runs.csv`, `table.md` and the figure are made of what is there; `--analyse` makes
them and simulates nothing. How the driver is built: `results/chrono/README.md`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd

from benchmarks.child import run_child
from benchmarks.chrono import figure
from benchmarks.chrono.cases import ACTIVITIES, FRAMES, SERIES, Case, planned, pour, scene_data, scene_of
from benchmarks.chrono.checks import known_answers
from benchmarks.chrono.records import constraints, write_run
from benchmarks.chrono.running import simulate
from benchmarks.chrono.table import markdown, measured, summary
from benchmarks.chrono.task import SETTINGS, words
from dem.errors import InputError, RunError
from dem.record.names import DONE

VERSION = "10.0 (7689fbc)"  # of the snapshot that README's recipe builds


def check(driver: Path, folder: Path) -> int:
    """Tell the known answers; the exit status."""
    folder.mkdir(parents=True, exist_ok=True)
    found = known_answers(driver, folder)
    for one in found:
        print(f"{'holds' if one.holds else 'FAILS'}  {one.what}: {one.found:.5g}, known {one.known:.5g}")
    return 0 if all(one.holds for one in found) else 1


def run(case: Case, folder: Path, driver: Path) -> None:
    """Simulate one case into a run directory, unless it is done.

    Raises:
        InputError: There is no driver.
        RunError: It failed.
    """
    out = folder / case.name
    if (out / DONE).exists():
        return
    pile = pour(folder, case.rules, case.seed, case.count)
    if case.engine == "links":
        run_child(folder, case.name, scene_data(case, pile))
        return
    scene = scene_of(case, pile)
    records = simulate(driver, folder, case.name, words(scene, SETTINGS[case.engine]), case.count)
    command = f"python -m benchmarks.chrono {' '.join(sys.argv[1:])}"
    write_run(
        records,
        scene,
        out,
        frame_every=round(FRAMES / SERIES),
        time_step=SETTINGS[case.engine].time_step,
        version=VERSION,
        command=command,
    )
    facts = constraints(records, scene, every=round(FRAMES / SERIES))
    (out / "chrono.json").write_text(json.dumps(facts), encoding="utf-8")


def collect(folder: Path, cases: Sequence[Case]) -> pd.DataFrame:
    """A row per case that is done; those that `runs.csv` has already are not measured again."""
    path = folder / "runs.csv"
    known = pd.read_csv(path) if path.exists() else pd.DataFrame({"run": []})
    rows = [row for row in known.to_dict("records") if row["run"] in {case.name for case in cases}]
    for case in cases:
        if (folder / case.name / DONE).exists() and case.name not in set(known["run"]):
            rows.append(measured(case, folder / case.name))
    order = {case.name: index for index, case in enumerate(cases)}
    rows.sort(key=lambda row: order[str(row["run"])])
    table = pd.DataFrame(rows)
    table.to_csv(path, index=False)
    return table


def main() -> int:
    """Run what is missing, and make table and figure of what is there."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.chrono", description=__doc__)
    parser.add_argument("--driver", type=Path, default=Path("driver"), help="the program (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=None, help="folder (default: a new one); goes on if it exists")
    parser.add_argument("--count", type=int, default=100, help="smarticles (default: %(default)s)")
    parser.add_argument("--seeds", type=int, nargs="*", default=[1, 2, 3], help="piles for Chrono")
    parser.add_argument("--warm-seeds", type=int, nargs="*", default=[], help="piles for Chrono with a warm solver")
    parser.add_argument("--links-seeds", type=int, nargs="*", default=[1, 2, 3], help="piles for links")
    parser.add_argument("--activities", nargs="+", choices=ACTIVITIES, default=list(ACTIVITIES))
    parser.add_argument("--check", action="store_true", help="known answers of the driver, and no pile")
    parser.add_argument("--analyse", action="store_true", help="simulate nothing")
    arguments = parser.parse_args()
    folder = arguments.out or Path("out") / f"chrono-{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
    cases = [
        *planned("links", arguments.links_seeds, arguments.activities, arguments.count),
        *planned("chrono", arguments.seeds, arguments.activities, arguments.count),
        *planned("chrono-warm", arguments.warm_seeds, arguments.activities, arguments.count),
    ]
    try:
        if arguments.check:
            return check(arguments.driver, folder / "checks")
        folder.mkdir(parents=True, exist_ok=True)
        for case in [] if arguments.analyse else cases:
            print(f"{datetime.now(UTC):%H:%M:%S} {case.name}", flush=True)
            run(case, folder, arguments.driver)
        table = collect(folder, cases)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except (RunError, subprocess.CalledProcessError) as error:
        print(error, file=sys.stderr)
        return 1
    if table.empty:
        print("nothing was run", file=sys.stderr)
        return 1
    points = summary(table)
    (folder / "table.md").write_text(markdown(points), encoding="utf-8")
    figure.draw(folder / "height_time", folder, [case for case in cases if (folder / case.name / DONE).exists()])
    print(markdown(points))
    return 0


if __name__ == "__main__":
    sys.exit(main())
