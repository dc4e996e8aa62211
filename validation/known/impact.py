"""Single impacts: rebound, oblique, bars end to end, a smarticle on its tip."""

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
from validation.case import case
from validation.check import Answer
from validation.engines import BALL_MASS, BALL_RADIUS, STIFFNESS, EngineAccess
from validation.known.theory import dashpot_impact

DASHPOT = "Schwager and Pöschel, Granular Matter 9, 465 (2007)"
OBLIQUE = "impulse theory with Coulomb friction, as in MFiX DEM-05 and Chung and Ooi (2011), tests 5 to 8"
RIGID = "rigid-body impulse theory: 1/m_eff = 1/m + (r × n)·I⁻¹(r × n), impulse (1 + e) m_eff v"
TIP = "a welded U meets a smooth floor with one sphere"
UNLIMITED = "the same, with cs/cn = 0.9: the dashpot acts without limit until the spring has reached Coulomb's"
WINDING = f"μ(1 + e)mv + (cs s − μ cn v/2) μ cn v/(ks s − μ kn v); {OBLIQUE}, and YADE's law"

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
    """Advance until a body has met the floor and left it again."""
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


@case("elastic rebound", "a ball on the floor", "half a period of a mass on a spring: π√(m/k), v√(m/k), v")
def elastic_rebound(access: EngineAccess) -> list[Answer]:
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    found = ball_impact(access, ball_law(), speed=speed, dt=dt)
    return [
        Answer("contact time [s]", CONTACT_TIME, found.steps * dt, 2 / RESOLVED, reason="counted in whole steps"),
        Answer("largest overlap [m]", speed * math.sqrt(BALL_MASS / STIFFNESS), found.deepest, 1e-4).because(
            "second order: (ω dt)²/8 and what the onset within a step costs"
        ),
        Answer("rebound speed [m/s]", speed, float(found.velocity[2]), 1e-4).because(
            "second order: the force grows from zero at the onset within a step"
        ),
    ]


def damped_rebound(access: EngineAccess, restitution: float) -> list[Answer]:
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    law = ball_law(restitution=restitution)
    found = ball_impact(access, law, speed=speed, dt=dt)
    exact = dashpot_impact(stiffness=STIFFNESS, damping=law.wall_damping, mass=BALL_MASS)
    return [
        Answer(
            "restitution, against the one asked for [1]", restitution, float(found.velocity[2]) / speed, 0.01
        ).because(f"first order: the dashpot acts at once, but {ONSET}"),
        Answer(
            "restitution, against the integrated impact [1]", exact.restitution, float(found.velocity[2]) / speed, 0.01
        ).because(f"first order: the dashpot acts at once, but {ONSET}"),
        Answer("contact time [s]", exact.duration, found.steps * dt, 2 * dt / exact.duration + 0.01).because(
            "counted in whole steps, and first order"
        ),
    ]


for _e in (0.2, 0.5, 0.9):
    case(
        f"damped rebound, e = {_e:g}",
        "a ball on the floor, its dashpot sized for it",
        f"spring and dashpot that never pull; {DASHPOT}, integrated",
        restitution=_e,
    )(damped_rebound)


@case("two balls", "head on, in free space, e = 0.5", "the same at the reduced mass; momentum", restitution=0.5)
def pair_rebound(access: EngineAccess, restitution: float) -> list[Answer]:
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    engine = access.build(access.ball(), ball_law(restitution=restitution), dt=dt)
    add(engine, (0, 0, 0.1), access.ball_turn)
    add(engine, (0, 0, 0.1 + 2 * BALL_RADIUS + 3.3 * speed * dt), access.ball_turn)
    access.push(engine, 0, velocity=(0, 0, speed / 4))
    access.push(engine, 1, velocity=(0, 0, -3 * speed / 4))
    engine.advance(4 * RESOLVED)
    after = engine.state().velocities
    return [
        Answer("restitution [1]", restitution, float(after[1, 2] - after[0, 2]) / speed, 0.01).because(
            f"first order: the dashpot acts at once, but {ONSET}"
        ),
        Answer("momentum [kg m/s]", -BALL_MASS * speed / 2, float(BALL_MASS * after[:, 2].sum()), 1e-12).because(
            "rounding: forces come in pairs"
        ),
    ]


