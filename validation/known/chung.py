"""Tests 3 to 8 of Chung and Ooi, Granular Matter 13, 643 (2011), doi 10.1007/s10035-011-0277-0, as published.

`chung_ooi.csv` has the published curves, as digitised for the benchmarks of Kratos Multiphysics,
`applications/DEMApplication/test_examples/basic_benchmarks/paper_data`. Its columns x and y are dimensionless unless
a unit is given:

- test 4, x angle of incidence from the normal [deg]; y velocity along the plane after over before, or spin after;
- test 5, x velocity along the plane over μ times the normal one; y slip after, or radius times spin after, over the
  same;
- tests 6 and 8, `tangential restitution`: x 7/2 μ(1 + e) v/s, y −s'/s; `rebound slope`: x s/v, y s'/v', with the slip
  s and the normal speed v before, s' and v' after the impact.
"""

import math
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from dem.body.kinds import Kind, Mixture
from dem.body.placement import Poses
from dem.body.state import RigidState
from dem.engine.interface import Engine
from dem.engine.links.engine import LinksEngine
from dem.physics.contact import ContactLaw
from dem.setting.container import Cylinder
from validation.access import EngineAccess
from validation.bench import Array, add
from validation.cases import Answer, case
from validation.known.balls import (
    EQUAL_PHASE,
    RESOLVED,
    SOLID,
    Hertz,
    Material,
    Rebound,
    ball,
    ball_kind,
    impacts,
    law,
    on_plane,
    slid,
    slides,
)

SOURCE = "Chung and Ooi, Granular Matter 13, 643 (2011)"
CURVE = f"{SOURCE}, curve as digitised by Kratos"

OXIDE = Material(name="aluminium oxide", young=3.8e11, poisson=0.23, density=4000)
IRON = Material(name="cast iron", young=1e11, poisson=0.25, density=7000)
STEEL = Material(name="steel", young=2.08e11, poisson=0.3, density=7850)
POLYETHYLENE = Material(name="polyethylene", young=1e9, poisson=0.4, density=1400)
ALLOY = Material(name="aluminium alloy", young=7e10, poisson=0.33, density=2700)
NYLON = Material(name="nylon", young=2.5e9, poisson=0.4, density=1000)
COPPER = Material(name="copper", young=1.2e11, poisson=0.35, density=8900)

LAW_FREE = "1 % of what friction changes: the tangential spring winds up first, and contact begins within a step"
LINEAR = "1 % of the curve's span: contact begins and ends within a step, 1/400 of it"
MET = "2 % of the curve's span: what digitising costs, and what the law differs from Hertz and Mindlin's"
BESIDE = "the curve is that of Hertz and Mindlin's law; linear springs differ from it by what theory says, within 1 %"


@cache
def curve(test: int, name: str, material: str) -> Array:
    """Return the points (n, 2) of a published curve."""
    table = pd.read_csv(Path(__file__).with_name("chung_ooi.csv"))
    rows = table[(table.test == test) & (table.curve == name) & (table.material == material)]
    assert len(rows)
    return np.asarray(rows[["x", "y"]], dtype=np.float64)


# y of a curve, from velocities away from the plane and along it and spins after impacts, velocities along the plane
# before them, and approach speeds [m/s]; (n,) each.
Of = Callable[[Array, Array, Array, Array, Array], Array]
Thrown = tuple[Array, Array, Array]


def worst(what: str, measured: Array, theory: Array, scale: float | Array, reason: str) -> Answer:
    """Return the answer that the largest deviation of `measured` from `theory`, over a `scale`, is 0 ± 1 %."""
    return Answer(what, 0.0, float((np.abs(measured - theory) / scale).max()), 0.01, reason, scale=1.0)


