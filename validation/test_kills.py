"""What a kill and a resume are judged by, without an engine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from dem.errors import RunError
from validation.hard.kills import LEAST_FILES, SAME, finish, kill_after, row_of

LOG = "2026-11-22 INFO phase 0 deposit begins at t = 0.0000 s\nresumed from the checkpoint of t = 0.1200 s\n"


def left(out: Path, files: int = LEAST_FILES) -> Path:
    """A run directory as far as kills look at it."""
    (out / "frames").mkdir(parents=True)
    for name in ("series.h5", "frames.pvd", *(f"frames/{k}.vtu" for k in range(files - 2))):
        (out / name).write_bytes(name.encode())
    (out / "log.txt").write_text(LOG)
    return out


def judged(whole: Path, out: Path) -> dict[str, object]:
    return row_of(whole, out, seconds=0.5, killed="deposit")


def test_the_same_bytes_are_the_same_bits(tmp_path: Path) -> None:
    row = judged(left(tmp_path / "whole"), left(tmp_path / "killed"))
    assert (row[SAME], row["files that differ [1]"]) == ("yes", 0)
    assert row["resumed from [s of simulated time]"] == 0.12


@pytest.mark.parametrize("name", ["series.h5", "frames.pvd", "frames/0.vtu", "frames/more.vtu"])
def test_one_file_is_enough_to_differ(tmp_path: Path, name: str) -> None:
    whole, out = left(tmp_path / "whole"), left(tmp_path / "killed")
    (out / name).write_bytes(b"x")
    row = judged(whole, out)
    assert (row[SAME], row["files that differ [1]"]) == ("NO", 1)


def test_a_file_that_is_missing_differs(tmp_path: Path) -> None:
    whole, out = left(tmp_path / "whole"), left(tmp_path / "killed")
    (out / "frames/3.vtu").unlink()
    assert judged(whole, out)[SAME] == "NO"


def test_to_compare_next_to_nothing_is_refused(tmp_path: Path) -> None:
    few = LEAST_FILES - 1
    with pytest.raises(RunError, match="only 19 files to compare, 20 at least"):
        judged(left(tmp_path / "whole", few), left(tmp_path / "killed", few))


def process(code: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", code])


def test_who_is_at_work_is_killed_and_who_has_ended_is_not() -> None:
    assert kill_after(process("while True: pass"), 0.3, "busy")
    assert not kill_after(process("pass"), 60.0, "ended")


def test_a_run_that_fails_is_told() -> None:
    with pytest.raises(RunError, match="broken: ended with status 3"):
        finish(process("raise SystemExit(3)"), "broken")
