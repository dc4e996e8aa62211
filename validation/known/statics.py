"""Known answers of statics: a ladder, a strut, a rope round a bar, a silo.

`access` is the engine, with access to its internals.
"""

import dataclasses
import math

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.forces import FLOOR, WALL
from dem.body.placement import Bent, Poses
from dem.engine.interface import Engine
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.setting.container import Cylinder
from validation.access import EngineAccess
from validation.bench import ONE_STRAND, RELAX, Array, G, add, law_of, scene, scene_of
from validation.cases import Answer, case
from validation.known.balls import ball, law

# -- a ladder ----------------------------------------------------------------------------------------------------------

HELD = 0.2  # s, in which a ladder that is 1 % too flat slips by diameters
SLIPPED = 0.2  # of a diameter; a ladder that stands moves by far less


def steepest(friction: float, slenderness: float) -> float:
    """Return the angle from the floor [rad] at which a ladder slips, for equal friction at floor and wall.

    Both contacts are at the limit. Moments about the foot: tan φ = (1 - μ²)/2μ for a thin ladder; with round ends of a
    radius r, r/ℓ = `slenderness`, tan φ + (1 + μ) r/(ℓ cos φ) = (1 - μ²)/2μ.
    """
    angles = np.linspace(0.05, math.pi / 2 - 1e-6, 200001)
    left = np.tan(angles) + (1 + friction) * slenderness / np.cos(angles)
    return float(np.interp((1 - friction**2) / (2 * friction), left, angles))


def stands(access: EngineAccess, angle: float, friction: float) -> bool:
    """Lean a bar at the wall at an `angle` from the floor [rad], and return whether it stays."""
    one = scene(
        access,
        fidelity=ONE_STRAND,
        smarticle={"aspect_ratio": 0},
        contact={"friction_wall": friction, "restitution": 0.2},
    )
    engine = access.build(one.body, law_of(one), dt=time_step(one), gravity=G)
    # A flat of the wall: its edges are at multiples of 2π/facets from the x axis.
    facing = math.pi / engine.cylinder.facets
    wall = engine.cylinder.inner_radius if access.name == "yade" else engine.cylinder.radius
    radius, half = one.body.radius, one.body.boxes.middle_length / 2 - one.body.radius
    out, up = wall - radius - half * math.cos(angle), radius + half * math.sin(angle)
    turn = Rotation.from_euler("z", facing) * Rotation.from_euler("y", -angle)
    add(engine, (out * math.cos(facing), out * math.sin(facing), up), turn)
    engine.advance(round(HELD / engine.time_step))
    return bool(up - engine.state().smarticles.positions[0, 2] < SLIPPED * 2 * radius)


@case("ladder", "a bar leans at the wall, at angles about the critical one", "statics: both ends at Coulomb's limit")
def ladder_slips(access: EngineAccess) -> list[Answer]:
    answers = []
    for friction in (0.25, 0.5):
        one = scene(access, fidelity=ONE_STRAND, smarticle={"aspect_ratio": 0})
        thin = one.body.radius / (one.body.boxes.middle_length - 2 * one.body.radius)
        critical = steepest(friction, thin)
        low, high = 0.9 * critical, 1.1 * critical
        assert not stands(access, low, friction)
        assert stands(access, high, friction)
        for _ in range(4):
            middle = (low + high) / 2
            low, high = (low, middle) if stands(access, middle, friction) else (middle, high)
        found = math.degrees((low + high) / 2)
        reason = "half the last interval, and how far a ladder near the limit gets in the time given"
        answers.append(Answer(f"critical angle, μ = {friction:g} [deg]", math.degrees(critical), found, 0.015, reason))
    return answers


# -- a strut -----------------------------------------------------------------------------------------------------------

LENGTH, DIAMETER, DENSITY, YOUNG = 0.1, 4e-3, 1000.0, 1e6  # m, m, kg/m³, Pa
BENDING = YOUNG * math.pi * DIAMETER**4 / 64  # N m²
SHORTENED = 0.02  # of the strut's length


