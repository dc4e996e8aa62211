"""What a person sees of many runs."""

import io

from rich.console import Console

from dem.record.document import Progress
from templates.local import Display, Outcome, Snapshot

RUNNING = (
    ("lw0.70_seed1", 33.1, Progress(phase="shake", time_s=1.2, end_s=5.5, phi=0.1234)),
    ("lw0.40_seed1", 1.0, Progress()),
)
SNAPSHOT = Snapshot(total=9, ended=3, failed=1, running=RUNNING, left_s=125.0)


def plain(interval_s: float = 0.0) -> tuple[Display, io.StringIO]:
    text = io.StringIO()
    return Display(Console(file=text, width=40), interval_s), text


def test_plain_lines_are_whole_and_report_events() -> None:
    display, text = plain()
    with display:
        display.started("a")
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
