"""What a run needs of an engine: the one interface between the physics and everything around it.

An engine is a container, or a plane, that smarticles are added to and that time is advanced in. `Engine` is the running
simulation, in groups: time and smarticles on the engine itself, and `boundaries`, `motors`, `strings` and `ledger` for
what does not give way, what moves barbs, what pulls chains, and what energies add up to. `EngineKind` is what is asked
of an engine before there is a simulation.

Heights, velocities and forces are in the laboratory frame. Sums over steps are counted inside the engine: a difference
of two of them over the steps in between is a mean that misses no impact. `tests/double.py` implements the interface in
memory; `dem.engine.kinds` lists the engines that there are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dem.body.chain import Tie
from dem.body.forces import ContactForces
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import State
from dem.physics.overlaps import Glance, Overlaps
from dem.physics.strings import StringLaw
from dem.setting.container import Cylinder

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Saved:
    """A simulation at one instant, as its engine saves it.

    Args:
        content: the engine's own serialisation; opaque to everybody else.
        memory: plain data, JSON-able without loss, that belongs to it.
    """

    content: bytes
    memory: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class MotorReadings:
    """All motors at one instant, (N, 2) each: barb 1 and barb 2 of every smarticle.

    Args:
        schedule: angles that they were told at the last look [rad]; a motor that halts falls behind.
        commands: angles that they hold [rad].
        torques: on the barbs since the last look [N m]; positive ones raise the angle.
        work: done on the links since the start, ∫ τ dα up to the last look [J].
        halted: bool, whether a motor wanted to advance at the last look and did not.
    """

    schedule: Array
    commands: Array
    torques: Array
    work: Array
    halted: NDArray[np.bool_]


class Boundaries(Protocol):
    """What does not give way to smarticles: floor and wall, hooks, or the walls of a channel."""

    # -- how they stand ----------------------------------------------------------------------------------------

    @property
    def floor(self) -> float:
        """Height of the container's floor [m]."""

    @property
    def velocity(self) -> float:
        """Vertical velocity of the container, or of its floor where the wall is gone [m/s]."""

    @property
    def walled(self) -> bool:
        """Whether the wall is there, wherever it is."""

    @property
    def wall_bottom(self) -> float:
        """Height of the wall's lower edge [m]; inf without a wall."""

    @property
    def enclosed(self) -> bool:
        """Whether nothing can leave the container: the wall is there, and begins below the floor."""

    @property
    def raised(self) -> float | None:
        """How far the pile may have been raised by a hook [m]; None where nothing holds it back any more."""

    @property
    def upper_height(self) -> float:
        """Height of the upper hook's centre [m]; of scenes with hooks only."""

    # -- how they move -----------------------------------------------------------------------------------------

    def shake(self, *, amplitude: float, frequency: float, walls: bool = True) -> None:
        """Move what is there as z = A sin(2πf t), t from now; it starts where it is.

        Args:
            amplitude: A [m].
            frequency: f [Hz].
            walls: whether wall and hooks move with the floor.

        Raises:
            RunError: the engine was built without a shaker.
        """

    def lift_wall(self, speed: float) -> None:
        """Move the wall upwards at a speed [m/s] from now on."""

    def raise_upper(self, speed: float) -> None:
        """Move the upper hook upwards at a speed [m/s] from now on."""

    def stop(self) -> None:
        """Bring everything to rest where it is."""

    def remove_wall(self) -> None:
        """Take the wall away, moving or not; what its contacts had stored is dissipated."""

    # -- what they feel ----------------------------------------------------------------------------------------

    @property
    def hook_sums(self) -> Array:
        """(2, 3) forces of the smarticles on the lower and the upper hook, summed over all steps so far [N].

        (0, 3) without hooks.
        """

    @property
    def channel_sums(self) -> Array:
        """(2, 3) the same for the lower and the upper wall of a channel; (0, 3) without walls."""


class Motors(Protocol):
    """The barbs' motors. Smarticles are welded, rigid, until they are articulated, and may be welded again."""

    @property
    def present(self) -> bool:
        """Whether the scene has motors, at work or not."""

    @property
    def articulated(self) -> bool:
        """Whether barbs can turn at present."""

    def articulate(self) -> None:
        """Let the motors take hold of the barbs, where these are; nothing while articulated already."""

    def weld(self) -> None:
        """Make each smarticle rigid in the shape that it has; nothing while welded already."""

    @property
    def looks_at_once(self) -> int:
        """How many looks the motors can be told of at once, one or more."""

    def actuate(self, targets: Array, interval: float) -> None:
        """Let the motors look at their barbs and act for a control period; and so for the periods that follow.

        Args:
            targets: (looks, N, 2) angles at the end of each period according to the schedule [rad]; `looks_at_once`
                of them at most.
            interval: length of a period [s].
        """

    @property
    def readings(self) -> MotorReadings | None:
        """What the motors tell; None before the first articulation."""

    @property
    def work(self) -> float:
        """Work of all motors on the links since the start, up to now [J]."""

    def gaps(self) -> Array:
        """(N, 2) how far the hinges have given way [m]; zero while welded."""