@case(
    "strut",
    "the ends of a filament, free to turn, are pushed together",
    "Euler: π²EI/L², and 1 + δ/2L times that when ends have come nearer by δ",
    absent={"yade": "it has no grips; tests/engine holds a strut by YADE's own means"},
)
def strut_buckles(access: EngineAccess) -> list[Answer]:
    euler = math.pi**2 * BENDING / LENGTH**2
    slowest = math.pi**2 * math.sqrt(BENDING / (DENSITY * math.pi * DIAMETER**2 / 4) / LENGTH**4)  # rad/s
    rod = {
        "shape": "filament",
        "length_m": LENGTH,
        "diameter_m": DIAMETER,
        "density_kg_per_m3": DENSITY,
        "young_modulus_Pa": YOUNG,
        "segments": 10,
        "bending_time_s": 2 / slowest,
        "stretching_time_s": 1e-3,
    }
    # Its own weight bends the straight strut by 1e-4 of its length, so that it buckles.
    weight = 0.0077 * BENDING / LENGTH**3 / (DENSITY * math.pi * DIAMETER**2 / 4)
    one = scene_of(
        {
            "schema_version": 1,
            "engine": access.name,
            "seed": 1,
            "count": 1,
            "particle": rod,
            "container": {"radius_m": 0.3},
            "gravity_m_per_s2": weight,
            "fidelity": {"base": "draft", "stiffness_N_per_m": 10},
            "phases": [{"type": "deposit", "per_layer": 1}, RELAX],
        }
    )
    engine = build_engine(one, time_step(one))
    engine.add(Poses(np.array([[0.0, 0.0, 0.2]]), (Rotation.identity(),), np.zeros(1, np.int64)))
    assert engine.filaments is not None
    engine.filaments.grip({0: [0]})
    pushed, time = engine.filaments.grip({0: [-1]}), 10 / slowest
    loads = []
    for pace, part in ((-SHORTENED * LENGTH / time, 1.0), (0.0, 0.5), (0.0, 0.5), (0.0, 0.5)):
        engine.filaments.move(pushed, (pace, 0.0, 0.0))
        engine.advance(round(part * time / engine.time_step))
        loads.append(-float(engine.filaments.force(pushed)[0]))
    squeezed = euler / (YOUNG * math.pi * DIAMETER**2 / 4)
    expected, drift = euler * (1 + (SHORTENED - squeezed) / 2), loads[-1] - loads[-2]
    segments = "10 segments: (π/10)²/12 of bending by straight pieces, and what is left of the motion"
    return [
        Answer("load [N]", expected, loads[-1], 0.01, segments),
        Answer("change of the load in half the time of the push [N]", 0.0, drift, 1e-3, "at rest", scale=euler),
    ]


# -- a rope round a bar ------------------------------------------------------------------------------------------------

BAR, ROPE = 20e-3, 1e-3  # radius of the bar, and diameter of the rope [m]
TAIL = 40e-3  # free length at either end [m]
STRETCH = 0.05  # of the rope, before it slides


def wound(degrees: float, segments: int) -> Array:
    """Return the nodes (n, 3) [m] of a rope that touches a bar along y, at the origin, over an angle.

    It comes along x, passes over the top of the bar, and leaves on the far side. Turns lie side by side along y.
    """
    wrap, radius = math.radians(degrees), BAR + ROPE / 2
    along = np.linspace(-TAIL, wrap * radius + TAIL, segments + 1)
    angle = np.clip(along / radius, 0.0, wrap)
    before, after = np.minimum(along, 0.0), np.maximum(along - wrap * radius, 0.0)
    x = radius * np.sin(angle) + before + after * math.cos(wrap)
    z = radius * np.cos(angle) - after * math.sin(wrap)
    pitch = 4 * ROPE * along / (2 * math.pi * radius)
    return np.stack([x, pitch, z], axis=1)


def pulled(access: EngineAccess, degrees: float, friction: float) -> tuple[float, float]:
    """Pull a stretched rope round a bar until it slides; return the tensions at both ends, slack end first [N]."""
    turn = math.radians(degrees)
    length = 2 * TAIL + turn * (BAR + ROPE / 2)
    segments = round(length / (BAR * math.radians(10)))
    rope = {
        "shape": "filament",
        "length_m": length,
        "diameter_m": ROPE,
        "density_kg_per_m3": 1000.0,
        "young_modulus_Pa": 1e6,
        "segments": segments,
        "stretching_time_s": 2e-3,
        "bending_time_s": 2e-3,
    }
    one = scene_of(
        {
            "schema_version": 1,
            "engine": access.name,
            "seed": 1,
            "count": 1,
            "particle": rope,
            "container": {"radius_m": 0.3},
            "gravity_m_per_s2": 1e-6,
            "contact": {"friction_wall": friction, "restitution": 0.2},
            "hooks": {"side_m": 2 * BAR, "length_m": 0.2, "lower_height_m": 0.05, "upper_height_m": 0.25},
            "fidelity": {"base": "draft", "stiffness_N_per_m": 200},
            "phases": [{"type": "deposit", "per_layer": 1}, RELAX],
        }
    )
    engine = build_engine(one, time_step(one))
    points = wound(degrees, segments) + np.array([0.0, 0.05, 0.25])
    kinds = np.zeros(1, np.int64)
    engine.add(Poses(points.mean(axis=0)[None], (Rotation.identity(),), kinds, (Bent(points),)))
    held = engine.filaments
    assert held is not None
    slack, taut = held.grip({0: [0]}), held.grip({0: [-1]})
    way = np.array([math.cos(turn), 0.0, -math.sin(turn)])  # of the end that is pulled
    speed, stretch = 0.1, STRETCH * length
    for ends, distance in ((1.0, stretch / 2), (-1.0, stretch)):  # first both apart, then along the rope
        held.move(slack, (-ends * speed, 0.0, 0.0))
        held.move(taut, tuple(speed * way))
        engine.advance(round(distance / speed / engine.time_step))
    return -float(held.force(slack)[0]), float(held.force(taut) @ way)


