"""Scenes with extreme shapes, counts, friction, time steps, motors, containers and hooks.

In all cases `access` is the engine, with access to its internals, `out` the run directory, and times are simulated
times [s]. A case returns its checks.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem.errors import InputError
from dem.plan.steps import stable_step, time_step
from validation.access import EngineAccess
from validation.bench import (
    RELAX,
    REST,
    add,
    lying,
    scene_data,
    scene_of,
    shape_change,
    swing,
    turn,
    watchdog_error,
    watched,
)
from validation.cases import Check, above, below, hard, near, nothing, says
from validation.hard.runs import Watched, whole

TORQUE_LIMIT = 1.607e-5  # τ_max of the paper [N m]


# -- shapes, counts, friction ------------------------------------------------------------------------------------------


def barbs(access: EngineAccess, out: Path, *, ratio: float, count: int) -> list[Check]:
    """Pour smarticles of an unusual aspect ratio: without barbs, with the shortest or the longest barbs."""
    run = whole(scene_data(access, RELAX, count=count, smarticle={"aspect_ratio": ratio}), out)
    # A large final speed is allowed, since rods roll.
    return run.sound(rest=0.05) + run.weight_on_floor(0.02)


for _ratio in (0.0, 0.05, 2.0):
    hard(f"l/w = {_ratio:g}", {"ratio": _ratio, "count": 6}, {"count": 100})(barbs)


@hard("rods that may roll", {"count": 40, "radius": 0.0117})
def rods(access: EngineAccess, out: Path, *, count: int, radius: float) -> list[Check]:
    """Pour rods, whose moment of inertia about their axis is small, into a container of a `radius` [m]."""
    data = scene_data(access, RELAX, count=count, smarticle={"aspect_ratio": 0}, container={"radius_m": radius})
    data["phases"][0]["settle"] = {"timeout_s": 1}
    run = whole(data, out)
    return run.sound(rest=0.1) + run.weight_on_floor(0.05)


@hard("N = 1", {})
def one(access: EngineAccess, out: Path) -> list[Check]:
    """Run a scene with a single smarticle: pour, actuate, rest."""
    run = whole(scene_data(access, swing(0.1), RELAX, count=1), out)
    checks = run.sound() + run.weight_on_floor(0.02)
    if run.error is None:
        known = int(np.isfinite(run.series["packing_fraction"]).sum())
        error = float(run.series["tracking_error_rad"][run.during(1)].max())
        checks += [
            below("samples with a packing fraction, which needs two smarticles [1]", known, 0.5),
            below("largest tracking error [rad]", error, 0.05),
        ]
    return checks


@hard("checkpoint at the last step", {})
def checkpoint_last(access: EngineAccess, out: Path) -> list[Check]:
    """End a run at a checkpoint, after which contacts are unknown until the next step; it must be sound."""
    recording = {"series_interval_s": 0.01, "frame_interval_s": 0.04, "checkpoint_interval_s": 0.01}
    run = whole(scene_data(access, RELAX, count=2, recording=recording), out)
    return run.sound() + run.weight_on_floor(0.02)


@hard("N = 2000", None, {"count": 2000, "per_layer": 500, "radius": 0.15})
def many(access: EngineAccess, out: Path, *, count: int, per_layer: int, radius: float) -> list[Check]:
    """Pour many smarticles, `per_layer` at a time, into a wide container of a `radius` [m]."""
    data = scene_data(access, RELAX, count=count, per_layer=per_layer, container={"radius_m": radius})
    run = whole(data, out)
    return run.sound(rest=0.1) + run.weight_on_floor(0.02)


@hard("friction 0", {"value": 0.0, "count": 6}, {"count": 100})
@hard("friction 5", {"value": 5.0, "count": 6}, {"count": 100})
def friction(access: EngineAccess, out: Path, *, value: float, count: int) -> list[Check]:
    """Pour with the friction coefficient `value` at all contacts."""
    contact = {"friction_smarticle": value, "friction_wall": value}
    data = scene_data(access, RELAX, count=count, contact=contact)
    data["phases"][0]["settle"] = {"timeout_s": 2}
    run = whole(data, out)
    # Without friction, sliding does not end; 0.05 m/s is the speed after a fall of 0.1 mm.
    return run.sound(rest=0.05 if not value else 0.02) + run.weight_on_floor(0.05)


# -- time steps --------------------------------------------------------------------------------------------------------


def _with_step(data: dict[str, Any], share: float) -> tuple[dict[str, Any], float, float]:
    """Set a scene's time step to `share` times the stable step; return scene, step and stable step [s]."""
    stable = stable_step(scene_of(data))
    return {**data, "fidelity": {**data["fidelity"], "time_step_s": share * stable}}, share * stable, stable


