"""The same smarticles on an engine that a scene names; see `cases.py`."""

from __future__ import annotations

from typing import Any

import numpy as np

from dem.body.placement import place_layer
from dem.plan.steps import time_step
from dem.run.build import build_engine
from validation.bench import scene_of


def thrown(data: dict[str, Any], *, count: int, speed: float, steps: int, every: int) -> dict[str, Any]:
    """A layer of random poses thrown at the floor of a container that is shaken: vertices, touches at every look."""
    scene = scene_of(data)
    engine = build_engine(scene, time_step(scene))
    rng = np.random.default_rng(scene.seed)
    poses = place_layer(
        scene.particle, count=count, radius=0.012, bottom=3e-3, height=5e-3, obstacles=np.empty((0, 3)), rng=rng
    )
    engine.add(poses, speed=speed)
    vertices, touches = [np.array(engine.state().vertices)], []
    engine.boundaries.shake(amplitude=5e-4, frequency=30.0)
    for _ in range(steps // every):
        engine.advance(every)
        vertices.append(np.array(engine.state().vertices))
        touches.append(int(engine.touches().sum()))
    return {
        "vertices": np.array(vertices),
        "touches": touches,
        "diameter": scene.sphere_diameter,
        "floor": engine.boundaries.floor,
        "time": engine.time,
        "impulse": engine.impulse,
    }
