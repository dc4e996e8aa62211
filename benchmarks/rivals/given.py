"""What every engine is given, and what it gives back."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dem.body.particle import Boxes
from dem.body.state import State
from dem.phases.actuated import Drive, drive
from dem.phases.shake import Shake
from dem.phases.take_over import TakeOver, poses_of
from dem.scene.scene import Scene

Array = NDArray[np.float64]
Knobs = Mapping[str, Any]

REST, ACTIVITY = 1, 2  # phases of the scene, after the take-over
FACETS = 32  # flat walls of engines that have no cylinder to be in; they touch it from outside


@dataclass(frozen=True, eq=False)
class Given:
    """A scene of three phases, take-over, relax and an activity, as engines of others are told of it.

    Args:
        scene: the scene.
        folder: where an engine may leave files.
        look_s: time between two looks at the poses [s].
    """

    scene: Scene
    folder: Any
    look_s: float

    @cached_property
    def state(self) -> State:
        """The smarticles at the beginning, at rest."""
        first = self.scene.phases[0]
        assert isinstance(first, TakeOver)
        poses = poses_of(self.scene, first.taken)
        turns, still = np.array([turn.as_matrix() for turn in poses.rotations]), np.zeros_like(poses.positions)
        return State.rigid(self.boxes, poses.positions, turns, still, still)

    @property
    def turns(self) -> Array:
        """(N, 3, 3) body frame to laboratory frame at the beginning."""
        turns: Array = self.state.link_rotations[:, 1] @ self.boxes.link_rotations[1].T
        return turns

    @property
    def boxes(self) -> Boxes:
        """One smarticle."""
        return self.scene.particle.boxes

    @property
    def rest_s(self) -> float:
        """How long the pile rests [s]."""
        return float(self.scene.phases[REST].known_duration or 0.0)

    @property
    def activity_s(self) -> float:
        """How long the activity takes [s]."""
        return float(self.scene.phases[ACTIVITY].known_duration or 0.0)

    @property
    def actuates(self) -> bool:
        """Whether motors act."""
        return self.scene.phases[ACTIVITY].actuates

    @cached_property
    def gait(self) -> Drive:
        """Where the motors are told to be."""
        return drive(self.scene, ACTIVITY)

    @property
    def torque_limit(self) -> float:
        """τ_max [N m]."""
        return float(self.scene.torque_limit)

    def pull(self, time_s: float) -> float:
        """G in the container's frame [m/s²], downwards, at a time after the activity began."""
        gravity, phase = self.scene.gravity_m_per_s2, self.scene.phases[ACTIVITY]
        if not isinstance(phase, Shake):
            return gravity
        omega = 2 * math.pi * phase.frequency_hz
        return gravity - phase.amplitude(gravity) * omega**2 * math.sin(omega * time_s)

    def floor(self, time_s: float) -> float:
        """Height of the container's floor [m] at a time after the activity began."""
        phase = self.scene.phases[ACTIVITY]
        if not isinstance(phase, Shake):
            return 0.0
        omega = 2 * math.pi * phase.frequency_hz
        return phase.amplitude(self.scene.gravity_m_per_s2) * math.sin(omega * time_s)

    @property
    def kick(self) -> float:
        """Velocity that the container jumps to as the activity begins [m/s]; seen from it, all have the opposite."""
        return float(self.scene.phases[ACTIVITY].peak_speed(self.scene.gravity_m_per_s2))

    def walls(self) -> tuple[Array, Array]:
        """(FACETS, 3) points of flat walls and unit normals into the container [m]."""
        angles = 2 * math.pi * np.arange(FACETS) / FACETS
        outwards = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(FACETS)])
        return self.scene.cylinder.radius * outwards, -outwards


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a simulation gave.

    Args:
        time_step: dt of the activity [s].
        processor_s: processor time that the activity took.
        positions: (2 + F, N, 3, 3) centres of the links, seen from the container [m]: `CREEP` before the end of the
            rest, at its end, and at each look during the activity.
        frames: (2 + F, N, 3, 3, 3) their axes as columns.
        version: of the engine.
        more: what this engine alone can tell, by column.
    """

    time_step: float
    processor_s: float
    positions: Array
    frames: Array
    version: str
    more: Mapping[str, float] = field(default_factory=dict)


class Stepped(Protocol):
    """A simulation that is advanced from look to look, its current dt [s] and the engine's name and version."""

    @property
    def time_step(self) -> float: ...  # noqa: D102

    @property
    def version(self) -> str: ...  # noqa: D102

    def begin(self) -> None:
        """The activity begins."""

    def advance(self, seconds: float) -> None:
        """Advance by a time [s]."""

    def links(self) -> tuple[Array, Array]:
        """(N, 3, 3) centres of the links [m] and (N, 3, 3, 3) their axes as columns, seen from the container."""


CREEP = 0.1  # s at the end of the rest in which it is looked at whether the pile still sinks


def simulated(given: Given, simulation: Stepped, more: Callable[[], Mapping[str, float]] | None = None) -> Outcome:
    """Rest and act; only the steps of the activity are timed."""
    if given.rest_s > CREEP:
        simulation.advance(given.rest_s - CREEP)
    looks, spent = [simulation.links()], 0.0
    simulation.advance(min(CREEP, given.rest_s))
    looks.append(simulation.links())
    simulation.begin()
    for _ in range(round(given.activity_s / given.look_s)):
        begun = time.process_time()
        simulation.advance(given.look_s)
        spent += time.process_time() - begun
        looks.append(simulation.links())
    positions, frames = (np.array(each) for each in zip(*looks, strict=True))
    return Outcome(
        time_step=simulation.time_step,
        processor_s=spent,
        positions=positions,
        frames=frames,
        version=simulation.version,
        more=more() if more else {},
    )


def rigid_links(boxes: Boxes, positions: Array, turns: Array) -> tuple[Array, Array]:
    """Links of smarticles that are one body each, from (N, 3) centres of mass [m] and (N, 3, 3) rotations."""
    still = np.zeros_like(positions)
    state = State.rigid(boxes, positions, turns, still, still)
    return state.link_positions, state.link_rotations
