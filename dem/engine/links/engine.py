"""A running simulation on the engine links, behind the interface of all engines."""

import io
import json
import math
import zipfile
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.forces import ContactForces, contacts_of_points
from dem.body.kinds import Mixture
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import LinkageState, PileState
from dem.engine.interface import Filaments, Saved
from dem.engine.links.boundaries import LinksBoundaries, ground_for
from dem.engine.links.contact import queries
from dem.engine.links.contact.queries import BETWEEN, DEEPEST, ELASTIC, FASTEST, HIGHEST, LOWEST, WIDEST
from dem.engine.links.filaments import LinksFilaments
from dem.engine.links.grips import LinksGrips
from dem.engine.links.ledger import LinksLedger
from dem.engine.links.linkages import LinksLinkages
from dem.engine.links.motors import LinksMotors
from dem.engine.links.stepping import LOST
from dem.engine.links.strings import LinksStrings
from dem.engine.links.world import World
from dem.errors import InputError
from dem.physics.contact import ContactLaw
from dem.physics.motor import MotorLaw
from dem.physics.overlaps import APART, Extremes, Held, Overlaps, held_between
from dem.record.files import reject_inflated
from dem.setting.container import Cylinder
from dem.setting.hooks import Cross
from dem.setting.plane import Channel

Array = NDArray[np.float64]

# Of a diameter; links whose axes come nearer than the rest of a diameter may have passed through each other.
PASSES = 0.9
# Of a diameter; a body between two boundaries that move apart is held where a contact is deeper, far beyond the
# linear range: nothing but the contacts can give way.
HOLDS = 0.5
FORMAT = "links-6"


