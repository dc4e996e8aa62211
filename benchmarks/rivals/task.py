"""The task of every engine, its outcome, and the base class of simulations."""

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes
from dem.body.state import State
from dem.phases.actuated import Drive, drive
from dem.phases.shake import Shake
from dem.phases.take_over import TakeOver, poses_of
from dem.scene.scene import Scene

Array = NDArray[np.float64]
Knobs = Mapping[str, Any]

REST, ACTIVITY = 1, 2  # indices of the phases after the take-over
FACETS = 32  # number of flat walls, tangent to the cylinder, for engines without hollow cylinders
CREEP = 0.1  # time at the end of the rest in which sinking is measured [s]


@dataclass(frozen=True, eq=False)
class Task:
    """Scene of three phases: take-over, relax and an activity."""

    scene: Scene
    folder: Path  #: Folder for files of the engine
    sample_s: float  #: Time between two samples of the poses [s]

    @cached_property
    def state(self) -> State:
        """State of the smarticles at the start, at rest."""
        first = self.scene.phases[0]
        assert isinstance(first, TakeOver)
        poses = poses_of(self.scene, first.taken)
        turns, still = np.array([turn.as_matrix() for turn in poses.rotations]), np.zeros_like(poses.positions)
        return State.rigid(self.boxes, poses.positions, turns, still, still)

    @property
    def turns(self) -> Array:
        """Rotations from body frame to laboratory frame at the start, (N, 3, 3)."""
        turns: Array = self.state.link_rotations[:, 1] @ self.boxes.link_rotations[1].T
        return turns

    @property
    def boxes(self) -> Boxes:
        """Geometry and mass of a smarticle."""
        return self.scene.body.boxes

    @property
    def rest_s(self) -> float:
        """Duration of the rest [s]."""
        return float(self.scene.phases[REST].known_duration or 0.0)

    @property
    def activity_s(self) -> float:
        """Duration of the activity [s]."""
        return float(self.scene.phases[ACTIVITY].known_duration or 0.0)

    @property
    def actuates(self) -> bool:
        """Whether the activity moves barbs."""
        return self.scene.phases[ACTIVITY].actuates

    @cached_property
    def gait(self) -> Drive:
        """Target angles of the barbs over time."""
        return drive(self.scene, ACTIVITY)

    def floor(self, time_s: float) -> float:
        """Return the height of the floor [m] at a time since the start of the activity [s]."""
        phase = self.scene.phases[ACTIVITY]
        if not isinstance(phase, Shake):
            return 0.0
        omega = 2 * math.pi * phase.frequency_hz
        return phase.amplitude(self.scene.gravity_m_per_s2) * math.sin(omega * time_s)

    def gravity(self, time_s: float) -> float:
        """Return the downward gravity [m/s²] in the container's frame at a time [s] in the activity."""
        phase = self.scene.phases[ACTIVITY]
        omega = 2 * math.pi * phase.frequency_hz if isinstance(phase, Shake) else 0.0
        return self.scene.gravity_m_per_s2 - omega**2 * self.floor(time_s)

    @property
    def kick(self) -> float:
        """Upward velocity of the container just after the start of the activity [m/s]."""
        return float(self.scene.phases[ACTIVITY].peak_speed(self.scene.gravity_m_per_s2))

    def walls(self) -> tuple[Array, Array]:
        """Return a point (FACETS, 3) [m] and the inward unit normal (FACETS, 3) of each flat wall.

        The walls replace the round wall, tangent to it, for engines without round walls.
        """
        angles = 2 * math.pi * np.arange(FACETS) / FACETS
        outwards = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(FACETS)])
        return self.scene.cylinder.radius * outwards, -outwards

    def slabs(self, scale: float) -> Iterator[tuple[Array, Rotation, Array]]:
        """Yield boxes for floor and walls: centre, rotation and half side lengths; all lengths times `scale`."""
        thick, radius, height = 2.0, scale * self.scene.cylinder.radius, scale * 0.2
        yield np.array([0.0, 0.0, -thick / 2]), Rotation.identity(), np.array([3 * radius, 3 * radius, thick / 2])
        for point, inward in zip(*self.walls(), strict=True):
            centre = scale * point - inward * thick / 2 + np.array([0.0, 0.0, height / 2])
            turn = Rotation.from_euler("z", math.atan2(inward[1], inward[0]))
            yield centre, turn, np.array([thick / 2, 1.3 * math.pi * radius / FACETS, height / 2 + thick])


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a simulation with N smarticles and F samples during the activity."""

    time_step: float  #: Time step of the activity [s]
    processor_s: float  #: Processor time of the activity [s]
    #: Centres of the links relative to the container, (2 + F, N, 3, 3) [m]: `CREEP` before the end of the rest, at the
    #: end of the rest, and at each sample during the activity
    positions: Array
    frames: Array  #: Axes of the links as columns, (2 + F, N, 3, 3, 3)
    version: str  #: Version of the engine


class World:
    """Base class of simulations in the container's frame; subclasses define `kick`, `step` and `links`."""

    def __init__(self, task: Task, time_step: float, version: str) -> None:
        self.task, self.time_step, self.version = task, time_step, version
        self._since: float | None = None

    def kick(self, speed: float) -> None:
        """Add a vertical velocity [m/s] to all smarticles."""
        raise NotImplementedError

    def step(self, gravity: float, time_s: float) -> None:
        """Take one step with a downward gravity [m/s²] to the time `time_s` [s] since the activity began."""
        raise NotImplementedError

    def begin(self) -> None:
        """Begin the activity, at which the container jumps to its first velocity.

        In the container's frame all smarticles get the opposite velocity.
        """
        self._since = 0.0
        self.kick(-self.task.kick)

    def links(self) -> tuple[Array, Array]:
        """Return the centres of the links (N, 3, 3) [m], and their axes as columns (N, 3, 3, 3)."""
        raise NotImplementedError

    def advance(self, seconds: float) -> None:
        """Advance by a time [s]; each step uses the gravity at the middle of the step."""
        for _ in range(round(seconds / self.time_step)):
            if self._since is None:
                self.step(self.task.scene.gravity_m_per_s2, 0.0)
            else:
                self._since += self.time_step
                self.step(self.task.gravity(self._since - self.time_step / 2), self._since)


def simulated(task: Task, simulation: World) -> Outcome:
    """Simulate rest and activity of a task in `simulation`; measure the processor time of the activity."""
    if task.rest_s > CREEP:
        simulation.advance(task.rest_s - CREEP)
    samples, spent = [simulation.links()], 0.0
    simulation.advance(min(CREEP, task.rest_s))
    samples.append(simulation.links())
    simulation.begin()
    for _ in range(round(task.activity_s / task.sample_s)):
        begun = time.process_time()
        simulation.advance(task.sample_s)
        spent += time.process_time() - begun
        samples.append(simulation.links())
    positions, frames = (np.array(each) for each in zip(*samples, strict=True))
    return Outcome(simulation.time_step, spent, positions, frames, simulation.version)


def rigid_links(boxes: Boxes, positions: Array, turns: Array) -> tuple[Array, Array]:
    """Return centres (N, 3, 3) [m] and axes (N, 3, 3, 3) of the links `boxes` of rigid smarticles.

    Positions are the centres of mass, (N, 3) [m], turns the rotations from body frame to laboratory frame, (N, 3, 3).
    """
    still = np.zeros_like(positions)
    state = State.rigid(boxes, positions, turns, still, still)
    return state.link_positions, state.link_rotations
