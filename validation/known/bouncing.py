"""Bounces and collisions at several time steps: how their errors fall with the step."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from dem.physics.contact import ContactLaw
from validation.bench import Array, G, add, ball_law, law_of, scene
from validation.case import COARSE, LEAPFROG, MIDDLE, ladder, on_both
from validation.engines import BALL_MASS, BALL_RADIUS, EngineAccess
from validation.known.theory import bounced

LATE = "YADE's dashpot takes the velocity of half a step before, and begins with a jump: first order"
LAGS = "the dashpot takes the velocity of half a step before, and begins with a jump: first order"
BALL, WAY = "a ball bounces once under gravity", 5.12e-3 * 0.2  # m

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


def bounce_errors(access: EngineAccess, steps: Sequence[float], *, restitution: float, phases: int = 24) -> list[float]:
    """Error of the height of a ball after one bounce, root mean square over places of the onset in a step [m]."""
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
            engine = access.build(access.ball(), law, dt=dt, gravity=G)
            add(engine, (0, 0, BALL_RADIUS + gap), access.ball_turn)
            access.push(engine, 0, velocity=(0, 0, -speed + G * dt / 2))
            engine.advance(round(time / dt))
            squares[k] += (float(engine.state().positions[0, 2]) - BALL_RADIUS - exact) ** 2
    return _roots(squares / phases)


def _collided(access: EngineAccess, law: ContactLaw, dt: float, gap: float, *, tilted: bool) -> Array:
    """(S, 3) spheres of two smarticles that have collided once [m]."""
    one = scene(access)
    engine = access.build(one.particle, law, dt=dt)
    add(engine, (0, 0, 0.1))
    tilt = [0.5, 0.2, 0.6] if tilted else [0, 0, 0.6]
    other = Rotation.from_rotvec(tilt)
    first = access.swept(one.particle)
    near = other.apply(first)
    # Above the first one along y, so near that the closest spheres touch after a way of a tenth of a millimetre.
    apart = near[None] - first[:, None]
    inside = 4 * one.particle.radius**2 - apart[..., 0] ** 2 - apart[..., 2] ** 2
    lift = float((np.sqrt(np.maximum(inside, 0.0)) - apart[..., 1])[inside > 0].max())
    speed = 0.2
    add(engine, (0, lift + gap, 0.1), other)
    access.push(engine, 1, velocity=(0, -speed, 0))
    engine.advance(round(5.12e-3 / dt))
    spheres: Array = engine.state().spheres(one.particle).reshape(-1, 3)
    return spheres


def collision_errors(
    access: EngineAccess, steps: Sequence[float], *, smooth: bool, phases: int = PHASES
) -> list[float]:
    """Error of where two smarticles are after they collided once [m]."""
    law = law_of(scene(access))
    if access.name == "links":
        # The tangential dashpot has no limit until its spring has reached Coulomb's, which takes as long here as one of
        # these steps: coarser ones miss it, finer ones see it.
        law = dataclasses.replace(law, tangential_damping=0.0)
    if smooth:
        law = dataclasses.replace(law, normal_damping=0.0, wall_damping=0.0, friction=0.0)
    # No theory: against the same at a step eight times finer than the finest.
    squares = np.zeros(len(steps))
    for number in range(phases):
        one, gap = _stiffer(law, number), _gap(number)
        reference = _collided(access, one, min(steps) / 8, gap, tilted=not smooth)
        for k, dt in enumerate(steps):
            away = _collided(access, one, dt, gap, tilted=not smooth) - reference
            squares[k] += float((away**2).sum(axis=1).mean())
    return _roots(squares / phases)


ladder(
    "bounce, e = 0.5",
    BALL,
    "height after 5 ms",
    "m",
    WAY,
    COARSE,
    {"yade": (1, LATE), "links": (1, LAGS)},
    phases=16,
    restitution=0.5,
)(bounce_errors)
ladder(
    "bounce, elastic",
    BALL,
    "height after 5 ms",
    "m",
    WAY,
    COARSE,
    on_both(2, f"{LEAPFROG}, and the force begins from zero"),
    phases=16,
    restitution=1.0,
)(bounce_errors)
ladder(
    "collision, law of the scene",
    "two tilted smarticles collide once",
    "places of all spheres after 5 ms",
    "m",
    WAY,
    COARSE,
    {"yade": (1, f"{LATE}; so are rotations"), "links": (1, LAGS)},
    phases=8,
    smooth=False,
)(collision_errors)
ladder(
    "collision, elastic and smooth",
    "two smarticles in one plane collide once",
    "places of all spheres after 5 ms",
    "m",
    WAY,
    MIDDLE,
    on_both(2, f"{LEAPFROG}, also of turns about the normal, and the force begins from zero"),
    phases=8,
    smooth=True,
)(collision_errors)
