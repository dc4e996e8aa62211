"""Rigid bodies of straight bars, flat or round, joined at their ends: staples, crosses or rings."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

import numpy as np

from dem.arrays import Array, Flags, Numbers
from dem.body.linear import applied, dot, eigen_symmetric, matrix_product
from dem.body.particle import mean_width
from dem.errors import InputError

JOINED = 1e-9  # of the longest bar: ends that are nearer are one joint


def first_ends(points: Array) -> Numbers:
    """Return (2 S,) a number for each end of segments (S, 2, 3) [m], the same for all ends at one point.

    End e (0 or 1) of segment s has the number 2 s + e. Of all ends at a point, the lowest number is returned.
    """
    places = points.reshape(-1, 3)
    longest = np.abs(points[:, 1] - points[:, 0]).max()
    return np.asarray((np.abs(places[:, None] - places).max(axis=-1) <= JOINED * longest).argmax(axis=1))


def owners(first: Numbers, inner: Flags) -> Flags:
    """Return (2 S,) whether each end of a segment owns the point where it lies.

    Every joint, where ends of several segments meet, has one owner: the first end there whose segment is joined at both
    of its ends, or the first end if there is no such segment. A free end owns its point.

    `first` are the numbers (2 S,) of `first_ends`; `inner` (2 S,): whether an end's segment is joined at both its ends.
    """
    order = np.lexsort((np.arange(len(first)), ~inner, first))
    found = np.zeros(len(first), np.bool_)
    found[order[np.append(True, np.diff(first[order]) != 0)]] = True
    return found


def segment_distances(one: Array, other: Array) -> Array:
    """Return (P,) distances between segments `one` (P, 2, 3) and `other` (P, 2, 3), pair by pair.

    Segments may have length 0. Source: Ericson, Real-Time Collision Detection, section 5.1.9.
    """
    p, q = one[:, 0], other[:, 0]
    u, v, w = one[:, 1] - p, other[:, 1] - q, p - q
    a, e, b = (u * u).sum(axis=1), (v * v).sum(axis=1), (u * v).sum(axis=1)
    c, f = (u * w).sum(axis=1), (v * w).sum(axis=1)
    det = a * e - b * b

    def ratio(top: Array, bottom: Array) -> Array:
        return np.clip(np.divide(top, bottom, out=np.zeros_like(top), where=bottom > 0), 0.0, 1.0)

    s = np.where(det > 1e-12 * a * e, ratio(b * f - c * e, det), 0.0)
    t = ratio(b * s + f, e)
    s = ratio(b * t - c, a)
    apart = w + s[:, None] * u - t[:, None] * v
    return np.asarray(np.sqrt((apart**2).sum(axis=1)))


@dataclass(frozen=True, kw_only=True)
class Bars:
    """S straight bars of one cross-section that form a rigid body.

    Mass and inertia are the sums over one box, or cylinder, per bar. Boxes overlap at joints, where mass counts twice,
    as in the paper. InputError if a bar is not longer than its thickness, a normal is along its bar, or bars touch
    elsewhere than at joints.
    """

    points: Array  #: (S, 2, 3) both ends of each bar [m], in any frame
    normals: Array  #: (S, 3) normal of each bar, along which `thickness_normal` is measured, of any length [1]
    thickness_normal: float  #: Thickness of all bars along their normals [m]
    thickness_in_plane: float  #: Thickness of all bars across length and normal [m]
    density: float  #: [kg/m³]
    round: bool = False  #: Whether the section is a disc; both thicknesses are then its diameter

    def __post_init__(self) -> None:
        least = self.thickness_in_plane
        for k, length in enumerate(self.lengths):
            if not length > least:
                raise InputError(f"bar {k}: {length:g} m long; make it longer than its thickness, {least:g} m")
        if not (np.linalg.norm(np.cross(self.directions, self.normals), axis=1) > 1e-9).all():
            raise InputError("normals: one is along its bar; give a direction across it")
        first, second, apart = self.gaps
        least = min(self.thickness_normal, self.thickness_in_plane)
        if len(apart) and not apart.min() > least:
            k = int(np.argmin(apart))
            raise InputError(
                f"bars {first[k]} and {second[k]} cross or touch: their axes are {apart[k]:.3g} m apart away from a "
                f"common joint; keep them more than their thickness apart, {least:g} m"
            )

    @cached_property
    def _joints(self) -> Numbers:
        """(2 S,) number of the joint, or free end, at each end of the bars, see `first_ends`."""
        return first_ends(self.points)

    @cached_property
    def gaps(self) -> tuple[Numbers, Numbers, Array]:
        """Numbers of the first and of the second bar of all P pairs of bars, and distances of their axes [m].

        Each array is (P,). The axes of two bars with a common joint meet there. Their distance is measured from the far
        end of one bar to the axis of the other bar, and the smaller of the two values is given.
        """
        first, second = np.triu_indices(len(self.points), 1)
        joints = self._joints.reshape(-1, 2)
        one, other = joints[first], joints[second]
        same = one[:, :, None] == other[:, None, :]  # (P, 2, 2) whether an end of one is an end of the other
        apart = segment_distances(self.points[first], self.points[second])
        for k in np.flatnonzero(same.any(axis=(1, 2))):
            i, j = np.argwhere(same[k])[0]
            a, b = self.points[first[k]], self.points[second[k]]
            ends = np.array([[a[1 - i], a[1 - i]], [b[1 - j], b[1 - j]]])
            apart[k] = float(segment_distances(ends, np.array([b, a])).min())
        return first, second, apart

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
        area = self.thickness_normal * self.thickness_in_plane * (math.pi / 4 if self.round else 1.0)
        return self.density * area * self.lengths

    @property
    def mass(self) -> float:
        """Mass of the body [kg]."""
        return float(self.masses.sum())

    @property
    def volume(self) -> float:
        """Sum of the bars' volumes [m³]; overlaps at joints count twice, as in the paper."""
        return self.mass / self.density

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
        # The second moment of a disc is 3/4 of that of the square around it, over their areas.
        squares = np.array([self.thickness_in_plane**2, self.thickness_normal**2]) * (0.75 if self.round else 1.0)
        tensor = np.zeros((3, 3))
        for mass, length, frame, ends in zip(self.masses, self.lengths, self._frames, self.points, strict=True):
            arm = ends.mean(axis=0) - self._centre_of_mass
            second = mass / 12 * np.array([length**2, *squares])
            moment = matrix_product(frame * second, frame.T) + mass * arm[:, None] * arm
            tensor += np.trace(moment) * np.eye(3) - moment
        moments, axes = (found[0] for found in eigen_symmetric(tensor[None]))
        order = max(permutations(range(3)), key=lambda order: sum(abs(axes[k, order[k]]) for k in range(3)))
        axes = axes[:, order] * np.where(np.diag(axes[:, order]) < 0, -1.0, 1.0)
        axes[:, 2] *= 1.0 if dot(np.cross(axes[:, 0], axes[:, 1]), axes[:, 2]) > 0 else -1.0
        return moments[list(order)], axes

    @property
    def inertia(self) -> Array:
        """(3,) principal moments about the centre of mass [kg m²], along the axes of the body's frame."""
        return self._principal[0]

    @property
    def rotation(self) -> Array:
        """(3, 3) axes of the body's frame in columns, in the frame of `points`."""
        return self._principal[1]

    @cached_property
    def frames(self) -> Array:
        """(S, 3, 3) unit vectors along, across and normal to each bar in columns, in the body's frame."""
        return matrix_product(self.rotation.T, self._frames)

    @cached_property
    def ends(self) -> Array:
        """(S, 2, 3) both ends of each bar [m], in the body's frame: centre of mass, principal axes."""
        return applied(self.rotation.T, self.points - self._centre_of_mass)

    @cached_property
    def free(self) -> Flags:
        """(S, 2) whether each end of a bar is free: not the end of another bar."""
        first = self._joints
        return np.asarray((np.bincount(first, minlength=len(first))[first] == 1).reshape(-1, 2))

    @cached_property
    def owned(self) -> Flags:
        """(S, 2) whether each bar owns the joint, or free end, at its start and at its end.

        A joint is a common end of several bars. Each joint has one owner: the first of those bars that are joined at
        both ends, or else the first bar.
        """
        return owners(self._joints, np.repeat((~self.free).all(axis=1), 2)).reshape(-1, 2)

    def radius(self, rows: int) -> float:
        """Return the radius [m] of the `rows` strands, swept spheres side by side, that represent a bar.

        The diameter of a single strand is the mean width of the section. The diameter of several strands is the bar's
        thickness in the plane.
        """
        if self.round:
            return self.thickness_in_plane / 2
        one = mean_width(self.thickness_normal, self.thickness_in_plane)
        return (one if rows == 1 else self.thickness_in_plane) / 2

    def axes(self, radius: float) -> tuple[Array, Array]:
        """Return the starts and the ends of the bars' axes, each (S, 3), in the body's frame [m].

        Free ends are moved inwards by the `radius` of a strand [m]; InputError if nothing is left of a bar's axis.
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