NO_ROUND = {"yade": "its bars are square"}


@case(
    "rope round a bar",
    "a filament slides over a bar of a hook",
    "Euler and Eytelwein: e^μα; tension acts at the rope's axis and friction at the bar's surface: e^(μα/(1 + d/2R))",
    absent=NO_ROUND,
)
def rope_slides(access: EngineAccess) -> list[Answer]:
    answers = []
    for degrees, friction in ((90, 0.4), (180, 0.4), (360, 0.3)):
        slack, taut = pulled(access, degrees, friction)
        expected = math.exp(friction * math.radians(degrees) / (1 + ROPE / (2 * BAR)))
        what = f"ratio of tensions at {degrees}°, μ = {friction:g} [1]"
        answers.append(Answer(what, expected, taut / slack, 0.02, "segments turn by 10° each; bending of the rope"))
    return answers


# -- a silo ------------------------------------------------------------------------------------------------------------

SILO, GRAIN = 10e-3, 2e-3  # radii of silo and balls [m]
DRAGGED = 0.8e-3  # way of the wall [m]; its lower edge stays below the floor
RESTING, LATEST = 1e-4, 3.0  # mean net force on a ball over its weight [1], and end of waiting for it [s]
ON_WALL, BETWEEN = 0.3, 0.5  # friction of wall and floor, and between balls


def filled(access: EngineAccess, layers: int) -> tuple[float, float, float, float]:
    """Fill a silo with `layers` of four balls, drag its wall upwards, so that it bears weight, and wait for rest.

    Returns the weight of the balls, the force of the floor on them at the end of the drag, and then at rest the forces
    of floor and wall [N].
    """
    body, rng = ball(GRAIN, 2500.0), np.random.default_rng(1)
    mass, cylinder = body.boxes.mass, Cylinder(radius=SILO, height=0.3, facets=16)
    contact = law(access, stiffness=500.0, mass=mass, restitution=0.3, friction=BETWEEN, dashpot=0.5)
    contact = dataclasses.replace(contact, wall_friction=ON_WALL)
    engine: Engine = access.engine(
        particle=body, cylinder=cylinder, law=contact, gravity=G, time_step=5e-5, shaken=False
    )
    for layer, turn in enumerate(rng.uniform(0, 2 * math.pi, layers)):
        for k in range(4):
            x, y = 2.2 * GRAIN * math.cos(turn + math.pi / 2 * k), 2.2 * GRAIN * math.sin(turn + math.pi / 2 * k)
            add(engine, (x, y, 2.5 * GRAIN * (1 + layer)))
    engine.advance(round((0.2 + 0.006 * layers) / engine.time_step))
    engine.boundaries.lift_wall(DRAGGED / 0.15)
    engine.advance(round(0.15 / engine.time_step))
    dragged = upwards(engine, FLOOR)
    engine.boundaries.stop()
    while engine.unbalanced_force() > RESTING and engine.time < LATEST:
        engine.advance(round(0.05 / engine.time_step))
    return 4 * layers * mass * G, dragged, upwards(engine, FLOOR), upwards(engine, WALL)


def upwards(engine: Engine, boundary: int) -> float:
    """Return the upward force of a boundary, an index of `BOUNDARIES`, on all bodies [N]."""
    found = engine.contact_forces()
    return float(found.forces[found.boundaries == boundary][:, 2].sum())


@case(
    "silo",
    "100 balls in a silo of 5 diameters, whose wall is dragged upwards and stopped",
    "statics: floor and wall bear the weight",
)
def silo(access: EngineAccess) -> list[Answer]:
    weight, dragged, floor, wall = filled(access, 25)
    rest = "ten times the mean net force on a ball, over its weight, that counts as rest"
    bears = "that the wall bears a part: how much depends on how balls lie and roll"
    return [
        Answer("force of floor and wall at rest [N]", weight, floor + wall, 1e-3, rest),
        Answer("force of the floor while the wall moves, over the weight [1]", 0.65, dragged / weight, 0.4, bears),
    ]
