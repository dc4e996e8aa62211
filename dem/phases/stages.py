"""The stages of a run: pour, rest, shake, actuate, take the container away, pull a hook.

A stage is asked again and again when it wants to be asked next; in between, time passes and everything due is recorded.
All that it remembers is plain data, so that a run can be stopped between any two steps and go on as if it had not been.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from dem.body.placement import place_layer
from dem.engine.yade.engine import Engine
from dem.errors import RunError
from dem.phases.actuation import Drive, drive
from dem.phases.chain import Arrange, Chain, Strain, chain_of, parted
from dem.phases.release import RemoveContainer
from dem.physics.strings import StringLaw
from dem.scene.scene import Scene, derive_seed
from dem.setting.hooks import PullHook
from dem.setting.parts import Deposit, Relax, Settle, Shake, shake_amplitude

CHECK_INTERVAL = 0.01  # s between looks at whether a layer has come down or a pile has settled
HELD_FAST = 0.1  # s that a hook stays where its force limit has stopped it, for the force to be measured
LAYER_TIMEOUT = 2.0  # s; the fall of a layer takes less than 0.1 s

Memory = dict[str, Any]


class Stage(Protocol):
    """One phase while it runs."""

    memory: Memory
    """All that the stage remembers: plain data, JSON-able without loss; what is to be told of it at its end stands
    under `warning`."""

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
        freed = any(isinstance(before, RemoveContainer) for before in scene.phases[:index])
        return Shaking(phase, scene.gravity_m_per_s2, freed=freed)
    if isinstance(phase, Relax):
        return Resting(phase)
    if isinstance(phase, RemoveContainer):
        return Removing(phase)
    if isinstance(phase, PullHook):
        return Pulling(phase)
    return Arranging(chain_of(scene)) if isinstance(phase, Arrange) else _at_motors(scene, index)


def _at_motors(scene: Scene, index: int) -> Stage:
    phase, motors = scene.phases[index], (drive(scene, index), scene.fidelity.control_interval_s)
    return Straining(*motors, phase, chain_of(scene)) if isinstance(phase, Strain) else Actuating(*motors)


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
    """The container moves, or its floor alone where the wall was taken away."""

    def __init__(self, phase: Shake, gravity: float, *, freed: bool) -> None:
        self._phase = phase
        self._amplitude = shake_amplitude(phase, gravity)
        self._freed = freed
        self.memory: Memory = {"begun": False}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        if self.memory["begun"]:
            engine.stop_container()
            return 0.0
        if self._freed and engine.fixtures.walled:
            edge = engine.fixtures.wall_bottom - engine.floor
            msg = (
                f"the wall is still around the pile, its edge {edge:.3g} m over the floor that is to be shaken: it was "
                "not clear of the pile when remove-container ended; lengthen that phase's duration_s or raise its "
                "speed_m_per_s"
            )
            raise RunError(msg)
        self.memory["begun"] = True
        engine.weld()
        engine.shake(amplitude=self._amplitude, frequency=self._phase.frequency_hz)
        return self._phase.duration_s


class Removing:
    """The container's wall goes away, at once or upwards, and the pile rests on the floor."""

    def __init__(self, phase: RemoveContainer) -> None:
        self._phase = phase
        self.memory: Memory = {"end": None, "lifting": False}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        memory, speed = self.memory, self._phase.speed_m_per_s
        if memory["end"] is None:
            memory["end"] = engine.time + self._phase.duration_s
            engine.weld()
            if speed is None:
                engine.remove_wall()
            else:
                engine.fixtures.lift_wall(speed)
                memory["lifting"] = True
        left = _time_left(engine, memory["end"])
        if memory["lifting"]:
            top = engine.state().vertices[..., 2].max() + engine.particle.radius
            if engine.fixtures.wall_bottom > top:
                engine.remove_wall()
                memory["lifting"] = False
            elif not left:
                engine.fixtures.stop()
            else:
                return min(CHECK_INTERVAL, left)
        return left


