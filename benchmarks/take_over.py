"""What it does to a pile to be taken over: `python -m benchmarks.take_over`.

Piles poured on each engine go on on each, at rest. Told are how far smarticles move until they rest again, and what
that does to the packing fraction. Nothing here is timed.
"""

from __future__ import annotations

import argparse
from datetime import UTC, datetime
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.child import run_child
from postprocess import read_frames, read_series

ENGINES = ("links", "yade")


def scene_data(engine: str, fidelity: str, seed: int, count: int, *phases: dict[str, Any]) -> dict[str, Any]:
    """A pile of the paper's smarticles, l/w = 0.7."""
    return {
        "schema_version": 1,
        "name": "take over",
        "engine": engine,
        "fidelity": fidelity,
        "seed": seed,
        "count": count,
        "phases": list(phases),
    }


def compared(pour: Path, on: Path) -> dict[str, float]:
    """A pile at the end of its pour, and taken over and at rest again."""
    before, after = (read_frames(run)[-1] for run in (pour, on))
    moved = after.vertices.mean(axis=1) - before.vertices.mean(axis=1)
    distances = np.linalg.norm(moved, axis=1)
    phi = [float(read_series(run)["packing_fraction"][-1]) for run in (pour, on)]
    return {
        "phi before [-]": phi[0],
        "phi change [%]": 100 * (phi[1] / phi[0] - 1),
        "moved mean [mm]": 1e3 * float(distances.mean()),
        "moved most [mm]": 1e3 * float(distances.max()),
        "rise mean [mm]": 1e3 * float(moved[:, 2].mean()),
    }


def main() -> None:
    """Pour, take over, and print one table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.take_over", description=__doc__)
    parser.add_argument("--count", type=int, default=60, help="number of smarticles")
    parser.add_argument("--fidelities", nargs="+", default=["standard", "draft"], help="draft, standard, reference")
    parser.add_argument("--engines", nargs="+", default=ENGINES, choices=ENGINES, help="to pour and to go on on")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="one pile of each per seed")
    parser.add_argument("--out", type=Path, default=None, help="folder for runs and table (default: a new one)")
    arguments = parser.parse_args()
    folder = arguments.out or Path("out") / f"take-over-{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}"
    folder.mkdir(parents=True)
    rows = []
    for fidelity, seed, poured in product(arguments.fidelities, arguments.seeds, arguments.engines):
        name = f"{fidelity}-{poured}-{seed}"
        phases = ({"type": "deposit"}, {"type": "relax", "duration_s": 0.4})
        run_child(folder, name, scene_data(poured, fidelity, seed, arguments.count, *phases))
        for onto in arguments.engines:
            first = {"type": "take-over", "run": str((folder / name).absolute())}
            on = scene_data(onto, fidelity, seed, arguments.count, first, {"type": "relax", "duration_s": 0.2})
            run_child(folder, f"{name}-{onto}", on)
            row = {"fidelity": fidelity, "poured on": poured, "goes on on": onto, "seed": seed}
            rows.append({**row, **compared(folder / name, folder / f"{name}-{onto}")})
    table = pd.DataFrame(rows).sort_values(["fidelity", "poured on", "goes on on", "seed"])
    table.to_csv(folder / "take_over.csv", index=False)
    print(table.round(5).to_string(index=False))


if __name__ == "__main__":
    main()
