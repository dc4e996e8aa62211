"""Welded smarticles: mass and inertia of the boxes, piles at rest, a container that moves as prescribed."""

from collections.abc import Callable
from typing import Any

import cases
import numpy as np
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]
F, GAMMA, G = 30.0, 2.0, 9.81


def test_mass_and_inertia_are_the_boxes_in_every_pose(simulate: Simulate, scene_data: SceneData) -> None:
    data = scene_data({"smarticle.aspect_ratio": 0.6, "smarticle.angles_deg": [20, 100], "fidelity": "reference"})
    found = simulate(cases.poses, data, count=12, seed=3, steps=40)
    boxes = cases.scene_of(data).smarticle.boxes
    assert found["masses"] == pytest.approx(np.full(12, boxes.mass), rel=1e-14)
    # Poses are those asked for, before any step.
    assert found["start"] == pytest.approx(found["asked"], abs=1e-14)
    assert found["start_positions"] == pytest.approx(found["asked_positions"], abs=1e-15)
    # After some turning the tensor is the boxes', turned with the pose that `state` reports. Rounding only.
    turned = found["rotations"]
    assert np.abs(turned - found["asked"]).max() > 0.01
    expected = np.einsum("nij,j,nkj->nik", turned, boxes.inertia, turned)
    assert found["tensors"] == pytest.approx(expected, abs=1e-12 * boxes.inertia.max())
    assert found["spheres"] == pytest.approx(found["expected_spheres"], abs=1e-12)


def test_container_follows_the_sine_without_drift(simulate: Simulate, scene_data: SceneData) -> None:
    shake = simulate(cases.shake, scene_data(), periods=20, delay=37)
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
