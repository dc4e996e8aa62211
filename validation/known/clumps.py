"""What many spheres do to a flat impact.

A clump that meets the floor with n of them is n times stiffer, and is damped by n dashpots that were sized for one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dem.physics.contact import restitution_of, typical_effective_mass
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from validation.bench import Array, G, add, law_of, scene
from validation.case import case
from validation.check import Answer
from validation.engines import EngineAccess
from validation.known.floor import lowest
from validation.known.theory import falling_on_springs

ROW = "a smarticle meets the floor with a whole row of spheres"
SPRINGS = "n springs and dashpots side by side, that never pull; integrated with the tilt"

SPEED = 0.1  # m/s


@dataclass(frozen=True, kw_only=True)
class FlatImpact:
    """A smarticle thrown flat at the floor, and one lying there.

    Args:
        rows: of spheres across the thickness [1].
        pitch: of neighbouring spheres over their diameter; 0 where links are whole [1].
        spheres: of the smarticle [1].
        contacts: of them that touch the floor [1].
        nominal: restitution that the scene asks for [1].
        parallel: restitution of the body on all springs and dashpots side by side, without tilting [1].
        theory: the same with tilting: energy after over energy before, the root of it [1].
        measured: the same in the engine [1].
        at_scene_step: the same at the time step of a scene, which has few steps in a flat contact [1].
        theory_contact: from first touch to the end of the last contact [s].
        measured_contact: the same in the engine [s].
        single_contact: of one sphere of a tip, at the typical effective mass, elastic [s].
        theory_sunk: how deep the centre of mass lies under its own weight [m].
        measured_sunk: the same in the engine [m].
        step: time step of a scene of this smarticle [s].
    """

    rows: int
    pitch: float
    spheres: int
    contacts: int
    nominal: float
    parallel: float
    theory: float
    measured: float
    at_scene_step: float
    theory_contact: float
    measured_contact: float
    single_contact: float
    theory_sunk: float
    measured_sunk: float
    step: float


def flat_scene(access: EngineAccess, *, rows: int, pitch: float, restitution: float = 0.7) -> Scene:
    """A scene at the stiffness of `standard`, with spheres of its own."""
    fidelity = {"base": "standard", "rows": rows} | ({"pitch": pitch} if pitch else {})
    return scene(access, fidelity=fidelity, contact={"restitution": restitution})


def _thrown(access: EngineAccess, one: Scene, dt: float) -> tuple[float, float]:
    """Restitution [1] and time in contact [s] of a flat throw."""
    engine = access.build(one.particle, law_of(one), dt=dt)
    rest = one.particle.radius - float(one.particle.centres[:, 2].min())
    add(engine, (0, 0, rest + 3.3 * SPEED * dt))
    access.push(engine, 0, velocity=(0, 0, -SPEED))
    first = last = 0
    while not last or engine.steps < 2 * last - first + 50:
        engine.advance(1)
        if access.floor_force(engine)[2]:
            first, last = first or engine.steps, engine.steps
    energy = one.smarticle.boxes.mass * SPEED**2 / 2
    return math.sqrt(engine.state().kinetic_energy / energy), (last - first + 1) * dt


def _sunk(access: EngineAccess, one: Scene, dt: float, *, time: float) -> float:
    """How deep the centre of mass of a smarticle that lies flat has sunk [m]."""
    engine = access.build(one.particle, law_of(one), dt=dt, gravity=G)
    rest = one.particle.radius - float(one.particle.centres[:, 2].min())
    add(engine, (0, 0, rest))
    engine.advance(round(time / dt))
    return rest - float(engine.state().positions[0, 2])


def _sunk_theory(points: Array, *, stiffness: float, weight: float) -> float:
    """The same on springs under points (n, 2) [m]: the centre of mass is not above the middle of the springs."""
    lift = np.stack([np.ones(len(points)), points[:, 1], -points[:, 0]], axis=1)
    return float(np.linalg.solve(stiffness * lift.T @ lift, [weight, 0.0, 0.0])[0])


def flat_impact(access: EngineAccess, *, rows: int, pitch: float, restitution: float = 0.7) -> FlatImpact:
    """Throw a smarticle flat at the floor, and lay it there."""
    one = flat_scene(access, rows=rows, pitch=pitch, restitution=restitution)
    law, boxes, points = law_of(one), one.smarticle.boxes, lowest(access, one.particle)
    stiffness, damping, mass, count = law.normal_stiffness, law.wall_damping, boxes.mass, len(points)
    ratio = count * damping / (2 * math.sqrt(count * stiffness * mass))
    after, lasts = falling_on_springs(
        points, stiffness=stiffness, damping=damping, mass=mass, inertia=boxes.inertia[:2], speed=SPEED
    )
    energy = float((np.array([mass, *boxes.inertia[:2]]) * after**2).sum() / (mass * SPEED**2))
    period = 2 * math.pi * math.sqrt(mass / (count * stiffness))
    dt = period / 800
    measured, measured_contact = _thrown(access, one, dt)
    # As deep as weight and springs have it, once the vibration has died away: a damping time is a fraction of a period.
    measured_sunk = _sunk(access, one, period / 60, time=40 * period)
    return FlatImpact(
        rows=rows,
        pitch=pitch,
        spheres=len(one.particle.centres),
        contacts=count,
        nominal=restitution,
        parallel=restitution_of(ratio),
        theory=math.sqrt(energy),
        measured=measured,
        at_scene_step=_thrown(access, one, time_step(one))[0],
        theory_contact=lasts,
        measured_contact=measured_contact,
        single_contact=math.pi * math.sqrt(typical_effective_mass(one.particle) / stiffness),
        theory_sunk=_sunk_theory(points, stiffness=stiffness, weight=mass * G),
        measured_sunk=measured_sunk,
        step=time_step(one),
    )


@case("flat impact, spheres of draft", ROW, SPRINGS, rows=1, pitch=1.3)
@case("flat impact, spheres of reference", ROW, SPRINGS, rows=2, pitch=1.0)
def flat_checks(access: EngineAccess, *, rows: int, pitch: float) -> list[Answer]:
    found = flat_impact(access, rows=rows, pitch=pitch)
    reason = "contact begins within a step, 1/400 of an undamped one; the sum over n contacts is that of one"
    return [
        Answer("restitution, root of the energies [1]", found.theory, found.measured, 0.02, reason=reason),
        Answer("time in contact [s]", found.theory_contact, found.measured_contact, 0.05).because(
            "the last of the contacts ends slowly, as its force comes down to zero"
        ),
        Answer("depth under its own weight [m]", found.theory_sunk, found.measured_sunk, 1e-3).because(
            "what is left of the vibration after 40 periods"
        ),
    ]


ROWS_AND_PITCHES = tuple((rows, pitch) for rows in (1, 2) for pitch in (1.3, 1.0, 0.5, 0.25))


STRANDS = (1, 2)


def flat_impacts(access: EngineAccess) -> list[FlatImpact]:
    """Flat impacts over the number of points that touch: of spheres, or of strands where links are whole."""
    settings = ROWS_AND_PITCHES if access.name == "yade" else [(rows, 0.0) for rows in STRANDS]
    return [flat_impact(access, rows=rows, pitch=pitch) for rows, pitch in settings]
