"""Conservation: momentum and energy of smarticles in free flight, the energy ledger of a pile, links as solids."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.body.state import State
from dem.engine.interface import Engine
from dem.physics.contact import ContactLaw
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from validation.bench import Array, add, law_of, scene
from validation.case import case
from validation.check import Answer
from validation.engines import EngineAccess
from validation.hard import scenes
from validation.hard.runs import whole

YADES_TURNS = {"yade": "its turns are of first order: ladder `spin`"}
NOT_EACH_STEP = {"yade": "chains are looked at now and then, not in every step: results/stability/README.md"}
GAIT = "two smarticles in space swing their barbs, spinning"
MOMENTA = "nothing acts from outside: momentum and angular momentum about the centre of mass"
WORK = "work of the motors is gain of kinetic energy"
SOLID = "links are solid, or the watchdog says that they were not"

AMPLITUDE = 0.35  # rad, of gaits, within the speed of the motors
PERIOD_LOOKS = 2000
SPINS = np.array([[40.0, -30.0, 20.0], [0.0, 10.0, 30.0]])  # rad/s
VELOCITIES = np.array([[0.1, -0.2, 0.3], [0.0, 0.1, 0.0]])  # m/s


def gait(access: EngineAccess, law: str, *, damping: float = 0.0, strength: float) -> tuple[Scene, Engine]:
    """Two smarticles far apart that spin and drift, and whose motors take hold of the barbs."""
    motor = {"law": law, "torque_limit_N_m": strength} | ({"damping_N_m_s_per_rad": damping} if damping else {})
    one = scene(access, phases=("shape-change",), motor=motor)
    engine = access.build_hinged(one, gravity=0.0)
    for k in range(2):
        add(engine, (0.2 * k - 0.1, 0.0, 0.1), Rotation.random(random_state=k))
        access.push(engine, k, VELOCITIES[k], SPINS[k])
    engine.motors.articulate()
    return one, engine


def move(one: Scene, engine: Engine, looks: int, seen: Callable[[], None]) -> None:
    """Let all barbs swing about the right angle, and look after each control period."""
    interval = one.fidelity.control_interval_s
    for look in range(looks):
        angle = math.pi / 2 + AMPLITUDE * math.sin(2 * math.pi * look / PERIOD_LOOKS)
        engine.motors.actuate(np.full((1, 2, 2), angle), interval)
        engine.advance(round(interval / engine.time_step))
        seen()


def _own_momentum(state: State) -> Array:
    """(2, 3) angular momenta about the own centres of mass [kg m²/s]."""
    masses = state.boxes.link_masses[None, :, None]
    arms, velocities = (
        state.link_positions - state.positions[:, None],
        state.link_velocities - state.velocities[:, None],
    )
    own = np.einsum("nkij,nkj->nki", state.link_rotations, state.boxes.link_inertias * state._local_spins)
    found: Array = (np.cross(arms, velocities) * masses + own).sum(axis=1)
    return found


def free_gait(access: EngineAccess, *, law: str, damping: float = 0.0) -> list[Answer]:
    one, engine = gait(access, law, damping=damping, strength=1e-4)
    before = engine.state()
    angles: list[Array] = []
    move(one, engine, PERIOD_LOOKS, lambda: angles.append(engine.state().angles))
    after = engine.state()
    spin, speed = _own_momentum(before), np.linalg.norm(before.velocities, axis=1)
    reason = "rounding, 2000 control periods: momenta are the state, and internal motion is taken off in closed form"
    return [
        Answer(
            "momentum, change [kg m/s]",
            0.0,
            float(before.boxes.mass * np.linalg.norm(after.velocities - before.velocities, axis=1).max()),
            1e-12,
            scale=float(before.boxes.mass * speed.max()),
        ).because(reason),
        Answer(
            "angular momentum, change of the vector [kg m²/s]",
            0.0,
            float(np.linalg.norm(_own_momentum(after) - spin, axis=1).max()),
            1e-12,
            scale=float(np.linalg.norm(spin, axis=1).max()),
        ).because(reason),
        Answer("swing of the barbs [rad]", 2 * AMPLITUDE, float(np.ptp(np.array(angles), axis=0).min()), 0.2).because(
            "that there was a gait; motors are limited in speed and torque"
        ),
    ]


def pair_work(access: EngineAccess, *, law: str, damping: float = 0.0) -> list[Answer]:
    one, engine = gait(access, law, damping=damping, strength=1e-4)
    start, gains, works = engine.state().kinetic_energy, [], []

    def seen() -> None:
        gains.append(engine.state().kinetic_energy - start)
        works.append(engine.motors.work)

    move(one, engine, PERIOD_LOOKS, seen)
    most = float(np.abs(gains).max())
    return [
        Answer(
            "work of the motors less gain of energy, worst [J]",
            0.0,
            float(np.abs(np.array(gains) - works).max()),
            1e-3,
            scale=most,
        ).because("second order in the time step where they drive; jumps of a rate are counted exactly")
    ]


for _law, _damping in (("halt", 0.0), ("stall", 0.0), ("ease", 0.0), ("slip", 0.0), ("servo", 2e-6)):
    _options: dict[str, Any] = {"absent": YADES_TURNS, "law": _law, "damping": _damping}
    case(f"free gait, {_law}", GAIT, MOMENTA, **_options)(free_gait)
    if _law != "stall":
        case(f"work on a free pair, {_law}", "the same", WORK, **_options)(pair_work)


@case(
    "thousand turns",
    "smarticles spin freely at 60 rad/s, at the step of a scene",
    "energy and angular momentum",
    absent=YADES_TURNS,
)
def thousand_turns(access: EngineAccess) -> list[Answer]:
    one, rate = scene(access), 60.0
    engine = access.build(one.particle, law_of(one), dt=time_step(one))
    spins = np.array([[rate, 1.0, 0.5], [1.0, rate, 0.5], [30.0, 30.0, 43.0]])
    for k, spin in enumerate(spins):
        add(engine, (0.2 * k - 0.2, 0, 0.1), Rotation.random(random_state=k))
        access.push(engine, k, spin=spin)
    before = engine.state()
    engine.advance(round(1000 * 2 * math.pi / rate / engine.time_step))
    after, momentum = engine.state(), before.angular_momentum
    return [
        Answer("kinetic energy after a thousand turns [J]", before.kinetic_energy, after.kinetic_energy, 1e-4).because(
            "the midpoint rule keeps it but for what its three iterations leave, (ω dt)³ of a turn"
        ),
        Answer(
            "angular momentum, change of the vector [kg m²/s]",
            0.0,
            float(np.linalg.norm(after.angular_momentum - momentum)),
            1e-12,
            scale=float(np.linalg.norm(momentum)),
        ).because("rounding: it is the state"),
    ]


@case(
    "energy ledger of a pile",
    "100 smarticles swing their barbs in a pile, standard",
    "added energy and work are what is stored and what was dissipated",
    absent={"yade": "dissipation is sampled there, not added up: tests/engine has its error"},
    count=100,
    seconds=0.5,
)
def account(access: EngineAccess, *, count: int, seconds: float) -> list[Answer]:
    swing = {"type": "internal-oscillation", "theta_deg": 10, "duration_s": seconds}
    data = scenes.scene(
        access, swing, count=count, per_layer=20, fidelity="standard", recording={"dissipation_interval_s": 2e-3}
    )
    with tempfile.TemporaryDirectory() as scratch:
        run = whole(data, Path(scratch) / "run", note=False)
    assert run.error is None, run.text
    swinging = run.during(1)
    residual, work, lost = (
        run.series[name][swinging] for name in ("energy_residual_J", "motor_work_J", "dissipated_energy_J")
    )
    done = float(work[-1] - work[0])
    reason = (
        "first order: springs of contacts that begin or end within a step do more or less work than they hold; half as "
        "much at half the step"
    )
    return [
        Answer(
            "residual of the ledger, over all that was dissipated since the pour [J]",
            0.0,
            float(np.nanmax(np.abs(run.series["energy_residual_J"]))),
            0.01,
            scale=float(lost[-1]),
        ).because(reason),
        Answer(
            "residual, its change while motors are at work, over their work [J]",
            0.0,
            float(np.ptp(residual)),
            0.03,
            scale=done,
        ).because(reason),
        Answer("dissipated over work of the motors, all told [1]", 1.0, float(lost[-1] - lost[0]) / done, 0.3).because(
            "that there is something to account for: a pile that swings stores next to nothing"
        ),
    ]


# -- links are solid ---------------------------------------------------------------------------------------------------


def _sides(vertices: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Two smarticles, (2, 4, 3) [m]: on which side each link of one passes each of the other, and whether it does so.

    Returns:
        (3, 3) signed volumes, and whether both nearest points are inside the links.
    """
    starts, along = vertices[:, :3], vertices[:, 1:] - vertices[:, :3]
    u, v = along[0][:, None], along[1][None]
    apart = starts[0][:, None] - starts[1][None]
    normal = np.cross(u, v)
    volume = (apart * normal).sum(axis=-1)
    square = (normal**2).sum(axis=-1)
    s = -(np.cross(apart, v) * normal).sum(axis=-1) / square
    t = -(np.cross(apart, u) * normal).sum(axis=-1) / square
    inside = (s > 0) & (s < 1) & (t > 0) & (t < 1)
    return volume, inside


