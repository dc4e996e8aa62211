"""Poses and velocities of all bodies at one instant, for smarticles, other rigid bodies and filaments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, Self

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.filament import Filament
from dem.body.kinds import Kind, Mixture, padded
from dem.body.linear import by_element, matrix_product
from dem.body.particle import LINKS, Boxes, Particle
from dem.errors import InputError


class PileState(Protocol):
    """Interface of the states of piles of any bodies, in the laboratory frame."""

    @property
    def count(self) -> int:
        """Number of bodies, N."""

    @property
    def positions(self) -> Array:
        """(N, 3) centres of mass [m]."""

    @property
    def velocities(self) -> Array:
        """(N, 3) velocities of the centres of mass [m/s]."""

    @property
    def volume(self) -> float:
        """Mean solid volume of the bodies present, or of all bodies of the scene if none is present [m³]."""

    @property
    def tops(self) -> Array:
        """(N,) height of the highest point on the axes of each body's bars, or links [m]."""

    @property
    def speeds(self) -> Array:
        """(N,) largest speed of the centres of each body's bars, or links [m/s]."""

    @property
    def momentum(self) -> Array:
        """(3,) momentum of all bodies [kg m/s]."""

    @property
    def angular_momentum(self) -> Array:
        """(3,) angular momentum of all bodies about the origin [kg m²/s]."""

    @property
    def kinetic_energy(self) -> float:
        """Translational and rotational kinetic energy of all bodies [J]."""

    def potential_energy(self, gravity: float, floor: float) -> float:
        """Return the gravitational energy [J] of all bodies, 0 at the height `floor` [m]; gravity in m/s²."""

    @property
    def smarticles(self) -> State:
        """This state, if the bodies are smarticles; raises InputError for other bodies."""

    @property
    def bodies(self) -> BarState | None:
        """This state, if the bodies are no smarticles; None for smarticles."""


class BarState:
    """Base of the states of bodies that consist of bars, M bars in all, in the laboratory frame.

    Subclasses are dataclasses with `mixture`, `kind`, `positions` and `velocities`.
    """

    mixture: Mixture
    kind: Numbers
    positions: Array
    velocities: Array

    @property
    def segments(self) -> Array:
        """(M, 2, 3) both ends of all bars [m]."""
        raise NotImplementedError

    @property
    def normals(self) -> Array:
        """(M, 3) unit vectors along the normal of each bar; zeros where the section is round [1]."""
        raise NotImplementedError

    @property
    def bar_velocities(self) -> Array:
        """(M, 3) velocities of the bars' centres [m/s]."""
        raise NotImplementedError

    @property
    def bar_spins(self) -> Array:
        """(M, 3) angular velocities of the bars [rad/s]."""
        raise NotImplementedError

    def spheres(self) -> Array:
        """Return (N, S, 3) centres of all spheres [m]; a body with fewer than S spheres repeats its last one."""
        sizes, rows = self.mixture.sizes[self.kind], []
        for start, kind in zip(np.cumsum(sizes) - sizes, self._kinds, strict=True):
            ends = self.segments[start + kind.links]
            rows.append(ends[:, 0] + kind.stations[:, None] * (ends[:, 1] - ends[:, 0]))
        return padded(rows) if rows else np.zeros((0, 1, 3))

    @property
    def count(self) -> int:
        return len(self.positions)

    @property
    def smarticles(self) -> State:
        raise InputError("particle: these bodies are no smarticles, and have no barbs; leave particle out")

    @property
    def bodies(self) -> Self:
        return self

    @property
    def volume(self) -> float:
        return self.mixture.mean(self.mixture.volumes.tolist(), self.kind if self.count else None)

    @cached_property
    def body(self) -> Numbers:
        """(M,) number of the body to which each bar belongs."""
        return np.repeat(np.arange(self.count), self.mixture.sizes[self.kind])

    @cached_property
    def bar(self) -> Numbers:
        """(M,) number of each bar in its body."""
        sizes = self.mixture.sizes[self.kind]
        return np.arange(len(self.body)) - np.repeat(np.cumsum(sizes) - sizes, sizes)

    @property
    def _kinds(self) -> list[Kind]:
        return [self.mixture.kinds[k] for k in self.kind]

    @cached_property
    def tops(self) -> Array:
        return self.largest(self.segments[..., 2].max(axis=1))

    @cached_property
    def speeds(self) -> Array:
        return self.largest(np.linalg.norm(self.bar_velocities, axis=1))

    def largest(self, values: Array) -> Array:
        """Return (N,) the largest value of each body, from values (M,) of the bars."""
        found = np.full(self.count, -np.inf)
        np.maximum.at(found, self.body, values)
        return found

    def spheres_by_body(self) -> list[Array]:
        """Return (S, 3) centres of the spheres of each body [m]."""
        return [row[: len(kind.centres)] for row, kind in zip(self.spheres(), self._kinds, strict=True)]

    @cached_property
    def _masses(self) -> Array:
        return self.mixture.masses[self.kind]

    @cached_property
    def momentum(self) -> Array:
        return np.asarray((self._masses[:, None] * self.velocities).sum(axis=0))


