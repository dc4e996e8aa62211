"""A turntable's pictures show the same thing from all around, at one distance."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from synthetic import RADIUS, SyntheticRun, W, u_shape, write_frame, write_run

from postprocess.pictures.turntable import turned_extent, turntable


def coloured(content: bytes) -> np.ndarray:
    """Which pixels are a smarticle's: clearly not grey."""
    image = np.asarray(Image.open(io.BytesIO(content)).convert("RGB")).astype(int)
    found: np.ndarray = np.ptp(image, axis=2) > 60
    return found


def test_what_is_on_the_right_is_on_the_left_from_behind_and_nearer_in_between(tmp_path: Path) -> None:
    write_run(tmp_path, SyntheticRun(count=2, frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    aside = u_shape(0.7 * W) / 4 + np.array([0.75 * RADIUS, 0.0, 0.003])  # at x > 0, small
    other = u_shape(0.7 * W) / 4 + np.array([0.0, 0.0, 0.003])
    write_frame(tmp_path / "frames/frame_000000.vtu", np.stack([aside, other]), time=0.5, phase=0)
    right, near, left, far = (coloured(one) for one in turntable(tmp_path, views=4, color_by="id"))

    def centre(seen: np.ndarray) -> tuple[float, float]:
        rows, columns = np.nonzero(seen)
        return float(columns.mean() / seen.shape[1] - 0.5), float(rows.mean() / seen.shape[0] - 0.5)

    assert centre(right)[0] > 0.1
    assert centre(left)[0] < -0.1
    assert centre(right)[0] == pytest.approx(-centre(left)[0], abs=0.01)
    assert abs(centre(near)[0]) < 0.02 > abs(centre(far)[0])
    # The camera looks down: what is nearer is lower, and larger.
    assert centre(near)[1] > centre(far)[1] + 0.1
    assert near.sum() > 1.1 * far.sum()


def test_room_is_the_same_from_every_side() -> None:
    points = np.array([[3.0, 4.0, 0.0], [0.0, 1.0, 7.0], [0.1, 0.0, 2.0]])
    found = turned_extent(points)
    assert np.hypot(found[:, 0], found[:, 1]).max() == pytest.approx(5.0)
    assert found[:, 2].max() == 7.0
    for axis in (0, 1):
        assert found[:, axis].max() == pytest.approx(-found[:, axis].min()) == pytest.approx(5.0)
    assert len(turned_extent(np.zeros((2, 3)))) > 0
