"""What all motions of a barb have in common: how they are asked, and the stretches that they are made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dem.setting.part import Part

Array = NDArray[np.float64]

Course = Callable[[Array], Array]  # a motion that has begun: times [s] since then to angles [rad]


@dataclass(frozen=True)
class Leg:
    """One stretch of a motion that is no sequence.

    Args:
        key: where the motion stands below the one it is a leg of, "" or e.g. "steps.1".
        motion: the motion of this stretch.
        start: angles [rad] at its beginning.
        home: angles [rad] at the beginning of the phase.
        until: how long it lasts [s].
    """

    key: str
    motion: SimpleMotion
    start: Array
    home: Array
    until: float

    def extremes(self) -> tuple[Array, Array]:
        """Lowest and highest angle [rad] of the stretch, for each start."""
        low, high = self.motion.bounds(self.start, self.home, self.until)
        return low + np.zeros_like(self.start), high + np.zeros_like(self.start)

    def speed(self) -> float:
        """Greatest speed [rad/s] over all starts, jumps apart."""
        return float(np.max(self.motion.speeds(self.start, self.home)))


class BaseMotion(Part):
    """What all motions have in common."""

    type: str

    @property
    def duration(self) -> float:
        """Length [s]; inf: as long as its phase."""
        raise NotImplementedError

    @property
    def period(self) -> float | None:
        """Time [s] after which the motion repeats itself; None: it does not."""
        return None

    def course(self, start: Array, home: Array) -> Course:
        """The motion from angles `start` [rad] on, in a phase that began at angles `home` [rad]."""
        raise NotImplementedError

    def legs(self, start: Array, home: Array, until: float) -> Iterator[Leg]:
        """The stretches that make the motion up to the time `until` [s]; of repetitions only those that differ."""
        raise NotImplementedError

    def end(self, start: Array, home: Array) -> Array:
        """Angles [rad] at the end of a motion of finite length."""
        return self.course(start, home)(np.array(self.duration))

    def angle(self, times: Array, start: Array | float) -> Array:
        """Angles [rad] at times [s] since the phase began, given the angles [rad] at which it did.

        Arrays are combined by NumPy's rules: times (T, 1) and starts (N,) give (T, N). Beyond the end of a motion what
        is periodic goes on, all else stays where it is.
        """
        times, begun = np.asarray(times, dtype=np.float64), np.asarray(start, dtype=np.float64)
        angles = np.empty(np.broadcast_shapes(times.shape, begun.shape))
        angles[...] = self.course(begun, begun)(times)
        return angles

    def extremes(self, start: Array | float, until: float) -> tuple[Array, Array]:
        """Lowest and highest angle [rad] that the motion asks for from its beginning to the time `until` [s].

        Args:
            start: angles [rad] at which the phase began, of any shape, which is that of the results.
            until: end of the stretch of time [s]; must be finite for a motion that never ends.
        """
        begun = np.asarray(start, dtype=np.float64)
        lows, highs = zip(*(leg.extremes() for leg in self.legs(begun, begun, until)), strict=True)
        return np.min(lows, axis=0), np.max(highs, axis=0)

    def speed(self, start: Array | float, until: float = math.inf) -> float:
        """Greatest speed [rad/s] over all starts [rad], up to the time `until` [s].

        A jump of the angle does not count: the motor follows it at its speed limit.
        """
        begun = np.asarray(start, dtype=np.float64)
        return max(leg.speed() for leg in self.legs(begun, begun, until))


class SimpleMotion(BaseMotion):
    """A motion that is no sequence of others."""

    pace: ClassVar[tuple[str, str]] = ("duration_s", "s")  # the key that sets the speed, and its unit

    def bounds(self, start: Array, home: Array, until: float) -> tuple[Array | float, Array | float]:
        """Lowest and highest angle [rad] up to the time `until` [s]."""
        raise NotImplementedError

    def speeds(self, start: Array, home: Array) -> Array | float:
        """Greatest speed [rad/s], jumps apart."""
        raise NotImplementedError

    def legs(self, start: Array, home: Array, until: float) -> Iterator[Leg]:
        """See `BaseMotion.legs`."""
        yield Leg("", self, start, home, until)
