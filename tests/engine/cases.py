"""Small simulations whose answer is known. They run in the worker process of `conftest.py`, never in pytest's own:

YADE keeps one scene per process, installs handlers, and must not meet PyVista's VTK. Each case builds its engine anew
and returns plain numbers and arrays; the tests compare them with the answer. SI throughout.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses, place_layer
from dem.engine.demand import contact_law_of
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.library import yade_version
from dem.engine.yade.stable_step import stable_time_step
from dem.errors import InputError, RunError
from dem.plan.steps import time_step
from dem.run.run import run_scene
from dem.run.sampler import Sampler
from dem.scene.scene import Scene
from dem.setting.container import Cylinder
from validation.access import YadeAccess
from validation.bench import add, advance_watched, body_rotations, scene_of


def build(
    scene: Scene, *, dt: float | None = None, radius: float | None = None, facets: int = 64, **instead: Any
) -> YadeEngine:
    """An engine of a scene, welded and at rest, or of what `instead` says."""
    made = {
        "particle": scene.particle,
        "cylinder": Cylinder(radius=radius or scene.container.radius_m, height=scene.cylinder.height, facets=facets),
        "law": contact_law_of(scene),
        "gravity": scene.gravity_m_per_s2,
        "time_step": dt or time_step(scene),
        "shaken": False,
    }
    return YadeEngine(**(made | instead))


def version() -> str:
    return yade_version()


def push(engine: YadeEngine, k: int, **motion: Any) -> None:
    """Give a welded smarticle a velocity and a spin."""
    YadeAccess().push(engine, k, **motion)


def poses(data: dict[str, Any], *, count: int, seed: int, steps: int) -> dict[str, Any]:
    """Tensors and sphere positions in the engine against the particle's, at random poses and after some steps."""
    scene = scene_of(data)
    engine = build(scene, gravity=0.0, radius=1.0)
    rng = np.random.default_rng(seed)
    rotations = tuple(Rotation.random(random_state=rng) for _ in range(count))
    positions = np.stack([0.06 * np.arange(count) - 0.5, np.zeros(count), np.full(count, 0.05)], 1)
    engine.add(Poses(positions, rotations))
    start = engine.state()
    for k in range(count):
        push(engine, k, spin=rng.normal(size=3) * 30)
    engine.advance(steps)
    state = engine.state()
    members = {k: [] for k in range(count)}
    for body, k in engine._assembly.smarticle_of.items():
        members[k].append(np.array(engine._omega.bodies[body].state.pos))
    tensors = []
    clumps = [engine._omega.bodies[body].state for body in engine._assembly.bodies]
    for clump in clumps:
        axes = np.array(clump.ori.toRotationMatrix()).reshape(3, 3)
        tensors.append(axes @ np.diag(np.array(clump.inertia)) @ axes.T)
    return {
        "asked": np.array([r.as_matrix() for r in rotations]),
        "asked_positions": positions,
        "start": body_rotations(start),
        "start_positions": start.positions,
        "rotations": body_rotations(state),
        "tensors": np.array(tensors),
        "masses": np.array([clump.mass for clump in clumps]),
        "spheres": np.array([members[k] for k in range(count)]),
        "expected_spheres": state.spheres(scene.particle),
    }


def pour(
    engine: YadeEngine, scene: Scene, count: int, obstacles: np.ndarray | None = None, radius: float | None = None
) -> None:
    """A layer just above the floor, clear of the centres of spheres (n, 3) that are there."""
    poses = place_layer(
        scene.particle,
        count=count,
        radius=scene.container.radius_m if radius is None else radius,
        bottom=1e-4,
        height=2e-2,
        obstacles=np.empty((0, 3)) if obstacles is None else obstacles,
        rng=np.random.default_rng(scene.seed),
    )
    engine.add(poses)


def pile(data: dict[str, Any], *, count: int, settle: float, watch: int) -> dict[str, Any]:
    scene = scene_of(data)
    engine = build(scene)
    pour(engine, scene, count)
    engine.advance(round(settle / engine.time_step))
    sampler = Sampler(scene.container.radius_m)
    sampler.sample(engine, engine.state(), 0)
    forces: list[np.ndarray] = []
    advance_watched(engine, watch, lambda: forces.append(engine.container_force()))
    state = engine.state()
    balance = sampler.sample(engine, state, 0)["container_force_N"]
    return {
        "forces": np.array(forces),
        "balance": balance,
        "weight": count * scene.smarticle.boxes.mass * scene.gravity_m_per_s2,
        "speed": np.linalg.norm(state.velocities, axis=1).max(),
        "unbalanced": engine.unbalanced_force(),
        "touches": engine.touches(),
        "contacts": engine.neighbours(),
    }


