"""Single impacts: rebound, bars end to end, a smarticle on its tip."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from dem.engine.interface import Engine
from dem.physics.contact import ContactLaw, typical_effective_mass
from dem.plan.steps import time_step
from validation.bench import UPRIGHT, Array, add, ball_law, law_of, scene
from validation.check import Answer
from validation.engines import BALL_MASS, BALL_RADIUS, STIFFNESS, EngineAccess
from validation.known.theory import dashpot_impact

CONTACT_TIME = math.pi * math.sqrt(BALL_MASS / STIFFNESS)  # s, of an elastic ball on the floor
RESOLVED = 400  # steps in an elastic contact
ONSET = f"contact begins and ends within a step, 1/{RESOLVED} of its duration"


@dataclass(frozen=True)
class Touch:
    """What was seen from the first step with a contact force on the floor to the last.

    Args:
        velocity: (3,) after [m/s].
        spin: (3,) after [rad/s].
        steps: with a force [1].
        deepest: largest overlap of the lowest point of the first sphere [m].
    """

    velocity: Array
    spin: Array
    steps: int
    deepest: float


def touch(access: EngineAccess, engine: Engine, *, most: int) -> Touch:
    """Advance until a body has met the floor and left it again.

    Args:
        access: on the engine.
        engine: with one welded body on its way down.
        most: steps to give up after.
    """
    pressed, deepest = 0, 0.0
    for _ in range(most):
        engine.advance(1)
        if access.floor_force(engine)[2]:
            pressed += 1
            state = engine.state()
            deepest = max(deepest, engine.particle.radius - float(state.spheres(engine.particle)[0, :, 2].min()))
        elif pressed:
            break
    state = engine.state()
    return Touch(state.velocities[0], state.link_spins[0, 1], pressed, deepest)


def ball_impact(access: EngineAccess, law: ContactLaw, *, speed: float, slip: float = 0.0, dt: float) -> Touch:
    """A ball meets the floor at a speed downwards, and `slip` along x [m/s]; no gravity."""
    engine = access.build(access.ball(), law, dt=dt)
    add(engine, (0, 0, BALL_RADIUS + 3.3 * speed * dt), access.ball_turn)
    access.push(engine, 0, velocity=(slip, 0, -speed))
    return touch(access, engine, most=10 * RESOLVED)


def elastic_rebound(access: EngineAccess) -> list[Answer]:
    """A ball on an elastic floor."""
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    found = ball_impact(access, ball_law(), speed=speed, dt=dt)
    return [
        Answer(
            quantity="contact time",
            unit="s",
            theory=CONTACT_TIME,
            measured=found.steps * dt,
            tolerance=2 / RESOLVED,
            reason="counted in whole steps",
        ),
        Answer(
            quantity="largest overlap",
            unit="m",
            theory=speed * math.sqrt(BALL_MASS / STIFFNESS),
            measured=found.deepest,
            tolerance=1e-4,
            reason="second order: (ω dt)²/8 and what the onset within a step costs",
        ),
        Answer(
            quantity="rebound speed",
            unit="m/s",
            theory=speed,
            measured=float(found.velocity[2]),
            tolerance=1e-4,
            reason="second order: the force grows from zero at the onset within a step",
        ),
    ]


def damped_rebound(access: EngineAccess, restitution: float) -> list[Answer]:
    """A ball whose dashpot is sized for the restitution asked for."""
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    law = ball_law(restitution=restitution)
    found = ball_impact(access, law, speed=speed, dt=dt)
    exact = dashpot_impact(stiffness=STIFFNESS, damping=law.wall_damping, mass=BALL_MASS)
    return [
        Answer(
            quantity="restitution, against the one asked for",
            unit="1",
            theory=restitution,
            measured=float(found.velocity[2]) / speed,
            tolerance=0.01,
            reason=f"first order: the dashpot acts at once, but {ONSET}",
        ),
        Answer(
            quantity="restitution, against the integrated impact",
            unit="1",
            theory=exact.restitution,
            measured=float(found.velocity[2]) / speed,
            tolerance=0.01,
            reason=f"first order: the dashpot acts at once, but {ONSET}",
        ),
        Answer(
            quantity="contact time",
            unit="s",
            theory=exact.duration,
            measured=found.steps * dt,
            tolerance=2 * dt / exact.duration + 0.01,
            reason="counted in whole steps, and first order",
        ),
    ]


def pair_rebound(access: EngineAccess, restitution: float) -> list[Answer]:
    """Two balls meet head on in free space: the reduced mass is half of one."""
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    engine = access.build(access.ball(), ball_law(restitution=restitution), dt=dt)
    add(engine, (0, 0, 0.1), access.ball_turn)
    add(engine, (0, 0, 0.1 + 2 * BALL_RADIUS + 3.3 * speed * dt), access.ball_turn)
    access.push(engine, 0, velocity=(0, 0, speed / 4))
    access.push(engine, 1, velocity=(0, 0, -3 * speed / 4))
    engine.advance(4 * RESOLVED)
    after = engine.state().velocities
    return [
        Answer(
            quantity="restitution",
            unit="1",
            theory=restitution,
            measured=float(after[1, 2] - after[0, 2]) / speed,
            tolerance=0.01,
            reason=f"first order: the dashpot acts at once, but {ONSET}",
        ),
        Answer(
            quantity="momentum",
            unit="kg m/s",
            theory=-BALL_MASS * speed / 2,
            measured=float(BALL_MASS * after[:, 2].sum()),
            tolerance=1e-12,
            reason="rounding: forces come in pairs",
        ),
    ]


def bar_rebound(access: EngineAccess, restitution: float, *, resized: bool = False) -> list[Answer]:
    """An upright bar falls on its end: the force passes through the centre of mass, and the law is a scene's.

    Args:
        access: on the engine.
        restitution: that the scene asks for; it holds at the typical effective mass, not at the bar's [1].
        resized: whether to size the dashpots for the bar's mass, so that it holds here.
    """
    one = scene(access, smarticle={"aspect_ratio": 0}, contact={"restitution": restitution})
    law, mass, speed = law_of(one), one.smarticle.boxes.mass, 0.5
    if resized:
        scale = math.sqrt(mass / typical_effective_mass(one.particle))
        law = dataclasses.replace(law, wall_damping=law.wall_damping * scale)
    engine = access.build(one.particle, law, dt=time_step(one) / 8)
    add(engine, (0, 0, one.smarticle.middle_length_m / 2 + 1e-5), UPRIGHT)
    access.push(engine, 0, velocity=(0, 0, -speed))
    found = touch(access, engine, most=10 * RESOLVED)
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.wall_damping, mass=mass)
    return [
        Answer(
            quantity="restitution",
            unit="1",
            theory=restitution if resized else exact.restitution,
            measured=float(found.velocity[2]) / speed,
            tolerance=0.03 if resized else 0.01,
            reason="contact begins and ends within a step, which is some 1/150 of it",
        ),
        Answer(
            quantity="spin",
            unit="rad/s",
            theory=0.0,
            measured=float(np.abs(found.spin).max()),
            tolerance=1e-9,
            reason="rounding: the force passes through the centre of mass",
            scale=speed / one.smarticle.middle_length_m,
        ),
    ]


def bars_rebound(access: EngineAccess, restitution: float) -> list[Answer]:
    """Two upright bars in free space, end to end, with a scene's law."""
    one = scene(access, smarticle={"aspect_ratio": 0}, contact={"restitution": restitution})
    law, mass, speed = law_of(one), one.smarticle.boxes.mass, 0.5
    engine = access.build(one.particle, law, dt=time_step(one) / 8)
    add(engine, (0, 0, 0.05), UPRIGHT)
    add(engine, (0, 0, 0.05 + one.smarticle.middle_length_m + 1e-4), UPRIGHT)
    access.push(engine, 0, velocity=(0, 0, speed / 2))
    access.push(engine, 1, velocity=(0, 0, -speed / 2))
    engine.advance(math.ceil((2e-4 / speed + 0.004) / engine.time_step))
    after = engine.state().velocities[:, 2]
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.normal_damping, mass=mass / 2)
    return [
        Answer(
            quantity="restitution",
            unit="1",
            theory=exact.restitution,
            measured=float(after[1] - after[0]) / speed,
            tolerance=0.01,
            reason="contact begins and ends within a step, which is some 1/150 of it",
        ),
        Answer(
            quantity="momentum left",
            unit="kg m/s",
            theory=0.0,
            measured=float(mass * after.sum()),
            tolerance=1e-12,
            reason="rounding: forces come in pairs",
            scale=mass * speed,
        ),
    ]


