"""The running YADE simulation behind a small interface. The only module that imports `yade`.

Heights, velocities and forces are in the laboratory frame. One process runs one simulation: YADE keeps its scene in a
process-wide singleton.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import math
import os
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.errors import RunError
from dem.particle import Particle
from dem.placement import Poses
from dem.timestep import ContactLaw

Array = NDArray[np.float64]

# How far a sphere may move before neighbours are looked for again, in radii: a larger distance means more pairs to look
# at in every step, a smaller one more searches. Measured on a shaken pile (N = 494, l/w = 0.4, draft): 0.2 costs
# 17 % less than 0.4, 0.1 as much as 0.2.
VERLET_DISTANCE = 0.15
POLL_INTERVAL = 2e-4  # s of wall time; O.run(wait=True) would sleep 40 ms


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """The container as the engine builds it. Lengths in m."""

    radius: float
    height: float
    facets: int

    @property
    def corner_radius(self) -> float:
        """Distance [m] of the wall's edges from the axis: the polygon has the area of the circle."""
        turn = 2 * math.pi / self.facets
        return self.radius * math.sqrt(turn / math.sin(turn))

    @property
    def inner_radius(self) -> float:
        """Distance [m] of the wall's flats from the axis, a little less than the radius."""
        return self.corner_radius * math.cos(math.pi / self.facets)


@dataclass(frozen=True)
class State:
    """All smarticles at one instant, in the laboratory frame.

    Args:
        positions: (N, 3) centres of mass [m].
        rotations: (N, 3, 3) body frame to laboratory frame [1].
        velocities: (N, 3) of the centres of mass [m/s].
        angular_velocities: (N, 3) [rad/s].
    """

    positions: Array
    rotations: Array
    velocities: Array
    angular_velocities: Array

    def points(self, body: Array) -> Array:
        """Points of the body frame, (k, 3) [m], on every smarticle: (N, k, 3) [m]."""
        turned: Array = np.einsum("nij,kj->nki", self.rotations, body)
        return turned + self.positions[:, None]


def yade_version() -> str:
    """Version of the YADE that runs.

    Raises:
        RunError: YADE is not installed.
    """
    import_yade()
    return str(importlib.import_module("yade.config").version)


def import_yade() -> Any:
    """The distribution's YADE, imported into this process.

    Raises:
        RunError: YADE is not installed.
    """
    # Threads that find no free core spin; a run of seconds would take minutes.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    for folder in Path("/usr/lib").glob("*/yade*/py"):
        if folder.parent.name in ("yade", "yade-double") and str(folder) not in sys.path:
            sys.path.append(str(folder))
    try:
        # YADE greets on standard output, which belongs to the command's own answer.
        with contextlib.redirect_stdout(io.StringIO()):
            return importlib.import_module("yade")
    except ImportError as error:
        msg = (
            f"YADE cannot be imported ({error}); install it with `make setup` or `apt-get install yade`, "
            "see environment.md; `smarticles doctor` tells what is missing"
        )
        raise RunError(msg) from None


