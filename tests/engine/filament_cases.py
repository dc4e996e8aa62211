"""Filaments on YADE, and beside those on links, in a process of its own; see `cases.py`."""

from pathlib import Path
from typing import Any

import numpy as np
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.engine.interface import Engine
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.filaments import YadeFilaments
from dem.plan.steps import time_step
from dem.record.run import Run
from dem.run.build import build_engine
from dem.run.run import run_scene

L, D, DENSITY, E = 0.1, 4e-3, 1000.0, 1e6
ROD: dict[str, Any] = {
    "shape": "filament",
    "length_m": L,
    "diameter_m": D,
    "density_kg_per_m3": DENSITY,
    "young_modulus_Pa": E,
    "segments": 20,
}


def built(particle: dict[str, Any], *, engine: str = "yade", dt: float | None = None, **changes: Any) -> Engine:
    """An engine without filaments in a wide container."""
    count = changes.pop("count", 1)
    scene = small({"engine": engine, "count": count, "particle": particle, "container.radius_m": 0.3, **changes})
    return build_engine(scene, dt or time_step(scene))


def put(engine: Engine, *places: tuple[float, float, float], turns: tuple[Rotation, ...] = ()) -> None:
    """Add straight or bent filaments, along x unless `turns` are given, with centres of mass at places [m]."""
    turns = turns or (Rotation.identity(),) * len(places)
    engine.add(Poses(np.array(places), turns, np.zeros(len(places), np.int64)))


def inside(engine: Engine) -> tuple[YadeFilaments, list[Any]]:
    """The filaments, and YADE's states of all nodes."""
    assert isinstance(engine, YadeEngine)
    assert engine.filaments is not None
    return engine.filaments, engine.filaments._states


def clamped(segments: int, gravity: float, bending_time: float) -> tuple[Engine, YadeFilaments]:
    """A rod along x whose first node is held."""
    rod = {**ROD, "segments": segments, "bending_time_s": bending_time}
    engine = built(rod, **{"gravity_m_per_s2": gravity, "fidelity": {"base": "draft", "stiffness_N_per_m": 10}})
    put(engine, (0.0, 0.0, 0.2))
    filaments, states = inside(engine)
    states[0].blockedDOFs = "xyzXYZ"
    filaments._inertia[0] *= 1e6  # damping does not move it either
    return engine, filaments


def sagged(segments: int, gravity: float, slowest: float) -> np.ndarray:
    """Deflection of the free end of a cantilever at rest, along x and z [m]."""
    engine, filaments = clamped(segments, gravity, 2 / slowest)
    engine.advance(round(24 / slowest / engine.time_step))
    points = filaments.points(0)
    return (points[-1] - points[0])[[0, 2]]


def vibrating(segments: int, gravity: float, slowest: float, damping_time: float) -> dict[str, Any]:
    """Height of the free end of a cantilever that was bent by its weight, which then vanishes."""
    engine, filaments = clamped(segments, gravity, 2 / slowest)
    engine.advance(round(24 / slowest / engine.time_step))
    engine._omega.engines[-1].gravity = engine._yade.vector(0, 0, 0)
    filaments._damping[:] *= damping_time * slowest / 2
    times, heights = [], []
    for _ in range(round(25 / slowest / engine.time_step / 20)):
        engine.advance(20)
        points = filaments.points(0)
        times.append(engine.time)
        heights.append(points[-1, 2] - points[0, 2])
    return {"times": np.array(times), "heights": np.array(heights)}


