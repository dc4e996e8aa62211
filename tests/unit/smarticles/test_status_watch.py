"""status --watch: checks again until nothing goes on."""

import fcntl
import json
from pathlib import Path
from typing import TextIO

import pytest
from command_cases import Smarticles, WriteRun

from smarticles.commands import status as command


class Clock:
    """Stands for `time`: each wait lets the next thing happen."""

    def __init__(self, *steps) -> None:
        self.steps, self.waits = list(steps), []

    def sleep(self, seconds: float) -> None:
        self.waits.append(seconds)
        self.steps.pop(0)()


@pytest.fixture
def out(tmp_path: Path, sweep_file: Path, write_run: WriteRun, smarticles: Smarticles) -> Path:
    """A sweep of two runs, of which one is done."""
    smarticles("sweep", sweep_file, "--out", tmp_path / "out")
    write_run(tmp_path / "out" / "runs" / "n5")
    return tmp_path / "out"


def held(run: Path) -> TextIO:
    """A run that a process computes."""
    lock = (run / ".lock").open("w")
    fcntl.flock(lock, fcntl.LOCK_EX)
    return lock


def test_it_ends_when_nothing_runs(
    out: Path, write_run: WriteRun, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = write_run(out / "runs" / "n6", status="unfinished")
    lock = held(run)
    clock = Clock(
        lambda: None,
        lambda: (run / "progress.json").write_text('{"phase": "shake", "time_s": 1.5}'),
        lambda: (lock.close(), write_run(out / "runs" / "n6")),
    )
    monkeypatch.setattr(command, "time", clock)
    said = smarticles("status", out, "--watch", "--every", "0.5")
    assert (said.status, said.err) == (0, "")
    assert clock.waits == [0.5] * 3
    # A check that shows nothing new prints nothing.
    lasts = [line for line in said.out.splitlines() if line.startswith("counts: ")]
    assert lasts == ["counts: 2 runs, 1 done, 1 running"] * 2 + ["counts: 2 runs, 2 done"]
    assert [line.split()[1] for line in said.out.splitlines() if line.startswith("n6")] == ["running"] * 2 + ["done"]


def test_ctrl_c_is_its_way_to_end(
    out: Path, write_run: WriteRun, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop() -> None:
        raise KeyboardInterrupt

    run = write_run(out / "runs" / "n6", status="unfinished")
    monkeypatch.setattr(command, "time", Clock(stop))
    with held(run):
        said = smarticles("status", out, "--watch")
    assert (said.status, said.err) == (0, "")
    assert said.out.count("running") == 2


def test_where_nothing_runs_it_checks_once(out: Path, smarticles: Smarticles) -> None:
    assert smarticles("status", out, "--watch").out == smarticles("status", out).out
    assert smarticles("status", "--watch", out).out == smarticles("status", out).out
    said = smarticles("status", out, "--every", "5")
    assert (said.status, "add --watch" in said.err) == (2, True)
    said = smarticles("status", out, "--watch", "--json")
    assert (said.status, "leave it out with --json" in said.err) == (2, True)


def test_several_directories_are_shown_in_order(
    out: Path, tmp_path: Path, write_run: WriteRun, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = write_run(tmp_path / "single")
    apart = [smarticles("status", path) for path in (run, out)]
    said = smarticles("status", run, out)
    assert (said.status, said.out) == (0, "\n".join(each.out for each in apart))
    assert smarticles("status", run, out, "--watch").out == said.out
    answers = json.loads(smarticles("status", run, out, "--json").out)
    assert answers == [json.loads(smarticles("status", path, "--json").out) for path in (run, out)]
    # A wrong place is known before anything is printed.
    said = smarticles("status", run, tmp_path / "absent")
    assert (said.status, said.out) == (2, "")
    assert f"{tmp_path / 'absent'}: there is no such directory" in said.err
