"""Contacts: piles and stacks at rest. Rebound and friction have their theory: see `test_verification.py`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cases
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]


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
