"""Motions against hand-computed angles, and their extremes and speeds against dense sampling."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import TypeAdapter

from dem.setting.motion import Motion

ADAPTER: TypeAdapter[Motion] = TypeAdapter(Motion)


def motion(**data: Any) -> Motion:
    return ADAPTER.validate_python(data)


def angles_of(found: Motion, times: Any, start: float) -> NDArray[np.float64]:
    """Angles [rad] of a motion that begins at `start` [rad]."""
    begun, times = np.array(start), np.asarray(times, dtype=float)
    return found.course(begun, begun)(times) + np.zeros_like(times)


def extent_of(found: Motion, start: float, until: float) -> tuple[float, float, float]:
    """Lowest and highest angle [rad] and greatest speed [rad/s] up to a time [s]."""
    begun = np.array(start)
    lows, highs, speeds = zip(*(leg.extent() for leg in found.legs(begun, begun, until)), strict=True)
    return min(map(float, lows)), max(map(float, highs)), max(speeds)


def degrees(data: dict[str, Any], times: Any, start: float = 90.0) -> NDArray[np.float64]:
    """Angles [deg] of a motion that begins at `start` [deg]."""
    return np.degrees(angles_of(motion(**data), times, math.radians(start)))


def ramp(to: float, length: float) -> dict[str, Any]:
    return {"type": "ramp", "to_deg": to, "duration_s": length}


def hold(length: float | None = None) -> dict[str, Any]:
    return {"type": "hold", "duration_s": length}


def back(length: float) -> dict[str, Any]:
    return {"type": "return", "duration_s": length}


def sequence(*steps: dict[str, Any], repeat: int | None = 1) -> dict[str, Any]:
    return {"type": "sequence", "steps": list(steps), "repeat": repeat}


def sine(**changes: Any) -> dict[str, Any]:
    return {"type": "sine", "centre_deg": 60.0, "amplitude_deg": 20.0, "frequency_hz": 2.0, **changes}


def triangle(**changes: Any) -> dict[str, Any]:
    # 20° at 2π/9 rad/s = 40°/s: a quarter of a cycle takes 0.5 s.
    data = {"type": "triangle", "centre_deg": 60.0, "amplitude_deg": 20.0, "speed_rad_per_s": 2 * math.pi / 9}
    return {**data, **changes}


@pytest.mark.parametrize(
    ("data", "times", "expected"),
    [
        (hold(), [0, 1, 100], [90, 90, 90]),
        (ramp(0, 1.5), [0, 0.5, 0.75, 1.5, 9], [90, 60, 45, 0, 0]),
        (ramp(105, 1), [0, 0.5, 1], [90, 97.5, 105]),
        (back(1), [0, 0.5, 1], [90, 90, 90]),
        (sine(), [0, 1 / 24, 1 / 8, 1 / 4, 3 / 8, 1 / 2], [60, 70, 80, 60, 40, 60]),
        (sine(cycles_offset=0.25), [0, 1 / 8, 1 / 4, 3 / 8], [80, 60, 40, 60]),
        (triangle(), [0, 0.25, 0.5, 0.75, 1, 1.5, 2, 2.25], [60, 70, 80, 70, 60, 40, 60, 70]),
        (triangle(cycles_offset=0.75), [0, 0.25, 0.5, 1], [40, 50, 60, 80]),
        (triangle(cycles_offset=-0.25), [0, 0.25, 0.5, 1], [40, 50, 60, 80]),
    ],
)
def test_angles_by_hand(data: dict[str, Any], times: list[float], expected: list[float]) -> None:
    assert degrees(data, times) == pytest.approx(expected, abs=1e-9)


def test_steps_begin_where_the_one_before_ended() -> None:
    data = sequence(ramp(0, 1.5), hold(0.5), ramp(30, 1), hold(1), back(2))
    times = [0, 0.75, 1.5, 1.9, 2.0, 2.5, 3.0, 3.9, 5, 6, 7]
    assert degrees(data, times) == pytest.approx([90, 45, 0, 0, 0, 15, 30, 30, 60, 90, 90], abs=1e-9)
    assert motion(**data).duration == 6
    assert motion(**data).period is None


def test_sequences_within_sequences() -> None:
    wave = sequence(ramp(80, 0.5), ramp(40, 0.5), repeat=2)
    data = sequence(ramp(40, 1), wave, back(1))
    assert degrees(data, [1, 1.5, 2, 2.5, 3, 3.5, 4]) == pytest.approx([40, 80, 40, 80, 40, 65, 90], abs=1e-9)
    # `return` leads to the beginning of the phase, not of the inner sequence.
    inner = sequence(ramp(40, 1), sequence(ramp(0, 1), back(1)), repeat=None)
    assert degrees(inner, [1, 2, 3, 4, 5, 6]) == pytest.approx([40, 0, 90, 40, 0, 90], abs=1e-9)


ANGLES = st.floats(-15, 105)
LENGTHS = st.floats(0.1, 3)
STEPS = st.one_of(
    st.builds(ramp, ANGLES, LENGTHS),
    st.builds(hold, LENGTHS),
    st.builds(back, LENGTHS),
    st.builds(
        sine,
        centre_deg=ANGLES,
        amplitude_deg=st.floats(0.1, 40),
        frequency_hz=st.floats(0.1, 5),
        cycles_offset=st.floats(-2, 2),
        duration_s=LENGTHS,
    ),
    st.builds(
        triangle,
        centre_deg=ANGLES,
        amplitude_deg=st.floats(1, 40),
        speed_rad_per_s=st.floats(0.1, 6),
        cycles_offset=st.floats(-2, 2),
        duration_s=LENGTHS,
    ),
)
SEQUENCES = st.builds(
    lambda steps, repeat: sequence(*steps, repeat=repeat), st.lists(STEPS, min_size=1, max_size=4), st.integers(1, 3)
)
MOTIONS = st.one_of(
    STEPS, SEQUENCES, st.builds(lambda a, b, c, n: sequence(a, b, c, repeat=n), STEPS, SEQUENCES, STEPS, st.just(2))
)


@settings(max_examples=150)
@given(data=MOTIONS, start=ANGLES, share=st.floats(0.05, 1.5))
def test_extremes_are_those_of_dense_sampling(data: dict[str, Any], start: float, share: float) -> None:
    found, begun = motion(**data), math.radians(start)
    until = share * found.duration
    times = np.linspace(0, until, 20_001)
    angles = angles_of(found, times, begun)
    low, high, speed = extent_of(found, begun, until)
    reach = speed * times[1]  # between two samples
    # Both ways: nothing lies outside, and the extremes are met. Of a jump, only one side falls on a sample.
    assert low - 1e-9 <= angles.min() <= low + reach + 1e-9
    assert high - reach - 1e-9 <= angles.max() <= high + 1e-9


@given(data=STEPS, start=ANGLES)
def test_speed_is_that_of_dense_sampling(data: dict[str, Any], start: float) -> None:
    found, begun = motion(**data), math.radians(start)
    # Several periods, beyond the length of a swing, so that its fastest point is among them.
    length = found.duration if found.period is None else 3 * found.period
    times = np.linspace(0, length, 20_001)
    steepest = np.abs(np.diff(angles_of(found, times, begun))).max() / times[1]
    assert steepest == pytest.approx(extent_of(found, begun, math.inf)[2], rel=1e-3, abs=1e-6)


@given(data=SEQUENCES, start=ANGLES, share=st.floats(0.01, 0.99))
def test_from_the_second_time_on_a_sequence_is_periodic(data: dict[str, Any], start: float, share: float) -> None:
    found = motion(**{**data, "repeat": None})
    assert found.period is not None
    times = found.period * (np.array([1, 2, 3, 7]) + share)
    # A jump may fall to either side of a time by rounding: the angle a moment earlier or later is as good.
    angles = [angles_of(found, times + shift, math.radians(start)) for shift in (0, -1e-9, 1e-9)]
    for other in range(1, 4):
        assert min(abs(row[other] - angles[0][0]) for row in angles) < 1e-6