class Pulling:
    """The upper hook is raised until it has arrived or takes too much force, and then stays where it is."""

    def __init__(self, phase: PullHook) -> None:
        self._phase = phase
        # `force_sum`, `step`: sum of the vertical forces on the hook so far [N], and steps, at the last look.
        self.memory: Memory = {"arrival": None, "end": None, "raising": False, "force_sum": 0.0, "step": 0}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        memory, phase = self.memory, self._phase
        if memory["end"] is None:
            arrival = engine.time + phase.distance_m / phase.speed_m_per_s
            memory.update(arrival=arrival, end=engine.time + phase.duration_s, raising=True, felt=_felt_above(engine))
            engine.weld()
            engine.fixtures.raise_upper(phase.speed_m_per_s)
            self._note(engine)
        elif memory["raising"] and self._overloaded(engine):
            memory.update(arrival=engine.time, end=engine.time + HELD_FAST)
        if memory["raising"] and (left := _time_left(engine, memory["arrival"])):
            return left if phase.force_limit_N is None else min(CHECK_INTERVAL, left)
        if memory["raising"]:
            memory["raising"] = False
            engine.fixtures.stop()
        left = _time_left(engine, memory["end"])
        if not left and memory.get("felt") == _felt_above(engine):
            memory["warning"] = (
                "no smarticle touched the upper hook while it was raised, and its force is 0 N throughout; lower "
                "hooks.upper_height_m or raise count"
            )
        return left

    def _overloaded(self, engine: Engine) -> bool:
        """Whether the hook took more than it may since the last look, on average."""
        limit, before, step = self._phase.force_limit_N, self.memory["force_sum"], self.memory["step"]
        self._note(engine)
        return limit is not None and before - self.memory["force_sum"] > limit * (self.memory["step"] - step)

    def _note(self, engine: Engine) -> None:
        self.memory.update(force_sum=float(engine.fixtures.hook_sums[1, 2]), step=engine.steps)


def _felt_above(engine: Engine) -> list[float]:
    """All that the upper hook has felt so far, summed over steps [N]: unchanged where nothing touches it."""
    felt: list[float] = engine.fixtures.hook_sums[1].tolist()
    return felt


def _time_left(engine: Engine, end: float) -> float:
    """Time [s] until `end`; 0 where it is nearer than half a step, as near as steps come."""
    left = end - engine.time
    return left if left > engine.time_step / 2 else 0.0


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


class Arranging:
    """The chain is laid out, at once."""

    def __init__(self, chain: Chain) -> None:
        self._chain = chain
        self.memory: Memory = {}

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        engine.add(self._chain.poses())
        return 0.0


class Straining(Actuating):
    """The motors hold while strings pull the chain apart, until it has parted or the end of the way."""

    def __init__(self, schedule: Drive, interval: float, phase: Strain, chain: Chain) -> None:
        super().__init__(schedule, interval)
        self._phase = phase
        self._chain = chain
        self._looks_per_check = max(1, round(CHECK_INTERVAL / interval))

    def proceed(self, engine: Engine) -> float:
        """See `Stage.proceed`."""
        phase, diameter = self._phase, 2 * self._chain.particle.radius
        if self.memory["look"] == 0:
            engine.articulate()
            law = StringLaw(
                length=phase.string_length_m,
                stiffness=phase.string_stiffness_N_per_m,
                damping=phase.string_damping_N_s_per_m,
            )
            engine.tie(self._chain.ties(phase.tied_at), law, (0.0, phase.speed_m_per_s))
        over = self.memory["look"] % self._looks_per_check == 0 and parted(engine.state(), diameter)
        wait = 0.0 if over else super().proceed(engine)
        if not wait:
            engine.untie()
        return wait


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


def _pour_layer(phase: Deposit, scene: Scene, engine: Engine, size: int, rng: np.random.Generator) -> None:
    particle, state = scene.particle, engine.state()
    tops = state.vertices[..., 2].max(axis=1)
    top = tops.max(initial=engine.floor)
    near = tops > top - 2 * particle.radius
    cylinder, bottom = engine.cylinder, top + particle.radius
    hooks = [cross.obstacles(2 * particle.radius) for cross in (scene.hooks.crosses if scene.hooks else ())]
    poses = place_layer(
        particle,
        count=size,
        radius=float(cylinder.inner_radii(np.array([bottom]))[0]),
        bottom=bottom,
        height=phase.layer_height_w * scene.smarticle.middle_length_m,
        obstacles=np.concatenate([state.spheres(particle)[near].reshape(-1, 3), *hooks]),
        rng=rng,
        narrower=cylinder.inner_radii if cylinder.upper else None,
    )
    highest = poses.positions[:, 2].max() + particle.reach
    if highest > cylinder.height:
        key = "container.height_m" if scene.container.tiers is None else "height_m of the top tier"
        msg = (
            f"{scene.count} smarticles do not fit: after {engine.count} the next layer would reach {highest:.3g} m, "
            f"above container.height_m = {cylinder.height:.3g} m; lower count or raise {key}"
        )
        raise RunError(msg)
    engine.add(poses)
