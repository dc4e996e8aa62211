"""Whether the smarticles of a scene can do what its actuated phases ask for.

A scene without actuated phases passes unseen.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dem.body.particle import HINGE_CLEARANCE
from dem.phases.gaits.drive import BARBS, actuated, drive
from dem.phases.phase import SceneView
from dem.setting.course import SimpleMotion
from dem.setting.motion import Sine, Triangle
from dem.setting.part import HINGE_RANGE

Array = NDArray[np.float64]

TOLERANCE = 1e-9  # relative; angles and speeds that meet their limit up to rounding are allowed
BARB_LINKS = (0, 2)
_MOST_PARTS = 100  # that are tried: among them is one of few digits, unless there are very many parts
# Share of τ_max that one look of a motor may add before it notices and halts. The defaults add 0.22.
MOST_OVERSHOOT = 0.5


def check_actuated(scene: SceneView, index: int) -> None:
    """Check an actuated phase against the smarticle, the motors and the recording.

    Raises:
        ValueError: one line with key, value and the way out.
    """
    if not any(actuated(before) for before in scene.phases[:index]):
        _check_barbs(scene, index)
        _check_control(scene)
    _check_active(scene, index)
    highest = _check_motions(scene, index)
    _check_crossing(scene, index, highest)
    _check_first_spheres(scene, index, max(highest))


def overshoot(scene: SceneView) -> float:
    """Torque over τ_max that one look of a motor can add before it notices and halts [1]; 0 where it is capped."""
    motor = scene.motor
    added = motor.stiffness_N_m_per_rad * motor.speed_limit_rad_per_s * scene.fidelity.control_interval_s
    return 0.0 if motor.law in ("slip", "servo") else added / scene.torque_limit


def actuation_warnings(scene: SceneView) -> tuple[str, ...]:
    """What a scene that actuates had better change, one line each with key, value and the way out.

    A motor that is quick and stiff for its torque limit goes beyond it. That is no reason to refuse a scene: it goes
    no farther than by this much, then halts, and motors that are hardly able to do anything are a case worth running.
    """
    share = overshoot(scene)
    if share <= MOST_OVERSHOOT:
        return ()
    motor, series, less = scene.motor, scene.recording.series_interval_s, MOST_OVERSHOOT / share
    interval = _whole_fraction(series, math.ceil(series / (scene.fidelity.control_interval_s * less)))
    return (
        f"motor.torque_limit_N_m: τ_max = {scene.torque_limit:.3g} N m, but within one look of "
        f"fidelity.control_interval_s = {scene.fidelity.control_interval_s:g} s at motor.speed_limit_rad_per_s = "
        f"{motor.speed_limit_rad_per_s:g} rad/s a motor can go beyond it by {share:.3g} τ_max; use "
        f"control_interval_s: {interval} or stiffness_N_m_per_rad: "
        f"{_down(motor.stiffness_N_m_per_rad * less)}, or law: slip",
    )


def _check_barbs(scene: SceneView, index: int) -> None:
    """Each barb must have a sphere of its own that is clear of the hinge's."""
    ratio, width = scene.smarticle.aspect_ratio, scene.smarticle.middle_length_m
    if ratio == 0:
        msg = (
            f"smarticle.aspect_ratio: 0 means no barbs, which phases.{index} ({scene.phases[index].kind}) is to move; "
            "use a larger aspect_ratio or leave the phase out"
        )
        raise ValueError(msg)
    if not np.isin(BARB_LINKS, scene.particle.links).all() or _first_station(scene) < scene.sphere_diameter * (
        1 - TOLERANCE
    ):
        diameter = scene.sphere_diameter
        # The first sphere begins where the hinge's ends, and the last one ends at the tip.
        least = (1.5 + HINGE_CLEARANCE) * diameter
        msg = (
            f"smarticle.aspect_ratio: {ratio:g} means barbs of {ratio * width:.4g} m, too short for a sphere of their "
            f"own of {diameter:.4g} m beside the hinge's, which phases.{index} ({scene.phases[index].kind}) needs; use "
            f"at least {_up(least / width)} or a smaller fidelity.diameter_m"
        )
        raise ValueError(msg)