@case(
    "bar on its end",
    "a bar falls on its end, with the law of a scene that asks for e = 0.5 at the typical mass",
    f"spring and dashpot at the bar's mass; {DASHPOT}, integrated",
    restitution=0.5,
)
def bar_rebound(access: EngineAccess, restitution: float, *, resized: bool = False) -> list[Answer]:
    """An upright bar falls on its end: the force passes through the centre of mass, and the law is a scene's."""
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
            "restitution [1]",
            restitution if resized else exact.restitution,
            float(found.velocity[2]) / speed,
            0.03 if resized else 0.01,
        ).because("contact begins and ends within a step, which is some 1/150 of it"),
        Answer(
            "spin [rad/s]", 0.0, float(np.abs(found.spin).max()), 1e-9, scale=speed / one.smarticle.middle_length_m
        ).because("rounding: the force passes through the centre of mass"),
    ]


@case(
    "bars end to end",
    "the same, two bars in free space",
    f"the same at the reduced mass; {DASHPOT}, integrated",
    restitution=0.5,
)
def bars_rebound(access: EngineAccess, restitution: float) -> list[Answer]:
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
        Answer("restitution [1]", exact.restitution, float(after[1] - after[0]) / speed, 0.01).because(
            "contact begins and ends within a step, which is some 1/150 of it"
        ),
        Answer("momentum left [kg m/s]", 0.0, float(mass * after.sum()), 1e-12, scale=mass * speed).because(
            "rounding: forces come in pairs"
        ),
    ]


# -- clump on its tip --------------------------------------------------------------------------------------------------


def tip_impact(access: EngineAccess, restitution: float, turn: Sequence[float]) -> list[Answer]:
    """A welded smarticle meets a smooth floor with one sphere."""
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
            "velocity upwards [m/s]",
            impulse / boxes.mass - speed,
            float(found.velocity[2]),
            0.01,
            scale=impulse / boxes.mass,
        ).because(reason),
        Answer("spin [rad/s]", float(np.linalg.norm(spin)), float(found.spin @ along), 0.01, reason=reason),
        Answer(
            "spin across that of theory [rad/s]",
            0.0,
            float(np.linalg.norm(found.spin - (found.spin @ along) * along)),
            0.01,
            scale=float(np.linalg.norm(spin)),
        ).because(reason),
    ]


for _place, _turn, _e in (
    ("a barb's tip", (0.5, 0.3, 0.1), 1.0),
    ("a barb's tip", (0.5, 0.3, 0.1), 0.7),
    ("a corner", (-1.2, 0.4, 0.0), 0.7),
):
    case(f"smarticle on {_place}, e = {_e:g}", TIP, RIGID, restitution=_e, turn=_turn)(tip_impact)


FRICTION = 0.4


