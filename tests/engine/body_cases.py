"""Bodies of any shape on YADE, in a process of its own; see `cases.py`."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
from stopping import run_until

from dem.body.placement import Poses
from dem.engine.yade.engine import YadeEngine
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.run.run import run_scene
from dem.scene.reading import load_scene
from validation.bench import scene_of


def clumps(data: dict[str, Any]) -> dict[str, Any]:
    """Mass, principal moments and rotation of one body of each kind, as YADE has them."""
    scene = scene_of(data)
    engine = build_engine(scene, time_step(scene))
    assert isinstance(engine, YadeEngine)
    assert scene.mixture is not None
    kinds = np.arange(len(scene.mixture.kinds))
    turns = tuple(Rotation.from_rotvec([0.3 * k, 0.5, -0.2 * k]) for k in kinds)
    engine.add(Poses(np.array([[0.0, 0.0, 0.05 * (k + 1)] for k in kinds]), turns, kinds))
    states = [engine._omega.bodies[body].state for body in engine._assembly.bodies]
    state = engine.state().bodies
    assert state is not None
    return {
        "kinds": kinds,
        "masses": [body.mass for body in states],
        "moments": [np.array([body.inertia[d] for d in range(3)]) for body in states],
        "rotations": [turn.as_matrix().T @ found for turn, found in zip(turns, state.rotations, strict=True)],
    }


def run(file: str, out: str, how: str = "") -> None:
    """Run a scene to its end, to a time, or from its last checkpoint on."""
    scene, options = load_scene(Path(file)), {"command": ""}
    if how in ("", "resume"):
        run_scene(scene, Path(out), resume=how == "resume", **options)
        return
    run_until(scene, Path(out), float(how))
