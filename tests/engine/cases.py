"""Small simulations with a known answer. They run in the worker process of `conftest.py`, never in pytest's own:

YADE keeps one scene per process, installs handlers, and must not meet PyVista's VTK. Each case builds its engine and
returns plain numbers and arrays; the tests compare them with the answer. SI throughout.
"""

import math
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import h5py
import meshio
import numpy as np
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses, place_layer
from dem.engine.demand import contact_law_of
from dem.engine.effect import Adds
from dem.engine.yade.engine import YadeEngine
from dem.engine.yade.library import yade_version
from dem.errors import InputError, RunError
from dem.plan.effects import decide
from dem.plan.outlook import plan
from dem.plan.steps import time_step
from dem.run.build import build_engine
from dem.run.recorder import Recorder
from dem.run.run import run_scene
from dem.run.sampler import Sampler
from dem.scene.scene import Scene
from dem.setting.container import Cylinder
from validation.access import YadeAccess, bodies_of
from validation.bench import advance_watched, body_rotations, scene_of


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


def vec(value: Any) -> np.ndarray:
    return np.array([value[0], value[1], value[2]])


def axes_of(body: Any) -> np.ndarray:
    """(3, 3) a body's principal axes in the laboratory frame."""
    return np.array(body.ori.toRotationMatrix()).reshape(3, 3)


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
    state, clumps = engine.state(), bodies_of(engine)
    spheres = [vec(engine._omega.bodies[body].state.pos) for body in sorted(engine._assembly.smarticle_of)]
    return {
        "asked": np.array([r.as_matrix() for r in rotations]),
        "asked_positions": positions,
        "start": body_rotations(start),
        "start_positions": start.positions,
        "rotations": body_rotations(state),
        "tensors": np.array([axes_of(clump) @ np.diag(vec(clump.inertia)) @ axes_of(clump).T for clump in clumps]),
        "masses": np.array([clump.mass for clump in clumps]),
        "spheres": np.array(spheres).reshape(count, -1, 3),
        "expected_spheres": state.spheres(scene.particle),
    }


def pour(
    engine: YadeEngine, scene: Scene, count: int, obstacles: np.ndarray | None = None, radius: float | None = None
) -> None:
    """A layer just above the floor, clear of the centres of spheres (n, 3) that exist already."""
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