class Plane:
    """A published test of a ball that hits a plane: throws balls, and integrates the same impacts.

    Velocities are in units of the approach speed, spins of approach speed over radius.
    """

    def __init__(
        self,
        material: Material,
        *,
        radius: float,
        speed: float,
        restitution: float,
        friction: float,
        share: float = 1.0,
        dashpot: float = 0.0,
        margin: float = 1.25,
    ) -> None:
        """Set up a test.

        Args:
            radius: of the ball [m].
            speed: approach speed for which springs are chosen [m/s].
            share: tangential stiffness over that of Mindlin [1].
            dashpot: tangential over normal damping [1].
            margin: slip from which on impacts count as sliding, over the least with which balls slide throughout [1].
        """
        self.margin = margin
        self.radius, self.restitution, self.friction, self.dashpot = radius, restitution, friction, dashpot
        self.body, self.mass = ball(radius, material.density), material.mass(radius)
        self.hertz = Hertz(modulus=material.plane_strain, radius=radius, mass=self.mass, speed=speed)
        self.ratio = EQUAL_PHASE * share * material.mindlin

    def levers(self, access: EngineAccess, speeds: Array) -> Array:
        """Return distances of the contact from the centre over R [1], averaged over impacts at `speeds` (n,) [m/s].

        The mean overlap, weighted by the normal force, is π/4 of the largest for a sine.
        """
        deepest = speeds * math.sqrt(self.mass / self.hertz.stiffness)
        return 1 - access.arm_share * math.pi / 4 * deepest / self.radius

    def law(self, access: EngineAccess, *, plane: bool = True) -> ContactLaw:
        """Return the law of contact with a plane, or with a ball."""
        return law(
            access,
            stiffness=self.hertz.stiffness,
            mass=self.mass,
            restitution=self.restitution,
            friction=self.friction,
            ratio=self.ratio,
            dashpot=self.dashpot,
            plane=plane,
        )

    def thrown(self, access: EngineAccess, speeds: Array, along: Array, spin: Array) -> Thrown:
        """Throw balls; return velocities away from the plane, along it, and spins, (n,) each, in the test's units."""
        contact, dt, rows = self.law(access), self.hertz.duration / RESOLVED, []
        for speed, v, w in zip(speeds, along, spin, strict=True):
            motion = {"speed": float(speed), "along": float(v * speed), "spin": float(w * speed / self.radius)}
            found: Rebound = on_plane(access, self.body, contact, dt=dt, **motion)
            rows.append((found.normal / speed, found.along / speed, found.spin * self.radius / speed))
        normal, after, spun = np.array(rows).T
        return normal, after, spun

    def sliding(self, access: EngineAccess, what: str, *, speeds: Array, along: Array, spin: Array, of: Of) -> Answer:
        """Compare balls that slide throughout with the closed form; `what` and `of` are name and y of a curve."""
        keys = {"friction": self.friction, "restitution": self.restitution}
        free = slides(along, spin, margin=self.margin, **keys)
        assert free.sum() >= 2
        normal, levers = np.full(int(free.sum()), self.restitution), self.levers(access, speeds)[free]
        speeds, along, spin = speeds[free], along[free], spin[free]
        closed = of(normal, *slid(along, spin, lever=levers, **keys), along, speeds)
        change = np.abs(closed - of(normal, along, spin, along, speeds))  # by friction
        measured = of(*self.thrown(access, speeds, along, spin), along, speeds)
        return worst(f"{what}, where it slides, off the closed form [1]", measured, closed, change, LAW_FREE)

    def on_curve(
        self, access: EngineAccess, what: str, published: Array, *, speeds: Array, along: Array, spin: Array, of: Of
    ) -> list[Answer]:
        """Compare balls with the integrated linear law, and with a published curve.

        Args:
            what: name of the curve.
            published: (n, 2) its points.
            speeds: (n,) approach speeds there [m/s].
            along: (n,) velocities along the plane there.
            spin: (n,) spins there.
            of: y of the curve.
        """
        normal, span = np.full(len(along), self.restitution), float(np.ptp(published[:, 1]))
        after, spun = impacts(
            along,
            spin,
            friction=self.friction,
            restitution=self.restitution,
            ratio=self.ratio,
            dashpot=self.dashpot,
            lever=self.levers(access, speeds),
        )
        theory = of(normal, after, spun, along, speeds)
        measured = of(*self.thrown(access, speeds, along, spin), along, speeds)
        off, found = (float(np.abs(y - published[:, 1]).max()) / span for y in (theory, measured))
        beside = f"{what}, off the published curve, over its span [1]"
        return [
            worst(f"{what}, off the linear law, over the curve's span [1]", measured, theory, span, LINEAR),
            Answer(beside, 0.0, found, 0.02, MET, scale=1.0)
            if off <= 0.02
            else Answer(beside, off, found, 0.01, BESIDE, scale=1.0),
        ]


