"""Known answers on the floor: sliding, rolling, stacks, flat impacts.

`access` is the engine, with access to its internals; `dt` is a time step, a sequence `steps` has several [s].
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from dem.body.forces import FLOOR, ContactForces
from dem.body.particle import Particle
from dem.engine.interface import Engine
from dem.physics.contact import ContactLaw, restitution_of, typical_effective_mass
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from validation.access import BALL_MASS, BALL_RADIUS, STIFFNESS, EngineAccess
from validation.bench import ONE_STRAND, Array, G, add, ball_law, law_of, lying, scene
from validation.cases import COARSE, LEAPFROG, Answer, case, ladder
from validation.known.theory import falling_on_springs

FRICTION = 0.4


def lowest(access: EngineAccess, particle: Particle) -> Array:
    """Return x and y of the points at which a flat body touches the floor, (n, 2) [m].

    They are relative to the centre of mass, in the body frame.
    """
    ends = access.ends(particle)
    found: Array = ends[ends[:, 2] < ends[:, 2].min() + 1e-9, :2]
    return found


def resting(access: EngineAccess, particle: Particle, law: ContactLaw, *, dt: float, speed: float) -> Engine:
    """Place a body on the floor at its static overlap, with a velocity `speed` along y [m/s]."""
    engine = access.build(particle, law, dt=dt, gravity=G)
    sunk = particle.boxes.mass * G / (len(lowest(access, particle)) * law.normal_stiffness)
    add(engine, (0, -0.03, particle.radius - float(particle.centres[:, 2].min()) - sunk))
    access.push(engine, 0, velocity=(0, speed, 0))
    return engine


# -- sliding to rolling ------------------------------------------------------------------------------------------------


def roll(access: EngineAccess, particle: Particle, law: ContactLaw, *, speed: float, dt: float) -> list[Answer]:
    """Throw a round body along the floor at `speed` [m/s]; friction makes the body spin until it rolls."""
    friction, mass, inertia = law.wall_friction, particle.boxes.mass, particle.boxes.inertia[0]
    lever = particle.radius - access.arm_share * mass * G / (len(lowest(access, particle)) * law.normal_stiffness)
    rolling = speed / (1 + inertia / (mass * lever**2))
    rolls_at = (speed - rolling) / (friction * G)
    engine = resting(access, particle, law, dt=dt, speed=speed)
    rows = []
    for _ in range(400):
        engine.advance(max(1, round(2 * rolls_at / 400 / dt)))
        state = engine.state().smarticles
        along = state.velocities[0, 1]
        rows.append((engine.time, along, along + state.link_spins[0, 1, 0] * lever))
    time, speeds, slip = np.array(rows).T
    slides, rolls = time < 0.9 * rolls_at, time > 1.3 * rolls_at
    # While the body slides, the slip decreases linearly; rolling begins at the zero of this line.
    line = np.polyfit(time[slides], slip[slides], 1)
    slowed, slips = -np.polyfit(time[slides], speeds[slides], 1)[0], np.abs(slip[rolls]).max()
    winding = "Coulomb's force from the first step on: rounding, and what the winding of the spring takes"
    unwinding = "the tangential spring unwinds where sliding ends, and dies away"
    return [
        Answer("deceleration while it slides [m/s²]", friction * G, slowed, 1e-4, winding),
        Answer("time when rolling begins [s]", rolls_at, -line[1] / line[0], 1e-4, winding),
        Answer("speed when it rolls [m/s]", rolling, speeds[rolls].mean(), 1e-4, unwinding),
        Answer("slip when it rolls [m/s]", 0.0, slips, 1e-4, unwinding, scale=speed),
    ]


@case(
    "sliding to rolling, ball",
    "a ball thrown along the floor",
    "v₀/(1 + I/mr²), 5/7 v₀ for a solid one, after that much slip over μg; MFiX DEM-04",
)
def ball_rolls(access: EngineAccess) -> list[Answer]:
    law = ball_law(restitution=0.5, friction=FRICTION)
    return roll(access, access.roller(), law, speed=0.3, dt=math.pi * math.sqrt(BALL_MASS / STIFFNESS) / 100)


@case("sliding to rolling, bar", "a bar of spheres thrown across itself, with its box's inertia", "v₀/(1 + I/mr²)")
def bar_rolls(access: EngineAccess) -> list[Answer]:
    one = scene(access, fidelity=ONE_STRAND, smarticle={"aspect_ratio": 0})
    return roll(access, one.body, law_of(one), speed=0.3, dt=time_step(one) / 4)


@case("sliding to a stop", "a U lying flat is pushed along its axis of symmetry", "Coulomb: μg, v²/2μg")
def slide(access: EngineAccess, *, aspect_ratio: float = 0.7, friction: float = 0.4) -> list[Answer]:
    speed = 0.3
    one = scene(access, smarticle={"aspect_ratio": aspect_ratio}, contact={"friction_wall": friction})
    engine = resting(access, one.body, law_of(one), dt=time_step(one), speed=speed)
    stops, way = speed / (friction * G), speed**2 / (2 * friction * G)
    rows = [(0.0, -0.03, speed)]
    while engine.time < 1.5 * stops:
        engine.advance(max(1, round(2e-3 / engine.time_step)))
        state = engine.state().smarticles
        rows.append((engine.time, state.positions[0, 1], state.velocities[0, 1]))
    times, ways, speeds = np.array(rows).T
    sliding, across = times < 0.8 * stops, state.positions[0, 0]
    slowed = -np.polyfit(times[sliding], speeds[sliding], 1)[0]
    rocks = "friction at the height of the floor makes it rock on its stiff contacts; seen every 2 ms"
    sticks = "it sticks; the tangential springs' vibration dies away"
    return [
        Answer("deceleration [m/s²]", friction * G, slowed, 5e-3, rocks),
        Answer("way until it stops [m]", way, ways[-1] - ways[0], 5e-3, rocks),
        Answer("speed after it stopped [m/s]", 0.0, speeds[-1], 3e-4, sticks, scale=speed),
        Answer("way across [m]", 0.0, across, 1e-7, "symmetry, but for rounding", scale=way),
    ]


@ladder(
    "sliding to rolling",
    "a ball thrown along the floor, without a tangential dashpot",
    "way after 0.1 s [m]",
    0.1,
    COARSE,
    (2, "the force of friction does not jump where sliding ends: second order"),
    phases=2,
)
def roll_errors(access: EngineAccess, steps: Sequence[float], *, phases: int = 5) -> list[float]:
    """Return the error [m] of the way in 0.1 s of a ball that slides, then rolls, for each time step.

    The reference is a simulation with a quarter of the smallest time step. The tangential dashpot is off. On YADE its
    force is not limited by friction for the first few µs of a contact, so that results would depend on whether a time
    step is shorter than this.
    """
    law, time = ball_law(restitution=0.5, friction=FRICTION, dashpot=0.0), 0.1024
    slowed = FRICTION * G
    spin_rate = slowed * BALL_MASS * BALL_RADIUS / float(access.roller().boxes.inertia[0])

    def way(dt: float, number: int) -> Array:
        speed = 1 + 0.1 * (0.618034 * number % 1)
        engine = resting(access, access.roller(), law, dt=dt, speed=speed)
        access.push(engine, 0, velocity=(0, speed + slowed * dt / 2, 0), spin=(spin_rate * dt / 2, 0, 0))
        engine.advance(round(time / dt))
        return np.asarray(engine.state().smarticles.positions[0])

    squares = np.zeros(len(steps))
    for number in range(phases):
        reference = way(min(steps) / 4, number)
        squares += [float(((way(dt, number) - reference) ** 2).sum()) for dt in steps]
    return [math.sqrt(square) for square in squares / phases]


# -- a stack -----------------------------------------------------------------------------------------------------------


def two_high(
    access: EngineAccess, law: ContactLaw, *, dt: float, velocities: Sequence[float] = (0.0, 0.0), sunk: bool
) -> Engine:
    """Stack two balls on the floor, at their static overlaps if `sunk`, otherwise just touching.

    `velocities` are the upward velocities of the lower and the upper ball [m/s].
    """
    press = BALL_MASS * G / STIFFNESS * sunk
    engine = access.build(access.ball(), law, dt=dt, gravity=G)
    add(engine, (0, 0, BALL_RADIUS - 2 * press), access.ball_turn)
    add(engine, (0, 0, 3 * BALL_RADIUS - 3 * press), access.ball_turn)
    for k, velocity in enumerate(velocities):
        access.push(engine, k, velocity=(0, 0, velocity))
    return engine


@case("two balls stacked", "come to rest on the floor; MFiX DEM-03", "overlaps 2mg/k and mg/k")
def stack_at_rest(access: EngineAccess) -> list[Answer]:
    engine = two_high(access, ball_law(restitution=0.2), dt=2e-5, sunk=False)
    engine.advance(5000)
    low, high = engine.state().smarticles.positions[:, 2]
    weight, force = BALL_MASS * G, access.floor_force(engine)[2]
    reason = "what is left of the vibration after 0.1 s, 40 periods of it"
    return [
        Answer("overlap with the floor [m]", 2 * weight / STIFFNESS, BALL_RADIUS - low, 1e-6, reason),
        Answer("overlap of the two [m]", weight / STIFFNESS, 2 * BALL_RADIUS - (high - low), 1e-6, reason),
        Answer("force on the floor [N]", -2 * weight, force, 1e-6, reason),
    ]


@ladder(
    "stack, elastic",
    "two balls on each other vibrate without parting",
    "heights after 20 ms [m]",
    2e-3 * 0.36e-3,
    COARSE,
    (2, LEAPFROG),
)
def stack_errors(access: EngineAccess, steps: Sequence[float]) -> list[float]:
    """Return the error [m] of the heights of two vibrating stacked balls for each time step."""
    shape = STIFFNESS * np.array([[2.0, -1.0], [-1.0, 1.0]])
    squares, modes = eigh(shape, BALL_MASS * np.eye(2))
    thrown, time = np.array([2e-3, -1e-3]), 0.02048  # m/s, s; overlaps stay above zero
    frequencies, share = np.sqrt(squares), modes.T @ (BALL_MASS * thrown)
    exact = modes @ (share * np.sin(frequencies * time) / frequencies)
    errors = []
    for dt in steps:
        # Velocities half a step before t = 0, to second order.
        before = modes @ (share * np.cos(frequencies * dt / 2))
        engine = two_high(access, ball_law(), dt=dt, velocities=before, sunk=True)
        rest = engine.state().smarticles.positions[:, 2]
        engine.advance(round(time / dt))
        errors.append(float(np.linalg.norm(engine.state().smarticles.positions[:, 2] - rest - exact)))
    return errors


SETTLED = 0.4  # s
REASON = "residual vibration after 0.4 s"


def _level(found: ContactForces, level: int, each: int) -> Array:
    """Return the forces (contacts, 3) [N] from below on a level (0: lowest) that has `each` bodies."""
    bodies = found.smarticles // each
    if level:
        upwards: Array = -found.forces[(bodies == (level - 1, level)).all(axis=1)]
    else:
        upwards = found.forces[found.boundaries == FLOOR]
    return upwards


def _answers(engine: Engine, levels: int, each: int, *, contacts: int | None) -> list[Answer]:
    """Return the forces from below on all levels of a stack at rest, compared with the weight above.

    A level has `each` bodies. If the contacts below a level are equivalent, they share the weight equally; `contacts`
    is their number, None if they are not equivalent.
    """
    found = engine.contact_forces()
    weight = each * engine.particle.mass * G
    answers = []
    for level in range(levels):
        forces = _level(found, level, each)
        upwards, across = forces[:, 2].tolist(), float(np.linalg.norm(forces[:, :2].sum(axis=0)))
        bears = (levels - level) * weight
        where = f"level {level} on {f'level {level - 1}' if level else 'the floor'} [N]"
        carried = [("sum of the forces", sum(upwards), bears)]
        if level and contacts is not None:
            carried += [("least force of a contact", min(upwards, default=math.nan), bears / contacts)]
            carried += [("largest force of a contact", max(upwards, default=math.nan), bears / contacts)]
        answers += [Answer(f"{what}, {where}", theory, measured, 1e-5, REASON) for what, measured, theory in carried]
        sideways = f"nothing pulls sideways; {REASON}"
        answers.append(Answer(f"sum across, {where}", 0.0, across, 1e-5, sideways, scale=bears))
    return answers


@case(
    "crossed bars stacked",
    "five pairs of bars, each pair across the one below, come to rest",
    "statics and symmetry: a contact bears a quarter of the weight above it",
)
def crossed_bars(access: EngineAccess, *, levels: int = 5) -> list[Answer]:
    one = scene(access, fidelity=ONE_STRAND, smarticle={"aspect_ratio": 0})
    engine = access.build(one.body, law_of(one), dt=time_step(one), gravity=G)
    radius = one.body.radius
    apart = 2 * radius * round(one.body.boxes.middle_length / 6 / radius)
    for level in range(levels):
        turn = Rotation.from_euler("z", 90 * (level % 2), degrees=True)
        for side in (-1, 1):
            add(engine, (*turn.apply([0.0, side * apart, 0.0])[:2], (2 * level + 1) * radius), turn)
    engine.advance(round(SETTLED / engine.time_step))
    return _answers(engine, levels, 2, contacts=4)


@case(
    "flat smarticles stacked",
    "four smarticles, link on link, come to rest",
    "statics: contacts bear the weight above them",
)
def flat_smarticles(access: EngineAccess, *, levels: int = 4) -> list[Answer]:
    one = scene(access, fidelity=ONE_STRAND)
    engine = access.build(one.body, law_of(one), dt=time_step(one), gravity=G)
    for level in range(levels):
        add(engine, (0.0, 0.0, (2 * level + 1) * lying(one)))
    engine.advance(round(SETTLED / engine.time_step))
    return _answers(engine, levels, 1, contacts=None)


# -- flat impacts ------------------------------------------------------------------------------------------------------

# A body that touches the floor with n spheres has n springs and n dashpots, each sized for a single contact.

ROW = "a smarticle hits the floor with a row of spheres"
SPRINGS = "n parallel springs and dashpots that never pull; integrated with tilt"

THROWN = 0.1  # m/s
ROWS_AND_PITCHES = tuple((rows, pitch) for rows in (1, 2) for pitch in (1.3, 1.0, 0.5, 0.25))
STRANDS = ((1, 0.0), (2, 0.0))  # on links, which have no pitch


def _thrown(access: EngineAccess, one: Scene, dt: float) -> tuple[float, float]:
    """Throw a smarticle flat at the floor; return its restitution [1] and contact time [s]."""
    engine = access.build(one.body, law_of(one), dt=dt)
    add(engine, (0, 0, lying(one) + 3.3 * THROWN * dt))
    access.push(engine, 0, velocity=(0, 0, -THROWN))
    first = last = 0
    while not last or engine.steps < 2 * last - first + 50:
        engine.advance(1)
        if access.floor_force(engine)[2]:
            first, last = first or engine.steps, engine.steps
    energy = one.smarticle.boxes.mass * THROWN**2 / 2
    return math.sqrt(engine.state().kinetic_energy / energy), (last - first + 1) * dt


def _sunk(access: EngineAccess, one: Scene, dt: float, *, time: float) -> float:
    """Simulate a smarticle lying flat for a `time` [s]; return how far its centre of mass sinks [m]."""
    engine = access.build(one.body, law_of(one), dt=dt, gravity=G)
    add(engine, (0, 0, lying(one)))
    engine.advance(round(time / dt))
    return lying(one) - float(engine.state().smarticles.positions[0, 2])


def _sunk_theory(points: Array, *, stiffness: float, weight: float) -> float:
    """Return the depth by which a weight [N] at the origin sinks on springs [N/m] at points (n, 2) [m]."""
    lift = np.stack([np.ones(len(points)), points[:, 1], -points[:, 0]], axis=1)
    return float(np.linalg.solve(stiffness * lift.T @ lift, [weight, 0.0, 0.0])[0])


def flat_impact(access: EngineAccess, *, rows: int, pitch: float, restitution: float = 0.7) -> dict[str, float]:
    """Throw a smarticle flat at the floor, and let another rest there; return a row of the table `clumps`.

    On YADE links are `rows` rows of spheres, a `pitch` of sphere diameters apart; on `links` the pitch is 0. The
    contact law is that of a scene with this `restitution`.
    """
    fidelity = {"base": "standard", "rows": rows} | ({"pitch": pitch} if pitch else {})
    one = scene(access, fidelity=fidelity, contact={"restitution": restitution})
    law, boxes, points = law_of(one), one.smarticle.boxes, lowest(access, one.body)
    stiffness, damping, mass, count = law.normal_stiffness, law.wall_damping, boxes.mass, len(points)
    springs = {"stiffness": stiffness, "damping": damping, "mass": mass}
    after, lasts = falling_on_springs(points, **springs, inertia=boxes.inertia[:2], speed=THROWN)
    energy = float((np.array([mass, *boxes.inertia[:2]]) * after**2).sum() / (mass * THROWN**2))
    period = 2 * math.pi * math.sqrt(mass / (count * stiffness))
    measured, contact = _thrown(access, one, period / 800)
    return {
        "rows": rows,
        "pitch": pitch,  # over the sphere diameter; 0 on links
        "spheres": len(one.body.centres),
        "contacts": count,  # spheres that touch the floor
        "nominal": restitution,  # `contact.restitution` of the scene [1]
        # Restitution of parallel springs and dashpots without tilt [1]. With tilt, the restitution is the root of the
        # ratio of energies after and before.
        "parallel": restitution_of(count * damping / (2 * math.sqrt(count * stiffness * mass))),
        "theory": math.sqrt(energy),
        "measured": measured,
        "at_scene_step": _thrown(access, one, time_step(one))[0],  # few time steps per contact
        "theory_contact": lasts,  # from first touch to the end of the last contact [s]
        "measured_contact": contact,
        # Duration of an elastic contact of one sphere at the typical effective mass [s].
        "single_contact": math.pi * math.sqrt(typical_effective_mass(one.body) / stiffness),
        # Static sinkage of the centre of mass under its own weight [m], after the vibration has decayed.
        "theory_sunk": _sunk_theory(points, stiffness=stiffness, weight=mass * G),
        "measured_sunk": _sunk(access, one, period / 60, time=40 * period),
        "step": time_step(one),  # [s]
    }


@case("flat impact, spheres of draft", ROW, SPRINGS, rows=1, pitch=1.3)
@case("flat impact, spheres of reference", ROW, SPRINGS, rows=2, pitch=1.0)
def flat_checks(access: EngineAccess, *, rows: int, pitch: float) -> list[Answer]:
    found = flat_impact(access, rows=rows, pitch=pitch)
    begins = "contact begins within a step, 1/400 of an undamped one; the sum over n contacts is that of one"
    ends = "the last of the contacts ends slowly, as its force comes down to zero"
    vibrates = "what is left of the vibration after 40 periods"
    energies, sunk = "restitution, root of the energies [1]", "depth under its own weight [m]"
    return [
        Answer(energies, found["theory"], found["measured"], 0.02, begins),
        Answer("time in contact [s]", found["theory_contact"], found["measured_contact"], 0.05, ends),
        Answer(sunk, found["theory_sunk"], found["measured_sunk"], 1e-3, vibrates),
    ]


def flat_impacts(access: EngineAccess) -> list[dict[str, float]]:
    """Return rows of the table `clumps`, made by `flat_impact`, for several numbers of contact points.

    Rows and pitch of the spheres vary on YADE, the number of rows on `links`.
    """
    settings = ROWS_AND_PITCHES if access.name == "yade" else STRANDS
    return [flat_impact(access, rows=rows, pitch=pitch) for rows, pitch in settings]
