"""The cores that this process may use, and what threads need of them."""

from __future__ import annotations

import os


def usable_cores() -> int:
    """How many cores this process is allowed to use, which a batch system may make fewer than the machine has."""
    return len(os.sched_getaffinity(0))


def threads_warning(threads: int) -> str | None:
    """What is to be told of a number of threads in one line; None: they all find a core."""
    cores = usable_cores()
    if threads <= cores:
        return None
    return (
        f"--threads {threads}: this process may use {cores} core{'s' if cores > 1 else ''}, and threads that find no "
        f"free core make a run many times slower; use at most {cores}"
    )
