"""Cases that are hard on the engine: violent, degenerate or broken on purpose; in the worker process, like `cases.py`.

Each gives plain numbers for a check, or the text of the error that it ended in. SI throughout.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import cases
import h5py
import numpy as np
from scipy.spatial.transform import Rotation

from dem.engine import Engine
from dem.errors import InputError, RunError
from dem.library import load_yade
from dem.progress import Progress
from dem.recorder import Recorder
from dem.run import _build_engine, _build_recorder, run_scene
from dem.scene import Scene
from dem.timestep import stable_step, time_step

TILTED = Rotation.from_rotvec([0.4, 0.2, -0.7])


def whole(data: dict[str, Any], out: str) -> dict[str, Any]:
    """A whole run: how it ended, its series, and how deep the contacts are at its end."""
    try:
        scene = cases.load(data)
        run_scene(scene, Path(out), command="test", progress=False)
    except (InputError, RunError) as error:
        return {"error": type(error).__name__, "text": str(error)}
    with h5py.File(Path(out) / "series.h5") as file:
        series = {name: dataset[()] for name, dataset in file.items()}
    # YADE still has the simulation of the run that has just ended.
    return {
        "error": None,
        "series": series,
        "deepest": deepest() / scene.sphere_diameter,
        "diameter": scene.sphere_diameter,
        "torque_limit": scene.torque_limit,
        "weight": scene.count * scene.smarticle.boxes.mass * scene.gravity_m_per_s2,
        "height": scene.cylinder.height,
    }


def deepest() -> float:
    """Depth of the deepest contact [m]."""
    contacts = (i for i in load_yade().omega.interactions if i.isReal and type(i.phys).__name__ == "ViscElPhys")
    return max((i.geom.penetrationDepth for i in contacts), default=0.0)


def watched(data: dict[str, Any], out: str) -> tuple[Scene, Engine, Recorder]:
    """Engine and recorder, watchdog included, as a run builds them."""
    scene = cases.load(data)
    engine = _build_engine(scene, time_step(scene))
    return scene, engine, _build_recorder(scene, engine, Path(out), Progress(Path(out), scene.count, show=False))


def look(engine: Engine, recorder: Recorder) -> str | None:
    """What the next look of the recorder says."""
    try:
        recorder.record(engine, 0)
    except RunError as error:
        return str(error)
    return None


def energy(engine: Engine) -> float:
    """Kinetic, potential, and that of the springs of all contacts [J]."""
    state = engine.state()
    total = state.kinetic_energy + state.potential_energy(engine.gravity, 0.0)
    for contact in engine._omega.interactions:
        if contact.isReal and type(contact.phys).__name__ == "ViscElPhys":
            phys, depth = contact.phys, max(0.0, contact.geom.penetrationDepth)
            total += phys.kn * depth**2 / 2 + phys.shearForce.squaredNorm() / (2 * phys.ks)
    return float(total)


def drop(data: dict[str, Any], out: str, *, speed: float, articulated: bool, time: float) -> dict[str, Any]:
    """One smarticle is thrown onto the floor."""
    scene, engine, recorder = watched(data, out)
    cases.add(engine, (0, 0, 0.02), TILTED)
    cases.push(engine, 0, velocity=(0, 0, -speed))
    if articulated:
        engine.articulate()
        held = engine.state().angles
    said = look(engine, recorder)
    energies, lows, gaps = [energy(engine)], [], [0.0]
    interval = scene.fidelity.control_interval_s
    for _ in range(round(time / interval)):
        if articulated:
            engine.actuate(held, interval)
        engine.advance(round(interval / engine.time_step))
        energies.append(energy(engine))
        lows.append(engine.state().positions[0, 2])
        gaps.append(engine.joint_gaps().max())
    state = engine.state()
    return {
        "said": said,
        "energies": np.array(energies),
        "lowest": min(lows),
        "gap": max(gaps) / scene.sphere_diameter,
        "last_gap": gaps[-1] / scene.sphere_diameter,
        "rest": float(np.linalg.norm(state.link_velocities, axis=-1).max()),
        "z": state.positions[0, 2],
        "radius": scene.particle.radius,
        "depth": speed * math.sqrt(scene.smarticle.boxes.mass / scene.fidelity.stiffness_N_per_m),
        "work": 0.0 if engine.motors is None else float(engine.motors.work.sum()),
    }


def overlap(data: dict[str, Any], out: str, *, offset: float, time: float) -> dict[str, Any]:
    """Two smarticles in nearly the same place, or with `offset` 0 [d] in the very same, and what comes of it."""
    scene, engine, recorder = watched(data, out)
    d = scene.sphere_diameter
    cases.add(engine, (0, 0, 0.03), TILTED)
    cases.add(engine, (0, 0, 0.03 + offset * d), TILTED)
    said, energies = [], []
    try:
        engine.advance(1)
        energies.append(energy(engine))
        for _ in range(round(time / 1e-3)):
            engine.advance(round(1e-3 / engine.time_step))
            said.append(look(engine, recorder))
            energies.append(energy(engine))
    except RunError as error:
        said.append(str(error))
    first = next((text for text in said if text), None)
    if first is not None:
        return {"said": first}
    spheres = engine.state().spheres(scene.particle)
    apart = np.linalg.norm(spheres[0][:, None] - spheres[1][None], axis=-1).min()
    return {"said": None, "energies": np.array(energies), "apart": apart / d}


def spoil(data: dict[str, Any], out: str, *, what: str, steps: int, articulated: bool) -> dict[str, Any]:
    """Three smarticles at rest on the floor; then the second one is spoilt, and the next look says so, or not."""
    scene, engine, recorder = watched(data, out)
    lowest = scene.particle.centres[:, 2].min() - scene.particle.radius
    # A few diameters apart, so that none falls on another.
    for k in range(3):
        cases.add(engine, (0, 0, -lowest + 1e-5 + 3 * k * scene.particle.radius))
    engine.advance(10)
    if articulated:
        engine.articulate()
    before = look(engine, recorder)
    links = len(engine._assembly.bodies) // 3
    body = engine._omega.bodies[engine._assembly.bodies[2 * links - 1]].state
    vector, where = engine._yade.vector, body.pos
    if what == "velocity":
        body.vel = vector(0, math.nan, 0)
    elif what == "position":
        body.pos = vector(where[0], where[1], math.nan)
    elif what == "spin":
        body.angVel = body.angMom = vector(math.nan, 0, 0)
    elif what == "over the wall":
        body.pos = vector(where[0], where[1], engine.cylinder.height + scene.particle.reach)
        body.vel = vector(0, 0, 0.1)
    elif what == "through the wall":
        body.pos = vector(engine.cylinder.radius + scene.particle.reach, where[1], where[2])
    elif what == "under the floor":
        body.pos = vector(where[0], where[1], -scene.particle.reach)
    elif what == "hinge":
        body.pos = vector(where[0], where[1], where[2] + 0.5 * scene.sphere_diameter)
    else:
        assert what == "speed"
        body.vel = vector(0, 0, 1e3)
    try:
        engine.advance(steps)
    except RunError as error:
        return {"before": before, "said": str(error)}
    return {"before": before, "said": look(engine, recorder), "height": engine.cylinder.height}


def step_of(data: dict[str, Any], *, share: float) -> dict[str, Any]:
    """The time step of a scene that asks for a share of the stable one, or the refusal."""
    scene = cases.load(data)
    stable = stable_step(scene)
    asked = share * stable
    fidelity = scene.fidelity.model_copy(update={"time_step_s": asked})
    try:
        return {"stable": stable, "asked": asked, "dt": time_step(scene.model_copy(update={"fidelity": fidelity}))}
    except InputError as error:
        return {"stable": stable, "asked": asked, "text": str(error)}


def oscillate(data: dict[str, Any], out: str, *, settle: float, seconds: float) -> dict[str, Any]:
    """Few smarticles on the floor of a container, their barbs swinging at 6 rad/s; energy and gaps as time goes."""
    scene, engine, recorder = watched(data, out)
    lowest = scene.particle.centres[:, 2].min() - scene.particle.radius
    for k in range(scene.count):
        turned = Rotation.from_euler("zx", [1.1 * k, 0.2 * k])
        cases.add(engine, (0, 0, 3 * scene.particle.reach * (k + 0.5) / 2 - lowest), turned)
    engine.advance(round(settle / engine.time_step))
    engine.articulate()
    interval, centre = scene.fidelity.control_interval_s, np.radians(scene.smarticle.angles_deg)
    rows = []
    for n in range(1, round(seconds / interval) + 1):
        swing = math.radians(5) * math.sin(2 * math.pi * 8 * n * interval)
        engine.actuate(np.tile(centre + swing, (scene.count, 1)), interval)
        engine.advance(round(interval / engine.time_step))
        if n % 20 == 0:
            state = engine.state()
            height = state.potential_energy(engine.gravity, 0.0)
            rows.append((n * interval, state.kinetic_energy, height, engine.joint_gaps().max()))
        if n % 500 == 0 and (text := look(engine, recorder)):
            return {"said": text}
    time, kinetic, height, gap = np.array(rows).T
    tips = scene.smarticle.boxes.mass * (math.radians(5) * 2 * math.pi * 8 * scene.smarticle.boxes.barb_length) ** 2
    return {
        "said": None,
        "time": time,
        "kinetic": kinetic,
        "height": height,
        "gap": gap / scene.sphere_diameter,
        "scale": scene.count * tips / 2,
        "weight_drop": scene.count * scene.smarticle.boxes.mass * engine.gravity * scene.particle.reach,
    }


def narrowest(data: dict[str, Any], *, margin: float) -> dict[str, Any]:
    """The same scene in a container that is by `margin` [1] wider than the smallest one that is accepted."""
    scene = cases.load(data)
    radius = scene.particle.reach * (1 + margin)
    container = {**data.get("container", {}), "radius_m": radius}
    try:
        cases.load(data | {"container": {**container, "radius_m": scene.particle.reach * 0.999}})
    except InputError as error:
        refusal = str(error)
    return {"data": data | {"container": container}, "refusal": refusal, "reach": scene.particle.reach}
