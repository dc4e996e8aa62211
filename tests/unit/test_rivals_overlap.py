"""Overlaps of smarticles against known answers."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.rivals.overlap import Bars

PAIR = np.array([[0, 1]])
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
