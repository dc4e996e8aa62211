"""The driver as a process: where it is, and what it says."""

from __future__ import annotations

import fcntl
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchmarks.chrono.records import Records, read_records
from benchmarks.chrono.task import Words, written
from dem.errors import InputError, RunError


def simulate(driver: Path, folder: Path, name: str, told: Words, count: int) -> Records:
    """Run the driver; what it wrote before is taken where the task is the same and it is whole.

    Args:
        driver: the program made of `driver.cpp`.
        folder: for the task, the records and what the driver says.
        name: of these files.
        told: see `benchmarks.chrono.task.words`.
        count: smarticles.

    Raises:
        InputError: There is no such program, or another process is at it.
        RunError: It failed.
    """
    with alone_at(folder / f"{name}.lock"):
        return _simulate(driver, folder, name, told, count)


@contextmanager
def alone_at(lock: Path) -> Iterator[None]:
    """Two processes that write the same records spoil them; the kernel lets go of a lock whose process ends.

    Raises:
        InputError: Another process holds it.
    """
    with lock.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            msg = f"{lock.with_suffix('')}: another process simulates it; wait for it, or use another --out"
            raise InputError(msg) from None
        yield


def _simulate(driver: Path, folder: Path, name: str, told: Words, count: int) -> Records:
    task, out, log = (folder / f"{name}.{suffix}" for suffix in ("txt", "bin", "log"))
    text = written(told)
    if not (out.exists() and task.exists() and task.read_text(encoding="utf-8") == text):
        if not driver.is_file():
            msg = f"--driver {driver}: no such program; build it as results/chrono/README.md says"
            raise InputError(msg)
        out.unlink(missing_ok=True)
        task.write_text(text, encoding="utf-8")
        with log.open("w", encoding="utf-8") as said:
            command: Sequence[str] = [str(driver.resolve()), str(task), str(out)]
            status = subprocess.run(command, stdout=said, stderr=subprocess.STDOUT, check=False).returncode
        if status:
            last = log.read_text(encoding="utf-8").strip().splitlines()[-1:]
            msg = f"{name}: the driver ended with status {status}: {' '.join(last) or 'it said nothing'}"
            raise RunError(msg)
    return read_records(out, count)
