"""The floor shaken without its wall: small simulations whose answer is known, run as those of `cases.py` are."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from cases import add, advance_watched, build
from fixture_cases import damped

from dem.engine.yade.engine import YadeEngine
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from validation.bench import scene_of


def last_shake(scene: Scene) -> tuple[float, float]:
    """Amplitude [m] and frequency [Hz] of a scene's last shaking."""
    phase = [phase for phase in scene.phases if phase.type == "shake"][-1]
    return phase.amplitude(scene.gravity_m_per_s2), phase.frequency_hz


def without_wall(engine: YadeEngine, scene: Scene) -> set[int]:
    """Shake with the wall for a part of a period, then take it away; its bodies' ids."""
    amplitude, frequency = last_shake(scene)
    engine.fixtures.shake(amplitude=amplitude, frequency=frequency)
    engine.advance(round(0.3 / frequency / engine.time_step))
    engine.fixtures.stop()
    wall = set(engine.fixtures.container[:-1])
    engine.fixtures.remove_wall()
    engine.advance(11)
    return wall


def floor_motion(data: dict[str, Any], *, periods: float, refine: int, rest: int) -> dict[str, Any]:
    """Position of the floor at every step, once the wall has shaken with it and is gone."""
    scene = scene_of(data)
    engine = build(scene, shaken=True, dt=time_step(scene) / refine)
    wall = without_wall(engine, scene)
    amplitude, frequency = last_shake(scene)
    start = engine.fixtures.floor
    engine.fixtures.shake(amplitude=amplitude, frequency=frequency)
    heights: list[float] = []
    steps = math.ceil(periods / frequency / engine.time_step)
    advance_watched(engine, steps, lambda: heights.append(engine.fixtures.floor))
    engine.fixtures.stop()
    end = engine.fixtures.floor
    engine.advance(rest)
    return {
        "time": np.arange(1, steps + 1) * engine.time_step,
        "z": np.array(heights) - start,
        "amplitude": amplitude,
        "dt": engine.time_step,
        "crept": engine.fixtures.floor - end,
        "start": start,
        "moved": len(engine.fixtures.bodies),
        "bodies": sum(1 for body in wall if engine._omega.bodies[body] is not None),
    }


def carried(data: dict[str, Any], *, periods: int) -> dict[str, Any]:
    """A smarticle that lies flat on the floor and moves with it: force on the floor and work at every step."""
    scene = scene_of(data)
    engine = build(scene, shaken=True)
    engine.account._works = True
    lowest = scene.particle.centres[:, 2].min() - scene.particle.radius
    add(engine, (0, 0, -lowest))
    damped(engine, 0.3)
    without_wall(engine, scene)
    engine.advance(round(0.1 / engine.time_step))
    damped(engine, 0.0)
    amplitude, frequency = last_shake(scene)
    mass, g = scene.smarticle.boxes.mass, engine.gravity

    def energy() -> float:
        state = engine.state()
        return float(state.kinetic_energy + mass * g * state.positions[0, 2])

    before, worked = energy(), engine.account.container_work
    engine.fixtures.shake(amplitude=amplitude, frequency=frequency)
    rows: list[tuple[float, float, float]] = []

    def look() -> None:
        rows.append((engine.container_force()[2], engine.account.container_work - worked, energy() - before))

    steps = round(periods / frequency / engine.time_step)
    advance_watched(engine, steps, look)
    force, work, gained = np.array(rows).T
    return {
        "time": np.arange(1, steps + 1) * engine.time_step,
        "force": force,
        "work": work,
        "gained": gained,
        "weight": mass * g,
        "amplitude": amplitude,
    }
