"""Motors that are too weak, too strong or have no room; hooks; seconds of oscillation."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from validation.bench import add, look, lying, scene_of, watched
from validation.check import Check, above, below, near, says
from validation.engines import EngineAccess
from validation.hard.extremes import narrowest
from validation.hard.runs import Watched, whole
from validation.hard.scenes import RELAX, REST, scene, shape_change, turn

TORQUE_LIMIT = 1.607e-5  # N m, the paper's


def no_torque(access: EngineAccess, out: Path) -> list[Check]:
    """τ_max = 0."""
    run = whole(scene(access, turn(40, 0.3), motor={"torque_limit_N_m": 0.0}), out)
    return [says(run.text, "motor.torque_limit_N_m", "0.0 N m", "at least 1e-15 N m")]


def weak_motors(access: EngineAccess, out: Path, *, law: str, count: int) -> list[Check]:
    """τ_max / 1000: motors that cannot lift their own barbs."""
    limit = TORQUE_LIMIT / 1000
    run = whole(scene(access, turn(40, 0.3), RELAX, count=count, motor={"law": law, "torque_limit_N_m": limit}), out)
    checks = run.sound()
    if run.error is None:
        driven = run.during(1)
        work = abs(run.series["motor_work_J"][-1]) / (run.weight * 1e-3)
        checks += [
            above("share of halted motors [1]", run.series["halted_fraction"][driven][10:].mean(), 0.5),
            below("work of the motors over lifting the pile by 1 mm [1]", work, 1.0),
        ]
        if law == "slip":
            torque = run.series["motor_torque_N_m"][driven].max() / limit
            checks.append(below("largest torque over τ_max [1]", torque, 1 + 1e-9))
    return checks


def strong_motors(access: EngineAccess, out: Path, *, count: int) -> list[Check]:
    """τ_max · 100: motors that nothing stops."""
    run = whole(scene(access, turn(40, 0.3), REST, count=count, motor={"torque_limit_N_m": 100 * TORQUE_LIMIT}), out)
    checks = run.sound()
    if run.error is None:
        angles = run.series["angle_rad"][run.during(1)][-1]
        checks += [
            below("share of halted motors [1]", np.nanmax(run.series["halted_fraction"]), 1e-9),
            *(
                near(f"mean angle of barb {k + 1} [rad]", angle, math.radians(40), 0.02)
                for k, angle in enumerate(angles)
            ),
        ]
    return checks


def no_room(access: EngineAccess, out: Path, *, count: int, seconds: float) -> list[Check]:
    """Smarticles of l/w = 0.7 straighten in a container little wider than one of them, half as wide as needed."""
    data, refused = narrowest(scene(access, shape_change(seconds, hold=0.05), RELAX, count=count, per_layer=1), 0.05)
    run = whole(data, out)
    return [refused, *run.sound(), *_jammed(run)]


def jammed(access: EngineAccess, out: Path, *, count: int, seconds: float) -> list[Check]:
    """l/w = 0.4 in a container of radius 0.7 w, into which a straight one, 0.9 w to either side, does not fit."""
    data = scene(
        access, shape_change(seconds, hold=0.05), RELAX, count=count, per_layer=1, smarticle={"aspect_ratio": 0.4}
    )
    data["container"] = {"radius_m": 0.7 * scene_of(data).smarticle.middle_length_m}
    run = whole(data, out)
    return [*run.sound(), *_jammed(run)]


def _jammed(run: Watched) -> list[Check]:
    if run.error is not None:
        return []
    assert run.scene is not None
    smallest = float(run.series["angle_rad"][run.during(1)].min())
    torque = np.nanmax(run.series["motor_torque_N_m"]) / run.scene.torque_limit
    return [
        above("smallest mean angle [rad]", smallest, 0.1),
        below("smallest mean angle [rad]", smallest, 1.4),
        above("largest share of halted motors [1]", np.nanmax(run.series["halted_fraction"]), 0.2),
        below("largest torque over τ_max [1]", torque, 3.0),
    ]


def hook(
    access: EngineAccess, out: Path, *, count: int, distance: float, speed: float, change: float, rest: float
) -> list[Check]:
    """The upper hook is drawn out of a pile after its smarticles changed their shape around it."""
    hooks = {"lower_height_m": 2e-3, "upper_height_m": 4e-3}
    # The time that it stays up: what hangs on it comes to rest.
    pull = {"type": "pull-hook", "distance_m": distance, "speed_m_per_s": speed, "duration_s": distance / speed + rest}
    run = whole(scene(access, shape_change(change), pull, count=count, hooks=hooks), out)
    checks = run.sound(rest=None)
    if run.error is None:
        height = run.series["hook_upper_z_m"]
        force = run.series["hook_upper_force_N"][run.during(2)][:, 2] / run.weight
        checks += [
            near("raised by [m]", height[-1] - height[run.during(1)][-1], distance, 1e-3 * distance),
            below("mean force on the hook, downwards over the weight [1]", -force.mean(), 5.0),
            above("mean force on the hook, downwards over the weight [1]", -force.mean(), -0.05),
            above("largest force on the hook over the weight [1]", np.abs(force).max(), 0.02),
            below("largest force on the hook over the weight [1]", np.abs(force).max(), 20.0),
        ]
    return checks


def oscillation(access: EngineAccess, out: Path, *, seconds: float, count: int = 3) -> list[Check]:
    """Smarticles on the floor of a container swing their barbs by 5° at 8 Hz."""
    described, engine, recorder = watched(scene(access, shape_change(1.5), count=count), out)
    particle, boxes = described.particle, described.smarticle.boxes
    for k in range(count):
        height = 3 * particle.reach * (k + 0.5) / 2 + lying(described)
        add(engine, (0, 0, height), Rotation.from_euler("zx", [1.1 * k, 0.2 * k]))
    engine.advance(round(0.15 / engine.time_step))
    engine.motors.articulate()
    interval, centre = described.fidelity.control_interval_s, np.radians(described.smarticle.angles_deg)
    rows, said = [], None
    for n in range(1, round(seconds / interval) + 1):
        angle = math.radians(5) * math.sin(2 * math.pi * 8 * n * interval)
        engine.motors.actuate(np.tile(centre + angle, (1, count, 1)), interval)
        engine.advance(round(interval / engine.time_step))
        if n % 20 == 0:
            state = engine.state()
            height = state.potential_energy(engine.gravity, 0.0)
            rows.append((n * interval, state.kinetic_energy, height, engine.motors.gaps().max()))
        if n % 500 == 0 and (said := look(engine, recorder)):
            break
    time, kinetic, height, gap = np.array(rows).T
    gap /= described.sphere_diameter
    tips = boxes.mass * (math.radians(5) * 2 * math.pi * 8 * boxes.barb_length) ** 2
    scale, fall = count * tips / 2, count * boxes.mass * engine.gravity * particle.reach
    middle, late = (time > seconds / 3) & (time <= 2 * seconds / 3), time > 2 * seconds / 3
    return [
        Check("the watchdog says", said or "nothing", "nothing", said is None),
        above("largest kinetic energy over that of swinging barbs [1]", kinetic.max() / scale, 0.05),
        below(
            "largest kinetic energy over that of swinging barbs and a fall [1]", kinetic.max() / (5 * scale + fall), 1.0
        ),
        below(
            "kinetic energy of the last third over that of the second [1]",
            kinetic[late].mean() / kinetic[middle].mean(),
            2.0,
        ),
        below("gain of height over a fall [1]", (height[late].max() - height[time < seconds / 6].max()) / fall, 0.5),
        below("largest joint gap [d]", gap.max(), 0.01),
        # No trend that would reach the limit in ten times as long.
        below("trend of the joint gap [d] in ten times as long", abs(np.polyfit(time, gap, 1)[0]) * 10 * seconds, 0.01),
    ]
