"""The driver as a process: where it is, and what it says."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
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
        InputError: There is no such program.
        RunError: It failed.
    """
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
