"""Chains in a plane: small simulations with a known answer; see `cases.py`."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.chain import Tie
from dem.engine.yade.engine import YadeEngine
from dem.physics.contact import StringLaw
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.scene.scene import Scene
from validation.bench import add, scene_of


def single(data: dict[str, Any], rotation: Rotation) -> tuple[Scene, YadeEngine]:
    """One smarticle alone in the plane, its motors holding; its barb tips lie on the x-axis unless it is turned."""
    scene = scene_of(data)
    engine = build_engine(scene, time_step(scene))
    add(engine, (0, -scene.body.boxes.vertices[0, 1], 0), rotation)
    engine.motors.articulate()
    return scene, engine


def hold(engine: YadeEngine, scene: Scene, seconds: float) -> None:
    """Let motors hold their commands for a time, with a control update per step, as phases do."""
    interval = scene.fidelity.control_interval_s
    for _ in range(round(seconds / interval)):
        engine.motors.actuate(engine.motors.readings.commands[None], interval)
        engine.advance(1)


def pulled_apart(data: dict[str, Any], *, speed: float, moments: list[float]) -> list[dict[str, float]]:
    """Both barb tips of one smarticle pulled apart by strings; torque by geometry and angle at some moments [s]."""
    scene, engine = single(data, Rotation.identity())
    half = scene.body.boxes.barb_length / 2
    law = StringLaw(length=0.1, stiffness=5000.0, damping=1.0)
    engine.strings.tie([Tie(0, 0, half), Tie(0, 2, half)], law, (speed, speed))
    found, now = [], 0.0
    for moment in moments:
        hold(engine, scene, moment - now - 0.01)
        before, opened = engine.strings.sums, engine.state().angles
        hold(engine, scene, 0.01)
        now, state = moment, engine.state()
        force = (engine.strings.sums - before)[1] / round(0.01 / engine.time_step)
        lever = state.vertices[0, 3] - state.vertices[0, 2]
        middle = (opened[0, 1] + state.angles[0, 1]) / 2
        found.append(
            {
                # In the middle of the time over which the force is a mean.
                "opened": float(np.pi / 2 - middle),
                "rate": float(opened[0, 1] - state.angles[0, 1]) / 0.01,
                "torque": float(np.cross(lever, force)[2]) * -1,
                "asymmetry": float(np.ptp(state.angles)),
            }
        )
    return found
