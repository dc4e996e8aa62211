"""Known answers for single impacts (balls, bars, tips of smarticles), and errors over the time step.

`access` is the engine, with access to its internals; `dt` is a time step, a sequence `steps` has several [s].
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.state import spheres_of
from dem.engine.interface import Engine
from dem.physics.contact import ContactLaw, typical_effective_mass
from dem.plan.steps import time_step
from validation.access import BALL_MASS, BALL_RADIUS, STIFFNESS, EngineAccess
from validation.bench import UPRIGHT, Array, G, add, ball_law, law_of, scene
from validation.cases import COARSE, LEAPFROG, MIDDLE, Answer, case, ladder
from validation.known.theory import bounced, dashpot_impact

DASHPOT = "Schwager and Pöschel, Granular Matter 9, 465 (2007)"
OBLIQUE = "impulse theory with Coulomb friction, as in MFiX DEM-05 and Chung and Ooi (2011), tests 5 to 8"
RIGID = "rigid-body impulse theory: 1/m_eff = 1/m + (r × n)·I⁻¹(r × n), impulse (1 + e) m_eff v"
TIP = "a welded U meets a smooth floor with one sphere"
UNLIMITED = "a ball at 82°, cs/cn = 0.9: the dashpot acts without limit until the spring has reached Coulomb's"
WINDING = f"μ(1 + e)mv + (cs s − μ cn v/2) μ cn v/(ks s − μ kn v); {OBLIQUE}, and YADE's law"
SLIDES = f"tangential impulse μ(1 + e)mv; {OBLIQUE}"

CONTACT_TIME = math.pi * math.sqrt(BALL_MASS / STIFFNESS)  # elastic ball on the floor [s]
RESOLVED = 400  # time steps per elastic contact
ONSET = f"contact begins and ends within a step, 1/{RESOLVED} of its duration"
FIRST = f"first order: the dashpot acts at once, but {ONSET}"
COARSER = "contact begins and ends within a step, which is some 1/150 of it"


@dataclass(frozen=True)
class Touch:
    """Measurements of one contact with the floor."""

    velocity: Array  #: Velocity after the contact, (3,) [m/s]
    spin: Array  #: Angular velocity after the contact, (3,) [rad/s]
    steps: int  #: Number of time steps with a contact force
    deepest: float  #: Largest overlap of the first smarticle with the floor [m]


def touch(access: EngineAccess, engine: Engine, *, most: int) -> Touch:
    """Advance until a body has touched and left the floor, at most `most` steps; return the measurements."""
    pressed, deepest = 0, 0.0
    for _ in range(most):
        engine.advance(1)
        if access.floor_force(engine)[2]:
            pressed += 1
            state = engine.state().smarticles
            deepest = max(deepest, engine.particle.radius - float(spheres_of(state, engine.particle)[0, :, 2].min()))
        elif pressed:
            break
    state = engine.state().smarticles
    return Touch(state.velocities[0], state.link_spins[0, 1], pressed, deepest)


def ball_impact(access: EngineAccess, law: ContactLaw, *, speed: float, slip: float = 0.0, dt: float) -> Touch:
    """Throw a ball at the floor without gravity; return the measurements.

    `speed` is its downward velocity, `slip` its velocity along x [m/s].
    """
    engine = access.build(access.ball(), law, dt=dt)
    add(engine, (0, 0, BALL_RADIUS + 3.3 * speed * dt), access.ball_turn)
    access.push(engine, 0, velocity=(slip, 0, -speed))
    return touch(access, engine, most=10 * RESOLVED)


@case("elastic rebound", "a ball on the floor", "half a period of a mass on a spring: π√(m/k), v√(m/k), v")
def elastic_rebound(access: EngineAccess) -> list[Answer]:
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    found = ball_impact(access, ball_law(), speed=speed, dt=dt)
    deepest = speed * math.sqrt(BALL_MASS / STIFFNESS)
    second = "second order: (ω dt)²/8 and what the onset within a step costs"
    grows = "second order: the force grows from zero at the onset within a step"
    return [
        Answer("contact time [s]", CONTACT_TIME, found.steps * dt, 2 / RESOLVED, "counted in whole steps"),
        Answer("largest overlap [m]", deepest, found.deepest, 1e-4, second),
        Answer("rebound speed [m/s]", speed, found.velocity[2], 1e-4, grows),
    ]


def damped_rebound(access: EngineAccess, restitution: float) -> list[Answer]:
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    law = ball_law(restitution=restitution)
    found = ball_impact(access, law, speed=speed, dt=dt)
    exact = dashpot_impact(stiffness=STIFFNESS, damping=law.wall_damping, mass=BALL_MASS)
    rebound, counted = found.velocity[2] / speed, 2 * dt / exact.duration + 0.01
    return [
        Answer("restitution, against the one asked for [1]", restitution, rebound, 0.01, FIRST),
        Answer("restitution, against the integrated impact [1]", exact.restitution, rebound, 0.01, FIRST),
        Answer(
            "contact time [s]", exact.duration, found.steps * dt, counted, "counted in whole steps, and first order"
        ),
    ]


for _e in (0.2, 0.5, 0.9):
    case(
        f"damped rebound, e = {_e:g}",
        "a ball on the floor, its dashpot sized for it",
        f"spring and dashpot that never pull; {DASHPOT}, integrated",
        restitution=_e,
    )(damped_rebound)


@case("two balls", "head on, in free space, e = 0.5", "spring and dashpot at the reduced mass; momentum")
def pair_rebound(access: EngineAccess, restitution: float = 0.5) -> list[Answer]:
    speed, dt = 0.2, CONTACT_TIME / RESOLVED
    engine = access.build(access.ball(), ball_law(restitution=restitution), dt=dt)
    add(engine, (0, 0, 0.1), access.ball_turn)
    add(engine, (0, 0, 0.1 + 2 * BALL_RADIUS + 3.3 * speed * dt), access.ball_turn)
    access.push(engine, 0, velocity=(0, 0, speed / 4))
    access.push(engine, 1, velocity=(0, 0, -3 * speed / 4))
    engine.advance(4 * RESOLVED)
    after = engine.state().smarticles.velocities[:, 2]
    momentum = BALL_MASS * after.sum()
    return [
        Answer("restitution [1]", restitution, (after[1] - after[0]) / speed, 0.01, FIRST),
        Answer("momentum [kg m/s]", -BALL_MASS * speed / 2, momentum, 1e-12, "rounding: forces come in pairs"),
    ]


@case(
    "bar on its end",
    "a bar falls on its end, with the law of a scene that asks for e = 0.5 at the typical mass",
    f"spring and dashpot at the bar's mass; {DASHPOT}, integrated",
)
def bar_rebound(access: EngineAccess, restitution: float = 0.5, *, resized: bool = False) -> list[Answer]:
    """Throw an upright bar at the floor with the contact law of a scene.

    The force passes through the bar's centre. With `resized` the dashpot is adapted to the mass of the bar, so that the
    nominal restitution is reached.
    """
    one = scene(access, smarticle={"aspect_ratio": 0}, contact={"restitution": restitution})
    law, mass, speed, length = law_of(one), one.smarticle.boxes.mass, 0.5, one.smarticle.middle_length_m
    if resized:
        scale = math.sqrt(mass / typical_effective_mass(one.body))
        law = dataclasses.replace(law, wall_damping=law.wall_damping * scale)
    engine = access.build(one.body, law, dt=time_step(one) / 8)
    add(engine, (0, 0, length / 2 + 1e-5), UPRIGHT)
    access.push(engine, 0, velocity=(0, 0, -speed))
    found = touch(access, engine, most=10 * RESOLVED)
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.wall_damping, mass=mass).restitution
    expected, tolerance = (restitution, 0.03) if resized else (exact, 0.01)
    through, spin = "rounding: the force passes through the centre of mass", np.abs(found.spin).max()
    return [
        Answer("restitution [1]", expected, found.velocity[2] / speed, tolerance, COARSER),
        Answer("spin [rad/s]", 0.0, spin, 1e-9, through, scale=speed / length),
    ]


@case(
    "bars end to end",
    "two bars in free space meet end to end, with the law of a scene",
    f"spring and dashpot at the reduced mass; {DASHPOT}, integrated",
)
def bars_rebound(access: EngineAccess, restitution: float = 0.5) -> list[Answer]:
    one = scene(access, smarticle={"aspect_ratio": 0}, contact={"restitution": restitution})
    law, mass, speed = law_of(one), one.smarticle.boxes.mass, 0.5
    engine = access.build(one.body, law, dt=time_step(one) / 8)
    add(engine, (0, 0, 0.05), UPRIGHT)
    add(engine, (0, 0, 0.05 + one.smarticle.middle_length_m + 1e-4), UPRIGHT)
    access.push(engine, 0, velocity=(0, 0, speed / 2))
    access.push(engine, 1, velocity=(0, 0, -speed / 2))
    engine.advance(math.ceil((2e-4 / speed + 0.004) / engine.time_step))
    after = engine.state().smarticles.velocities[:, 2]
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.normal_damping, mass=mass / 2).restitution
    left, pairs = mass * after.sum(), "rounding: forces come in pairs"
    return [
        Answer("restitution [1]", exact, (after[1] - after[0]) / speed, 0.01, COARSER),
        Answer("momentum left [kg m/s]", 0.0, left, 1e-12, pairs, scale=mass * speed),
    ]


# -- clump on its tip --------------------------------------------------------------------------------------------------


def tip_impact(access: EngineAccess, restitution: float, turn: Sequence[float]) -> list[Answer]:
    """Throw a welded smarticle, rotated by the vector `turn` [rad], at a smooth floor; one sphere touches."""
    one = scene(access, contact={"restitution": restitution, "friction_wall": 0})
    law, boxes, particle, speed = law_of(one), one.smarticle.boxes, one.body, 0.02
    pose = Rotation.from_rotvec(turn)
    ends = pose.apply(access.ends(particle))
    heights, arm = np.sort(ends[:, 2]), ends[np.argmin(ends[:, 2])]
    lever = np.cross(arm, [0, 0, 1])
    turned = pose.apply(pose.inv().apply(lever) / boxes.inertia)
    felt = 1 / (1 / boxes.mass + lever @ turned)
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.wall_damping, mass=felt)
    # A single contact: the next sphere does not reach the floor.
    assert heights[1] - heights[0] > 3 * speed * exact.duration
    dt = exact.duration / RESOLVED
    engine = access.build(particle, law, dt=dt)
    add(engine, (0, 0, -heights[0] + particle.radius + 3.3 * speed * dt), pose)
    access.push(engine, 0, velocity=(0, 0, -speed))
    found = touch(access, engine, most=4 * RESOLVED)
    impulse = (1 + exact.restitution) * felt * speed
    gain, spin = impulse / boxes.mass, impulse * turned
    size = float(np.linalg.norm(spin))
    # Components parallel and perpendicular to the angular velocity by theory.
    along = found.spin @ spin / size
    across = float(np.linalg.norm(found.spin - along * spin / size))
    reason = f"{ONSET}; and the smarticle turns by some 1e-3 rad meanwhile"
    return [
        Answer("velocity upwards [m/s]", gain - speed, found.velocity[2], 0.01, reason, scale=gain),
        Answer("spin [rad/s]", size, along, 0.01, reason),
        Answer("spin across that of theory [rad/s]", 0.0, across, 0.01, reason, scale=size),
    ]


for _place, _turn, _e in (
    ("a barb's tip", (0.5, 0.3, 0.1), 1.0),
    ("a barb's tip", (0.5, 0.3, 0.1), 0.7),
    ("a corner", (-1.2, 0.4, 0.0), 0.7),
):
    case(f"smarticle on {_place}, e = {_e:g}", TIP, RIGID, restitution=_e, turn=_turn)(tip_impact)


# -- oblique -----------------------------------------------------------------------------------------------------------

FRICTION = 0.4


@case("oblique, sliding, elastic", "a ball at 82° from the normal, μ = 0.4", SLIDES, restitution=1.0, dashpot=0.9)
@case("oblique, sliding, e = 0.7", "a ball at 82°, without a tangential dashpot", SLIDES, restitution=0.7, dashpot=0.0)
@case("oblique, sliding, e = 0.7, dashpot of a scene", UNLIMITED, WINDING, restitution=0.7, dashpot=0.9)
@case("oblique, sliding, e = 0.3, dashpot of a scene", UNLIMITED, WINDING, restitution=0.3, dashpot=0.9)
@case(
    "oblique, sliding, e = 0.7, dashpot and step of a scene",
    "a ball at 82°, 22 steps in a contact, as in a scene: longer than the dashpot acts",
    SLIDES,
    restitution=0.7,
    dashpot=0.9,
    steps=22,
)
def sliding_impact(access: EngineAccess, restitution: float, *, dashpot: float, steps: int = RESOLVED) -> list[Answer]:
    """Throw a ball that slides throughout the contact: tangential impulse is μ times normal impulse.

    A tangential dashpot adds to the impulse: its force is not limited by friction until the tangential spring reaches
    Coulomb's limit. With slip speed s and approach speed v this happens at t* = μ cn v / (ks s − μ kn v). Until then
    the impulse exceeds Coulomb's by (cs s − μ cn v/2) t*. Stiffnesses and dampings are kn, cn (normal) and ks, cs
    (tangential). Time steps longer than t* do not resolve this.
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
    # The lever from the centre to the floor is the radius less the mean overlap, weighted by the normal force: π/4 of
    # the largest overlap for a sine.
    lever = BALL_RADIUS - access.arm_share * math.pi / 4 * found.deepest
    reason, tolerance = "second order", 1e-4
    if restitution < 1:
        reason = f"{ONSET}; and the estimate of the excess takes both speeds as constant while the spring is wound up"
        tolerance = 0.01 + 0.05 * excess / coulomb
    lost, normal = slip - found.velocity[0], BALL_MASS * (found.velocity[2] + speed)
    ratio, what = lost * BALL_MASS / (FRICTION * normal), "tangential impulse over μ times the normal one [1]"
    answers = [
        Answer(what, 1 + excess / coulomb, ratio, tolerance, reason),
        Answer("tangential velocity lost [m/s]", impulse / BALL_MASS, lost, tolerance, reason),
        Answer("spin gained [rad/s]", impulse * lever / inertia, found.spin[1], tolerance, f"{reason}; mean lever"),
    ]
    return answers[:1] if steps < RESOLVED else answers  # too few steps for the others


