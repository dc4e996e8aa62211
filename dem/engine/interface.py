"""The interface of engines, which compute the physics of a run.

An `Engine` is a running simulation: bodies are added to a container or a plane, and time is advanced. It has the
parts `boundaries`, `motors`, `strings`, `filaments`, `grips` and `ledger`. `dem.engine.kinds` lists the engines, with
facts that are known without a simulation; `tests/double.py` implements the interface in memory.

Heights, velocities and forces are in the laboratory frame. Engines sum some forces over all steps: the difference of
two sums, divided by the number of steps in between, is a mean force that misses no impact.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from dem.arrays import Array, Flags, Numbers
from dem.body.chain import Tie
from dem.body.filament import Activity, FilamentEnergies
from dem.body.forces import ContactForces
from dem.body.kinds import Mixture
from dem.body.linkage import Undulation
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import PileState
from dem.physics.contact import StringLaw
from dem.physics.overlaps import Extremes, Overlaps
from dem.setting.container import Cylinder


@dataclass(frozen=True, kw_only=True)
class Saved:
    """The state of an engine, as `Engine.save` returns it."""

    content: bytes  #: Part of the state in the engine's own format
    memory: Mapping[str, Any]  #: Rest of the state, as plain data that JSON stores without loss


@dataclass(frozen=True, kw_only=True)
class MotorReadings:
    """State of all motors at one instant, as (N, 2) arrays for barb 1 and barb 2 of every smarticle."""

    schedule: Array  #: Angles of the schedule at the last control update [rad]
    commands: Array  #: Angles that the motors hold [rad]; commands of halted motors lag behind the schedule
    torques: Array  #: Torques on the barbs since the last control update [N m]; positive torques increase the angle
    work: Array  #: Work on the links since the start, ∫ τ dα up to the last control update [J]
    halted: Flags  #: Whether the last control update halted a motor, or under "slip" and "servo" found it at its limit


@dataclass(frozen=True, kw_only=True)
class JointReadings:
    """State of the joints of all linkages."""

    motor_torque: float  #: Greatest torque of a motor about one axis in the last step [N m]
    broken: int  #: Number of joints that are broken


class Boundaries(Protocol):
    """Rigid boundaries: floor and wall, hooks and plate, or the walls of a channel."""

    # -- where they are ----------------------------------------------------------------------------------------

    @property
    def floor(self) -> float:
        """Height of the container's floor [m]."""

    @property
    def velocity(self) -> float:
        """Vertical velocity of the container's floor [m/s]."""

    @property
    def walled(self) -> bool:
        """Whether the container's wall exists; a lifted wall exists, a removed one does not."""

    @property
    def wall_bottom(self) -> float:
        """Height of the wall's lower edge [m]; inf without a wall."""

    @property
    def enclosed(self) -> bool:
        """Whether bodies cannot leave the container: the wall exists, and its lower edge is below the floor."""

    @property
    def raised(self) -> float | None:
        """Increase of the upper hook's height above the floor since the start [m], 0 or more; 0 without hooks.

        None if the wall does not enclose the pile: the wall is removed, its lower edge is above the floor, the upper
        hook is above the top of the wall, or the scene is in a plane.
        """

    @property
    def upper_height(self) -> float:
        """Height of the upper hook's centre [m]; undefined in scenes without hooks."""

    @property
    def plate_height(self) -> float | None:
        """Height of the plate's lower face [m]; None while there is no plate."""

    # -- how they move -----------------------------------------------------------------------------------------

    def shake(self, *, amplitude: float, frequency: float, walls: bool = True, from_rest: bool = False) -> None:
        """Shake the container from now on, by A sin(2πf t) about its present height, with t = 0 now.

        What a hook or a plate moves by itself is added.

        Args:
            amplitude: A [m].
            frequency: f [Hz].
            walls: whether wall, hooks and plate move with the floor.
            from_rest: by A (1 - cos(2πf t)) instead, upwards from the present height, so that it begins at rest.

        RunError if the engine was built without a shaker.
        """

    def stop_shaking(self) -> None:
        """Stop the shaking at the present heights; what moves by itself goes on."""

    def lift_wall(self, speed: float) -> None:
        """Move the wall upwards at a speed [m/s] from now on."""

    def raise_upper(self, speed: float) -> None:
        """Move the upper hook upwards at a speed [m/s] from now on."""

    def place_plate(self, height: float) -> None:
        """Put a horizontal plate without edges, at rest, at a height of its lower face [m].

        RunError if the engine has no plates.
        """

    def move_plate(self, speed: float) -> None:
        """Move the plate upwards at a speed [m/s] from now on; downwards if it is negative."""

    def remove_plate(self) -> None:
        """Remove the plate; the elastic energy of its contacts counts as dissipated."""

    def stop(self) -> None:
        """Stop all boundaries at their present heights."""

    def remove_wall(self) -> None:
        """Remove the wall; the elastic energy of its contacts counts as dissipated."""

    # -- forces on them ----------------------------------------------------------------------------------------

    @property
    def hook_sums(self) -> Array:
        """(2, 3) forces on the lower and the upper hook [N], summed over all steps; (0, 3) without hooks."""

    @property
    def plate_sum(self) -> Array:
        """(3,) force on the plate [N], summed over all steps."""

    @property
    def channel_sums(self) -> Array:
        """(2, 3) forces on the channel's lower and upper wall [N], summed over all steps; (0, 3): no walls."""