@dataclass(frozen=True)
class RigidState(BarState):
    """Poses and velocities of N rigid bodies of several kinds with M bars in all, laboratory frame."""

    mixture: Mixture
    kind: Numbers  #: (N,) kind of each body
    positions: Array  #: (N, 3) centres of mass [m]
    rotations: Array  #: (N, 3, 3) rotations from body frame to laboratory frame [1]
    velocities: Array  #: (N, 3) velocities of the centres of mass [m/s]
    spins: Array  #: (N, 3) angular velocities [rad/s]

    @cached_property
    def _bar_of_kind(self) -> Numbers:
        """(M,) index of each bar in `Mixture.ends`, the bars of all kinds."""
        sizes = self.mixture.sizes
        return (np.cumsum(sizes) - sizes)[self.kind[self.body]] + self.bar

    @cached_property
    def segments(self) -> Array:
        local = self.mixture.ends[self._bar_of_kind]
        turned = matrix_product(self.rotations[self.body, None], local[..., None])[..., 0]
        return np.asarray(turned + self.positions[self.body, None])

    @cached_property
    def normals(self) -> Array:
        local = self.mixture.normals[self._bar_of_kind]
        return matrix_product(self.rotations[self.body], local[..., None])[..., 0]

    @cached_property
    def bar_velocities(self) -> Array:
        arms = self.segments.mean(axis=1) - self.positions[self.body]
        return self.velocities[self.body] + np.cross(self.spins[self.body], arms)

    @cached_property
    def bar_spins(self) -> Array:
        return self.spins[self.body]

    def spheres(self) -> Array:
        return self.placed(self.mixture.spheres)

    def placed(self, points: Array) -> Array:
        """Return (N, P, 3) places [m] of points (K, P, 3) in the frames of all kinds [m], those of each body's kind."""
        return matrix_product(points[self.kind], np.swapaxes(self.rotations, 1, 2)) + self.positions[:, None]

    @cached_property
    def _own_spins(self) -> tuple[Array, Array]:
        """Principal moments (N, 3) [kg m²], and angular velocities (N, 3) along the principal axes [rad/s]."""
        spins = matrix_product(np.swapaxes(self.rotations, 1, 2), self.spins[..., None])[..., 0]
        return self.mixture.inertias[self.kind], spins

    @cached_property
    def angular_momentum(self) -> Array:
        inertias, spins = self._own_spins
        own = matrix_product(self.rotations, (inertias * spins)[..., None])[..., 0]
        orbital = np.cross(self.positions, self._masses[:, None] * self.velocities)
        return np.asarray((orbital + own).sum(axis=0))

    @cached_property
    def kinetic_energy(self) -> float:
        inertias, spins = self._own_spins
        return float(0.5 * ((self._masses[:, None] * self.velocities**2).sum() + (inertias * spins**2).sum()))

    def potential_energy(self, gravity: float, floor: float) -> float:
        return float((self._masses * gravity * (self.positions[:, 2] - floor)).sum())


