"""Poses and velocities of all smarticles at one instant."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.particle import LINKS, Boxes, Particle


@dataclass(frozen=True)
class State:
    """Poses and velocities of all links, in the laboratory frame.

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
        """Number of smarticles, N."""
        return len(self.link_positions)

    @cached_property
    def positions(self) -> Array:
        """(N, 3) centres of mass of the smarticles [m]."""
        return self._mean(self.link_positions)

    @cached_property
    def velocities(self) -> Array:
        """(N, 3) velocities of the centres of mass [m/s]."""
        return self._mean(self.link_velocities)

    def _mean(self, values: Array) -> Array:
        return np.asarray(np.einsum("nkj,k->nj", values, self.boxes.link_masses / self.boxes.mass))

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
        return np.stack([np.arctan2(across1, -along1), np.arctan2(across2, along2)], axis=1)

    def spheres(self, particle: Particle, which: Numbers | None = None) -> Array:
        """Return (N, S, 3) centres of all spheres [m], or (N, len(which), 3) of the spheres `which`."""
        links, local = particle.links, particle.local_centres
        if which is not None:
            links, local = links[which], local[which]
        turned = np.einsum("nsij,sj->nsi", self.link_rotations[:, links], local)
        return np.asarray(turned + self.link_positions[:, links])

    @cached_property
    def momentum(self) -> Array:
        """(3,) momentum of all smarticles [kg m/s]."""
        return np.asarray(self.boxes.mass * self.velocities.sum(axis=0))

    @cached_property
    def angular_momentum(self) -> Array:
        """(3,) angular momentum of all smarticles about the origin [kg m²/s]."""
        orbital = np.cross(self.link_positions, self.link_velocities) * self.boxes.link_masses[None, :, None]
        own = np.einsum("nkij,nkj->nki", self.link_rotations, self.boxes.link_inertias * self._local_spins)
        return np.asarray((orbital + own).sum(axis=(0, 1)))

    @cached_property
    def kinetic_energy(self) -> float:
        """Translational and rotational kinetic energy of all links [J]."""
        boxes = self.boxes
        translation = (boxes.link_masses[None, :, None] * self.link_velocities**2).sum()
        rotation = (boxes.link_inertias * self._local_spins**2).sum()
        return float(0.5 * (translation + rotation))

    @cached_property
    def _local_spins(self) -> Array:
        """(N, 3, 3) angular velocities in the links' own frames [rad/s]."""
        return np.asarray(np.einsum("nkij,nki->nkj", self.link_rotations, self.link_spins))

    def potential_energy(self, gravity: float, floor: float) -> float:
        """Return the gravitational energy [J] of all smarticles, 0 at the height `floor` [m]; gravity in m/s²."""
        heights = self.positions[:, 2] - floor
        return float(self.boxes.mass * gravity * heights.sum())
