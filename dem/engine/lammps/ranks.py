"""How many processes LAMMPS runs on, and how many find a core."""

from __future__ import annotations

import os

from dem.engine.cores import usable_cores
from dem.errors import InputError

RANKS = "SMARTICLES_RANKS"
"""Variable of the environment that a command sets before an engine is built."""


def ranks() -> int:
    """Processes that LAMMPS runs on here: 1 where nobody set it to a number."""
    given = os.environ.get(RANKS, "")
    return max(1, int(given)) if given.isdecimal() else 1


def most_ranks() -> int:
    """Ranks that find a core: of this machine, or of all nodes that a batch system gives."""
    given = os.environ.get("SLURM_NTASKS", "")
    return max(usable_cores(), int(given) if given.isdecimal() else 0)


def check_ranks(wanted: int) -> None:
    """Refuse more ranks than there are cores: each waits for the others at every step.

    Raises:
        InputError: there are not so many.
    """
    most = most_ranks()
    if wanted > most:
        msg = (
            f"--ranks {wanted}: there are {most} core{'s' if most > 1 else ''} for this process, and each rank waits "
            f"for all others at every step; use at most {most}, or more machines: smarticles sweep … --submit slurm "
            f"--ranks {wanted}"
        )
        raise InputError(msg)
