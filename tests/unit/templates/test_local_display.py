"""What a person sees of many runs."""

import io

import pytest

from dem.display import Display
from dem.record.document import Progress
from templates.local import Outcome, Snapshot, SweepDisplay, time_left

SHAKING = Progress(phase="shake", index=1, phases=2, time_s=1.2, fraction=0.4, left_s=50.0, phi=0.1234)
RUNNING = (("lw0.70_seed1", 33.1, SHAKING), ("lw0.40_seed1", 1.0, Progress()))
SNAPSHOT = Snapshot(total=9, ended=3, failed=1, running=RUNNING, left_s=125.0)


def test_plain_lines_are_whole_and_report_events() -> None:
    text = io.StringIO()
    with SweepDisplay(Display(text, patience_s=1e3)) as display:
        display.started("a")
        display.update(SNAPSHOT)
        display.ended(Outcome(name="a", status="done", wall_s=65.0))
        display.ended(Outcome(name="b", status="failed", wall_s=2.0, cause="left [the] wall"))
        display.ended(Outcome(name="c", status="kept"))
        display.stopping(2)
    assert text.getvalue().splitlines() == [
        "a started",
        "a done after 1:05",
        "b failed after 0:02: left [the] wall",
        "c finished before",
        "stopping 2 runs, which close their files; Ctrl-C again does not wait",
    ]


def test_rows_are_of_each_running_run_and_of_the_sweep() -> None:
    assert [row.to_text() for row in SNAPSHOT.rows] == [
        "lw0.70_seed1 40 %, shake 2/2  t = 1.20 s, 0:50 left",
        "lw0.40_seed1, starting",
        "3 of 9 runs ended, 1 failed 33 %, 2:05 left",
    ]


def done(name: str, wall_s: float) -> dict[str, Outcome]:
    return {name: Outcome(name=name, status="done", wall_s=wall_s)}


def test_time_left_follows_the_pace_of_finished_runs() -> None:
    expected = dict.fromkeys("abcd", 10.0)
    # Runs take three times as long as planned; three are left, two at once.
    assert time_left(expected, done("a", 30.0), [], slots=2) == pytest.approx(45.0)
    # The longest run decides if it is longer than its share.
    assert time_left({**expected, "d": 100.0}, done("a", 30.0), [], slots=3) == pytest.approx(300.0)


def test_time_left_follows_running_runs_before_any_has_finished() -> None:
    running = [("a", 20.0, Progress(left_s=40.0))]
    # One run of 10 s as planned takes 60 s, so that the other one will, too.
    assert time_left({"a": 10.0, "b": 10.0}, {}, running, slots=1) == pytest.approx(100.0)
    # A run that takes longer than planned is not about to end.
    assert time_left({"a": 10.0}, {}, running, slots=1) == pytest.approx(40.0)
