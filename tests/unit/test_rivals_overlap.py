"""Overlaps of smarticles against known answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.rivals.overlap import Bars
from postprocess.measures.contacts import segment_distances

Array = NDArray[np.float64]
PAIR = np.array([[0, 1]])
POINTS = arrays(np.float64, (4, 3), elements=st.floats(-1, 1).map(lambda x: round(x, 3)))
HALF = np.array([6e-3, 0.25e-3, 0.635e-3])  # of a link's box [m]


def bars(turns: list[Rotation], apart: list[float]) -> Bars:
    """Two bars, the first at the origin."""
    centres = np.array([[0.0, 0.0, 0.0], apart])
    return Bars(centres, np.array([turn.as_matrix() for turn in turns]), np.array([HALF, HALF]), np.arange(2))


@pytest.mark.parametrize("depth", [-1e-4, 1e-5, 2e-4])
def test_crossed_bars_are_as_deep_as_their_faces(depth: float) -> None:
    across = Rotation.from_euler("z", 90, degrees=True)
    found = bars([Rotation.identity(), across], [1e-3, -2e-3, 2 * HALF[2] - depth]).depths(PAIR)
    assert found == pytest.approx([depth], abs=1e-15)


@pytest.mark.parametrize("depth", [-1e-4, 1e-5, 1e-4])
def test_bars_that_cross_on_their_edges_are_as_deep_as_their_diagonals(depth: float) -> None:
    # On edges both stand half a diagonal high, and the way out is along the common normal of the two edges.
    tilt = math.atan2(HALF[1], HALF[2])
    first = Rotation.from_euler("x", tilt)
    second = Rotation.from_euler("z", 90, degrees=True) * first
    high = 2 * math.hypot(HALF[1], HALF[2])
    assert bars([first, second], [0.0, 0.0, high - depth]).depths(PAIR) == pytest.approx([depth], abs=1e-15)


@given(points=POINTS)
def test_segments_are_as_far_apart_as_their_nearest_points(points: Array) -> None:
    shares = np.linspace(0, 1, 401)[:, None]
    one = points[0] + shares * (points[1] - points[0])
    other = points[2] + shares * (points[3] - points[2])
    nearest = float(np.linalg.norm(one[:, None] - other[None], axis=-1).min())
    found = float(segment_distances(*(point[None] for point in points))[0])
    # A point is at most half a piece of each segment from the nearest one that was tried.
    pieces = (np.linalg.norm(points[1] - points[0]) + np.linalg.norm(points[3] - points[2])) / 800
    assert nearest - pieces - 1e-12 <= found <= nearest + 1e-12
