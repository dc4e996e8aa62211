"""Number of cores that this process may use, and checks of numbers of threads and ranks."""

import os

from dem.errors import InputError

RANKS = "SMARTICLES_RANKS"  #: Environment variable with the number of ranks of LAMMPS


def usable_cores() -> int:
    """Return the number of cores that this process may use, which a batch system may restrict."""
    return len(os.sched_getaffinity(0))


def threads_warning(threads: int) -> str | None:
    """Return a warning in one line if there are more threads than cores; None otherwise."""
    cores = usable_cores()
    if threads <= cores:
        return None
    return (
        f"--threads {threads}: this process may use {cores} core{'s' if cores > 1 else ''}, and threads that find no "
        f"free core make a run many times slower; use at most {cores}"
    )


def ranks() -> int:
    """Return the number of ranks of LAMMPS: the value of the environment variable `RANKS`, or 1."""
    given = os.environ.get(RANKS, "")
    return max(1, int(given)) if given.isdecimal() else 1


def check_ranks(wanted: int) -> None:
    """Raise InputError if `wanted` ranks are more than cores: ranks wait for each other in every step."""
    # On this machine, or on the nodes of a batch job.
    tasks = os.environ.get("SLURM_NTASKS", "")
    most = max(usable_cores(), int(tasks) if tasks.isdecimal() else 0)
    if wanted > most:
        raise InputError(
            f"--ranks {wanted}: there are {most} core{'s' if most > 1 else ''} for this process, and each rank waits "
            f"for all others at every step; use at most {most}, or more machines: smarticles sweep … --submit slurm "
            f"--ranks {wanted}"
        )
