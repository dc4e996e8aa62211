"""Which frames a film shows, and how fast it plays."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Self

import numpy as np

from dem.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

MOST = 150
"""Pictures of a film, unless a time between them is asked for."""

RATE = 15.0
"""Pictures per second of a film [1/s], unless asked for."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Moments:
    """Times at equal distances, so that a film plays at one speed.

    Attributes:
        times: (n,) simulated times [s]; each is shown by the recorded frame nearest to it.
        every: From one to the next [s].
        rate: Pictures per second [1/s].
    """

    times: NDArray[np.float64] = field(repr=False)
    every: float
    rate: float

    @property
    def speed(self) -> float:
        """Simulated time over playing time [-]."""
        return self.every * self.rate

    @property
    def pace(self) -> str:
        """The speed in words."""
        return f"{float(f'{self.speed:.3g}'):g} × real time"

    @classmethod
    def chosen(
        cls,
        recorded: ArrayLike,
        *,
        start: float | None = None,
        end: float | None = None,
        every: float | None = None,
        rate: float = RATE,
        most: int = MOST,
    ) -> Self:
        """Moments of a film.

        Args:
            recorded: (m,) times of the frames, ascending [s].
            start: First moment [s]; the first frame if not given.
            end: Last moment at most [s]; the last frame if not given.
            every: From one moment to the next [s]; if not given the time between frames, or a multiple of it that
                makes no more than `most`.
            rate: Pictures per second [1/s].
            most: See `every`.

        Raises:
            InputError: Fewer than two moments, or times out of order or out of the run.
        """
        recorded = np.asarray(recorded, dtype=np.float64)
        if len(recorded) < 2:
            msg = f"a film needs at least 2 frames: got {len(recorded)}; draw a picture, .png"
            raise InputError(msg)
        if not (math.isfinite(rate) and 0 < rate <= 100):
            msg = f"fps must be above 0 and up to 100 pictures per second: got {rate:g}; {RATE:g} is usual"
            raise InputError(msg)
        first, last = float(recorded[0]), float(recorded[-1])
        low, high = first if start is None else start, last if end is None else end
        slack = 1e-9 * max(abs(first), abs(last), 1.0)
        if not first - slack <= low < high <= last + slack:
            msg = (
                f"a film must begin before it ends, within {first:g} s to {last:g} s, the run's frames: "
                f"got {low:g} s to {high:g} s"
            )
            raise InputError(msg)
        spacing = float(np.median(np.diff(recorded)))
        if every is None:
            every = spacing * max(1, math.ceil((high - low) / spacing / (most - 1) - 1e-6))
        elif not (math.isfinite(every) and every >= spacing * (1 - 1e-6)):
            msg = f"every must be {spacing:g} s or more, the time between the run's frames: got {every:g} s"
            raise InputError(msg)
        steps = math.floor((high - low) / every + 1e-6)
        if steps < 1:
            msg = f"every {every:g} s leaves one picture between {low:g} s and {high:g} s; choose less"
            raise InputError(msg)
        return cls(times=low + every * np.arange(steps + 1.0), every=every, rate=rate)

    def indices(self, recorded: NDArray[np.float64]) -> NDArray[np.int64]:
        """(n,) the frame nearest to each moment, of frames at (m,) times [s]."""
        nearest: NDArray[np.int64] = np.abs(recorded[None] - self.times[:, None]).argmin(axis=1).astype(np.int64)
        return nearest


def durations(count: int, rate: float, unit: float) -> list[int]:
    """How long each of some pictures is shown, in whole units of time [unit of `unit`], right to half a unit in sum.

    Args:
        count: Pictures.
        rate: Pictures per second [1/s].
        unit: Seconds that a format can tell apart: 0.01 s of a GIF, 0.001 s of a WebP [s].

    Example:
        >>> durations(4, 15.0, 0.01)
        [7, 6, 7, 7]
    """
    ends = [round(k / rate / unit) for k in range(count + 1)]
    return [after - before for before, after in pairwise(ends)]