def _first_station(scene: SceneView) -> float:
    """Distance [m] of the barbs' first spheres from the hinge, along the barb."""
    particle = scene.particle
    barb = particle.centres[particle.links == BARB_LINKS[0]] - particle.boxes.vertices[1]
    return float(np.hypot(barb[:, 0], barb[:, 1]).min())


def _check_control(scene: SceneView) -> None:
    interval, series = scene.fidelity.control_interval_s, scene.recording.series_interval_s
    looks = series / interval
    way_out = f"use e.g. {_whole_fraction(series, max(1, math.ceil(looks * (1 - TOLERANCE))))} s"
    if looks < 1 - 1e-6:
        msg = (
            f"fidelity.control_interval_s: {interval:g} s is longer than recording.series_interval_s = {series:g} s; "
            f"{way_out}"
        )
        raise ValueError(msg)
    if abs(looks - round(looks)) > 1e-6:
        msg = (
            f"fidelity.control_interval_s: {interval:g} s is not a whole fraction of recording.series_interval_s = "
            f"{series:g} s; {way_out}"
        )
        raise ValueError(msg)


def _whole_fraction(whole: float, parts: int) -> str:
    """A whole fraction of a time [s], in so many parts or a few more, such that it can be written in few digits."""
    for more in range(parts, min(10 * parts, parts + _MOST_PARTS) + 1):
        text = f"{whole / more:.3g}"
        if math.isclose(float(text) * more, whole, rel_tol=TOLERANCE):
            return text
    return repr(whole / parts)


def _check_active(scene: SceneView, index: int) -> None:
    phase = scene.phases[index]
    assert actuated(phase)
    gait = phase.gait(scene.smarticle, scene.motor)
    if not gait.active_count(scene.count):
        msg = (
            f"phases.{index}.active_fraction: {gait.active_fraction:g} of {scene.count} smarticles is none; "
            f"use e.g. {_up(1 / scene.count)}"
        )
        raise ValueError(msg)


def _check_motions(scene: SceneView, index: int) -> tuple[float, float]:
    """Check range and speed of the motions in a phase.

    Returns:
        Highest angle [deg] of barb 1 and of barb 2, over all smarticles, moving or not.
    """
    phase = scene.phases[index]
    assert actuated(phase)
    gait, driven = phase.gait(scene.smarticle, scene.motor), drive(scene, index)
    # With random offsets the motion goes through up to one more period than the phase is long.
    until = driven.duration + ((gait.period or 0.0) if gait.offsets == "random" else 0.0)
    highest = np.degrees(driven.start.max(axis=0))
    for barb in range(BARBS):
        start = driven.start[driven.active, barb]
        for leg in gait.motions[barb].legs(start, start, until):
            key = ".".join(filter(None, (gait.keys[barb], leg.key)))
            low, high = (np.degrees(angles) for angles in leg.extremes())
            if isinstance(leg.motion, Sine | Triangle):
                # All other angles are checked where they are read: only a swing can lead out of the range.
                own, present = phase.own(f"{key}.amplitude_deg")
                assert present is not None  # a swing has an amplitude
                _check_range(f"phases.{index}.{own}", present, leg.motion, (float(low.min()), float(high.max())))
            highest[barb] = max(highest[barb], high.max())
            own, _ = phase.own(f"{key}.{leg.motion.pace[0]}")
            _check_speed(f"phases.{index}.{own}", leg.motion, leg.speed(), scene.motor.speed_limit_rad_per_s)
    return float(highest[0]), float(highest[1])


def _check_range(place: str, present: float, swing: Sine | Triangle, reached: tuple[float, float]) -> None:
    """Refuse a swing that leaves the range of the hinges; `present` [deg] is what sets it at `place`."""
    lowest, highest = HINGE_RANGE
    too_low, too_high = lowest - reached[0], reached[1] - highest
    beyond = max(too_low, too_high)
    if beyond <= TOLERANCE:
        return
    smaller = 1 - beyond / swing.amplitude_deg
    way_out = f"use at most {_down(present * smaller)}° or another centre" if smaller > TOLERANCE else "move its centre"
    msg = (
        f"{place}: {present:g}° makes the barbs reach {reached[too_high > too_low]:.4g}°, outside {lowest:g}° … "
        f"{highest:g}°, the range of the hinges; {way_out}"
    )
    raise ValueError(msg)