class Motors(Protocol):
    """Motors at the hinges. Smarticles are welded at first, can be articulated and welded again."""

    @property
    def present(self) -> bool:
        """Whether the scene has motors, even while smarticles are welded."""

    @property
    def articulated(self) -> bool:
        """Whether barbs can turn at present."""

    def articulate(self) -> None:
        """Let barbs turn, with motors that hold their present angles; no effect on articulated smarticles."""

    def weld(self) -> None:
        """Make each smarticle rigid in its present shape; no effect on welded smarticles."""

    @property
    def updates_at_once(self) -> int:
        """Largest number of control updates that one call of `actuate` takes."""

    def actuate(self, targets: Array, interval: float) -> None:
        """Make U control updates, one at the beginning of each of U control periods; the first begins now.

        Args:
            targets: (U, N, 2) angles of barb 1 and barb 2 that the schedule has at the end of each period [rad]; U is
                at most `updates_at_once`.
            interval: length of a control period [s].
        """

    @property
    def readings(self) -> MotorReadings | None:
        """State of all motors; None before smarticles are articulated for the first time."""

    @property
    def work(self) -> float:
        """Work of all motors on the links since the start, up to now [J]."""

    def gaps(self) -> Array:
        """Return (N, 2) gaps of the hinges, distances between the joined ends of links [m]; 0 while welded."""


class Strings(Protocol):
    """The two strings that pull a chain apart."""

    @property
    def tied(self) -> bool:
        """Whether strings are tied to smarticles at present."""

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        """Tie taut strings to links; the other ends of the strings lie on the chain's axis.

        Args:
            ties: points at which the two strings are tied.
            speeds: speeds at which the other ends move outwards along x [m/s].
        """

    def untie(self) -> None:
        """Remove all strings."""

    @property
    def sums(self) -> Array:
        """(2, 3) forces on the tied links [N], summed over all steps since tying; (0, 3) without strings."""

    @property
    def pulled(self) -> float:
        """Distance by which the strings' other ends have moved apart since the strings were tied [m]."""

    @property
    def ties(self) -> Array:
        """(2, 3) positions of the points at which strings are tied [m]; (0, 3) without strings."""


class Filaments(Protocol):
    """Filaments or linkages: their active bending, the grips that hold their nodes or links, and their energies."""

    def act(self, activity: Activity | Undulation | None, *, ramp: float = 0.0) -> None:
        """Set the preferred curvature of all filaments, or the gait of all linkages, from now on.

        Args:
            activity: wave of preferred curvature, or for linkages the gait of their motors; None: filaments return to
                their own preferred curvature, linkages to the angles at the start.
            ramp: time in which the new preferred curvature, or the swings, grow from 0 [s].
        """

    def points(self, filament: int) -> Array:
        """Return the nodes (n, 3) of a filament, or middles of the links of a linkage [m]."""

    def grip(self, nodes: Mapping[int, Sequence[int]]) -> int:
        """Hold nodes or links by a new grip, which is at rest; return the number of the grip.

        `nodes` are numbers of nodes or links by the number of their body; negative numbers count from its end.
        """

    def move(self, grip: int, velocity: tuple[float, float, float]) -> None:
        """Move a grip with a velocity [m/s] from now on."""

    def release(self, grip: int | None = None) -> None:
        """Release all nodes or links that a grip holds; None: those of all grips."""

    @property
    def held(self) -> int:
        """Number of bodies of which a grip holds at least one node or link."""

    def force(self, grip: int | None = None) -> Array:
        """Return the force (3,) of a grip on its nodes or links in the last step [N]; None: the sum over all grips."""

    def mean_unbalanced(self) -> float:
        """Return the mean net force on a body over its weight in the liquid [1]."""

    @property
    def joints(self) -> JointReadings | None:
        """State of the joints of linkages; None for filaments."""

    @property
    def energies(self) -> FilamentEnergies:
        """Energies of all bodies at present, and work on them since the start."""


