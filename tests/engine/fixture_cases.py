"""Hooks and the container's removal: small simulations whose answer is known, run as those of `cases.py` are."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import cases
import numpy as np
from cases import pour
from scipy.spatial.transform import Rotation

from dem.engine.effect import EffectName
from dem.engine.yade.engine import YadeEngine
from dem.errors import RunError
from dem.record.progress import ProgressWriter
from dem.run.build import build_recorder
from dem.run.sampler import Sampler
from dem.scene.scene import Scene
from validation.bench import add, advance_watched, scene_of

HANGING = Rotation.from_euler("x", -90, degrees=True)  # turns the mouth downwards


def build(scene: Scene, *, radius: float | None = None) -> YadeEngine:
    cylinder = scene.cylinder
    if radius is not None:
        cylinder = type(cylinder)(radius=radius, height=cylinder.height, facets=cylinder.facets)
    hooks = None if scene.hooks is None else scene.hooks.crosses
    shaken = any(phase.type == "shake" for phase in scene.phases)
    return cases.build(scene, cylinder=cylinder, shaken=shaken, hooks=hooks)


def damped(engine: YadeEngine, damping: float) -> None:
    """Cundall's damping, to bring things to rest; it is no part of the model."""
    engine._omega.engines[-1].damping = damping


def mean_hook_forces(engine: YadeEngine, steps: int) -> np.ndarray:
    """(2, 3) mean over steps, lower and upper hook."""
    before = engine.fixtures.hook_sums
    engine.advance(steps)
    return (engine.fixtures.hook_sums - before) / steps


def elastic(engine: YadeEngine) -> float:
    """Energy in the springs of all contacts [J]."""
    total = 0.0
    for contact in engine._omega.interactions:
        if contact.isReal:
            phys = contact.phys
            depth = max(0.0, contact.geom.penetrationDepth)
            total += phys.kn * depth**2 / 2 + phys.shearForce.squaredNorm() / (2 * phys.ks)
    return total


def energies(engine: YadeEngine) -> dict[str, float]:
    state = engine.state()
    return {
        "kinetic": state.kinetic_energy,
        "height": state.potential_energy(engine.gravity, 0.0),
        "elastic": elastic(engine),
    }


def hang(data: dict[str, Any], *, settle: float, pull: float) -> dict[str, Any]:
    """A U hung over a bar of the upper hook; then the hook is raised with it."""
    scene = scene_of(data)
    engine = build(scene)
    cross = scene.hooks.crosses[1]
    particle = scene.particle
    middle = HANGING.apply(particle.centres[particle.links == 1])
    top = cross.height + cross.side / 2 + particle.radius
    # Off the axis, clear of the other bar, its middle link across this one.
    add(engine, (0, 0.3 * cross.length, top - middle[:, 2].max() + 1e-5), HANGING)
    damped(engine, 0.3)
    engine.advance(round(settle / engine.time_step))
    rest = mean_hook_forces(engine, 200)
    speed = float(np.linalg.norm(engine.state().velocities))
    start = engine.fixtures.upper_height
    height = engine.state().positions[0, 2]
    engine.fixtures.raise_upper(scene.smarticle.middle_length_m)
    engine.advance(round(pull / engine.time_step))
    moving = mean_hook_forces(engine, 200)
    return {
        "rest": rest,
        "moving": moving,
        "speed": speed,
        "raised": engine.fixtures.upper_height - start,
        "carried": engine.state().positions[0, 2] - height,
        "expected": scene.smarticle.middle_length_m * round(pull / engine.time_step) * engine.time_step
        + scene.smarticle.middle_length_m * 200 * engine.time_step,
        "weight": particle.boxes.mass * scene.gravity_m_per_s2,
    }


def bracket(data: dict[str, Any], *, limit: float) -> dict[str, Any]:
    """A U round both hooks, one barb below the lower and one above the upper, which is raised until a contact is deep.

    Args:
        limit: overlap at which to stop [m].
    """
    scene = scene_of(data)
    engine = build(scene)
    lower, upper = scene.hooks.crosses
    # The middle link stands at the end of two bars, which the barbs lie along.
    standing = Rotation.from_euler("yz", [-90, 90], degrees=True)
    middle = standing.apply(engine.particle.centres[engine.particle.links == 1])[:, 0].mean()
    beside = upper.length / 2 + engine.particle.radius + 1e-4
    add(engine, (beside - middle, 0, (lower.height + upper.height) / 2), standing)
    before = engine.overlaps(limit)
    engine.fixtures.raise_upper(0.05)
    strain, watchdog = before, build_recorder(scene, Path(), ProgressWriter(Path(), 1, show=False)).watchdog
    while not strain.deep.any() and engine.time < 1:
        engine.advance(20)
        strain = engine.overlaps(limit)
    try:
        watchdog.check_depths(strain, time=engine.time)
        said = ""
    except RunError as error:
        said = str(error)
    return {
        "before": before.held,
        "held": [(held.smarticle, held.between, held.apart) for held in strain.held],
        "raised": engine.fixtures.upper_height - upper.height,
        "said": said,
    }


