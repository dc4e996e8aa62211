"""Files appear whole or not at all, also on a disk that fills up."""

import errno
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest

from dem.errors import RunError
from dem.record.files import write_text, write_whole

ROOT = Path(__file__).resolve().parents[3]
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


LONG_SERIES = """
import sys
from pathlib import Path
import numpy as np
from dem.errors import RunError
from dem.record.columns import COLUMNS
from dem.record.series import SeriesWriter

def write(length):
    writer = SeriesWriter(Path(sys.argv[1]), COLUMNS, {"seed": 1})
    for _ in range(length):
        writer.add({name: np.zeros(3) if name == "container_force_N" else 0.0 for name in COLUMNS})
    writer.write()

write(10)
try:
    write(5000)
except RunError as error:
    print(error)
"""


LONG_LOG = """
import sys
from pathlib import Path
from dem.record.rundir import log_of

with log_of(Path(sys.argv[1])) as log:
    for _ in range(1000):
        log.info("%s", "x" * 100)
print("ended")
"""


def test_a_log_on_a_full_disk_prints_nothing(mount_disk: Callable[[str], Path]) -> None:
    disk = mount_disk("16k")
    command = [sys.executable, "-c", LONG_LOG, str(disk)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "ended\n", "")


def test_series_on_a_really_full_disk(mount_disk: Callable[[str], Path]) -> None:
    disk = mount_disk("64k")
    # In a process of its own: where HDF5 cannot flush a file, it takes the process with it.
    command = [sys.executable, "-c", LONG_SERIES, str(disk)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{disk}/series.h5: {FULL}\n", "")
    with h5py.File(disk / "series.h5") as file:
        assert len(file["time_s"]) == 10
    assert [path.name for path in disk.iterdir()] == ["series.h5"]
