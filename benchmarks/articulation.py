"""What articulation costs: wall seconds per simulated second of one pile shaken, at rest, and hinged and actuated.

The welded runs take the longer time step that they may; every run is a process of its own on one thread. Quote the
ratios: they are taken in one go on one machine.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.child import last_phase_cost, run_child

ACTIVITIES: Mapping[str, Mapping[str, Any]] = {
    "shaken": {"type": "shake"},
    "at rest": {"type": "relax"},
    "internal oscillation": {"type": "internal-oscillation", "theta_deg": 10},
}


def phase_cost(folder: Path, *, activity: str, count: int, fidelity: str, seconds: float, seed: int) -> float:
    """Wall seconds per simulated second of one activity of `count` smarticles, l/w = 0.7."""
    data = {
        "schema_version": 1,
        "name": f"{activity}, N = {count}",
        "seed": seed,
        "count": count,
        "fidelity": fidelity,
        "phases": [
            {"type": "deposit", "per_layer": 10},
            {**ACTIVITIES[activity], "duration_s": seconds},
        ],
    }
    name = f"{activity.replace(' ', '-')}-{fidelity}-{count}-{seed}"
    run_child(folder, name, data)
    return last_phase_cost(folder / name)


def main() -> None:
    """Time all activities and print one table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.articulation", description=__doc__)
    parser.add_argument("--count", type=int, default=270, help="number of smarticles")
    parser.add_argument("--fidelity", default="standard", help="draft, standard or reference")
    parser.add_argument("--seconds", type=float, default=0.3, help="simulated time of each activity [s]")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="one run of each activity per seed")
    parser.add_argument("--out", type=Path, default=None, help="folder for runs and table (default: a new one)")
    arguments = parser.parse_args()
    folder = arguments.out or Path("out") / f"articulation-{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
    folder.mkdir(parents=True)
    rows = []
    for seed in arguments.seeds:
        costs = {
            activity: phase_cost(
                folder,
                activity=activity,
                count=arguments.count,
                fidelity=arguments.fidelity,
                seconds=arguments.seconds,
                seed=seed,
            )
            for activity in ACTIVITIES
        }
        hinged = costs["internal oscillation"]
        ratios = {f"hinged over {name} [1]": hinged / cost for name, cost in costs.items() if cost is not hinged}
        rows.append({"seed": seed, **{f"{name} [s/s]": cost for name, cost in costs.items()}, **ratios})
    table = pd.DataFrame(rows)
    table.to_csv(folder / "articulation.csv", index=False)
    print(table.round(2).to_string(index=False))
    print(f"N = {arguments.count}, {arguments.fidelity}; to be at most 130 s/s hinged and 2.5 times welded")


if __name__ == "__main__":
    main()
