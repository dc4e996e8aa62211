"""Progress of a running simulation, in `progress.json` and in one line on the terminal."""

from __future__ import annotations

import math
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from dem.errors import RunError
from dem.record.document import Progress
from dem.record.names import PROGRESS

INTERVAL = 1.0  # s of wall time between updates


def _now() -> float:
    return time.monotonic()


@dataclass
class ProgressWriter:
    """Writer of a run's progress, at most once per second."""

    folder: Path  #: The run directory
    total: int  #: Smarticles of the scene
    show: bool  #: Whether to write to the terminal
    _said: Progress = field(default_factory=Progress)
    _begun: float = field(default_factory=_now)
    _start: float = 0.0
    _here_since: tuple[float, float] = (0.0, 0.0)
    _last: float = -math.inf

    def begin(self, *, index: int, phase: str, start: float, now: float, end: float | None) -> None:
        """Begin or resume a phase.

        Args:
            start: simulated time at which the phase began [s].
            now: present simulated time [s].
            end: simulated time at which the phase will end [s]; None: unknown.
        """
        self._said = self._said.model_copy(update={"phase": phase, "phase_index": index, "end_s": end})
        self._start = start
        self._here_since = (_now(), now)
        self._last = -math.inf

    def warn(self, message: str) -> None:
        """Print a warning to standard error."""
        start = "\r\x1b[K" if self.show else ""
        sys.stderr.write(f"{start}smarticles: warning: {message}\n")

    def checkpointed(self, time: float) -> None:
        """Write the simulated time [s] of a new checkpoint at once."""
        said = self._said = self._said.model_copy(update={"checkpoint_s": time})
        if said.count is not None:
            self._last = -math.inf
            self.update(time=time, phi=math.nan if said.phi is None else said.phi, count=said.count)

    def update(self, *, time: float, phi: float, count: int) -> None:
        """Write simulated time [s], packing fraction [1] and number of smarticles, if a second has passed."""
        now = _now()
        said = {"time_s": time, "phi": phi if math.isfinite(phi) else None, "count": count, "wall_s": now - self._begun}
        self._said = self._said.model_copy(update=said)
        if now - self._last < INTERVAL:
            return
        self._last = now
        try:
            if self.folder.is_dir():  # a folder that was removed is not made again
                self._said.write(self.folder / PROGRESS)
        except RunError:
            # A full disk stops the run where results are written, not here.
            return
        if self.show:
            self._draw(time, count, now)

    def finish(self) -> None:
        """Remove `progress.json`, and clear the line on the terminal."""
        (self.folder / PROGRESS).unlink(missing_ok=True)
        if self.show:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()

    def _draw(self, simulated: float, count: int, now: float) -> None:
        (wall_since, since), phase, end, phi = self._here_since, self._said.phase, self._said.end_s, self._said.phi
        done, left = "", ""
        if end is not None and simulated > since:
            fraction = (simulated - self._start) / (end - self._start)
            bar = "█" * round(20 * fraction)
            done = f" {bar:<20} {100 * fraction:3.0f} %"
            ahead = max(0.0, end - simulated)
            left = f"  {(now - wall_since) * ahead / (simulated - since):.0f} s left in this phase"
        elif phase == "deposit":
            fraction = count / self.total
            done = f" {'█' * round(20 * fraction):<20} {count}/{self.total}"
            if 0 < fraction < 1:
                # The pile grows, and each layer costs as much as the pile under it: time goes as the square.
                left = f"  about {(now - wall_since) * (1 / fraction**2 - 1):.0f} s left in this phase"
        packing = f"  φ {phi:.3f}" if phi is not None else ""
        line = f"{phase:<8}{done}  t = {simulated:.2f} s{packing}{left}"
        sys.stderr.write(f"\r\x1b[K{line}")
        sys.stderr.flush()
