"""Phases in which motors move or hold the barbs: gait, target angles, checks and control updates.

Each of these phases defines a `Gait`, from which `drive` computes target angles over time. The smarticles that move are
drawn from the scene's seed; starting angles follow from the previous phases.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from dem.arrays import Array, Flags, Numbers
from dem.body.particle import HINGE_CLEARANCE
from dem.engine.effect import EffectName
from dem.engine.interface import Engine
from dem.errors import rounded_down, rounded_up
from dem.phases.phase import Memory, Phase, SceneView, Stage
from dem.setting.hooks import TOLERANCE
from dem.setting.motion import Course, Motion, SimpleMotion, Sine, Triangle
from dem.setting.motor import Motor
from dem.setting.part import HINGE_RANGE
from dem.setting.smarticle import Smarticle
from dem.setting.span import STEPS

BARBS = 2
BARB_LINKS = (0, 2)
MOST_PARTS = 100  # numbers of parts tried to divide an interval into parts of few digits
# Torque over τ_max that a motor may gain between two control updates without a warning; 0.22 at the defaults.
MOST_OVERSHOOT = 0.5


@dataclass(frozen=True, kw_only=True)
class Gait:
    """Motions of the barbs in a phase, and the smarticles that make them."""

    motions: tuple[Motion, Motion]  #: Motions of barb 1 and barb 2
    keys: tuple[str, str] = ("barbs", "barbs")  #: Keys of the two motions, for `ActuatedPhase.source_of`
    duration: float  #: Length of the phase [s]
    active_fraction: float = 1.0  #: Fraction of the smarticles that move [1]
    offsets: Literal["none", "random"] = "none"  #: "random": each smarticle begins at a random point of the period

    @property
    def period(self) -> float | None:
        """Longer one of the two motions' periods [s]; None if neither motion is periodic."""
        return max((motion.period for motion in self.motions if motion.period is not None), default=None)

    def active_count(self, count: int) -> int:
        return round(self.active_fraction * count)