@case(
    "10 m/s and 60 rad/s, contacts of 250 N/m",
    "smarticles thrown at others, which linear contacts so soft could not hold",
    SOLID,
    absent=NOT_EACH_STEP,
    stiffness=250.0,
    throws=30,
)
@case(
    "10 m/s and 60 rad/s, contacts of 20000 N/m",
    "smarticles thrown at others",
    SOLID,
    absent=NOT_EACH_STEP,
    stiffness=2e4,
    throws=30,
)
def thrown_at(access: EngineAccess, *, stiffness: float, throws: int) -> list[Answer]:
    """Smarticles at 10 m/s and 60 rad/s meet others in free space."""
    one = scene(access, fidelity={"base": "draft", "stiffness_N_per_m": stiffness})
    law: ContactLaw = law_of(one)
    dt = time_step(one)
    rng = np.random.default_rng(1)
    crossed, met = [], []
    for _ in range(throws):
        engine = access.build(one.particle, law, dt=dt)
        add(engine, (0, 0, 0.1), Rotation.random(random_state=rng))
        across, up = rng.uniform(-4e-3, 4e-3, 2)
        add(engine, (0.03, across, 0.1 + up), Rotation.random(random_state=rng))
        axis = rng.normal(size=3)
        access.push(engine, 1, velocity=(-10, 0, 0), spin=60 * axis / np.linalg.norm(axis))
        before, passed = _sides(engine.state().vertices), False
        for _ in range(math.ceil(0.06 / 10 / dt)):
            engine.advance(1)
            now = _sides(engine.state().vertices)
            passed |= bool((before[1] & now[1] & (before[0] * now[0] < 0)).any())
            before = now
        crossed.append(passed)
        met.append(abs(engine.state().velocities[0, 0]) > 1e-3)
    return [
        Answer("throws that met [1]", float(throws), float(np.sum(met)), 0.6).because(
            "that something happened: some fly by"
        ),
        Answer("links that passed through each other [1]", 0.0, float(np.sum(crossed)), 0.0, scale=1.0).because(
            "counted"
        ),
    ]
