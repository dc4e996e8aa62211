"""Damping from restitution, and the stable time step against a scheme that is iterated until it blows up."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scenes import small

from dem.engine.demand import contact_law_of
from dem.engine.yade.stable_step import CONTACTS_AT_A_TIP, stable_time_step
from dem.scene.scene import Scene


def limit_by_iteration(stiffness: float, damping: float, mass: float) -> float:
    """Largest stable step of leapfrog with the dashpot's velocity half a step late: bisection on blowing up."""

    def grows(dt: float) -> bool:
        x, v = 1.0, 0.0
        for _ in range(4000):
            v += dt * (-stiffness * x - damping * v) / mass
            x += dt * v
            if abs(x) > 1e3:
                return True
        return False

    low, high = 0.0, 4 * math.sqrt(mass / stiffness)
    for _ in range(16):
        middle = (low + high) / 2
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


def limit_of_a_flat_pile(scene: Scene, layers: int, *, rolling: bool = False) -> float:
    """The same for smarticles lying flat on each other, on the floor: eigenvalues of the damped leapfrog map.

    They move up and down, or all roll about the axis about which they have the least inertia.
    """
    particle, law = scene.particle, contact_law_of(scene)
    springs, neighbour, stiffness, share = len(particle.centres) / particle.boxes.mass, -1, law.normal_stiffness, 1.0
    if rolling:
        # Surfaces that face each other part where both roll in the same sense.
        tops = particle.centres[:, 2] + particle.radius
        springs, neighbour = (tops**2).sum() / particle.boxes.inertia[:2].min(), 1
        stiffness, share = law.tangential_stiffness, law.tangential_damping
    spring, dashpot = np.zeros((layers, layers)), np.zeros((layers, layers))
    for k in range(layers):
        pair = np.zeros(layers)
        pair[k] = 1
        if k:
            pair[k - 1] = neighbour
        spring += springs * stiffness * np.outer(pair, pair)
        dashpot += springs * share * (law.normal_damping if k else law.wall_damping) * np.outer(pair, pair)
    one, none = np.eye(layers), np.zeros((layers, layers))

    def grows(dt: float) -> bool:
        velocity = np.hstack([-dt * spring, one - dt * dashpot])
        step = np.vstack([np.hstack([one, none]) + dt * velocity, velocity])
        return bool(np.abs(np.linalg.eigvals(step)).max() > 1 + 1e-9)

    low, high = 0.0, 4 / math.sqrt(springs * stiffness)
    for _ in range(14):
        middle = (low + high) / 2
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


CHANGES: list[dict[str, object]] = [
    {},
    {"fidelity": "standard"},
    {"fidelity": "reference", "smarticle.aspect_ratio": 2},
    {"contact.restitution": 1, "smarticle.aspect_ratio": 0},
    {"contact.restitution": 0.05, "smarticle.aspect_ratio": 1},
    {"smarticle.aspect_ratio": 0.3, "fidelity": {"pitch": 1.4}},
    {"smarticle.aspect_ratio": 0.1},
    {"fidelity": "reference", "smarticle.aspect_ratio": 0},
]


@pytest.mark.parametrize("changes", CHANGES)
def test_stable_step_equals_the_limit_of_the_iterated_schemes(changes: dict[str, object]) -> None:
    scene = small(changes)
    particle, law = scene.particle, contact_law_of(scene)
    light, contacts = particle.smallest_effective_mass, CONTACTS_AT_A_TIP
    limits = [
        limit_by_iteration(contacts * law.normal_stiffness, contacts * damping, moved)
        for moved, damping in ((light / 2, law.normal_damping), (light, law.wall_damping))
    ]
    limits += [limit_of_a_flat_pile(scene, layers=24, rolling=rolling) for rolling in (False, True)]
    # 4000 steps see growth of 0.2 % a step; 24 layers come within 0.5 % of the endless pile, from above.
    assert stable_time_step(particle, law) == pytest.approx(min(limits), rel=0.01)


@pytest.mark.parametrize("layers", [1, 2, 3, 10])
@pytest.mark.parametrize("changes", CHANGES)
def test_stable_step_is_stable_for_piles_lying_flat(changes: dict[str, object], layers: int) -> None:
    scene = small(changes)
    assert stable_time_step(scene.particle, contact_law_of(scene)) <= limit_of_a_flat_pile(scene, layers) * (1 + 1e-3)