# -- test 3 ------------------------------------------------------------------------------------------------------------


@case(
    "Chung and Ooi, test 3, aluminium oxide",
    "a ball falls on a plane",
    f"e is the one asked for; {SOURCE}",
    material=OXIDE,
)
@case("Chung and Ooi, test 3, cast iron", "a ball falls on a plane", f"e is the one asked for; {SOURCE}", material=IRON)
def restitution(access: EngineAccess, *, material: Material) -> list[Answer]:
    first = "first order: contact begins within a step, 1/400 of it"
    answers = []
    for asked in (0.2, 0.4, 0.6, 0.8, 1.0):
        test = Plane(material, radius=2.5e-3, speed=3.9, restitution=asked, friction=0.0)
        none = np.zeros(1)
        rebound = test.thrown(access, np.array([3.9]), none, none)[0]
        answers.append(Answer(f"restitution, {asked:g} asked for [1]", asked, float(rebound[0]), 0.01, first))
    return answers


# -- test 4 ------------------------------------------------------------------------------------------------------------

ALONG = "a ball at 3.9 m/s, 5° to 85° from the normal"


@case("Chung and Ooi, test 4, aluminium oxide", ALONG, CURVE, material=OXIDE)
@case("Chung and Ooi, test 4, aluminium alloy", ALONG, CURVE, material=ALLOY)
def oblique(access: EngineAccess, *, material: Material) -> list[Answer]:
    test, answers = Plane(material, radius=2.5e-3, speed=3.9, restitution=0.98, friction=0.092), []
    ways: dict[str, Of] = {
        "tangential restitution": lambda _, after, __, along, ___: after / along,
        "spin after [rad/s]": lambda _, __, spun, ___, speeds: spun * speeds / test.radius,
    }
    for name, of in ways.items():
        published, what = curve(4, name, material.name), name.partition(" [")[0]
        angles = np.radians(published[:, 0])
        motion = {"speeds": 3.9 * np.cos(angles), "along": np.tan(angles), "spin": np.zeros(len(angles))}
        answers.append(test.sliding(access, what, of=of, **motion))
        answers += test.on_curve(access, what, published, of=of, **motion)
    return answers


# -- test 5 ------------------------------------------------------------------------------------------------------------

NORMAL = "a ball at one normal speed, and many along the plane"
HALF = 0.5  # of Mindlin's tangential stiffness: with it Hertz and Mindlin's law gives the published curves of test 5


@case("Chung and Ooi, test 5, steel", NORMAL, CURVE, material=STEEL)
@case("Chung and Ooi, test 5, polyethylene", NORMAL, CURVE, material=POLYETHYLENE)
def recoil(access: EngineAccess, *, material: Material) -> list[Answer]:
    friction, answers = 0.3, []
    test = Plane(material, radius=1e-5, speed=5.0, restitution=1.0, friction=friction, share=HALF)
    ways: dict[str, Of] = {
        "recoil": lambda _, after, spun, *__: (after + spun) / friction,
        "spin after": lambda _, __, spun, *___: spun / friction,
    }
    for name, of in ways.items():
        published = curve(5, name, material.name)
        along = friction * published[:, 0]
        motion = {"speeds": np.full(len(along), 5.0), "along": along, "spin": np.zeros(len(along))}
        answers.append(test.sliding(access, name, of=of, **motion))
        answers += test.on_curve(access, name, published, of=of, **motion)
    return answers


