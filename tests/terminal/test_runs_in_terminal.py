"""A running simulation on a terminal: its bar, its stop, and what is left on the screen."""

import re
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from terminals import Terminal

from dem.record.run import Run

Type = Callable[..., Terminal]
LONG = ("--set", "phases.1.duration_s=600")  # ended by the test; a minute of processor time or more


def bar(lines: list[str]) -> str:
    """Return the line with the bar; empty if there is none."""
    return next((line for line in lines if "━" in line), "")


def share(lines: list[str]) -> float:
    """Return the share that the line with the bar states [%]."""
    found = re.search(r"(\d+) %", bar(lines))
    return float(found[1]) if found else -1.0


@pytest.mark.parametrize(("columns", "rows"), [(80, 24), (200, 50)])
def test_the_bar_moves_and_the_time_left_is_believable(columns: int, rows: int, type_command: Type) -> None:
    words = ("run", "scene.yaml", "--out", f"runs/bar{columns}", *LONG)
    with type_command(*words, columns=columns, rows=rows) as terminal:
        first = terminal.wait_for(lambda lines: share(lines) >= 1)
        began, left = time.monotonic(), re.search(r"(\d+):(\d\d) left", bar(first))
        assert left, first
        assert "…" not in bar(first)  # nothing is cut
        second = terminal.wait_for(lambda lines: share(lines) >= share(first) + 3)
        pace = (share(second) - share(first)) / (time.monotonic() - began)
        terminal.press_ctrl_c()
        assert terminal.end() == 130
    # The first estimate is no promise, but not 1869 s for 26 s either. Shares are whole percents.
    true = (100 - share(first)) / pace
    assert true / 5 < 60 * int(left[1]) + int(left[2]) < 5 * true


def test_a_run_that_ends_leaves_no_bar(type_command: Type) -> None:
    with type_command("run", "scene.yaml", "--out", "runs/ends", "--set", "phases.1.duration_s=40") as terminal:
        assert terminal.end() == 0
        lines = terminal.lines
    assert bar(lines) == ""
    assert lines[-2].startswith("runs/ends: done, ")
    assert lines[-1] == "next: smarticles measure runs/ends, smarticles render runs/ends"
    assert all(line.startswith(("compiling", "  ")) for line in lines[:-2])


def test_resizing_leaves_no_debris(type_command: Type) -> None:
    with type_command("run", "scene.yaml", "--out", "runs/resized", *LONG, columns=120, rows=30) as terminal:
        terminal.wait_for(lambda lines: share(lines) >= 0)
        for columns in (70, 100):
            terminal.resize(columns, 30)
            before = share(terminal.lines)
            terminal.wait_for(lambda lines, before=before: share(lines) > before)  # type: ignore[misc]
        assert sum("━" in line for line in terminal.lines) <= 2  # a terminal may keep a line that it has wrapped
        terminal.press_ctrl_c()
        assert terminal.end() == 130
        assert "smarticles resume runs/resized" in terminal.lines[-1]


def test_no_color_has_a_bar_without_colours(type_command: Type) -> None:
    how = {"environment": {"NO_COLOR": "1"}}
    with type_command("run", "scene.yaml", "--out", "runs/grey", *LONG, **how) as terminal:
        terminal.wait_for(lambda lines: share(lines) >= 0)
        terminal.press_ctrl_c()
        assert terminal.end() == 130
    assert not re.search(r"\x1b\[[0-9;]*(3[0-7]|38;|9[0-7])[0-9;]*m", terminal.raw)


def test_a_dumb_terminal_gets_lines(type_command: Type) -> None:
    with type_command("run", "scene.yaml", "--out", "runs/dumb", *LONG, environment={"TERM": "dumb"}) as terminal:
        lines = terminal.wait_for(lambda lines: any("%" in line or "starting" in line for line in lines))
        assert bar(lines) == ""
        terminal.press_ctrl_c()
        assert terminal.end() == 130
    assert "\x1b" not in terminal.raw


def goes_on(out: str, here: Path, type_command: Type) -> None:
    """Check that a stopped run can be resumed, from its checkpoint and not from its beginning."""
    stopped = Run(here / out)
    assert stopped.status.state in ("interrupted", "stopped")
    assert stopped.can_resume
    reached = stopped.series.table()["time_s"].iloc[-1]
    with type_command("resume", out) as terminal:
        lines = terminal.wait_for(lambda lines: "shake" in bar(lines))
        time_s = re.search(r"t = ([\d.]+) s", bar(lines))
        assert time_s
        assert float(time_s[1]) > 0.5 * reached  # a stop while the newest checkpoint is written leaves the one before
        terminal.press_ctrl_c()
        assert terminal.end() == 130


