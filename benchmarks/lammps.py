"""Compare LAMMPS with the other engines, and one rank with two: `python -m benchmarks.lammps agree | ranks`.

`agree` pours piles on links. Each engine takes them over, lets them rest, and shakes them. The table has φ at rest, and
φ and ⟨N⟩ during shaking.

`ranks` lets smarticles fall into a wide container, saves the engine, and repeats the next steps on one and two ranks.
The smallest wall time of each interval of steps is used, which approximates an idle machine.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
import time
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.runs import PAPER_COUNT, PAPER_RADIUS, folder_of, run_child
from dem.body.placement import place_layer
from dem.engine.cores import RANKS
from dem.engine.interface import Saved
from dem.engine.lammps.kind import LammpsKind
from dem.plan.steps import time_step
from dem.record.run import Run
from dem.scene.reading import parse_scene
from postprocess import link_crossings, read_frames, read_series

ENGINES = ("yade", "links", "lammps")
STEPS, INTERVALS = 10, 8  # steps per timed interval, number of intervals


def scene_data(engine: str, seed: int, count: int, fidelity: str, *phases: dict[str, Any]) -> dict[str, Any]:
    """Return a scene as a dictionary, with the paper's smarticles, l/w = 0.7."""
    keys = {"name": "lammps", "engine": engine, "fidelity": fidelity, "seed": seed, "count": count}
    recording = {"frame_interval_s": 0.04, "checkpoint_interval_s": None}
    return {"schema_version": 1, **keys, "phases": list(phases), "recording": recording}


def measured(run: Path) -> dict[str, float]:
    """Return the mean φ at the end of the rest, and the means of φ and ⟨N⟩ over the second half of the shaking."""
    planned, series = Run(run).phases, read_series(run)
    times, phases, phi = series["time_s"], series["phase"], series["packing_fraction"]
    rest = phi[(phases == 1) & (times > (planned[1].end_s or 0.0) - 0.1)]
    shaken = planned[2]
    half = ((shaken.start_s or 0.0) + (shaken.end_s or 0.0)) / 2
    crossings = [float(link_crossings(frame.vertices).mean()) for frame in read_frames(run).after(half)]
    return {
        "phi_0 [-]": float(rest.mean()),
        "phi_f [-]": float(phi[times > half].mean()),
        "<N> [-]": float(np.mean(crossings)),
    }


def agree(folder: Path, given: argparse.Namespace) -> None:
    """Compute rest and shaking of equal piles on every engine; write and print the table `agree.csv`."""
    rows, rest = [], {"type": "relax", "duration_s": 0.2}
    for seed, engine in product(given.seeds, ENGINES):
        pour = f"pour-{seed}"
        if not (folder / pour).exists():
            run_child(folder, pour, scene_data("links", seed, given.count, given.fidelity, {"type": "deposit"}, rest))
        taken = {"type": "take-over", "run": str((folder / pour).absolute())}
        shake = {"type": "shake", "duration_s": given.shake}
        run_child(folder, f"{engine}-{seed}", scene_data(engine, seed, given.count, given.fidelity, taken, rest, shake))
        rows.append({"engine": engine, "seed": seed, **measured(folder / f"{engine}-{seed}")})
        print(rows[-1], flush=True)
    table = pd.DataFrame(rows)
    table.to_csv(folder / "agree.csv", index=False)
    columns = list(table.columns[2:])
    print(table.groupby("engine")[columns].agg(["mean", "sem"]).round(5).to_string())
    wide = table.pivot_table(index="seed", columns="engine", values=columns)
    for column, other in product(columns, ("yade", "links")):
        apart = wide[column]["lammps"] - wide[column][other]
        print(f"{column}: lammps - {other}: {apart.mean():+.5f} ± {apart.sem():.5f} (standard error of pairs)")