@hard("time step 0.5 of the stable one", {"share": 0.5, "count": 4}, {"count": 40})
@hard("time step 0.9 of the stable one", {"share": 0.9, "count": 4}, {"count": 40})
def step_below(access: EngineAccess, out: Path, *, share: float, count: int) -> list[Check]:
    """Run with an explicit time step, the fraction `share` of the stable one."""
    data, requested, _ = _with_step(scene_data(access, swing(0.04), REST, count=count), share)
    run = whole(data, out)
    assert run.scene is not None  # the scene is valid
    # The step is shortened until the control period is a multiple of it.
    steps = run.scene.fidelity.control_interval_s / requested
    expected = steps / math.ceil(steps - 1e-9)
    return [*run.sound(), near("step taken over the step asked [1]", time_step(run.scene) / requested, expected, 1e-6)]


@hard("time step 1.1 of the stable one", {"share": 1.1})
@hard("time step 2 of the stable one", {"share": 2.0})
def step_above(access: EngineAccess, out: Path, *, share: float) -> list[Check]:
    """Run with an explicit time step of `share` > 1 times the stable one, which must be rejected."""
    data, requested, stable = _with_step(scene_data(access, shape_change()), share)
    run = whole(data, out)
    above_stable = f"fidelity.time_step_s: {requested:g} s is above the stable step {stable:.4g} s"
    made = Check("run directory", "made" if out.exists() else "none", "none", not out.exists())
    return [says(run.text, above_stable, "use at most"), made]


# -- motors, room, hooks -----------------------------------------------------------------------------------------------


@hard("τ_max = 0", {})
def no_torque(access: EngineAccess, out: Path) -> list[Check]:
    """Run with a torque limit of zero, which must be rejected."""
    run = whole(scene_data(access, turn(40, 0.3), motor={"torque_limit_N_m": 0.0}), out)
    return [says(run.text, "motor.torque_limit_N_m", "0.0 N m", "at least 1e-15 N m")]


@hard("τ_max / 1000, halt", {"law": "halt", "count": 6}, {"count": 40})
@hard("τ_max / 1000, stall", {"law": "stall", "count": 6}, {"count": 40})
@hard("τ_max / 1000, slip", {"law": "slip", "count": 6}, {"count": 40})
def weak_motors(access: EngineAccess, out: Path, *, law: str, count: int) -> list[Check]:
    """Actuate motors with a torque limit too small to lift the barbs; `law` is their torque law."""
    limit = TORQUE_LIMIT / 1000
    motor = {"law": law, "torque_limit_N_m": limit}
    run = whole(scene_data(access, turn(40, 0.3), RELAX, count=count, motor=motor), out)
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


@hard("τ_max · 100", {"count": 6}, {"count": 40})
def strong_motors(access: EngineAccess, out: Path, *, count: int) -> list[Check]:
    """Actuate with a torque limit that no load reaches."""
    motor = {"torque_limit_N_m": 100 * TORQUE_LIMIT}
    run = whole(scene_data(access, turn(40, 0.3), REST, count=count, motor=motor), out)
    checks = run.sound()
    if run.error is None:
        checks.append(below("share of halted motors [1]", np.nanmax(run.series["halted_fraction"]), 1e-9))
        for k, angle in enumerate(run.series["angle_rad"][run.during(1)][-1], start=1):
            checks.append(near(f"mean angle of barb {k} [rad]", angle, math.radians(40), 0.02))
    return checks


def _jammed(run: Watched) -> list[Check]:
    """Return checks that barbs move but cannot straighten, and that torques stay limited."""
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


@hard("no room to straighten", {"count": 5, "seconds": 0.4}, {"count": 20, "seconds": 1.5})
def no_room(access: EngineAccess, out: Path, *, count: int, seconds: float) -> list[Check]:
    """Straighten smarticles (l/w = 0.7) in a container of 1.05 times the smallest allowed radius."""
    data = scene_data(access, shape_change(seconds, hold=0.05), RELAX, count=count, per_layer=1)
    reach, message = scene_of(data).body.reach, None
    try:
        scene_of({**data, "container": {"radius_m": 0.999 * reach}})
    except InputError as error:
        message = str(error)
    run = whole({**data, "container": {"radius_m": reach * 1.05}}, out)
    return [says(message, f"use at least {math.ceil(reach * 1e6 - 1e-6) / 1e6:.4g} m"), *run.sound(), *_jammed(run)]


