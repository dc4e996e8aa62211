"""A running simulation on YADE, which keeps its scene in a singleton: one simulation per process."""

import math
from pathlib import Path

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.forces import ContactForces
from dem.body.kinds import Mixture
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import PileState
from dem.engine.effect import Adds, EffectName
from dem.engine.interface import Saved
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.boundaries import YadeBoundaries
from dem.engine.yade.construction import ADDS, add_engines, add_materials
from dem.engine.yade.contacts import contact_forces, contacts_of, measure_overlaps
from dem.engine.yade.filaments import YadeFilaments
from dem.engine.yade.hinges import HingeLaw
from dem.engine.yade.ledger import YadeLedger
from dem.engine.yade.library import load_yade, rows_of
from dem.engine.yade.motors import YadeMotors
from dem.engine.yade.strings import YadeStrings
from dem.errors import RunError
from dem.physics.contact import ContactLaw
from dem.physics.motor import MotorLaw
from dem.physics.overlaps import Overlaps
from dem.setting.container import Cylinder
from dem.setting.hooks import Cross
from dem.setting.plane import Channel

SCRATCH = ".engine.partial.yade"


class YadeEngine:
    """`dem.engine.interface.Engine` on YADE.

    Args:
        gravity: g, downwards [m/s²].
        time_step: dt of the first steps [s].
        shaken: whether the container will be shaken, which needs a further engine of YADE.
        hinge_law: law of the hinges; None if smarticles stay welded.
        motor_law: law of the motors; None if smarticles stay welded.
        track_work: whether to sum the work of moving boundaries.
        dissipation_interval: time between samples of the dissipation [s]; None: no samples.
        hooks: the lower and the upper hook; None: no hooks.
        channel: table and walls instead of the container; all motion is then confined to a plane.
        strengths: (N, 2) factors on torque limit and stiffness of the motors [1]; None: 1 for all motors.
    """

    def __init__(
        self,
        *,
        particle: Particle | Mixture,
        cylinder: Cylinder,
        law: ContactLaw,
        gravity: float,
        time_step: float,
        shaken: bool,
        hinge_law: HingeLaw | None = None,
        motor_law: MotorLaw | None = None,
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
        self.cpu_elsewhere = 0.0
        self.gravity = gravity
        self._smarticle_seconds = 0.0
        self._thrown = 0.0
        # (step, value) of the unbalanced force at loading, since YADE does not save forces.
        self._loaded: tuple[int, float] | None = None
        called_for = {
            EffectName.CONTACT: True,
            EffectName.CONTAINER: channel is None,
            EffectName.CONTAINER_MOTION: shaken,
            EffectName.ARTICULATION: hinge_law is not None,
            EffectName.HOOKS: hooks is not None,
            EffectName.FILAMENTS: isinstance(particle, Mixture) and particle.flexible,
        }
        adds = Adds.together(ADDS[effect] for effect, on in called_for.items() if on)
        add_materials(self._yade, adds, law)
        self.boundaries = YadeBoundaries(self._yade, cylinder, hooks, channel)
        self.filaments: YadeFilaments | None = None
        if isinstance(particle, Mixture) and particle.flexible:
            self.filaments = YadeFilaments(self._yade, particle, gravity, self.boundaries.container)
        self._assembly = self.filaments or Assembly(
            self._yade, particle, hinge_law, planar=channel is not None, strengths=strengths
        )
        self.ledger = YadeLedger(
            self._yade, self._assembly, self.boundaries, works=track_work, dissipation_interval=dissipation_interval
        )
        self.boundaries.book_removal = self.ledger.book_removal
        self.motors = YadeMotors(self._yade, self._assembly, self.ledger, motor_law, strengths)
        self.strings = YadeStrings(self._yade, self._assembly)
        self.grips = None
        add_engines(self._yade, adds, law, hinges=hinge_law, gravity=gravity, radius=particle.radius)
        self.set_time_step(time_step)
        self.boundaries.bind()
        self._assembly.bind()

    def save(self, scratch: Path) -> Saved:
        # YADE orders bodies and contacts differently after loading, and sums of forces depend on the order. The running
        # simulation loads what it has saved, so that a resumed run gives identical bits.
        file = scratch / SCRATCH
        try:
            self._store(file)
            memory = {
                "assembly": self._assembly.memory,
                "motors": self.motors.memory,
                "smarticle_seconds": self._smarticle_seconds,
                "thrown": self._thrown,
                "fixtures": self.boundaries.memory,
                "strings": self.strings.memory,
                "account": self.ledger.memory,
                "unbalanced": self.unbalanced_force(),
            }
            saved = Saved(content=file.read_bytes(), memory=memory)
            self._load(file, saved)
        finally:
            file.unlink(missing_ok=True)
        return saved

    def load(self, saved: Saved, scratch: Path) -> None:
        file = scratch / SCRATCH
        try:
            file.write_bytes(saved.content)
            self._load(file, saved)
        finally:
            file.unlink(missing_ok=True)

    def _store(self, file: Path) -> None:
        try:
            self._omega.save(str(file))
        except RuntimeError as error:  # of the stream that YADE's library writes into
            raise RunError(
                f"{file}: the state cannot be written ({error}); free space, or raise the limit of a file's size, and "
                "go on with `smarticles run … --resume`; the checkpoint before is whole"
            ) from error

    def _load(self, file: Path, saved: Saved) -> None:
        memory = saved.memory
        self._omega.load(str(file), quiet=True)
        self._assembly.restore(memory["assembly"])
        self._smarticle_seconds = memory["smarticle_seconds"]
        self._thrown = memory.get("thrown", 0.0)  # absent in older checkpoints
        self.boundaries.restore(memory["fixtures"])
        self.strings.restore(memory["strings"])
        self.ledger.restore(memory["account"])
        self.motors.restore(memory["motors"])
        self.boundaries.bind()
        self._assembly.bind()
        self._loaded = (self.steps, memory["unbalanced"])

    def set_time_step(self, time_step: float) -> None:
        """Set the length of all further steps [s].

        Velocities belong to the middles of steps. A change of the length by Δ [s] causes an error of velocities of Δ/2
        times the present acceleration, which is negligible in a pile at rest.
        """
        self.time_step = self._omega.dt = time_step
        self.ledger.set_time_step(time_step)

    @property
    def time(self) -> float:
        return float(self._omega.time)

    @property
    def steps(self) -> int:
        return int(self._omega.iter)

    def advance(self, steps: int) -> None:
        if steps <= 0:
            return
        step, target, measured = self._omega.step, self.steps + steps, bool(self.boundaries.measured)
        tied, filaments = self.strings.tied, self.filaments
        # One call per step costs 1 µs; YADE's own loop runs in the background and would have to be polled. Ctrl-C
        # arrives between two steps.
        for number in range(self.steps + 1, target + 1):
            if tied:
                self.ledger.container_work += self.strings.pull(self.time_step)
            if filaments is not None:
                filaments.resist(self.time_step)
            self.ledger.step(number, step)
            if measured:
                self.boundaries.sum_forces()
        if self._assembly.hinges is not None:
            self._assembly.hinges.moved()
        if self.steps != target:
            msg = f"YADE stopped at step {self.steps} of {target} (t = {self.time:.4f} s); see its message above"
            raise RunError(msg)
        self._smarticle_seconds += steps * self.time_step * float(self._relative_weights.sum())

    @property
    def count(self) -> int:
        return self._assembly.count

    def add(self, poses: Poses, *, speed: float = 0.0) -> None:
        self.ledger.added += self._assembly.add(poses, speed=speed)
        mass, heights = self.particle.mass, poses.positions[:, 2]
        first = self.count - len(heights)
        new, weights = float(self._relative_masses[first:].sum()), self._relative_weights[first:]
        self.ledger.added += mass * (self.gravity * float((weights * heights).sum()) + new * speed**2 / 2)
        self._thrown += mass * new * speed

    @property
    def _relative_masses(self) -> Array:
        """(N,) masses of the bodies, over the mean mass of the scene's bodies [1]; exactly 1 for smarticles."""
        return self._assembly.masses / self.particle.mass

    @property
    def _relative_weights(self) -> Array:
        """(N,) weights, less buoyancy, of the bodies, over the mean full weight of the scene's bodies [1]."""
        return self._relative_masses * self._assembly.weight_shares

    def still(self) -> None:
        self.ledger.dissipated += self.state().kinetic_energy
        self._assembly.still()

    def state(self) -> PileState:
        return self._assembly.pile()

    @property
    def impulse(self) -> float:
        return self._smarticle_seconds * self.particle.mass * self.gravity + self._thrown

    def neighbours(self) -> Numbers:
        touching: set[tuple[int, int]] = set()
        smarticle_of = self._assembly.smarticle_of
        for interaction in self._omega.interactions:
            first = smarticle_of.get(interaction.id1)
            second = smarticle_of.get(interaction.id2)
            if first is None or second is None or first == second or not interaction.isReal:
                continue
            if interaction.phys.normalForce.squaredNorm() > 0:
                touching.add((first, second) if first < second else (second, first))
        pairs = np.array(list(touching), dtype=np.int64).ravel()
        return np.bincount(pairs, minlength=self.count)

    def touches(self) -> Numbers:
        # Contacts of spheres are counted one by one.
        smarticle_of = self._assembly.smarticle_of
        bodies = (body for i in contacts_of(self._yade, self._assembly) for body in (i.id1, i.id2))
        owners = [smarticle_of[body] for body in bodies if body in smarticle_of]
        return np.bincount(np.array(owners, dtype=np.int64), minlength=self.count)

    def overlaps(self, limit: float) -> Overlaps:
        return measure_overlaps(self._yade, self._assembly, self.boundaries, self._law, limit)

    def contact_forces(self) -> ContactForces:
        return contact_forces(self._yade, self._assembly, self.boundaries)

    def extremes(self, state: PileState) -> None:
        """Return None: on YADE extremes are not cheaper than a full check."""

    def unbalanced_force(self) -> float:
        # YADE's own measure omits gravity for bodies whose contact forces are exactly zero or balance exactly, which is
        # wrong for a pile at rest.
        if self._loaded is not None and self._loaded[0] == self.steps:
            return self._loaded[1]
        if not self.count or not self.gravity:
            return math.inf
        if self.filaments is not None:
            return self.filaments.mean_unbalanced()
        weight, relative = self.particle.mass * self.gravity, self._relative_masses
        forces = rows_of(map(self._omega.forces.f, self._assembly.bodies)).reshape(self.count, -1, 3).sum(axis=1)
        forces[:, 2] -= weight * relative
        return float(np.linalg.norm(forces, axis=1).mean() / (weight * float(relative.mean())))
