"""Compare the cost of each activity on links and YADE: `python -m benchmarks.engines`.

Piles have 50 to 20 000 smarticles. The radius of the container grows with N, so that all piles are as high as the
paper's pile of 270. Every run is a process on one thread. The processor time of the activity alone is compared,
recording included. `engines.csv` has one row per run; a later call with the same `--out` continues the table. A run
that is expected to exceed the allowed wall time is skipped and reported.
"""

import argparse
import json
import time
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.runs import folder_of, phase_cost, pile, run_child

ENGINES = ("links", "yade")
COUNTS = (50, 100, 270, 1000, 3000, 10_000, 20_000)
ACTIVITIES: dict[str, dict[str, Any]] = {"shake": {}, "internal-oscillation": {"theta_deg": 10.0}}
SECONDS = 0.4  # duration of an activity [s]
REPEATS_UP_TO, REPEATS = 270, 3  # piles of up to 270 smarticles are run with 3 seeds
COST, PER_STEP = "processor time per simulated time [s/s]", "per step and smarticle [us]"
MEMORY, WHOLE = "peak memory [MiB]", "whole run [s]"


def measured(folder: Path, run: dict[str, Any]) -> dict[str, Any]:
    """Compute a run in the folder of all runs; return `run`, its known columns, with times and memory."""
    engine, activity, fidelity, count, seed = run.values()
    name = f"{engine}-{activity}-{fidelity}-{count}-{seed}"
    acting = {"type": activity, "duration_s": SECONDS, **ACTIVITIES[activity]}
    begun = time.monotonic()
    usage = run_child(folder, name, pile(count, acting, seed=seed, engine=engine, fidelity=fidelity))
    cost = phase_cost(folder / name)
    step = json.loads((folder / name / "run.json").read_text())["phases"][-1]["time_step_s"]
    per_step = cost * step * 1e6 / count
    memory, whole = usage.ru_maxrss / 1024, time.monotonic() - begun
    return {**run, COST: cost, PER_STEP: per_step, MEMORY: memory, WHOLE: whole}


def main() -> None:
    """Compute the missing runs, and print the medians of both engines side by side."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.engines", description=__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS, help="numbers of smarticles")
    parser.add_argument("--activities", nargs="+", choices=ACTIVITIES, default=ACTIVITIES, help="(default: both)")
    parser.add_argument("--fidelity", default="standard", help="(default: %(default)s)")
    parser.add_argument("--hours", type=float, default=1.0, help="wall time allowed [h] (default: %(default)s)")
    parser.add_argument("--out", type=Path, help="folder for runs and engines.csv; continued if it exists")
    given = parser.parse_args()
    folder, begun = folder_of("engines", given.out), time.monotonic()
    path = folder / "engines.csv"
    rows = pd.read_csv(path).to_dict("records") if path.exists() else []
    for activity, count in product(given.activities, sorted(given.counts)):
        for seed, engine in product(range(1, (REPEATS if count <= REPEATS_UP_TO else 1) + 1), ENGINES):
            run = {"engine": engine, "activity": activity, "fidelity": given.fidelity, "N [-]": count, "seed": seed}
            if any(all(row[key] == value for key, value in run.items()) for row in rows):
                continue
            before = [row for row in rows if (row["engine"], row["activity"]) == (engine, activity)]
            guess = before[-1][WHOLE] * max(1.0, count / before[-1]["N [-]"]) if before else 0.0
            if time.monotonic() - begun + guess > 3600 * given.hours:
                print(f"skipped, not enough time: {run}, about {guess:.0f} s; continue with --out {folder}")
                continue
            rows.append(measured(folder, run))
            pd.DataFrame(rows).to_csv(path, index=False)
            print(f"{engine:6s} {activity} N = {count:6d} seed {seed}: {rows[-1][COST]:8.2f} s/s", flush=True)
    if rows:
        keys = ["activity", "fidelity", "N [-]", "engine"]
        wide = pd.DataFrame(rows).groupby(keys)[[COST, PER_STEP, MEMORY]].median().unstack("engine")
        if set(ENGINES) <= set(wide[COST]):
            wide["yade over links [1]", ""] = wide[COST]["yade"] / wide[COST]["links"]
        print(wide.to_string(float_format=lambda x: f"{x:.3g}"))
    print(f"table: {path}")


if __name__ == "__main__":
    main()
