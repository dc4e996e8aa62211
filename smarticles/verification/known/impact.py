"""Single impacts: rebound, bars end to end, a smarticle on its tip."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.kind import contact_law_of
from dem.physics.contact import ContactLaw, typical_effective_mass
from dem.plan.steps import time_step
from smarticles.verification.answer import Check
from smarticles.verification.bench import (
    BALL_MASS,
    BALL_RADIUS,
    STIFFNESS,
    UPRIGHT,
    Array,
    G,
    add,
    ball,
    ball_law,
    build,
    push,
    scene,
)
from smarticles.verification.known.theory import bounced, dashpot_impact

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


def touch(engine: YadeEngine, *, most: int) -> Touch:
    """Advance until a body has met the floor and left it again.

    Args:
        engine: with one welded body on its way down.
        most: steps to give up after.
    """
    pressed, deepest = 0, 0.0
    for _ in range(most):
        engine.advance(1)
        if engine.container_force()[2]:
            pressed += 1
            state = engine.state()
            deepest = max(deepest, engine.particle.radius - float(state.spheres(engine.particle)[0, :, 2].min()))
        elif pressed:
            break
    state = engine.state()
    return Touch(state.velocities[0], state.link_spins[0, 1], pressed, deepest)


def ball_impact(law: ContactLaw, *, speed: float, slip: float = 0.0, dt: float) -> Touch:
    """A ball meets the floor at a speed downwards, and `slip` along x [m/s]; no gravity."""
    engine = build(ball(), law, dt=dt)
    add(engine, (0, 0, BALL_RADIUS + 3.3 * speed * dt))
    push(engine, 0, velocity=(slip, 0, -speed))
    return touch(engine, most=10 * RESOLVED)


def elastic_rebound() -> list[Check]:
    """A ball on an elastic floor."""
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    found = ball_impact(ball_law(), speed=speed, dt=dt)
    return [
        Check(
            quantity="contact time",
            unit="s",
            theory=CONTACT_TIME,
            measured=found.steps * dt,
            tolerance=2 / RESOLVED,
            reason="counted in whole steps",
        ),
        Check(
            quantity="largest overlap",
            unit="m",
            theory=speed * math.sqrt(BALL_MASS / STIFFNESS),
            measured=found.deepest,
            tolerance=1e-4,
            reason="second order: (ω dt)²/8 and what the onset within a step costs",
        ),
        Check(
            quantity="rebound speed",
            unit="m/s",
            theory=speed,
            measured=float(found.velocity[2]),
            tolerance=1e-4,
            reason="second order: the force grows from zero at the onset within a step",
        ),
    ]


def damped_rebound(restitution: float) -> list[Check]:
    """A ball whose dashpot is sized for the restitution asked for."""
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    law = ball_law(restitution=restitution)
    found = ball_impact(law, speed=speed, dt=dt)
    exact = dashpot_impact(stiffness=STIFFNESS, damping=law.wall_damping, mass=BALL_MASS)
    return [
        Check(
            quantity="restitution, against the one asked for",
            unit="1",
            theory=restitution,
            measured=float(found.velocity[2]) / speed,
            tolerance=0.01,
            reason=f"first order: the dashpot acts at once, but {ONSET}",
        ),
        Check(
            quantity="restitution, against the integrated impact",
            unit="1",
            theory=exact.restitution,
            measured=float(found.velocity[2]) / speed,
            tolerance=0.01,
            reason=f"first order: the dashpot acts at once, but {ONSET}",
        ),
        Check(
            quantity="contact time",
            unit="s",
            theory=exact.duration,
            measured=found.steps * dt,
            tolerance=2 * dt / exact.duration + 0.01,
            reason="counted in whole steps, and first order",
        ),
    ]


def pair_rebound(restitution: float) -> list[Check]:
    """Two balls meet head on in free space: the reduced mass is half of one."""
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    engine = build(ball(), ball_law(restitution=restitution), dt=dt)
    add(engine, (0, 0, 0.1))
    add(engine, (0, 0, 0.1 + 2 * BALL_RADIUS + 3.3 * speed * dt))
    push(engine, 0, velocity=(0, 0, speed / 4))
    push(engine, 1, velocity=(0, 0, -3 * speed / 4))
    engine.advance(4 * RESOLVED)
    after = engine.state().velocities
    return [
        Check(
            quantity="restitution",
            unit="1",
            theory=restitution,
            measured=float(after[1, 2] - after[0, 2]) / speed,
            tolerance=0.01,
            reason=f"first order: the dashpot acts at once, but {ONSET}",
        ),
        Check(
            quantity="momentum",
            unit="kg m/s",
            theory=-BALL_MASS * speed / 2,
            measured=float(BALL_MASS * after[:, 2].sum()),
            tolerance=1e-12,
            reason="rounding: forces come in pairs",
        ),
    ]


def bar_rebound(restitution: float, *, resized: bool = False) -> list[Check]:
    """An upright bar falls on its end: the force passes through the centre of mass, and the law is a scene's.

    Args:
        restitution: that the scene asks for; it holds at the typical effective mass, not at the bar's [1].
        resized: whether to size the dashpots for the bar's mass, so that it holds here.
    """
    one = scene(smarticle={"aspect_ratio": 0}, contact={"restitution": restitution})
    law, mass, speed = contact_law_of(one), one.smarticle.boxes.mass, 0.5
    if resized:
        scale = math.sqrt(mass / typical_effective_mass(one.particle))
        law = dataclasses.replace(law, wall_damping=law.wall_damping * scale)
    engine = build(one.particle, law, dt=time_step(one) / 8)
    add(engine, (0, 0, one.smarticle.middle_length_m / 2 + 1e-5), UPRIGHT)
    push(engine, 0, velocity=(0, 0, -speed))
    found = touch(engine, most=10 * RESOLVED)
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.wall_damping, mass=mass)
    return [
        Check(
            quantity="restitution",
            unit="1",
            theory=restitution if resized else exact.restitution,
            measured=float(found.velocity[2]) / speed,
            tolerance=0.03 if resized else 0.01,
            reason="contact begins and ends within a step, which is some 1/150 of it",
        ),
        Check(
            quantity="spin",
            unit="rad/s",
            theory=0.0,
            measured=float(np.abs(found.spin).max()),
            tolerance=1e-9,
            reason="rounding: the force passes through the centre of mass",
            scale=speed / one.smarticle.middle_length_m,
        ),
    ]


def bars_rebound(restitution: float) -> list[Check]:
    """Two upright bars in free space, end to end, with a scene's law."""
    one = scene(smarticle={"aspect_ratio": 0}, contact={"restitution": restitution})
    law, mass, speed = contact_law_of(one), one.smarticle.boxes.mass, 0.5
    engine = build(one.particle, law, dt=time_step(one) / 8)
    add(engine, (0, 0, 0.05), UPRIGHT)
    add(engine, (0, 0, 0.05 + one.smarticle.middle_length_m + 1e-4), UPRIGHT)
    push(engine, 0, velocity=(0, 0, speed / 2))
    push(engine, 1, velocity=(0, 0, -speed / 2))
    engine.advance(math.ceil((2e-4 / speed + 0.004) / engine.time_step))
    after = engine.state().velocities[:, 2]
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.normal_damping, mass=mass / 2)
    return [
        Check(
            quantity="restitution",
            unit="1",
            theory=exact.restitution,
            measured=float(after[1] - after[0]) / speed,
            tolerance=0.01,
            reason="contact begins and ends within a step, which is some 1/150 of it",
        ),
        Check(
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


def tip_impact(restitution: float, turn: Sequence[float]) -> list[Check]:
    """A welded smarticle meets a smooth floor with one sphere.

    Args:
        restitution: that the scene asks for [1].
        turn: rotation vector of its pose [rad].
    """
    one = scene(contact={"restitution": restitution, "friction_wall": 0})
    law, boxes, particle, speed = contact_law_of(one), one.smarticle.boxes, one.particle, 0.02
    pose = Rotation.from_rotvec(turn)
    heights = np.sort(pose.apply(particle.centres)[:, 2])
    arm = pose.apply(particle.centres)[np.argmin(pose.apply(particle.centres)[:, 2])]
    lever = np.cross(arm, [0, 0, 1])
    turned = pose.apply(pose.inv().apply(lever) / boxes.inertia)
    felt = 1 / (1 / boxes.mass + lever @ turned)
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.wall_damping, mass=felt)
    dt = exact.duration / RESOLVED
    # One sphere alone: the next one is higher than the first one ever comes down.
    assert heights[1] - heights[0] > 3 * speed * exact.duration
    engine = build(particle, law, dt=dt)
    add(engine, (0, 0, -heights[0] + particle.radius + 3.3 * speed * dt), pose)
    push(engine, 0, velocity=(0, 0, -speed))
    found = touch(engine, most=4 * RESOLVED)
    impulse = (1 + exact.restitution) * felt * speed
    reason = f"{ONSET}; and the smarticle turns by some 1e-3 rad meanwhile"
    spin = impulse * turned
    # Seen along the spin of theory; what is across it is wrong altogether.
    along = spin / np.linalg.norm(spin)
    return [
        Check(
            quantity="velocity upwards",
            unit="m/s",
            theory=impulse / boxes.mass - speed,
            measured=float(found.velocity[2]),
            tolerance=0.01,
            reason=reason,
            scale=impulse / boxes.mass,
        ),
        Check(
            quantity="spin",
            unit="rad/s",
            theory=float(np.linalg.norm(spin)),
            measured=float(found.spin @ along),
            tolerance=0.01,
            reason=reason,
        ),
        Check(
            quantity="spin across that of theory",
            unit="rad/s",
            theory=0.0,
            measured=float(np.linalg.norm(found.spin - (found.spin @ along) * along)),
            tolerance=0.01,
            reason=reason,
            scale=float(np.linalg.norm(spin)),
        ),
    ]


# -- ladders -----------------------------------------------------------------------------------------------------------

# The error varies with where in a step a contact begins and where it ends. Starts are spread over some steps, and
# stiffness by a tenth so that the one does not fix the other, both evenly (a plastic-number sequence).
PHASES = 16
SPREAD = 8e-5  # m


def _gap(number: int) -> float:
    return 1e-4 + SPREAD * (0.754878 * number % 1)


def _stiffer(law: ContactLaw, number: int) -> ContactLaw:
    factor = 1 + 0.1 * (0.569840 * number % 1)
    return dataclasses.replace(
        law,
        normal_stiffness=factor * law.normal_stiffness,
        tangential_stiffness=factor * law.tangential_stiffness,
    )


def _roots(squares: Array) -> list[float]:
    found: list[float] = np.sqrt(squares).tolist()
    return found


def bounce_errors(steps: Sequence[float], *, restitution: float, phases: int = 24) -> list[float]:
    """Error of the height of a ball after one bounce, root mean square over places of the onset in a step [m].

    Args:
        steps: [s].
        restitution: [1].
        phases: how many such places.
    """
    speed, time, squares = 0.2, 5.12e-3, np.zeros(len(steps))
    for number in range(phases):
        law, gap = _stiffer(ball_law(restitution=restitution), number), _gap(number)
        exact = bounced(
            gap=gap,
            speed=speed,
            time=time,
            stiffness=law.normal_stiffness,
            damping=law.wall_damping,
            mass=BALL_MASS,
            gravity=G,
        )
        for k, dt in enumerate(steps):
            engine = build(ball(), law, dt=dt, gravity=G)
            add(engine, (0, 0, BALL_RADIUS + gap))
            push(engine, 0, velocity=(0, 0, -speed + G * dt / 2))
            engine.advance(round(time / dt))
            squares[k] += (float(engine.state().positions[0, 2]) - BALL_RADIUS - exact) ** 2
    return _roots(squares / phases)


def _collided(law: ContactLaw, dt: float, gap: float, *, tilted: bool) -> Array:
    """(S, 3) spheres of two smarticles that have collided once [m]."""
    one = scene()
    engine = build(one.particle, law, dt=dt)
    add(engine, (0, 0, 0.1))
    tilt = [0.5, 0.2, 0.6] if tilted else [0, 0, 0.6]
    other = Rotation.from_rotvec(tilt)
    near = other.apply(one.particle.centres)
    # Above the first one along y, so near that the closest spheres touch after a way of a tenth of a millimetre.
    apart = near[None] - one.particle.centres[:, None]
    inside = 4 * one.particle.radius**2 - apart[..., 0] ** 2 - apart[..., 2] ** 2
    lift = float((np.sqrt(np.maximum(inside, 0.0)) - apart[..., 1])[inside > 0].max())
    speed = 0.2
    add(engine, (0, lift + gap, 0.1), other)
    push(engine, 1, velocity=(0, -speed, 0))
    engine.advance(round(5.12e-3 / dt))
    spheres: Array = engine.state().spheres(one.particle).reshape(-1, 3)
    return spheres


def collision_errors(steps: Sequence[float], *, smooth: bool, phases: int = PHASES) -> list[float]:
    """Error of where two smarticles are after they collided once [m].

    Args:
        steps: [s].
        smooth: in one plane, elastic and without friction; otherwise tilted, with the law of the scene.
        phases: places of the onset in a step.
    """
    law = contact_law_of(scene())
    if smooth:
        law = dataclasses.replace(law, normal_damping=0.0, wall_damping=0.0, friction=0.0)
    # No theory: against the same at a step eight times finer than the finest.
    squares = np.zeros(len(steps))
    for number in range(phases):
        one, gap = _stiffer(law, number), _gap(number)
        reference = _collided(one, min(steps) / 8, gap, tilted=not smooth)
        for k, dt in enumerate(steps):
            away = _collided(one, dt, gap, tilted=not smooth) - reference
            squares[k] += float((away**2).sum(axis=1).mean())
    return _roots(squares / phases)
