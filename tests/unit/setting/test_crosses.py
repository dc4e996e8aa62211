"""Crosses as smarticles that are poured see them."""

import numpy as np
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