class ActuatedPhase(Phase):
    """A phase in which motors move the barbs or hold them."""

    planar: ClassVar[bool | None] = None
    actuates: ClassVar[bool] = True

    def gait(self, smarticle: Smarticle, motor: Motor) -> Gait:
        """Return the gait of the phase."""
        raise NotImplementedError

    def source_of(self, key: str) -> tuple[str, float | None]:
        """Return the key in the scene file that a user must change to change a parameter of a motion.

        `key` has dots for nesting, such as `barbs.steps.0.duration_s`. Returns the key relative to this phase, and its
        value; None if it is not given.
        """
        raise NotImplementedError

    def check(self, scene: SceneView, index: int) -> Iterator[str]:
        if not any(before.actuates for before in scene.phases[:index]):
            yield from _of_barbs(scene, index)
            yield from _of_control(scene)
        gait = _gait(scene, index)
        if not gait.active_count(scene.count):
            yield (
                f"phases.{index}.active_fraction: {gait.active_fraction:g} of {scene.count} smarticles is none; "
                f"use e.g. {rounded_up(1 / scene.count)}"
            )
        highest = yield from _of_motions(scene, index)
        # Halted motors lag behind the schedule, so that both barbs may be at their highest angles at one time.
        if scene.smarticle.tip_clearance(highest) < 0:
            yield (
                f"phases.{index}: at {highest[0]:.4g}° and {highest[1]:.4g}° the barbs of l/w = "
                f"{scene.smarticle.aspect_ratio:g} cross; use angles nearer to 90° or a smaller aspect_ratio"
            )
        yield from _of_first_spheres(scene, index, max(highest))

    def warnings(self, scene: SceneView, index: int) -> Sequence[str]:
        return actuation_warnings(scene)

    def calls(self, scene: SceneView, index: int) -> Mapping[EffectName, str]:
        return {EffectName.ARTICULATION: str(index)}

    def first_memory(self, scene: SceneView) -> Memory:
        return {"look": 0}

    def proceed(self, stage: Stage, engine: Engine) -> float:
        return self.follow(stage, engine)

    def follow(self, stage: Stage, engine: Engine, check_every: int | None = None) -> float:
        """Pass the next control updates to the motors, as many as the engine takes at once.

        The first call articulates the smarticles.

        With `check_every`, no call goes beyond a multiple of this number of updates since the phase began, so that the
        caller can check the pile there. Returns the simulated time until the next call [s]; 0 at the end of the phase.
        """
        update: int = stage.memory["look"]
        if update == 0:
            engine.motors.articulate()
        schedule: Drive = stage.prepared
        interval = stage.scene.fidelity.control_interval_s
        last = math.ceil(schedule.duration / interval - 1e-9)
        every = check_every or last
        # The last update only adds up the work since the previous one.
        stop = min(update + engine.motors.updates_at_once, (update // every + 1) * every, last)
        updates = range(update, max(update + 1, stop))
        targets = [schedule.targets(min((k + 1) * interval, schedule.duration)) for k in updates]
        engine.motors.actuate(np.stack(targets), interval)
        stage.memory["look"] = updates.stop
        period = max(1, round(interval / engine.time_step)) * engine.time_step
        return len(updates) * period if update < last else 0.0

    def prepare(self, scene: SceneView, index: int) -> Drive:
        return drive(scene, index)


# -- target angles -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Track:
    span: slice  #: Indices of the motion's K angles in `Drive._entries`
    course: Course  #: Function from times to K angles, for K starting angles
    shifts: Array  #: (1,) or (K,) time within the motion at the beginning of the phase [s]


@dataclass(frozen=True, eq=False)
class Drive:
    """Target angles of an actuated phase over time."""

    duration: float  #: Length of the phase [s]
    active: Flags  #: (N,) whether each smarticle moves
    start: Array  #: (N, 2) target angles at the end of the previous actuated phase, or `smarticle.angles_deg` [rad]
    # Barbs whose targets are always equal share an entry of `_entries`: first come those of barbs that do not move,
    # then those of each track. `_which` (N, 2) is the number of each barb's entry.
    _entries: Array
    _tracks: tuple[_Track, ...]
    _which: Numbers

    def targets(self, time: float) -> Array:
        """Return (N, 2) target angles [rad] at a time [s] since the phase began, constant after its end."""
        time = min(max(time, 0.0), self.duration)
        entries = self._entries.copy()
        for track in self._tracks:
            entries[track.span] = track.course(time + track.shifts)
        return entries[self._which]


def _gait(scene: SceneView, index: int) -> Gait:
    phase = scene.phases[index]
    assert isinstance(phase, ActuatedPhase)  # the caller has checked
    return phase.gait(scene.smarticle, scene.motor)


def drive(scene: SceneView, index: int) -> Drive:
    """Return the target angles over time of the actuated phase `scene.phases[index]`."""
    gait, start = _gait(scene, index), _starting_angles(scene, index)
    # The first ones in a random order: at one seed a larger fraction contains all smarticles of a smaller one.
    rng = np.random.default_rng(scene.seed_for(f"active/{index}"))
    active = np.zeros(scene.count, dtype=np.bool_)
    active[rng.permutation(scene.count)[: gait.active_count(scene.count)]] = True
    shifts = np.zeros(1)
    if gait.offsets == "random":
        rng = np.random.default_rng(scene.seed_for(f"offsets/{index}"))
        shifts = (rng.random(scene.count) * (gait.period or 0.0))[active]

    resting, which_resting = np.unique(start[~active], return_inverse=True)
    which = np.empty((scene.count, BARBS), dtype=np.int64)
    which[~active] = which_resting.reshape(-1, BARBS)
    tracks, size = [], resting.size
    motion_1, motion_2 = gait.motions
    for columns, motion in [([0, 1], motion_1)] if motion_1 == motion_2 else [([0], motion_1), ([1], motion_2)]:
        starts = start[active][:, columns]
        if shifts.size > 1:
            each, inverse = np.ravel(starts), np.arange(starts.size)
            ahead = np.repeat(shifts, len(columns))
        else:
            each, inverse = np.unique(starts, return_inverse=True)
            ahead = shifts
        tracks.append(_Track(slice(size, size + each.size), motion.course(each, each), ahead))
        which[np.flatnonzero(active)[:, None], columns] = size + inverse.reshape(starts.shape)
        size += each.size
    entries = np.concatenate([resting, np.zeros(size - resting.size)])
    return Drive(gait.duration, active, start, entries, tuple(tracks), which)


def _starting_angles(scene: SceneView, index: int) -> Array:
    """Return (N, 2) final targets of the previous actuated phase, or else `smarticle.angles_deg` [rad]."""
    for before in range(index - 1, -1, -1):
        if scene.phases[before].actuates:
            last = drive(scene, before)
            return last.targets(last.duration)
    return np.tile(np.radians(scene.smarticle.angles_deg), (scene.count, 1))


# -- checks ------------------------------------------------------------------------------------------------------------


def overshoot(scene: SceneView) -> float:
    """Return the largest increase of a motor's torque between two control updates, over τ_max [1].

    The laws "slip" and "servo" cap the torque; for them 0 is returned.
    """
    motor = scene.motor
    added = motor.stiffness_N_m_per_rad * motor.speed_limit_rad_per_s * scene.fidelity.control_interval_s
    return 0.0 if motor.law in ("slip", "servo") else added / scene.torque_limit


def actuation_warnings(scene: SceneView) -> tuple[str, ...]:
    """Return a warning if motors can exceed τ_max by more than `MOST_OVERSHOOT` τ_max; else none.

    Such a scene is not rejected: a motor halts at the next control update, and motors too weak to move anything are
    worth studying.
    """
    excess = overshoot(scene)
    if excess <= MOST_OVERSHOOT:
        return ()
    motor, series, less = scene.motor, scene.recording.series_interval_s, MOST_OVERSHOOT / excess
    interval = _whole_fraction(series, math.ceil(series / (scene.fidelity.control_interval_s * less)))
    return (
        f"motor.torque_limit_N_m: τ_max = {scene.torque_limit:.3g} N m, but within one control update of "
        f"fidelity.control_interval_s = {scene.fidelity.control_interval_s:g} s at motor.speed_limit_rad_per_s = "
        f"{motor.speed_limit_rad_per_s:g} rad/s a motor can exceed it by {excess:.3g} τ_max; use "
        f"control_interval_s: {interval} or stiffness_N_m_per_rad: "
        f"{rounded_down(motor.stiffness_N_m_per_rad * less)}, or law: slip",
    )


def _of_barbs(scene: SceneView, index: int) -> Iterator[str]:
    ratio, width, diameter = scene.smarticle.aspect_ratio, scene.smarticle.middle_length_m, scene.sphere_diameter
    if ratio == 0:
        yield (
            f"smarticle.aspect_ratio: 0 means no barbs, which phases.{index} ({scene.phases[index].kind}) is to move; "
            "use a larger aspect_ratio or leave the phase out"
        )
    has_spheres = np.isin(BARB_LINKS, scene.body.links).all()
    if not has_spheres or _first_station(scene) < diameter * (1 - TOLERANCE):
        # The first sphere of a barb begins where the hinge's sphere ends, and the last one ends at the tip.
        least = (1.5 + HINGE_CLEARANCE) * diameter
        yield (
            f"smarticle.aspect_ratio: {ratio:g} means barbs of {ratio * width:.4g} m, too short for a sphere of their "
            f"own of {diameter:.4g} m beside the hinge's, which phases.{index} ({scene.phases[index].kind}) needs; use "
            f"at least {rounded_up(least / width)} or a smaller fidelity.diameter_m"
        )


def _first_station(scene: SceneView) -> float:
    """Return the distance of the barbs' first sphere from the hinge, along the barb [m]."""
    particle = scene.body
    barb = particle.centres[particle.links == BARB_LINKS[0]] - particle.boxes.vertices[1]
    return float(np.hypot(barb[:, 0], barb[:, 1]).min())


def _of_control(scene: SceneView) -> Iterator[str]:
    interval, series = scene.fidelity.control_interval_s, scene.recording.series_interval_s
    updates = series / interval
    if updates >= 1 - 1e-6 and abs(updates - round(updates)) <= 1e-6:
        return
    wrong = "longer than" if updates < 1 - 1e-6 else "not a whole fraction of"
    yield (
        f"fidelity.control_interval_s: {interval:g} s is {wrong} recording.series_interval_s = {series:g} s; use e.g. "
        f"{_whole_fraction(series, max(1, math.ceil(updates * (1 - TOLERANCE))))} s"
    )


def _whole_fraction(whole: float, parts: int) -> str:
    """Return a time of few digits of which `whole` is a multiple, as text [s].

    The time fits into `whole` at least `parts` times: the smallest number that gives few digits, or `parts`.
    """
    for more in range(parts, min(10 * parts, parts + MOST_PARTS) + 1):
        text = f"{whole / more:.3g}"
        if math.isclose(float(text) * more, whole, rel_tol=TOLERANCE):
            return text
    return repr(whole / parts)


def _of_motions(scene: SceneView, index: int) -> Generator[str, None, tuple[float, float]]:
    """Yield errors of angles out of the hinges' range and of too high speeds.

    Return the highest angles of barb 1 and of barb 2 [deg] over all smarticles, moving or not.
    """
    phase, gait, driven = scene.phases[index], _gait(scene, index), drive(scene, index)
    assert isinstance(phase, ActuatedPhase)
    # With random offsets the motion covers up to one more period than the phase is long.
    until = driven.duration + ((gait.period or 0.0) if gait.offsets == "random" else 0.0)
    highest = np.degrees(driven.start.max(axis=0))
    for barb in range(BARBS):
        start = driven.start[driven.active, barb]
        for leg in gait.motions[barb].legs(start, start, until):
            key = ".".join(filter(None, (gait.keys[barb], leg.key)))
            lows, highs, speed = leg.extent()
            low, high = np.degrees(lows), np.degrees(highs)
            if isinstance(leg.motion, Sine | Triangle):
                # All other angles were checked when the scene was read: only a swing can leave the range.
                source, present = phase.source_of(f"{key}.amplitude_deg")
                assert present is not None  # a swing has an amplitude
                yield from _of_range(
                    f"phases.{index}.{source}", present, leg.motion, (float(low.min()), float(high.max()))
                )
            highest[barb] = max(highest[barb], high.max())
            source, _ = phase.source_of(f"{key}.{leg.motion.pace[0]}")
            yield from _of_speed(f"phases.{index}.{source}", leg.motion, speed, scene.motor.speed_limit_rad_per_s)
            if speed:
                yield from _of_updates(scene, f"phases.{index}.{source}", leg.motion)
    return float(highest[0]), float(highest[1])


def _of_range(place: str, present: float, swing: Sine | Triangle, reached: tuple[float, float]) -> Iterator[str]:
    """Yield an error if a swing leaves the range of the hinges; `reached`: its lowest and highest angle [deg].

    `place` is the key in the scene file that sets the amplitude, `present` its value [deg].
    """
    lowest, highest = HINGE_RANGE
    too_low, too_high = lowest - reached[0], reached[1] - highest
    beyond = max(too_low, too_high)
    if beyond <= TOLERANCE:
        return
    smaller = 1 - beyond / swing.amplitude_deg
    way_out = (
        f"use at most {rounded_down(present * smaller)}° or another centre"
        if smaller > TOLERANCE
        else "move its centre"
    )
    yield (
        f"{place}: {present:g}° makes the barbs reach {reached[too_high > too_low]:.4g}°, outside {lowest:g}° … "
        f"{highest:g}°, the range of the hinges; {way_out}"
    )


def _of_speed(place: str, motion: SimpleMotion, speed: float, limit: float) -> Iterator[str]:
    factor = speed / limit
    if factor <= 1 + TOLERANCE:
        return
    key, unit = motion.pace
    present = getattr(motion, key)
    way_out = (
        f"at least {rounded_up(present * factor)}"
        if key == "duration_s"
        else f"at most {rounded_down(present / factor)}"
    )
    yield (
        f"{place}: {present:g} {unit} makes {speed:.4g} rad/s, faster than motor.speed_limit_rad_per_s = "
        f"{limit:g} rad/s; use {way_out} {unit}"
    )


def _of_updates(scene: SceneView, place: str, motion: SimpleMotion) -> Iterator[str]:
    """Yield an error if control updates, between which motors turn evenly, do not resolve a motion."""
    interval, series = scene.fidelity.control_interval_s, scene.recording.series_interval_s
    updates = motion.changes_in / interval
    if updates >= STEPS * (1 - TOLERANCE):
        return
    parts = math.ceil(STEPS * series / motion.changes_in * (1 - TOLERANCE))
    yield (
        f"{place}: a {motion.tag()} of {motion.changes_in:.3g} s has {updates:.3g} control updates, {STEPS} resolve "
        f"it; use a slower one, or a fidelity.control_interval_s of {_whole_fraction(series, parts)} s"
    )


def _of_first_spheres(scene: SceneView, index: int, angle: float) -> Iterator[str]:
    """Yield an error if the first sphere of a barb at `angle` [deg] touches spheres of the middle link.

    At the angle α the distance between a barb's sphere at s from the hinge and a middle link's sphere at m from the
    hinge is √(s² + m² + 2 s m cos α). Spheres of diameter d do not touch while -cos α ≤ (s² + m² - d²) / (2 s m).
    """
    if angle <= 90 or scene.smooth:
        return
    particle, d = scene.body, scene.sphere_diameter
    s = _first_station(scene)
    arms = particle.centres[particle.links == 1] - particle.boxes.vertices[1]
    m = np.unique(np.round(np.hypot(arms[:, 0], arms[:, 1]) / d, 9))[1:] * d  # the first is the hinge's own
    inward = float(((s**2 + m**2 - d**2) / (2 * s * m)).min())
    if -math.cos(math.radians(angle)) <= inward + TOLERANCE:
        return
    # Spheres are spread evenly over the link, with up to one more than the pitch needs, and may be nearer than it.
    near, inwards = s / d, -math.cos(math.radians(angle))
    apart = near * inwards + math.sqrt(max(0.0, (near * inwards) ** 2 + 1 - near**2))
    wider = apart / (1 - apart * d / scene.smarticle.middle_length_m)
    yield (
        f"fidelity.pitch: with {scene.fidelity.pitch:g} the middle link's spheres are {m[0] / d:.3g} diameters apart, "
        f"and the first sphere of a barb touches them at the {angle:.4g}° of phases.{index}; stay below "
        f"{rounded_down(math.degrees(math.acos(-inward)))}° or use a pitch of at least {rounded_up(wider, 2)}"
    )