class Strings(Protocol):
    """The two strings that hold and pull a chain apart."""

    @property
    def tied(self) -> bool:
        """Whether they are there."""

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        """Tie a string to each of some points of articulated smarticles, taut, its other end outwards on the x-axis.

        Args:
            ties: the points.
            law: what the strings have in common.
            speeds: of their other ends, away from the origin [m/s].
        """

    def untie(self) -> None:
        """Let go of all strings."""

    @property
    def sums(self) -> Array:
        """(strings, 3) forces on the links, summed over all steps since they were tied [N]."""

    @property
    def pulled(self) -> float:
        """How far the other ends have moved apart since the strings were tied [m]."""

    @property
    def ties(self) -> Array:
        """(strings, 3) where the strings are tied [m]."""


class EnergyLedger(Protocol):
    """Energies that have to be added up step by step, each only where a scene asks for it."""

    @property
    def container_work(self) -> float:
        """Work of moving boundaries, and of strings, on the smarticles since the start [J]."""

    @property
    def added(self) -> float:
        """Energy of motion, of gravity above z = 0 and of contacts taken in, that smarticles were added with [J]."""

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, by contacts, hinges and welding [J]."""

    @property
    def given(self) -> float:
        """Energy added and work of boundaries since the start [J]; NaN while one moves whose work is not added up."""

    def elastic(self) -> tuple[float, float]:
        """Energy in the springs of contacts and of hinges [J]."""

    def take_in(self) -> None:
        """Count what the springs of contacts hold at present as added: of smarticles that were added touching."""


class Engine(Protocol):
    """A running simulation. One process runs one: engines may keep theirs in a process-wide singleton."""

    @property
    def particle(self) -> Particle:
        """One smarticle."""

    @property
    def cylinder(self) -> Cylinder:
        """The container as it was built."""

    @property
    def gravity(self) -> float:
        """g, downwards [m/s²]."""

    @property
    def boundaries(self) -> Boundaries:
        """What does not give way."""

    @property
    def motors(self) -> Motors:
        """What moves the barbs."""

    @property
    def strings(self) -> Strings:
        """What pulls a chain."""

    @property
    def ledger(self) -> EnergyLedger:
        """What energies add up to."""

    # -- time --------------------------------------------------------------------------------------------------

    @property
    def cpu_elsewhere(self) -> float:
        """Processor time [s] that other processes of this machine have spent for it since it was built."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    @property
    def steps(self) -> int:
        """Steps made."""

    @property
    def time_step(self) -> float:
        """Time step, dt [s]."""

    def set_time_step(self, time_step: float) -> None:
        """Take steps of another length [s] from now on."""

    def advance(self, steps: int) -> None:
        """Advance by whole steps; none for a number that is not positive.

        Raises:
            RunError: the engine stopped before the last step.
        """

    # -- smarticles --------------------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        """Smarticles present, N."""

    def add(self, poses: Poses, *, speed: float = 0.0) -> None:
        """Add smarticles of the particle's own shape, which fall at a speed [m/s] and do not turn."""

    def still(self) -> None:
        """Bring all smarticles to rest where they are, while welded; their kinetic energy is dissipated."""

    def state(self) -> State:
        """Poses and velocities of all smarticles.

        Raises:
            RunError: the simulation has blown up.
        """

    @property
    def impulse(self) -> float:
        """What gravity, and throwing them, has given to all smarticles since they were added [N s], downwards."""

    def unbalanced_force(self) -> float:
        """Mean net force on a smarticle over its weight [1]: 0 for a still pile, 1 in free fall, inf when empty."""

    def neighbours(self) -> NDArray[np.int64]:
        """(N,) how many other smarticles each one touches."""

    def touches(self) -> NDArray[np.int64]:
        """(N,) contacts of each smarticle with others and with boundaries, however many with the same."""

    def overlaps(self, limit: float) -> Overlaps:
        """How deep contacts are at present, and who has some deeper than a limit [m]."""

    def contact_forces(self) -> ContactForces:
        """Forces at all contacts at present, or in the last step; contacts of one pair of links are one."""

    def glance(self, state: State) -> Glance | None:
        """The extremes of all smarticles, for less than it costs to ask for each one.

        Args:
            state: at this instant.

        Returns:
            None where the engine has no such way, or knows of something that must be looked at closely.
        """

    # -- checkpoints -------------------------------------------------------------------------------------------

    def save(self, scratch: Path) -> Saved:
        """Everything that `load` needs; the simulation goes on from it as one that was loaded would, bit for bit.

        Args:
            scratch: folder for files that are removed again.
        """

    def load(self, saved: Saved, scratch: Path) -> None:
        """Replace the simulation by a saved one of the same scene."""
