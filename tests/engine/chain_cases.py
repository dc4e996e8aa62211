"""Chains in a plane: small simulations whose answer is known, run as those of `cases.py` are."""

from __future__ import annotations

from typing import Any

import numpy as np
from cases import add
from scipy.spatial.transform import Rotation

from dem.body.chain import Tie
from dem.engine.yade.engine import YadeEngine
from dem.phases.arrange import chain_of
from dem.physics.strings import StringLaw
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.scene.scene import Scene
from validation.bench import scene_of

TURNED = Rotation.from_rotvec([0.0, 0.0, 0.3])


def build(scene: Scene) -> YadeEngine:
    return build_engine(scene, time_step(scene))


def single(data: dict[str, Any], rotation: Rotation) -> tuple[Scene, YadeEngine]:
    """One smarticle alone in the plane, its motors holding; its barb tips lie on the x-axis unless it is turned."""
    scene = scene_of(data)
    engine = build(scene)
    add(engine, (0, -scene.particle.boxes.vertices[0, 1], 0), rotation)
    engine.motors.articulate()
    return scene, engine


def hold(engine: YadeEngine, scene: Scene, seconds: float) -> None:
    """Let motors hold their commands for a time; one look per step, as the phases do."""
    interval = scene.fidelity.control_interval_s
    for _ in range(round(seconds / interval)):
        engine.motors.actuate(engine.motors.readings.commands[None], interval)
        engine.advance(1)


def pulled_apart(data: dict[str, Any], *, speed: float, moments: list[float]) -> list[dict[str, float]]:
    """Both barb tips of one smarticle pulled apart by strings; torque by geometry and angle at some moments [s]."""
    scene, engine = single(data, Rotation.identity())
    half = scene.particle.boxes.barb_length / 2
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


def swing(data: dict[str, Any], *, turn: float, seconds: float) -> dict[str, Any]:
    """A free smarticle whose motors are suddenly off their barbs: energies step by step."""
    scene, engine = single(data, TURNED)
    engine.motors.deciding.commands = engine.motors.deciding.commands + np.array([turn, 0.6 * turn])
    stiffness, hinges = scene.motor.stiffness_N_m_per_rad, engine._assembly.hinges
    energies, interval = [], scene.fidelity.control_interval_s
    for _ in range(round(seconds / interval)):
        engine.motors.actuate(engine.motors.readings.commands[None], interval)
        engine.advance(1)
        # Velocities are half a step behind the angles: with those at the step's beginning the springs are as much late.
        twisted = engine.motors.readings.commands - hinges.angles()
        energies.append(engine.state().kinetic_energy + 0.5 * stiffness * (twisted**2).sum() + hinges.elastic_energy())
    state = engine.state()
    return {
        "begun": 0.5 * stiffness * turn**2 * (1 + 0.36),
        "energies": np.array(energies),
        "momentum": state.momentum,
        "angular_momentum": state.angular_momentum,
        "gap": float(engine.motors.gaps().max()),
    }


def strained(data: dict[str, Any], *, strain: float) -> dict[str, Any]:
    """A chain strained by the phase itself: how far it has left the plane, and its angles."""
    scene = scene_of(data)
    engine = build(scene)
    scene.phases[0].begin(scene, 0).proceed(engine)
    stage = scene.phases[1].begin(scene, 1)
    first = chain_of(scene).length
    while wait := stage.proceed(engine):
        engine.advance(max(1, round(wait / engine.time_step)))
        if np.ptp(engine.strings.ties[:, 0]) > (1 + strain) * first:
            break
    state = engine.state()
    return {
        "heights": np.abs(state.link_positions[..., 2]).max(),
        "tilts": np.abs(state.link_rotations[..., 2, :2]).max(),
        "turns": np.abs(state.link_spins[..., :2]).max(),
        "angles": state.angles,
        "steps": engine.steps,
    }


def bodies(data: dict[str, Any]) -> dict[str, int]:
    """What exists of plane and strings in a scene."""
    engine = build(scene_of(data))
    return {
        "felt": len(engine.fixtures.felt),
        "container": len(engine.fixtures.container),
        "strings": int(engine.strings.tied),
    }
