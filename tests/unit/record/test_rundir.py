"""The lock of a run directory: held by another process, or not to be had from the file system."""

import errno
import fcntl
import os
from pathlib import Path
from typing import NoReturn

import pytest

from dem.errors import InputError
from dem.record.run import Run
from dem.record.rundir import claimed


def test_a_directory_in_use_is_rejected_with_the_process(tmp_path: Path) -> None:
    with claimed(tmp_path, resume=False):
        with (
            pytest.raises(InputError, match=f"process {os.getpid()} is running it; wait"),
            claimed(tmp_path, resume=False),
        ):
            pass
        assert Run(tmp_path).status.state == "running"


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_named_as_the_cause(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flock(*_: object) -> NoReturn:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", flock)
    with pytest.raises(InputError) as error, claimed(tmp_path, resume=False):
        pass
    said = str(error.value)
    assert said.startswith(f"--out {tmp_path}: its file system cannot lock files ({os.strerror(number)})")
    assert "choose a directory on another file system" in said
    assert "is running it" not in said
    assert "\n" not in said
    assert Run(tmp_path).status.state != "running"


def test_a_lock_refused_by_a_network_file_system_is_one_in_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def flock(*_: object) -> NoReturn:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(fcntl, "flock", flock)
    with pytest.raises(InputError, match="is running it"), claimed(tmp_path, resume=False):
        pass
