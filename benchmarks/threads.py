"""What threads bring: wall seconds per simulated second of one shaken pile on 1, 2, … threads of YADE.

Runs on several threads are not bit-identical, so the packing fraction is shown beside: it may differ by the scatter of
seeds, not by more. Threads that find no free core spin: measure on a machine that is otherwise idle.
"""

from __future__ import annotations

import argparse
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd

from benchmarks.child import last_phase_cost, run_child
from postprocess.measures.table import summarise_run


def threads_cost(folder: Path, *, count: int, fidelity: str, threads: int, seed: int) -> dict[str, float]:
    """One run's row: cost of its shake phase and φ at its end."""
    data = {
        "schema_version": 1,
        "name": f"{threads} threads, N = {count}",
        "seed": seed,
        "count": count,
        "fidelity": fidelity,
        "phases": [{"type": "deposit", "per_layer": 10}, {"type": "shake", "duration_s": 0.4}],
    }
    name = f"threads-{threads}-{seed}"
    run_child(folder, name, data, threads=threads)
    packing = summarise_run(folder / name, definitions=["second-highest-com"]).iloc[-1]
    return {
        "threads [-]": threads,
        "seed": seed,
        "wall time per simulated time [s/s]": last_phase_cost(folder / name),
        "phi second-highest-com [-]": packing["phi second-highest-com [-]"],
    }


def main() -> None:
    """Time all numbers of threads and print one table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.threads", description=__doc__)
    parser.add_argument("--count", type=int, default=270, help="number of smarticles")
    parser.add_argument("--fidelity", default="standard", help="draft, standard or reference")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2], help="numbers of threads")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="one run of each number per seed")
    parser.add_argument("--out", type=Path, default=None, help="folder for runs and table (default: a new one)")
    arguments = parser.parse_args()
    folder = arguments.out or Path("out") / f"threads-{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
    folder.mkdir(parents=True)
    table = pd.DataFrame(
        [
            threads_cost(folder, count=arguments.count, fidelity=arguments.fidelity, threads=threads, seed=seed)
            for seed in arguments.seeds
            for threads in arguments.threads
        ]
    )
    table.to_csv(folder / "threads.csv", index=False)
    print(table.round(4).to_string(index=False))
    print(table.drop(columns="seed").groupby("threads [-]").agg(["mean", "std"]).round(4).to_string())


if __name__ == "__main__":
    main()
