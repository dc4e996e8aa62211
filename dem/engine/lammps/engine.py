"""A running simulation on LAMMPS, in a child process on one or several ranks."""

import io
import json
import math
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from scipy.spatial.transform import Rotation

from dem.arrays import Array, Numbers
from dem.body.chain import Tie
from dem.body.kinds import Kind, Mixture, bodies_of, body_of
from dem.body.linear import matrix_product
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.body.state import PileState, RigidState, State, spheres_of
from dem.engine.interface import MotorReadings, Saved
from dem.engine.lammps import text
from dem.engine.lammps.boundaries import LammpsBoundaries
from dem.engine.lammps.child import Child
from dem.engine.lammps.contacts import Contacts
from dem.engine.lammps.text import Moving
from dem.errors import InputError, RunError
from dem.physics.contact import ContactLaw, StringLaw
from dem.physics.overlaps import Overlaps
from dem.record.files import reject_inflated
from dem.setting.container import Cylinder

FORMAT = "lammps-2"
SPHERES, BODIES, RESTART, STATE = "spheres.data", "bodies.txt", "restart", "state.npz"
FORGET_BODIES = ("undump bodies", "uncompute where", "unfix bodies")
HEAD = 9  # lines of a dump before its rows


def absent(what: str) -> NoReturn:
    """Raise RunError for a feature `what` that the engine lacks; scenes that need it are rejected before."""
    raise RunError(f"engine: lammps has no {what}")


class NoMotors:
    """`dem.engine.interface.Motors` for smarticles that stay welded."""

    present = False
    articulated = False
    updates_at_once = 1
    readings: MotorReadings | None = None
    work = 0.0

    def articulate(self) -> None:
        absent("motors")

    def weld(self) -> None:
        pass

    def actuate(self, targets: Array, interval: float) -> None:
        absent("motors")

    def gaps(self) -> Array:
        return np.zeros((0, 2))


class NoStrings:
    """`dem.engine.interface.Strings` of an engine without strings."""

    tied = False
    pulled = math.nan
    sums = ties = np.zeros((0, 3))

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        absent("strings")

    def untie(self) -> None:
        pass


class LammpsLedger:
    """`dem.engine.interface.EnergyLedger` without the work of boundaries and the dissipation of contacts.

    `moving` returns whether a boundary moves, `stored` the elastic energy of contacts [J].
    """

    container_work = 0.0

    def __init__(self, moving: Callable[[], bool], stored: Callable[[], float]) -> None:
        self._moving, self._stored = moving, stored
        self.added = self.dissipated = 0.0

    @property
    def given(self) -> float:
        return math.nan if self._moving() else self.added + self.container_work

    def elastic(self) -> tuple[float, float]:
        return self._stored(), 0.0

    def take_in(self) -> None:
        self.added += self.elastic()[0]


