"""Progress of a running simulation, in `progress.json` and on a display."""

import math
from collections.abc import Container, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from dem.display import Display, Row
from dem.errors import RunError
from dem.record.document import Progress
from dem.record.names import PROGRESS

INTERVAL = 1.0  # s of wall time between updates
LATE = 0.8  # share of a phase of unknown length from which on its progress slows down
TRUST_S, TRUST_SHARE = 0.5, 0.1  # time [s] and share of the run for which the plan counts as measured


@dataclass(frozen=True, kw_only=True)
class PhaseCost:
    """What a phase is expected to cost."""

    simulated_s: float  #: Expected simulated time
    wall_s: float  #: Expected wall time
    known: bool  #: Whether the simulated time is exact
    grows: bool = False  #: Whether bodies are added at a constant rate, so that the cost grows with the square of time

    def share(self, time: float) -> float:
        """Return the expected share [1] of the phase's work that is done at a time since its beginning [s]."""
        share = time / self.simulated_s if self.simulated_s > 0 else 1.0
        if self.known:
            return min(share, 1.0)
        if share > LATE:  # it may last longer than expected
            share = 1 - (1 - LATE) * math.exp(-(share - LATE) / (1 - LATE))
        return share**2 if self.grows else share


@dataclass
class Estimate:
    """Estimate of the wall time left, from the planned cost and the time spent so far."""

    phases: Sequence[PhaseCost]  #: Expected cost of all phases of the run
    _start: tuple[float, float] | None = None  #: Wall time [s] and work done [s] when counting began

    def done(self, phase: int, time: float) -> float:
        """Return the share [1] of the run's work that is done at a time since the beginning of a phase [s]."""
        total = sum(cost.wall_s for cost in self.phases)
        return self._work(phase, time) / total if total > 0 else 0.0

    def left_s(self, phase: int, time: float, wall: float) -> float:
        """Return the expected wall time left [s], at a time since the beginning of a phase and a wall time [s].

        The planned cost is multiplied by the ratio of measured to planned time of the work so far. The plan counts as
        a short measurement: without it, the first fractions of a second would decide.
        """
        work, total = self._work(phase, time), sum(cost.wall_s for cost in self.phases)
        if self._start is None:
            self._start = wall, work
        trust = TRUST_S + TRUST_SHARE * total
        pace = (wall - self._start[0] + trust) / (work - self._start[1] + trust)
        return pace * (total - work)

    def _work(self, phase: int, time: float) -> float:
        current = self.phases[phase]
        return sum(cost.wall_s for cost in self.phases[:phase]) + current.share(time) * current.wall_s


def row_of(progress: Progress, *, label: str = "") -> Row:
    """Return the row of a display that shows the progress of a run.

    Without a label it begins with the phase; with one, as in a sweep, it is shorter.
    """
    phase = progress.phase or "starting"
    if progress.phases is not None and progress.index is not None:
        phase += f" {progress.index + 1}/{progress.phases}"
    parts = [phase] if label else []
    if progress.time_s is not None:
        parts.append(f"t = {progress.time_s:.2f} s")
    if not label and progress.phase == "deposit" and progress.total is not None:
        parts.append(f"{progress.count} of {progress.total} poured")
    elif not label and progress.phi is not None:
        parts.append(f"φ {progress.phi:.3f}")
    return Row(label=label or phase, fraction=progress.fraction, detail="  ".join(parts), left_s=progress.left_s)


@dataclass
class ProgressWriter:
    """Writer of a run's progress, at most once per second."""

    folder: Path  #: The run directory
    total: int  #: Number of bodies in the scene
    costs: Sequence[PhaseCost] = ()  #: Expected cost of the phases; empty: the time left is unknown
    lifted: Container[int] = ()  #: Numbers of phases in which bodies hang, so that they are no pile with a φ
    display: Display | None = None  #: Shows the progress
    _progress: Progress = field(default_factory=Progress)
    _begun: float = field(init=False)
    _start: float = 0.0
    _last: float = -math.inf

    def __post_init__(self) -> None:
        self._begun = monotonic()
        self._estimate = Estimate(self.costs) if self.costs else None

    def begin(self, *, phase: str, index: int, start: float, end: float | None) -> None:
        """Begin or resume a phase, which began at the simulated time `start` [s]; its end is None if it is unknown."""
        counts = {"index": index, "phases": len(self.costs) or None, "total": self.total}
        self._progress = self._progress.model_copy(update={"phase": phase, "end_s": end, **counts})
        self._start = start
        self._last = -math.inf

    def checkpointed(self, time: float) -> None:
        """Write the simulated time [s] of a new checkpoint without delay."""
        progress = self._progress = self._progress.model_copy(update={"checkpoint_s": time})
        if progress.count is not None:
            self._last = -math.inf
            self.update(time=time, phi=math.nan if progress.phi is None else progress.phi, count=progress.count)

    def update(self, *, time: float, phi: float, count: int) -> None:
        """Write simulated time [s], packing fraction [1] and number of bodies, at most once per second."""
        now, index = monotonic(), self._progress.index
        known_phi = phi if math.isfinite(phi) and index not in self.lifted else None
        update = {"time_s": time, "phi": known_phi, "count": count, "wall_s": now - self._begun}
        self._progress = self._progress.model_copy(update=update)
        if now - self._last < INTERVAL:
            return
        self._last = now
        if self._estimate is not None and index is not None:  # the first sample comes before the first phase
            since = max(0.0, time - self._start)
            done, left = self._estimate.done(index, since), self._estimate.left_s(index, since, now)
            self._progress = self._progress.model_copy(update={"fraction": done, "left_s": left})
        try:
            if self.folder.is_dir():  # a folder that was removed is not made again
                self._progress.write(self.folder / PROGRESS)
        except RunError:
            # A full disk stops the run where results are written, not here.
            return
        if self.display is not None:
            self.display.update(row_of(self._progress))

    def finish(self, *, remove: bool = True) -> None:
        """Remove `progress.json` if `remove`."""
        if remove:
            (self.folder / PROGRESS).unlink(missing_ok=True)
