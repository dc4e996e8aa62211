"""The stages of a run: pour, rest, shake, actuate.

A stage is asked again and again when it wants to be asked next; in between, time passes and everything due is recorded.
All that it remembers is plain data, so that a run can be stopped between any two steps and go on as if it had not been.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from dem.actuation import Drive, drive
from dem.engine import Engine
from dem.errors import RunError
from dem.parts import Deposit, Relax, Settle, Shake
from dem.placement import place_layer
from dem.scene import Scene, derive_seed

CHECK_INTERVAL = 0.01  # s between looks at whether a layer has come down or a pile has settled
LAYER_TIMEOUT = 2.0  # s; the fall of a layer takes less than 0.1 s

Memory = dict[str, Any]


class Stage(Protocol):
    """One phase while it runs."""

    memory: Memory
    """All that the stage remembers: plain data, JSON-able without loss."""

    def proceed(self, engine: Engine) -> float:
        """Do what is due now.

        Returns:
            Time [s] after which to be asked again; 0: the phase is over.

        Raises:
            RunError: the phase did not end as it should; the message says by how much.
        """


def begin(scene: Scene, index: int) -> Stage:
    """The stage of a phase, at its beginning."""
    phase = scene.phases[index]
    if isinstance(phase, Deposit):
        return Pouring(phase, scene)
    if isinstance(phase, Shake):
        return Shaking(phase, scene.gravity_m_per_s2)
    if isinstance(phase, Relax):
        return Resting(phase)
    return Actuating(drive(scene, index), scene.fidelity.control_interval_s)


class Resting:
    """Nothing acts but gravity."""

    def __init__(self, phase: Relax) -> None:
        self._phase = phase
        self.memory: Memory = {"begun": False}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        if self.memory["begun"]:
            return 0.0
        self.memory["begun"] = True
        engine.weld()
        return self._phase.duration_s


class Shaking:
    """The container moves."""

    def __init__(self, phase: Shake, gravity: float) -> None:
        self._phase = phase
        self._amplitude = shake_amplitude(phase, gravity)
        self.memory: Memory = {"begun": False}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        if self.memory["begun"]:
            engine.stop_container()
            return 0.0
        self.memory["begun"] = True
        engine.weld()
        engine.shake(amplitude=self._amplitude, frequency=self._phase.frequency_hz)
        return self._phase.duration_s


class Actuating:
    """The motors follow their schedule, one look per control period; smarticles are articulated meanwhile."""

    def __init__(self, schedule: Drive, interval: float) -> None:
        self._drive = schedule
        self._interval = interval
        self._looks = math.ceil(schedule.duration / interval - 1e-9)
        self.memory: Memory = {"look": 0}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        look: int = self.memory["look"]
        if look == 0:
            engine.articulate()
        # The last look only takes note of the work since the one before.
        time = min((look + 1) * self._interval, self._drive.duration)
        engine.actuate(self._drive.targets(time), self._interval)
        self.memory["look"] = look + 1
        return self._interval if look < self._looks else 0.0


class Pouring:
    """Layers of random poses just above the pile, the next when the last has come down; then the pile settles."""

    def __init__(self, phase: Deposit, scene: Scene) -> None:
        self._phase = phase
        self._scene = scene
        rng = np.random.default_rng(derive_seed(scene.seed, "deposit"))
        # `layer`: smarticles of the layer that is coming down, 0 for none; `waited` [s] for it, or for the pile;
        # `still` [s] that the pile has been.
        self.memory: Memory = {
            "left": scene.count,
            "layer": 0,
            "waited": 0.0,
            "still": 0.0,
            "random": rng.bit_generator.state,
        }

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        memory = self.memory
        if memory["layer"]:
            self._look_at_layer(engine)
        elif not memory["left"] and self._has_settled(engine):
            return 0.0
        if memory["left"] and not memory["layer"]:
            self._pour(engine)
        memory["waited"] += CHECK_INTERVAL
        return CHECK_INTERVAL

    def _pour(self, engine: Engine) -> None:
        memory = self.memory
        size = min(self._phase.per_layer, memory["left"])
        rng = np.random.default_rng()
        rng.bit_generator.state = memory["random"]
        _pour_layer(self._phase, self._scene, engine, size, rng)
        memory.update(left=memory["left"] - size, layer=size, waited=0.0, random=rng.bit_generator.state)

    def _look_at_layer(self, engine: Engine) -> None:
        size, limit = self.memory["layer"], self._phase.landed_speed_m_per_s
        fastest = float(-engine.state().velocities[-size:, 2].min())
        if fastest < limit and engine.touches()[-size:].min() > 0:
            self.memory.update(layer=0, waited=0.0)
        elif self.memory["waited"] > LAYER_TIMEOUT:
            msg = (
                f"a layer of {size} had not come down {LAYER_TIMEOUT:g} s after it was poured: the fastest falls at "
                f"{fastest:.3g} m/s, limit {limit:g} m/s; raise phases.0.landed_speed_m_per_s"
            )
            raise RunError(msg)

    def _has_settled(self, engine: Engine) -> bool:
        settle: Settle = self._phase.settle
        speed = float(np.linalg.norm(engine.state().velocities, axis=1).max())
        unbalanced = engine.unbalanced_force()
        still = speed < settle.speed_m_per_s and unbalanced < settle.unbalanced_force
        self.memory["still"] = self.memory["still"] + CHECK_INTERVAL if still else 0.0
        if self.memory["still"] > settle.hold_s:
            return True
        if self.memory["waited"] > settle.timeout_s:
            msg = (
                f"the pile has not settled after {settle.timeout_s:g} s: speed {speed:.3g} m/s (limit "
                f"{settle.speed_m_per_s:g} m/s), unbalanced force {unbalanced:.3g} (limit "
                f"{settle.unbalanced_force:g}); raise phases.0.settle.timeout_s or its limits"
            )
            raise RunError(msg)
        return False


def shake_amplitude(phase: Shake, gravity: float) -> float:
    """A = Γ g / (2πf)² [m]."""
    return phase.peak_acceleration_g * gravity / (2 * math.pi * phase.frequency_hz) ** 2


def container_height(scene: Scene) -> float:
    """Height of the wall [m]: given, or enough for the loosest pile plus a layer being poured.

    A loose random packing of thin bars has φ ≈ 2.4 d/L with L the length of all links (Gravish's φ_0 at l/w = 0, 0.7
    and 1.4, with d the mean width of the section); half of that is taken as the loosest.
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
    tops = state.vertices[..., 2].max(axis=1)
    top = tops.max(initial=engine.floor)
    near = tops > top - 2 * particle.radius
    poses = place_layer(
        particle,
        count=size,
        radius=engine.cylinder.inner_radius,
        bottom=top + particle.radius,
        height=phase.layer_height_w * scene.smarticle.middle_length_m,
        obstacles=state.spheres(particle)[near].reshape(-1, 3),
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
