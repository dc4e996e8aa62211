"""LAMMPS beside the other engines, and its ranks beside each other: `python -m benchmarks.lammps agree | ranks`.

`agree` pours piles on links, and has each engine take them over, rest and shake: φ at rest, φ and ⟨N⟩ while shaken.
`ranks` puts smarticles into a wide container, lets them come down, saves them, and times the same steps from there on
one rank and on two, again and again: of every stretch of steps the least time counts, as near to an idle machine as a
shared one allows. Two ranks need both cores to be free at once.
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
STRETCH, STRETCHES = 10, 8  # steps, and how many such


def scene_data(engine: str, seed: int, count: int, fidelity: str, *phases: dict[str, Any]) -> dict[str, Any]:
    """Return the data of a pile of the paper's smarticles, l/w = 0.7."""
    keys = {"name": "lammps", "engine": engine, "fidelity": fidelity, "seed": seed, "count": count}
    recording = {"frame_interval_s": 0.04, "checkpoint_interval_s": None}
    return {"schema_version": 1, **keys, "phases": list(phases), "recording": recording}


def measured(run: Path) -> dict[str, float]:
    """Average at rest and over the second half of the shaking."""
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
    """Give the same poses to every engine."""
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
    """Let smarticles come down for a time [s], and save them."""
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
    """Find the least wall times of the same steps on one rank and on two."""
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
            for _ in range(STRETCHES):
                begun = time.monotonic()
                engine.advance(STRETCH)
                took.append(time.monotonic() - begun)
            engine.child.close()
            least[number] = np.minimum(least.get(number, np.inf), took)
        steps = STRETCH * STRETCHES
        one, two = (1e6 * least[number].sum() / steps / count for number in (1, 2))
        rows.append(
            {"N": count, "one rank [us per step and smarticle]": one, "two ranks": two, "faster [-]": one / two}
        )
        print(rows[-1], flush=True)
    pd.DataFrame(rows).to_csv(folder / "ranks.csv", index=False)


def main() -> None:
    """Measure, and print tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lammps", description=__doc__)
    parser.add_argument("what", choices=("agree", "ranks"))
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5, 6], help="one pile each (agree)")
    parser.add_argument("--count", type=int, default=60, help="smarticles of a pile (agree)")
    parser.add_argument("--shake", type=float, default=1.0, help="length of the shaking [s] (agree)")
    parser.add_argument("--counts", type=int, nargs="+", default=[500, 1000, 5000], help="smarticles (ranks)")
    parser.add_argument("--repeats", type=int, default=5, help="times that the same steps are timed (ranks)")
    parser.add_argument("--fall", type=float, default=0.25, help="time to come down [s] (ranks)")
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
