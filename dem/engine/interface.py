"""The interface between the physics and everything around it: what a run needs of an engine.

An engine is a container, or a plane, that smarticles are added to and in which time is advanced. `Engine` is the
running simulation: time and smarticles on the engine itself, and `boundaries`, `motors`, `strings` and `ledger`.
`dem.engine.kinds` lists the engines, and says what can be asked of one before there is a simulation; `tests/double.py`
implements the interface in memory.

Heights, velocities and forces are in the laboratory frame. Sums over steps are counted inside the engine: a difference
of two of them over the steps in between is a mean that misses no impact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from dem.arrays import Array, Flags, Numbers
from dem.body.chain import Tie
from dem.body.forces import ContactForces
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import State
from dem.physics.contact import StringLaw
from dem.physics.overlaps import Extremes, Overlaps
from dem.setting.container import Cylinder


@dataclass(frozen=True, kw_only=True)
class Saved:
    """A simulation at one instant: the engine's own bytes, and plain data that JSON keeps without loss."""

    content: bytes
    memory: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class MotorReadings:
    """All motors at one instant, (N, 2) each: barb 1 and barb 2 of every smarticle."""

    schedule: Array  #: Angles of the schedule at the last control update [rad]; a motor that halts falls behind
    commands: Array  #: Angles that they hold [rad]
    torques: Array  #: On the barbs since the last control update [N m]; positive ones raise the angle
    work: Array  #: Done on the links since the start, ∫ τ dα up to the last control update [J]
    halted: Flags  #: Whether a motor wanted to advance at the last control update and did not


class Boundaries(Protocol):
    """Rigid boundaries: floor and wall, hooks, or the walls of a channel."""

    # -- where they are ----------------------------------------------------------------------------------------

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
        """How far a hook may have raised the pile [m]; None where nothing holds the pile back any more."""

    @property
    def upper_height(self) -> float:
        """Height of the upper hook's centre [m]; of scenes with hooks only."""

    # -- how they move -----------------------------------------------------------------------------------------

    def shake(self, *, amplitude: float, frequency: float, walls: bool = True) -> None:
        """Move the container as z = A sin(2πf t), t from now; it starts where it is.

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

    # -- forces on them ----------------------------------------------------------------------------------------

    @property
    def hook_sums(self) -> Array:
        """(2, 3) forces of the smarticles on lower and upper hook, summed over all steps [N]; (0, 3) without hooks."""

    @property
    def channel_sums(self) -> Array:
        """(2, 3) forces on the lower and the upper wall of a channel, summed likewise [N]; (0, 3) without walls."""


class Motors(Protocol):
    """The barbs' motors. Smarticles are welded, rigid, until they are articulated, and may be welded again."""

    @property
    def present(self) -> bool:
        """Whether the scene has motors, at work or not."""

    @property
    def articulated(self) -> bool:
        """Whether barbs can turn at present."""

    def articulate(self) -> None:
        """Let barbs turn, held by their motors where they are; nothing while articulated already."""

    def weld(self) -> None:
        """Make each smarticle rigid in its present shape; nothing while welded already."""

    @property
    def updates_at_once(self) -> int:
        """Most control updates that `actuate` takes at once."""

    def actuate(self, targets: Array, interval: float) -> None:
        """Make a control update, which acts for a control period, and others at the ends of the periods that follow.

        Args:
            targets: (updates, N, 2) angles at the end of each period according to the schedule [rad]; `updates_at_once`
                of them at most.
            interval: length of a period [s].
        """

    @property
    def readings(self) -> MotorReadings | None:
        """State of all motors; None before the first articulation."""

    @property
    def work(self) -> float:
        """Work of all motors on the links since the start, up to now [J]."""

    def gaps(self) -> Array:
        """Return how far the hinges have given way (N, 2) [m]; zero while welded."""


class Strings(Protocol):
    """The two strings that hold and pull a chain apart."""

    @property
    def tied(self) -> bool:
        """Whether they exist at present."""

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        """Tie taut strings to smarticles; their other ends move outwards along x at `speeds` [m/s]."""

    def untie(self) -> None:
        """Remove all strings."""

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
    """Work and dissipation, added up step by step, each only where a scene asks for it."""

    @property
    def container_work(self) -> float:
        """Work of moving boundaries, and of strings, on the smarticles since the start [J]."""

    @property
    def added(self) -> float:
        """Energy that smarticles were added with [J]: kinetic, of gravity above z = 0, of contacts taken in."""

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, by contacts, hinges and welding [J]."""

    @property
    def given(self) -> float:
        """Energy added and work of boundaries since the start [J]; NaN while one moves whose work is not added up."""

    def elastic(self) -> tuple[float, float]:
        """Return the energies in the springs of contacts and of hinges [J]."""

    def take_in(self) -> None:
        """Count the present energy of contacts as added; for smarticles that were added touching."""


class Engine(Protocol):
    """A running simulation; one per process, since an engine may be a process-wide singleton."""

    particle: Particle  #: One smarticle
    cylinder: Cylinder  #: The container as it was built
    gravity: float  #: g, downwards [m/s²]

    @property
    def boundaries(self) -> Boundaries:
        """Rigid boundaries."""

    @property
    def motors(self) -> Motors:
        """Motors of the barbs."""

    @property
    def strings(self) -> Strings:
        """Strings that pull a chain."""

    @property
    def ledger(self) -> EnergyLedger:
        """Energy ledger."""

    # -- time --------------------------------------------------------------------------------------------------

    @property
    def cpu_elsewhere(self) -> float:
        """Processor time of its other processes on this machine since it was built [s]."""

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
        """Set all velocities to zero, while welded; the kinetic energy is dissipated."""

    def state(self) -> State:
        """Return poses and velocities of all smarticles.

        Raises:
            RunError: the simulation has blown up.
        """

    @property
    def impulse(self) -> float:
        """Momentum that gravity and throwing have given to all smarticles, downwards [N s]."""

    def unbalanced_force(self) -> float:
        """Return the mean net force on a smarticle over its weight [1]: 0 at rest, 1 in free fall, inf when empty."""

    def neighbours(self) -> Numbers:
        """Return for each smarticle (N,) how many others it touches."""

    def touches(self) -> Numbers:
        """Return the number (N,) of contacts of each smarticle, with smarticles and boundaries."""

    def overlaps(self, limit: float) -> Overlaps:
        """Return the present overlaps, and which smarticles have one deeper than a limit [m]."""

    def contact_forces(self) -> ContactForces:
        """Return forces at all contacts, at present or in the last step; a pair of links has one contact."""

    def extremes(self, state: State) -> Extremes | None:
        """Return the extremes of all smarticles, cheaper than from each one, in the present state.

        None where the engine has no such way, or knows of something that needs a full check.
        """

    # -- checkpoints -------------------------------------------------------------------------------------------

    def save(self, scratch: Path) -> Saved:
        """Return all that `load` needs; a loaded simulation goes on with the bits of the saved one."""

    def load(self, saved: Saved, scratch: Path) -> None:
        """Replace the simulation by a saved one of the same scene."""
