"""Measure how far bodies move: the mean squared displacement over time."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError
from dem.record.frames import FrameSequence
from postprocess.geometry.links import Flags, Floats, Whole, centres_of_mass, floats

# Largest deviation of a time between frames, over their interval [1]. Frames are at the nearest time steps; those of
# taps divide no interval, so that times between frames differ by a step, 0.2 % of the usual interval.
_EVEN = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class MeanSquaredDisplacement:
    """Mean squared displacement over L times, averaged over bodies and over all starts."""

    times_s: Floats = field(repr=False)  #: (L,) times between start and end [s], from 0
    along_m2: Floats = field(repr=False)  #: (L, 3) mean squared displacement along x, y and z [m²]
    #: (L,) number of displacements that were averaged; those whose times overlap are not independent
    count: Whole = field(repr=False)

    @property
    def total_m2(self) -> Floats:
        """(L,) mean squared displacement in space [m²]."""
        return np.asarray(self.along_m2.sum(axis=1))


def mean_squared_displacement(
    positions: ArrayLike | FrameSequence, times: ArrayLike | None = None, *, without_drift: bool = False
) -> MeanSquaredDisplacement:
    """Compute the mean squared displacement of bodies over the time between two frames.

    Displacements over one time are averaged over all bodies and all pairs of frames that are so far apart (a moving
    window).

    Args:
        positions: Frames at equal intervals, such as `run.at_intervals(run.frames.in_phase(1))`; or positions
            (T, N, 3) [m] of N bodies at T times, NaN where a body is missing.
        times: (T,) times of the positions [s]; left out for frames, which have them.
        without_drift: Whether to subtract the mean motion of all bodies.

    Raises:
        InputError: Fewer than 2 times, times that are not at equal intervals, or positions of another shape.

    Example:
        >>> steady = np.arange(4.0)[:, None, None] * [0.0, 0.0, 0.5]
        >>> mean_squared_displacement(steady, times=[0, 2, 4, 6]).total_m2.tolist()
        [0.0, 0.25, 1.0, 2.25]
    """
    if isinstance(positions, FrameSequence):
        times, positions = positions.times if times is None else times, centres_of_mass(positions)
    places = floats("positions", positions, "give frames of a run, such as run.at_intervals(run.frames.in_phase(1))")
    when = np.asarray(times, dtype=np.float64)
    if places.ndim != 3 or places.shape[2] != 3 or len(places) < 2:
        raise InputError(f"positions must be (T, N, 3) [m] at 2 times or more: got {places.shape}; give a run's frames")
    if when.shape != places.shape[:1]:
        raise InputError(f"times must be ({len(places)},) [s], one for each frame: got {when.shape}")
    steps = np.diff(when)
    interval = float(np.median(steps))
    uneven = np.logical_not(np.abs(steps - interval) <= _EVEN * interval)
    if uneven.any() or not interval > 0:
        number = int(np.argmax(uneven)) if uneven.any() else 0
        raise InputError(
            f"frame {number + 1} is {steps[number]:g} s after the one before, others {interval:g} s: give frames at "
            "equal intervals, such as those of one phase, run.at_intervals(run.frames.in_phase(1))"
        )
    along, count = np.full((len(places), 3), np.nan), np.zeros(len(places), np.int64)
    for lag in range(len(places)):
        moved = places[lag:] - places[: len(places) - lag]
        known: Flags = np.asarray(np.isfinite(moved).all(axis=2))
        if without_drift:
            every = np.where(known[:, :, None], moved, 0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)[:, None]
            moved = moved - every[:, None]
        count[lag] = known.sum()
        if count[lag]:
            along[lag] = (moved[known] ** 2).mean(axis=0)
    return MeanSquaredDisplacement(times_s=when - when[0], along_m2=along, count=count)
