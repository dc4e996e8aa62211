"""One smarticle without contact weighs and turns as the boxes do. Fall and spin: see `test_verification.py`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cases
import numpy as np
import pytest

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
