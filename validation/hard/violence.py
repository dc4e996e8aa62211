"""Fast impacts, deep overlaps, strong shaking, large mass ratios.

In all cases `access` is the engine, with access to its internals, `out` the run directory, and times are simulated
times [s]. A case returns its checks.
"""

import math
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from dem.errors import RunError
from dem.plan.steps import time_step
from validation.access import EngineAccess
from validation.bench import (
    TILTED,
    add,
    energy,
    fastest,
    lying,
    scene_data,
    scene_of,
    shape_change,
    watchdog_error,
    watched,
)
from validation.cases import Check, above, below, hard, near, nothing, says
from validation.extremes import crossings, segments
from validation.hard.runs import Noting, whole


@hard("drop at 10 m/s, welded", {"articulated": False, "time": 0.1}, {"time": 0.45})
@hard("drop at 10 m/s, articulated", {"articulated": True, "time": 0.1}, {"time": 0.45})
def drop(access: EngineAccess, out: Path, *, articulated: bool, time: float) -> list[Check]:
    """Throw a smarticle at the floor at 10 m/s, and simulate for a `time` [s]."""
    speed = 10.0
    scene, engine, recorder = watched(scene_data(access, shape_change(), count=1), out)
    add(engine, (0, 0, 0.02), TILTED)
    access.push(engine, 0, velocity=(0, 0, -speed))
    if articulated:
        engine.motors.articulate()
    held = engine.state().smarticles.angles
    message = watchdog_error(engine, recorder)
    energies, lows, gaps = [energy(engine)], [math.inf], [0.0]
    interval = scene.fidelity.control_interval_s
    for _ in range(round(time / interval)):
        if articulated:
            engine.motors.actuate(held[None], interval)
        engine.advance(round(interval / engine.time_step))
        energies.append(energy(engine))
        lows.append(engine.state().smarticles.positions[0, 2])
        gaps.append(engine.motors.gaps().max())
    d, particle = scene.sphere_diameter, scene.body
    most, end = (max(energies) - max(0.0, engine.motors.work)) / energies[0], energies[-1] / energies[0]
    # Depth at which a single spring holds the whole kinetic energy.
    depth = speed * math.sqrt(particle.boxes.mass / scene.fidelity.stiffness_N_per_m)
    return [
        says(message, "1 smarticle(s) (0): a speed above", "fastest 10 m/s"),
        below("highest energy over that of the impact [1]", most, 1.001),
        below("energy at the end over that of the impact [1]", end, 0.7),
        above("lowest centre of mass [m]", min(lows), -depth),
        below("lowest centre of mass [m]", min(lows), 0.005),
        above("height at the end [m]", float(engine.state().smarticles.positions[0, 2]), particle.radius),
        below("largest joint gap [d]", max(gaps) / d, 1.0 if articulated else 1e-9),
        below("joint gap at the end [d]", gaps[-1] / d, 0.01),
    ]


@hard("articulated smarticles land", {"time": 0.2})
def landing(access: EngineAccess, out: Path, *, time: float) -> list[Check]:
    """Drop articulated smarticles on each other; the watchdog must not stop the run.

    The torques of the motors must exceed three times their limit.
    """
    scene, engine, recorder = watched(scene_data(access, shape_change(), count=4), out)
    limits = recorder.watchdog
    noting = Noting(cylinder=limits.cylinder, speed=limits.speed, gap=limits.gap, energy=limits.energy)
    recorder.watchdog = noting
    for k in range(4):
        add(engine, (0, 0, 0.01 + 0.01 * k), Rotation.random(random_state=k))
    engine.motors.articulate()
    held, interval, message, hardest = engine.state().smarticles.angles, scene.fidelity.control_interval_s, None, 0.0
    while not message and engine.time < time:
        engine.motors.actuate(held[None], interval)
        engine.advance(round(interval / engine.time_step))
        assert engine.motors.readings is not None  # set for articulated smarticles
        hardest = max(hardest, float(np.abs(engine.motors.readings.torques).max()) / scene.torque_limit)
        message = watchdog_error(engine, recorder)
    return [
        nothing("the watchdog reports", message),
        above("largest torque over τ_max [1]", hardest, 3.0),
        below("energy from nowhere over the watchdog's limit [1]", noting.nearest["energy"], 0.25),
    ]


