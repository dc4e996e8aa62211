"""One smarticle without contact weighs and turns as the boxes do. Fall and spin: see `test_verification.py`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cases
import numpy as np
import pytest

pytestmark = pytest.mark.engine

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]


@pytest.mark.parametrize("changes", [{}, {"smarticle.angles_deg": [20, 100], "fidelity": "reference"}])
def test_mass_and_inertia_are_the_boxes_in_every_pose(
    simulate: Simulate, scene_data: SceneData, changes: dict[str, Any]
) -> None:
    data = scene_data({"smarticle.aspect_ratio": 0.6, **changes})
    found = simulate(cases.poses, data, count=12, seed=3, steps=40)
    boxes = cases.scene_of(data).smarticle.boxes
    assert found["masses"] == pytest.approx(np.full(12, boxes.mass), rel=1e-14)
    # What was asked for is what is there, before any step.
    assert found["start"] == pytest.approx(found["asked"], abs=1e-14)
    assert found["start_positions"] == pytest.approx(found["asked_positions"], abs=1e-15)
    # After some turning the tensor is the boxes', turned with the pose that `state` reports. Rounding only.
    turned = found["rotations"]
    assert np.abs(turned - found["asked"]).max() > 0.01
    expected = np.einsum("nij,j,nkj->nik", turned, boxes.inertia, turned)
    assert found["tensors"] == pytest.approx(expected, abs=1e-12 * boxes.inertia.max())
    assert found["spheres"] == pytest.approx(found["expected_spheres"], abs=1e-12)


def test_what_is_thrown_falls_from_that_speed_on(simulate: Simulate, scene_data: SceneData) -> None:
    found = simulate(cases.thrown, scene_data(), speed=2.0, duration=0.02)
    time, g = found["time"], 9.81
    assert found["speeds"] == pytest.approx(np.full(2, 2.0 + g * time), rel=1e-9)
    # Of first order: velocities belong to the middles of steps.
    assert found["fallen"] == pytest.approx(np.full(2, 2.0 * time + g * time**2 / 2), abs=g * time * found["step"])
    # Forces on the container are taken from this balance: nothing has been felt.
    assert -found["momentum"][2] == pytest.approx(found["impulse"], rel=1e-9)
    assert found["added"] == pytest.approx(found["energy"], rel=1e-12)