class LammpsEngine:
    """`dem.engine.interface.Engine` on LAMMPS.

    LAMMPS integrates the motion, and writes the bodies' poses and velocities to a file after each advance. All other
    quantities are computed here from that file.
    """

    def __init__(
        self,
        *,
        particle: Particle | Mixture,
        cylinder: Cylinder,
        law: ContactLaw,
        gravity: float,
        time_step: float,
        ranks: int = 1,
    ) -> None:
        self.particle: Particle | Mixture = particle
        self.cylinder = cylinder
        self.gravity = gravity
        self.time, self.steps, self.time_step = 0.0, 0, time_step
        self._law = law
        self.child = Child(ranks)  #: The process of LAMMPS
        self._cpu_before = 0.0  # processor time of earlier LAMMPS processes [s]
        self._moving = Moving.none()
        self._kinds = np.zeros(0, dtype=np.int64)  # of a mixture, the kind of each body
        # (N, 3, 3) rotations from the body frame to LAMMPS's principal frame, known after the first dump.
        self._frames: Array | None = None
        self._fresh = True  # whether the next run must be set up
        self._box = False
        self._seconds = 0.0
        self._thrown = 0.0
        self._contacts: Contacts | None = None
        self.boundaries: LammpsBoundaries = LammpsBoundaries(cylinder, self._send, lambda: (self.steps, self.time_step))
        self.motors, self.strings, self.filaments, self.grips = NoMotors(), NoStrings(), None, None
        self.ledger: LammpsLedger = LammpsLedger(
            lambda: self.boundaries.moving, lambda: self.contacts.elastic_energy(law)
        )

    def _send(self, commands: Iterator[str]) -> None:
        """Send commands to LAMMPS, and make its next `run` compute all forces anew at the start.

        Before the first bodies are added, LAMMPS has no simulation box and nothing is sent. What the commands set is
        then part of the commands that `_scene` yields for the new box.
        """
        self._contacts = None
        if self._box:
            self.child.send(*commands)
            self._fresh = True

    def _scene(self, box: str) -> Iterator[str]:
        """Yield all commands that a new LAMMPS process needs before those of the rigid bodies.

        `box` is the command that makes the simulation box with its spheres, `read_data` or `read_restart` with a file.
        """
        between, at_wall = text.contact_terms(self._law, self._reference.mass)
        yield from text.before_box(self.particle)
        # Vertical cuts divide the pile among ranks: above a horizontal cut there would be little work.
        yield "processors * * 1"
        yield box
        yield from text.neighbours(self.particle)
        yield f"pair_style gran/hooke/history {between}"
        yield "pair_coeff * *"
        yield f"fix weight all gravity {self.gravity:.17g} vector 0 0 -1"
        yield from self.boundaries.variables()
        yield from text.container(self.cylinder, at_wall, walled=self.boundaries.walled)
        yield f"timestep {self.time_step:.17g}"
        yield "thermo 0"
        yield "thermo_style custom step"
        yield "thermo_modify lost error flush yes"

    def _bodies(self, file: str) -> Iterator[str]:
        # After all other fixes, since its set-up needs their forces.
        yield f"fix bodies all rigid/small molecule infile {file} reinit no"
        yield from text.body_dump("bodies.*.dump", when="v_when")

    def _balanced(self) -> Iterator[str]:
        """Yield the command that distributes spheres evenly among ranks; none for one or two ranks."""
        if self.child.ranks > 2:
            yield "balance 1.02 shift xy 20 1.01"

    @property
    def cpu_elsewhere(self) -> float:
        return self._cpu_before + self.child.cpu()

    def set_time_step(self, time_step: float) -> None:
        if time_step == self.time_step:
            return
        if self.boundaries.moving:
            raise RunError("engine: lammps cannot change the time step while the container moves")
        self.time_step = time_step
        self._send(iter((f"timestep {time_step:.17g}",)))

    def advance(self, steps: int) -> None:
        if steps <= 0:
            return
        if self.count:
            self._run(steps)
        elif self._box:
            raise RunError("engine: lammps lost its bodies")
        self.steps += steps
        self.time += steps * self.time_step
        self._seconds += steps * self.time_step * float(self._relative_masses.sum())
        self._contacts = None

    def _run(self, steps: int) -> None:
        target = self.steps + steps
        try:
            self.child.send(
                f"variable when equal {target}+1000000000*(step>={target})",
                f"run {steps} pre {'yes' if self._fresh else 'no'} post no",
            )
        except RunError as error:
            raise RunError(f"at t = {self.time:.4f} s to {self.time + steps * self.time_step:.4f} s: {error}") from None
        if self._frames is None:
            # The dump of the set-up, of known poses, gives LAMMPS's principal axes.
            own = _turns(self._read(self.steps))
            self._frames = matrix_product(np.swapaxes(own, 1, 2), self._moving.turns)
        self._fresh = False
        rows = self._read(target)
        self._moving = Moving(
            positions=rows[:, 1:4],
            turns=matrix_product(_turns(rows), self._frames),
            velocities=rows[:, 4:7],
            spins=rows[:, 11:14],
            momenta=rows[:, 14:17],
            forces=rows[:, 17:20],
        )

    def _read(self, step: int) -> Array:
        """Return (N, 20) values of all bodies at a step, in columns `text.WRITTEN`, and remove the file read."""
        file = self.child.scratch / f"bodies.{step}.dump"
        lines = file.read_text(encoding="ascii").split("\n", HEAD)
        rows = np.array(lines[HEAD].split(), dtype=np.float64).reshape(-1, len(text.WRITTEN.split()))
        file.unlink()
        if len(rows) != self.count:
            raise RunError(f"LAMMPS wrote {len(rows)} of {self.count} bodies at step {step}")
        return np.asarray(rows[np.argsort(rows[:, 0])])

    @property
    def count(self) -> int:
        return len(self._moving.positions)

    def add(self, poses: Poses, *, speed: float = 0.0) -> None:
        new, before = len(poses.positions), self._moving
        self._kinds = np.append(self._kinds, [] if poses.kinds is None else poses.kinds).astype(np.int64)
        bodies = [self._body(k) for k in range(self.count + new)]
        added_bodies, masses = bodies[self.count :], np.array([body.mass for body in bodies[self.count :]])
        turns = np.array([turn.as_matrix() for turn in poses.rotations]).reshape(-1, 3, 3)
        zero, thrown = np.zeros((new, 3)), np.tile([0.0, 0.0, -speed], (new, 1))
        weight = -self.gravity * masses[:, None] * [0.0, 0.0, 1.0]
        added = Moving(poses.positions, turns, thrown, zero, zero, weight)
        spheres = self._spheres(self._pile(added, self._kinds[self.count :]))
        lines = text.sphere_lines(
            added_bodies,
            self.cylinder,
            spheres,
            title="smarticles",
            first=self.count,
            first_sphere=sum(len(body.centres) for body in bodies[: self.count]),
        )
        pairs = zip(vars(before).values(), vars(added).values(), strict=True)
        self._moving = Moving(*(np.concatenate(pair) for pair in pairs))
        self._write(SPHERES, lines)
        self._write(BODIES, text.body_lines(bodies, self._moving))
        if self._box:
            self.child.send(*FORGET_BODIES, f"read_data {SPHERES} add merge", *self._balanced())
        else:
            self.child.send(*self._scene(f"read_data {SPHERES}"), *self._balanced())
            if self.steps:
                self.child.send(f"reset_timestep {self.steps}")
            self._box = True
        self.child.send(*self._bodies(BODIES))
        self._frames, self._fresh, self._contacts = None, True, None
        mass, relative = self.particle.mass, masses / self.particle.mass
        lifted, amount = float((relative * poses.positions[:, 2]).sum()), float(relative.sum())
        self.ledger.added += mass * (self.gravity * lifted + amount * speed**2 / 2)
        self._thrown += mass * amount * speed

    @property
    def _reference(self) -> Particle | Kind:
        """Body to whose mass the damping of the contact law belongs: the smarticle, or the first kind."""
        return bodies_of(self.particle)[0]

    def _body(self, number: int) -> Particle | Kind:
        """Return the smarticle or, in a mixture, the kind of the body with this number."""
        return body_of(self.particle, self._kinds, number)

    @property
    def _relative_masses(self) -> Array:
        """(N,) masses of the bodies, over the mean mass of the scene's bodies [1]; exactly 1 for smarticles."""
        if isinstance(self.particle, Particle):
            return np.ones(self.count)
        return np.asarray(self.particle.masses[self._kinds] / self.particle.mass)

    def _write(self, name: str, lines: Iterator[str]) -> None:
        with (self.child.scratch / name).open("w", encoding="ascii") as file:
            file.writelines(f"{line}\n" for line in lines)

    def still(self) -> None:
        self.ledger.dissipated += self.state().kinetic_energy
        none = np.zeros_like(self._moving.velocities)
        self._moving = replace(self._moving, velocities=none, spins=none, momenta=none)
        self._send(iter(f"velocity all zero {what} rigid bodies" for what in ("linear", "angular")))

    def state(self) -> PileState:
        return self._pile(self._moving, self._kinds)

    def _pile(self, moving: Moving, kinds: Numbers) -> PileState:
        poses = (moving.positions, moving.turns, moving.velocities, moving.spins)
        if isinstance(self.particle, Mixture):
            return RigidState(self.particle, kinds, *poses)
        return State.rigid(self.particle.boxes, *poses)

    def _spheres(self, state: PileState) -> list[Array]:
        """Return (S, 3) centres of the spheres of each body of a state [m]."""
        if state.bodies is not None:
            return state.bodies.spheres_by_body()
        return list(spheres_of(state, self.particle))

    @property
    def impulse(self) -> float:
        return self._seconds * self.particle.mass * self.gravity + self._thrown

    def unbalanced_force(self) -> float:
        if not self.count or not self.gravity:
            return math.inf
        weight = self.particle.mass * self.gravity * float(self._relative_masses.mean())
        return float(np.linalg.norm(self._moving.forces, axis=1).mean() / weight)

    @property
    def contacts(self) -> Contacts:
        """Present contacts."""
        if self._contacts is None:
            radii = np.array([self._body(k).radius for k in range(self.count)])
            self._contacts = Contacts.of(self._spheres(self.state()), radii, self.boundaries)
        return self._contacts

    def neighbours(self) -> Numbers:
        return self.contacts.neighbours()

    def touches(self) -> Numbers:
        return self.contacts.touches()

    def overlaps(self, limit: float) -> Overlaps:
        return self.contacts.overlaps(limit, self._law)

    def extremes(self, state: PileState) -> None:
        """Return None: on LAMMPS extremes are not cheaper than a full check."""

    def contact_forces(self) -> NoReturn:
        absent("forces at contacts")

    def save(self, scratch: Path) -> Saved:
        # Saved are LAMMPS's restart files with friction springs and bodies, and the poses of this process. LAMMPS
        # orders spheres differently after reading them, so that the running simulation loads what it has saved. It does
        # so in a new LAMMPS process, since one that has had contacts does not find those of the file.
        files: dict[str, bytes] = {}
        if self._box:
            self.child.send(f"write_restart {RESTART}")
            for name in (RESTART, f"{RESTART}.rigid"):
                files[name] = (self.child.scratch / name).read_bytes()
        arrays = io.BytesIO()
        np.savez(arrays, **vars(self._moving))
        files[STATE] = arrays.getvalue()
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name, data in files.items():
                archive.writestr(name, data)
        memory: dict[str, Any] = {
            "format": FORMAT,
            "time": self.time,
            "steps": self.steps,
            "time_step": self.time_step,
            "seconds": self._seconds,
            "thrown": self._thrown,
            **({"kinds": self._kinds.tolist()} if len(self._kinds) else {}),
            "fixtures": self.boundaries.memory,
            "account": [self.ledger.added, self.ledger.dissipated],
        }
        saved = Saved(content=content.getvalue(), memory=json.loads(json.dumps(memory)))
        self.load(saved, scratch)
        return saved

    def load(self, saved: Saved, scratch: Path) -> None:
        """Replace the state; raise InputError if `saved` is of another engine or version, or damaged."""
        memory = saved.memory
        if memory.get("format") != FORMAT:
            raise InputError(
                f"checkpoint: format {memory.get('format')!r}, here is {FORMAT!r}; it was made by another engine or "
                "version: resume with that, or start anew"
            )
        try:
            with zipfile.ZipFile(io.BytesIO(saved.content)) as archive:
                # Positions and velocities hardly shrink, and deflating can shrink zeros a thousand times.
                reject_inflated(archive, 100 * len(saved.content))
                files = {name: archive.read(name) for name in archive.namelist()}
                self._box = RESTART in files
                with np.load(io.BytesIO(files[STATE])) as arrays:
                    self._moving = Moving(**arrays)
        except (zipfile.BadZipFile, KeyError, TypeError, ValueError) as error:
            raise InputError(f"checkpoint: not readable by the lammps engine ({error}); start the run anew") from error
        self.time, self.steps, self.time_step = memory["time"], memory["steps"], memory["time_step"]
        self._seconds, self._thrown = memory["seconds"], memory["thrown"]
        self._kinds = np.array(memory.get("kinds", ()), dtype=np.int64)
        self.ledger.added, self.ledger.dissipated = memory["account"]
        self.boundaries.restore(memory["fixtures"])
        self._frames, self._fresh, self._contacts = None, True, None
        if self._box:
            self._restart(files)
            self.child.send(
                *self._scene(f"read_restart {RESTART}"), *self._balanced(), *self._bodies(f"{RESTART}.rigid")
            )

    def _restart(self, files: Mapping[str, bytes]) -> None:
        self._cpu_before += self.child.cpu()
        self.child.close()
        self.child = Child(self.child.ranks)
        for name, data in files.items():
            (self.child.scratch / name).write_bytes(data)


def _turns(rows: Array) -> Array:
    """Return (N, 3, 3) rotation matrices from quaternions (w, x, y, z) in columns 7 to 10 of rows (N, 20)."""
    return np.asarray(Rotation.from_quat(rows[:, [8, 9, 10, 7]]).as_matrix())
