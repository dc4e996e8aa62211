"""Filaments of YADE's grid nodes, joined by bonds, and of its grid connections, which are cylinders in contact.

Nodes have mass, are bonded to their neighbours, and touch floor and wall as spheres. A swept segment in a convex
container touches it at its ends only, so that this is exact. Connections have no mass; they touch other connections,
and their forces act on their nodes.

YADE's bonds have no dashpots. Before each step `YadeFilaments.resist` sets the forces of internal damping and drag on
all nodes, which are implicit and so stable for any damping. The velocities themselves are left to YADE, since bonds and
contacts sum displacements from them.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import solveh_banded
from scipy.spatial.transform import Rotation

from dem.arrays import Array
from dem.body.filament import Activity, Filament, FilamentEnergies
from dem.body.kinds import Mixture
from dem.body.linear import applied, by_element, dot
from dem.body.linkage import Undulation
from dem.body.placement import Poses
from dem.body.state import FilamentState, PileState
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.beams import FREEDOMS, matrices, springs
from dem.engine.yade.construction import OF_BOUNDARIES, OF_NODES, OF_SEGMENTS, SEGMENT_MATERIAL, SMARTICLE_MATERIAL
from dem.engine.yade.hinges import HINGE_MATERIAL
from dem.engine.yade.library import Yade, rows_of
from dem.errors import RunError, reject

# YADE turns the shear force of a bond to first order, which adds energy where nodes spin fast. Shear is damped by this
# fraction of critical damping at least. It is small where a filament bends over several segments, which changes little.
SHEAR_DAMPING = 0.1
# Rows and columns of a bond's matrix on and below its diagonal: of its first node, then of its second. Bonds share
# nodes, so that each part is added by itself.
_ROWS, _COLUMNS = np.tril_indices(2 * FREEDOMS)
PARTS = [(_ROWS[part], _COLUMNS[part]) for part in (_COLUMNS < FREEDOMS, _COLUMNS >= FREEDOMS)]


class YadeFilaments(Assembly):
    """All filaments of a pile as bodies of YADE; also `dem.engine.interface.Filaments`, without grips and waves.

    Args:
        mixture: kinds of filaments.
        gravity: g, downwards [m/s²].
        boundaries: ids of floor and wall, which touch nodes only.
    """

    def __init__(self, yade: Yade, mixture: Mixture, gravity: float, boundaries: Sequence[int]) -> None:
        super().__init__(yade, mixture, None)
        self._mixture = mixture
        self._gravity = gravity
        self._segments: list[list[int]] = []  # ids of the connections of each filament
        self._losses = [0.0, 0.0]  # by internal damping and by drag since the start [J]
        self._bonds: list[Any] = []
        for body in boundaries:
            yade.omega.bodies[body].mask = OF_BOUNDARIES

    # -- bodies ------------------------------------------------------------------------------------------------

    def bind(self) -> None:
        """Look up YADE's objects again, and compute the constants of all nodes and bonds."""
        self._ids = [node for nodes in self._spheres for node in nodes]
        self.smarticle_of = {
            body: k
            for k, (nodes, segments) in enumerate(zip(self._spheres, self._segments, strict=True))
            for body in (*nodes, *segments)
        }
        super().bind()
        interactions = self._yade.omega.interactions
        self._bonds = [interactions[a, b] for nodes in self._spheres for a, b in pairwise(nodes)]
        none = np.zeros((0, 4))
        each = [(f, f.nodes - 1) for f in self._filaments]
        self._springs = np.concatenate([none, *(np.tile(springs(f), (n, 1)) for f, n in each)])
        self._damping = np.concatenate([none, *(np.tile(_dampers(f), (n, 1)) for f, n in each)])
        # Half a segment's drag across and along, and of its roll, acts on each of its nodes.
        self._drag = np.concatenate(
            [none[:, :3], *(np.tile(np.multiply(f.drags, f.segment_length / 2), (n, 1)) for f, n in each)]
        )
        self._masses = np.concatenate([np.zeros(0), *(f.masses for f, _ in each)])
        inertias = [np.tile(f.axial_inertia, n + 1) * f.masses / f.masses[1] for f, n in each]
        rolling = np.concatenate([np.zeros(0), *inertias])
        self._inertia = np.repeat(np.stack([self._masses, rolling], axis=1), 3, axis=1)
        ends = np.cumsum([0, *(n + 1 for _, n in each)])
        self._starts = np.delete(np.arange(ends[-1]), ends[1:] - 1)
        self._lift = np.zeros((ends[-1], FREEDOMS))
        self._lift[:, 2] = (1 - np.repeat(self.weight_shares, np.diff(ends))) * self._masses * self._gravity
        if self._segments:  # YADE makes room for forces on new bodies; setting a constant force does not
            self._yade.omega.forces.f(self._segments[-1][-1], True)

    @property
    def _filaments(self) -> list[Filament]:
        found = [self._mixture.kinds[k].filament for k in self._kinds]
        return [filament for filament in found if filament is not None]

    @property
    def weight_shares(self) -> Array:
        """(N,) weight less buoyancy, over weight, of each filament [1]."""
        return np.array([filament.weight_share for filament in self._filaments])

    @property
    def bonded(self) -> bool:
        """True: some of YADE's interactions are bonds."""
        return True

    def add(self, poses: Poses, *, speed: float = 0.0) -> float:
        """Add filaments at poses, falling at a speed [m/s]; return the elastic energy of those poured bent [J]."""
        assert poses.kinds is not None
        stored = 0.0
        for number, position, rotation in zip(poses.kinds, poses.positions, poses.rotations, strict=True):
            kind = self._mixture.kinds[number]
            filament, frames = kind.filament, kind.bars.frames
            assert filament is not None
            self._kinds.append(int(number))
            # Bonds are made in the shape at rest, then nodes are moved to the shape in which filaments are poured:
            # both are arcs in one plane, of equal angles between neighbouring segments.
            first, second, normal = frames[0][:, 0], frames[1][:, 0], frames[0][:, 2]
            poured = math.atan2(dot(np.cross(first, second), normal), dot(first, second))
            rest = 0.0 if filament.curvature is None else float(filament.curvature.amplitudes) * filament.segment_length
            headings = rest * np.arange(filament.nodes - 1)[:, None]
            edges = by_element(math.cos, headings) * first + by_element(math.sin, headings) * np.cross(normal, first)
            nodes = self._chain(filament, np.cumsum([np.zeros(3), *(filament.segment_length * edges)], axis=0))
            local = np.concatenate([kind.bars.ends[:, 0], kind.bars.ends[-1:, 1]])
            places = applied(rotation.as_matrix(), local) + position
            angles = (np.arange(filament.nodes) - 0.5) * (poured - rest)
            turns = (rotation * Rotation.from_rotvec(angles[:, None] * normal)).as_quat()
            for node, place, (x, y, z, w) in zip(nodes, places, turns, strict=True):
                state = self._yade.omega.bodies[node].state
                state.pos, state.ori = self._yade.vector(*place), self._yade.quaternion(w, x, y, z)
                state.vel = self._yade.vector(0, 0, -speed)
            stored += 0.5 * float(springs(filament)[2]) * (filament.nodes - 1) * (poured - rest) ** 2
        self.bind()
        return stored

    def _chain(self, filament: Filament, points: Array) -> list[int]:
        """Make nodes at points (nodes, 3) [m], bonds and connections; return the ids of the nodes."""
        yade, bodies = self._yade, self._yade.omega.bodies
        materials, radius = yade.omega.materials, filament.diameter / 2
        nodes, segments = [], []
        for point, mass in zip(points, filament.masses, strict=True):
            body = yade.classes.Body()
            body.shape = yade.classes.GridNode(radius=radius)
            body.material, body.mask = materials[HINGE_MATERIAL], OF_NODES
            body.state.pos, body.state.mass = yade.vector(*point), mass
            # Equal about all axes: that of rolling counts, the others are small beside those of segments.
            inertia = filament.axial_inertia * mass / filament.masses[1]
            body.state.inertia = yade.vector(inertia, inertia, inertia)
            nodes.append(int(bodies.append(body)))
        for one, other in pairwise(nodes):
            bond = yade.utils.createInteraction(one, other)
            phys = bond.phys
            phys.kn, phys.ks, phys.kr, phys.ktw = (float(value) for value in springs(filament))
            phys.unp = bond.geom.penetrationDepth
            phys.momentRotationLaw, phys.fragile, phys.cohesionBroken = True, False, False
            phys.normalAdhesion = phys.shearAdhesion = math.inf
            phys.maxRollPl = phys.maxTwistPl = -1.0
            body = yade.classes.Body()
            body.shape = yade.classes.GridConnection(radius=radius)
            body.shape.node1, body.shape.node2 = bodies[one], bodies[other]
            body.material, body.mask, body.dynamic = materials[SEGMENT_MATERIAL], OF_SEGMENTS, False
            body.state.pos = bodies[one].state.pos
            for node in (one, other):
                bodies[node].shape.addConnection(body)
            segments.append(int(bodies.append(body)))
            bond.geom.connectionBody = body
        for node in nodes:  # whose material has made the bonds; from now on it makes contacts
            bodies[node].material = materials[SMARTICLE_MATERIAL]
        self._spheres.append(nodes)
        self._segments.append(segments)
        return nodes

    def pile(self) -> PileState:
        """Return the state of all filaments."""
        table = self._rows()
        nodes, velocities, spins = np.split(table, (3, 6), axis=1)
        rolls, edges = np.zeros(len(nodes)), nodes[self._starts + 1] - nodes[self._starts]
        means = (spins[self._starts] + spins[self._starts + 1]) / 2
        rolls[self._starts] = (means * edges).sum(axis=1) / np.sqrt((edges**2).sum(axis=1))
        return FilamentState(self._mixture, np.array(self._kinds, dtype=np.int64), nodes, velocities, rolls)

    def _rows(self) -> Array:
        """Return (n, 9) positions [m], velocities [m/s] and angular velocities [rad/s] of all nodes.

        Raises:
            RunError: one is not finite.
        """
        rows = []
        for state in self._states:
            x, v, w = state.pos, state.vel, state.angVel
            rows.append((x[0], x[1], x[2], v[0], v[1], v[2], w[0], w[1], w[2]))
        table = np.array(rows).reshape(-1, 9)
        broken = ~np.isfinite(table).all(axis=1)
        if broken.any():
            reject(
                np.logical_or.reduceat(broken, np.cumsum([0, *map(len, self._spheres)])[:-1]),
                self._yade.omega.time,
                "positions or velocities are no numbers, the simulation has blown up",
                "lower fidelity.time_step_fraction",
            )
        return table

    # -- damping and drag --------------------------------------------------------------------------------------

    def resist(self, time_step: float) -> None:
        """Set the forces of internal damping, drag and buoyancy on all nodes for a step dt [s]."""
        if not self._ids:
            return
        dragged = self._drag.any()
        table, starts = self._rows(), self._starts
        edges = table[starts + 1, :3] - table[starts, :3]
        blocks = matrices(edges, self._damping)
        drag = np.zeros((len(edges), FREEDOMS, FREEDOMS))
        if dragged:
            along = edges[:, :, None] * edges[:, None, :] / (edges**2).sum(axis=1)[:, None, None]
            across, parallel, roll = self._drag.T[:, :, None, None]
            drag[:, :3, :3] = across * (np.eye(3) - along) + parallel * along
            drag[:, 3:, 3:] = roll * along
            blocks[:, :FREEDOMS, :FREEDOMS] += drag
            blocks[:, FREEDOMS:, FREEDOMS:] += drag
        band = np.zeros((2 * FREEDOMS, self._inertia.size))
        band[0] = self._inertia.ravel()
        for i, j in PARTS:
            band[i - j, FREEDOMS * starts[:, None] + j] += time_step * blocks[:, i, j]
        # From the velocities before the step, without the forces of the step, which balance each other at rest.
        before, momenta = table[:, 3:], self._inertia * table[:, 3:]
        after = solveh_banded(band, momenta.ravel(), lower=True, check_finite=False).reshape(before.shape)
        forces = (self._inertia * after - momenta) / time_step
        vector, pull, turn = self._yade.vector, self._yade.omega.forces.setPermF, self._yade.omega.forces.setPermT
        for node, (x, y, z, a, b, c) in zip(self._ids, (forces + self._lift).tolist(), strict=True):
            pull(node, vector(x, y, z))
            turn(node, vector(a, b, c))
        lost, slowed = -time_step * float((forces * (before + after) / 2).sum()), 0.0
        if dragged:
            slowed = time_step * sum(
                float(np.einsum("bi,bij,bj->", after[node], drag, (before[node] + after[node]) / 2))
                for node in (starts, starts + 1)
            )
        self._losses[0] += lost - slowed
        self._losses[1] += slowed

    # -- `Filaments` -------------------------------------------------------------------------------------------

    def act(self, activity: Activity | Undulation | None, *, ramp: float = 0.0) -> None:
        """Do nothing: on YADE filaments never bend actively."""
        assert activity is None  # the scene was checked

    def points(self, filament: int) -> Array:
        """Return the nodes (n, 3) of a filament [m]."""
        bodies = self._yade.omega.bodies
        return rows_of(bodies[node].state.pos for node in self._spheres[filament])

    def grip(self, nodes: Mapping[int, Sequence[int]]) -> int:
        """Raise RunError: YADE has no grips here."""
        raise RunError("engine: yade has no grips")

    def move(self, grip: int, velocity: tuple[float, float, float]) -> None:
        """Do nothing without grips."""

    def release(self, grip: int | None = None) -> None:
        """Do nothing without grips."""

    held = 0
    joints = None

    def force(self, grip: int | None = None) -> Array:
        """Return (3,) zeros, since there are no grips [N]."""
        return np.zeros(3)

    def mean_unbalanced(self) -> float:
        """Return the mean net force on a filament over its weight in the liquid [1]."""
        forces = rows_of(map(self._yade.omega.forces.f, self._ids))
        forces[:, 2] -= self._masses * self._gravity
        net = np.add.reduceat(forces, np.cumsum([0, *map(len, self._spheres)])[:-1])
        weights = self.masses * np.abs(self.weight_shares) * self._gravity
        return float(np.linalg.norm(net, axis=1).mean() / weights.mean())

    def elastic_energy(self) -> float:
        """Return the elastic energy of all bonds [J]."""
        return sum(self._elastic())

    def _elastic(self) -> tuple[float, float, float]:
        """Return the elastic energies of stretching, of bending and shear, and of twisting [J]."""
        squares = [
            (
                phys.normalForce.squaredNorm(),
                phys.shearForce.squaredNorm(),
                phys.moment_bending.squaredNorm(),
                phys.moment_twist.squaredNorm(),
            )
            for phys in (bond.phys for bond in self._bonds)
        ]
        energies = 0.5 * np.array(squares).reshape(-1, 4) / self._springs
        stretching, shear, bending, twisting = energies.sum(axis=0).tolist()
        return stretching, shear + bending, twisting

    @property
    def energies(self) -> FilamentEnergies:
        """Energies of all filaments at present, and losses since the start."""
        state, (damped, dragged) = self.pile(), self._losses
        stretching, bending, twisting = self._elastic()
        return FilamentEnergies(
            kinetic=state.kinetic_energy,
            potential=state.potential_energy(self._gravity, 0.0),
            stretching=stretching,
            bending=bending,
            twisting=twisting,
            damped=damped,
            dragged=dragged,
            active=0.0,
            gripped=0.0,
        )

    # -- checkpoints -------------------------------------------------------------------------------------------

    @property
    def memory(self) -> dict[str, Any]:
        return {"nodes": self._spheres, "segments": self._segments, "kinds": self._kinds, "losses": self._losses}

    def restore(self, memory: Mapping[str, Any]) -> None:
        self._spheres = [list(nodes) for nodes in memory["nodes"]]
        self._segments = [list(segments) for segments in memory["segments"]]
        self._kinds, self._losses = list(memory["kinds"]), list(memory["losses"])
        self.bind()


def _dampers(filament: Filament) -> Array:
    """Return (4,) dashpots of a bond: of stretching, shear [N s/m], bending, twisting [N m s/rad]."""
    stiffness = springs(filament)
    spinning = math.sqrt(filament.axial_inertia / stiffness[1]) / filament.segment_length
    shear = max(filament.bending_time, 2 * SHEAR_DAMPING * spinning)
    return stiffness * [filament.stretching_time, shear, filament.bending_time, filament.stretching_time]
