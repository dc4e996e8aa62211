"""Piles poured once, simulations in processes of their own one after the other, and what is measured of each."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.child import run_child
from benchmarks.rivals.given import CREEP
from benchmarks.rivals.overlap import deepest
from benchmarks.rivals.settings import ACTIVITIES, ENGINES, Setting
from benchmarks.rivals.solids import solid_of
from dem.body.state import State
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene
from postprocess import packing_fraction

Array = NDArray[np.float64]

# A round bar as thick as the section's diagonal: only corners at the barbs' tips reach out of it, so that the pile
# overlaps in no engine by much, whatever its shapes. Thinner ones settle a little before anything is measured.
POUR_DIAMETER = 1.37e-3  # m
POUR: Mapping[str, Any] = {"engine": "links", "fidelity": {"base": "standard", "diameter_m": POUR_DIAMETER}}
PAPER_COUNT, PAPER_RADIUS, PAPER_PER_LAYER = 270, 0.0234, 10
REST = 0.3  # s before the activity

COUNT, SECONDS = "N [1]", "activity [s]"
COST, STEP, MEMORY = "cost [s/s]", "dt [s]", "peak memory [MiB]"
DEPTH, MEAN_DEPTH, BOX_DEPTH = "deepest overlap [m]", "deepest overlap, mean of looks [m]", "of the true boxes [m]"
PHI_REST, PHI_END = "phi at rest [1]", "phi at the end [1]"
SINKING = "sinks at rest [m/s]"


def pour(folder: Path, *, count: int, seed: int) -> Path:
    """A pile at rest, poured on links, as a run directory; kept where it is there already."""
    name = f"pile-{count}-{seed}"
    if not (folder / name / "done.json").exists():
        phases = [{"type": "deposit", "per_layer": PAPER_PER_LAYER}, {"type": "relax", "duration_s": 0.3}]
        run_child(folder, name, {**_common(count, seed), **POUR, "phases": phases})
    return folder / name


def _common(count: int, seed: int) -> dict[str, Any]:
    radius = PAPER_RADIUS * (count / PAPER_COUNT) ** 0.5
    return {
        "schema_version": 1,
        "name": "beside the rivals",
        "seed": seed,
        "count": count,
        "container": {"radius_m": max(radius, 0.012)},
    }


def scene_of(
    setting: Setting, activity: str, pile: Path, *, count: int, seed: int, seconds: float, look: float, account: bool
) -> dict[str, Any]:
    """The scene of a setting: take over, rest, act."""
    recording = {"frame_interval_s": look, "series_interval_s": look, "checkpoint_interval_s": None}
    if account:
        recording["dissipation_interval_s"] = look
    phases = [
        {"type": "take-over", "run": str(pile.absolute())},
        {"type": "relax", "duration_s": REST},
        {"type": activity, "duration_s": seconds, **ACTIVITIES[activity]},
    ]
    return {**_common(count, seed), "engine": "links", **setting.scene, "phases": phases, "recording": recording}


def run(
    folder: Path,
    setting: Setting,
    activity: str,
    pile: Path,
    *,
    count: int,
    seed: int,
    seconds: float,
    look: float,
    account: bool = False,
) -> dict[str, Any]:
    """Simulate in a process of its own and measure; a row of the table.

    Raises:
        subprocess.CalledProcessError: it failed; what it said is on stderr.
    """  # fmt: skip
    name = f"{setting.key}-{activity}-{count}-{seed}" + ("-account" if account else "")
    place = folder / name
    place.mkdir(exist_ok=True)
    scene = scene_of(setting, activity, pile, count=count, seed=seed, seconds=seconds, look=look, account=account)
    task = place / "task.json"
    task.write_text(
        json.dumps({"engine": setting.engine, "knobs": dict(setting.knobs), "scene": scene, "look_s": look}),
        encoding="utf-8",
    )
    one_thread = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS")}
    subprocess.run(
        [sys.executable, "-m", "benchmarks.rivals.child", str(task)], check=True, env={**os.environ, **one_thread}
    )
    told = json.loads(task.with_suffix(".told.json").read_text(encoding="utf-8"))
    with np.load(task.with_suffix(".npz")) as poses:
        found = measured(parse_scene(scene, source=str(place)), setting.shape, poses["positions"], poses["frames"])
    return {
        "engine": ENGINES[setting.engine].title,
        "setting": setting.name,
        "activity": activity,
        COUNT: count,
        "seed": seed,
        SECONDS: seconds,
        COST: told["processor_s"] / seconds,
        STEP: told["time_step_s"],
        **found,
        MEMORY: told["memory_MiB"],
        "version": told["version"],
        **told["more"],
    }


def measured(scene: Scene, shape: str, positions: Array, frames: Array) -> dict[str, float]:
    """Overlaps and packing of what a simulation gave, see `benchmarks.rivals.given.Outcome`."""
    poses = list(zip(positions, frames, strict=True))
    before, rested, *acting = poses
    looks = [[deepest(solid_of(kind, scene.particle, *pose)) for kind in (shape, "boxes")] for pose in acting]
    depths = np.array(looks)
    sunk = float((before[0] - rested[0])[..., 2].mean())
    return {
        DEPTH: float(depths[:, 0].max()),
        MEAN_DEPTH: float(depths[:, 0].mean()),
        BOX_DEPTH: float(depths[:, 1].max()),
        PHI_REST: packed(scene, *rested),
        PHI_END: float(np.mean([packed(scene, *pose) for pose in acting[-max(1, len(acting) // 4) :]])),
        SINKING: sunk / CREEP,
    }


def packed(scene: Scene, positions: Array, frames: Array) -> float:
    """φ by the second-highest centre of mass [1], of the poses of links."""
    boxes, still = scene.particle.boxes, np.zeros_like(positions)
    vertices = State(boxes, positions, frames, still, still).vertices
    return packing_fraction(vertices, radius=scene.container.radius_m, solid_volume=boxes.volume).value
