"""Bodies of spheres: one rigid body each, or three links and two hinges of an articulated smarticle.

Welding and articulating conserve positions, momentum and angular momentum up to rounding. Articulating also conserves
the kinetic energy; welding dissipates the energy of the links' relative motion.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from dem.arrays import Array
from dem.body.kinds import Kind, Mixture, body_of
from dem.body.linear import eigen_symmetric, matrix_product, solved, transformed
from dem.body.particle import LINKS, Particle
from dem.body.placement import Poses
from dem.body.state import PileState, RigidState, State
from dem.engine.yade.construction import SMARTICLE_MATERIAL
from dem.engine.yade.hinges import HingeLaw, Hinges, add_nodes, hinge_nodes
from dem.engine.yade.library import Yade, rows_of
from dem.errors import reject


class Assembly:
    """All bodies of a pile as bodies of YADE.

    Args:
        particle: the smarticle of which the pile consists, or a mixture of other bodies.
        hinge_law: law of the hinges; None if smarticles stay welded.
        planar: whether bodies move only in the xy plane.
        strengths: (N, 2) factors on torque limit and stiffness of the motors [1]; None: 1 for all motors.
    """

    def __init__(
        self,
        yade: Yade,
        particle: Particle | Mixture,
        hinge_law: HingeLaw | None,
        *,
        planar: bool = False,
        strengths: Array | None = None,
    ) -> None:
        self._yade = yade
        self._model = particle
        self._kinds: list[int] = []  # of a mixture, the kind of each body
        self._hinge_law = hinge_law
        self._planar = planar
        self._strengths = strengths
        self.hinges: Hinges | None = None  #: The hinges; None while welded
        self._spheres: list[list[int]] = []
        self._ids: list[int] = []
        self._to_body: list[Any] = []
        self._states: list[Any] = []
        self.smarticle_of: dict[int, int] = {}  #: Number of a sphere's body, by the sphere's id in YADE
        # Link poses in the frames of welded bodies; of no meaning while articulated.
        self._arms: Array = np.empty((0, LINKS, 3))
        self._turns: Array = np.empty((0, LINKS, 3, 3))

    @property
    def count(self) -> int:
        return len(self._spheres)

    @property
    def bodies(self) -> Sequence[int]:
        """Ids of the rigid bodies, smarticle by smarticle: one while welded, three while articulated."""
        return self._ids

    @property
    def _particle(self) -> Particle:
        """One smarticle."""
        assert isinstance(self._model, Particle)  # other bodies are neither articulated nor tied
        return self._model

    def _body(self, number: int) -> Particle | Kind:
        """Return the smarticle or, in a mixture, the kind of the body with this number."""
        return body_of(self._model, self._kinds, number)

    @property
    def each(self) -> int:
        """Largest number of links of a body, but at least 3."""
        if isinstance(self._model, Particle):
            return LINKS
        return max(LINKS, *(len(kind.bars.points) for kind in self._model.kinds))

    @property
    def link_of(self) -> Mapping[int, tuple[int, int]]:
        """Number of the body and number of the link to which a sphere belongs, by the sphere's id."""
        return {
            sphere: (k, link)
            for k, spheres in enumerate(self._spheres)
            for sphere, link in zip(spheres, self._body(k).links.tolist(), strict=True)
        }

    @property
    def masses(self) -> Array:
        """(N,) masses of the bodies [kg]."""
        if isinstance(self._model, Particle):
            return np.full(self.count, self._model.mass)
        return self._model.masses[np.array(self._kinds, dtype=np.int64)]

    def bind(self) -> None:
        """Look up YADE's objects again, after loading has replaced them."""
        bodies = self._yade.omega.bodies
        self._states = [bodies[body].state for body in self._ids]

    @property
    def weight_shares(self) -> Array:
        """(N,) weight less buoyancy, over weight, of each body [1]."""
        return np.ones(self.count)

    @property
    def bonded(self) -> bool:
        """Whether some of YADE's interactions are bonds, not contacts."""
        return self.hinges is not None

    def elastic_energy(self) -> float:
        """Return the elastic energy of all bonds [J]."""
        return 0.0 if self.hinges is None else self.hinges.elastic_energy()

    def add(self, poses: Poses, *, speed: float = 0.0) -> float:
        """Add bodies at poses, falling at a speed [m/s]; return the elastic energy that they have by then [J]."""
        omega, still, falling = self._yade.omega, np.zeros(3), np.array([0.0, 0.0, -speed])
        self._kinds += [] if poses.kinds is None else poses.kinds.tolist()
        for position, rotation in zip(poses.positions, poses.rotations, strict=True):
            particle = self._body(len(self._spheres))
            spheres = [
                omega.bodies.append(
                    self._yade.utils.sphere(self._yade.vector(*centre), particle.radius, material=SMARTICLE_MATERIAL)
                )
                for centre in particle.centres
            ]
            self.smarticle_of.update(dict.fromkeys(spheres, len(self._spheres)))
            self._spheres.append(spheres)
            self._clump(
                members=spheres,
                local=particle.centres,
                mass=particle.mass,
                inertia=particle.inertia,
                position=position,
                rotation=rotation.as_matrix(),
                velocity=falling,
                angular_momentum=still,
            )
        if isinstance(self._model, Mixture):
            return 0.0
        new, boxes = len(poses.positions), self._model.boxes
        self._arms = np.concatenate([self._arms, np.tile(boxes.link_centres, (new, 1, 1))])
        self._turns = np.concatenate([self._turns, np.tile(boxes.link_rotations, (new, 1, 1, 1))])
        return 0.0

    def state(self) -> State:
        """Return the state of a pile of smarticles."""
        return self.pile().smarticles

    def pile(self) -> PileState:
        """Return the state of a pile of any bodies."""
        rows = []
        for body, to_body in zip(self._states, self._to_body, strict=True):
            x, v, w, q = body.pos, body.vel, body.angVel, body.ori * to_body
            # Component by component: five times faster than letting NumPy convert YADE's vectors.
            rows.append((x[0], x[1], x[2], v[0], v[1], v[2], w[0], w[1], w[2], q[0], q[1], q[2], q[3]))
        table = np.array(rows).reshape(-1, 13)
        self._check(table)
        positions, velocities, spins, quaternions = np.split(table, (3, 6, 9), axis=1)
        rotations = Rotation.from_quat(quaternions).as_matrix() if rows else np.empty((0, 3, 3))
        if isinstance(self._model, Mixture):
            kinds = np.array(self._kinds, dtype=np.int64)
            return RigidState(self._model, kinds, positions, rotations, velocities, spins)
        boxes = self._model.boxes
        if self.hinges is not None:
            shape = (-1, LINKS, 3)
            return State(
                boxes,
                positions.reshape(shape),
                rotations.reshape(-1, LINKS, 3, 3),
                velocities.reshape(shape),
                spins.reshape(shape),
            )
        return State.rigid(boxes, positions, rotations, velocities, spins, shapes=(self._arms, self._turns))

    def still(self) -> None:
        assert self.hinges is None  # motors would set links in motion again
        zero, bodies = self._yade.vector(0, 0, 0), self._yade.omega.bodies
        # Contact laws read the members' own velocities, before the integrator has moved them.
        for state in (*self._states, *(bodies[sphere].state for spheres in self._spheres for sphere in spheres)):
            state.vel = state.angVel = zero
            state.angMom = zero

    def _check(self, table: Array) -> None:
        broken = ~np.isfinite(table).all(axis=1) | ~table[:, 9:].any(axis=1)
        reject(
            broken.reshape(self.count, 1 if self.hinges is None else LINKS).any(axis=1),
            self._yade.omega.time,
            "positions or velocities are no numbers, the simulation has blown up",
            "lower fidelity.time_step_fraction",
        )

    def articulate(self) -> None:
        """Split every smarticle into three links that hinges join; no effect on articulated smarticles."""
        if self.hinges is not None:
            return
        assert self._hinge_law is not None  # the engine was built for scenes that never articulate
        boxes, state = self._particle.boxes, self.state()
        tensors, arms = _tensors(state)
        spins = solved(tensors, self._angular_momenta())
        inertias = boxes.link_inertias
        nodes: list[list[list[int]]] = []
        self._dissolve()
        for k in range(state.count):
            nodes.append([])
            for link in range(LINKS):
                rotation = state.link_rotations[k, link]
                own = hinge_nodes(boxes, link)
                nodes[k].append(add_nodes(self._yade, len(own)))
                spheres = np.flatnonzero(self._particle.links == link)
                self._clump(
                    members=[*(self._spheres[k][s] for s in spheres), *nodes[k][link]],
                    local=np.concatenate([self._particle.local_centres[spheres], own]),
                    mass=boxes.link_masses[link],
                    inertia=inertias[link],
                    position=state.link_positions[k, link],
                    rotation=rotation,
                    velocity=state.velocities[k] + np.cross(spins[k], arms[k, link]),
                    angular_momentum=transformed(rotation, inertias[link] * transformed(rotation.T, spins[k])),
                )
        self.hinges = Hinges(self._yade, self._hinge_law, nodes, state.angles)
        self.hinges.make(self._strengths)

    def weld(self) -> float:
        """Make articulated smarticles rigid in their present shapes; return the lost kinetic energy [J]."""
        if self.hinges is None:
            return 0.0
        boxes, state = self._particle.boxes, self.state()
        tensors, arms = _tensors(state)
        masses = boxes.link_masses[None, :, None]
        relative = state.link_velocities - state.velocities[:, None]
        own = self._angular_momenta().reshape(-1, LINKS, 3)
        momenta = (own + np.cross(arms, masses * relative)).sum(axis=1)
        if self._planar:
            moments, axes = tensors[:, [0, 1, 2], [0, 1, 2]], np.tile(np.eye(3), (state.count, 1, 1))
        else:
            moments, axes = eigen_symmetric(tensors)
            axes[..., 0] = np.cross(axes[..., 1], axes[..., 2])  # right-handed
        before = state.kinetic_energy
        spheres = state.spheres(self._particle) - state.positions[:, None]
        self.hinges.remove()
        self.hinges = None
        self._dissolve()
        for k in range(state.count):
            self._clump(
                members=self._spheres[k],
                local=matrix_product(spheres[k], axes[k]),
                mass=boxes.mass,
                inertia=moments[k],
                position=state.positions[k],
                rotation=axes[k],
                velocity=state.velocities[k],
                angular_momentum=momenta[k],
            )
        self._arms = np.einsum("nji,nkj->nki", axes, arms)
        self._turns = np.einsum("nji,nkjm->nkim", axes, state.link_rotations)
        return before - self.state().kinetic_energy

    def anchor(self, smarticle: int, link: int, point: Array) -> tuple[int, Array]:
        """Return the id of an articulated link's body, and a point of the link in the frame of this body.

        Args:
            point: (3,) the point in the link's frame [m].
        """
        number = LINKS * smarticle + link
        arm = self._to_body[number] * self._yade.vector(*point)
        return self._ids[number], np.array([arm[0], arm[1], arm[2]])

    def _clump(self, **body: Any) -> None:
        number, to_body = clump(self._yade, planar=self._planar, **body)
        self._ids.append(number)
        self._to_body.append(to_body)
        self._states.append(self._yade.omega.bodies[number].state)

    def _dissolve(self) -> None:
        for body in self._ids:
            self._yade.omega.bodies.erase(body, False)
        self._ids, self._to_body, self._states = [], [], []

    def _angular_momenta(self) -> Array:
        """Return (bodies, 3) angular momenta about the centres of mass, in the laboratory frame [kg m²/s]."""
        if self._planar:
            # YADE stores no angular momentum of bodies that it rotates like spheres.
            return np.array([[0.0, 0.0, s.inertia[2] * s.angVel[2]] for s in self._states]).reshape(-1, 3)
        return rows_of(state.angMom for state in self._states)

    @property
    def memory(self) -> dict[str, Any]:
        return {
            "spheres": self._spheres,
            **({"kinds": self._kinds} if self._kinds else {}),
            "bodies": self._ids,
            "to_body": [[q[0], q[1], q[2], q[3]] for q in self._to_body],
            "arms": self._arms.tolist(),
            "turns": self._turns.tolist(),
            "hinges": None if self.hinges is None else self.hinges.memory,
        }

    def restore(self, memory: Mapping[str, Any]) -> None:
        self._spheres = [list(spheres) for spheres in memory["spheres"]]
        self._kinds = list(memory.get("kinds", ()))
        self.smarticle_of = {sphere: k for k, spheres in enumerate(self._spheres) for sphere in spheres}
        self._ids = list(memory["bodies"])
        # Component by component: the constructor from (w, x, y, z) is exact, normalising would not be.
        self._to_body = [self._yade.quaternion(w, x, y, z) for x, y, z, w in memory["to_body"]]
        self._arms = np.array(memory["arms"]).reshape(-1, LINKS, 3)
        self._turns = np.array(memory["turns"]).reshape(-1, LINKS, 3, 3)
        self.hinges = None
        if memory["hinges"] is not None:
            assert self._hinge_law is not None  # a checkpoint belongs to its scene
            self.hinges = Hinges.restored(self._yade, self._hinge_law, memory["hinges"])
        self.bind()


