"""Crosses as smarticles that are poured see them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dem.setting.hooks import Cross


@given(
    side=st.floats(2e-4, 5e-3),
    length=st.floats(5e-3, 3e-2),
    diameter=st.floats(4e-4, 2e-3),
    place=st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)),
    grid=st.tuples(st.integers(0, 9), st.integers(1, 5)),
)
def test_obstacles_keep_spheres_off_the_bars(
    side: float, length: float, diameter: float, place: tuple[float, float, float], grid: tuple[int, int]
) -> None:
    bar, count = grid
    cross = Cross(height=0.01, side=side, length=max(length, side), count=count)
    assert len(cross.bars) == 2 * count
    middle, half = cross.bars[bar % len(cross.bars)]
    point = np.array(place) * half + [*middle, 0.01]
    nearest = np.linalg.norm(cross.obstacles(diameter) - point, axis=1).min()
    # A sphere a diameter away from every obstacle is farther than its radius from any point of a bar.
    assert nearest < diameter / 2


def test_a_grid_is_even_and_ends_at_its_disc() -> None:
    cross = Cross(height=0.01, side=5e-4, length=0.04, count=3)
    assert [bar.middle for bar in cross.bars[::2]] == [(0.0, -0.01), (0.0, 0.0), (0.0, 0.01)]
    assert [bar.middle for bar in cross.bars[1::2]] == [(-0.01, 0.0), (0.0, 0.0), (0.01, 0.0)]
    for (x, y), (a, b, c) in cross.bars:
        # The middle of a bar's end is on the circle.
        assert np.hypot(x + (a if a > b else 0), y + (b if b > a else 0)) == pytest.approx(0.02)
        assert (min(a, b), c) == (2.5e-4, 2.5e-4)
    assert 0.02 < cross.reach < 0.02 + 5e-4
    assert Cross(height=0.01, side=5e-4, length=0.04).half_extents == (
        (0.02, 2.5e-4, 2.5e-4),
        (2.5e-4, 0.02, 2.5e-4),
    )
