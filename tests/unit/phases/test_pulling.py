"""The pull of a hook against a spring: when it stops, and how long it then stays."""

from typing import Any

import pytest
from double import EngineDouble
from scenes import small

from dem.phases.phase import CHECK_INTERVAL, Stage
from dem.phases.pull_hook import PullHook
from dem.phases.travel import HELD_SECONDS
from dem.setting.vibration import Vibration

DT, SPEED, DISTANCE = 1e-4, 0.01, 0.004
ARRIVAL = DISTANCE / SPEED


def pull(stiffness: float, *, anew: bool = False, **keys: Any) -> tuple[EngineDouble, float, Stage]:
    """An engine without smarticles, whose hook takes `stiffness` N for each metre; how far it was raised, the stage.

    With `anew` the stage is made again from what it remembers at every check.
    """
    phase = PullHook(type="pull-hook", distance_m=DISTANCE, speed_m_per_s=SPEED, **keys)
    scene = small({"hooks": {}})
    engine, pulling = EngineDouble.of(scene, DT), phase.begin(scene, 1)
    engine.boundaries.hook_stiffness = stiffness
    start = engine.boundaries.upper_height
    while wait := pulling.proceed(engine):
        engine.advance(max(1, round(wait / DT)))
        if anew:
            memory, pulling = pulling.memory, phase.begin(scene, 1)
            pulling.memory = dict(memory)
    if phase.vibration is None:
        assert engine.calls == [("raise_upper", SPEED), ("stop",)]
    return engine, engine.boundaries.upper_height - start, pulling


@pytest.mark.parametrize("limit", [None, 0.0401])
def test_a_hook_that_is_not_held_arrives(limit: float | None) -> None:
    # It takes 0.04 N where it arrives.
    engine, raised, pulling = pull(10.0, force_limit_N=limit, duration_s=0.5)
    assert raised == pytest.approx(DISTANCE)
    assert engine.time == pytest.approx(0.5)
    assert "warning" not in pulling.memory


def test_a_held_hook_stops_at_the_first_check_with_a_mean_above_its_limit() -> None:
    engine, raised, _ = pull(10.0, force_limit_N=0.02)
    # A check's mean is that of the force half an interval before.
    reached = 0.02 / 10.0 / SPEED + CHECK_INTERVAL / 2
    assert reached - 2 * DT <= raised / SPEED <= reached + CHECK_INTERVAL + 2 * DT
    assert raised < 0.6 * DISTANCE
    assert engine.time == pytest.approx(raised / SPEED + HELD_SECONDS, abs=2 * DT)


def test_the_force_under_vibration_is_averaged_over_whole_periods_whenever_it_switches() -> None:
    # Checks are 0.02 s apart. From 0.02 s to 0.04 s the mean is 0.003 N, in the last tenth of that time 0.0039 N.
    vibration = Vibration(peak_acceleration_g=0.0, frequency_hz=50, windows_s=((0.038, 9),))
    _, raised, _ = pull(10.0, force_limit_N=0.0035, vibration=vibration)
    assert raised / SPEED == pytest.approx(0.06, abs=2 * DT)


def test_what_a_pull_remembers_is_enough_to_resume() -> None:
    straight, raised, _ = pull(10.0, force_limit_N=0.02, duration_s=ARRIVAL)
    again, too, _ = pull(10.0, anew=True, force_limit_N=0.02, duration_s=ARRIVAL)
    assert (again.steps, too) == (straight.steps, raised)