def _tensors(state: State) -> tuple[Array, Array]:
    """Return inertia tensors (N, 3, 3) [kg m²], and arms of links (N, 3, 3) [m], in laboratory axes.

    An arm is the vector from the centre of mass of the smarticle to the centre of a link.
    """
    boxes = state.boxes
    arms = state.link_positions - state.positions[:, None]
    own = np.einsum("nkij,kj,nklj->nil", state.link_rotations, boxes.link_inertias, state.link_rotations)
    squares = (arms**2).sum(axis=-1)
    offset = np.einsum("k,nk,ij->nij", boxes.link_masses, squares, np.eye(3))
    offset -= np.einsum("k,nki,nkj->nij", boxes.link_masses, arms, arms)
    return own + offset, arms


def clump(
    yade: Yade,
    *,
    members: Sequence[int],
    local: Array,
    mass: float,
    inertia: Array,
    position: Array,
    rotation: Array,
    velocity: Array,
    angular_momentum: Array,
    planar: bool,
) -> tuple[int, Any]:
    """Join existing spheres into a rigid body of given mass and inertia.

    Args:
        members: ids of the spheres.
        local: (k, 3) centres of the spheres in the body's principal frame [m].
        mass: mass of the body [kg].
        inertia: (3,) principal moments of inertia of the body [kg m²].
        position: (3,) centre of mass [m].
        rotation: (3, 3) rotation from the principal frame to the laboratory frame.
        velocity: (3,) velocity of the centre of mass [m/s].
        angular_momentum: (3,) angular momentum about the centre of mass [kg m²/s].
        planar: whether the body moves along x and y and turns about z only; z is then the body's third principal axis.

    Returns:
        The id of the body, and the quaternion q from YADE's principal frame of the clump to the body's principal frame:
        q_body = q_clump q.
    """
    # Clumped at the origin in the body frame, then moved: the mass properties that YADE computes for overlapping
    # spheres depend on the pose and count overlaps twice. The spheres have no mass; one ballast member has the exact
    # mass and inertia, and is then erased, which does not change the clump's state.
    omega, classes, vector = yade.omega, yade.classes, yade.vector
    upright = yade.quaternion(1, 0, 0, 0)
    for member, centre in zip(members, local, strict=True):
        state = omega.bodies[member].state
        state.pos, state.ori = vector(*centre), upright
    ballast = classes.Body()
    ballast.shape = classes.Box()
    ballast.material = omega.bodies[members[0]].material
    ballast.state.mass = mass
    # For rotation about the third axis alone the other moments do not matter. If all are equal, the axes keep their
    # order, and YADE's integration for spheres, which it uses where a rotation is blocked, is right.
    inertia = np.full(3, inertia[2]) if planar else inertia
    ballast.state.inertia = vector(*inertia)
    ballast_id = omega.bodies.append(ballast)
    clump_id = omega.bodies.clump([*members, ballast_id], discretization=0)
    omega.bodies.erase(ballast_id)
    state = omega.bodies[clump_id].state
    # YADE sorts the principal axes: a permutation of ours.
    principal = state.ori
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    turned = yade.quaternion(w, x, y, z)
    spin = transformed(rotation, transformed(rotation.T, angular_momentum) / inertia)
    state.ori = turned * principal
    state.pos = vector(*position)
    state.vel = vector(*velocity)
    state.angVel = vector(*spin)
    state.angMom = vector(*angular_momentum)
    if planar:
        state.blockedDOFs = "zXY"
    for member, arm in zip(members, matrix_product(local, rotation.T), strict=True):
        own = omega.bodies[member].state
        own.pos, own.ori = vector(*(position + arm)), turned
        # Contact laws read the members' own velocities, before the integrator has moved them for the first time.
        own.vel, own.angVel = vector(*(velocity + np.cross(spin, arm))), state.angVel
    return clump_id, principal.inverse()