class Engine:
    """A cylinder that smarticles are added to and that time is advanced in.

    Args:
        particle: one smarticle.
        cylinder: the container; its floor is at z = 0 at the start.
        law: contact law.
        gravity: g, downwards [m/s²].
        time_step: dt [s].
        shaken: whether the container will move; the engine that moves it exists only then.

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
    ) -> None:
        import_yade()
        from yade import utils, wrapper  # noqa: PLC0415 - YADE is imported when an engine is built, not before
        from yade.minieigenHP import Quaternion, Vector3  # noqa: PLC0415

        self._utils, self._yade, self._vector, self._quaternion = (
            utils,
            wrapper,
            Vector3,
            Quaternion,
        )
        self.particle = particle
        self.cylinder = cylinder
        self.time_step = time_step
        self._gravity = gravity
        self._omega = wrapper.Omega()
        self._omega.reset()
        self._clumps: list[Any] = []
        self._clump_ids: list[int] = []
        self._to_body: Any = None
        self._smarticle_of: dict[int, int] = {}
        self._smarticle_seconds = 0.0
        # (step, value) of the unbalanced force when the simulation was loaded: forces are not saved.
        self._loaded: tuple[int, float] | None = None
        self._add_materials(law)
        self._add_container(cylinder)
        self._assemble(law, shaken=shaken)

    # -- construction ------------------------------------------------------------------------------------------

    def _add_materials(self, law: ContactLaw) -> None:
        # YADE joins two materials in series, so each carries twice the contact's value. The wall's dashpot is chosen
        # such that the series with a smarticle's gives the wall's. Density zero: the spheres weigh nothing, the
        # mass comes from a ballast that is taken away again (see `_clump`).
        between = 2 * law.normal_damping
        wall = 1 / (1 / law.wall_damping - 1 / between) if law.wall_damping else 0.0
        for label, damping in (("smarticle", between), ("wall", wall)):
            self._omega.materials.append(
                self._yade.ViscElMat(
                    density=0,
                    kn=2 * law.normal_stiffness,
                    ks=2 * law.tangential_stiffness,
                    cn=damping,
                    cs=damping * law.tangential_damping,
                    label=label,
                )
            )

    def _add_container(self, cylinder: Cylinder) -> None:
        # A polygon of the same area as the circle; it starts below the floor so that no gap opens at the edge.
        n = cylinder.facets
        corner = cylinder.corner_radius
        low, high = -0.1 * cylinder.radius, cylinder.height
        angles = 2 * math.pi * np.arange(n + 1) / n
        ring = np.stack([corner * np.cos(angles), corner * np.sin(angles)], axis=1)
        bodies = []
        for (x0, y0), (x1, y1) in pairwise(ring):
            a, b = self._vector(x0, y0, low), self._vector(x1, y1, low)
            c, d = self._vector(x1, y1, high), self._vector(x0, y0, high)
            bodies += [
                self._utils.facet([a, b, c], material="wall", fixed=True),
                self._utils.facet([a, c, d], material="wall", fixed=True),
            ]
        # sense=1: the floor pushes upwards whatever happens, so nothing that is pressed through comes out below.
        bodies.append(self._utils.wall(0, axis=2, sense=1, material="wall"))
        self._container = [self._omega.bodies.append(body) for body in bodies]

    def _assemble(self, law: ContactLaw, *, shaken: bool) -> None:
        yade = self._yade
        friction = yade.MatchMaker(matches=((0, 0, math.atan(law.friction)), (0, 1, math.atan(law.wall_friction))))
        shaker = [yade.HarmonicMotionEngine(ids=self._container, dead=True)] if shaken else []
        collider = yade.InsertionSortCollider(
            [yade.Bo1_Sphere_Aabb(), yade.Bo1_Facet_Aabb(), yade.Bo1_Wall_Aabb()],
            verletDist=VERLET_DISTANCE * self.particle.radius,
        )
        self._omega.engines = [
            yade.ForceResetter(),
            collider,
            yade.InteractionLoop(
                [
                    yade.Ig2_Sphere_Sphere_ScGeom(),
                    yade.Ig2_Facet_Sphere_ScGeom(),
                    yade.Ig2_Wall_Sphere_ScGeom(),
                ],
                [yade.Ip2_ViscElMat_ViscElMat_ViscElPhys(frictAngle=friction)],
                [yade.Law2_ScGeom_ViscElPhys_Basic()],
            ),
            *shaker,
            yade.NewtonIntegrator(damping=0, gravity=self._vector(0, 0, -self._gravity), exactAsphericalRot=True),
        ]
        self._omega.dt = self.time_step
        self._bind()

    def _bind(self) -> None:
        """Take hold of YADE's objects; loading replaces them all."""
        bodies, engines = self._omega.bodies, self._omega.engines
        self._floor = bodies[self._container[-1]].state
        self._clumps = [bodies[clump].state for clump in self._clump_ids]
        self._smarticle_of = {
            sphere: k for k, clump in enumerate(self._clump_ids) for sphere in bodies[clump].shape.members
        }
        self._shaker = next((e for e in engines if isinstance(e, self._yade.HarmonicMotionEngine)), None)

    def save(self, path: Path) -> dict[str, Any]:
        """Save the simulation into a file.

        Returns:
            Plain data that `load` needs besides the file.
        """
        self._omega.save(str(path))
        axes = [] if self._to_body is None else [self._to_body[k] for k in range(4)]
        return {
            "clumps": self._clump_ids,
            "to_body": axes,
            "smarticle_seconds": self._smarticle_seconds,
            "unbalanced": self.unbalanced_force(),
        }

    def load(self, path: Path, memory: Mapping[str, Any]) -> None:
        """Replace the simulation by a saved one of the same scene.

        Args:
            path: the file.
            memory: what `save` returned.
        """
        self._omega.load(str(path), quiet=True)
        self._clump_ids = list(memory["clumps"])
        self._smarticle_seconds = memory["smarticle_seconds"]
        if memory["to_body"]:
            x, y, z, w = memory["to_body"]
            # Component by component: the constructor from (w, x, y, z) is exact, normalising would not be.
            self._to_body = self._quaternion(w, x, y, z)
        self._bind()
        self._loaded = (self.steps, memory["unbalanced"])

    def add(self, poses: Poses) -> None:
        """Add smarticles at rest."""
        for position, rotation in zip(poses.positions, poses.rotations, strict=True):
            self._clump(position, rotation)

    def _clump(self, position: Array, rotation: Rotation) -> None:
        # Clumped at the origin in the body frame, then moved: YADE's own mass properties of overlapping spheres depend
        # on the pose and count overlaps twice. The spheres weigh nothing; one ballast member carries the exact mass
        # and inertia of the boxes and is erased again, which leaves the clump's state alone.
        omega, particle = self._omega, self.particle
        spheres = [
            omega.bodies.append(self._utils.sphere(self._vector(*centre), particle.radius, material="smarticle"))
            for centre in particle.centres
        ]
        ballast = self._yade.Body()
        ballast.shape = self._yade.Box()
        ballast.material = omega.materials["smarticle"]
        ballast.state.mass = particle.boxes.mass
        ballast.state.inertia = self._vector(*particle.boxes.inertia)
        ballast_id = omega.bodies.append(ballast)
        clump_id = omega.bodies.clump([*spheres, ballast_id], discretization=0)
        omega.bodies.erase(ballast_id)
        clump = omega.bodies[clump_id].state
        # YADE sorts the principal axes: a permutation of ours, the same for every smarticle.
        principal = clump.ori
        x, y, z, w = rotation.as_quat()
        clump.ori = self._quaternion(w, x, y, z) * principal
        clump.pos = self._vector(*position)
        for sphere, centre in zip(spheres, rotation.apply(particle.centres) + position, strict=True):
            omega.bodies[sphere].state.pos = self._vector(*centre)
            self._smarticle_of[sphere] = len(self._clumps)
        self._clumps.append(clump)
        self._clump_ids.append(clump_id)
        self._to_body = principal.inverse()

    # -- time --------------------------------------------------------------------------------------------------

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
            # YADE would take it for a run without end.
            return
        target = self.steps + steps
        self._omega.run(steps, False)
        try:
            while self._omega.running:
                time.sleep(POLL_INTERVAL)
        except BaseException:
            # Ctrl-C arrives here, while YADE's own thread is at work: let it finish its step.
            self._omega.pause()
            raise
        self._smarticle_seconds += steps * self.time_step * self.count
        if self.steps != target:
            msg = f"YADE stopped at step {self.steps} of {target} (t = {self.time:.4f} s); see its message above"
            raise RunError(msg)

    def shake(self, *, amplitude: float, frequency: float) -> None:
        """Move the container as z = A sin(2πf t), t from now; it starts at the position where it is.

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
        self._shaker.A = self._vector(0, 0, amplitude)
        self._shaker.f = self._vector(0, 0, frequency)
        self._shaker.fi = self._vector(0, 0, phase)
        self._shaker.dead = False

    def stop_container(self) -> None:
        """Bring the container to rest where it is."""
        if self._shaker is not None:
            self._shaker.dead = True
        for body in self._container:
            self._omega.bodies[body].state.vel = self._vector(0, 0, 0)

    # -- state -------------------------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        """Smarticles present."""
        return len(self._clumps)

    @property
    def gravity_impulse(self) -> float:
        """What gravity has given to all smarticles, each since it was added [N s], downwards."""
        return self._smarticle_seconds * self.particle.boxes.mass * self._gravity

    @property
    def floor(self) -> float:
        """Height of the container's floor [m]."""
        return float(self._floor.pos[2])

    @property
    def container_velocity(self) -> float:
        """Vertical velocity of the container [m/s]."""
        return float(self._floor.vel[2])

    def state(self) -> State:
        """Poses and velocities of all smarticles."""
        rows = []
        for clump in self._clumps:
            x, v, w, q = clump.pos, clump.vel, clump.angVel, clump.ori * self._to_body
            # Component by component: five times faster than letting NumPy convert YADE's vectors.
            rows.append((x[0], x[1], x[2], v[0], v[1], v[2], w[0], w[1], w[2], q[0], q[1], q[2], q[3]))
        table = np.array(rows).reshape(-1, 13)
        positions, velocities, spins, quaternions = np.split(table, (3, 6, 9), axis=1)
        rotations = Rotation.from_quat(quaternions).as_matrix() if rows else np.empty((0, 3, 3))
        return State(positions, rotations, velocities, spins)

    def contacts(self) -> NDArray[np.int64]:
        """(N,) int64: how many other smarticles each one touches."""
        touching: set[tuple[int, int]] = set()
        for interaction in self._omega.interactions:
            first = self._smarticle_of.get(interaction.id1)
            second = self._smarticle_of.get(interaction.id2)
            if first is None or second is None or not interaction.isReal:
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
        for interaction in self._omega.interactions:
            if interaction.isReal:
                for body in (interaction.id1, interaction.id2):
                    k = self._smarticle_of.get(body)
                    if k is not None:
                        result[k] += 1
        return result

    def container_force(self) -> Array:
        """(3,) [N]: force of the smarticles on the container in the last step."""
        force = np.zeros(3)
        for body in self._container:
            force += self._omega.forces.f(body)
        return force

    def unbalanced_force(self) -> float:
        """Mean net force on a smarticle over its weight [1]: 0 for a still pile, 1 in free fall, inf when empty.

        YADE's own measure leaves gravity out for a body whose contact forces are exactly zero or balance exactly, and
        so calls a still pile unbalanced.
        """
        if self._loaded is not None and self._loaded[0] == self.steps:
            return self._loaded[1]
        if not self._clump_ids or not self._gravity:
            return math.inf
        weight = self.particle.boxes.mass * self._gravity
        total = 0.0
        for clump in self._clump_ids:
            x, y, z = self._omega.forces.f(clump)
            total += math.sqrt(x * x + y * y + (z - weight) ** 2)
        return total / (weight * len(self._clump_ids))

    def kinetic_energy(self, state: State) -> float:
        """Translational and rotational kinetic energy [J] of the smarticles in a state."""
        spins = np.einsum("nij,ni->nj", state.rotations, state.angular_velocities)
        mass, inertia = self.particle.boxes.mass, self.particle.boxes.inertia
        return float(0.5 * mass * (state.velocities**2).sum() + 0.5 * (inertia * spins**2).sum())
