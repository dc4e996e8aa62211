"""Motions of a barb: its angle as a function of time, as data.

A motion begins at the barb's present angle and may depend on it. Each step of a sequence begins at the angle at which
the previous step ended. A motion has no state: angles of many smarticles are computed at once, for any time.

Angles are in degrees in a scene file, and in radians in this module's functions.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dem.arrays import Array
from dem.setting.part import Duration, Frequency, HingeAngle, Part, Turning

Angles = Array | float
Course = Callable[[Array], Array]  # function from times since the beginning of a motion [s] to angles [rad]


@dataclass(frozen=True)
class Leg:
    """A simple motion that is part of a motion, such as a step of a sequence."""

    key: str  #: Key of the simple motion in the whole motion, e.g. "steps.1"; "" if it is the whole motion
    motion: SimpleMotion
    start: Array  #: Angles at the beginning of the leg [rad]
    home: Array  #: Angles at the beginning of the phase [rad]
    until: float  #: Duration of the leg [s]

    def extent(self) -> tuple[Array, Array, float]:
        """Return lowest and highest angle [rad] for each angle of `start`, and the greatest speed [rad/s]."""
        low, high, speed = self.motion.extent(self.start, self.home, self.until)
        return low + np.zeros_like(self.start), high + np.zeros_like(self.start), float(np.max(speed))


class BaseMotion(Part):
    """Base of all motions."""

    type: str

    @property
    def duration(self) -> float:
        """Duration [s]; inf where the motion lasts as long as its phase."""
        raise NotImplementedError

    @property
    def period(self) -> float | None:
        """Period after which the motion repeats itself [s]; None for a motion without repetition."""
        return None

    def course(self, start: Array, home: Array) -> Course:
        """Return a function from the time [s] since the beginning of the motion to the angles [rad].

        `start` has the angles at the beginning of the motion, `home` those at the beginning of the phase, in its shape
        [rad].
        """
        raise NotImplementedError

    def legs(self, start: Array, home: Array, until: float) -> Iterator[Leg]:
        """Yield the simple motions of which the motion consists, in order, up to the time `until` [s].

        A repeated sequence yields its first two repetitions only, since all later ones are equal to the second.
        `start` has the angles at the beginning of the motion, `home` those at the beginning of the phase [rad].
        """
        raise NotImplementedError

    def end(self, start: Array, home: Array) -> Array:
        """Return the angles [rad] at the end of a motion of finite duration.

        `start` has the angles at the beginning of the motion, `home` those at the beginning of the phase [rad].
        """
        return self.course(start, home)(np.array(self.duration))


class SimpleMotion(BaseMotion):
    """Base of all motions except sequences."""

    pace: ClassVar[tuple[str, str]] = ("duration_s", "s")  # the key that sets the speed, and its unit

    def extent(self, start: Array, home: Array, until: float) -> tuple[Angles, Angles, Angles]:
        """Return lowest and highest angle [rad] and greatest speed [rad/s] up to the time `until` [s].

        Jumps of the angle do not count as speed, since motors follow them at their speed limit. `start` has the angles
        at the beginning of the motion, `home` those at the beginning of the phase [rad].
        """
        raise NotImplementedError

    @property
    def changes_in(self) -> float:
        """Time within which the angle changes, a period or a turn [s]; inf where it stays."""
        raise NotImplementedError

    def legs(self, start: Array, home: Array, until: float) -> Iterator[Leg]:
        yield Leg("", self, start, home, until)


class _Endless(SimpleMotion):
    """A motion that lasts as long as its phase, unless `duration_s` is given."""

    duration_s: Duration | None = Field(None, description="length [s]; default: as long as the phase")

    @property
    def duration(self) -> float:
        return math.inf if self.duration_s is None else self.duration_s


class Hold(_Endless):
    """Keep the angle at which the motion begins."""

    type: Literal["hold"]

    @property
    def changes_in(self) -> float:
        return math.inf

    def course(self, start: Array, home: Array) -> Course:
        return lambda times: start

    def extent(self, start: Array, home: Array, until: float) -> tuple[Angles, Angles, Angles]:
        return start, start, 0.0


class _Straight(SimpleMotion):
    """Turn at a constant speed to an angle, and keep this angle."""

    duration_s: Duration = Field(..., description="time that the turn takes [s]")

    @property
    def duration(self) -> float:
        return self.duration_s

    @property
    def changes_in(self) -> float:
        return self.duration_s

    def goal(self, home: Array) -> Array:
        """Return the angles [rad] at the end of the turn; `home`: those at the beginning of the phase [rad]."""
        raise NotImplementedError

    def course(self, start: Array, home: Array) -> Course:
        goal, length = self.goal(home), self.duration_s

        def at(times: Array) -> Array:
            done = np.minimum(np.maximum(times / length, 0.0), 1.0)
            # Weighted so that both ends are exact.
            return np.asarray((1.0 - done) * start + done * goal)

        return at

    def extent(self, start: Array, home: Array, until: float) -> tuple[Angles, Angles, Angles]:
        last = self.course(start, home)(np.array(until))
        return np.minimum(start, last), np.maximum(start, last), np.abs(self.goal(home) - start) / self.duration_s


class Ramp(_Straight):
    """Turn at a constant speed to a given angle."""

    type: Literal["ramp"]
    to_deg: HingeAngle = Field(..., description="angle at the end [deg]")

    def goal(self, home: Array) -> Array:
        return np.array(math.radians(self.to_deg))


class Return(_Straight):
    """Turn at a constant speed back to the angle at which the phase began."""

    type: Literal["return"]

    def goal(self, home: Array) -> Array:
        return home


class _Wave(_Endless):
    """Swing about an angle; when the motion begins, the scheduled angle jumps to the swing's first angle.

    With `cycles_offset` 0 the swing begins at the centre, with rising angle.
    """

    centre_deg: HingeAngle = Field(..., description="angle that the barb swings about [deg]")
    amplitude_deg: float = Field(
        ..., ge=1e-6, le=120, description="largest distance from the centre, half the full swing [deg]"
    )
    cycles_offset: float = Field(
        0.0, ge=-1e6, le=1e6, description="phase at the beginning in cycles [1]; 0.25: begins at the highest angle"
    )

    @property
    def frequency(self) -> float:
        """Cycles per second [Hz]."""
        raise NotImplementedError

    @property
    def period(self) -> float:
        return 1 / self.frequency

    @property
    def changes_in(self) -> float:
        return self.period

    @property
    def fastest(self) -> float:
        """Greatest speed of the swing [rad/s], reached in every half cycle."""
        raise NotImplementedError

    def swing(self, cycles: Array) -> Array:
        """Return the deviation from the centre over the amplitude [1], after numbers of cycles [1]."""
        raise NotImplementedError

    def course(self, start: Array, home: Array) -> Course:
        centre, amplitude = math.radians(self.centre_deg), math.radians(self.amplitude_deg)
        frequency, offset = self.frequency, self.cycles_offset
        return lambda times: centre + amplitude * self.swing(frequency * times + offset)

    def extent(self, start: Array, home: Array, until: float) -> tuple[Angles, Angles, Angles]:
        first = self.cycles_offset
        last = first + self.frequency * until
        ends = self.swing(np.array([first, last] if math.isfinite(last) else [first]))
        # The highest angle is reached a quarter of a cycle after whole numbers of cycles, the lowest three quarters.
        high = 1.0 if np.floor(last - 0.25) >= np.ceil(first - 0.25) else float(ends.max())
        low = -1.0 if np.floor(last - 0.75) >= np.ceil(first - 0.75) else float(ends.min())
        centre, amplitude = math.radians(self.centre_deg), math.radians(self.amplitude_deg)
        return centre + amplitude * low, centre + amplitude * high, self.fastest


_SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
         2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
_COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
           -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip


def sine_of(cycles: Array) -> Array:
    """Return sin(2π cycles) [1] with identical bits on every processor, unlike NumPy's sine.

    Source: kernels of fdlibm (Sun Microsystems, 1993), after an exact reduction to an eighth of a cycle.
    """
    quarters = np.round(4 * cycles)
    x = (cycles - quarters / 4) * (2 * math.pi)
    square = x * x
    odd, even = np.zeros_like(x), np.zeros_like(x)
    for s, c in zip(_SINE[::-1], _COSINE[::-1], strict=True):
        odd, even = odd * square + s, even * square + c
    sine, cosine = x + x * square * odd, 1 - square / 2 + square * square * even
    turn = np.mod(quarters, 4)
    return np.asarray(np.where(turn == 0, sine, np.where(turn == 1, cosine, np.where(turn == 2, -sine, -cosine))))


class Sine(_Wave):
    """Swing sinusoidally about an angle: centre + amplitude · sin(2π (frequency · t + offset))."""

    type: Literal["sine"]
    frequency_hz: Frequency = Field(..., description="cycles per second [Hz]")

    pace: ClassVar[tuple[str, str]] = ("frequency_hz", "Hz")

    @property
    def frequency(self) -> float:
        return self.frequency_hz

    def swing(self, cycles: Array) -> Array:
        return sine_of(cycles)

    @property
    def fastest(self) -> float:
        return 2 * math.pi * self.frequency_hz * math.radians(self.amplitude_deg)


class Triangle(_Wave):
    """Swing about an angle at a constant speed between the turning points."""

    type: Literal["triangle"]
    speed_rad_per_s: Turning = Field(..., description="speed between the turning points [rad/s]")

    pace: ClassVar[tuple[str, str]] = ("speed_rad_per_s", "rad/s")

    @property
    def frequency(self) -> float:
        return self.speed_rad_per_s / (4 * math.radians(self.amplitude_deg))

    def swing(self, cycles: Array) -> Array:
        quarter = cycles - 0.25
        return 4 * np.abs(quarter - np.floor(quarter) - 0.5) - 1

    @property
    def fastest(self) -> float:
        return self.speed_rad_per_s


class Sequence(BaseMotion):
    """Run motions in order, once or repeatedly; each begins at the angle at which the previous one ended."""

    type: Literal["sequence"]
    steps: tuple[Motion, ...] = Field(..., description="motions in order, at least one")
    repeat: int | None = Field(
        1, ge=1, le=1_000_000, description="number of times that all steps are run [1]; null: as long as the phase"
    )

    @model_validator(mode="after")
    def _steps_end(self) -> Self:
        if not self.steps:
            raise ValueError("steps: is empty; give at least one motion")
        once = self.repeat == 1
        for number, step in enumerate(self.steps[:-1] if once else self.steps):
            if math.isinf(step.duration):
                where = "each step but the last" if once else "each step of a sequence that is repeated"
                # A nested sequence has no end because of its own `repeat`, or because of its last step.
                key = "finite repeat" if isinstance(step, Sequence) and step.repeat is None else "duration_s"
                raise ValueError(f"steps.{number}: {step.type} has no end; give it a {key}, as {where} needs one")
        return self

    @property
    def _lengths(self) -> list[float]:
        return [step.duration for step in self.steps]

    @property
    def duration(self) -> float:
        return math.inf if self.repeat is None else self.repeat * sum(self._lengths)

    @property
    def period(self) -> float | None:
        # Repetitions are alike from the second one on; the first may begin at another angle.
        return None if self.repeat == 1 else sum(self._lengths)

    def _courses(self, start: Array, home: Array) -> list[Course]:
        courses, angles = [], start
        for step in self.steps:
            courses.append(step.course(angles, home))
            if math.isfinite(step.duration):
                angles = step.end(angles, home)
        return courses

    def end(self, start: Array, home: Array) -> Array:
        # All repetitions end at one angle.
        for step in self.steps:
            start = step.end(start, home)
        return start

    def course(self, start: Array, home: Array) -> Course:
        count, length, repeated = len(self.steps), sum(self._lengths), self.repeat != 1
        begins = [0.0, *accumulate(self._lengths[:-1])]
        courses = self._courses(start, home)
        if repeated:
            # From the second one on all repetitions are alike: the steps end at an angle that does not depend on where
            # they began, or, if all of them hold or return, at the angle where they began.
            courses += self._courses(self.end(start, home), home)

        # At the time at which a step ends its own angle counts, so that a sequence ends at the angle of its last step.
        def at_one(time: float, times: Array) -> Array:
            cycle = max(math.ceil(time / length) - 1, 0) if repeated else 0
            begun = cycle * length if cycle else 0.0
            step = bisect_left(begins, time - begun, lo=1) - 1
            return courses[step + count * (cycle > 0)](times - (begun + begins[step]))

        def at(times: Array) -> Array:
            if times.size == 1:  # smarticles that move together, at every control update: the fast case
                return at_one(times.item(), times)
            cycles = np.maximum(np.ceil(times / length) - 1, 0) if repeated else np.zeros_like(times)
            local = times - cycles * length if repeated else times
            slots = np.searchsorted(begins[1:], local) + count * (cycles > 0)
            angles = np.empty(np.broadcast_shapes(times.shape, start.shape))
            for slot in np.unique(slots):
                np.copyto(angles, courses[slot](local - begins[slot % count]), where=slots == slot)
            return angles

        return at

    def legs(self, start: Array, home: Array, until: float) -> Iterator[Leg]:
        begun = 0.0
        for _ in range(1 if self.repeat == 1 else 2):
            for number, step in enumerate(self.steps):
                if begun > 0 and begun >= until:
                    return
                left, last = until - begun, self.repeat == 1 and number == len(self.steps) - 1
                for leg in step.legs(start, home, left if last else min(left, step.duration)):
                    yield replace(leg, key=f"steps.{number}.{leg.key}".removesuffix("."))
                begun += step.duration
                if math.isfinite(begun):
                    start = step.end(start, home)


Simple = Hold | Ramp | Return | Sine | Triangle
Motion = Annotated[Simple | Sequence, Field(discriminator="type")]
Sequence.model_rebuild()
