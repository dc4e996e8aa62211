"""`make bench`: what a simulated second of shaking costs, how it grows with N, and how fast the measures are.

Every run is a process of its own on one thread; figures are wall seconds per simulated second of the shake phase, read
from `done.json`. Machines are noisy: quote the exponent and the ratios, and repeat before quoting a time.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.child import last_phase_cost, run_child
from postprocess import link_crossings

REPEATS = 3
# The pile of the paper's l/w = 0.7 run; other N keep its height: container and layers are widened or narrowed.
PAPER_COUNT, PAPER_RADIUS, PAPER_PER_LAYER = 270, 0.0234, 10
PACKING = 0.13  # number density of the random scene that link_crossings is timed on


@dataclass(frozen=True)
class Cost:
    """Cost of one run's shake phase."""

    count: int
    fidelity: str
    wall_s_per_s: float
    memory_mib: float


def shake_cost(folder: Path, *, count: int, fidelity: str, seed: int) -> Cost:
    """Pour and shake `count` smarticles, l/w = 0.7, and time the shaking."""
    widening = (count / PAPER_COUNT) ** 0.5
    data = {
        "schema_version": 1,
        "name": f"bench N = {count}",
        "seed": seed,
        "count": count,
        "container": {"radius_m": PAPER_RADIUS * widening},
        "fidelity": fidelity,
        "phases": [
            {
                "type": "deposit",
                "per_layer": max(PAPER_PER_LAYER, round(PAPER_PER_LAYER * widening**2)),
            },
            {"type": "shake", "duration_s": 0.4},
        ],
    }
    name = f"{fidelity}-{count}-{seed}"
    usage = run_child(folder, name, data)
    return Cost(count, fidelity, last_phase_cost(folder / name), usage.ru_maxrss / 1024)


def crossings_cost(count: int) -> float:
    """Seconds that link_crossings takes on a random scene as dense as a pile."""
    rng = np.random.default_rng(1)
    w, barb, volume = 0.0117, 0.00819, 1.783e-8
    side = (count * volume / PACKING) ** (1 / 3)
    plain = np.array([[-w / 2, barb, 0], [-w / 2, 0, 0], [w / 2, 0, 0], [w / 2, barb, 0]])
    turns = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    vertices = np.einsum("nij,kj->nki", turns, plain) + side * rng.random((count, 1, 3))
    begun = time.perf_counter()
    link_crossings(vertices)
    return time.perf_counter() - begun


def main() -> None:
    """Run all benchmarks and print one table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=[100, 270, 1000], help="numbers of smarticles")
    parser.add_argument("--out", type=Path, default=None, help="folder for runs and bench.csv (default: a new one)")
    arguments = parser.parse_args()
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    folder = arguments.out or Path("out") / f"bench-{stamp}"
    folder.mkdir(parents=True)
    costs = [
        shake_cost(folder, count=count, fidelity="standard", seed=seed)
        for count in arguments.counts
        for seed in range(1, (REPEATS if count <= PAPER_COUNT else 1) + 1)
    ]
    table = pd.DataFrame(
        [(c.count, c.fidelity, c.wall_s_per_s, c.memory_mib) for c in costs],
        columns=["N [-]", "fidelity", "wall time per simulated time [s/s]", "peak memory [MiB]"],
    )
    table.to_csv(folder / "bench.csv", index=False)
    medians = table.groupby("N [-]")["wall time per simulated time [s/s]"].median()
    print(table.to_string(index=False))
    if len(medians) > 1:
        exponent = np.polyfit(np.log(medians.index.to_numpy(float)), np.log(medians.to_numpy(float)), 1)[0]
        print(f"\ncost grows as N^{exponent:.2f} (to be at most N^1.2)")
    seconds = np.median([crossings_cost(10_000) for _ in range(REPEATS)])
    print(f"link_crossings of 10 000 smarticles: {seconds:.2f} s (to be below 10 s)")
    print(f"table: {folder / 'bench.csv'}")


if __name__ == "__main__":
    main()
