"""The running simulation behind a small interface.

Heights, velocities and forces are in the laboratory frame. One process runs one simulation: YADE keeps its scene in a
process-wide singleton.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import State
from dem.engine.yade.account import Account
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.construction import add_engines, add_materials
from dem.engine.yade.fixtures import Fixtures
from dem.engine.yade.hinges import HingeLaw, Hinges
from dem.engine.yade.library import load_yade
from dem.engine.yade.strain import Strain, measure_strain
from dem.errors import RunError
from dem.phases.chain import Tie
from dem.physics.motor import MotorLaw, Motors
from dem.physics.stability import ContactLaw
from dem.physics.strings import StringLaw, Strings, tied
from dem.plan import effects
from dem.setting.container import Cylinder
from dem.setting.hooks import Cross
from dem.setting.plane import Channel

Array = NDArray[np.float64]


class Engine:
    """A cylinder that smarticles are added to and that time is advanced in.

    Args:
        particle: one smarticle.
        cylinder: the container; its floor is at z = 0 at the start.
        law: contact law.
        gravity: g, downwards [m/s²].
        time_step: dt [s], until another is set.
        shaken: whether the container will move; the engine that moves it exists only then.
        hinges: stiffness of the hinges and what all motors have in common; None where smarticles stay welded: then
            nothing of a hinge exists.
        track_work: whether to add up the work of the moving container.
        dissipation_interval: time between samples of what is dissipated [s]; None: never.
        hooks: the lower and the upper hook; None: nothing of a hook exists.
        channel: table and walls instead of the container; all motion is then confined to a plane.
        strengths: (N, 2) factors on what the motors can do [1]; None: all are alike.

    Raises:
        RunError: YADE is not installed.
    """

    def __init__(
        self,
        *,
        particle: Particle,
        cylinder: Cylinder,
        law: ContactLaw,
        gravity: float,
        time_step: float,
        shaken: bool,
        hinges: tuple[HingeLaw, MotorLaw] | None = None,
        track_work: bool = False,
        dissipation_interval: float | None = None,
        hooks: tuple[Cross, Cross] | None = None,
        channel: Channel | None = None,
        strengths: Array | None = None,
    ) -> None:
        self._yade = load_yade()
        self._omega = self._yade.omega
        self._law = law
        self.particle = particle
        self.cylinder = cylinder
        self.gravity = gravity
        self.motors: Motors | None = None
        """The motors of all smarticles; None before the first articulation."""
        hinge_law: HingeLaw | None = None
        self._motor_law: MotorLaw | None = None
        if hinges is not None:
            hinge_law, self._motor_law = hinges
        self._strengths = strengths
        self._assembly = Assembly(
            self._yade, particle, hinge_law, planar=channel is not None, strengths=self._strengths
        )
        self._smarticle_seconds = 0.0
        # (step, value) of the unbalanced force when the simulation was loaded: forces are not saved.
        self._loaded: tuple[int, float] | None = None
        called_for = {
            effects.CONTACT: True,
            effects.CONTAINER: channel is None,
            effects.CONTAINER_MOTION: shaken,
            effects.ARTICULATION: hinges is not None,
            effects.HOOKS: hooks is not None,
        }
        adds = effects.Adds.together(effect.adds for effect, on in called_for.items() if on)
        add_materials(self._yade, adds, law)
        self.fixtures = Fixtures(self._yade, cylinder, hooks, channel)
        """The container and the hooks, or the channel."""
        self.strings: Strings | None = None
        """Strings tied to smarticles at present."""
        self.account = Account(
            self._yade,
            self._assembly,
            self.fixtures,
            works=track_work,
            dissipation_interval=dissipation_interval,
        )
        """Work and dissipation since the start."""
        add_engines(
            self._yade,
            adds,
            law,
            hinges=hinge_law,
            gravity=gravity,
            radius=particle.radius,
        )
        self.set_time_step(time_step)
        self._bind()

    def _bind(self) -> None:
        """Take hold of YADE's objects; loading replaces them all."""
        engines, classes = self._omega.engines, self._yade.classes
        self.fixtures.bind()
        self._shaker = next((e for e in engines if isinstance(e, classes.HarmonicMotionEngine)), None)
        self._collider = next(e for e in engines if isinstance(e, classes.InsertionSortCollider))
        self._assembly.bind()

    def save(self, path: Path) -> dict[str, Any]:
        """Save the simulation into a file.

        Returns:
            Plain data that `load` needs besides the file.
        """
        self._omega.save(str(path))
        return {
            "assembly": self._assembly.memory,
            "motors": None if self.motors is None else self.motors.memory,
            "smarticle_seconds": self._smarticle_seconds,
            "fixtures": self.fixtures.memory,
            "strings": None if self.strings is None else self.strings.memory,
            "account": self.account.memory,
            "unbalanced": self.unbalanced_force(),
        }

    def load(self, path: Path, memory: Mapping[str, Any]) -> None:
        """Replace the simulation by a saved one of the same scene.

        Args:
            path: the file.
            memory: what `save` returned.
        """
        self._omega.load(str(path), quiet=True)
        self._assembly.restore(memory["assembly"])
        self._smarticle_seconds = memory["smarticle_seconds"]
        self.fixtures.restore(memory["fixtures"])
        if memory["strings"] is not None:
            self.strings = Strings.restored(self._yade, memory["strings"])
        self.account.restore(memory["account"])
        if memory["motors"] is not None:
            assert self._motor_law is not None  # a checkpoint belongs to its scene
            self.motors = Motors(self._motor_law, np.zeros((self.count, 2)), self._strengths)
            self.motors.restore(memory["motors"])
        self._bind()
        self._loaded = (self.steps, memory["unbalanced"])

    def add(self, poses: Poses) -> None:
        """Add smarticles at rest."""
        self._assembly.add(poses)
        self.account.added += self.particle.boxes.mass * self.gravity * float(poses.positions[:, 2].sum())

    # -- time --------------------------------------------------------------------------------------------------

    def set_time_step(self, time_step: float) -> None:
        """Take steps of another length [s] from now on.

        Velocities belong to the middles of steps: a change of the length by Δ puts them in error by Δ/2 times the
        acceleration at this moment, next to nothing in a pile at rest.
        """
        self.time_step = self._omega.dt = time_step
        self.account.count_in(time_step)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._omega.time)

    @property
    def steps(self) -> int:
        """Steps made."""
        return int(self._omega.iter)

    def advance(self, steps: int) -> None:
        """Advance by whole steps; none for a number that is not positive.

        Raises:
            RunError: YADE stopped before the last step.
        """
        if steps <= 0:
            return
        step, target, felt = self._omega.step, self.steps + steps, bool(self.fixtures.felt)
        # One call per step: 1 µs, where YADE's own loop in the background would be waited for by polling. Ctrl-C
        # arrives between two steps.
        for number in range(self.steps + 1, target + 1):
            if self.strings is not None:
                self.account.container_work += self.strings.pull(self.time_step)
            self.account.step(number, step)
            if felt:
                self.fixtures.feel()
        if self._assembly.hinges is not None:
            self._assembly.hinges.moved()
        if self.steps != target:
            msg = f"YADE stopped at step {self.steps} of {target} (t = {self.time:.4f} s); see its message above"
            raise RunError(msg)
        self._smarticle_seconds += steps * self.time_step * self.count

    def shake(self, *, amplitude: float, frequency: float) -> None:
        """Move what is there of the container as z = A sin(2πf t), t from now; it starts where it is.

        Args:
            amplitude: A [m].
            frequency: f [Hz].
        """
        if self._shaker is None:
            msg = "the engine was built without a shaker"
            raise RunError(msg)
        # YADE sets v(t) = -Aω sin(ωt + φ) before the integrator moves by v dt. Half a step is added to the phase, so
        # that each move uses the velocity at its middle and the position follows z(t) to second order, without drift.
        omega = 2 * math.pi * frequency
        phase = -math.pi / 2 - omega * (self.time - self.time_step / 2)
        self._shaker.A = self._yade.vector(0, 0, amplitude)
        self._shaker.f = self._yade.vector(0, 0, frequency)
        self._shaker.fi = self._yade.vector(0, 0, phase)
        self._shaker.ids = self.fixtures.moving = self.fixtures.bodies
        self._shaker.dead = False

    def remove_wall(self) -> None:
        """Take the container's wall away; what its contacts had stored is lost."""
        self.account.removed(self.fixtures.remove_wall)

    def stop_container(self) -> None:
        """Bring the container to rest where it is."""
        if self._shaker is not None:
            self._shaker.dead = True
        self.fixtures.stop()

    # -- articulation ------------------------------------------------------------------------------------------

    @property
    def hinged(self) -> bool:
        """Whether the scene has hinges and motors, at work or not."""
        return self._motor_law is not None

    @property
    def articulated(self) -> bool:
        """Whether smarticles are three hinged links at present."""
        return self._assembly.hinges is not None

    def articulate(self) -> None:
        """Split welded smarticles into hinged links, their motors holding the barbs where they are."""
        if self.articulated:
            return
        assert self._motor_law is not None  # the engine was built for scenes that never articulate
        self._assembly.articulate()
        # Spheres of one smarticle may touch each other from now on: neighbours must be looked for anew.
        self._collider.doSort = True
        angles = self._hinges.angles()
        if self.motors is None:
            self.motors = Motors(self._motor_law, angles, self._strengths)
        else:
            self.motors.engage(angles)

    def weld(self) -> None:
        """Make each smarticle one rigid body of the shape that it has: motors that hold, at a third of the cost."""
        self.account.dissipated += self._assembly.weld()

    def actuate(self, targets: Array, interval: float) -> None:
        """Let the motors look at their barbs and act for one control period.

        Args:
            targets: (N, 2) angles at the end of the period according to the schedule [rad].
            interval: length of the period [s].
        """
        assert self.motors is not None  # only articulated smarticles are actuated
        rates = self._hinges.rates() if self.motors.law.damping else None
        torques = self.motors.look(self._hinges.angles(), targets, interval, self.time_step, rates)
        self._hinges.set_torques(torques, self.time_step)

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        """Tie a string to each of some points of articulated smarticles, see `dem.physics.strings.tied`."""
        ends = tied(self.state(), self._assembly, ties, law, speeds)
        self.strings = Strings(self._yade, law, ends)

    def untie(self) -> None:
        """Let go of all strings."""
        if self.strings is not None:
            self.strings.release()
            self.strings = None

    @property
    def motor_work(self) -> float:
        """Work of all motors on the links since the start, up to now [J]."""
        if self.motors is None:
            return 0.0
        return self.motors.work_until(self._hinges.angles()) if self.articulated else float(self.motors.work.sum())

    @property
    def _hinges(self) -> Hinges:
        assert self._assembly.hinges is not None
        return self._assembly.hinges

    def joint_gaps(self) -> Array:
        """(N, 2) how far the hinges have given way [m]; zero while welded."""
        hinges = self._assembly.hinges
        return np.zeros((self.count, 2)) if hinges is None else hinges.gaps()

    # -- state -------------------------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        """Smarticles present."""
        return self._assembly.count

    @property
    def gravity_impulse(self) -> float:
        """What gravity has given to all smarticles, each since it was added [N s], downwards."""
        return self._smarticle_seconds * self.particle.boxes.mass * self.gravity

    @property
    def floor(self) -> float:
        """Height of the container's floor [m]."""
        return float(self.fixtures.floor.pos[2])

    @property
    def container_velocity(self) -> float:
        """Vertical velocity of the container [m/s]."""
        return float(self.fixtures.floor.vel[2])

    def state(self) -> State:
        """Poses and velocities of all smarticles."""
        return self._assembly.state()

    def contacts(self) -> NDArray[np.int64]:
        """(N,) int64: how many other smarticles each one touches."""
        touching: set[tuple[int, int]] = set()
        smarticle_of = self._assembly.smarticle_of
        for interaction in self._omega.interactions:
            first = smarticle_of.get(interaction.id1)
            second = smarticle_of.get(interaction.id2)
            if first is None or second is None or first == second or not interaction.isReal:
                continue
            if interaction.phys.normalForce.squaredNorm() > 0:
                touching.add((first, second) if first < second else (second, first))
        result = np.zeros(self.count, dtype=np.int64)
        for pair in touching:
            result[list(pair)] += 1
        return result

    def touches(self) -> NDArray[np.int64]:
        """(N,) int64: contacts of each smarticle with others and with the container, spheres counted singly."""
        result = np.zeros(self.count, dtype=np.int64)
        smarticle_of = self._assembly.smarticle_of
        for interaction in self._omega.interactions:
            if interaction.isReal:
                for body in (interaction.id1, interaction.id2):
                    k = smarticle_of.get(body)
                    if k is not None:
                        result[k] += 1
        return result

    def strain(self, limit: float) -> Strain:
        """How far contacts and hinges are strained at present, and who has contacts deeper than a limit [m]."""
        return measure_strain(self._yade, self._assembly, self.fixtures, self._law, limit)

    def container_force(self) -> Array:
        """(3,) [N]: force of the smarticles on the container in the last step."""
        force = np.zeros(3)
        for body in self.fixtures.container:
            force += self._omega.forces.f(body)
        return force

    def unbalanced_force(self) -> float:
        """Mean net force on a smarticle over its weight [1]: 0 for a still pile, 1 in free fall, inf when empty.

        YADE's own measure leaves gravity out for a body whose contact forces are exactly zero or balance exactly, and
        so calls a still pile unbalanced.
        """
        if self._loaded is not None and self._loaded[0] == self.steps:
            return self._loaded[1]
        if not self.count or not self.gravity:
            return math.inf
        weight = self.particle.boxes.mass * self.gravity
        rows = [(f[0], f[1], f[2]) for f in map(self._omega.forces.f, self._assembly.bodies)]
        forces = np.array(rows).reshape(self.count, -1, 3).sum(axis=1)
        forces[:, 2] -= weight
        return float(np.linalg.norm(forces, axis=1).mean() / weight)
