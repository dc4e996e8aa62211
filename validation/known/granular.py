"""Impacts that other codes test as well, each with its closed form and with the value it had when it was recorded.

The form is that of LAMMPS's tests of granular styles of 2026 (`unittest/granular`): a closed form within a percent
says that the law is right, and the recorded value, within 1e-10, that nothing has changed. Grazing impacts have a guard
besides: kinetic energy must not grow. In LAMMPS it did, at 76° from the normal and μ = 0.5 (pull request 5007).
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.body.state import RigidState
from dem.engine.links.engine import LinksEngine
from dem.run.build import build_engine
from validation.access import EngineAccess
from validation.bench import RELAX, add, scene_of
from validation.cases import Answer, case
from validation.known.balls import RESOLVED, SOLID, ball, law, on_plane

# So stiff that a grazing ball moves by 1e-3 of its radius during the contact.
RADIUS, DENSITY, STIFFNESS = 2e-3, 2500.0, 2e7  # m, kg/m³, N/m
BODY = ball(RADIUS, DENSITY)
MASS = BODY.boxes.mass
DT = math.pi * math.sqrt(MASS / STIFFNESS) / RESOLVED
SAME = "the same computation; compilers may round it otherwise"
SLIDES = "1 %: the normal dashpot acts at once, the tangential spring winds up first"


def recorded(what: str, value: float, measured: float) -> Answer:
    """Return the answer that a quantity, `what` with its unit, has not changed since its `value` was recorded."""
    return Answer(f"{what.partition(' [')[0]}, recorded [{what.partition(' [')[2]}", value, measured, 1e-10, SAME)


def kinetic(along: float, normal: float, spin: float) -> float:
    """Return a ball's kinetic energy over its mass [m²/s²], for velocities [m/s] and a spin [rad/s]."""
    return (along**2 + normal**2 + SOLID * (RADIUS * spin) ** 2) / 2


# -- restitution -------------------------------------------------------------------------------------------------------

HEAD_ON = {"links": 0.5001043161829595, "yade": 0.5001010732017189}


@case("restitution, recorded", "a ball falls on a plane, e = 0.5", "spring and dashpot that never pull: e")
def restitution(access: EngineAccess, *, asked: float = 0.5) -> list[Answer]:
    contact = law(access, stiffness=STIFFNESS, mass=MASS, restitution=asked)
    found = on_plane(access, BODY, contact, speed=0.2, dt=DT).normal / 0.2
    first = f"contact begins within a step, 1/{RESOLVED} of it"
    return [
        Answer("restitution [1]", asked, found, 0.01, first),
        recorded("restitution [1]", HEAD_ON[access.name], found),
    ]


# -- grazing -----------------------------------------------------------------------------------------------------------

ANGLE, FRICTION, SPEED, ELASTICITY = 76.0, 0.5, 1.0, 0.9  # deg from the normal, 1, m/s, 1
GRAZING = {
    "links": (0.7277404057091117, 0.8638535053512326),
    "yade": (0.7277159600899786, 0.8638534360280825),
}  # at a plane, at a ball
GUARD = "rounding: friction and dashpots only take energy"


def grazing(access: EngineAccess, degrees: float, *, dashpot: float, pair: bool) -> tuple[float, float, float]:
    """Throw a ball at 1 m/s at a plane, or at an equal ball at rest; return velocity along, spin and energy after.

    Velocity [m/s] and spin [rad/s] are relative to the other ball. Energy is over that before [1].
    """
    across, along = SPEED * math.cos(math.radians(degrees)), SPEED * math.sin(math.radians(degrees))
    # In a collision the same spring and dashpot at the reduced mass: half of either.
    contact = law(
        access,
        stiffness=STIFFNESS / (1 + pair),
        mass=MASS,
        restitution=ELASTICITY,
        friction=FRICTION,
        ratio=0.8,
        dashpot=dashpot,
        plane=not pair,
    )
    if not pair:
        found = on_plane(access, BODY, contact, speed=across, along=along, dt=DT)
        return found.along, found.spin, kinetic(found.along, found.normal, found.spin) / kinetic(along, across, 0.0)
    engine = access.build(BODY, contact, dt=DT)
    add(engine, (0, 0, 0.05))
    # It passes over the other ball's top in the middle of the contact.
    add(engine, (-along * (3.3 + RESOLVED / 2) * DT, 0, 0.05 + 2 * RADIUS + 3.3 * across * DT))
    access.push(engine, 1, velocity=(along, 0, -across))
    engine.advance(4 + 2 * RESOLVED)
    state = engine.state().smarticles
    velocities, spins = state.velocities, state.link_spins[:, 1]
    energy = sum(kinetic(v[0], v[2], w[1]) for v, w in zip(velocities, spins, strict=True))
    return velocities[1, 0] - velocities[0, 0], -spins[:, 1].mean(), energy / kinetic(along, across, 0.0)


