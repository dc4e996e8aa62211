"""Contacts: rebound, friction, rest. The answer is on paper; the engine has to give it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import cases
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dem.timestep import typical_effective_mass

pytestmark = pytest.mark.engine

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]
G = 9.81


def restitution(stiffness: float, damping: float, mass: float) -> float:
    """Rebound of m x'' = -k x - c x' from first touch until the force would pull, integrated."""
    omega = math.sqrt(stiffness / mass)
    zeta = damping / (2 * mass * omega)

    def pull(_: float, y: np.ndarray) -> float:
        return y[0] + 2 * zeta * y[1]

    pull.terminal, pull.direction = True, -1  # type: ignore[attr-defined]
    solution = solve_ivp(
        lambda _, y: [y[1], -y[0] - 2 * zeta * y[1]], (0, 10), [0.0, 1.0], events=pull, rtol=1e-10, atol=1e-12
    )
    return float(-solution.y_events[0][0][1])


@pytest.mark.parametrize("asked", [0.2, 0.5, 0.9])
def test_rebound_from_the_floor(simulate: Simulate, scene_data: SceneData, asked: float) -> None:
    # An upright bar on its end: the force passes through the centre of mass, so the moved mass is the bar's.
    data = scene_data({"smarticle.aspect_ratio": 0, "contact.restitution": asked})
    fall = simulate(cases.rebound, data, speed=0.5, refine=8)
    law = fall["law"]
    expected = restitution(law["normal_stiffness"], law["wall_damping"], fall["mass"])
    # A hundredth: contact begins and ends within a step, which is some 1/150 of it.
    assert fall["after"][2] / 0.5 == pytest.approx(expected, rel=0.01)
    assert np.abs(fall["spin"]).max() < 1e-9


@pytest.mark.parametrize("asked", [0.2, 0.5, 0.9])
def test_rebound_of_two_smarticles(simulate: Simulate, scene_data: SceneData, asked: float) -> None:
    data = scene_data({"smarticle.aspect_ratio": 0, "contact.restitution": asked})
    pair = simulate(cases.collide, data, speed=0.5, refine=8)
    law = pair["law"]
    expected = restitution(law["normal_stiffness"], law["normal_damping"], pair["mass"] / 2)
    assert np.diff(pair["after"][:, 2])[0] / 0.5 == pytest.approx(expected, rel=0.01)
    assert np.abs(pair["after"].sum(axis=0)).max() < 1e-12  # momentum


@pytest.mark.parametrize("asked", [0.05, 0.2, 0.8])
def test_rebound_of_the_typical_mass_is_the_one_asked_for(
    simulate: Simulate, scene_data: SceneData, asked: float
) -> None:
    # The same bar, but with the law's dashpots sized for its own mass instead of the typical one.
    data = scene_data({"smarticle.aspect_ratio": 0, "contact.restitution": asked})
    typical = typical_effective_mass(cases.load(data).particle)
    fall = simulate(cases.rebound, data, speed=0.5, refine=8, resize=True)
    assert fall["mass"] > 1.3 * typical
    assert fall["after"][2] / 0.5 == pytest.approx(asked, rel=0.03)


@pytest.mark.parametrize(("aspect_ratio", "friction"), [(0.7, 0.4), (0.7, 0.2), (0.3, 0.4)])
def test_sliding_stops_by_coulombs_law(
    simulate: Simulate, scene_data: SceneData, aspect_ratio: float, friction: float
) -> None:
    speed = 0.3
    data = scene_data({"smarticle.aspect_ratio": aspect_ratio, "contact.friction_wall": friction})
    slide = simulate(cases.slide, data, speed=speed, duration=1.5 * speed / (friction * G))
    sliding = slide["time"] < 0.8 * speed / (friction * G)
    slope = np.polyfit(slide["time"][sliding], slide["v"][sliding], 1)[0]
    # The pile-up of the first millisecond and rocking on stiff contacts: 0.5 %.
    assert slope == pytest.approx(-friction * G, rel=5e-3)
    assert slide["y"][-1] - slide["y"][0] == pytest.approx(speed**2 / (2 * friction * G), rel=5e-3)
    assert abs(slide["v"][-1]) < 1e-4  # it sticks
    assert abs(slide["x"]) < 1e-9
    assert np.abs(slide["spin"]).max() < 0.01