@dataclass(frozen=True)
class FilamentState(BarState):
    """Positions and velocities of N filaments of several kinds with M segments in all, laboratory frame."""

    mixture: Mixture
    kind: Numbers  #: (N,) kind of each filament
    nodes: Array  #: (M + N, 3) positions of the nodes, filament by filament [m]
    node_velocities: Array  #: (M + N, 3) velocities of the nodes [m/s]
    #: (M + N,) rate at which the segment after each node rolls about its axis [rad/s]; unused at a filament's last node
    rolls: Array

    @property
    def count(self) -> int:
        return len(self.kind)

    @cached_property
    def _begin(self) -> Numbers:
        """(N + 1,) number of each filament's first node, then M + N."""
        return np.concatenate([[0], np.cumsum(1 + self.mixture.sizes[self.kind])])

    @cached_property
    def _starts(self) -> Numbers:
        """(M,) number of the node at which each segment starts."""
        return np.delete(np.arange(len(self.nodes)), self._begin[1:] - 1)

    @cached_property
    def node_masses(self) -> Array:
        """(M + N,) masses of the nodes [kg]."""
        return np.concatenate([np.zeros(0), *(filament.masses for filament in self._filaments)])

    @property
    def _filaments(self) -> list[Filament]:
        return [kind.filament for kind in self._kinds if kind.filament is not None]

    def _mean(self, values: Array) -> Array:
        """Return (N, 3) the mean of each filament, weighted by mass, from values (M + N, 3) at nodes."""
        sums = np.add.reduceat(self.node_masses[:, None] * values, self._begin[:-1]) if self.count else values[:0]
        return np.asarray(sums / self._masses[:, None])

    @cached_property
    def positions(self) -> Array:  # type: ignore[override]
        return self._mean(self.nodes)

    @cached_property
    def velocities(self) -> Array:  # type: ignore[override]
        return self._mean(self.node_velocities)

    @cached_property
    def segments(self) -> Array:
        return np.stack([self.nodes[self._starts], self.nodes[self._starts + 1]], axis=1)

    @cached_property
    def _edges(self) -> Array:
        """(M, 3) vectors from start to end of the segments [m]."""
        return self.segments[:, 1] - self.segments[:, 0]

    @property
    def normals(self) -> Array:
        """(M, 3) zeros, since sections are round [1]."""
        return np.zeros((len(self._starts), 3))

    @cached_property
    def bar_velocities(self) -> Array:
        return 0.5 * (self.node_velocities[self._starts] + self.node_velocities[self._starts + 1])

    @cached_property
    def bar_spins(self) -> Array:
        edges = self._edges
        opening = self.node_velocities[self._starts + 1] - self.node_velocities[self._starts]
        squares = (edges**2).sum(axis=1)
        rolls = (self.rolls[self._starts] / np.sqrt(squares))[:, None] * edges
        return np.asarray(rolls + np.cross(edges, opening) / squares[:, None])

    @cached_property
    def _rolling(self) -> Array:
        """(M,) angular momenta of the segments about their axes [kg m²/s]."""
        inertias = [np.full(f.nodes - 1, f.axial_inertia) for f in self._filaments]
        return np.concatenate([np.zeros(0), *inertias]) * self.rolls[self._starts]

    @cached_property
    def angular_momentum(self) -> Array:
        edges = self._edges
        tangents = edges / np.sqrt((edges**2).sum(axis=1))[:, None]
        orbital = np.cross(self.nodes, self.node_masses[:, None] * self.node_velocities)
        return np.asarray(orbital.sum(axis=0) + (self._rolling[:, None] * tangents).sum(axis=0))

    @cached_property
    def kinetic_energy(self) -> float:
        """Kinetic energy of all nodes and of the rolling of all segments about their axes [J]."""
        moving = (self.node_masses[:, None] * self.node_velocities**2).sum()
        return float(0.5 * (moving + (self._rolling * self.rolls[self._starts]).sum()))

    def potential_energy(self, gravity: float, floor: float) -> float:
        """Return the potential energy of weight less buoyancy [J], 0 at `floor` [m]; gravity in m/s²."""
        shares = np.array([filament.weight_share for filament in self._filaments])
        return float((self._masses * shares * gravity * (self.positions[:, 2] - floor)).sum())


