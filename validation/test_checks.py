"""Tests of the checks of bodies in `validation.checks`, each with a case that is right and one that is wrong."""

import numpy as np
import pytest

from validation.checks import GRAVITY, Array, Solid, axes_in_solids, floor_error, linked_pairs, unrest

CORNERS = 2 * np.pi * np.arange(12) / 12
RING = np.stack([np.cos(CORNERS), np.sin(CORNERS), 0 * CORNERS], axis=1)
BODY = np.repeat([0, 1], 12)


def bars_of(corners: Array) -> Array:
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


@pytest.mark.parametrize(("shift", "linked"), [((1.0, 0, 0), True), ((2.5, 0, 0), False), ((0.0, 0, 1.5), False)])
def test_a_ring_through_a_ring_is_linked(shift: tuple[float, float, float], linked: bool) -> None:
    upright = RING[:, [0, 2, 1]] + np.array(shift)
    ends = np.concatenate([bars_of(RING), bars_of(upright)])
    assert linked_pairs(ends, BODY) == ([(0, 1)] if linked else [])
    opened = np.delete(ends, 3, axis=0)  # a ring with a gap is no closed curve
    assert linked_pairs(opened, np.delete(BODY, 3)) == []


@pytest.mark.parametrize(
    ("height", "inside"),
    [(0.0, True), (0.9, True), (1.1, False)],  # the flat bar is 2 high and 0.4 wide
)
def test_an_axis_within_a_flat_bar_is_found(height: float, inside: bool) -> None:
    ends = np.array([[[-3.0, 0, 0], [3, 0, 0]], [[0, -3, height], [0, 3, height]]])
    normals = np.array([[0.0, 0, 1], [0, 0, 0]])
    found = axes_in_solids(ends, np.arange(2), normals, [Solid(1.0, 0.2), Solid(0.05, 0.05)])
    assert ((1, 0) in found) == inside


def test_bars_that_end_at_each_other_are_not_inside() -> None:
    ends = np.array([[[-3.0, 0, 0], [3, 0, 0]], [[0, 0, 0.5], [0, 0, 3.0]]])  # a bar stands on another one
    assert axes_in_solids(ends, np.arange(2), None, [Solid(0.5, 0.5)] * 2) == []


def test_a_pile_that_chatters_is_not_at_rest_and_one_that_rolls_is() -> None:
    still = np.zeros((10, 3, 3))
    turns = np.where(np.arange(10) % 2, 31.0, -31.0)[:, None, None] * np.ones((10, 3, 3))
    assert unrest(still, np.abs(turns), 1e-3) == 0
    assert unrest(still, turns, 1e-3) > 0.2


@pytest.mark.parametrize("taps", [None, 2])
def test_a_floor_that_stands_still_is_found(taps: int | None) -> None:
    frequency, start = 40.0, 0.3
    amplitude = 2 * GRAVITY / (2 * np.pi * frequency) ** 2
    phase = {"frequency_hz": frequency, "peak_acceleration_g": 2.0, **({"taps": 2, "rest_s": 0.1} if taps else {})}
    times = start + np.linspace(0, 0.02, 50)
    angle = 2 * np.pi * frequency * (times - start)
    right = amplitude * ((1 - np.cos(angle)) if taps else np.sin(angle))
    assert floor_error(times, right, phase, start) == pytest.approx(0, abs=1e-9)
    assert floor_error(times, 0 * right, phase, start) > 0.9
