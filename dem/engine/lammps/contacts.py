"""Contacts and overlaps on LAMMPS, computed in this process from the positions of the spheres."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.spatial import cKDTree

from dem.arrays import Array, Numbers
from dem.engine.lammps.boundaries import LammpsBoundaries
from dem.physics.contact import ContactLaw
from dem.physics.overlaps import Overlaps


@dataclass(frozen=True)
class Contacts:
    """All contacts of spheres at one instant."""

    count: int  #: Number of bodies, N
    pairs: Numbers  #: (C, 2) numbers of the two bodies of each pair of touching spheres
    depths: Array  #: (C,) overlap of each pair of `pairs` [m]
    fixed: Numbers  #: (F,) number of the body at each contact of a sphere with floor or wall
    fixed_depths: Array  #: (F,) overlap at each contact of `fixed` [m]

    @classmethod
    def of(cls, spheres: Iterable[Array], radius: float | Array, boundaries: LammpsBoundaries) -> Self:
        """Find the contacts of spheres of different bodies, and of spheres with floor and wall.

        Spheres (S, 3) of each of N bodies are centres [m]; the radius [m] is a number for all bodies, or (N,).
        """
        bodies = list(spheres)
        count, sizes = len(bodies), [len(body) for body in bodies]
        centres = np.concatenate([np.zeros((0, 3)), *bodies])
        owners = np.repeat(np.arange(count), sizes)
        radii = np.repeat(np.broadcast_to(radius, count), sizes)
        none = np.zeros((0, 2), dtype=np.int64)
        found = cKDTree(centres).query_pairs(2 * radii.max(), output_type="ndarray") if len(centres) else none
        found = found[owners[found[:, 0]] != owners[found[:, 1]]]
        apart = np.linalg.norm(centres[found[:, 0]] - centres[found[:, 1]], axis=1)
        reach = radii[found].sum(axis=1)
        meeting = apart <= reach
        beside = [radii - (centres[:, 2] - boundaries.floor)]
        if boundaries.walled:
            high = (centres[:, 2] > boundaries.wall_bottom) & (centres[:, 2] < boundaries.wall_top)
            off_axis = np.hypot(centres[:, 0], centres[:, 1])
            beside.append(np.where(high, radii - (boundaries.cylinder.radius - off_axis), -np.inf))
        touching = [np.flatnonzero(depths > 0) for depths in beside]
        return cls(
            count=count,
            pairs=owners[found[meeting]],
            depths=(reach - apart)[meeting],
            fixed=owners[np.concatenate(touching)],
            fixed_depths=np.concatenate([depths[k] for depths, k in zip(beside, touching, strict=True)]),
        )

    def neighbours(self) -> Numbers:
        ordered = np.sort(self.pairs, axis=1)
        both = np.unique(ordered[:, 0] * self.count + ordered[:, 1])
        return np.bincount(np.concatenate(np.divmod(both, max(1, self.count))), minlength=self.count)

    def touches(self) -> Numbers:
        return np.bincount(np.concatenate([self.pairs.ravel(), self.fixed]), minlength=self.count)

    def overlaps(self, limit: float, law: ContactLaw) -> Overlaps:
        deep = np.zeros(self.count, dtype=np.bool_)
        deep[self.pairs[self.depths > limit]] = True
        deep[self.fixed[self.fixed_depths > limit]] = True
        depths = np.concatenate([self.depths, self.fixed_depths])
        return Overlaps(float(depths.max(initial=0.0)), deep, self.elastic_energy(law))

    def elastic_energy(self, law: ContactLaw) -> float:
        """Return an upper bound of the elastic energy of all contacts [J].

        Normal springs are compressed by the overlaps. All tangential springs are assumed to be at the Coulomb limit,
        with the larger one of the friction coefficients between bodies and at the wall.
        """
        squares = float((self.depths**2).sum() + (self.fixed_depths**2).sum())
        friction = max(law.friction, law.wall_friction)
        return law.normal_stiffness / 2 * squares * (1 + friction**2 * law.normal_stiffness / law.tangential_stiffness)
