"""The pull of a hook against scripted forces: when it stops, and how long it then stays."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dem.phases.phase import CHECK_INTERVAL
from dem.phases.pull_hook import HELD_FAST, PullHook, Pulling

DT, SPEED, DISTANCE = 1e-4, 0.01, 0.004
ARRIVAL = DISTANCE / SPEED


class Machine:
    """An engine that only knows its hook: it takes `stiffness` N for each metre that it has been raised."""

    def __init__(self, stiffness: float) -> None:
        self._stiffness, self._sum, self._speed = stiffness, 0.0, 0.0
        self.steps, self.raised, self.time_step = 0, 0.0, DT
        self.fixtures = SimpleNamespace(raise_upper=self._start, stop=lambda: self._start(0.0), hook_sums=None)
        self._tell()

    @property
    def time(self) -> float:
        return self.steps * DT

    def weld(self) -> None:
        pass

    def _start(self, speed: float) -> None:
        self._speed = speed

    def _tell(self) -> None:
        # Smarticles pull the hook downwards.
        self.fixtures.hook_sums = np.array([[0, 0, 0], [0, 0, -self._sum]])

    def pass_time(self, wait: float) -> None:
        for _ in range(max(1, round(wait / DT))):
            self.steps += 1
            self.raised += self._speed * DT
            self._sum += self._stiffness * self.raised
        self._tell()


def pull(stiffness: float, **keys: Any) -> tuple[Machine, Pulling]:
    phase = PullHook(type="pull-hook", distance_m=DISTANCE, speed_m_per_s=SPEED, **keys)
    machine, pulling = Machine(stiffness), Pulling(phase)
    while wait := pulling.proceed(machine):  # type: ignore[arg-type]
        machine.pass_time(wait)
    return machine, pulling


@pytest.mark.parametrize("limit", [None, 0.0401])
def test_a_hook_that_is_not_held_arrives(limit: float | None) -> None:
    # It takes 0.04 N where it arrives.
    machine, _ = pull(10.0, force_limit_N=limit, duration_s=0.5)
    assert machine.raised == pytest.approx(DISTANCE)
    assert machine.time == pytest.approx(0.5)


def test_a_hook_that_is_held_stops_at_the_first_look_with_a_mean_above_its_limit() -> None:
    machine, _ = pull(10.0, force_limit_N=0.02)
    # A look's mean is that of the force half a look before.
    reached = 0.02 / 10.0 / SPEED + CHECK_INTERVAL / 2
    assert reached - 2 * DT <= machine.raised / SPEED <= reached + CHECK_INTERVAL + 2 * DT
    assert machine.raised < 0.6 * DISTANCE
    assert machine.time == pytest.approx(machine.raised / SPEED + HELD_FAST, abs=2 * DT)


def test_what_a_pull_remembers_is_enough_to_go_on() -> None:
    phase = PullHook(type="pull-hook", distance_m=DISTANCE, speed_m_per_s=SPEED, force_limit_N=0.02, duration_s=ARRIVAL)
    machine, pulling = Machine(10.0), Pulling(phase)
    while wait := pulling.proceed(machine):  # type: ignore[arg-type]
        machine.pass_time(wait)
        memory, pulling = pulling.memory, Pulling(phase)
        pulling.memory = dict(memory)
    straight, _ = pull(10.0, force_limit_N=0.02)
    assert (machine.steps, machine.raised) == (straight.steps, straight.raised)
