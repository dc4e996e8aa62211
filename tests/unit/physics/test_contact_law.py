"""Damping from restitution, a scene's numbers in its contact law, and strings."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import small
from scipy.integrate import solve_ivp

from dem.engine.demand import contact_law_of
from dem.physics.contact import StringLaw, damping_ratio, restitution_of, typical_effective_mass


def rebound(zeta: float) -> float:
    """x'' = -x - 2ζx' from first touch until the force would pull, integrated: no closed form."""

    def pull(_: float, y: np.ndarray) -> float:
        return y[0] + 2 * zeta * y[1]

    pull.terminal, pull.direction = True, -1  # type: ignore[attr-defined]
    solution = solve_ivp(
        lambda _, y: [y[1], -y[0] - 2 * zeta * y[1]], (0, 100), [0.0, 1.0], events=pull, rtol=1e-10, atol=1e-12
    )
    return float(-solution.y_events[0][0][1])


@pytest.mark.parametrize("zeta", [1e-3, 0.1, 0.5, 0.70711, 0.95, 1.0, 1.5, 3.0])
def test_restitution_of_a_contact_that_never_pulls(zeta: float) -> None:
    assert restitution_of(zeta) == pytest.approx(rebound(zeta), rel=1e-6)


@given(st.floats(0.01, 0.9999))
def test_damping_ratio_inverts_it(restitution: float) -> None:
    assert restitution_of(damping_ratio(restitution)) == pytest.approx(restitution, rel=1e-9)


def test_typical_mass_by_random_pushes() -> None:
    particle = small().body
    pushes = np.random.default_rng(4).normal(size=(4000, 3))
    pushes /= np.linalg.norm(pushes, axis=1)[:, None]
    arms = np.cross(particle.centres[:, None], pushes[None])
    mobility = 1 / particle.boxes.mass + (arms**2 / particle.boxes.inertia).sum(axis=-1)
    # 4000 directions for each of some twenty spheres: the mean scatters by 0.5 %.
    assert typical_effective_mass(particle) == pytest.approx(1 / mobility.mean(), rel=0.02)
    assert typical_effective_mass(particle) < 0.7 * particle.boxes.mass


def test_law_carries_the_scenes_numbers() -> None:
    scene = small(
        {
            "contact.friction_smarticle": 0.3,
            "contact.friction_wall": 0.2,
            "contact.tangential_stiffness_ratio": 0.5,
            "contact.tangential_damping_ratio": 0.25,
            "contact.restitution": 0.4,
            "fidelity": {"stiffness_N_per_m": 800.0},
        }
    )
    law, mass = contact_law_of(scene), typical_effective_mass(scene.body)
    assert (law.normal_stiffness, law.tangential_stiffness) == (800, 400)
    assert (law.friction, law.wall_friction, law.tangential_damping) == (0.3, 0.2, 0.25)
    # The same damping ratio in both: against the wall one typical mass moves, between smarticles half of it.
    for damping, moved in ((law.wall_damping, mass), (law.normal_damping, mass / 2)):
        assert damping / (2 * math.sqrt(800 * moved)) == pytest.approx(damping_ratio(0.4), rel=1e-12)


def test_a_string_pulls_and_never_pushes() -> None:
    law = StringLaw(length=0.1, stiffness=5000.0, damping=2.0)
    assert law.tension(0.1001, 0.0) == pytest.approx(0.5)
    assert law.tension(0.1001, 0.1) == pytest.approx(0.7)
    assert law.tension(0.1001, -1.0) == 0
    assert law.tension(0.0999, 10.0) == 0
