"""Both engines side by side: what each activity costs, from 50 to 20 000 smarticles: `python -m benchmarks.engines`.

The same scene at every N, in a cylinder that is widened so that the pile is as high as the paper's of 270; every run is
a process of its own on one thread, the engines turn about. Processor time of the activity alone is compared, shaking or
the paper's internal oscillation, with everything that a run records; pouring and loading are left out. The table goes
to stdout and, run by run, to `engines.csv`, where a later call with the same `--out` goes on. A run that would go
beyond the time allowed, by what the one before it took, is left out and said so.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.child import run_child

ENGINES = ("links", "yade")
COUNTS, QUICK_COUNTS = (50, 100, 270, 1000, 3000, 10_000, 20_000), (50, 100)
ACTIVITIES: Mapping[str, Mapping[str, Any]] = {"shake": {}, "internal-oscillation": {"theta_deg": 10.0}}
SECONDS, QUICK_SECONDS = 0.4, 0.05  # of an activity
REPEATS_UP_TO, REPEATS = 270, 3  # smarticles, seeds
# The pile of the paper's l/w = 0.7 run; other N keep its height.
PAPER_COUNT, PAPER_RADIUS, PAPER_PER_LAYER = 270, 0.0234, 10
COST, PER_STEP, MEMORY = "processor time per simulated time [s/s]", "per step [us]", "peak memory [MiB]"


def scene_of(engine: str, activity: str, count: int, *, fidelity: str, seconds: float, seed: int) -> dict[str, Any]:
    """Pour and do."""
    widening = (count / PAPER_COUNT) ** 0.5
    return {
        "schema_version": 1,
        "name": f"{engine}, {activity}, N = {count}",
        "engine": engine,
        "seed": seed,
        "count": count,
        "container": {"radius_m": PAPER_RADIUS * widening},
        "fidelity": fidelity,
        "phases": [
            {"type": "deposit", "per_layer": max(PAPER_PER_LAYER, round(PAPER_PER_LAYER * widening**2))},
            {"type": activity, "duration_s": seconds, **ACTIVITIES[activity]},
        ],
    }


def measured(
    folder: Path, engine: str, activity: str, count: int, *, fidelity: str, seconds: float, seed: int
) -> dict[str, Any]:
    """Run once; a row of the table."""
    name = f"{engine}-{activity}-{fidelity}-{count}-{seed}"
    begun = time.monotonic()
    usage = run_child(folder, name, scene_of(engine, activity, count, fidelity=fidelity, seconds=seconds, seed=seed))
    done = json.loads((folder / name / "done.json").read_text())
    phase = done["phases"][-1]
    cost = phase["cpu_s"] / (phase["end_s"] - phase["start_s"])
    step = json.loads((folder / name / "run.json").read_text())["phases"][-1]["time_step_s"]
    return {
        "engine": engine,
        "activity": activity,
        "fidelity": fidelity,
        "N [-]": count,
        "seed": seed,
        COST: cost,
        PER_STEP: cost * step * 1e6,
        "per step and smarticle [us]": cost * step * 1e6 / count,
        MEMORY: usage.ru_maxrss / 1024,
        "whole run [s]": time.monotonic() - begun,
    }


def run_all(
    folder: Path, activity: str, counts: Sequence[int], *, fidelity: str, seconds: float, budget: float
) -> tuple[Any, list[str]]:
    """Run what is not in the folder's table yet.

    Args:
        folder: of runs and table.
        activity: what is done after the pour.
        counts: numbers of smarticles, rising.
        fidelity: named one.
        seconds: of the activity.
        budget: wall time allowed [s].

    Returns:
        The table, and what was left out.
    """
    path, begun, left_out = folder / "engines.csv", time.monotonic(), []
    table = pd.read_csv(path) if path.exists() else pd.DataFrame()
    for count in counts:
        for seed in range(1, (REPEATS if count <= REPEATS_UP_TO else 1) + 1):
            for engine in ENGINES:
                known = table
                for column, value in (("engine", engine), ("activity", activity), ("fidelity", fidelity)):
                    known = known[known[column] == value] if len(known) else known
                if len(known) and ((known["N [-]"] == count) & (known["seed"] == seed)).any():
                    continue
                last = known.iloc[-1] if len(known) else None
                guess = 0.0 if last is None else float(last["whole run [s]"]) * max(1.0, count / last["N [-]"])
                if time.monotonic() - begun + guess > budget:
                    left_out.append(f"{engine}, {activity}, N = {count}, seed {seed}: about {guess:.0f} s")
                    continue
                row = measured(folder, engine, activity, count, fidelity=fidelity, seconds=seconds, seed=seed)
                table = pd.concat([table, pd.DataFrame([row])], ignore_index=True)
                table.to_csv(path, index=False)
                print(f"{engine:6s} {activity} N = {count:6d} seed {seed}: {row[COST]:8.2f} s/s", flush=True)
    return table, left_out


def side_by_side(table: Any) -> Any:
    """Medians of both engines in one row for each activity, fidelity and N, and their ratio."""
    columns = [COST, "per step and smarticle [us]", MEMORY]
    wide = table.groupby(["activity", "fidelity", "N [-]", "engine"])[columns].median().unstack("engine")
    wide.columns = [f"{engine}: {what}" for what, engine in wide.columns]
    if {f"{engine}: {COST}" for engine in ENGINES} <= set(wide.columns):
        wide["yade over links [1]"] = wide[f"yade: {COST}"] / wide[f"links: {COST}"]
    return wide


def main() -> None:
    """Run all and print one table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.engines", description=__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=None, help="numbers of smarticles")
    parser.add_argument("--activities", nargs="+", choices=ACTIVITIES, default=ACTIVITIES, help="(default: both)")
    parser.add_argument("--fidelity", default="standard", help="named fidelity (default: %(default)s)")
    parser.add_argument("--hours", type=float, default=1.0, help="wall time allowed [h] (default: %(default)s)")
    parser.add_argument("--quick", action="store_true", help="two small N and little shaking")
    parser.add_argument("--out", type=Path, default=None, help="folder for runs and engines.csv; goes on if it exists")
    arguments = parser.parse_args()
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    folder = arguments.out or Path("out") / f"engines-{stamp}"
    folder.mkdir(parents=True, exist_ok=True)
    counts = sorted(arguments.counts or (QUICK_COUNTS if arguments.quick else COUNTS))
    seconds = QUICK_SECONDS if arguments.quick else SECONDS
    left_out = []
    for activity in arguments.activities:
        hours = arguments.hours / len(arguments.activities)
        table, missing = run_all(
            folder, activity, counts, fidelity=arguments.fidelity, seconds=seconds, budget=3600 * hours
        )
        left_out += missing
    if len(table):
        print(side_by_side(table).to_string(float_format=lambda x: f"{x:.3g}"))
    for what in left_out:
        print(f"left out for want of time: {what}; go on with --out {folder} and more --hours")
    print(f"table: {folder / 'engines.csv'}")


if __name__ == "__main__":
    main()
