"""One run before the camera: its frames, what stands around them, and what its colours tell."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from dem.errors import InputError
from dem.record.forces import NO_FORCES, has_forces, read_forces
from dem.record.frames import FrameSequence, read_frames
from dem.record.run import Run, open_run
from postprocess.pictures.camera import Look, extent, rims
from postprocess.pictures.surroundings import Surroundings, read_surroundings

if TYPE_CHECKING:
    from numpy.typing import NDArray

Span = tuple[float, float]
"""Least and largest value of a scale of colours."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Shot:
    """A run to be drawn."""

    run: Run
    frames: FrameSequence = field(repr=False)
    around: Surroundings = field(repr=False)

    @classmethod
    def of(cls, directory: Path | str) -> Self:
        """A shot of a run directory.

        Raises:
            InputError: Something of it is missing or damaged.
        """
        run = open_run(directory)
        return cls(run=run, frames=read_frames(directory), around=read_surroundings(run))

    def extent(self, indices: Iterable[int], look: Look) -> NDArray[np.float64]:
        """(n, 3) [mm], what the camera must have in view to show some frames."""
        return np.concatenate([extent(self.frames[int(i)], self.run, look, self.around) for i in indices])

    def rims(self, top: float, look: Look) -> NDArray[np.float64]:
        """(n, 3) [mm], what of a wall that reaches up to `top` [mm] the camera must have in view."""
        return rims(top, self.run, look, self.around)

    def values(self, indices: Iterable[int], look: Look) -> list[NDArray[Any]]:
        """What the colours of some frames tell, (N,) each."""
        return [look.colouring.values(self.frames[int(i)], self.run) for i in indices]

    def largest_force(self, indices: Iterable[int]) -> float:
        """The largest normal force at a contact in some frames [N]; a millinewton where there is none.

        Raises:
            InputError: The run records no forces.
        """
        if not has_forces(self.run.path):
            msg = f"{self.run.path}: records no forces to draw; {NO_FORCES}"
            raise InputError(msg)
        found = [read_forces(self.frames[int(i)]).contacts.normal.max(initial=0.0) for i in indices]
        return float(max(found)) or 1e-3

    def frame_at(self, time: float | None) -> int:
        """Index of the frame nearest to a time [s]; the last one for None.

        Raises:
            InputError: The time is before the first frame or after the last one.
        """
        if time is None:
            return len(self.frames) - 1
        first, last = float(self.frames.times[0]), float(self.frames.times[-1])
        slack = 1e-9 * max(abs(first), abs(last), 1.0)
        if not first - slack <= time <= last + slack:
            msg = f"time must be between {first:g} s and {last:g} s, the run's frames: got {time:g} s"
            raise InputError(msg)
        return int(np.argmin(np.abs(self.frames.times - time)))


def common_times(shots: Sequence[Shot]) -> NDArray[np.float64]:
    """Times of the frames that all runs have come to: those of the one with the fewest [s].

    Raises:
        InputError: There is no time at which all have frames.
    """
    low = max(float(shot.frames.times[0]) for shot in shots)
    high = min(float(shot.frames.times[-1]) for shot in shots)
    if low > high:
        spans = ", ".join(f"{shot.run.path} {shot.frames.times[0]:g} to {shot.frames.times[-1]:g} s" for shot in shots)
        msg = f"the runs have no time in common: {spans}; compare runs that overlap in time"
        raise InputError(msg)
    inside = [shot.frames.times[(shot.frames.times >= low) & (shot.frames.times <= high)] for shot in shots]
    return min(inside, key=len)


def span_of(values: Iterable[NDArray[Any]]) -> Span:
    """Least and largest of all values."""
    joined = np.concatenate(list(values))
    return float(joined.min()), float(joined.max())