# -- tests 6 and 8 -----------------------------------------------------------------------------------------------------

SPINNING: dict[str, Of] = {
    "tangential restitution": lambda _, after, spun, along, __: -(after + spun) / along,
    "rebound slope": lambda normal, after, spun, *_: (after + spun) / normal,
}


class Spinning(Plane):
    """A ball that spins, and hits a plane; in curves, slips before the impact take the place of velocities along."""

    def thrown(self, access: EngineAccess, speeds: Array, along: Array, spin: Array) -> Thrown:
        """Throw balls whose slips are `along`."""
        return super().thrown(access, speeds, spin, along)


class Unequal(Plane):
    """A ball that spins, and hits a ball at rest of five times its radius and a thousand times its density."""

    def __init__(self, material: Material, *, radius: float, speed: float, **keys: float) -> None:
        super().__init__(material, radius=radius, speed=speed, **keys)
        self.kinds = ball_kind(radius, material.density), ball_kind(5 * radius, 1000 * material.density)
        masses = [kind.mass for kind in self.kinds]
        effective, curvature = masses[0] * masses[1] / sum(masses), radius * 5 / 6
        modulus = material.plane_strain / 2
        self.hertz = Hertz(modulus=modulus, radius=curvature, mass=effective, speed=speed)

    def thrown(self, access: EngineAccess, speeds: Array, along: Array, spin: Array) -> Thrown:
        """Throw balls whose slips are `along`; velocities are relative to the other ball."""
        assert not spin.any()
        contact, dt, rows = self.law(access, plane=False), self.hertz.duration / RESOLVED, []
        for speed, slip in zip(speeds, along, strict=True):
            engine = collided(access, self.kinds, contact, speed=speed, spin=slip * speed / self.radius, dt=dt)
            state = engine.state()
            assert isinstance(state, RigidState)
            (v, big), (w, turned) = state.velocities, state.spins[:, 1]
            rows.append((v[2] - big[2], v[0] - big[0] - 5 * self.radius * turned, -w * self.radius))
        normal, after, spun = np.array(rows).T / speeds
        return normal, after, spun


def collided(
    access: EngineAccess, kinds: tuple[Kind, Kind], contact: ContactLaw, *, speed: float, spin: float, dt: float
) -> Engine:
    """Throw the first ball down at the second, and return the engine after the collision.

    The ball has a downward `speed` [m/s], and a `spin` as in `Rebound` [rad/s].
    """
    mixture, height = Mixture(kinds, np.arange(2)), 3 * kinds[1].radius
    cylinder = Cylinder(radius=2 * height, height=3 * height, facets=16)
    engine: Engine = access.engine(
        particle=mixture, cylinder=cylinder, law=contact, gravity=0.0, time_step=dt, shaken=False
    )
    places = [[0, 0, height + kinds[0].radius + kinds[1].radius + 3.3 * speed * dt], [0, 0, height]]
    engine.add(Poses(np.array(places), (Rotation.identity(),) * 2, np.arange(2)))
    assert isinstance(engine, LinksEngine)
    bodies = engine._world.bodies
    bodies.velocity[0], bodies.momentum[0] = (0.0, 0.0, -speed), (0.0, -spin * kinds[0].inertia[1], 0.0)
    engine.advance(4 + 2 * RESOLVED)
    return engine


