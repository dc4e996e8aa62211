"""Files appear whole or not at all, also on a disk that fills up."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from dem.errors import RunError
from dem.record.files import write_text, write_whole

FULL = (
    "cannot be written (No space left on device); free space or choose another --out; "
    "everything written before is whole"
)


def full(_: Path) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_writer_sees_a_temporary_name_with_the_suffix_and_never_the_final_one(tmp_path: Path) -> None:
    final = tmp_path / "frame_000001.vtu"
    final.write_text("old")
    seen = []

    def write(path: Path) -> None:
        path.write_text("half")
        seen.append((path.suffix, path.parent, final.read_text(), path == final))
        path.write_text("whole")

    write_whole(final, write)
    assert seen == [(".vtu", tmp_path, "old", False)]
    assert final.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [final]


@pytest.mark.parametrize("error", [ValueError("broken"), KeyboardInterrupt()])
def test_failing_writer_leaves_the_old_file_and_nothing_else(tmp_path: Path, error: BaseException) -> None:
    final = tmp_path / "series.h5"
    final.write_text("old")

    def write(path: Path) -> None:
        path.write_text("half")
        raise error

    with pytest.raises(type(error)):
        write_whole(final, write)
    assert final.read_text() == "old"
    assert list(tmp_path.iterdir()) == [final]


def test_full_disk_is_a_run_error_with_the_way_out(tmp_path: Path) -> None:
    final = tmp_path / "run.json"
    final.write_text("old")

    def write(path: Path) -> None:
        path.write_text("half")
        full(path)

    with pytest.raises(RunError) as caught:
        write_whole(final, write)
    assert str(caught.value) == f"{final}: {FULL}"
    assert final.read_text() == "old"
    assert list(tmp_path.iterdir()) == [final]


def test_folder_is_made_but_not_a_whole_path(tmp_path: Path) -> None:
    write_text(tmp_path / "new" / "a.txt", "x")
    assert (tmp_path / "new" / "a.txt").read_text() == "x"
    with pytest.raises(RunError, match=r"gone/far/a\.txt: cannot be written, its folder is gone"):
        write_text(tmp_path / "gone" / "far" / "a.txt", "x")