@case(
    "oblique, sticking",
    "a ball at 45°, ks = 2/7 kn: its slip is turned around",
    "a mass 2/7 m on the tangential spring for half a period; Chung and Ooi (2011)",
)
def sticking_impact(access: EngineAccess) -> list[Answer]:
    """Throw a ball that never slides; the tangential spring reverses the slip velocity.

    The effective tangential mass at the contact is m/(1 + m r²/I), 2/7 m for a solid ball. With ks = 2/7 kn, normal and
    tangential vibrations have one frequency. The ball sticks throughout if slip/speed < μ kn/ks.
    """
    inertia = access.ball().boxes.inertia[1]
    share = 1 / (1 + BALL_MASS * BALL_RADIUS**2 / inertia)
    speed, dt = 0.01, CONTACT_TIME / RESOLVED
    slip = min(1.0, 0.72 * FRICTION / share) * speed
    found = ball_impact(access, ball_law(friction=FRICTION, tangential=share), speed=speed, slip=slip, dt=dt)
    # The tolerance allows for the lever, which is the radius less the overlap.
    reason = "the lever is shorter than the radius by the overlap, 0.7 %, and with it the vibration slower"
    after, spin = found.velocity[0], 2 * share * BALL_MASS * slip * BALL_RADIUS / inertia
    return [
        Answer("slip after, at the contact [m/s]", -slip, after - found.spin[1] * BALL_RADIUS, 0.02, reason),
        Answer("tangential velocity after [m/s]", slip - 2 * share * slip, after, 0.02, reason),
        Answer("spin after [rad/s]", spin, found.spin[1], 0.01, reason),
    ]


