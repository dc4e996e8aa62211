"""Flat impacts of many spheres: n times stiffer than one, and damped by n dashpots that were sized for one."""

from __future__ import annotations

import math

import numpy as np

from dem.physics.contact import restitution_of, typical_effective_mass
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from validation.access import EngineAccess
from validation.bench import Array, G, add, law_of, lying, scene
from validation.cases import Answer, case
from validation.known.floor import lowest
from validation.known.theory import falling_on_springs

ROW = "a smarticle meets the floor with a whole row of spheres"
SPRINGS = "n springs and dashpots side by side, that never pull; integrated with the tilt"

SPEED = 0.1  # m/s
ROWS_AND_PITCHES = tuple((rows, pitch) for rows in (1, 2) for pitch in (1.3, 1.0, 0.5, 0.25))
STRANDS = ((1, 0.0), (2, 0.0))  # of whole links, which have no pitch


def _thrown(access: EngineAccess, one: Scene, dt: float) -> tuple[float, float]:
    """Return the restitution [1] and time in contact [s] of a flat throw."""
    engine = access.build(one.particle, law_of(one), dt=dt)
    add(engine, (0, 0, lying(one) + 3.3 * SPEED * dt))
    access.push(engine, 0, velocity=(0, 0, -SPEED))
    first = last = 0
    while not last or engine.steps < 2 * last - first + 50:
        engine.advance(1)
        if access.floor_force(engine)[2]:
            first, last = first or engine.steps, engine.steps
    energy = one.smarticle.boxes.mass * SPEED**2 / 2
    return math.sqrt(engine.state().kinetic_energy / energy), (last - first + 1) * dt


def _sunk(access: EngineAccess, one: Scene, dt: float, *, time: float) -> float:
    """Return how deep the centre of mass of a smarticle that lies flat has sunk [m]."""
    engine = access.build(one.particle, law_of(one), dt=dt, gravity=G)
    add(engine, (0, 0, lying(one)))
    engine.advance(round(time / dt))
    return lying(one) - float(engine.state().positions[0, 2])


def _sunk_theory(points: Array, *, stiffness: float, weight: float) -> float:
    """Return how deep it sinks on springs under points (n, 2) [m], of which it is not above the middle."""
    lift = np.stack([np.ones(len(points)), points[:, 1], -points[:, 0]], axis=1)
    return float(np.linalg.solve(stiffness * lift.T @ lift, [weight, 0.0, 0.0])[0])


def flat_impact(access: EngineAccess, *, rows: int, pitch: float, restitution: float = 0.7) -> dict[str, float]:
    """Throw a smarticle flat at the floor, and lay it there; a row of the table `clumps`."""
    fidelity = {"base": "standard", "rows": rows} | ({"pitch": pitch} if pitch else {})
    one = scene(access, fidelity=fidelity, contact={"restitution": restitution})
    law, boxes, points = law_of(one), one.smarticle.boxes, lowest(access, one.particle)
    stiffness, damping, mass, count = law.normal_stiffness, law.wall_damping, boxes.mass, len(points)
    springs = {"stiffness": stiffness, "damping": damping, "mass": mass}
    after, lasts = falling_on_springs(points, **springs, inertia=boxes.inertia[:2], speed=SPEED)
    energy = float((np.array([mass, *boxes.inertia[:2]]) * after**2).sum() / (mass * SPEED**2))
    period = 2 * math.pi * math.sqrt(mass / (count * stiffness))
    measured, contact = _thrown(access, one, period / 800)
    return {
        "rows": rows,
        "pitch": pitch,  # over the spheres' diameter; 0 where links are whole
        "spheres": len(one.particle.centres),
        "contacts": count,  # spheres that touch the floor
        "nominal": restitution,  # restitution that the scene asks for [1]
        # Restitution on all springs and dashpots side by side without tilting [1]; with tilting it is the root of
        # energy after over energy before.
        "parallel": restitution_of(count * damping / (2 * math.sqrt(count * stiffness * mass))),
        "theory": math.sqrt(energy),
        "measured": measured,
        "at_scene_step": _thrown(access, one, time_step(one))[0],  # a scene has few steps in a flat contact
        "theory_contact": lasts,  # from first touch to the end of the last contact [s]
        "measured_contact": contact,
        # Of one sphere of a tip, at the typical effective mass, elastic [s].
        "single_contact": math.pi * math.sqrt(typical_effective_mass(one.particle) / stiffness),
        # Depth of the centre of mass under the own weight [m], once the vibration has died away: a damping time is a
        # fraction of a period.
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
    """Return rows over the number of points that touch: of spheres, or of strands where links are whole."""
    settings = ROWS_AND_PITCHES if access.name == "yade" else STRANDS
    return [flat_impact(access, rows=rows, pitch=pitch) for rows, pitch in settings]