# -- clump on its tip --------------------------------------------------------------------------------------------------


def tip_impact(access: EngineAccess, restitution: float, turn: Sequence[float]) -> list[Answer]:
    """A welded smarticle meets a smooth floor with one sphere.

    Args:
        access: on the engine.
        restitution: that the scene asks for [1].
        turn: rotation vector of its pose [rad].
    """
    one = scene(access, contact={"restitution": restitution, "friction_wall": 0})
    law, boxes, particle, speed = law_of(one), one.smarticle.boxes, one.particle, 0.02
    pose = Rotation.from_rotvec(turn)
    ends = pose.apply(access.ends(particle))
    heights, arm = np.sort(ends[:, 2]), ends[np.argmin(ends[:, 2])]
    lever = np.cross(arm, [0, 0, 1])
    turned = pose.apply(pose.inv().apply(lever) / boxes.inertia)
    felt = 1 / (1 / boxes.mass + lever @ turned)
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.wall_damping, mass=felt)
    dt = exact.duration / RESOLVED
    # One sphere alone: the next one is higher than the first one ever comes down.
    assert heights[1] - heights[0] > 3 * speed * exact.duration
    engine = access.build(particle, law, dt=dt)
    add(engine, (0, 0, -heights[0] + particle.radius + 3.3 * speed * dt), pose)
    access.push(engine, 0, velocity=(0, 0, -speed))
    found = touch(access, engine, most=4 * RESOLVED)
    impulse = (1 + exact.restitution) * felt * speed
    reason = f"{ONSET}; and the smarticle turns by some 1e-3 rad meanwhile"
    spin = impulse * turned
    # Seen along the spin of theory; what is across it is wrong altogether.
    along = spin / np.linalg.norm(spin)
    return [
        Answer(
            quantity="velocity upwards",
            unit="m/s",
            theory=impulse / boxes.mass - speed,
            measured=float(found.velocity[2]),
            tolerance=0.01,
            reason=reason,
            scale=impulse / boxes.mass,
        ),
        Answer(
            quantity="spin",
            unit="rad/s",
            theory=float(np.linalg.norm(spin)),
            measured=float(found.spin @ along),
            tolerance=0.01,
            reason=reason,
        ),
        Answer(
            quantity="spin across that of theory",
            unit="rad/s",
            theory=0.0,
            measured=float(np.linalg.norm(found.spin - (found.spin @ along) * along)),
            tolerance=0.01,
            reason=reason,
            scale=float(np.linalg.norm(spin)),
        ),
    ]