# -- over the time step ------------------------------------------------------------------------------------------------

LATE = "YADE's dashpot takes the velocity of half a step before, and begins with a jump: first order"
LAGS = "the dashpot takes the velocity of half a step before, and begins with a jump: first order"
WAY = 5.12e-3 * 0.2  # m

# The error depends on the positions of the start and the end of the contact within a time step. Initial gaps vary over
# some steps, and stiffnesses by 10 %, as a low-discrepancy sequence (plastic number).
PHASES = 16
SPREAD = 8e-5  # m


def _spread(law: ContactLaw, number: int) -> tuple[ContactLaw, float]:
    """Vary a contact law and the initial gap with the sample `number`.

    Returns the law with stiffnesses up to 10 % higher, and the gap [m].
    """
    factor = 1 + 0.1 * (0.569840 * number % 1)
    springs = {key: factor * getattr(law, key) for key in ("normal_stiffness", "tangential_stiffness")}
    return dataclasses.replace(law, **springs), 1e-4 + SPREAD * (0.754878 * number % 1)


@ladder(
    "bounce, e = 0.5",
    "a ball bounces once under gravity",
    "height after 5 ms [m]",
    WAY,
    COARSE,
    {"yade": (1, LATE), "links": (1, LAGS)},
    phases=16,
    restitution=0.5,
)
@ladder(
    "bounce, elastic",
    "a ball bounces once under gravity",
    "height after 5 ms [m]",
    WAY,
    COARSE,
    (2, f"{LEAPFROG}, and the force begins from zero"),
    phases=16,
    restitution=1.0,
)
def bounce_errors(access: EngineAccess, steps: Sequence[float], *, restitution: float, phases: int = 24) -> list[float]:
    """Return the rms error [m] of a ball's height after a bounce for each step.

    The mean is over `phases` bounces with slightly different stiffnesses and initial gaps.
    """
    speed, time, squares = 0.2, 5.12e-3, np.zeros(len(steps))
    for number in range(phases):
        law, gap = _spread(ball_law(restitution=restitution), number)
        springs = {"stiffness": law.normal_stiffness, "damping": law.wall_damping, "mass": BALL_MASS}
        exact = bounced(gap=gap, speed=speed, time=time, gravity=G, **springs)
        for k, dt in enumerate(steps):
            engine = access.build(access.ball(), law, dt=dt, gravity=G)
            add(engine, (0, 0, BALL_RADIUS + gap), access.ball_turn)
            access.push(engine, 0, velocity=(0, 0, -speed + G * dt / 2))
            engine.advance(round(time / dt))
            squares[k] += (float(engine.state().smarticles.positions[0, 2]) - BALL_RADIUS - exact) ** 2
    return [math.sqrt(square) for square in squares / phases]