def test_without_friction_nothing_stops(simulate: Simulate, scene_data: SceneData) -> None:
    slide = simulate(cases.slide, scene_data({"contact.friction_wall": 0}), speed=0.3, duration=0.1)
    assert slide["v"][-1] == pytest.approx(0.3, rel=1e-9)


def test_pile_at_rest_weighs_what_it_weighs(simulate: Simulate, scene_data: SceneData) -> None:
    pile = simulate(cases.pile, scene_data(), count=5, settle=0.5, watch=400)
    weight = pile["weight"]
    for force in (pile["forces"].mean(axis=0), pile["balance"]):
        # 0.5 %: what is left of the motion after half a second.
        assert force == pytest.approx([0, 0, -weight], abs=5e-3 * weight)
    assert pile["speed"] < 1e-3
    assert pile["unbalanced"] < 0.05
    # Each rests on something, and touching is mutual.
    assert pile["touches"].min() > 0
    assert pile["contacts"].sum() % 2 == 0
    assert (pile["contacts"] <= pile["touches"]).all()


def chatter(simulate: Simulate, data: dict[str, Any], layers: int, times_stable: float | None = None) -> float:
    """Largest speed [m/s] of smarticles lying flat on each other, 0.3 s after they were let go."""
    stack = simulate(cases.stack, data, layers=layers, settle=0.3, watch=0.02, times_stable=times_stable)
    if times_stable is None or times_stable <= 1:
        expected = (np.arange(layers) + 0.5) * stack["thick"]
        assert stack["z"] == pytest.approx(expected, abs=0.2 * stack["thick"])  # still stacked: this is what is tested
    return float(stack["fastest"])


RESTS = 1e-4  # m/s; at rest it is 1e-15


@pytest.mark.parametrize("aspect_ratio", [0.4, 0.7, 2.0])
@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_smarticle_lying_flat_comes_to_rest(
    simulate: Simulate, scene_data: SceneData, fidelity: str, aspect_ratio: float
) -> None:
    data = scene_data({"fidelity": fidelity, "smarticle.aspect_ratio": aspect_ratio})
    assert chatter(simulate, data, layers=1) < RESTS


@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_flat_smarticle_chatters_above_the_stable_step(
    simulate: Simulate, scene_data: SceneData, fidelity: str
) -> None:
    # What these tests see if the step is too large. Two layers are softer than the endless pile that rules the step.
    assert chatter(simulate, scene_data({"fidelity": fidelity}), layers=2, times_stable=1.6) > 3 * RESTS


@pytest.mark.parametrize(
    ("fidelity", "layers"),
    [("draft", 2), ("draft", 3), ("draft", 5), ("standard", 2), ("standard", 3), ("reference", 3)],
)
def test_stack_of_flat_smarticles_comes_to_rest(
    simulate: Simulate, scene_data: SceneData, fidelity: str, layers: int
) -> None:
    assert chatter(simulate, scene_data({"fidelity": fidelity}), layers=layers) < RESTS


@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_bar_lying_on_the_floor_comes_to_rest(simulate: Simulate, scene_data: SceneData, fidelity: str) -> None:
    # Without barbs it can roll, and its moment about its own axis is small.
    assert chatter(simulate, scene_data({"fidelity": fidelity, "smarticle.aspect_ratio": 0}), layers=1) < RESTS


def test_unbalanced_force_is_that_of_the_forces(simulate: Simulate, scene_data: SceneData) -> None:
    # Some of 64 smarticles at rest balance gravity to the last bit. One of them adds its weight to the mean.
    for aspect_ratio in (0.1, 0.2, 0.4, 0.7):
        data = scene_data({"fidelity": "standard", "smarticle.aspect_ratio": aspect_ratio})
        still = simulate(cases.still, data, count=16, settle=0.3)
        assert still["touching"] >= 16
        assert still["summed"] < 1e-6
        assert still["said"] == pytest.approx(still["summed"], abs=1e-6)