@hard("tip through the floor", {"speed": 2.0})
def tip(access: EngineAccess, out: Path, *, speed: float) -> list[Check]:
    """Throw the tip of a barb at the floor, so fast that on YADE a sphere's centre goes through the floor.

    From that depth on YADE's contact force decreases. On the engine `links` the repulsive barrier stops the tip above
    the floor.
    """
    scene, engine, recorder = watched(scene_data(access, count=1), out)
    add(engine, (0, 0, 0.02), Rotation.random(random_state=1))
    access.push(engine, 0, velocity=(0, 0, -speed))
    message, first, lowest = None, energy(engine), math.inf
    while not message and engine.time < 0.05:
        engine.advance(2)
        lowest = min(lowest, float(engine.state().smarticles.spheres(scene.body)[..., 2].min()))
        message = watchdog_error(engine, recorder)
    left = "1 smarticle(s) (0): left through the wall or the floor; raise fidelity.stiffness_N_per_m"
    return [
        above("lowest point of an axis [m]", lowest, 0.0) if access.name == "links" else says(message, left),
        below("energy before over that of the start [1]", energy(engine) / first, 1.001),
    ]


@hard("deep overlap", {"time": 0.1}, {"time": 0.5})
def overlap(access: EngineAccess, out: Path, *, time: float) -> list[Check]:
    """Start with two parallel smarticles 0.4 diameters apart, which overlap over their whole length."""
    scene, engine, recorder = watched(scene_data(access, count=2, container={"height_m": 1.0}), out)
    d, start = scene.sphere_diameter, 0.03
    add(engine, (0, 0, start), TILTED)
    add(engine, (0, 0, start + 0.4 * d), TILTED)
    engine.advance(1)
    message = watchdog_error(engine, recorder)
    energies = [energy(engine)]
    for _ in range(round(time / 1e-3)):
        engine.advance(round(1e-3 / engine.time_step))
        energies.append(energy(engine))
    spheres = engine.state().smarticles.spheres(scene.body)
    apart = np.linalg.norm(spheres[0][:, None] - spheres[1][None], axis=-1).min()
    # On links the barrier separates them; chains of spheres may pass through each other, which must be reported.
    seen = (
        [] if access.name == "links" else [says(message, "2 smarticle(s) (0, 1): contacts more", "through each other")]
    )
    return [
        *seen,
        below("highest energy over that of the start [1]", max(energies) / energies[0], 1.01),
        below("energy at the end over that of the start [1]", energies[-1] / energies[0], 0.9),
        above("distance of the spheres at the end [d]", apart / d, 0.9),
    ]


@hard("deep overlap, thrown out", {"time": 0.1})
def thrown_by_overlap(access: EngineAccess, out: Path, *, time: float) -> list[Check]:
    """Start with two overlapping smarticles, without the check of overlaps; one is thrown over the wall."""
    scene, engine, recorder = watched(scene_data(access, count=2), out)
    recorder.watchdog.depth = math.inf
    add(engine, (0, 0, 0.03), TILTED)
    add(engine, (0, 0, 0.03 + 0.4 * scene.sphere_diameter), TILTED)
    message = None
    while not message and engine.time < time:
        engine.advance(round(1e-3 / engine.time_step))
        message = watchdog_error(engine, recorder)
    return [says(message, "1 smarticle(s) (1): thrown out over the wall of")]


@hard("same place", {"time": 0.02})
def same_place(access: EngineAccess, out: Path, *, time: float) -> list[Check]:
    """Start with two smarticles at equal positions, where the direction of the contact force is undefined."""
    _, engine, recorder = watched(scene_data(access, count=2), out)
    for _ in range(2):
        add(engine, (0, 0, 0.03), TILTED)
    try:
        engine.advance(round(time / engine.time_step))
        message = watchdog_error(engine, recorder)
    except RunError as error:
        message = str(error)
    return [says(message, "2 smarticle(s) (0, 1)")]


