"""The container moves as prescribed, and what it feels is recorded exactly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cases
import numpy as np
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]
F, GAMMA, G = 30.0, 2.0, 9.81


@pytest.mark.parametrize("delay", [0, 37])
def test_container_follows_the_sine_without_drift(simulate: Simulate, scene_data: SceneData, delay: int) -> None:
    shake = simulate(cases.shake, scene_data(), periods=20, delay=delay, rest=30)
    amplitude = GAMMA * G / (2 * np.pi * F) ** 2
    assert shake["amplitude"] == pytest.approx(amplitude, rel=1e-12)
    assert shake["elapsed"] == pytest.approx(shake["time"][-1], rel=1e-9)
    assert shake["elapsed"] == pytest.approx(20 / F, abs=shake["dt"])
    expected = amplitude * np.sin(2 * np.pi * F * shake["time"])
    error = (shake["z"] - expected) / amplitude
    # Second order in the step: (ω dt)²/24 is 1e-5 at 7e-5 s.
    assert np.abs(error).max() < 1e-3
    last = error[-round(1 / F / shake["dt"]) :]
    assert abs(last.mean()) < 1e-4  # no drift over 20 periods
    assert shake["z"].max() == pytest.approx(amplitude, rel=1e-3)
    assert shake["z"].min() == pytest.approx(-amplitude, rel=1e-3)
    # Wall and floor move as one.
    assert shake["wall_moved"] == pytest.approx(shake["z"][-1], abs=1e-12)


def test_recorded_force_is_the_mean_over_every_step(simulate: Simulate, scene_data: SceneData) -> None:
    shaken = simulate(cases.shaken_force, scene_data(), count=5, samples=25, every=40)
    weight = shaken["weight"]
    assert np.abs(shaken["steps"][:, 2]).max() > 3 * weight  # impacts, not a pile at rest
    assert shaken["steps"][:, 2].mean() < 0  # downwards
    # Exact but for rounding of momenta.
    assert shaken["balance"] == pytest.approx(shaken["steps"], abs=1e-6 * weight)