class LinksEngine:
    """`dem.engine.interface.Engine` on links.

    Args:
        motor_law: law of the motors; None if smarticles stay welded.
        keep_ledger: whether to sum the energy that contacts dissipate.
        hooks: the lower and the upper hook; None: no hooks.
        channel: table and walls instead of the container; all motion is then confined to a plane.
        strengths: (N, 2) factors on torque limit and stiffness of the motors [1]; None: 1 for all motors.
        wave_seed: seed of the waves of actively bending filaments and linkages.
        gripped: whether grips will hold rigid bodies.
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
        motor_law: MotorLaw | None = None,
        keep_ledger: bool = False,
        hooks: tuple[Cross, Cross] | None = None,
        channel: Channel | None = None,
        strengths: Array | None = None,
        wave_seed: int = 0,
        gripped: bool = False,
    ) -> None:
        self.particle = particle
        self.cylinder = cylinder
        self.gravity = gravity
        self.cpu_elsewhere = 0.0
        self._world = World(
            particle=particle if isinstance(particle, Particle) else None,
            mixture=particle if isinstance(particle, Mixture) else None,
            contact=law,
            ground=ground_for(cylinder, hooks, channel),
            gravity=gravity,
            planar=channel is not None,
            keep_ledger=keep_ledger,
            wave_seed=wave_seed,
        )
        if hooks is not None:
            self._world.add_hooks([cross.bars for cross in hooks])
        for height, radius in () if channel is not None else cylinder.upper:
            self._world.add_rim(height, radius)
        if channel is not None:
            self._world.channel = np.array([math.inf if channel.width is None else channel.width / 2])
        if gripped:
            self._world.allow_grips()
        self.grips = LinksGrips(self._world) if gripped else None
        self.filaments: Filaments | None = None
        if self._world.filaments is not None:
            self.filaments = LinksFilaments(self._world)
        elif self._world.linkages is not None:
            self.filaments = LinksLinkages(self._world)
        self.ledger = LinksLedger(self._world, self.filaments)
        self.boundaries = LinksBoundaries(self._world, cylinder, shaken=shaken, removed=self.ledger.removed)
        self.motors = LinksMotors(self._world, motor_law, strengths)
        self.strings = LinksStrings(self._world)
        self._smarticle_seconds = 0.0
        self._thrown = 0.0
        self._world.set_time_step(time_step)

    # -- time --------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        return self._world.time

    @property
    def steps(self) -> int:
        return self._world.steps

    @property
    def time_step(self) -> float:
        return self._world.time_step

    def set_time_step(self, time_step: float) -> None:
        """Set the length of all further steps [s].

        Velocities belong to the middles of steps. A change of the length by Δ [s] causes an error of velocities of Δ/2
        times the present acceleration, which is negligible in a pile at rest.
        """
        if time_step != self.time_step:
            self._world.set_time_step(time_step)

    def advance(self, steps: int) -> None:
        if steps > 0:
            self._world.advance(steps)
            self._smarticle_seconds += steps * self.time_step * float(self._relative_weights.sum())

    # -- smarticles --------------------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        return self._world.count

    def add(self, poses: Poses, *, speed: float = 0.0) -> None:
        before = self.ledger.deformation
        self._world.add(poses, speed=speed)
        mass, heights = self._first_mass, poses.positions[:, 2]
        first = self.count - len(heights)
        new = float(self._relative_masses[first:].sum())
        weights = self._relative_weights[first:]
        self.ledger.added += mass * (self.gravity * float((weights * heights).sum()) + new * speed**2 / 2)
        self.ledger.added += self.ledger.deformation - before
        self._thrown += mass * new * speed

    @property
    def _first_mass(self) -> float:
        """Mass of a body of the first kind [kg]."""
        return float(self._world.shapes.mass[0])

    @property
    def _relative_masses(self) -> Array:
        """(N,) masses of the bodies, over the mass of a body of the first kind [1]; exactly 1 for smarticles."""
        masses = self._world.shapes.mass
        return np.asarray((masses / masses[0])[self._world.bodies.shape])

    @cached_property
    def _weights_of_kinds(self) -> Array:
        """(K,) weights, less buoyancy, of bodies of each kind, over the full weight of the first kind [1]."""
        rods, masses = [kind.filament for kind in self._world.kinds], self._world.shapes.mass
        return np.asarray(masses / masses[0] * [1.0 if rod is None else rod.weight_share for rod in rods])

    @property
    def _relative_weights(self) -> Array:
        """(N,) weights, less buoyancy, of the bodies, over the full weight of a body of the first kind [1]."""
        return np.asarray(self._weights_of_kinds[self._world.bodies.shape])

    def still(self) -> None:
        assert self.filaments is None  # only the bodies of another run are stopped, and no run hands filaments on
        assert not self.motors.articulated  # links that are at rest would be told otherwise by their motors
        world = self._world
        world.totals[LOST] += self.state().kinetic_energy
        for moving in (world.bodies.velocity, world.bodies.momentum, world.bodies.spin):
            moving[:] = 0.0

    def state(self) -> PileState:
        return self._world.state()

    @property
    def impulse(self) -> float:
        return self._smarticle_seconds * self._first_mass * self.gravity + self._thrown

    def unbalanced_force(self) -> float:
        if not self.count or not self.gravity:
            return math.inf
        if self.filaments is not None:
            return self.filaments.mean_unbalanced()
        weight, relative = self._first_mass * self.gravity, self._relative_masses
        forces = self._world.bodies.load[:, :3] - weight * relative[:, None] * [0.0, 0.0, 1.0]
        if self._world.grips is not None:  # what is held is in no balance
            forces[self._world.grips.of != 0] = 0.0
        return float(np.linalg.norm(forces, axis=1).mean() / (weight * float(relative.mean())))

    def neighbours(self) -> NDArray[np.int64]:
        pairs = self._world.contacts().pairs
        if self.filaments is not None:  # which may touch themselves
            pairs = pairs[pairs[:, 0] != pairs[:, 1]]
        # Two numbers as one: rows are sorted twenty times slower.
        both = np.unique(pairs[:, 0] * self.count + pairs[:, 1])
        return np.bincount(np.concatenate(np.divmod(both, max(1, self.count))), minlength=self.count)

    def touches(self) -> NDArray[np.int64]:
        return self._world.contacts().touches

    def overlaps(self, limit: float) -> Overlaps:
        """Return the present overlaps; `Overlaps.deep` marks bodies with an overlap above `limit` [m].

        Overlaps in the steps since the last check count as well where they were above `PASSES` of the overlap at which
        axes meet, since links may then have passed through each other. A body that is held between two boundaries is
        marked above an overlap of `HOLDS` diameters, even if `limit` is larger.
        """
        found, world = self._world.contacts(), self._world
        between = world.bodies.deepest.copy()
        world.bodies.deepest[:] = 0.0
        passed = ~(between <= PASSES)
        diameter = self.particle.diameter
        depths = diameter * np.where(passed, np.maximum(found.depths, between), found.depths)
        deep = ~(depths <= limit)
        held = self._held(found.held, ~(depths <= min(limit, HOLDS * diameter)), APART * diameter)
        deep[[one.smarticle for one in held]] = True
        elastic = found.elastic_energy + self.ledger.deformation
        return Overlaps(float(depths.max(initial=0.0)), deep, elastic, held)

    def contact_forces(self) -> ContactForces:
        """Return the contact forces at the beginning of the next step."""
        rows = self._world.forces()
        first, second = rows[:, : queries.PRESSED].astype(np.int64).T
        return contacts_of_points(
            first,
            second,
            loads=rows[:, queries.PRESSED],
            points=rows[:, queries.POINT : queries.FRICTION],
            friction=rows[:, queries.FRICTION : queries.WHOLE],
            forces=rows[:, queries.WHOLE :],
            each=self._world.each,
        )

    def extremes(self, state: PileState) -> Extremes | None:
        """Return extremes over all bodies; None if an overlap is so large that a full check is needed.

        `Extremes.gap` is the widest gap at a joint of a linkage; 0 for other bodies, since hinges are rigid.
        """
        if state.bodies is None:
            velocities = state.smarticles.link_velocities.reshape(-1, 3)
        else:
            velocities = state.bodies.bar_velocities
        found, bodies = self._world.extremes(np.ascontiguousarray(velocities)), self._world.bodies
        if not (found[BETWEEN] <= PASSES and found[DEEPEST] <= HOLDS):
            return None
        bodies.deepest[:] = 0.0
        return Extremes(
            fastest=found[FASTEST],
            lowest=found[LOWEST],
            highest=found[HIGHEST],
            widest=found[WIDEST],
            gap=float(state.gaps.max(initial=0.0)) if isinstance(state, LinkageState) else 0.0,
            deepest=found[DEEPEST] * self.particle.diameter,
            elastic_energy=found[ELASTIC] + self.ledger.deformation,
        )

    def _held(self, held: NDArray[np.bool_], deep: NDArray[np.bool_], least: float) -> tuple[Held, ...]:
        """Return the deep bodies that touch two boundaries whose distance has changed.

        For each body, `held` (N, 7) says whether it touches each boundary, `deep` (N,) whether it has a deep contact;
        `least` is the smallest change of distance that counts [m].
        """
        parts = self.boundaries.parts() if deep.any() else {}
        touched = {int(k): [name for name, (part, _) in parts.items() if held[k, part]] for k in np.flatnonzero(deep)}
        return held_between(touched, {name: raised for name, (_, raised) in parts.items()}, least)

    # -- checkpoints -------------------------------------------------------------------------------------------

    def save(self, scratch: Path) -> Saved:
        content = io.BytesIO()
        motors = {f"motors.{name}": array for name, array in self.motors.arrays.items()}
        np.savez(content, **self._world.arrays, **motors)  # type: ignore[arg-type] # the stubs take any keyword for allow_pickle
        memory: dict[str, Any] = {
            "format": FORMAT,
            "world": self._world.memory,
            "added": self.ledger.added,
            "smarticle_seconds": self._smarticle_seconds,
            "thrown": self._thrown,
        }
        return Saved(content=content.getvalue(), memory=json.loads(json.dumps(memory)))

    def load(self, saved: Saved, scratch: Path) -> None:
        """Replace the state by a saved one; this engine needs no files in `scratch`.

        InputError if another engine or version saved the state, or it is damaged.
        """
        if saved.memory.get("format") != FORMAT:
            raise InputError(
                f"checkpoint: format {saved.memory.get('format')!r}, here is {FORMAT!r}; it was made by another engine "
                "or version: resume with that, or start anew"
            )
        try:
            with np.load(io.BytesIO(saved.content)) as file:
                reject_inflated(file.zip, len(saved.content))
                arrays = {name: file[name] for name in file.files}
        except (zipfile.BadZipFile, ValueError, OSError) as error:
            raise InputError(f"checkpoint: not readable by the links engine ({error}); start the run anew") from error
        self._world.restore(arrays, saved.memory["world"])
        prefix = "motors."
        self.motors.restore({name[len(prefix) :]: array for name, array in arrays.items() if name.startswith(prefix)})
        self.ledger.added = saved.memory["added"]
        self._smarticle_seconds = saved.memory["smarticle_seconds"]
        self._thrown = saved.memory["thrown"]
