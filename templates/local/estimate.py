"""How long runs still take: from what was expected, corrected by what is seen."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(kw_only=True)
class PhaseClock:
    """Wall time that one run still needs in its present phase, from its pace since the phase was first seen.

    Args:
        phase: the phase; None before the first.
        wall_s: wall time of the run when it was first seen in it [s].
        time_s: simulated time then [s].
    """

    phase: object = None
    wall_s: float = 0.0
    time_s: float = 0.0

    def left(self, *, phase: object, wall_s: float, time_s: float | None, end_s: float | None) -> float:
        """Wall time to the phase's end [s]; 0 where nothing can be told.

        Args:
            phase: what tells the phase from others, such as its number.
            wall_s: wall time of the run so far [s].
            time_s: simulated time [s].
            end_s: simulated time at which the phase ends [s]; None if a criterion ends it.
        """
        if time_s is None or phase is None:
            return 0.0
        if phase != self.phase:
            self.phase, self.wall_s, self.time_s = phase, wall_s, time_s
        made = time_s - self.time_s
        if end_s is None or made <= 0:
            return 0.0
        return max(end_s - time_s, 0.0) * (wall_s - self.wall_s) / made


def time_left(
    finished: Sequence[tuple[float, float]],
    running: Sequence[tuple[float, float, float]],
    pending: Sequence[float],
    slots: int,
) -> float:
    """Wall time until all runs are done [s].

    Expectations are corrected by the ratio of measured to expected time, over the runs that finished and those that
    take longer than expected. Each pending run, in order, takes the slot that is free first.

    Args:
        finished: (expected, measured) wall time of finished runs [s].
        running: (expected, so far, at least still needed) wall time of active runs [s].
        pending: expected wall time of runs not yet started [s], in the order of their start.
        slots: how many run at once.
    """
    overdue = [(expected, wall + least) for expected, wall, least in running if wall + least > expected]
    known = [*finished, *overdue]
    expected_s = sum(pair[0] for pair in known)
    ratio = sum(pair[1] for pair in known) / expected_s if expected_s > 0 else 1.0
    free_at = [max(expected * ratio - wall, least) for expected, wall, least in running]
    free_at += [0.0] * (slots - len(running))
    heapq.heapify(free_at)
    for expected in pending:
        heapq.heappush(free_at, heapq.heappop(free_at) + expected * ratio)
    return max(free_at)
