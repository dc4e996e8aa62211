"""Time left: list scheduling of what is expected, corrected by what is seen."""

from __future__ import annotations

import pytest

from templates.local.estimate import PhaseClock, time_left


@pytest.mark.parametrize(
    ("running", "pending", "slots", "left"),
    [
        ([], [], 2, 0),
        ([(3.0, 0.0, 0.0)], [], 2, 3),
        ([(4.0, 1.0, 0.0), (2.0, 1.0, 0.0)], [4.0, 1.0], 2, 5),
        ([], [5.0, 4.0, 3.0, 3.0], 2, 8),
        ([], [5.0], 1, 5),
    ],
)
def test_pending_runs_take_the_slot_that_is_free_first(
    running: list[tuple[float, float, float]], pending: list[float], slots: int, left: float
) -> None:
    assert time_left([], running, pending, slots) == left


def test_finished_runs_correct_what_is_expected() -> None:
    # Twice as slow as expected: 2 × 10 s less the 5 s that have passed, then 2 × 3 s.
    assert time_left([(4.0, 8.0)], [(10.0, 5.0, 0.0)], [3.0], 1) == 15 + 6


def test_a_run_that_takes_longer_corrects_it_too() -> None:
    # 20 s so far and at least 20 s more, where 10 s were expected: four times as slow.
    assert time_left([], [(10.0, 20.0, 20.0)], [1.0], 1) == 20 + 4


def test_the_pace_of_a_phase_tells_its_end() -> None:
    clock = PhaseClock()
    assert clock.left(phase=None, wall_s=1.0, time_s=None, end_s=None) == 0
    assert clock.left(phase=0, wall_s=10.0, time_s=0.5, end_s=None) == 0
    assert clock.left(phase=2, wall_s=20.0, time_s=1.0, end_s=6.0) == 0
    # 1 s simulated in 8 s: 4 s simulated are left.
    assert clock.left(phase=2, wall_s=28.0, time_s=2.0, end_s=6.0) == 32
    assert clock.left(phase=2, wall_s=60.0, time_s=6.5, end_s=6.0) == 0
    assert clock.left(phase=3, wall_s=61.0, time_s=6.5, end_s=7.0) == 0