@hard("shaken at Γ = 10", {"count": 6, "seconds": 0.2, "rest": 0.8}, {"count": 100, "seconds": 2.0, "rest": 1.0})
def shaken(access: EngineAccess, out: Path, *, count: int, seconds: float, rest: float) -> list[Check]:
    """Shake at Γ = 10 and 30 Hz, then rest."""
    shake = {"type": "shake", "duration_s": seconds, "frequency_hz": 30, "peak_acceleration_g": 10}
    # By its name: the time step of 250 N/m is too long for the floor's speed.
    run = whole(scene_data(access, shake, {"type": "relax", "duration_s": rest}, count=count, fidelity="draft"), out)
    checks = run.sound()
    if run.error is None:
        peak = 10 * 9.81 / (2 * np.pi * 30)
        thrown, height = run.during(1), run.series["com_height_m"]
        fast = run.series["max_speed_m_per_s"][thrown].max()
        checks += [
            above("greatest speed over the container's [1]", fast / peak, 1.0),
            below("greatest speed over the container's [1]", fast / peak, 4.0 if count < 50 else 8.0),
            above("thrown above its height before [m]", height[thrown].max() - height[run.during(0)][-1], 2e-3),
            above("thrown above its height after [m]", height[thrown].max() - height[-1], 2e-3),
        ]
    return checks


@hard("thrown out of the container", {"count": 6, "seconds": 0.5}, {"count": 60})
def thrown_out(access: EngineAccess, out: Path, *, count: int, seconds: float) -> list[Check]:
    """Shake at Γ = 30 in a low container: the scene is rejected, and a run without this check is stopped."""
    shake = {"type": "shake", "duration_s": seconds, "frequency_hz": 20, "peak_acceleration_g": 30}
    # Shaking that moves the floor by more than a twentieth of a diameter in a step is rejected.
    stiff = {} if access.name == "yade" else {"stiffness_N_per_m": 5000}
    fidelity = {"base": "draft", "time_step_fraction": 0.25, **stiff}
    data = scene_data(access, shake, count=count, fidelity=fidelity, container={"height_m": 0.045})
    rejected = whole(data, out).text
    # Without the checks of `time_steps`.
    run = whole(data, out, steps=lambda scene: (time_step(scene),) * len(scene.phases))
    return [
        says(rejected, "phases.1.frequency_hz: 20 Hz at Γ = 30 throws smarticles up by", "out of the wall of 0.045 m"),
        says(run.text, "at t = ", "thrown out over the wall of 0.045 m; raise container.height_m, or shake"),
    ]


