"""Engines that are set up by hand: what no scene asks for, or what a scene refuses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.kind import YadeKind
from dem.errors import RunError
from dem.plan.steps import time_step
from dem.record.progress import Progress
from dem.run.build import build_recorder
from dem.run.recorder import Recorder
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

TILTED = Rotation.from_rotvec([0.4, 0.2, -0.7])


def load(data: dict[str, Any]) -> Scene:
    """A scene from plain data."""
    return parse_scene(data, source="case")


def watched(data: dict[str, Any], out: Path | str, *, dt: float | None = None) -> tuple[Scene, YadeEngine, Recorder]:
    """YadeEngine and recorder, watchdog included, as a run builds them; `dt` [s] by hand is not refused."""
    scene = load(data)
    Path(out).mkdir(parents=True, exist_ok=True)
    engine = YadeKind().build(scene, time_step(scene) if dt is None else dt)
    progress = Progress(Path(out), scene.count, show=False)
    return scene, engine, build_recorder(scene, Path(out), progress)


def look(engine: YadeEngine, recorder: Recorder) -> str | None:
    """What the recorder's next look says, contacts included; None: nothing."""
    recorder.watch_every = 1
    try:
        recorder.record(engine, 0)
    except RunError as error:
        return str(error)
    return None


def energy(engine: YadeEngine) -> float:
    """Kinetic, potential, and that of the springs of all contacts [J]."""
    state = engine.state()
    return state.kinetic_energy + state.potential_energy(engine.gravity, 0.0) + engine.account.elastic()[0]


def fastest(engine: YadeEngine) -> float:
    """Speed of the fastest link [m/s]."""
    return float(np.linalg.norm(engine.state().link_velocities, axis=-1).max())


def lying(scene: Scene) -> float:
    """Height [m] of the centre of mass of a smarticle that lies flat on the floor."""
    return float(scene.particle.radius - scene.particle.centres[:, 2].min())
