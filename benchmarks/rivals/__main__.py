"""Compare our engines with others: `python -m benchmarks.rivals`.

One pile per seed is poured on links. Every engine starts from the poses of this pile, lets it rest, and shakes it at
Γ = 2 and 30 Hz, or swings the barbs by 10° if it has motors. Every simulation is a separate process on one thread. The
processor time of the activity is measured. `rivals.csv` has one row per simulation; a later call with the same `--out`
continues the table. Medians over seeds are written to `rivals_medians.csv` and drawn. Engines that are not installed
are skipped.
"""

import argparse
import importlib
import json
import os
import platform
import resource
import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.rivals.overlap import deepest, solid_of
from benchmarks.rivals.settings import ACTIVITIES, ENGINES, SETTINGS, Setting
from benchmarks.rivals.task import CREEP, Task
from benchmarks.runs import PAPER_PER_LAYER, folder_of, pile, run_child
from dem.body.state import State
from dem.run.run import versions
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from postprocess import packing_fraction

Array = NDArray[np.float64]

SAMPLE = 0.01  # time between two samples of the poses [s]; three per period at 30 Hz
REST = 0.3  # rest before the activity [s]
# The piles are poured with round bars as thick as the diagonal of the section, so that the shapes of no engine overlap
# much at the start. Engines with thinner shapes let the pile settle during the rest.
POUR = {"engine": "links", "fidelity": {"base": "standard", "diameter_m": 1.37e-3}}
KEYS = ["activity", "engine", "setting"]
COST, STEP, MEMORY = "cost [s/s]", "dt [s]", "peak memory [MiB]"
DEPTH, MEAN_DEPTH, BOX_DEPTH = "deepest overlap [m]", "deepest overlap, mean of samples [m]", "of the true boxes [m]"
PHI_REST, PHI_END, SINKING = "phi at rest [1]", "phi at the end [1]", "sinks at rest [m/s]"
SAME, TENTH = "links at this overlap are cheaper by [1]", "links at a tenth of it are cheaper by [1]"


def data_of(count: int, seed: int, *phases: dict[str, Any], **keys: Any) -> dict[str, Any]:
    """Return a scene as a dictionary: a pour of `count` smarticles, then the given phases.

    The container's radius is at least 12 mm, which leaves room for moving barbs. `keys` are other keys of the scene.
    """
    data = pile(count, *phases, seed=seed, per_layer=PAPER_PER_LAYER, **keys)
    data["container"]["radius_m"] = max(data["container"]["radius_m"], 0.012)
    return data


def scene_of(
    setting: Setting, activity: str, poured: Path, *, count: int, seed: int, seconds: float, sample: float
) -> dict[str, Any]:
    """Return the scene of a setting as a dictionary: take-over of a poured pile, rest and activity.

    The pile was poured in the run directory `poured`. The activity lasts `seconds`, frames are `sample` apart [s].
    """
    recording = {"frame_interval_s": sample, "series_interval_s": sample, "checkpoint_interval_s": None}
    data = {**data_of(count, seed, recording=recording), "engine": "links", **setting.scene}
    data["phases"] = [
        {"type": "take-over", "run": str(poured.absolute())},
        {"type": "relax", "duration_s": REST},
        {"type": activity, "duration_s": seconds, **ACTIVITIES[activity]},
    ]
    return data


