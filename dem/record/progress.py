"""Progress of a running simulation, in `progress.json` and in one line on the terminal."""

import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from dem.errors import RunError
from dem.record.document import Progress
from dem.record.names import PROGRESS
from dem.terminal import ERASE_LINE, redraw, warn

INTERVAL = 1.0  # s of wall time between updates


@dataclass
class ProgressWriter:
    """Writer of a run's progress, at most once per second."""

    folder: Path  #: The run directory
    total: int  #: Number of smarticles in the scene
    show: bool  #: Whether to draw a progress line on the terminal
    _progress: Progress = field(default_factory=Progress)
    _begun: float = field(init=False)
    _start: float = 0.0
    _resumed: tuple[float, float] = (0.0, 0.0)  # wall time and simulated time at the beginning or the resumption [s]
    _last: float = -math.inf

    def __post_init__(self) -> None:
        self._begun = monotonic()

    def begin(self, *, phase: str, start: float, time: float, end: float | None) -> None:
        """Begin or resume a phase at a simulated time [s]; its end is None if it is unknown."""
        self._progress = self._progress.model_copy(update={"phase": phase, "end_s": end})
        self._start = start
        self._resumed = (monotonic(), time)
        self._last = -math.inf

    def warn(self, message: str) -> None:
        """Print a warning to standard error."""
        self._erase()
        warn(message)

    def checkpointed(self, time: float) -> None:
        """Write the simulated time [s] of a new checkpoint without delay."""
        progress = self._progress = self._progress.model_copy(update={"checkpoint_s": time})
        if progress.count is not None:
            self._last = -math.inf
            self.update(time=time, phi=math.nan if progress.phi is None else progress.phi, count=progress.count)

    def update(self, *, time: float, phi: float, count: int) -> None:
        """Write simulated time [s], packing fraction [1] and number of smarticles, at most once per second."""
        wall, known_phi = monotonic(), phi if math.isfinite(phi) else None
        update = {"time_s": time, "phi": known_phi, "count": count, "wall_s": wall - self._begun}
        self._progress = self._progress.model_copy(update=update)
        if wall - self._last < INTERVAL:
            return
        self._last = wall
        try:
            if self.folder.is_dir():  # a folder that was removed is not made again
                self._progress.write(self.folder / PROGRESS)
        except RunError:
            # A full disk stops the run where results are written, not here.
            return
        if self.show and self._progress.phase is not None:  # the first record comes before the first phase
            self._draw(time, count, wall)

    def finish(self, *, remove: bool = True) -> None:
        """Remove `progress.json` if `remove`, and clear the line on the terminal."""
        if remove:
            (self.folder / PROGRESS).unlink(missing_ok=True)
        self._erase()
        sys.stderr.flush()

    def _erase(self) -> None:
        if self.show:
            sys.stderr.write(ERASE_LINE)

    def _draw(self, time: float, count: int, wall: float) -> None:
        (wall_resumed, resumed), progress = self._resumed, self._progress
        phase, end, phi = progress.phase, progress.end_s, progress.phi
        done, left = "", ""
        if end is not None and time > resumed:
            fraction = (time - self._start) / (end - self._start)
            bar = "█" * round(20 * fraction)
            done = f" {bar:<20} {100 * fraction:3.0f} %"
            ahead = max(0.0, end - time)
            left = f"  {(wall - wall_resumed) * ahead / (time - resumed):.0f} s left in this phase"
        elif phase == "deposit":
            fraction = count / self.total
            done = f" {'█' * round(20 * fraction):<20} {count}/{self.total}"
            if 0 < fraction < 1:
                # The pile grows, and each layer costs as much as the pile below it: time grows with the square of N.
                left = f"  about {(wall - wall_resumed) * (1 / fraction**2 - 1):.0f} s left in this phase"
        packing = f"  φ {phi:.3f}" if phi is not None else ""
        redraw(f"{phase:<8}{done}  t = {time:.2f} s{packing}{left}")
