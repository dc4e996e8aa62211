"""Phases in which the barbs move, as data, and their compiled form for the engine.

`Actuate` is any motion that a user spells out; the other phases are presets, short for one such motion. `drive` turns a
phase into target angles over time: which smarticles move is drawn, and where they begin follows from the phases before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol, Self, TypeGuard, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from dem.setting.motion import Course, Hold, Motion, Ramp, Return, Sequence, Triangle
from dem.setting.part import REFERENCE_ASPECT_RATIO, Duration, HingeAngle, Part

if TYPE_CHECKING:
    from dem.scene.scene import Scene
    from dem.setting.parts import Motor, Smarticle

Array = NDArray[np.float64]

BARBS = 2

ActiveFraction = Annotated[
    float, Field(gt=0, le=1, description="share of the smarticles that move, drawn from the scene's seed [1]")
]
Offsets = Annotated[
    Literal["none", "random"],
    Field(
        description="none: all smarticles move together; random: each begins at another point of the period, drawn "
        "from the scene's seed"
    ),
]


def _length_of_motions(data: dict[str, Any]) -> float:
    """Default of `Actuate.duration_s`: the longest motion of those given; inf if that has no end."""
    motions = [data[key] for key in ("barbs", "barb_1", "barb_2") if data.get(key) is not None]
    return max((motion.duration for motion in motions), default=math.inf)


class Actuate(Part):
    """Move the barbs: one motion for both, `barbs`, or one for each, `barb_1` and `barb_2`."""

    type: Literal["actuate"]
    barbs: Motion | None = Field(None, description="motion of both barbs")
    barb_1: Motion | None = Field(None, description="motion of barb 1, angle α1")
    barb_2: Motion | None = Field(None, description="motion of barb 2, angle α2")
    duration_s: Duration = Field(
        default_factory=_length_of_motions, description="length of the phase [s]; default: that of the motion"
    )
    active_fraction: ActiveFraction = 1.0
    offsets: Offsets = "none"

    @model_validator(mode="after")
    def _one_motion_each(self) -> Self:
        apart = (self.barb_1 is not None) + (self.barb_2 is not None)
        if self.barbs is not None and apart:
            msg = "barbs: one motion for both barbs, but barb_1 or barb_2 is given as well; leave one or the other out"
            raise ValueError(msg)
        if self.barbs is None and apart != BARBS:
            missing = "barbs" if not apart else "barb_1" if self.barb_1 is None else "barb_2"
            msg = f"{missing}: missing; give barbs, or both barb_1 and barb_2 ({{type: hold}} for one that stays)"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _motions_fill_the_phase(self) -> Self:
        if math.isinf(self.duration_s):
            msg = "duration_s: missing, and the motion has no end of its own; give the phase or the motion one"
            raise ValueError(msg)
        for key, motion in self._named().items():
            if motion.duration < self.duration_s * (1 - 1e-9):
                msg = (
                    f"{key}: the motion ends after {motion.duration:g} s, before duration_s = {self.duration_s:g} s; "
                    "shorten the phase or end the motion with a step that holds"
                )
                raise ValueError(msg)
            if self.offsets == "random" and motion.period is None and not isinstance(motion, Hold):
                msg = (
                    f"offsets: random, but {key} ({motion.type}) has no period; use 'none', a sine, a triangle or a "
                    "sequence with repeat"
                )
                raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _something_to_offset(self) -> Self:
        if self.offsets == "random" and self.period is None:
            msg = "offsets: random, but both barbs hold; use 'none'"
            raise ValueError(msg)
        return self

    def _named(self) -> dict[str, Motion]:
        named = {"barbs": self.barbs, "barb_1": self.barb_1, "barb_2": self.barb_2}
        return {key: motion for key, motion in named.items() if motion is not None}

    @property
    def keys(self) -> tuple[str, str]:
        """The keys under which the motions of barb 1 and barb 2 stand."""
        return ("barbs", "barbs") if self.barbs is not None else ("barb_1", "barb_2")

    @property
    def motions(self) -> tuple[Motion, Motion]:
        """Motions of barb 1 and barb 2."""
        named = self._named()
        return named[self.keys[0]], named[self.keys[1]]

    @property
    def period(self) -> float | None:
        """Period [s] of the motions, the longer one of two; None: they have none."""
        return max((motion.period for motion in self.motions if motion.period is not None), default=None)

    def spelled_out(self, smarticle: Smarticle, motor: Motor) -> Actuate:
        """The phase itself; the presets say here what they are short for."""
        return self

    def own_key(self, key: str) -> str:
        """The key of this phase that sets `key` of the spelled-out one."""
        return key


class ShapeChange(Part):
    """Straighten both barbs, and turn them back to the angles where they began."""

    type: Literal["shape-change"]
    straight_deg: HingeAngle = Field(0.0, description="angle that the barbs are turned to [deg]")
    opening_s: Duration = Field(1.5, description="time to get there [s]")
    straight_hold_s: float = Field(0.0, ge=0, description="time to stay there [s]")
    closing_s: Duration = Field(1.5, description="time to get back [s]")

    @property
    def duration_s(self) -> float:
        """Length of the phase [s]."""
        return self.opening_s + self.straight_hold_s + self.closing_s

    def spelled_out(self, smarticle: Smarticle, motor: Motor) -> Actuate:
        """The phase as the motion that it is short for."""
        steps: list[Motion] = [Ramp(type="ramp", to_deg=self.straight_deg, duration_s=self.opening_s)]
        if self.straight_hold_s > 0:
            steps.append(Hold(type="hold", duration_s=self.straight_hold_s))
        steps.append(Return(type="return", duration_s=self.closing_s))
        return Actuate(type="actuate", barbs=Sequence(type="sequence", steps=tuple(steps)))

    def own_key(self, key: str) -> str:
        """The key of this phase that sets `key` of the spelled-out one."""
        return "opening_s" if key == "barbs.steps.0.duration_s" else "closing_s"


class InternalOscillation(Part):
    """Swing both barbs at the motor's speed limit, θ/2 to either side of the smarticle's own angles."""

    type: Literal["internal-oscillation"]
    theta_deg: float = Field(..., gt=0, description="θ, full swing, peak to peak [deg]")
    scaled: bool = Field(
        True,
        description="swing by θ · 0.7/(l/w) instead, so that the arc of a barb's tip is the same for every l/w",
    )
    duration_s: Duration = Field(5.0, description="length of the phase [s]")
    active_fraction: ActiveFraction = 1.0
    offsets: Offsets = "none"

    def spelled_out(self, smarticle: Smarticle, motor: Motor) -> Actuate:
        """The phase as the motion that it is short for."""
        scale = REFERENCE_ASPECT_RATIO / smarticle.aspect_ratio if self.scaled else 1.0
        barb_1, barb_2 = (
            Triangle(
                type="triangle",
                centre_deg=angle,
                amplitude_deg=self.theta_deg / 2 * scale,
                speed_rad_per_s=motor.speed_limit_rad_per_s,
            )
            for angle in smarticle.angles_deg
        )
        return Actuate(
            type="actuate",
            barb_1=barb_1,
            barb_2=barb_2,
            duration_s=self.duration_s,
            active_fraction=self.active_fraction,
            offsets=self.offsets,
        )

    def own_key(self, key: str) -> str:
        """The key of this phase that sets `key` of the spelled-out one."""
        return "theta_deg"


@runtime_checkable
class Actuated(Protocol):
    """A phase in which motors move the barbs or hold them."""

    @property
    def duration_s(self) -> float:
        """Length of the phase [s]."""

    def spelled_out(self, smarticle: Smarticle, motor: Motor) -> Actuate:
        """The phase as the motion that it is short for."""

    def own_key(self, key: str) -> str:
        """The key of this phase that sets `key` of the spelled-out one."""


def actuated(phase: object) -> TypeGuard[Actuated]:
    """Whether motors are at work in a phase of a scene."""
    return isinstance(phase, Actuated)


# -- compiled form -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Track:
    """One motion, for all barbs that follow it.

    Args:
        span: the entries of `Drive` that it sets, K of them.
        course: the motion, from K starts on.
        shifts: how far on the motion is at the beginning of the phase [s]: (1,) for all alike, or (K,).
    """

    span: slice
    course: Course
    shifts: Array


@dataclass(frozen=True, eq=False)
class Drive:
    """An actuated phase, ready to run.

    Args:
        duration: length of the phase [s].
        active: (N,) bool, which smarticles move.
        start: (N, 2) float64 [rad], target angles at the end of the actuated phase before, or the smarticle's own.
    """

    duration: float
    active: NDArray[np.bool_]
    start: Array
    # Barbs that always have the same target share an entry: `_entries` are those of barbs that do not move, then
    # those of each track; `_which` (N, 2) tells the entry of each barb.
    _entries: Array
    _tracks: tuple[_Track, ...]
    _which: NDArray[np.int64]

    def targets(self, time: float) -> Array:
        """(N, 2) float64 [rad], target angles of barb 1 and barb 2 at a time [s] after the phase began.

        Times beyond the end of the phase give the targets of its end.
        """
        time = min(max(time, 0.0), self.duration)
        entries = self._entries.copy()
        for track in self._tracks:
            entries[track.span] = track.course(time + track.shifts)
        return entries[self._which]


def active_count(phase: Actuate | InternalOscillation, count: int) -> int:
    """How many of `count` smarticles move in a phase."""
    return round(phase.active_fraction * count)


def drive(scene: Scene, index: int) -> Drive:
    """Compile the actuated phase `scene.phases[index]`."""
    phase = scene.phases[index]
    assert actuated(phase)  # the caller has asked
    spelled = phase.spelled_out(scene.smarticle, scene.motor)
    start = _starting_angles(scene, index)
    active = _draw_active(scene, index, spelled)
    shifts = np.zeros(1)
    if spelled.offsets == "random":
        rng = np.random.default_rng(scene.seed_for(f"offsets/{index}"))
        shifts = (rng.random(scene.count) * (spelled.period or 0.0))[active]

    resting, which_resting = np.unique(start[~active], return_inverse=True)
    which = np.empty((scene.count, BARBS), dtype=np.int64)
    which[~active] = which_resting.reshape(-1, BARBS)
    tracks, size = [], resting.size
    for columns, motion in _shared(spelled.motions):
        begun = start[active][:, columns]
        if shifts.size > 1:
            each, inverse = np.ravel(begun), np.arange(begun.size)
            ahead = np.repeat(shifts, len(columns))
        else:
            each, inverse = np.unique(begun, return_inverse=True)
            ahead = shifts
        tracks.append(_Track(slice(size, size + each.size), motion.course(each, each), ahead))
        which[np.flatnonzero(active)[:, None], columns] = size + inverse.reshape(begun.shape)
        size += each.size
    entries = np.concatenate([resting, np.zeros(size - resting.size)])
    return Drive(spelled.duration_s, active, start, entries, tuple(tracks), which)


def _starting_angles(scene: Scene, index: int) -> Array:
    """(N, 2) [rad]: final targets of the actuated phase before, or the smarticle's own angles."""
    for before in range(index - 1, -1, -1):
        if actuated(scene.phases[before]):
            last = drive(scene, before)
            return last.targets(last.duration)
    return np.tile(np.radians(scene.smarticle.angles_deg), (scene.count, 1))


def _draw_active(scene: Scene, index: int, phase: Actuate) -> NDArray[np.bool_]:
    # The first ones of one random order: at the same seed a larger share has all smarticles of a smaller one.
    rng = np.random.default_rng(scene.seed_for(f"active/{index}"))
    active = np.zeros(scene.count, dtype=np.bool_)
    active[rng.permutation(scene.count)[: active_count(phase, scene.count)]] = True
    return active


def _shared(motions: tuple[Motion, Motion]) -> list[tuple[list[int], Motion]]:
    """Motions with the columns of the barbs that follow them: one entry where both barbs move alike."""
    if motions[0] == motions[1]:
        return [([0, 1], motions[0])]
    return [([0], motions[0]), ([1], motions[1])]
