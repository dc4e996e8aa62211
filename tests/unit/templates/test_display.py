"""What a person sees of many runs."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from templates.local.display import LiveDisplay, PlainDisplay, display_for, duration
from templates.local.runner import Outcome, Snapshot, Standing
from templates.sweep.folder import Entry

SHAKEN = Standing(
    name="lw0.70_seed1",
    wall_s=33.1,
    expected_s=60.0,
    phase="shake",
    time_s=1.2,
    end_s=5.5,
    phi=0.1234,
)
STARTING = Standing(name="lw0.40_seed1", wall_s=1.0, expected_s=80.0)
SNAPSHOT = Snapshot(total=9, ended=3, failed=1, running=(SHAKEN, STARTING), left_s=125.0)


@pytest.mark.parametrize(("seconds", "text"), [(0, "0:00"), (65.4, "1:05"), (3723, "1:02:03"), (59.6, "1:00")])
def test_duration(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def plain(interval_s: float = 0.0) -> tuple[PlainDisplay, io.StringIO]:
    text = io.StringIO()
    return PlainDisplay(Console(file=text, width=40), interval_s), text


def test_plain_lines_are_whole_and_say_what_happens() -> None:
    display, text = plain()
    with display:
        display.started(Entry(name="a", scene_sha256="", expected_s=1.0, values={}))
        display.update(SNAPSHOT)
        display.ended(Outcome(name="a", status="done", wall_s=65.0))
        display.ended(Outcome(name="b", status="failed", wall_s=2.0, cause="left [the] wall"))
        display.ended(Outcome(name="c", status="kept"))
        display.stopping(2)
    assert text.getvalue().splitlines() == [
        "a started",
        "3 of 9 runs ended, 1 failed, time left 2:05; lw0.70_seed1 shake 1.20 of 5.50 s φ 0.123, lw0.40_seed1 starting",
        "a done after 1:05",
        "b failed after 0:02: left [the] wall",
        "c finished before",
        "stopping 2 runs, which close their files; Ctrl-C again does not wait",
    ]


def test_plain_reports_keep_their_distance() -> None:
    display, text = plain(interval_s=1000.0)
    display.update(SNAPSHOT)
    display.update(SNAPSHOT)
    assert text.getvalue() == ""


def test_the_live_picture_shows_each_run_and_the_total() -> None:
    console = Console(file=io.StringIO(), width=100)
    with console.capture() as captured:
        console.print(LiveDisplay.picture(SNAPSHOT))
    lines = captured.get().splitlines()
    assert lines[0].split() == "lw0.70_seed1 shake 1.20 of 5.50 s φ 0.123 0:33".split()
    assert lines[1].split() == "lw0.40_seed1 starting 0:01".split()
    assert lines[2].endswith("  3 of 9 runs ended, 1 failed, time left 2:05")
    assert len(lines) == 3


def test_the_live_display_draws_on_a_terminal_only() -> None:
    terminal = Console(file=io.StringIO(), force_terminal=True, width=100)
    display = display_for(terminal)
    assert isinstance(display, LiveDisplay)
    assert isinstance(display_for(Console(file=io.StringIO())), PlainDisplay)
    with display:
        display.update(SNAPSHOT)
        display.ended(Outcome(name="b", status="failed", wall_s=2.0, cause="left [the] wall"))
    written = terminal.file.getvalue()  # type: ignore[attr-defined]
    assert "b failed after 0:02: left [the] wall" in written
    assert "lw0.70_seed1" in written