@dataclass(frozen=True)
class LinkageState(BarState):
    """Poses and velocities of the M links of N linkages of several kinds, in the laboratory frame."""

    mixture: Mixture
    kind: Numbers  #: (N,) kind of each linkage
    links: RigidState  #: Of all links, linkage by linkage, of the kinds `Mixture.pieces`

    @property
    def count(self) -> int:
        return len(self.kind)

    def _mean(self, values: Array) -> Array:
        """Return the means (N, 3) over the mass of each linkage, of values (M, 3) of links."""
        sizes, masses = self.mixture.sizes[self.kind], self.mixture.pieces.masses[self.links.kind]
        sums = np.add.reduceat(masses[:, None] * values, np.cumsum(sizes) - sizes) if self.count else values[:0]
        return np.asarray(sums / self._masses[:, None])

    @cached_property
    def positions(self) -> Array:  # type: ignore[override]
        return self._mean(self.links.positions)

    @cached_property
    def velocities(self) -> Array:  # type: ignore[override]
        return self._mean(self.links.velocities)

    @property
    def segments(self) -> Array:
        return self.links.segments

    @cached_property
    def gaps(self) -> Array:
        """(N, 1) widest gap between ends of links at a joint of each linkage [m]."""
        inner = np.flatnonzero(np.diff(self.body) == 0)
        apart = np.linalg.norm(self.segments[inner + 1, 0] - self.segments[inner, 1], axis=1)
        found = np.zeros((self.count, 1))
        np.maximum.at(found[:, 0], self.body[inner], apart)
        return found

    @property
    def normals(self) -> Array:
        return self.links.normals

    @property
    def bar_velocities(self) -> Array:
        return self.links.velocities

    @property
    def bar_spins(self) -> Array:
        return self.links.spins

    @property
    def angular_momentum(self) -> Array:
        return self.links.angular_momentum

    @property
    def kinetic_energy(self) -> float:
        return self.links.kinetic_energy

    def potential_energy(self, gravity: float, floor: float) -> float:
        return self.links.potential_energy(gravity, floor)


