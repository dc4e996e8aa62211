"""Hooks and the container's removal: small simulations with a known answer; see `cases.py`."""

from typing import Any

import cases
import numpy as np
from scipy.spatial.transform import Rotation

from dem.engine.yade.engine import YadeEngine
from dem.scene.scene import Scene
from validation.bench import add, scene_of

HANGING = Rotation.from_euler("x", -90, degrees=True)  # turns the mouth downwards


def build(scene: Scene) -> YadeEngine:
    hooks = None if scene.hooks is None else scene.hooks.crosses
    return cases.build(scene, cylinder=scene.cylinder, hooks=hooks)


def damped(engine: YadeEngine, damping: float) -> None:
    """Cundall's damping, to bring things to rest; it is no part of the model."""
    engine._omega.engines[-1].damping = damping


def mean_hook_forces(engine: YadeEngine, steps: int) -> np.ndarray:
    """(2, 3) mean over steps, lower and upper hook."""
    before = engine.boundaries.hook_sums
    engine.advance(steps)
    return (engine.boundaries.hook_sums - before) / steps


def energies(engine: YadeEngine) -> dict[str, float]:
    state, elastic = engine.state(), 0.0
    for contact in engine._omega.interactions:
        if contact.isReal:
            phys, depth = contact.phys, max(0.0, contact.geom.penetrationDepth)
            elastic += phys.kn * depth**2 / 2 + phys.shearForce.squaredNorm() / (2 * phys.ks)
    return {"kinetic": state.kinetic_energy, "height": state.potential_energy(engine.gravity, 0.0), "elastic": elastic}


def hang(data: dict[str, Any], *, settle: float, pull: float) -> dict[str, Any]:
    """A U hung over a bar of the upper hook; then the hook is raised with it."""
    scene = scene_of(data)
    engine = build(scene)
    cross = scene.hooks.crosses[1]
    particle = scene.body
    middle = HANGING.apply(particle.centres[particle.links == 1])
    top = cross.height + cross.side / 2 + particle.radius
    # Off the axis, clear of the other bar, its middle link across this one.
    add(engine, (0, 0.3 * cross.length, top - middle[:, 2].max() + 1e-5), HANGING)
    damped(engine, 0.3)
    engine.advance(round(settle / engine.time_step))
    rest = mean_hook_forces(engine, 200)
    speed = float(np.linalg.norm(engine.state().velocities))
    start = engine.boundaries.upper_height
    height = engine.state().positions[0, 2]
    engine.boundaries.raise_upper(scene.smarticle.middle_length_m)
    engine.advance(round(pull / engine.time_step))
    moving = mean_hook_forces(engine, 200)
    return {
        "rest": rest,
        "moving": moving,
        "speed": speed,
        "raised": engine.boundaries.upper_height - start,
        "carried": engine.state().positions[0, 2] - height,
        "expected": scene.smarticle.middle_length_m * round(pull / engine.time_step) * engine.time_step
        + scene.smarticle.middle_length_m * 200 * engine.time_step,
        "weight": particle.boxes.mass * scene.gravity_m_per_s2,
    }


def tap_and_sweep(data: dict[str, Any], *, index: int) -> dict[str, Any]:
    """Heights of the floor in every step of a phase, without bodies, and of the hooks at its end."""
    scene = scene_of(data)
    engine = cases.build(scene, cylinder=scene.cylinder, shaken=True)
    stage, heights = scene.phases[index].begin(scene, index), [0.0]
    while wait := stage.proceed(engine):
        for _ in range(max(1, round(wait / engine.time_step))):
            engine.advance(1)
            heights.append(engine.boundaries.floor)
    return {"heights": np.array(heights), "time_step": engine.time_step}


def lift(data: dict[str, Any], places: list[list[float]]) -> dict[str, float]:
    """Bodies at places, unturned, in a wall that is lifted until it is removed: its lower edge then, and their top."""
    scene = scene_of(data)
    engine = cases.build(scene, cylinder=scene.cylinder)
    for place in places:
        add(engine, place, Rotation.identity())
    stage, bottom, top = scene.phases[1].begin(scene, 1), 0.0, 0.0
    while (wait := stage.proceed(engine)) and engine.boundaries.walled:
        engine.advance(round(wait / engine.time_step))
        bottom = engine.boundaries.wall_bottom
        spheres = [body for body in engine._omega.bodies if type(body.shape).__name__ == "Sphere"]
        top = max(body.state.pos[2] + body.shape.radius for body in spheres)
    return {"bottom": bottom, "top": top, "walled": engine.boundaries.walled}


def remove(data: dict[str, Any], *, count: int, settle: float, watch: float) -> dict[str, Any]:
    """A pile at rest whose wall goes away at once: contacts and energies before, right after, and while it spreads."""
    scene = scene_of(data)
    engine = build(scene)
    cases.pour(engine, scene, count, radius=engine.cylinder.inner_radius)
    damped(engine, 0.3)
    engine.advance(round(settle / engine.time_step))
    damped(engine, 0.0)
    wall = set(engine.boundaries.container[:-1])

    def with_wall() -> int:
        return sum(1 for i in engine._omega.interactions if {i.id1, i.id2} & wall)

    contacts, before, state = with_wall(), energies(engine), engine.state()
    engine.boundaries.remove_wall()
    after, same = energies(engine), engine.state()
    stale = with_wall()
    totals = [sum(after.values())]
    outside = []
    for _ in range(round(watch / engine.time_step / 20)):
        engine.advance(20)
        totals.append(sum(energies(engine).values()))
        outside.append(np.hypot(*engine.state().positions[:, :2].T).max())
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