def mass_ratio(
    access: EngineAccess, out: Path, *, heavy_above: bool, stiffness: float, time: float, ratio: float = 1e4
) -> list[Check]:
    """Multiply the weight of the upper or the lower of two stacked smarticles by `ratio`.

    With a contact `stiffness` of 250 N/m, that of draft, contacts cannot carry the weight, which the watchdog must
    report. With 1e6 N/m they must carry it.
    """
    carries = stiffness > 250 * ratio / 10
    data = scene_data(access, count=2, fidelity={"base": "draft", "stiffness_N_per_m": stiffness})
    scene, engine, recorder = watched(data, out)
    flat, d, centres = lying(scene), scene.sphere_diameter, access.ends(scene.body)
    # The centre of mass is not in the middle of the contact springs, so that the smarticle also tilts.
    middle = centres[:, 1].mean()
    softness = (1 / len(centres) + middle**2 / ((centres[:, 1] - middle) ** 2).sum()) / stiffness
    weight = scene.smarticle.boxes.mass * scene.gravity_m_per_s2
    sunk = [(ratio + 1) * weight * softness, (ratio if heavy_above else 1) * weight * softness]
    add(engine, (0, 0, flat - sunk[0] * carries))
    add(engine, (0, 0, 3 * flat - sum(sunk) * carries))
    if access.name == "links":
        recorder.watchdog.energy = math.inf  # the ledger does not include the work of the added load
    access.burden(engine, int(heavy_above), ratio, rise=0.0 if carries else time)
    message, start_time, heights = None, engine.time, []
    while not message and engine.time < start_time + time:
        engine.advance(round(recorder.interval / engine.time_step) // 20)
        message = watchdog_error(engine, recorder)
        heights.append(engine.state().smarticles.positions[:, 2])
    if not carries:
        return [says(message, "at t = ", "raise fidelity.stiffness_N_per_m")]
    # The heavy smarticle oscillates with little damping: compare the mean, within 10 %.
    low, high = np.mean(heights, axis=0)
    floor, other = (depth / d * 1e6 for depth in sunk)
    return [
        nothing("the watchdog reports", message),
        below("speed at the end [m/s]", fastest(engine), 0.01),
        near("depth of the lower one in the floor [1e-6 d]", 1e6 * (flat - low) / d, floor, floor / 10),
        near("depth of one in the other [1e-6 d]", 1e6 * (2 * flat - high + low) / d, other, other / 10),
    ]


LIGHT_ON_HEAVY = (
    "all smarticles share one mass: a load as heavy that has no inertia of its own shakes off what lies on it; above "
    "it is borne"
)
for _above in (False, True):
    for _stiffness in (250.0, 1e6):
        hard(
            f"mass ratio 1e4, {'heavy on light' if _above else 'light on heavy'}, contacts of {_stiffness:g} N/m",
            {"heavy_above": _above, "stiffness": _stiffness, "time": 0.1},
            absent={} if _above or _stiffness < 1e6 else {"links": LIGHT_ON_HEAVY},
        )(mass_ratio)


def lid(access: EngineAccess, out: Path, *, count: int, stiffness: float) -> list[Check]:
    """Load a column of smarticles of l/w = 1.8 with ten times its weight, at rest and shaken at Γ = 10.

    The lid is the highest smarticle, whose weight is raised. The plate of the phase `compress` has a prescribed motion,
    not a weight.
    """
    fidelity = {"base": "draft", "stiffness_N_per_m": stiffness}
    shake = {"type": "shake", "duration_s": 0.2, "frequency_hz": 30, "peak_acceleration_g": 10}
    data = scene_data(access, shake, count=count, per_layer=1, smarticle={"aspect_ratio": 1.8}, fidelity=fidelity)
    data["container"] = {"radius_m": 1.05 * scene_of(data).model.reach, "height_m": 0.6}
    scene, engine, recorder = watched(data, out)
    stage = scene.phases[0].begin(scene, 0)
    while wait := stage.proceed(engine):
        engine.advance(max(1, round(wait / engine.time_step)))
    ratio, rise = 10.0 * count, 0.1
    recorder.watchdog.energy = math.inf  # the ledger does not include the work of the added load
    top = int(engine.state().smarticles.positions[:, 2].argmax())
    access.burden(engine, top, ratio, rise=rise)
    crossed, last, interval = 0, segments(engine.state().smarticles.vertices), round(1e-3 / engine.time_step)

    def watch(seconds: float) -> str | None:
        nonlocal crossed, last
        message, end = None, engine.time + seconds
        while not message and engine.time < end:
            engine.advance(interval)
            ends = segments(engine.state().smarticles.vertices)
            crossed, last = crossed + len(crossings(last, ends)), ends
            message = watchdog_error(engine, recorder)
        return message

    resting = watch(rise + 0.4)
    load = (count + ratio - 1) * scene.body.boxes.mass * scene.gravity_m_per_s2
    # Each step kicks the loaded smarticle itself by `ratio` g dt.
    speeds = np.delete(np.linalg.norm(engine.state().smarticles.link_velocities, axis=-1), top, axis=0)
    force = -access.floor_force(engine)[2]
    shaking = watch(scene.phases[1].begin(scene, 1).proceed(engine))
    return [
        nothing("the watchdog reports at rest", resting),
        near("force on floor and wall over the load [1]", force / load, 1.0, 0.05),
        below("speed of the others at rest [m/s]", float(speeds.max()), 0.05),  # after a fall of 0.1 mm
        nothing("the watchdog reports while it is shaken", shaking),
        below("pairs of axes crossed [1]", crossed, 0.5),
    ]


for _stiffness in (250.0, 5000.0):
    hard(
        f"heavy lid on a column, contacts of {_stiffness:g} N/m",
        {"count": 6, "stiffness": _stiffness},
        {"count": 20},
        absent={"yade": "chains of spheres are pushed through the wall by such a load; links have a barrier"},
    )(lid)
