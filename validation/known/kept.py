"""Conservation of momentum and energy, the energy ledger of a pile, and impenetrable links.

`access` is the engine, with access to its internals; `dt` is a time step, a sequence `steps` has several [s].
"""

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.state import State
from dem.engine.interface import Engine
from dem.plan.steps import time_step
from validation.access import EngineAccess
from validation.bench import Array, add, drive, law_of, scene, scene_data, shape_change
from validation.cases import Answer, case
from validation.extremes import crossings, segments
from validation.hard.runs import whole

YADES_TURNS = {"yade": "its turns are of first order: ladder `spin`"}
NOT_EACH_STEP = {"yade": "chains are checked now and then, not in every step: results/stability/README.md"}
SAMPLED = {"yade": "dissipation is sampled there, not added up: tests/engine has its error"}
GAIT = "two smarticles in space swing their barbs, spinning"
MOMENTA = "nothing acts from outside: momentum and angular momentum about the centre of mass"
WORK = "work of the motors is gain of kinetic energy"
SOLID = "links are solid, or the watchdog says that they were not"

AMPLITUDE = 0.35  # amplitude of the gait [rad], within the speed limit of the motors
PERIODS = 2000  # control periods per period of the gait
SPINS = np.array([[40.0, -30.0, 20.0], [0.0, 10.0, 30.0]])  # rad/s
VELOCITIES = np.array([[0.1, -0.2, 0.3], [0.0, 0.1, 0.0]])  # m/s


def free_pair(access: EngineAccess, law: str, damping: float) -> tuple[Engine, Iterator[float]]:
    """Build an engine with two distant smarticles that spin and drift; return engine and iterator.

    The iterator advances the engine and swings the barbs, see `bench.drive`. The motors have the law `law` and the
    damping `damping` [N m s/rad]; 0 stands for the default damping.
    """
    motor = {"law": law, "torque_limit_N_m": 1e-4} | ({"damping_N_m_s_per_rad": damping} if damping else {})
    one = scene(access, shape_change(), motor=motor)
    engine, interval = access.build_hinged(one, gravity=0.0), one.fidelity.control_interval_s
    for k in range(2):
        add(engine, (0.2 * k - 0.1, 0.0, 0.1), Rotation.random(random_state=k))
        access.push(engine, k, VELOCITIES[k], SPINS[k])
    engine.motors.articulate()

    def targets(time: float) -> Array:
        update = round(time / interval) - 1
        return np.full((2, 2), math.pi / 2 + AMPLITUDE * math.sin(2 * math.pi * update / PERIODS))

    return engine, drive(engine, one, PERIODS * interval, targets)


def _own_momentum(state: State) -> Array:
    """Return the angular momentum of each smarticle about its centre of mass, (2, 3) [kg m²/s]."""
    arms = state.link_positions - state.positions[:, None]
    velocities = state.link_velocities - state.velocities[:, None]
    own = np.einsum("nkij,nkj->nki", state.link_rotations, state.boxes.link_inertias * state._local_spins)
    found: Array = (np.cross(arms, velocities) * state.boxes.link_masses[None, :, None] + own).sum(axis=1)
    return found


def free_gait(access: EngineAccess, *, law: str, damping: float = 0.0) -> list[Answer]:
    engine, swinging = free_pair(access, law, damping)
    before = engine.state().smarticles
    angles = [engine.state().smarticles.angles for _ in swinging]
    after, mass, spin = engine.state().smarticles, before.boxes.mass, _own_momentum(before)
    momentum = mass * np.linalg.norm(after.velocities - before.velocities, axis=1).max()
    turning = np.linalg.norm(_own_momentum(after) - spin, axis=1).max()
    fast, large = mass * np.linalg.norm(before.velocities, axis=1).max(), np.linalg.norm(spin, axis=1).max()
    swing = np.ptp(np.array(angles), axis=0).min()
    exact = "rounding, 2000 control periods: momenta are the state, and internal motion is taken off in closed form"
    limited = "that there was a gait; motors are limited in speed and torque"
    return [
        Answer("momentum, change [kg m/s]", 0.0, momentum, 1e-12, exact, scale=fast),
        Answer("angular momentum, change of the vector [kg m²/s]", 0.0, turning, 1e-12, exact, scale=large),
        Answer("swing of the barbs [rad]", 2 * AMPLITUDE, swing, 0.2, limited),
    ]


def pair_work(access: EngineAccess, *, law: str, damping: float = 0.0) -> list[Answer]:
    engine, swinging = free_pair(access, law, damping)
    start = engine.state().kinetic_energy
    gains, works = np.array([(engine.state().kinetic_energy - start, engine.motors.work) for _ in swinging]).T
    what, worst = "work of the motors less gain of energy, worst [J]", float(np.abs(gains - works).max())
    reason = "second order in the time step"
    return [Answer(what, 0.0, worst, 1e-3, reason, scale=float(np.abs(gains).max()))]


for _law, _damping in (("halt", 0.0), ("stall", 0.0), ("ease", 0.0), ("slip", 0.0), ("servo", 2e-6)):
    _options: dict[str, Any] = {"absent": YADES_TURNS, "law": _law, "damping": _damping}
    case(f"free gait, {_law}", GAIT, MOMENTA, **_options)(free_gait)
    if _law != "stall":
        case(f"work on a free pair, {_law}", GAIT, WORK, **_options)(pair_work)


