"""Each reason for which the watchdog stops a run, with its literal text; and a healthy state that passes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from dem.container import Cylinder
from dem.errors import RunError
from dem.particle import Boxes
from dem.state import State
from dem.watchdog import Watchdog

BOXES = Boxes(
    middle_length=0.0117, barb_length=0.00819, thickness_normal=1.27e-3, thickness_in_plane=0.5e-3, density=7850
)
WATCHDOG = Watchdog(cylinder=Cylinder(radius=0.0234, height=0.1, facets=64), speed=5.0)


def healthy() -> State:
    positions = np.array([[0.0, 0.0, 0.01], [0.02, 0.0, 0.02], [0.0, -0.023, 0.099], [0.0, 0.0, 0.001]])
    velocities = np.array([[0.0, 0.0, -4.9], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    return State.rigid(BOXES, positions, np.tile(np.eye(3), (4, 1, 1)), velocities, np.zeros((4, 3)))


def check(state: State, floor: float = 0.0) -> None:
    WATCHDOG.check(state, floor=floor, time=1.25)


def test_healthy_states_pass() -> None:
    check(healthy())
    none = np.empty((0, 3))
    check(State.rigid(BOXES, none, np.empty((0, 3, 3)), none, none))  # nothing poured yet
    lifted = healthy()
    lifted.positions[:, 2] += 5.0
    check(lifted, floor=5.0)  # heights are above the floor, wherever it is


def broken_position(state: State) -> None:
    state.positions[1, 0] = math.nan


def broken_velocity(state: State) -> None:
    state.link_velocities[1, 2, 2] = math.inf


def fast(state: State) -> None:
    state.link_velocities[1, 2] = [0.0, 3.0, -4.1]  # a barb, not the whole


def through_the_wall(state: State) -> None:
    state.positions[1, :2] = [0.02, 0.02]


def through_the_floor(state: State) -> None:
    state.positions[1, 2] = -1e-6


def over_the_wall(state: State) -> None:
    state.positions[1, 2] = 0.101


CAUSES: list[tuple[Callable[[State], None], str]] = [
    (broken_position, "a position or velocity that is no number; lower fidelity.time_step_fraction"),
    (broken_velocity, "a position or velocity that is no number; lower fidelity.time_step_fraction"),
    (
        fast,
        "a speed above 5 m/s (fastest 5.08 m/s), which nothing in this scene explains; "
        "lower fidelity.time_step_fraction",
    ),
    (through_the_wall, "left through the wall or the floor; raise fidelity.stiffness_N_per_m"),
    (through_the_floor, "left through the wall or the floor; raise fidelity.stiffness_N_per_m"),
    (over_the_wall, "thrown out over the wall of 0.1 m; raise container.height_m or shake less"),
]


@pytest.mark.parametrize(("harm", "text"), CAUSES, ids=[harm.__name__ for harm, _ in CAUSES])
def test_each_cause_stops_the_run(harm: Callable[[State], None], text: str) -> None:
    state = healthy()
    harm(state)
    with pytest.raises(RunError) as caught:
        check(state)
    assert str(caught.value) == f"at t = 1.2500 s: 1 smarticle(s) (1): {text}"


def test_many_smarticles_are_counted_and_the_first_named() -> None:
    positions = np.full((8, 3), -0.01)
    state = State.rigid(BOXES, positions, np.tile(np.eye(3), (8, 1, 1)), np.zeros((8, 3)), np.zeros((8, 3)))
    with pytest.raises(RunError, match=r"8 smarticle\(s\) \(0, 1, 2, 3, 4, …\): left through"):
        check(state)


def test_broken_hinge_is_named_with_its_gap() -> None:
    dog = Watchdog(cylinder=WATCHDOG.cylinder, speed=5.0, gap=2e-4)
    gaps = np.full((4, 2), 1e-6)
    dog.check(healthy(), floor=0.0, time=1.25, gaps=gaps)
    dog.check(healthy(), floor=0.0, time=1.25, gaps=None)  # welded
    for bad in (3e-4, math.nan):
        gaps[2, 1] = bad
        with pytest.raises(RunError, match=r"1\.2500 s: 1 smarticle\(s\) \(2\): links more than 0\.0002 m apart"):
            dog.check(healthy(), floor=0.0, time=1.25, gaps=gaps)