def _check_speed(place: str, motion: SimpleMotion, speed: float, limit: float) -> None:
    factor = speed / limit
    if factor <= 1 + TOLERANCE:
        return
    key, unit = motion.pace
    present = getattr(motion, key)
    way_out = f"at least {_up(present * factor)}" if key == "duration_s" else f"at most {_down(present / factor)}"
    msg = (
        f"{place}: {present:g} {unit} makes {speed:.4g} rad/s, faster than motor.speed_limit_rad_per_s = "
        f"{limit:g} rad/s; use {way_out} {unit}"
    )
    raise ValueError(msg)


def _check_crossing(scene: SceneView, index: int, highest: tuple[float, float]) -> None:
    # The highest angles of both barbs need not be asked for at the same time: a motor that halts is late, so that they
    # may meet all the same.
    if scene.smarticle.tip_clearance(highest) < 0:
        msg = (
            f"phases.{index}: at {highest[0]:.4g}° and {highest[1]:.4g}° the barbs of l/w = "
            f"{scene.smarticle.aspect_ratio:g} cross; use angles nearer to 90° or a smaller aspect_ratio"
        )
        raise ValueError(msg)


def _check_first_spheres(scene: SceneView, index: int, angle: float) -> None:
    """The first sphere of a barb beyond 90° must not touch the spheres of the middle link.

    At the angle α a barb's sphere at the distance s from the hinge is √(s² + m² + 2 s m cos α) from the middle link's
    sphere at m, so that they are clear of each other while -cos α ≤ (s² + m² - d²) / (2 s m).
    """
    if angle <= 90 or scene.smooth:
        return
    particle, d = scene.particle, scene.sphere_diameter
    s = _first_station(scene)
    arms = particle.centres[particle.links == 1] - particle.boxes.vertices[1]
    m = np.unique(np.round(np.hypot(arms[:, 0], arms[:, 1]) / d, 9))[1:] * d  # the first is the hinge's own
    inward = float(((s**2 + m**2 - d**2) / (2 * s * m)).min())
    if -math.cos(math.radians(angle)) <= inward + TOLERANCE:
        return
    most = math.degrees(math.acos(-inward))
    msg = (
        f"fidelity.pitch: with {scene.fidelity.pitch:g} the middle link's spheres are {m[0] / d:.3g} diameters apart, "
        f"and the first sphere of a barb touches them at the {angle:.4g}° of phases.{index}; stay below "
        f"{_down(most)}° or use a pitch of at least {_up(_wider_pitch(scene, angle), 2)}"
    )
    raise ValueError(msg)


def _wider_pitch(scene: SceneView, angle: float) -> float:
    """A pitch [1] at which the first sphere of a barb clears the middle link at an angle [deg] beyond 90°."""
    s, c = _first_station(scene) / scene.sphere_diameter, -math.cos(math.radians(angle))
    apart = s * c + math.sqrt(max(0.0, (s * c) ** 2 + 1 - s**2))
    # Spheres are spread evenly, and so may be nearer than the pitch, by up to one more among those of the link.
    return apart / (1 - apart * scene.sphere_diameter / scene.smarticle.middle_length_m)


def _up(value: float, digits: int = 3) -> str:
    """A number rounded up to some significant digits."""
    scale = 10.0 ** (digits - 1 - math.floor(math.log10(value)))
    return f"{math.ceil(value * scale * (1 - TOLERANCE)) / scale:g}"


def _down(value: float, digits: int = 3) -> str:
    """A positive number rounded down to some significant digits."""
    scale = 10.0 ** (digits - 1 - math.floor(math.log10(value)))
    return f"{math.floor(value * scale * (1 + TOLERANCE)) / scale:g}"