def _collided(access: EngineAccess, law: ContactLaw, dt: float, gap: float, *, tilted: bool) -> Array:
    """Simulate a collision of two smarticles from a `gap` [m]; return all sphere centres, (S, 3) [m]."""
    one = scene(access)
    engine = access.build(one.body, law, dt=dt)
    add(engine, (0, 0, 0.1))
    other = Rotation.from_rotvec([0.5, 0.2, 0.6] if tilted else [0, 0, 0.6])
    first = access.swept(one.body)
    # The second smarticle is placed above the first along y, at a distance `gap` between the closest spheres.
    apart = other.apply(first)[None] - first[:, None]
    inside = 4 * one.body.radius**2 - apart[..., 0] ** 2 - apart[..., 2] ** 2
    lift = float((np.sqrt(np.maximum(inside, 0.0)) - apart[..., 1])[inside > 0].max())
    add(engine, (0, lift + gap, 0.1), other)
    access.push(engine, 1, velocity=(0, -0.2, 0))
    engine.advance(round(5.12e-3 / dt))
    spheres: Array = engine.state().smarticles.spheres(one.body).reshape(-1, 3)
    return spheres


@ladder(
    "collision, law of the scene",
    "two tilted smarticles collide once",
    "places of all spheres after 5 ms [m]",
    WAY,
    COARSE,
    {"yade": (1, f"{LATE}; so are rotations"), "links": (1, LAGS)},
    phases=8,
    smooth=False,
)
@ladder(
    "collision, elastic and smooth",
    "two smarticles in one plane collide once",
    "places of all spheres after 5 ms [m]",
    WAY,
    MIDDLE,
    (2, f"{LEAPFROG}, also of turns about the normal, and the force begins from zero"),
    phases=8,
    smooth=True,
)
def collision_errors(
    access: EngineAccess, steps: Sequence[float], *, smooth: bool, phases: int = PHASES
) -> list[float]:
    """Return the rms error [m] of sphere positions after a collision for each step.

    The mean is over `phases` collisions with slightly different stiffnesses and initial gaps. `smooth`: without
    friction and dashpots, between smarticles in parallel planes.
    """
    law = law_of(scene(access))
    if access.name == "links":
        # The tangential dashpot is not limited until the spring reaches Coulomb's limit. Only the smaller of these time
        # steps resolve this, which would change the observed order.
        law = dataclasses.replace(law, tangential_damping=0.0)
    if smooth:
        law = dataclasses.replace(law, normal_damping=0.0, wall_damping=0.0, friction=0.0)
    # The reference is a simulation with an eighth of the smallest time step.
    squares = np.zeros(len(steps))
    for number in range(phases):
        one, gap = _spread(law, number)
        reference = _collided(access, one, min(steps) / 8, gap, tilted=not smooth)
        for k, dt in enumerate(steps):
            away = _collided(access, one, dt, gap, tilted=not smooth) - reference
            squares[k] += float((away**2).sum(axis=1).mean())
    return [math.sqrt(square) for square in squares / phases]
