"""Filaments of YADE's grid nodes, joined by bonds, and of its grid connections, which are cylinders in contact.

Nodes have mass, are bonded to their neighbours, and touch floor and wall as spheres. A swept segment in a convex
container touches it at its ends only, so that this is exact. Connections have no mass; they touch other connections,
and their forces act on their nodes.

YADE's bonds have no dashpots. `YadeFilaments.damp` reduces the velocities of nodes between two steps, implicitly, which
is stable for any damping.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.linalg import solveh_banded
from scipy.spatial.transform import Rotation

from dem.arrays import Array
from dem.body.filament import Activity, Filament, FilamentEnergies
from dem.body.kinds import Mixture
from dem.body.linkage import Undulation
from dem.body.placement import Poses
from dem.body.state import FilamentState, PileState
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.beams import FREEDOMS, matrices, springs
from dem.engine.yade.construction import OF_BOUNDARIES, OF_NODES, OF_SEGMENTS, SEGMENT_MATERIAL, SMARTICLE_MATERIAL
from dem.engine.yade.hinges import HINGE_MATERIAL
from dem.engine.yade.library import Yade, rows_of
from dem.errors import RunError, reject


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
        self._bonds = [interactions[a, b] for nodes in self._spheres for a, b in zip(nodes, nodes[1:], strict=False)]
        none = np.zeros((0, 4))
        each = [(f, f.nodes - 1) for f in self._filaments]
        self._springs = np.concatenate([none, *(np.tile(springs(f), (n, 1)) for f, n in each)])
        times = [(f.stretching_time, f.bending_time, f.bending_time, f.stretching_time) for f, _ in each]
        self._damping = self._springs * np.concatenate([none, *(np.tile(t, (n, 1)) for t, (_, n) in zip(times, each))])
        # Half a segment's drag across and along, and of its roll, acts on each of its nodes.
        self._drag = np.concatenate(
            [none[:, :3], *(np.tile(np.multiply(f.drags, f.segment_length / 2), (n, 1)) for f, n in each)]
        )
        self._masses = np.concatenate([np.zeros(0), *(f.masses for f, _ in each)])
        inertias = [np.tile(f.axial_inertia, n + 1) * f.masses / f.masses[1] for f, n in each]
        self._inertias = np.concatenate([np.zeros(0), *inertias])
        ends = np.cumsum([0, *(n + 1 for _, n in each)])
        self._starts = np.delete(np.arange(ends[-1]), ends[1:] - 1)
        shares = np.repeat(self.weight_shares, np.diff(ends))
        forces, vector = self._yade.omega.forces, self._yade.vector
        for node, lift in zip(self._ids, (1 - shares) * self._masses * self._gravity, strict=True):
            if lift:
                forces.setPermF(node, vector(0, 0, lift))

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
            poured = math.atan2(float(np.cross(first, second) @ normal), float(first @ second))
            rest = 0.0 if filament.curvature is None else float(filament.curvature.amplitudes) * filament.segment_length
            headings = rest * np.arange(filament.nodes - 1)[:, None]
            edges = np.cos(headings) * first + np.sin(headings) * np.cross(normal, first)
            nodes = self._chain(filament, np.cumsum([np.zeros(3), *(filament.segment_length * edges)], axis=0))
            places = np.concatenate([kind.bars.ends[:, 0], kind.bars.ends[-1:, 1]]) @ rotation.as_matrix().T + position
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
        for one, other in zip(nodes, nodes[1:], strict=False):
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
        broken = ~np.isfinite(table).all(axis=1)
        begin = np.cumsum([0, *map(len, self._spheres)])[:-1]
        reject(
            np.logical_or.reduceat(broken, begin) if len(begin) else broken,
            self._yade.omega.time,
            "positions or velocities are no numbers, the simulation has blown up",
            "lower fidelity.time_step_fraction",
        )
        nodes, velocities, spins = np.split(table, (3, 6), axis=1)
        rolls, edges = np.zeros(len(nodes)), nodes[self._starts + 1] - nodes[self._starts]
        means = (spins[self._starts] + spins[self._starts + 1]) / 2
        rolls[self._starts] = (means * edges).sum(axis=1) / np.sqrt((edges**2).sum(axis=1))
        return FilamentState(self._mixture, np.array(self._kinds, dtype=np.int64), nodes, velocities, rolls)

    def _rows(self) -> Array:
        """Return (n, 9) positions [m], velocities [m/s] and angular velocities [rad/s] of all nodes."""
        rows = []
        for state in self._states:
            x, v, w = state.pos, state.vel, state.angVel
            rows.append((x[0], x[1], x[2], v[0], v[1], v[2], w[0], w[1], w[2]))
        return np.array(rows).reshape(-1, 9)

    # -- damping and drag --------------------------------------------------------------------------------------

    def damp(self, time_step: float) -> None:
        """Reduce the motion of all nodes by internal damping and drag over a step dt [s]."""
        dragged = self._drag.any()
        if not dragged and not self._damping.any():
            return
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
        inertia = np.repeat(np.stack([self._masses, self._inertias], axis=1), 3, axis=1)
        band = np.zeros((2 * FREEDOMS, inertia.size))
        band[0] = inertia.ravel()
        row, column = np.tril_indices(2 * FREEDOMS)
        # Bonds share nodes: of one bond the rows of its first node are added, then those of its second.
        for part in (column < FREEDOMS, column >= FREEDOMS):
            i, j = row[part], column[part]
            band[i - j, FREEDOMS * starts[:, None] + j] += time_step * blocks[:, i, j]
        before = table[:, 3:]
        after = solveh_banded(band, (inertia * before).ravel(), lower=True, check_finite=False).reshape(before.shape)
        vector = self._yade.vector
        for state, (vx, vy, vz, wx, wy, wz) in zip(self._states, after.tolist(), strict=True):
            state.vel, state.angVel = vector(vx, vy, vz), vector(wx, wy, wz)
        lost = 0.5 * float((inertia * (before**2 - after**2)).sum())
        slowed = 0.0
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
        state = self.pile()
        return FilamentEnergies(
            state.kinetic_energy, state.potential_energy(self._gravity, 0.0), *self._elastic(), *self._losses, 0.0, 0.0
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