@case("grazing, plane", "a ball hits a plane at 76°, μ = 0.5", "impulse theory: v − μ(1 + e)v_n", pair=False)
@case("grazing, ball", "a ball hits an equal one at 76°, μ = 0.5", "impulse theory: v − μ(1 + e)v_n", pair=True)
def at_76_degrees(access: EngineAccess, *, pair: bool) -> list[Answer]:
    impulse = FRICTION * (1 + ELASTICITY) * SPEED * math.cos(math.radians(ANGLE))
    before = SPEED * math.sin(math.radians(ANGLE))
    along, spin, energy = grazing(access, ANGLE, dashpot=0.0, pair=pair)
    gains = [
        grazing(access, degrees, dashpot=dashpot, pair=pair)[2] - 1
        for degrees in (50.0, 65.0, ANGLE, 82.0, 88.0)
        for dashpot in (0.0, 0.9)
    ]
    # Energy that is left: of the normal velocity e², of the others what the impulse leaves.
    share = 0.5 if pair else 1.0
    normal = (SPEED * math.cos(math.radians(ANGLE))) ** 2
    lost = normal * (1 - ELASTICITY**2) * share + 2 * before * impulse * share - impulse**2 * share * (1 + 1 / SOLID)
    return [
        Answer("velocity lost along the contact [m/s]", impulse, before - along, 0.01, SLIDES),
        Answer("spin [rad/s]", -impulse * share / (SOLID * RADIUS), spin, 0.01, f"{SLIDES}; the contact's depth"),
        Answer("kinetic energy, over that before [1]", 1 - lost / SPEED**2, energy, 0.01, SLIDES),
        Answer("gain of kinetic energy, largest, 50° to 88° [1]", 0.0, max(0.0, *gains), 1e-12, GUARD, scale=1.0),
        recorded("kinetic energy, over that before [1]", GRAZING[access.name][pair], energy),
    ]


# -- a short rod -------------------------------------------------------------------------------------------------------


@case(
    "short rod of a scene",
    "a rod as long as it is thick slides over a plane, across its axis and along it",
    "impulse theory, with the moments of a cylinder: m R²/2 about the axis, m (3 R² + L²)/12 across it",
    absent={"yade": "the test sets velocities of bodies of bars on links only"},
)
def short_rod(access: EngineAccess) -> list[Answer]:
    length, speed, slip, friction = 2 * RADIUS * 1.001, 0.2, 1.5, 0.3
    one = scene_of(
        {
            "schema_version": 1,
            "engine": access.name,
            "seed": 1,
            "count": 1,
            "particle": {"shape": "rod", "length_m": length, "diameter_m": 2 * RADIUS, "density_kg_per_m3": DENSITY},
            "container": {"radius_m": 0.1},
            "gravity_m_per_s2": 1e-6,
            "contact": {"friction_wall": friction, "restitution": 0.9, "tangential_damping_ratio": 0},
            "fidelity": {"base": "draft", "stiffness_N_per_m": 1e6},
            "phases": [{"type": "deposit", "per_layer": 1}, RELAX],
        }
    )
    mass = DENSITY * math.pi * RADIUS**2 * length
    dt = math.pi * math.sqrt(mass / 2e6) / RESOLVED
    answers = []
    for name, axis, inertia in (("across", 1, RADIUS**2 / 2), ("along", 0, (3 * RADIUS**2 + length**2) / 12)):
        engine = build_engine(one, dt)
        assert isinstance(engine, LinksEngine)
        place = np.array([[0.0, 0.0, RADIUS + 3.3 * speed * dt]])
        engine.add(Poses(place, (Rotation.identity(),), np.zeros(1, np.int64)))
        velocity = np.array([0.0, 0.0, -speed])
        velocity[axis] = slip
        engine._world.bodies.velocity[0] = velocity
        engine.advance(4 + 2 * RESOLVED)
        state = engine.state()
        assert isinstance(state, RigidState)
        impulse = friction * (speed + state.velocities[0, 2])  # over the mass, as friction law and normal velocity say
        spin = float(np.linalg.norm(state.spins[0]))
        lost = float(slip - state.velocities[0, axis])
        answers += [
            Answer(f"velocity lost, {name} [m/s]", impulse, lost, 0.01, SLIDES),
            Answer(f"spin, {name} [rad/s]", impulse * RADIUS / inertia, spin, 0.01, f"{SLIDES}; the contact's depth"),
        ]
    return answers