@case(
    "oblique, sliding, elastic",
    "a ball at 82° from the normal, μ = 0.4",
    f"tangential impulse μ(1 + e)mv; {OBLIQUE}",
    restitution=1.0,
    dashpot=0.9,
)
@case(
    "oblique, sliding, e = 0.7",
    "the same, without a tangential dashpot",
    f"tangential impulse μ(1 + e)mv; {OBLIQUE}",
    restitution=0.7,
    dashpot=0.0,
)
@case("oblique, sliding, e = 0.7, dashpot of a scene", UNLIMITED, WINDING, restitution=0.7, dashpot=0.9)
@case("oblique, sliding, e = 0.3, dashpot of a scene", UNLIMITED, WINDING, restitution=0.3, dashpot=0.9)
@case(
    "oblique, sliding, e = 0.7, dashpot and step of a scene",
    "the same with 22 steps in a contact, as in a scene: longer than the dashpot acts",
    f"tangential impulse μ(1 + e)mv; {OBLIQUE}",
    restitution=0.7,
    dashpot=0.9,
    steps=22,
)
def sliding_impact(access: EngineAccess, restitution: float, *, dashpot: float, steps: int = RESOLVED) -> list[Answer]:
    """A ball that slides on the floor as long as it touches it: the tangential impulse is μ times the normal one.

    Not quite, with a tangential dashpot: YADE holds the tangential spring to Coulomb's limit, and adds the dashpot's
    force without limit until the spring has reached it. With s and v the speeds of slip and approach that is at
    t* = μ cn v / (ks s − μ kn v), and the impulse until then exceeds Coulomb's by (cs s − μ cn v/2) t*. A step longer
    than t* never sees it.
    """
    speed, slip, dt = 0.2, 1.5, CONTACT_TIME / steps
    law = ball_law(restitution=restitution, friction=FRICTION, dashpot=dashpot)
    found = ball_impact(access, law, speed=speed, slip=slip, dt=dt)
    inertia = access.ball().boxes.inertia[1]
    cn, kn, ks = law.wall_damping, law.normal_stiffness, law.tangential_stiffness
    winding = FRICTION * cn * speed / (ks * slip - FRICTION * kn * speed)
    excess = (dashpot * cn * slip - FRICTION * cn * speed / 2) * winding if winding > dt else 0.0
    coulomb = FRICTION * BALL_MASS * (1 + restitution) * speed
    impulse = coulomb + excess
    # At the lever from the centre to the floor, which is shorter than the radius by the overlap: by its mean under the
    # normal force, π/4 of the largest in a sine.
    lever = BALL_RADIUS - access.arm_share * math.pi / 4 * found.deepest
    reason, tolerance = "second order", 1e-4
    if restitution < 1:
        reason = f"{ONSET}; and the estimate of the excess takes both speeds as constant while the spring is wound up"
        tolerance = 0.01 + 0.05 * excess / coulomb
    normal = BALL_MASS * (float(found.velocity[2]) + speed)
    over = Answer(
        "tangential impulse over μ times the normal one [1]",
        1 + excess / coulomb,
        (slip - float(found.velocity[0])) * BALL_MASS / (FRICTION * normal),
        tolerance,
    ).because(reason)
    if steps < RESOLVED:  # too few for the other answers
        return [over]
    return [
        over,
        Answer(
            "tangential velocity lost [m/s]", impulse / BALL_MASS, slip - float(found.velocity[0]), tolerance
        ).because(reason),
        Answer("spin gained [rad/s]", impulse * lever / inertia, float(found.spin[1]), tolerance).because(
            f"{reason}; mean lever"
        ),
    ]


@case(
    "oblique, sticking",
    "a ball at 45°, ks = 2/7 kn: its slip is turned around",
    "a mass 2/7 m on the tangential spring for half a period; Chung and Ooi (2011)",
)
def sticking_impact(access: EngineAccess) -> list[Answer]:
    """A ball that never slides: the tangential spring, tuned to half a vibration per contact, turns the slip around.

    The contact point moves on the mass m/(1 + m r²/I), 2/7 m of a solid ball, so with that share of kn for ks both
    directions vibrate alike; the force stays within Coulomb's cone throughout where slip/speed < μ kn/ks.
    """
    inertia = access.ball().boxes.inertia[1]
    share = 1 / (1 + BALL_MASS * BALL_RADIUS**2 / inertia)
    speed, dt = 0.01, CONTACT_TIME / RESOLVED
    slip = min(1.0, 0.72 * FRICTION / share) * speed
    law = ball_law(friction=FRICTION, tangential=share)
    found = ball_impact(access, law, speed=speed, slip=slip, dt=dt)
    # To both sides of the contact point the mass is felt at the lever, which is shorter than the radius by the overlap.
    reason = "the lever is shorter than the radius by the overlap, 0.7 %, and with it the vibration slower"
    return [
        Answer(
            "slip after, at the contact [m/s]", -slip, float(found.velocity[0] - found.spin[1] * BALL_RADIUS), 0.02
        ).because(reason),
        Answer("tangential velocity after [m/s]", slip - 2 * share * slip, float(found.velocity[0]), 0.02).because(
            reason
        ),
        Answer(
            "spin after [rad/s]", 2 * share * BALL_MASS * slip * BALL_RADIUS / inertia, float(found.spin[1]), 0.01
        ).because(reason),
    ]