@dataclass(frozen=True)
class State:
    """Poses and velocities of all links of smarticles, in the laboratory frame.

    A smarticle has three links, whether it is welded or articulated: 0 barb 1, 1 middle link, 2 barb 2.
    """

    boxes: Boxes
    link_positions: Array  #: (N, 3, 3) centres of the links [m]
    link_rotations: Array  #: (N, 3, 3, 3) link frames, see `Boxes.link_rotations` [1]
    link_velocities: Array  #: (N, 3, 3) velocities of the links' centres [m/s]
    link_spins: Array  #: (N, 3, 3) angular velocities of the links [rad/s]

    @classmethod
    def rigid(
        cls,
        boxes: Boxes,
        positions: Array,
        rotations: Array,
        velocities: Array,
        spins: Array,
        *,
        shapes: tuple[Array, Array] | None = None,
    ) -> Self:
        """Return the state of N rigid smarticles.

        Args:
            positions: (N, 3) centres of mass [m].
            rotations: (N, 3, 3) rotations from the body frame to the laboratory frame [1].
            velocities: (N, 3) velocities of the centres of mass [m/s].
            spins: (N, 3) angular velocities [rad/s].
            shapes: centres (N, 3, 3) [m] and frames (N, 3, 3, 3) of the links of each smarticle in its body frame;
                None: those of `boxes` for all smarticles.
        """
        centres, frames = shapes or (boxes.link_centres[None], boxes.link_rotations[None])
        arms = np.einsum("nij,nkj->nki", rotations, centres)
        turned = np.einsum("nij,nkjm->nkim", rotations, frames)
        shared = np.repeat(spins[:, None], LINKS, axis=1)
        return cls(boxes, positions[:, None] + arms, turned, velocities[:, None] + np.cross(shared, arms), shared)

    @property
    def count(self) -> int:
        return len(self.link_positions)

    @cached_property
    def positions(self) -> Array:
        return self._mean(self.link_positions)

    @cached_property
    def velocities(self) -> Array:
        return self._mean(self.link_velocities)

    def _mean(self, values: Array) -> Array:
        return np.asarray(np.einsum("nkj,k->nj", values, self.boxes.link_masses / self.boxes.mass))

    @property
    def smarticles(self) -> State:
        return self

    @property
    def bodies(self) -> None:
        """None, since the bodies are smarticles."""

    @property
    def volume(self) -> float:
        return self.boxes.volume

    @property
    def tops(self) -> Array:
        return np.asarray(self.vertices[..., 2].max(axis=1))

    @property
    def speeds(self) -> Array:
        return np.asarray(np.linalg.norm(self.link_velocities, axis=-1).max(axis=-1))

    @cached_property
    def vertices(self) -> Array:
        """(N, 4, 3) barb tip, hinge, hinge, barb tip of each smarticle [m]; hinges are the middle link's ends."""
        half = self.link_rotations[..., 0] * (self.boxes.lengths / 2)[None, :, None]
        starts, ends = self.link_positions - half, self.link_positions + half
        return np.stack([ends[:, 0], starts[:, 1], ends[:, 1], ends[:, 2]], axis=1)

    @cached_property
    def angles(self) -> Array:
        """(N, 2) angles (α1, α2) of the barbs [rad], from the directions of the links."""
        (along1, across1), (along2, across2) = (
            [np.einsum("ni,ni->n", self.link_rotations[:, barb, :, 0], self.link_rotations[:, 1, :, k]) for k in (0, 1)]
            for barb in (0, 2)
        )
        return by_element(math.atan2, np.stack([across1, across2], axis=1), np.stack([-along1, along2], axis=1))

    def spheres(self, particle: Particle, which: Numbers | None = None) -> Array:
        """Return (N, S, 3) centres of all spheres [m], or (N, n, 3) of the n spheres with numbers `which`."""
        links, local = particle.links, particle.local_centres
        if which is not None:
            links, local = links[which], local[which]
        turned = np.einsum("nsij,sj->nsi", self.link_rotations[:, links], local)
        return np.asarray(turned + self.link_positions[:, links])

    @cached_property
    def momentum(self) -> Array:
        return np.asarray(self.boxes.mass * self.velocities.sum(axis=0))

    @cached_property
    def angular_momentum(self) -> Array:
        orbital = np.cross(self.link_positions, self.link_velocities) * self.boxes.link_masses[None, :, None]
        own = np.einsum("nkij,nkj->nki", self.link_rotations, self.boxes.link_inertias * self._local_spins)
        return np.asarray((orbital + own).sum(axis=(0, 1)))

    @cached_property
    def kinetic_energy(self) -> float:
        boxes = self.boxes
        translation = (boxes.link_masses[None, :, None] * self.link_velocities**2).sum()
        rotation = (boxes.link_inertias * self._local_spins**2).sum()
        return float(0.5 * (translation + rotation))

    @cached_property
    def _local_spins(self) -> Array:
        """(N, 3, 3) angular velocities in the links' own frames [rad/s]."""
        return np.asarray(np.einsum("nkij,nki->nkj", self.link_rotations, self.link_spins))

    def potential_energy(self, gravity: float, floor: float) -> float:
        heights = self.positions[:, 2] - floor
        return float(self.boxes.mass * gravity * heights.sum())


def spheres_of(state: PileState, model: Particle | Mixture) -> Array:
    """Return (N, S, 3) centres of all spheres [m]; in a mixture shorter rows repeat the last sphere."""
    if isinstance(model, Mixture):
        assert state.bodies is not None  # a pile of these kinds has no smarticles
        return state.bodies.spheres()
    return state.smarticles.spheres(model)


def bars_by_body(state: PileState) -> list[Array]:
    """Return both ends (S, 2, 3) of the S bars, or links, of each body [m]."""
    if state.bodies is None:
        vertices = state.smarticles.vertices
        return list(np.stack([vertices[:, :-1], vertices[:, 1:]], axis=2))
    return np.split(state.bodies.segments, np.flatnonzero(np.diff(state.bodies.body)) + 1)[: state.count]