def buckled(segments: int, slowest: float, shortening: float, gravity: float) -> np.ndarray:
    """Load of a strut on pins whose ends come nearer by `shortening` and then stay, at three times [N]."""
    rod = {**ROD, "segments": segments, "bending_time_s": 2 / slowest, "stretching_time_s": 1e-3}
    engine = built(rod, **{"gravity_m_per_s2": gravity, "fidelity": {"base": "draft", "stiffness_N_per_m": 10}})
    put(engine, (0.0, 0.0, 0.2))
    filaments, states = inside(engine)
    states[0].blockedDOFs = states[-1].blockedDOFs = "xyz"
    time, loads = 10 / slowest, []
    states[-1].vel = engine._yade.vector(-shortening / time, 0, 0)
    engine.advance(round(time / engine.time_step))
    states[-1].vel = engine._yade.vector(0, 0, 0)
    for _ in range(3):
        engine.advance(round(5 / slowest / engine.time_step))
        bond = filaments._bonds[-1].phys
        loads.append(abs(bond.normalForce[0] + bond.shearForce[0]))
    return np.array(loads)


def free(damped: bool, steps: int) -> dict[str, Any]:
    """Momentum, angular momentum and energies of a free, bent filament that tumbles and vibrates."""
    times = {"stretching_time_s": 1e-3, "bending_time_s": 0.02} if damped else {}
    engine = built({**ROD, "poured_bend_deg": 120, "segments": 10, **times}, **{"gravity_m_per_s2": 1e-6})
    put(engine, (0.0, 0.0, 0.2))
    filaments, states = inside(engine)
    rng = np.random.default_rng(3)
    for state in states:
        state.vel = engine._yade.vector(*rng.normal(0, 0.05, 3))
        state.angVel = engine._yade.vector(*rng.normal(0, 5, 3))
    rows = []
    for _ in range(20):
        engine.advance(steps // 20)
        table = filaments._rows()
        x, v, w = np.split(table, (3, 6), axis=1)
        m, inertia = filaments._masses[:, None], filaments._inertia[:, 3:]
        kinetic = 0.5 * float((m * v**2).sum() + (inertia * w**2).sum())
        turning = (np.cross(x, m * v) + inertia * w).sum(axis=0)
        rows.append([*(m * v).sum(axis=0), *turning, kinetic, filaments.elastic_energy(), sum(filaments._losses)])
    return {"rows": np.array(rows), "scale": np.abs(filaments._masses).sum() * 0.05}


def sinking() -> dict[str, Any]:
    """Speed, impulse and energy of a straight filament that sinks across its axis, and along it."""
    found = {}
    liquid = {"density_kg_per_m3": 800, "viscosity_Pa_s": 0.1}
    for name, turn in (("across", Rotation.identity()), ("along", Rotation.from_rotvec([0, np.pi / 2, 0]))):
        engine = built({**ROD, "segments": 10}, liquid=liquid)
        put(engine, (0.0, 0.0, 0.25), turns=(turn,))
        engine.advance(round(0.35 / engine.time_step))
        filaments, state, weight = engine.filaments, engine.state(), 0.2 * engine.particle.mass * engine.gravity
        assert filaments is not None
        found[name] = -state.velocities[0, 2]
        given = weight * (0.25 - state.positions[0, 2])
        found[f"{name} energy"] = (filaments.energies.dragged + state.kinetic_energy) / given
        found[f"{name} impulse"] = engine.impulse / (weight * engine.time)
    return found


def rolling(drag: float, rate: float) -> dict[str, float]:
    """Share of a straight filament's roll that is left after twice the time 1/rate [s] of its drag, and the loss."""
    engine = built({**ROD, "segments": 10, "roll_drag_N_s": drag}, dt=2e-3 / rate, gravity_m_per_s2=1e-6)
    put(engine, (0.0, 0.0, 0.2))
    filaments, states = inside(engine)
    for state in states:
        state.angVel = engine._yade.vector(10.0, 0, 0)
    before = engine.state().kinetic_energy
    engine.advance(1000)
    return {
        "left": min(state.angVel[0] for state in states) / 10.0,
        "dragged": filaments.energies.dragged / (before - engine.state().kinetic_energy),
    }


WORM: dict[str, Any] = {
    "shape": "filament",
    "length_m": 0.03,
    "diameter_m": 0.8e-3,
    "segments": 10,
    "young_modulus_Pa": 5e4,
    "stretching_time_s": 1e-4,
    "bending_time_s": 2e-3,
}


def resting() -> dict[str, float]:
    """Distance of the ends of a worm that prefers a curvature of 100 1/m and was poured straight, and energies."""
    engine = built({**WORM, "curvature_per_m": 100.0, "bending_time_s": 0.05}, gravity_m_per_s2=1e-6)
    put(engine, (0.0, 0.0, 0.05))
    filaments, _ = inside(engine)
    added = engine.ledger.added
    engine.advance(round(0.3 / engine.time_step))
    points = filaments.points(0)
    return {
        "chord": float(np.linalg.norm(points[-1] - points[0])),
        "added": added,
        "damped": filaments.energies.damped,
        "left": filaments.elastic_energy(),
    }


ELASTIC = {"friction_smarticle": 0.3, "friction_wall": 0.3, "restitution": 1.0}
FINE = {"base": "reference", "stiffness_N_per_m": 10}


def pair(engine: str, seconds: float) -> dict[str, Any]:
    """Two worms that fall: the lower one bounces off the floor, then hits the upper one; by rows of time."""
    found = built(WORM, engine=engine, count=2, contact=ELASTIC, fidelity=FINE)
    turns = (Rotation.identity(), Rotation.from_rotvec([0, 0, 1.2]))
    put(found, (0.0, 0.0, 3e-3), (4.5e-3, 1e-3, 6e-3), turns=turns)
    rows, every = [], max(1, round(5e-4 / found.time_step))
    while found.time < seconds:
        found.advance(every)
        state = found.state()
        rows.append([found.time, *state.positions[:, 2], *state.velocities[:, 2], state.kinetic_energy])
    return {"rows": np.array(rows)}


def hit(engine: str, place: tuple[float, float], angle: float) -> dict[str, Any]:
    """A worm that hits another one, which is at rest; `place` is its middle [m], `angle` that between both [rad]."""
    found = built(WORM, engine=engine, count=2, contact=ELASTIC, fidelity=FINE, gravity_m_per_s2=1e-6)
    put(found, (0.0, 0.0, 0.05))
    found.add(Poses(np.array([[*place, 0.0515]]), (Rotation.from_rotvec([0, 0, angle]),), np.zeros(1, int)), speed=0.2)
    deepest, touching = 0.0, 0
    while found.time < 0.012:
        found.advance(1)
        depth = found.overlaps(1.0).deepest
        deepest, touching = max(deepest, depth), touching + (depth > 0)
    velocities = found.state().velocities
    return {
        "gained": -velocities[0, 2],
        "momentum": np.abs(velocities.sum(axis=0) - [0, 0, -0.2]).max(),
        "deepest": deepest,
        "time": touching * found.time_step,
    }


def poured(engine: str, seed: int, out: str) -> dict[str, float]:
    """Packing fraction and height of the centre of mass of 20 worms, after the pour and after a shake."""
    phases = [
        {"type": "deposit", "per_layer": 4},
        {"type": "relax", "duration_s": 0.2},
        {"type": "shake", "duration_s": 0.5, "frequency_hz": 30, "peak_acceleration_g": 2},
        {"type": "relax", "duration_s": 0.2},
    ]
    changes = {
        "engine": engine,
        "seed": seed,
        "count": 20,
        "particle": {**WORM, "poured_bend_deg": 200},
        "container.radius_m": 0.012,
        "contact": ELASTIC | {"restitution": 0.4},
        "fidelity": {"base": "draft", "stiffness_N_per_m": 10},
        "phases": phases,
        "recording": {"series_interval_s": 0.01, "frame_interval_s": 0.1, "checkpoint_interval_s": 0.2},
    }
    run_scene(small(changes), Path(out), command="")
    series = Run(Path(out)).series
    found = {}
    for name, phase in (("poured", 1), ("shaken", 3)):
        last = np.flatnonzero(series["phase"] == phase)[-1]
        found[f"{name} fraction"] = float(series["packing_fraction"][last])
        found[f"{name} height"] = float(series["com_height_m"][last])
        found[f"{name} unbalanced"] = float(series["unbalanced_force"][last])
    return found
