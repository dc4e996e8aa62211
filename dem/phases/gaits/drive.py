"""What barbs do in a phase, gait out, and compiled into target angles over time.

Every phase in which motors act is short for a `Gait`. `drive` turns one into target angles: which smarticles move is
drawn, and where they begin follows from the phases before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, TypeGuard, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from dem.phases.phase import SceneView
from dem.setting.course import Course
from dem.setting.motion import Motion
from dem.setting.motor import Motor
from dem.setting.smarticle import Smarticle

Array = NDArray[np.float64]

BARBS = 2


@dataclass(frozen=True, kw_only=True)
class Gait:
    """What the barbs of smarticles do in a phase.

    Args:
        motions: of barb 1 and of barb 2.
        keys: under which the motions stand in a phase of type actuate.
        duration: length of the phase [s].
        active_fraction: share of the smarticles that move [1].
        offsets: "random": each begins at another point of the period.
    """

    motions: tuple[Motion, Motion]
    keys: tuple[str, str] = ("barbs", "barbs")
    duration: float
    active_fraction: float = 1.0
    offsets: Literal["none", "random"] = "none"

    @property
    def period(self) -> float | None:
        """Period [s] of the motions, the longer one of two; None: they have none."""
        return max((motion.period for motion in self.motions if motion.period is not None), default=None)

    def active_count(self, count: int) -> int:
        """How many of `count` smarticles move."""
        return round(self.active_fraction * count)


@runtime_checkable
class Actuated(Protocol):
    """A phase in which motors move the barbs or hold them."""

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
        """What it is short for."""

    def own(self, key: str) -> tuple[str, float | None]:
        """The key of this phase that sets `key` of the gait, and its value."""


def actuated(phase: object) -> TypeGuard[Actuated]:
    """Whether motors are at work in a phase of a scene."""
    return isinstance(phase, Actuated)


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


def drive(scene: SceneView, index: int) -> Drive:
    """Compile the actuated phase `scene.phases[index]`."""
    phase = scene.phases[index]
    assert actuated(phase)  # the caller has asked
    gait = phase.gait(scene.smarticle, scene.motor)
    start = _starting_angles(scene, index)
    active = _draw_active(scene, index, gait)
    shifts = np.zeros(1)
    if gait.offsets == "random":
        rng = np.random.default_rng(scene.seed_for(f"offsets/{index}"))
        shifts = (rng.random(scene.count) * (gait.period or 0.0))[active]

    resting, which_resting = np.unique(start[~active], return_inverse=True)
    which = np.empty((scene.count, BARBS), dtype=np.int64)
    which[~active] = which_resting.reshape(-1, BARBS)
    tracks, size = [], resting.size
    for columns, motion in _shared(gait.motions):
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
    return Drive(gait.duration, active, start, entries, tuple(tracks), which)


def _starting_angles(scene: SceneView, index: int) -> Array:
    """(N, 2) [rad]: final targets of the actuated phase before, or the smarticle's own angles."""
    for before in range(index - 1, -1, -1):
        if actuated(scene.phases[before]):
            last = drive(scene, before)
            return last.targets(last.duration)
    return np.tile(np.radians(scene.smarticle.angles_deg), (scene.count, 1))


def _draw_active(scene: SceneView, index: int, gait: Gait) -> NDArray[np.bool_]:
    # The first ones of one random order: at the same seed a larger share has all smarticles of a smaller one.
    rng = np.random.default_rng(scene.seed_for(f"active/{index}"))
    active = np.zeros(scene.count, dtype=np.bool_)
    active[rng.permutation(scene.count)[: gait.active_count(scene.count)]] = True
    return active


def _shared(motions: tuple[Motion, Motion]) -> list[tuple[list[int], Motion]]:
    """Motions with the columns of the barbs that follow them: one entry where both barbs move alike."""
    if motions[0] == motions[1]:
        return [([0, 1], motions[0])]
    return [([0], motions[0]), ([1], motions[1])]
