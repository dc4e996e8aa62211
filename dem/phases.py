"""The stages of a run: pour, rest, shake. Each drives the engine through a `Clock` and ends by a stated criterion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from dem.engine import Engine
from dem.errors import RunError
from dem.parts import Deposit, Relax, Settle, Shake
from dem.placement import place_layer
from dem.scene import Scene, derive_seed

CHECK_INTERVAL = 0.01  # s between looks at whether a layer has come down or a pile has settled
LAYER_TIMEOUT = 2.0  # s; the fall of a layer takes less than 0.1 s


@dataclass(frozen=True)
class Clock:
    """What a phase may do with time.

    Args:
        engine: the simulation.
        advance: lets time pass [s], with everything recorded that is due meanwhile.
    """

    engine: Engine
    advance: Callable[[float], None]


@singledispatch
def perform(phase: object, scene: Scene, clock: Clock) -> None:
    """Run one phase to its end.

    Raises:
        RunError: it did not end as it should; the message says by how much.
    """
    msg = f"no such phase: {phase!r}"
    raise TypeError(msg)


@perform.register
def _(phase: Relax, scene: Scene, clock: Clock) -> None:
    clock.advance(phase.duration_s)


@perform.register
def _(phase: Shake, scene: Scene, clock: Clock) -> None:
    amplitude = shake_amplitude(phase, scene.gravity_m_per_s2)
    clock.engine.shake(amplitude=amplitude, frequency=phase.frequency_hz)
    clock.advance(phase.duration_s)
    clock.engine.stop_container()


@perform.register
def _(phase: Deposit, scene: Scene, clock: Clock) -> None:
    rng = np.random.default_rng(derive_seed(scene.seed, "deposit"))
    left = scene.count
    while left:
        size = min(phase.per_layer, left)
        _pour_layer(phase, scene, clock.engine, size, rng)
        left -= size
        _await_landing(phase, clock, size)
    _await_settling(phase.settle, clock)


def shake_amplitude(phase: Shake, gravity: float) -> float:
    """A = Γ g / (2πf)² [m]."""
    return phase.peak_acceleration_g * gravity / (2 * math.pi * phase.frequency_hz) ** 2


def container_height(scene: Scene) -> float:
    """Height of the wall [m]: given, or enough for the loosest pile plus a layer being poured.

    A loose random packing of thin bars has φ ≈ 2.4 d/L with L the length of all links (Gravish's φ_0 at l/w = 0, 0.7
    and 1.4, with d the mean-width diameter); half of that is taken as the loosest.
    """
    given = scene.container.height_m
    if given is not None:
        return given
    boxes = scene.smarticle.boxes
    loosest = 1.2 * scene.sphere_diameter / float(boxes.lengths.sum())
    pile = scene.count * boxes.volume / (math.pi * scene.container.radius_m**2 * loosest)
    return pile + 4 * scene.particle.reach + 6 * boxes.middle_length


def _pour_layer(phase: Deposit, scene: Scene, engine: Engine, size: int, rng: np.random.Generator) -> None:
    particle, state = scene.particle, engine.state()
    tops = state.points(particle.boxes.vertices)[..., 2].max(axis=1) if engine.count else np.zeros(0)
    top = tops.max(initial=engine.floor)
    near = tops > top - 2 * particle.radius
    obstacles = state.points(particle.centres)[near].reshape(-1, 3)
    height = phase.layer_height_w * scene.smarticle.middle_length_m
    poses = place_layer(
        particle,
        count=size,
        radius=scene.container.radius_m,
        bottom=top + particle.radius,
        height=height,
        obstacles=obstacles,
        rng=rng,
    )
    highest = poses.positions[:, 2].max() + particle.reach
    wall = container_height(scene)
    if highest > wall:
        msg = (
            f"{scene.count} smarticles do not fit: after {engine.count} the next layer would reach {highest:.3g} m, "
            f"above container.height_m = {wall:.3g} m; lower count or raise container.height_m"
        )
        raise RunError(msg)
    engine.add(poses)


def _await_landing(phase: Deposit, clock: Clock, size: int) -> None:
    waited = 0.0
    while waited < LAYER_TIMEOUT:
        clock.advance(CHECK_INTERVAL)
        waited += CHECK_INTERVAL
        falling = -clock.engine.state().velocities[-size:, 2]
        if falling.max() < phase.landed_speed_m_per_s and clock.engine.touches()[-size:].min() > 0:
            return
    msg = (
        f"a layer of {size} had not come down {LAYER_TIMEOUT:g} s after it was poured: fastest falls at "
        f"{falling.max():.3g} m/s, limit {phase.landed_speed_m_per_s:g} m/s (phases.0.landed_speed_m_per_s)"
    )
    raise RunError(msg)


def _await_settling(settle: Settle, clock: Clock) -> None:
    waited = 0.0
    while waited < settle.timeout_s:
        clock.advance(CHECK_INTERVAL)
        waited += CHECK_INTERVAL
        speed = float(np.linalg.norm(clock.engine.state().velocities, axis=1).max())
        unbalanced = clock.engine.unbalanced_force()
        if speed < settle.speed_m_per_s and unbalanced < settle.unbalanced_force:
            return
    msg = (
        f"the pile has not settled after {settle.timeout_s:g} s: speed {speed:.3g} m/s (limit "
        f"{settle.speed_m_per_s:g}), unbalanced force {unbalanced:.3g} (limit {settle.unbalanced_force:g}); "
        "raise phases.0.settle.timeout_s or its limits, or lower contact.restitution"
    )
    raise RunError(msg)
