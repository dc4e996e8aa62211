"""What threads tell each other, and how work is shared out.

Shares are fixed by sizes and by the number of threads alone, and what threads have added up is added in their order: so
results depend on the number of threads and on nothing else.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.engine.links.arrays import Array, Bodies
from dem.engine.links.compiler import inlined
from dem.engine.links.team.barrier import Gate

LINE = 8  # numbers in a line of memory
NEAR, TOUCHING = 0, 1  # places in `tally`


class Shared(NamedTuple):
    """What all of T threads can see.

    Args:
        gate: where they wait for each other.
        sums: (T, LINE) sums of each.
        tally: (T, LINE) what each has counted.
        lost: (T, LINE) energy that the contacts of each dissipated in the step [J], in the first place.
        loads: (T - 1, N, 6) of each thread but the first, as `Bodies.load`.
        shares: (T - 1, 3 N, 6) the same of `Bodies.shares`; (T - 1, 0, 6) while welded.
        deepest: (T - 1, N) the same of `Bodies.deepest`.
        forces: (T - 1, 6, 3) the same of `Ground.force`.
    """

    gate: Gate
    sums: Array
    tally: NDArray[np.int64]
    lost: Array
    loads: Array
    shares: Array
    deepest: Array
    forces: Array


def shared_by(threads: int, gate: Gate, bodies: Bodies) -> Shared:
    """What so many threads need for some smarticles."""
    more = threads - 1
    return Shared(
        gate,
        np.zeros((threads, LINE)),
        np.zeros((threads, LINE), np.int64),
        np.zeros((threads, LINE)),
        np.zeros((more, *bodies.load.shape)),
        np.zeros((more, *bodies.shares.shape)),
        np.zeros((more, *bodies.deepest.shape)),
        np.zeros((more, 6, 3)),
    )


@inlined
def share(total: int, mine: int, threads: int) -> tuple[int, int]:
    """The part of so many things that a thread does, from the first up to the one after its last."""
    return total * mine // threads, total * (mine + 1) // threads


@inlined
def gather(shared: Shared, bodies: Bodies, hinged: bool, begin: int, stop: int) -> None:
    """Add up what all threads found for smarticles from `begin` up to `stop`, and clear what the others had."""
    for t in range(shared.loads.shape[0]):
        if hinged:
            for row in range(3 * begin, 3 * stop):
                for d in range(6):
                    bodies.shares[row, d] += shared.shares[t, row, d]
                    shared.shares[t, row, d] = 0.0
        else:
            for i in range(begin, stop):
                for d in range(6):
                    bodies.load[i, d] += shared.loads[t, i, d]
                    shared.loads[t, i, d] = 0.0
        for i in range(begin, stop):
            bodies.deepest[i] = max(bodies.deepest[i], shared.deepest[t, i])
            shared.deepest[t, i] = 0.0