def shaking(lines: list[str]) -> bool:
    """Return whether the bar shows a run that shakes and has a checkpoint."""
    time_s = re.search(r"t = ([\d.]+) s", bar(lines))
    return "shake" in bar(lines) and time_s is not None and float(time_s[1]) > 6


def test_after_ctrl_c_the_last_line_says_how_to_go_on(here: Path, type_command: Type) -> None:
    with type_command("run", "scene.yaml", "--out", "runs/stopped", *LONG) as terminal:
        terminal.wait_for(shaking)
        terminal.press_ctrl_c()
        assert terminal.end() == 130
        lines = terminal.lines
    assert bar(lines) == ""
    assert "Traceback" not in terminal.raw
    assert lines[-1].endswith("smarticles resume runs/stopped"), lines
    assert Run(here / "runs/stopped").status.state == "interrupted"
    goes_on("runs/stopped", here, type_command)


def test_ctrl_c_twice_ends_at_once_and_the_run_goes_on_later(here: Path, type_command: Type) -> None:
    with type_command("run", "scene.yaml", "--out", "runs/twice", *LONG) as terminal:
        terminal.wait_for(shaking)
        terminal.press_ctrl_c()
        terminal.press_ctrl_c()
        assert terminal.end() in (130, -2)
    assert "Traceback" not in terminal.raw, terminal.history
    goes_on("runs/twice", here, type_command)


def test_a_run_whose_terminal_closes_can_go_on(here: Path, type_command: Type) -> None:
    with type_command("run", "scene.yaml", "--out", "runs/closed", *LONG) as terminal:
        terminal.wait_for(shaking)
        terminal.close()
        assert terminal.end() in (130, -signal.SIGHUP)  # the second one may come when all has been written
    assert Run(here / "runs/closed").status.state == "interrupted"
    goes_on("runs/closed", here, type_command)


def test_a_sweep_shows_its_runs_and_keeps_their_outcomes(here: Path, type_command: Type) -> None:
    words = ("sweep", "sweep.yaml", "--out", "friction", "--submit", "local", "--jobs", "1")
    with type_command(*words) as terminal:
        assert terminal.end() == 0, terminal.history
        lines = terminal.lines
    assert [line.split()[:2] for line in lines[:2]] == [["✔", "mu0.2"], ["✔", "mu0.4"]]
    assert lines[-1].endswith("next: smarticles measure friction")
    for words in (("measure", "friction", "--by", "mu"), ("status", "friction"), ("report", "friction")):
        with type_command(*words) as terminal:
            assert terminal.end() == 0, terminal.history


def test_ctrl_c_stops_a_sweep_and_says_how_to_go_on(type_command: Type) -> None:
    words = ("sweep", "long.yaml", "--out", "cut", "--submit", "local", "--jobs", "1")
    with type_command(*words) as terminal:
        terminal.wait_for(lambda lines: any("0 of 2 runs ended" in line for line in lines))
        terminal.press_ctrl_c()
        assert terminal.end() == 130
        lines = terminal.lines
    assert "continue with: smarticles sweep" in " ".join(line.strip() for line in lines[-3:])
    assert sum("━" in line for line in lines) == 0


_SCRIPT = """\
import smarticles
scene = smarticles.Scene(
    seed=1, count=12, engine="links", fidelity="draft",
    phases=[{"type": "deposit", "per_layer": 6}, {"type": "shake", "duration_s": 600}],
)
smarticles.run(scene, "runs/script")
"""


def test_python_shows_a_bar_and_stops_at_ctrl_c(here: Path) -> None:
    with Terminal([sys.executable, "-c", _SCRIPT], folder=here) as terminal:
        terminal.wait_for(shaking)
        terminal.press_ctrl_c()
        terminal.end()
        lines = terminal.lines
    assert bar(lines) == ""
    assert "KeyboardInterrupt: runs/script: stopped; go on with" in "".join(lines)
    assert "resume=True" in "".join(lines)[-20:]
    assert Run(here / "runs/script").status.state == "interrupted"
    assert Run(here / "runs/script").can_resume
