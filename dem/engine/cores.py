"""The cores that this process may use, and what threads and ranks need of them."""

from __future__ import annotations

import os

from dem.errors import InputError

RANKS = "SMARTICLES_RANKS"  #: Environment variable: ranks of LAMMPS, set by a command before an engine is built


def usable_cores() -> int:
    """Count the cores that this process may use; a batch system may allow fewer than the machine has."""
    return len(os.sched_getaffinity(0))


def threads_warning(threads: int) -> str | None:
    """Warn of threads that find no free core, in one line; None if all find one."""
    cores = usable_cores()
    if threads <= cores:
        return None
    return (
        f"--threads {threads}: this process may use {cores} core{'s' if cores > 1 else ''}, and threads that find no "
        f"free core make a run many times slower; use at most {cores}"
    )


def ranks() -> int:
    """Return the number of LAMMPS's processes: 1 unless `RANKS` is set to a number."""
    given = os.environ.get(RANKS, "")
    return max(1, int(given)) if given.isdecimal() else 1


def most_ranks() -> int:
    """Count the ranks that find a core: of this machine, or of all nodes that a batch system gives."""
    given = os.environ.get("SLURM_NTASKS", "")
    return max(usable_cores(), int(given) if given.isdecimal() else 0)


def check_ranks(wanted: int) -> None:
    """Reject more ranks than there are cores: each waits for the others at every step."""
    most = most_ranks()
    if wanted > most:
        raise InputError(
            f"--ranks {wanted}: there are {most} core{'s' if most > 1 else ''} for this process, and each rank waits "
            f"for all others at every step; use at most {most}, or more machines: smarticles sweep … --submit slurm "
            f"--ranks {wanted}"
        )