class Grips(Protocol):
    """Grips that hold rigid bodies, which move with their grip and do not turn, while smarticles are welded."""

    def hold(self, bodies: Sequence[int]) -> int:
        """Hold bodies by a new grip, which is at rest; return its number."""

    def move(self, grip: int, velocity: tuple[float, float, float]) -> None:
        """Move a grip with a velocity [m/s] from now on."""

    def release(self) -> None:
        """Let go of all bodies; there are no grips then."""

    @property
    def made(self) -> int:
        """Number of grips since the start, with those that have let go."""

    @property
    def sums(self) -> Array:
        """(G, 3) forces on the grips, with weight and inertia of what they hold [N], summed over all steps."""

    @property
    def pushed(self) -> Array:
        """(G, 3) forces of contacts on what the grips hold [N], summed over all steps since `hold`."""

    @property
    def weights(self) -> Array:
        """(G,) weight of what each grip holds [N]."""

    @property
    def counts(self) -> Numbers:
        """(G,) number of bodies that each grip holds."""

    @property
    def moved(self) -> Array:
        """(G, 3) way of each grip since `hold` [m], without shaking."""

    @property
    def places(self) -> Array:
        """(G, 3) means of the centres of mass of what each grip holds [m]."""


class EnergyLedger(Protocol):
    """Energy ledger: work and dissipation, summed step by step.

    Some sums cost time. Engines may leave out the work of moving boundaries if the scene records no energies, and leave
    out the dissipation in contacts, hinges and filaments if it has no `recording.dissipation_interval_s`.
    """

    @property
    def container_work(self) -> float:
        """Work of moving boundaries, of strings and of grips on the bodies since the start [J]."""

    @property
    def added(self) -> float:
        """Energy that bodies had when they were added [J].

        It is kinetic energy, gravitational energy above z = 0 and, if `take_in` was called, elastic energy.
        """

    @property
    def dissipated(self) -> float:
        """Energy dissipated since the start, by contacts, hinges, welding and `Engine.still` [J]."""

    @property
    def given(self) -> float:
        """Sum of `added`, `container_work` and work of activity [J]; NaN if a boundary's work is unknown."""

    def elastic(self) -> tuple[float, float]:
        """Return the elastic energy of all contacts, and that of all hinges and flexible bodies [J]."""

    def take_in(self) -> None:
        """Add the elastic energy of contacts to `added`; called when all bodies were added and may overlap.

        Engines that find contacts in a step add the energy after the next step.
        """


class Engine(Protocol):
    """A running simulation; a process has one at most, since an engine may be a process-wide singleton."""

    cylinder: Cylinder  #: The container
    gravity: float  #: g, downwards [m/s²]

    @property
    def particle(self) -> Particle | Mixture:
        """Geometry of each smarticle, or the kinds of other bodies."""

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
    def filaments(self) -> Filaments | None:
        """Filaments, or linkages; None where bodies are rigid."""

    @property
    def grips(self) -> Grips | None:
        """Grips of rigid bodies; None if the scene has no phase that needs them."""

    @property
    def ledger(self) -> EnergyLedger:
        """Energy ledger."""

    # -- time --------------------------------------------------------------------------------------------------

    @property
    def cpu_elsewhere(self) -> float:
        """Processor time of the engine's other processes on this machine, since the engine was built [s]."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    @property
    def steps(self) -> int:
        """Number of steps made since the start."""

    @property
    def time_step(self) -> float:
        """Time step, dt [s]."""

    def set_time_step(self, time_step: float) -> None:
        """Set the length of all further steps [s]."""

    def advance(self, steps: int) -> None:
        """Make `steps` steps, none if negative; raise RunError if the engine stops before the last one."""

    # -- bodies ------------------------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        """Number of bodies present, N."""

    def add(self, poses: Poses, *, speed: float = 0.0) -> None:
        """Add bodies at poses, with a downward speed [m/s] and without rotation; smarticles are welded."""

    def still(self) -> None:
        """Set all velocities to zero; the kinetic energy counts as dissipated. Smarticles must be welded."""

    def state(self) -> PileState:
        """Return poses and velocities of all bodies; raise RunError if one is not finite."""

    @property
    def impulse(self) -> float:
        """Downward momentum from gravity, and from initial speeds of added bodies, since the start [N s]."""

    def unbalanced_force(self) -> float:
        """Return the mean net force on a body over its weight [1]: 0 at rest, 1 in free fall.

        The value is inf without bodies or without gravity.
        """

    def neighbours(self) -> Numbers:
        """Return (N,) the number of other bodies that each body touches."""

    def touches(self) -> Numbers:
        """Return (N,) the number of contacts of each body with other bodies and boundaries."""

    def overlaps(self, limit: float) -> Overlaps:
        """Return the present overlaps; `Overlaps.deep` marks bodies with an overlap above `limit` [m]."""

    def contact_forces(self) -> ContactForces:
        """Return the forces at all contacts, one contact per pair of links or of a link and a boundary.

        Forces are present ones or, on some engines, those of the last step.
        """

    def extremes(self, state: PileState) -> Extremes | None:
        """Return the largest speed, largest overlap and other extremes of all bodies, to check limits fast.

        None: on this engine extremes are not faster than a check of each body, or each body must be checked since the
        extremes alone do not show that all limits hold.
        """

    # -- checkpoints -------------------------------------------------------------------------------------------

    def save(self, scratch: Path) -> Saved:
        """Return the state, from which `load` continues with identical bits."""

    def load(self, saved: Saved, scratch: Path) -> None:
        """Replace the state by one that `save` returned for an engine of this scene."""