def _pour(engine: YadeEngine, scene: Scene, count: int, settle: float) -> None:
    """A small pile, damped to rest."""
    hooks = [cross.obstacles(2 * scene.particle.radius) for cross in (scene.hooks.crosses if scene.hooks else ())]
    pour(engine, scene, count, np.concatenate([np.empty((0, 3)), *hooks]), engine.cylinder.inner_radius)
    damped(engine, 0.3)
    engine.advance(round(settle / engine.time_step))
    damped(engine, 0.0)


def rest(data: dict[str, Any], *, count: int, settle: float) -> dict[str, Any]:
    """Forces on everything that is fixed, under a pile at rest in a container with hooks."""
    scene = scene_of(data)
    engine = build(scene)
    _pour(engine, scene, count, settle)
    damped(engine, 0.3)
    floor, wall = [], []
    body = engine._omega.forces.f

    def look() -> None:
        *sides, bottom = engine.fixtures.container
        floor.append(np.array(body(bottom)))
        wall.append(np.sum([np.array(body(side)) for side in sides], axis=0))

    before, steps = engine.fixtures.hook_sums, 50
    advance_watched(engine, steps, look)
    return {
        "floor": np.mean(floor, axis=0),
        "wall": np.mean(wall, axis=0),
        "hooks": (engine.fixtures.hook_sums - before) / steps,
        "weight": count * scene.smarticle.boxes.mass * scene.gravity_m_per_s2,
        "speed": float(np.linalg.norm(engine.state().velocities, axis=1).max()),
    }


def remove(data: dict[str, Any], *, count: int, settle: float, watch: float) -> dict[str, Any]:
    """A pile at rest whose wall goes away at once: what is there before, right after, and while it spreads."""
    scene = scene_of(data)
    engine = build(scene)
    _pour(engine, scene, count, settle)
    wall = set(engine.fixtures.container[:-1])

    def with_wall() -> int:
        return sum(1 for i in engine._omega.interactions if {i.id1, i.id2} & wall)

    contacts, before, state = with_wall(), energies(engine), engine.state()
    engine.fixtures.remove_wall()
    after, same = energies(engine), engine.state()
    stale = with_wall()
    totals = [sum(after.values())]
    outside = []

    def look() -> None:
        totals.append(sum(energies(engine).values()))
        outside.append(np.hypot(*engine.state().positions[:, :2].T).max())

    for _ in range(round(watch / engine.time_step / 20)):
        engine.advance(20)
        look()
    return {
        "contacts": contacts,
        "stale": stale,
        "later": with_wall(),
        "before": before,
        "after": after,
        "moved": float(np.abs(same.link_positions - state.link_positions).max()),
        "totals": np.array(totals),
        "outside": max(outside),
        "lowest": float(engine.state().positions[:, 2].min()),
        "bodies": sum(1 for body in wall if engine._omega.bodies[body] is not None),
    }


def rub(data: dict[str, Any], *, speed: float, duration: float) -> dict[str, Any]:
    """A smarticle that lies against a flat of a wall, held by a gravity that is turned, while the wall is lifted."""
    scene = scene_of(data)
    engine = build(scene, radius=0.5)
    particle, half = scene.particle, math.pi / engine.cylinder.facets
    outwards = np.array([math.cos(half), math.sin(half), 0.0])
    engine._omega.engines[-1].gravity = engine._yade.vector(*(engine.gravity * outwards))
    # The plane of the smarticle along the flat, its mouth upwards.
    axes = np.stack([np.cross([0, 0, 1.0], outwards), [0, 0, 1.0], outwards], axis=1)
    flat = engine.cylinder.inner_radius - particle.radius
    add(engine, flat * outwards + [0, 0, 0.1], Rotation.from_matrix(axes))
    damped(engine, 0.3)
    engine._assembly._states[0].blockedDOFs = "z"
    engine.advance(round(0.1 / engine.time_step))
    engine._assembly._states[0].blockedDOFs = ""
    damped(engine, 0.0)
    engine.fixtures.lift_wall(speed)
    bottom = engine.fixtures.wall_bottom
    rows = []
    for _ in range(40):
        engine.advance(max(1, round(duration / 40 / engine.time_step)))
        rows.append((engine.time, engine.state().velocities[0, 2], engine.container_force()[2]))
    times, speeds, forces = np.array(rows).T
    return {
        "time": times,
        "speed": speeds,
        "force": forces,
        "lifted": engine.fixtures.wall_bottom - bottom,
        "expected_lift": speed * 40 * max(1, round(duration / 40 / engine.time_step)) * engine.time_step,
        "weight": particle.boxes.mass * engine.gravity,
    }


def inventory(data: dict[str, Any]) -> dict[str, Any]:
    """What an engine is made of before anything is poured."""
    scene = scene_of(data)
    engine = build(scene)
    names = [type(one).__name__ for one in engine._omega.engines]
    collider, loop = engine._omega.engines[1], engine._omega.engines[2]
    functors = [
        *collider.boundDispatcher.functors,
        *loop.geomDispatcher.functors,
        *loop.physDispatcher.functors,
        *loop.lawDispatcher.functors,
    ]
    return {
        "engines": names,
        "functors": sorted(type(functor).__name__ for functor in functors),
        "shapes": [type(body.shape).__name__ for body in engine._omega.bodies],
        "hooks": len(engine.fixtures.hooks),
        "sums": engine.fixtures.hook_sums.size,
        "columns": set(Sampler(1.0, {EffectName.HOOKS} if scene.hooks is not None else set()).described),
    }