def pile(count: int, fidelity: str, fall: float) -> tuple[dict[str, Any], Saved]:
    """Let smarticles fall for a time `fall` [s]; return the scene as a dictionary, and the saved engine."""
    widening = (count / PAPER_COUNT) ** 0.5
    data = scene_data("lammps", 1, count, fidelity, {"type": "deposit"}, {"type": "shake", "duration_s": 1.0})
    data["container"] = {"radius_m": PAPER_RADIUS * widening, "height_m": 0.4}
    scene = parse_scene(data, source="benchmarks")
    engine = LammpsKind().build(scene, time_step(scene))
    rng, bottom = np.random.default_rng(1), 0.0
    while engine.count < count:
        size = min(count - engine.count, max(4, round(30 * widening**2)))
        layer = place_layer(
            scene.particle, count=size, radius=scene.cylinder.inner_radius, bottom=bottom, height=0.01,
            obstacles=np.empty((0, 3)), rng=rng,
        )  # fmt: skip
        engine.add(layer)
        bottom = float(engine.state().vertices[..., 2].max()) + scene.particle.chain.diameter
    engine.advance(round(fall / engine.time_step))
    with tempfile.TemporaryDirectory() as scratch:
        saved = engine.save(Path(scratch))
    engine.child.close()
    return data, saved


def ranks(folder: Path, counts: list[int], repeats: int, fidelity: str, fall: float) -> None:
    """Time equal steps on one and two ranks; write the smallest wall times to `ranks.csv`.

    Args:
        folder: for the table.
        counts: numbers of smarticles.
        repeats: number of measurements.
        fidelity: name of the fidelity.
        fall: time for the fall of the smarticles [s].
    """
    rows = []
    for count in counts:
        data, saved = pile(count, fidelity, fall)
        scene = parse_scene(data, source="benchmarks")
        least: dict[int, np.ndarray[Any, Any]] = {}
        for _, number in product(range(repeats), (1, 2)):
            os.environ[RANKS] = str(number)
            engine = LammpsKind().build(scene, time_step(scene))
            engine.load(saved, folder)
            engine.boundaries.shake(amplitude=5.5e-4, frequency=30.0)
            engine.advance(1)
            took = []
            for _ in range(INTERVALS):
                begun = time.monotonic()
                engine.advance(STEPS)
                took.append(time.monotonic() - begun)
            engine.child.close()
            least[number] = np.minimum(least.get(number, np.inf), took)
        steps = STEPS * INTERVALS
        one, two = (1e6 * least[number].sum() / steps / count for number in (1, 2))
        rows.append(
            {"N": count, "one rank [us per step and smarticle]": one, "two ranks": two, "faster [-]": one / two}
        )
        print(rows[-1], flush=True)
    pd.DataFrame(rows).to_csv(folder / "ranks.csv", index=False)


def main() -> None:
    """Run the measurement named on the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lammps", description=__doc__)
    parser.add_argument("what", choices=("agree", "ranks"))
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5, 6], help="one pile each (agree)")
    parser.add_argument("--count", type=int, default=60, help="smarticles of a pile (agree)")
    parser.add_argument("--shake", type=float, default=1.0, help="length of the shaking [s] (agree)")
    parser.add_argument("--counts", type=int, nargs="+", default=[500, 1000, 5000], help="smarticles (ranks)")
    parser.add_argument("--repeats", type=int, default=5, help="number of measurements (ranks)")
    parser.add_argument("--fall", type=float, default=0.25, help="time for the fall of the smarticles [s] (ranks)")
    parser.add_argument("--fidelity", default="standard", help="draft, standard, reference")
    parser.add_argument("--out", type=Path, default=None, help="folder for runs and tables (default: a new one)")
    given = parser.parse_args()
    folder = folder_of("lammps", given.out)
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, {' '.join(sys.argv)}")
    if given.what == "agree":
        agree(folder, given)
    else:
        ranks(folder, given.counts, given.repeats, given.fidelity, given.fall)


if __name__ == "__main__":
    main()
