"""φ against friction at one aspect ratio and stage, interpolated between the measured points, against Gravish's value.

φ falls with friction: where it lies above Gravish's throughout, the friction sought is above all that was measured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

Place = Literal["within the range", "above the range", "below the range"]

STEP = 0.001
"""Of friction, in which intervals and the best friction are found [-]."""


_ROUNDING = 1e-12  # of φ, where a curve is Gravish's to the last digit and has no error


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """The friction at which φ is Gravish's.

    Attributes:
        value: [-]; inf or -inf beyond what was measured.
        low: Lower end of its 95 % interval [-]; -inf where the interval is open, NaN without errors.
        high: Upper end, likewise.
        place: Where it is.
    """

    value: float
    low: float
    high: float
    place: Place


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """φ of several coefficients of friction, with what it is compared with.

    Attributes:
        friction: (n,) coefficients, ascending [-].
        packing: (n,) means of φ [-].
        half_widths: (n,) of their 95 % intervals [-]; NaN where unknown.
        reference: Gravish's φ [-].
        reading_error: Of the reference, 95 % [-].
        per_error: Half-widths over standard errors, by Student's t.
        freedom: Degrees of freedom that the errors are known with.
    """

    friction: NDArray[np.float64]
    packing: NDArray[np.float64]
    half_widths: NDArray[np.float64]
    reference: float
    reading_error: float
    per_error: float
    freedom: int

    def deviation(self, friction: NDArray[np.float64]) -> NDArray[np.float64]:
        """φ less Gravish's, linear between the points [-]."""
        return np.asarray(np.interp(friction, self.friction, self.packing) - self.reference, dtype=np.float64)

    def error(self, friction: NDArray[np.float64]) -> NDArray[np.float64]:
        """Half-width of the 95 % interval of the deviation: the errors of both neighbours and of the reading [-]."""
        if len(self.friction) == 1:
            return np.asarray(
                np.hypot(np.full(friction.shape, self.half_widths[0]), self.reading_error), dtype=np.float64
            )
        right = np.clip(np.searchsorted(self.friction, friction), 1, len(self.friction) - 1)
        low, high = self.friction[right - 1], self.friction[right]
        part = (friction - low) / (high - low)
        of_mean = np.hypot((1 - part) * self.half_widths[right - 1], part * self.half_widths[right])
        return np.asarray(np.hypot(of_mean, self.reading_error), dtype=np.float64)

    def grid(self) -> NDArray[np.float64]:
        """The measured points, and steps between them [-]."""
        steps = np.arange(self.friction[0], self.friction[-1] + STEP / 2, STEP)
        return np.unique(np.concatenate([np.clip(steps, None, self.friction[-1]), self.friction]))

    def crossing(self) -> Crossing:
        """The friction at which φ is Gravish's.

        Where scatter makes φ cross it more than once: the middle between the first crossing and the last. The interval
        has all friction at which φ is not clearly another than Gravish's.
        """
        zeros = self._zeros()
        above = bool(self.packing[0] > self.reference)
        place: Place = "within the range" if zeros else "above the range" if above else "below the range"
        value = (zeros[0] + zeros[-1]) / 2 if zeros else math.inf if above else -math.inf
        return Crossing(value=value, place=place, **self._interval(place, zeros))

    def within(self, margin: float, friction: float) -> float:
        """The confidence that φ differs by no more than a margin, both ways, from Gravish's.

        Args:
            margin: [-].
            friction: [-].

        Returns:
            0 to 1, by Student's t about the deviation; NaN without errors.
        """
        at = np.array([friction])
        deviation, error = float(self.deviation(at)[0]), float(self.error(at)[0]) / self.per_error
        if not math.isfinite(error):
            return math.nan
        upper, lower = (stdtr(self.freedom, (side * margin - deviation) / error) for side in (1, -1))
        return float(upper - lower)

    def _zeros(self) -> list[float]:
        """Where φ, linear between the points, is Gravish's [-]."""
        off = self.packing - self.reference
        found = [float(friction) for friction, value in zip(self.friction, off, strict=True) if value == 0]
        for left in range(len(off) - 1):
            if off[left] * off[left + 1] < 0:
                part = off[left] / (off[left] - off[left + 1])
                found.append(float(self.friction[left] + part * (self.friction[left + 1] - self.friction[left])))
        return sorted(found)

    def _interval(self, place: Place, zeros: Sequence[float]) -> dict[str, float]:
        grid = np.unique(np.concatenate([self.grid(), zeros]))
        errors = self.error(grid)
        if not np.isfinite(errors).all():
            return {"low": math.nan, "high": math.nan}
        near = grid[np.abs(self.deviation(grid)) <= errors + _ROUNDING]
        first, last = float(grid[0]), float(grid[-1])
        if not len(near):  # nothing near, so it is clearly beyond
            return {"low": last, "high": math.inf} if place == "above the range" else {"low": -math.inf, "high": first}
        return {
            "low": -math.inf if near[0] == first or place == "below the range" else float(near[0]),
            "high": math.inf if near[-1] == last or place == "above the range" else float(near[-1]),
        }
