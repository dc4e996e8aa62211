"""Engines of the bench beside the rivals: each adapter on a known answer; skipped where an engine is not installed."""

import importlib
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic import SyntheticRun, mesh_of, write_ending, write_manifest

from benchmarks.rivals import __main__ as bench
from benchmarks.rivals.settings import ENGINES, SETTINGS, SHAKE, Setting
from benchmarks.rivals.task import Outcome, Task
from dem.body.state import State
from dem.record.frames import FrameWriter
from dem.scene.reading import parse_scene

Array = NDArray[np.float64]

SAMPLE = 1e-3  # s
GAMMA, FREQUENCY = 2.0, 30.0
CHOSEN = {  # settings that are tried: stiff ones of others, which do not sink in
    "links": "standard",
    "lammps": "standard",
    "mujoco": "2e-4 s, CG 50, stiff",
    "bullet": "2e-4 s",
    "rapier": "2e-4 s, stiff",
}


def setting_of(engine: str) -> Setting:
    """One setting of an engine; skips the test where it is missing."""
    if ENGINES[engine].missing:
        pytest.skip(str(ENGINES[engine].missing))
    return next(each for each in SETTINGS if each.engine == engine and each.name == CHOSEN[engine])


def flat(folder: Path, height: float) -> Path:
    """A run that left one smarticle lying flat, its centre at a height [m]."""
    run = SyntheticRun(count=1, phases=("deposit", "relax"))
    folder.mkdir()
    write_manifest(folder, run)
    boxes = parse_scene({"schema_version": 1, "seed": 1, "count": 1, "phases": [{"type": "deposit"}]}, source="x")
    still = np.zeros((1, 3))
    place = np.array([[0.0, 0.0, height]])
    state = State.rigid(boxes.body.boxes, place, np.eye(3)[None], still, still)
    FrameWriter(folder).write(mesh_of(state.vertices, phase=1), 0.0)
    write_ending(folder, run.phases, [(0, 1), (1, 2)], status="done", wall=1.0)
    return folder


def simulated(engine: str, folder: Path, seconds: float) -> Outcome:
    """Shake one smarticle, put down from 0.1 mm; contacts hardly spring back, as those of the other engines."""
    setting = setting_of(engine)
    pile = flat(folder / "pile", 0.735e-3)
    scene = bench.scene_of(setting, SHAKE, pile, count=1, seed=1, seconds=seconds, sample=SAMPLE)
    scene["contact"] = {"restitution": 0.01}
    scene["container"] = {"radius_m": 0.0234}
    scene["phases"][-1]["peak_acceleration_g"] = GAMMA
    module = importlib.import_module(f"benchmarks.rivals.{ENGINES[engine].module}")
    outcome: Outcome = module.simulate(Task(parse_scene(scene, source="x"), folder, SAMPLE), setting.knobs)
    return outcome


def flight(times: Array) -> tuple[Array, float]:
    """Height over a shaken floor [m] of what does not spring back and lies on it at first, until it lands; and when."""
    omega, gravity = 2 * math.pi * FREQUENCY, 9.81
    amplitude = GAMMA * gravity / omega**2
    leaves = math.asin(1 / GAMMA) / omega

    def above(t: Array) -> Array:
        since = t - leaves
        start, speed = amplitude * math.sin(omega * leaves), amplitude * omega * math.cos(omega * leaves)
        found: Array = start + speed * since - gravity * since**2 / 2 - amplitude * np.sin(omega * t)
        return found

    fine = np.linspace(leaves + 1e-3, 0.05, 100_000)
    lands = float(fine[np.argmax(above(fine) < 0)])
    return np.where((times > leaves) & (times < lands), above(times), 0.0), lands


@pytest.mark.parametrize("engine", CHOSEN)
def test_a_smarticle_is_thrown_as_far_as_theory_says(engine: str, tmp_path: Path) -> None:
    found = simulated(engine, tmp_path, 0.03)
    heights = found.positions[:, 0, 1, 2]
    times = SAMPLE * np.arange(1, len(heights) - 1)
    expected, lands = flight(times)
    assert expected.max() > 5e-4
    assert lands > 0.02
    flying = times < lands - SAMPLE
    assert np.abs(heights[2:] - heights[1] - expected)[flying].max() < 0.05 * expected.max()
