"""Rigid bodies of straight flat bars that are joined at their ends: staples, crosses or rings."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

import numpy as np

from dem.arrays import Array, Numbers
from dem.body.linear import applied, eigen_symmetric, matrix_product
from dem.body.particle import mean_width
from dem.errors import InputError

JOINED = 1e-9  # of the longest bar: ends that are nearer are one joint


def first_ends(points: Array) -> Numbers:
    """Return for each end of S segments the number of the first end at the same place, (2 S,).

    Args:
        points: (S, 2, 3) ends of the segments [m]. End e of segment s has the number 2 s + e.
    """
    places = points.reshape(-1, 3)
    longest = np.abs(points[:, 1] - points[:, 0]).max()
    return np.asarray((np.abs(places[:, None] - places).max(axis=-1) <= JOINED * longest).argmax(axis=1))


@dataclass(frozen=True, kw_only=True)
class Bars:
    """S straight bars of one cross-section that form a rigid body.

    Mass and inertia are the sums over one box per bar. Boxes overlap at joints, where mass counts twice, as in the
    paper.

    Raises:
        InputError: a bar is too short for its thickness, or its normal is along it.
    """

    points: Array  #: (S, 2, 3) both ends of each bar [m], in any frame
    normals: Array  #: (S, 3) direction of the thickness along the normal, need not be of unit length [1]
    thickness_normal: float  #: [m]
    thickness_in_plane: float  #: [m]
    density: float  #: [kg/m³]

    def __post_init__(self) -> None:
        least = self.thickness_in_plane
        for k, length in enumerate(self.lengths):
            if not length > least:
                raise InputError(f"bar {k}: {length:g} m long; make it longer than its thickness, {least:g} m")
        if not (np.linalg.norm(np.cross(self.directions, self.normals), axis=1) > 0).all():
            raise InputError("normals: one is along its bar; give a direction across it")

    @cached_property
    def lengths(self) -> Array:
        """(S,) lengths of the bars [m]."""
        return np.asarray(np.sqrt(((self.points[:, 1] - self.points[:, 0]) ** 2).sum(axis=1)))

    @cached_property
    def directions(self) -> Array:
        """(S, 3) unit vectors from start to end, in the frame of `points`."""
        return np.asarray((self.points[:, 1] - self.points[:, 0]) / self.lengths[:, None])

    @property
    def masses(self) -> Array:
        """(S,) masses of the bars [kg]."""
        return self.density * self.thickness_normal * self.thickness_in_plane * self.lengths

    @property
    def mass(self) -> float:
        """Mass of the body [kg]."""
        return float(self.masses.sum())

    @cached_property
    def _frames(self) -> Array:
        """(S, 3, 3) unit vectors along, across and normal to each bar in columns, in the frame of `points`."""
        u = self.directions
        n = self.normals - (self.normals * u).sum(axis=1)[:, None] * u
        n = n / np.sqrt((n**2).sum(axis=1))[:, None]
        return np.stack([u, np.cross(n, u), n], axis=-1)

    @cached_property
    def _centre_of_mass(self) -> Array:
        return np.asarray((self.masses[:, None] * self.points.mean(axis=1)).sum(axis=0) / self.mass)

    @cached_property
    def _principal(self) -> tuple[Array, Array]:
        """Principal moments (3,) [kg m²] and principal axes (3, 3) in columns, in the frame of `points`.

        Axes are right-handed, and ordered such that they are as near as possible to the axes of that frame.
        """
        squares = np.array([self.thickness_in_plane**2, self.thickness_normal**2])
        tensor = np.zeros((3, 3))
        for mass, length, frame, ends in zip(self.masses, self.lengths, self._frames, self.points, strict=True):
            arm = ends.mean(axis=0) - self._centre_of_mass
            second = mass / 12 * np.array([length**2, *squares])
            moment = matrix_product(frame * second, frame.T) + mass * arm[:, None] * arm
            tensor += np.trace(moment) * np.eye(3) - moment
        moments, axes = (found[0] for found in eigen_symmetric(tensor[None]))
        order = max(permutations(range(3)), key=lambda order: sum(abs(axes[k, order[k]]) for k in range(3)))
        axes = axes[:, order] * np.where(np.diag(axes[:, order]) < 0, -1.0, 1.0)
        axes[:, 2] *= 1.0 if np.dot(np.cross(axes[:, 0], axes[:, 1]), axes[:, 2]) > 0 else -1.0
        return moments[list(order)], axes

    @property
    def inertia(self) -> Array:
        """(3,) principal moments about the centre of mass [kg m²], along the axes of the body's frame."""
        return self._principal[0]

    @property
    def rotation(self) -> Array:
        """(3, 3) axes of the body's frame in columns, in the frame of `points`."""
        return self._principal[1]

    @property
    def frames(self) -> Array:
        """(S, 3, 3) unit vectors along, across and normal to each bar in columns, in the body's frame."""
        return matrix_product(self.rotation.T, self._frames)

    @cached_property
    def ends(self) -> Array:
        """(S, 2, 3) both ends of each bar in the body's frame: centre of mass, principal axes [m]."""
        return applied(self.rotation.T, self.points - self._centre_of_mass)

    @property
    def free(self) -> Array:
        """(S, 2) whether each end of a bar is free: not the end of another bar."""
        first = first_ends(self.points)
        return np.asarray((np.bincount(first, minlength=len(first))[first] == 1).reshape(-1, 2))

    def radius(self, rows: int) -> float:
        """Return the radius [m] of the `rows` strands, swept spheres side by side, that represent a bar.

        The diameter of a single strand is the mean width of the section. The diameter of several strands is the bar's
        thickness in the plane.
        """
        one = mean_width(self.thickness_normal, self.thickness_in_plane)
        return (one if rows == 1 else self.thickness_in_plane) / 2

    def axes(self, radius: float) -> tuple[Array, Array]:
        """Return the starts and the ends of the bars' axes, each (S, 3), in the body's frame [m].

        Args:
            radius: radius of a strand [m], by which free ends are moved inwards.

        Raises:
            InputError: nothing of a bar is left between its ends.
        """
        pulled = radius * self.free
        if not (self.lengths > pulled.sum(axis=1)).all():
            k = int(np.argmin(self.lengths - pulled.sum(axis=1)))
            raise InputError(
                f"bar {k}: {self.lengths[k]:g} m long; make it longer than {2 * radius:g} m, its thickness"
            )
        along = applied(self.rotation.T, self.directions)
        return self.ends[:, 0] + pulled[:, :1] * along, self.ends[:, 1] - pulled[:, 1:] * along

    @property
    def effective_mass(self) -> float:
        """Effective mass [kg] at a contact: the harmonic mean over the bars' axes and all directions.

        The inverse of the effective mass at a point r in the direction n is the mobility 1/m + (r × n)·I⁻¹(r × n). Its
        mean over n is a third of the trace of the mobility tensor. The trace is a quadratic function of the position
        along a bar, which two Gauss points integrate exactly.
        """
        inverse, place = 1.0 / self.inertia, 0.5 / math.sqrt(3)
        starts, ends = self.ends[:, 0], self.ends[:, 1]
        squares = np.array([((0.5 - s) * starts + (0.5 + s) * ends) ** 2 for s in (-place, place)])
        rotation = ((squares.sum(axis=-1, keepdims=True) - squares) * inverse).sum(axis=-1).mean(axis=0) / 3
        return float(1.0 / (1.0 / self.mass + (self.masses * rotation).sum() / self.mass))