def _wall(engine: YadeEngine) -> float:
    """Height of the first facet of the wall."""
    return float(engine._omega.bodies[engine.boundaries.container[0]].state.pos[2])


def shake(data: dict[str, Any], *, periods: float, delay: int = 0, rest: int = 0, walls: bool = True) -> dict[str, Any]:
    """Position and velocity of an empty container at every step."""
    scene = scene_of(data)
    engine = build(scene, shaken=True)
    phase = next(p for p in scene.phases if p.type == "shake")
    amplitude = phase.amplitude(scene.gravity_m_per_s2)
    if delay:  # YADE takes a run of no steps for one without end
        engine.advance(delay)
    begun, start = engine.time, engine.boundaries.floor
    wall_start = _wall(engine)
    engine.boundaries.shake(amplitude=amplitude, frequency=phase.frequency_hz, walls=walls)
    rows: list[tuple[float, float]] = []
    steps = math.ceil(periods / phase.frequency_hz / engine.time_step)
    advance_watched(engine, steps, lambda: rows.append((engine.boundaries.floor, engine.boundaries.velocity)))
    floors, speeds = np.array(rows).T
    wall = _wall(engine)
    last, elapsed = engine.boundaries.floor, engine.time - begun
    engine.boundaries.stop()
    if rest:
        engine.advance(rest)
    return {
        "time": np.arange(1, steps + 1) * engine.time_step,
        "elapsed": elapsed,
        "z": floors - start,
        "v": speeds,
        "dt": engine.time_step,
        "amplitude": amplitude,
        "wall_moved": wall - wall_start,
        "crept": engine.boundaries.floor - last,
        "rest_velocity": engine.boundaries.velocity,
    }


def shaken_force(data: dict[str, Any], *, count: int, samples: int, every: int) -> dict[str, Any]:
    """The momentum balance against the contact force of every step, in a pile that is thrown about."""
    scene = scene_of(data)
    engine = build(scene, shaken=True)
    pour(engine, scene, count)
    engine.advance(round(0.15 / engine.time_step))
    phase = next(p for p in scene.phases if p.type == "shake")
    engine.boundaries.shake(amplitude=phase.amplitude(scene.gravity_m_per_s2), frequency=phase.frequency_hz)
    sampler = Sampler(scene.container.radius_m)
    sampler.sample(engine, engine.state(), 0)
    means, balance = [], []
    for _ in range(samples):
        forces: list[np.ndarray] = []
        advance_watched(engine, every, lambda forces=forces: forces.append(engine.container_force()))
        means.append(np.mean(forces, axis=0))
        balance.append(sampler.sample(engine, engine.state(), 0)["container_force_N"])
    return {
        "steps": np.array(means),
        "balance": np.array(balance),
        "weight": count * scene.smarticle.boxes.mass * scene.gravity_m_per_s2,
    }


def stack(
    data: dict[str, Any], *, layers: int, settle: float, watch: float, times_stable: float | None
) -> dict[str, Any]:
    """Smarticles lying flat on each other, let go from a slight height; largest speed after they settled."""
    scene = scene_of(data)
    dt = None
    if times_stable is not None:
        dt = times_stable * stable_time_step(scene.particle, contact_law_of(scene))
    engine = build(scene, dt=dt)
    particle = scene.particle
    thick = np.ptp(particle.centres[:, 2]) + 2 * particle.radius
    for k in range(layers):
        add(engine, (0, 0, (k + 0.5) * thick + (k + 1) * 2e-5))
    engine.advance(round(settle / engine.time_step))
    fastest = 0.0

    def look() -> None:
        nonlocal fastest
        fastest = max(fastest, float(np.linalg.norm(engine.state().velocities, axis=1).max()))

    advance_watched(engine, round(watch / engine.time_step), look)
    state = engine.state()
    return {"fastest": fastest, "z": state.positions[:, 2], "thick": thick, "dt": engine.time_step}


def run(data: dict[str, Any], out: str) -> dict[str, Any]:
    """A whole run; errors come back as text."""
    try:
        run_scene(scene_of(data), Path(out), command="test", progress=False)
    except (InputError, RunError) as error:
        return {"error": type(error).__name__, "text": str(error)}
    return {"error": None, "text": ""}