@hard("container of radius 0.7 w", {"count": 5, "seconds": 0.4}, {"count": 20, "seconds": 1.5})
def jammed(access: EngineAccess, out: Path, *, count: int, seconds: float) -> list[Check]:
    """Straighten smarticles (l/w = 0.4, half length 0.9 w when straight) in a container of radius 0.7 w."""
    change, smarticle = shape_change(seconds, hold=0.05), {"aspect_ratio": 0.4}
    data = scene_data(access, change, RELAX, count=count, per_layer=1, smarticle=smarticle)
    data["container"] = {"radius_m": 0.7 * scene_of(data).smarticle.middle_length_m}
    run = whole(data, out)
    return run.sound() + _jammed(run)


@hard(
    "hook pulled out of a pile",
    {"count": 12, "distance": 0.02, "speed": 0.1, "change": 0.3, "rest": 0.1},
    {"count": 60, "distance": 0.05, "speed": 0.05, "change": 1.0, "rest": 0.5},
)
def hook(
    access: EngineAccess, out: Path, *, count: int, distance: float, speed: float, change: float, rest: float
) -> list[Check]:
    """Pull the upper hook out of a pile after a shape change around the hook.

    The shape change takes the time `change`, the rest after the pull `rest` [s]; the hook is pulled over a distance [m]
    at a speed [m/s].
    """
    hooks = {"lower_height_m": 2e-3, "upper_height_m": 4e-3}
    # The phase is longer than the motion, so that hanging smarticles come to rest.
    pull = {"type": "pull-hook", "distance_m": distance, "speed_m_per_s": speed, "duration_s": distance / speed + rest}
    run = whole(scene_data(access, shape_change(change), pull, count=count, hooks=hooks), out)
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


@hard("internal oscillation", {"seconds": 3.0}, {"seconds": 60.0})
def oscillation(access: EngineAccess, out: Path, *, seconds: float, count: int = 3) -> list[Check]:
    """Swing the barbs of smarticles on the floor by 5° at 8 Hz."""
    scene, engine, recorder = watched(scene_data(access, shape_change(), count=count), out)
    particle, boxes = scene.body, scene.smarticle.boxes
    for k in range(count):
        height = 3 * particle.reach * (k + 0.5) / 2 + lying(scene)
        add(engine, (0, 0, height), Rotation.from_euler("zx", [1.1 * k, 0.2 * k]))
    engine.advance(round(0.15 / engine.time_step))
    engine.motors.articulate()
    interval, centre = scene.fidelity.control_interval_s, np.radians(scene.smarticle.angles_deg)
    rows, message = [], None
    for n in range(1, round(seconds / interval) + 1):
        angle = math.radians(5) * math.sin(2 * math.pi * 8 * n * interval)
        engine.motors.actuate(np.tile(centre + angle, (1, count, 1)), interval)
        engine.advance(round(interval / engine.time_step))
        if n % 20 == 0:
            state = engine.state().smarticles
            height = state.potential_energy(engine.gravity, 0.0)
            rows.append((n * interval, state.kinetic_energy, height, engine.motors.gaps().max()))
        if n % 500 == 0 and (message := watchdog_error(engine, recorder)):
            break
    time, kinetic, height, gap = np.array(rows).T
    gap /= scene.sphere_diameter
    tips = boxes.mass * (math.radians(5) * 2 * math.pi * 8 * boxes.barb_length) ** 2
    scale, fall = count * tips / 2, count * boxes.mass * engine.gravity * particle.reach
    second, third = (time > seconds / 3) & (time <= 2 * seconds / 3), time > 2 * seconds / 3
    most, ratio = kinetic.max(), kinetic[third].mean() / kinetic[second].mean()
    gain, trend = height[third].max() - height[time < seconds / 6].max(), abs(np.polyfit(time, gap, 1)[0])
    return [
        nothing("the watchdog reports", message),
        above("largest kinetic energy over that of swinging barbs [1]", most / scale, 0.05),
        below("largest kinetic energy over that of swinging barbs and a fall [1]", most / (5 * scale + fall), 1.0),
        below("kinetic energy of the last third over that of the second [1]", ratio, 2.0),
        below("gain of height over a fall [1]", gain / fall, 0.5),
        below("largest joint gap [d]", gap.max(), 0.01),
        # The gap must not reach its limit in a run ten times as long.
        below("trend of the joint gap [d] in ten times as long", trend * 10 * seconds, 0.01),
    ]