def perform(task: Path) -> None:
    """Simulate the task in the file `task`, a JSON file that `run` wrote, in this process.

    Poses are written next to the file, to `task.npz`; time step, costs and version to `task.row.json`. `run` calls
    this in a process of its own because YADE and PyVista must not be loaded together, and to measure memory.
    """
    content = json.loads(task.read_text(encoding="utf-8"))
    module = importlib.import_module(f"benchmarks.rivals.{ENGINES[content['engine']].module}")
    scene = parse_scene(content["scene"], source=str(task))
    outcome = module.simulate(Task(scene, task.parent, content["sample_s"]), content["knobs"])
    np.savez(task.with_suffix(".npz"), positions=outcome.positions, frames=outcome.frames)
    used = [resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    # Memory of the child process, if the engine is a separate program.
    row = {"processor_s": outcome.processor_s, STEP: outcome.time_step, MEMORY: (used[1] or used[0]) / 1024}
    row["version"] = outcome.version
    task.with_suffix(".row.json").write_text(json.dumps(row), encoding="utf-8")


def run(folder: Path, setting: Setting, activity: str, seed: int, given: argparse.Namespace) -> Any:
    """Simulate a setting in a separate process; return its row of the table, without the columns of `planned`.

    Missing piles are poured first. `given` are the options of the command line; `count` and `seconds` are used.
    """
    count, seconds, poured = given.count, given.seconds, folder / f"pile-{given.count}-{seed}"
    if not (poured / "done.json").exists():
        run_child(folder, poured.name, data_of(count, seed, {"type": "relax", "duration_s": 0.3}, **POUR))
    directory = folder / f"{setting.key}-{activity}-{count}-{seed}"
    directory.mkdir(exist_ok=True)
    scene = scene_of(setting, activity, poured, count=count, seed=seed, seconds=seconds, sample=SAMPLE)
    task = directory / "task.json"
    content = {"engine": setting.engine, "knobs": dict(setting.knobs), "scene": scene, "sample_s": SAMPLE}
    task.write_text(json.dumps(content), encoding="utf-8")
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"), "1")
    command = [sys.executable, "-m", "benchmarks.rivals", "--task", str(task)]
    subprocess.run(command, check=True, env={**os.environ, **one_thread})
    row = json.loads(task.with_suffix(".row.json").read_text(encoding="utf-8"))
    with np.load(task.with_suffix(".npz")) as poses:
        found = measured(parse_scene(scene, source=str(directory)), setting.shape, poses["positions"], poses["frames"])
    cost = row.pop("processor_s") / seconds
    return {"N [1]": count, "activity [s]": seconds, COST: cost, **found, **row}


def measured(scene: Scene, shape: str, positions: Array, frames: Array) -> dict[str, float]:
    """Return overlaps [m], packing fractions and rate of sinking [m/s] of a simulation, by column.

    Contacts are those of the `shape` that the engine uses: "boxes", "strands" or "spheres". Centres (2 + F, N, 3, 3)
    [m] and axes (2 + F, N, 3, 3, 3), in columns, of the links are at the times that `Outcome.positions` states.
    """
    before, rested, *acting = zip(positions, frames, strict=True)
    depths = np.array([[deepest(solid_of(kind, scene.body, *pose)) for kind in (shape, "boxes")] for pose in acting])
    boxes, radius = scene.body.boxes, scene.container.radius_m

    def packed(positions: Array, frames: Array) -> float:
        still = np.zeros_like(positions)
        vertices = State(boxes, positions, frames, still, still).vertices
        return packing_fraction(vertices, radius=radius, solid_volume=boxes.volume).value

    return {
        DEPTH: float(depths[:, 0].max()),
        MEAN_DEPTH: float(depths[:, 0].mean()),
        BOX_DEPTH: float(depths[:, 1].max()),
        PHI_REST: packed(*rested),
        PHI_END: float(np.mean([packed(*pose) for pose in acting[-max(1, len(acting) // 4) :]])),
        SINKING: float((before[0] - rested[0])[..., 2].mean()) / CREEP,
    }


def planned(engines: Sequence[str], given: argparse.Namespace) -> Iterator[tuple[Setting, dict[str, Any]]]:
    """Yield the simulations that the options select: setting, and first columns of the row of the table.

    The columns are `engine`, `setting`, `activity` and `seed`. Of the options `given`, `seeds` and `activities` are
    used.
    """
    for seed, setting in product(given.seeds, SETTINGS):
        if setting.engine in engines and not (setting.costly and seed != given.seeds[0]):
            for activity in filter(given.activities.__contains__, setting.activities):
                title = ENGINES[setting.engine].title
                yield setting, {"engine": title, "setting": setting.name, "activity": activity, "seed": seed}


def medians(rows: pd.DataFrame) -> pd.DataFrame:
    """Return medians over seeds per activity, engine and setting, and the cost relative to links.

    The last two columns compare each row with the engine `links` at the same activity. In the first, the row's cost is
    divided by that of the cheapest setting of `links` whose overlap is not larger than the row's. In the second, this
    overlap may be at most a tenth of the row's. NaN: `links` has no such setting.
    """
    columns = [COST, STEP, DEPTH, MEAN_DEPTH, BOX_DEPTH, PHI_REST, PHI_END, SINKING, MEMORY]
    groups = rows.groupby(KEYS, sort=False)
    table = groups[columns].median().assign(**{"seeds [1]": groups["seed"].nunique()}).reset_index()
    links = table[table["engine"] == "links"]
    for column, share in ((SAME, 1.0), (TENTH, 0.1)):
        table[column] = [
            row[COST] / links[(links["activity"] == row["activity"]) & (links[DEPTH] <= share * row[DEPTH])][COST].min()
            for row in table.to_dict("records")
        ]
    return table


def draw(path: Path, table: pd.DataFrame) -> None:
    """Draw cost against overlap, with one panel per activity."""
    activities = list(table["activity"].unique())
    figure = Figure(figsize=(4.0 * len(activities), 4.0), layout="constrained")
    panels = figure.subplots(1, len(activities), sharey=True, squeeze=False)[0]
    for axes, activity in zip(panels, activities, strict=True):
        for engine, own in table[table["activity"] == activity].groupby("engine", sort=False):
            axes.loglog(1e3 * own[DEPTH], own[COST], "o", label=engine)
        axes.set(title=activity, xlabel="deepest overlap [mm]", ylabel="processor time per simulated time [s/s]")
        axes.legend()
    figure.savefig(path, dpi=200)


def main() -> int:
    """Run all simulations; write tables, figure and origin; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rivals", description=__doc__)
    parser.add_argument("--engines", nargs="+", choices=ENGINES, default=list(ENGINES), help="(default: all)")
    parser.add_argument("--activities", nargs="+", choices=ACTIVITIES, default=list(ACTIVITIES))
    parser.add_argument("--count", type=int, default=270, help="smarticles (default: %(default)s)")
    parser.add_argument(
        "--seconds", type=float, default=0.4, help="duration of the activity [s] (default: %(default)s)"
    )
    parser.add_argument(
        "--seeds", type=int, nargs="+", default=[1, 2, 3], help="seeds of the piles; slow settings use the first only"
    )
    parser.add_argument("--out", type=Path, help="folder (default: a new one); continued if it exists")
    parser.add_argument("--task", type=Path, help="simulate this task file in this process")
    given = parser.parse_args()
    if given.task:
        perform(given.task)
        return 0
    folder = folder_of("rivals", given.out)
    missing = {engine: ENGINES[engine].missing for engine in given.engines}
    print(*filter(None, missing.values()), sep="\n")
    path = folder / "rivals.csv"
    rows = pd.read_csv(path).to_dict("records") if path.exists() else []
    for setting, keys in planned([engine for engine, reason in missing.items() if not reason], given):
        if any(all(row[key] == value for key, value in keys.items()) for row in rows):
            continue
        try:
            found = run(folder, setting, keys["activity"], keys["seed"], given)
        except subprocess.CalledProcessError as error:
            print(f"{keys}: failed, status {error.returncode}")
            continue
        rows.append({**keys, **found})
        pd.DataFrame(rows).to_csv(path, index=False)
        print(f"{keys}: {found[COST]:8.2f} s/s, {1e3 * found[DEPTH]:.4f} mm deep", flush=True)
    if not rows:
        print("nothing was run", file=sys.stderr)
        return 1
    table = medians(pd.DataFrame(rows))
    table.to_csv(folder / "rivals_medians.csv", index=False, float_format="%.4g")
    origin = {"machine": platform.platform(), "command": " ".join(sys.argv), "versions": versions(("links", ""))}
    (folder / "rivals.json").write_text(json.dumps(origin, indent=2) + "\n", encoding="utf-8")
    draw(folder / "rivals.png", table)
    print(table.to_string(index=False, float_format=lambda x: f"{x:.3g}"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
