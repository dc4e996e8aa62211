"""Overlaps between smarticles, computed from poses for the shapes of each engine.

The overlap of two boxes is the shortest displacement that separates them. The overlap of two swept segments is the
diameter less the distance of the segments; a sphere is a segment of length zero. Links of one smarticle are not
compared.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dem.body.particle import LINKS, Boxes, Particle
from dem.engine.links.shapes import planar_of, smarticle_shape
from postprocess.measures.contacts import segment_distances

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

PARALLEL = 1e-9  # squared sine below which two edges count as parallel


@dataclass(frozen=True, eq=False)
class Bars:
    """B boxes, one for each link of all smarticles."""

    centres: Array  #: Centres, (B, 3) [m]
    frames: Array  #: Axes as columns, (B, 3, 3)
    halves: Array  #: Half lengths of the sides, (B, 3) [m]
    owners: Indices  #: Indices of smarticles, (B,)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Centres (B, 3) and radii (B,) of spheres around the boxes [m]."""
        return self.centres, np.linalg.norm(self.halves, axis=1)

    def depths(self, pairs: Indices) -> Array:
        """Return the overlaps (P,) [m] of pairs (P, 2) of boxes by separating axes; below 0: apart."""
        one, other = pairs.T
        between = self.centres[other] - self.centres[one]
        frames = np.concatenate([self.frames[one], self.frames[other]], axis=2)
        sides = np.concatenate([self.halves[one], self.halves[other]], axis=1)
        axes = [frames[:, :, k] for k in range(6)]
        axes += [np.cross(frames[:, :, i], frames[:, :, j]) for i, j in itertools.product(range(3), range(3, 6))]
        least = np.full(len(pairs), np.inf)
        for axis in axes:
            squared = np.einsum("pi,pi->p", axis, axis)
            unit = axis / np.sqrt(np.maximum(squared, PARALLEL))[:, None]
            reach = np.einsum("pk,pk->p", np.abs(np.einsum("pi,pik->pk", unit, frames)), sides)
            apart = reach - np.abs(np.einsum("pi,pi->p", unit, between))
            least = np.where(squared > PARALLEL, np.minimum(least, apart), least)
        return least


@dataclass(frozen=True, eq=False)
class Swept:
    """S segments that are swept by a sphere; a sphere is a segment of length zero."""

    starts: Array  #: First ends of the segments, (S, 3) [m]
    ends: Array  #: Second ends of the segments, (S, 3) [m]
    radius: float  #: Radius of the sphere [m]
    owners: Indices  #: Indices of smarticles, (S,)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Centres (S, 3) and radii (S,) of spheres around the segments [m]."""
        reaches = np.linalg.norm(self.ends - self.starts, axis=1) / 2 + self.radius
        return (self.starts + self.ends) / 2, reaches

    def depths(self, pairs: Indices) -> Array:
        """Return the overlaps (P,) [m] of pairs (P, 2) of swept segments; a negative value is a gap."""
        one, other = pairs.T
        ends = self.starts[one], self.ends[one], self.starts[other], self.ends[other]
        return 2 * self.radius - segment_distances(*ends)


def deepest(solid: Bars | Swept) -> float:
    """Return the largest overlap of two smarticles [m] whose links are `solid`; 0 without any overlap."""
    centres, reaches = solid.bounds
    pairs = cKDTree(centres).query_pairs(2 * float(reaches.max()), output_type="ndarray").astype(np.int64)
    one, other = pairs.T
    meet = np.linalg.norm(centres[one] - centres[other], axis=1) < reaches[one] + reaches[other]
    pairs = pairs[meet & (solid.owners[one] != solid.owners[other])]
    return max(0.0, float(solid.depths(pairs).max())) if len(pairs) else 0.0


def solid_of(shape: str, particle: Particle, positions: Array, frames: Array) -> Bars | Swept:
    """Return all links of N smarticles in the shape that an engine uses for contacts.

    Shapes are "boxes"; "strands", the swept segments of the engine `links`; and "spheres", chains of YADE and LAMMPS.
    Centres (N, 3, 3) [m] and axes (N, 3, 3, 3), in columns, are those of the links.
    """
    if shape == "boxes":
        halves, owners = np.tile(halves_of(particle.boxes), (len(positions), 1)), np.arange(len(positions))
        return Bars(positions.reshape(-1, 3), frames.reshape(-1, 3, 3), halves, np.repeat(owners, LINKS))
    return (_strands if shape == "strands" else _spheres)(particle, positions, frames)


def halves_of(boxes: Boxes) -> Array:
    """Return half the side lengths of each link of `boxes` along the axes of its frame, (3, 3) [m]."""
    sections = np.tile([boxes.thickness_in_plane, boxes.thickness_normal], (LINKS, 1))
    return np.column_stack([boxes.lengths, sections]) / 2


def _strands(particle: Particle, positions: Array, frames: Array) -> Swept:
    """Return the strands of all links: one or several equal segments side by side along a link's normal.

    The engine `links` has the same strands. A barb's strand goes from the hinge to a radius before the tip.
    """
    planar = planar_of(particle)
    barb = (-planar.arm, planar.tip - planar.arm)
    spans = {0: barb, 1: (-planar.end, planar.end), 2: barb}
    ends: tuple[list[Array], list[Array]] = ([], [])
    for link in np.unique(smarticle_shape(particle).link):
        for offset in particle.offsets:
            for kept, along in zip(ends, spans[int(link)], strict=True):
                kept.append(positions[:, link] + along * frames[:, link, :, 0] + offset * frames[:, link, :, 2])
    starts, stops = (np.concatenate(kept) for kept in ends)
    owners = np.tile(np.arange(len(positions)), len(starts) // len(positions))
    return Swept(starts, stops, particle.radius, owners)


def _spheres(particle: Particle, positions: Array, frames: Array) -> Swept:
    turned = np.einsum("nsij,sj->nsi", frames[:, particle.links], particle.local_centres)
    centres = (positions[:, particle.links] + turned).reshape(-1, 3)
    owners = np.repeat(np.arange(len(positions)), len(particle.links))
    return Swept(centres, centres, particle.radius, owners)