def shake(data: dict[str, Any], *, periods: float, delay: int) -> dict[str, Any]:
    """Position of an empty container at every step, shaken after a delay of some steps."""
    scene = scene_of(data)
    engine = build(scene, shaken=True)
    phase = next(p for p in scene.phases if p.type == "shake")
    amplitude = phase.amplitude(scene.gravity_m_per_s2)

    def wall() -> float:
        return float(engine._omega.bodies[engine.boundaries.container[0]].state.pos[2])

    engine.advance(delay)
    begun, start, wall_start = engine.time, engine.boundaries.floor, wall()
    engine.boundaries.shake(amplitude=amplitude, frequency=phase.frequency_hz)
    floors: list[float] = []
    steps = math.ceil(periods / phase.frequency_hz / engine.time_step)
    advance_watched(engine, steps, lambda: floors.append(engine.boundaries.floor))
    return {
        "time": np.arange(1, steps + 1) * engine.time_step,
        "elapsed": engine.time - begun,
        "z": np.array(floors) - start,
        "dt": engine.time_step,
        "amplitude": amplitude,
        "wall_moved": wall() - wall_start,
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
        advance_watched(engine, every, lambda forces=forces: forces.append(YadeAccess().floor_force(engine)))
        means.append(np.mean(forces, axis=0))
        balance.append(sampler.sample(engine, engine.state(), 0)["container_force_N"])
    return {
        "steps": np.array(means),
        "balance": np.array(balance),
        "weight": count * scene.smarticle.boxes.mass * scene.gravity_m_per_s2,
    }


def run(data: dict[str, Any], out: str) -> dict[str, Any]:
    """A whole run; errors come back as text."""
    try:
        run_scene(scene_of(data), Path(out), command="test")
    except (InputError, RunError) as error:
        return {"error": type(error).__name__, "text": str(error)}
    return {"error": None, "text": ""}


def watched(data: dict[str, Any], out: str, each: Callable[[YadeEngine, int], None]) -> None:
    """A whole run; `each` gets engine and phase at every sample."""
    record = Recorder.record

    def record_and_note(recorder: Recorder, engine: YadeEngine, phase: int) -> None:
        record(recorder, engine, phase)
        each(engine, phase)

    with patch.object(Recorder, "record", record_and_note):
        answer = run(data, out)
    assert answer["error"] is None, answer


def noted(data: dict[str, Any], out: str) -> list[dict[str, Any]]:
    """Run a scene; the engine's own numbers at every sample."""
    notes: list[dict[str, Any]] = []

    def note(engine: YadeEngine, phase: int) -> None:
        notes.append(
            {
                "time": engine.time,
                "phase": phase,
                "floor": engine.boundaries.floor,
                "state": engine.state(),
                "contacts": engine.neighbours(),
                "torques": engine.motors.readings.torques.copy() if engine.motors.articulated else None,
            }
        )

    watched(data, out, note)
    return notes


def thrown(data: dict[str, Any], *, count: int, speed: float, steps: int, every: int) -> dict[str, Any]:
    """A layer of random poses thrown at the floor of a container that is shaken: vertices, touches at every check."""
    scene = scene_of(data)
    engine = build_engine(scene, time_step(scene))
    rng = np.random.default_rng(scene.seed)
    poses = place_layer(
        scene.particle, count=count, radius=0.012, bottom=3e-3, height=5e-3, obstacles=np.empty((0, 3)), rng=rng
    )
    engine.add(poses, speed=speed)
    vertices, touches = [np.array(engine.state().vertices)], []
    engine.boundaries.shake(amplitude=5e-4, frequency=30.0)
    for _ in range(steps // every):
        engine.advance(every)
        vertices.append(np.array(engine.state().vertices))
        touches.append(int(engine.touches().sum()))
    return {
        "vertices": np.array(vertices),
        "touches": touches,
        "diameter": scene.sphere_diameter,
        "floor": engine.boundaries.floor,
        "time": engine.time,
        "impulse": engine.impulse,
    }


# What every run directory holds, whatever the scene calls for.
OWN_FILES = {"scene.yaml", "run.json", "log.txt", "done.json", ".lock"}


def inventory(data: dict[str, Any], out: str) -> dict[str, Any]:
    """Run a scene; what it was declared to be made of, and what was found at every sample and on the disk."""
    scene = scene_of(data)
    declared = Adds.together(decision.adds for decision in decide(scene))
    found: dict[str, set[Any]] = defaultdict(set)
    watched(data, out, lambda engine, _: _look(engine, found))
    folder = Path(out)
    found["files"] = {path.name for path in folder.iterdir()} - OWN_FILES
    with h5py.File(folder / "series.h5") as file:
        found["series"] = set(file)
    for path in (folder / "frames").iterdir():
        found["arrays"] |= set(meshio.read(path).cell_data)
    kinds = ("engines", "functors", "materials", "shapes", "series", "arrays", "files")
    return {
        "declared": {kind: set(getattr(declared, kind)) for kind in kinds if kind != "engines"},
        "found": {kind: found[kind] for kind in kinds if kind != "engines"},
        "planned": set(plan(scene).engines),
        "engines": found["engines"],
        "contacts": found["contacts"],
        "caps": found["caps"],
    }


def _look(engine: YadeEngine, found: dict[str, set[Any]]) -> None:
    omega = engine._omega
    found["engines"].add(tuple(type(one).__name__ for one in omega.engines))
    _, collider, loop, *_ = omega.engines
    for functors in (
        collider.boundDispatcher.functors,
        loop.geomDispatcher.functors,
        loop.physDispatcher.functors,
        loop.lawDispatcher.functors,
    ):
        found["functors"] |= {type(functor).__name__ for functor in functors}
    found["materials"] |= {material.label for material in omega.materials}
    found["shapes"] |= {type(body.shape).__name__ for body in omega.bodies}
    for contact in omega.interactions:
        if contact.isReal:
            phys = contact.phys
            found["contacts"].add((type(contact.geom).__name__, type(phys).__name__))
            if type(phys).__name__ == "CohFrictPhys":
                found["caps"].add(phys.maxTwistPl)


def ledger_after_reload(data: dict[str, Any], out: str) -> dict[str, Any]:
    """Energies of a pile right before and right after the simulation is saved and loaded."""
    scene = scene_of(data)
    engine = build_engine(scene, time_step(scene))
    pour(engine, scene, scene.count)
    engine.advance(2500)
    before, folder = engine.ledger.elastic(), Path(out)
    engine.load(engine.save(folder), folder)
    after = engine.ledger.elastic()
    engine.boundaries.remove_wall()
    return {"before": before, "after": after, "dissipated": engine.ledger.dissipated}