@case(
    "thousand turns",
    "smarticles spin freely at 60 rad/s, at the step of a scene",
    "energy and angular momentum",
    absent=YADES_TURNS,
)
def thousand_turns(access: EngineAccess) -> list[Answer]:
    one, rate = scene(access), 60.0
    engine = access.build(one.body, law_of(one), dt=time_step(one))
    spins = np.array([[rate, 1.0, 0.5], [1.0, rate, 0.5], [30.0, 30.0, 43.0]])
    for k, spin in enumerate(spins):
        add(engine, (0.2 * k - 0.2, 0, 0.1), Rotation.random(random_state=k))
        access.push(engine, k, spin=spin)
    before, momentum = engine.state().kinetic_energy, engine.state().smarticles.angular_momentum
    engine.advance(round(1000 * 2 * math.pi / rate / engine.time_step))
    after, size = engine.state().smarticles, float(np.linalg.norm(momentum))
    change, what = (
        float(np.linalg.norm(after.angular_momentum - momentum)),
        "angular momentum, change of the vector [kg m²/s]",
    )
    midpoint = "the midpoint rule keeps it but for what its three iterations leave, (ω dt)³ of a turn"
    return [
        Answer("kinetic energy after a thousand turns [J]", before, after.kinetic_energy, 1e-4, midpoint),
        Answer(what, 0.0, change, 1e-12, "rounding: it is the state", scale=size),
    ]


@case(
    "energy ledger of a pile",
    "100 smarticles swing their barbs in a pile, standard",
    "added energy and work are what is stored and what was dissipated",
    absent=SAMPLED,
)
def ledger(access: EngineAccess, *, count: int = 100, seconds: float = 0.5) -> list[Answer]:
    swing = {"type": "internal-oscillation", "theta_deg": 10, "duration_s": seconds}
    recording = {"dissipation_interval_s": 2e-3}
    data = scene_data(access, swing, count=count, per_layer=20, fidelity="standard", recording=recording)
    with tempfile.TemporaryDirectory() as scratch:
        run = whole(data, Path(scratch) / "run", note=False)
    assert run.error is None, run.text
    names = ("energy_residual_J", "motor_work_J", "dissipated_energy_J")
    residual, work, lost = (run.series[name][run.during(1)] for name in names)
    done, largest, change = work[-1] - work[0], np.nanmax(np.abs(run.series["energy_residual_J"])), np.ptp(residual)
    second = "second order: a time step's share of springs and motors, a quarter as much at half the step"
    stores = "that there is something to account for: a pile that swings stores next to nothing"
    over = "residual of the ledger, over all that was dissipated since the pour [J]"
    during = "residual, its change while motors are at work, over their work [J]"
    share = "dissipated over work of the motors [1]"
    return [
        Answer(over, 0.0, largest, 0.005, second, scale=lost[-1]),
        Answer(during, 0.0, change, 0.01, second, scale=done),
        Answer(share, 1.0, (lost[-1] - lost[0]) / done, 0.3, stores),
    ]


# -- links are solid ---------------------------------------------------------------------------------------------------


@case(
    "10 m/s and 60 rad/s, contacts of 250 N/m",
    "smarticles thrown at others, which linear contacts so soft could not hold",
    SOLID,
    absent=NOT_EACH_STEP,
    stiffness=250.0,
)
@case(
    "10 m/s and 60 rad/s, contacts of 20000 N/m",
    "smarticles thrown at others",
    SOLID,
    absent=NOT_EACH_STEP,
    stiffness=2e4,
)
def thrown_at(access: EngineAccess, *, stiffness: float, throws: int = 30) -> list[Answer]:
    """Throw a smarticle at another one at 10 m/s and 60 rad/s without gravity, `throws` times."""
    one = scene(access, fidelity={"base": "draft", "stiffness_N_per_m": stiffness})
    law, dt, rng = law_of(one), time_step(one), np.random.default_rng(1)
    crossed, met = 0, 0
    for _ in range(throws):
        engine = access.build(one.body, law, dt=dt)
        add(engine, (0, 0, 0.1), Rotation.random(random_state=rng))
        across, up = rng.uniform(-4e-3, 4e-3, 2)
        add(engine, (0.03, across, 0.1 + up), Rotation.random(random_state=rng))
        axis = rng.normal(size=3)
        access.push(engine, 1, velocity=(-10, 0, 0), spin=60 * axis / np.linalg.norm(axis))
        before, passed = engine.state().smarticles.vertices, False
        for _ in range(math.ceil(0.06 / 10 / dt)):
            engine.advance(1)
            after = engine.state().smarticles.vertices
            passed |= bool(crossings(segments(before), segments(after)))
            before = after
        crossed += passed
        met += abs(engine.state().smarticles.velocities[0, 0]) > 1e-3
    return [
        Answer("throws that met [1]", throws, met, 0.6, "that something happened: some fly by"),
        Answer("links that passed through each other [1]", 0.0, crossed, 0.0, "counted", scale=1.0),
    ]
