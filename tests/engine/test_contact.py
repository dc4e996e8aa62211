"""Contacts: piles and stacks at rest. Rebound and friction have their theory: see `test_verification.py`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cases
import numpy as np
import pytest

pytestmark = pytest.mark.engine

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]


def test_without_friction_nothing_stops(simulate: Simulate, scene_data: SceneData) -> None:
    glide = simulate(cases.glide, scene_data({"contact.friction_wall": 0}), speed=0.3, duration=0.1)
    assert glide["v"] == pytest.approx(0.3, rel=1e-9)


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