def spins(access: EngineAccess, kind: type[Plane], material: Material, test: int) -> list[Answer]:
    """Compare a spinning ball with the curves of test 6 or 8, whose other body is given by the class `kind`."""
    keys, answers = {"radius": 0.1, "speed": 0.2, "restitution": 0.5, "friction": 0.4}, []
    # Where balls stick, the same damping ratio along the contact as across it; where they slide, no dashpot: its force
    # would add to Coulomb's while the spring winds up.
    damped = kind(material, dashpot=math.sqrt(EQUAL_PHASE * material.mindlin / (1 + 1 / SOLID)), **keys)
    for name, of in SPINNING.items():
        published = curve(test, name, material.name)
        slip = published[:, 0] if name == "rebound slope" else (1 + 1 / SOLID) * 0.4 * 1.5 / published[:, 0]
        motion = {"speeds": np.full(len(slip), 0.2), "along": slip, "spin": np.zeros(len(slip))}
        # With less slip, winding up the spring takes more than 1 % of the impulse: the normal dashpot acts at once.
        answers.append(kind(material, margin=1.75, **keys).sliding(access, name, of=of, **motion))
        answers += damped.on_curve(access, name, published, of=of, **motion)
    return answers


SPIN = "a ball at one normal speed, and many spins"
SIZES = {"yade": "the dashpots there are those of bodies of one mass"}

for _material in (ALLOY, NYLON):
    case(f"Chung and Ooi, test 6, {_material.name}", SPIN, CURVE, kind=Spinning, material=_material, test=6)(spins)
    case(
        f"Chung and Ooi, test 8, {_material.name}",
        f"{SPIN}, hits a ball of 5 times its radius and 1000 times its density",
        CURVE,
        absent=SIZES,
        kind=Unequal,
        material=_material,
        test=8,
    )(spins)


# -- test 7 ------------------------------------------------------------------------------------------------------------


@case("Chung and Ooi, test 7, aluminium alloy", "equal balls of opposite spins collide", SOURCE, material=ALLOY)
@case("Chung and Ooi, test 7, copper", "equal balls of opposite spins collide", SOURCE, material=COPPER)
def opposite_spins(access: EngineAccess, *, material: Material) -> list[Answer]:
    radius, speed, asked = 0.1, 0.2, 0.5
    test = Plane(material, radius=radius, speed=speed, restitution=asked, friction=0.4)
    mass, modulus = material.mass(radius) / 2, material.plane_strain / 2
    test.hertz = Hertz(modulus=modulus, radius=radius / 2, mass=mass, speed=2 * speed)
    # Twice the stiffness at the reduced mass: the law's dashpots are sized for the mass of one ball.
    contact, dt = test.law(access, plane=False), test.hertz.duration / RESOLVED
    across, changes, rebounds = [], [], []
    for spin in 2 * np.tan(np.radians([5.0, 45.0, 85.0])):
        engine = access.build(test.body, contact, dt=dt)
        for k, sign in enumerate((1, -1)):
            add(engine, (0, 0, 0.1 + 2 * radius + sign * (radius + 3.3 * speed * dt)))
            access.push(engine, k, velocity=(0, 0, -sign * speed), spin=(0, sign * spin, 0))
        engine.advance(8 + 2 * RESOLVED)
        state = engine.state().smarticles
        across.append(np.abs(state.velocities[:, :2]).max() / speed)
        changes.append(np.abs(state.link_spins[:, 1, 1] / [spin, -spin] - 1).max())
        rebounds.append((state.velocities[0, 2] - state.velocities[1, 2]) / (2 * speed))
    none = "rounding: surfaces do not slip, so that there is no friction"
    short = "a ball's axis is 1e-9 of its diameter long, the lever of the normal force"
    return [
        Answer("velocity across, largest, over the approach speed [1]", 0.0, max(across), 1e-9, none, scale=1.0),
        Answer("change of the spin, largest, over it [1]", 0.0, max(changes), 1e-6, short, scale=1.0),
        Answer("restitution [1]", asked, float(np.mean(rebounds)), 0.01, "contact begins within a step, 1/400 of it"),
    ]
