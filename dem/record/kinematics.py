"""Compute poses, velocities, masses and inertias of recorded bodies, and of their bars.

Frames hold the ends of bars, their velocities and angular velocities; `run.json` holds masses and thicknesses. All else
follows. Rolling about its axis is not recorded for a round bar by itself, nor for a smarticle that is straight: there
the orientation is the smallest rotation that turns x along the bar.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import permutations
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.arrays import Array, Flags, Numbers
from dem.body.particle import LINKS
from dem.record.document import Manifest

_STRAIGHT = 1e-6  # least sine of the angle between two bars that span a plane [1]
# Added to inertia tensors, over their traces, so that equal moments have axes that do not depend on rounding.
_TIE = 1e-6
_EQUAL = 1e-3  # moments that differ by less, over the trace, may keep axes that are this much off


class Recorded(Protocol):
    """Interface of a frame: what poses are computed from, see `dem.record.frame.Frame`."""

    @property
    def count(self) -> int: ...  # noqa: D102  (as in `Frame`)
    @property
    def segments(self) -> Array: ...  # noqa: D102
    @property
    def body(self) -> Numbers: ...  # noqa: D102
    @property
    def link(self) -> Numbers: ...  # noqa: D102
    @property
    def kind(self) -> Numbers: ...  # noqa: D102
    @property
    def link_velocity(self) -> Array: ...  # noqa: D102
    @property
    def link_angular_velocity(self) -> Array: ...  # noqa: D102
    @property
    def cell_data(self) -> Mapping[str, NDArray[Any]]: ...  # noqa: D102
    @property
    def normals(self) -> Array | None: ...  # noqa: D102


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedPoses:
    """Poses and motion of P bodies, or of P bars, in the laboratory frame.

    An orientation turns vectors from the own frame of a body or bar to the laboratory frame. A bar has x along its
    axis, from the first to the second of its ends, and z along its normal. The barbs of a smarticle have x from hinge
    to tip. The frame of a body has the principal axes of its inertia, as near as possible to those of its first bar, of
    a smarticle to those of its middle link.

    Filaments and chains have no orientation, since they change their shape, but their bars do.
    """

    body: Numbers = field(repr=False)  #: (P,) number of the body, its index in the frame
    link: Numbers = field(repr=False)  #: (P,) number of the bar in its body; -1 for whole bodies
    kind: Numbers = field(repr=False)  #: (P,) kind of the body, as index of `Manifest.kinds`; 0 for smarticles
    position_m: Array = field(repr=False)  #: (P, 3) centres of mass [m]
    orientation: Array = field(repr=False)  #: (P, 4) unit quaternions, real part first [1]; NaN for flexible bodies
    velocity_m_per_s: Array = field(repr=False)  #: (P, 3) velocities of the centres of mass [m/s]
    #: (P, 3) angular velocities [rad/s]; of a body that changes its shape that of a rigid one with its angular momentum
    angular_velocity_rad_per_s: Array = field(repr=False)
    mass_kg: Array = field(repr=False)  #: (P,) [kg]
    #: (P, 3) principal moments about the centre of mass, along the axes of the own frame, ascending for flexible bodies
    #: [kg m²]
    moment_of_inertia_kg_m2: Array = field(repr=False)

    def __len__(self) -> int:
        return len(self.body)

    @cached_property
    def rotation(self) -> Array:
        """(P, 3, 3) rotation matrices of `orientation` [1]."""
        found = np.full((len(self), 3, 3), np.nan)
        known = np.isfinite(self.orientation).all(axis=1)
        found[known] = Rotation.from_quat(self.orientation[known], scalar_first=True).as_matrix()
        return found

    @property
    def spin_kg_m2_per_s(self) -> Array:
        """(P, 3) angular momenta about the own centres of mass, along the axes of the own frame [kg m²/s]."""
        own = np.einsum("pji,pj->pi", self.rotation, self.angular_velocity_rad_per_s)
        return np.asarray(self.moment_of_inertia_kg_m2 * own)

    @property
    def kinetic_energy_J(self) -> Array:  # noqa: N802  (the unit)
        """(P,) energy of translation and rotation [J].

        It is NaN for filaments and chains, and lacks the motion of barbs for whole smarticles; the energies of bars
        have all of it.
        """
        own = np.einsum("pji,pj->pi", self.rotation, self.angular_velocity_rad_per_s)
        moving = self.mass_kg * (self.velocity_m_per_s**2).sum(axis=1)
        return np.asarray(0.5 * (moving + (self.moment_of_inertia_kg_m2 * own**2).sum(axis=1)))


def poses_of_bars(frame: Recorded, manifest: Manifest) -> RecordedPoses:
    """Return the poses of all bars, or links, of a frame, body by body."""
    masses, moments, flat = _inertias(frame, manifest)
    axes = _bar_axes(frame, flat, _flexible(frame, manifest))
    return RecordedPoses(
        body=frame.body,
        link=frame.link,
        kind=frame.kind[frame.body],
        position_m=frame.segments.mean(axis=1),
        orientation=_quaternions(axes),
        velocity_m_per_s=frame.link_velocity.reshape(-1, 3),
        angular_velocity_rad_per_s=frame.link_angular_velocity.reshape(-1, 3),
        mass_kg=masses,
        moment_of_inertia_kg_m2=moments,
    )


def poses_of_bodies(frame: Recorded, manifest: Manifest, bars: RecordedPoses) -> RecordedPoses:
    """Return the poses of all bodies of a frame, from those of its bars."""
    mass = _sums(bars.mass_kg, bars.body, frame.count)

    def mean(values: Array) -> Array:
        return np.asarray(_sums(bars.mass_kg[:, None] * values, bars.body, frame.count) / mass[:, None])

    centre, velocity = mean(bars.position_m), mean(bars.velocity_m_per_s)
    arms = bars.position_m - centre[bars.body]
    relative = bars.velocity_m_per_s - velocity[bars.body]
    own = np.einsum("pij,pj->pi", bars.rotation, bars.spin_kg_m2_per_s)
    each = own + bars.mass_kg[:, None] * np.cross(arms, relative)
    turned = np.einsum("pij,pj,pkj->pik", bars.rotation, bars.moment_of_inertia_kg_m2, bars.rotation)
    squares = (arms**2).sum(axis=1)[:, None, None] * np.eye(3) - arms[:, :, None] * arms[:, None]
    tensor = _sums(turned + bars.mass_kg[:, None, None] * squares, bars.body, frame.count)
    momentum = _sums(each, bars.body, frame.count)
    first = np.searchsorted(bars.body, np.arange(frame.count)) + (1 if frame.normals is None else 0)
    moments, axes = _principal(tensor, bars.rotation[first])
    quaternions = _quaternions(axes)
    flexible = _flexible(frame, manifest)
    quaternions[flexible] = np.nan
    moments[flexible] = np.sort(moments[flexible], axis=1)
    return RecordedPoses(
        body=np.arange(frame.count),
        link=np.full(frame.count, -1),
        kind=frame.kind,
        position_m=centre,
        orientation=quaternions,
        velocity_m_per_s=velocity,
        angular_velocity_rad_per_s=np.asarray(np.linalg.solve(tensor, momentum[..., None])[..., 0], np.float64),
        mass_kg=mass,
        moment_of_inertia_kg_m2=moments,
    )


def _flexible(frame: Recorded, manifest: Manifest) -> Flags:
    """Return which of the N bodies of a frame change their shape as filaments and chains do."""
    return np.array([kind.flexible for kind in manifest.kinds or ()] or [False])[frame.kind]


def _sums(values: Array, body: Numbers, count: int) -> Array:
    """Return the sums (N, …) over each of N bodies, of values (M, …) of bars that belong to bodies (M,)."""
    found = np.zeros((count, *values.shape[1:]))
    np.add.at(found, body, values)
    return found


def _inertias(frame: Recorded, manifest: Manifest) -> tuple[Array, Array, Flags]:
    """Return masses (M,) [kg] and principal moments (M, 3) [kg m²] of all bars, and which have flat sections (M,)."""
    if manifest.kinds is None:
        lengths = np.tile([manifest.barb_length_m, manifest.middle_length_m, manifest.barb_length_m], frame.count)
        across = np.tile(manifest.thicknesses_in_plane_m, frame.count)
        normal = np.full(len(lengths), manifest.thickness_normal_m)
        weights = lengths * across
        masses = manifest.smarticle_mass_kg * weights / weights[:LINKS].sum()
        disc = nodes = np.zeros(len(lengths), np.bool_)
    else:
        kind = frame.kind[frame.body]

        def each(name: str) -> NDArray[Any]:
            return np.array([getattr(one, name) for one in manifest.kinds or ()])[kind]

        lengths = np.linalg.norm(frame.segments[:, 1] - frame.segments[:, 0], axis=1)
        across, normal, disc = each("thickness_in_plane_m"), each("thickness_normal_m"), each("round")
        nodes = each("capped")  # filaments, whose nodes carry the mass
        masses = each("mass_kg") * np.where(nodes, 1 / each("bars"), lengths / each("length_m"))
    # The second moment of a disc is 3/4 of that of the square around it, over their areas.
    second = np.stack([lengths**2, across**2 * np.where(disc, 0.75, 1), normal**2 * np.where(disc, 0.75, 1)], axis=1)
    # Two halves of a mass at the ends of a segment have three times the second moment of a bar, and no width.
    second[:, 0] = np.where(nodes, 3 * lengths**2 - second[:, 1], second[:, 0])
    moments = masses[:, None] / 12 * (second.sum(axis=1, keepdims=True) - second)
    return masses, moments, ~disc


def _bar_axes(frame: Recorded, flat: Flags, flexible: Flags) -> Array:
    """Return (M, 3, 3) axes of all bars in columns: along, across and normal.

    Args:
        flat: (M,) whether the section of each bar is flat.
        flexible: (N,) whether each body changes its shape.
    """
    along = frame.segments[:, 1] - frame.segments[:, 0]
    if frame.normals is None:
        along = along.reshape(-1, LINKS, 3)
        along[:, 0] *= -1
        bare = (along == 0).all(axis=-1, keepdims=True)
        along = _units(np.where(bare, along[:, 1:2], along))  # barbs of length 0
        normal = np.repeat(_plane_normals(frame, along), LINKS, axis=0)
        return _axes(along.reshape(-1, 3), normal)
    along = _units(along)
    return _axes(along, np.where(flat[:, None], frame.normals, _round_normals(frame, along, flexible)))


def _plane_normals(frame: Recorded, along: Array) -> Array:
    """Return (N, 3) normals of the planes of smarticles, from the unit vectors (N, 3, 3) along their links.

    Angles above 0 are on the side of y. Scenes with motors record them; for others barb 1 is on the side of y, or barb
    2 if barb 1 is straight.
    """
    middle = along[:, 1]
    crosses = np.cross(middle[:, None], along[:, [0, 2]])
    angles = frame.cell_data.get("angle_rad")
    if angles is not None:
        found = (np.sin(angles[:, [0, 2], None]) * crosses).sum(axis=1)
    else:
        bent = np.linalg.norm(crosses, axis=-1, keepdims=True) > _STRAIGHT
        found = np.where(bent[:, 0], crosses[:, 0], crosses[:, 1])
    straight = np.linalg.norm(found, axis=1, keepdims=True) <= _STRAIGHT
    return np.where(straight, _least_turned(middle), found)


def _round_normals(frame: Recorded, along: Array, flexible: Flags) -> Array:
    """Return (M, 3) normals of round bars, from unit vectors (M, 3) along them; `flexible` (N,) is of bodies.

    A rigid body has one normal, that of the plane of its first bar and of the first bar at a clear angle to it. A bar
    near this normal has the first bar's direction instead.
    """
    if not len(along):
        return along
    body = frame.body
    first = np.searchsorted(body, np.arange(frame.count))
    crosses = np.cross(along[first[body]], along)
    sines = np.linalg.norm(crosses, axis=1)
    clear = sines > 0.37 * np.maximum.reduceat(sines, first)[body]
    ranks = np.where(clear, np.arange(len(body)), len(body) - 1)
    found = _units(crosses[np.minimum.reduceat(ranks, first)[body]])
    found = np.where((np.abs((found * along).sum(axis=1)) > 0.9)[:, None], along[first[body]], found)
    spans = (np.maximum.reduceat(sines, first) > _STRAIGHT)[body] & ~flexible[body]
    return np.where(spans[:, None], found, _least_turned(along))


def _least_turned(along: Array) -> Array:
    """Return (P, 3) the z axis after the smallest rotation that turns x along unit vectors (P, 3)."""
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    scale = 1 + along[:, :1]
    # Opposite to x, half a turn about z is one of the smallest rotations.
    return np.asarray(z - np.where(scale > 1e-12, along[:, 2:] / np.maximum(scale, 1e-12), 0) * (x + along))


def _units(vectors: Array) -> Array:
    """Return vectors (…, 3) with length 1; zeros stay zeros."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1))


def _axes(along: Array, normal: Array) -> Array:
    """Return (P, 3, 3) right-handed axes in columns, with x along unit vectors and z as near as possible to normals."""
    normal = _units(normal - (normal * along).sum(axis=1, keepdims=True) * along)
    return np.stack([along, np.cross(normal, along), normal], axis=-1)


def _principal(tensor: Array, near: Array) -> tuple[Array, Array]:
    """Return principal moments (N, 3) and axes (N, 3, 3), in columns, of inertia tensors (N, 3, 3).

    The axes are as near as possible to those of `near` (N, 3, 3); of equally near ones, the moments ascend.
    """
    local = np.einsum("nji,njk,nkl->nil", near, tensor, near)
    scale = np.trace(local, axis1=1, axis2=2)[:, None, None]
    _, turns = np.linalg.eigh(local + _TIE * scale * np.diag([0.0, 1.0, 2.0]))
    # Takes back to first order what the tie has turned.
    inside = np.einsum("nji,njk,nkl->nil", turns, local, turns)
    gaps = np.einsum("nii->ni", inside)[:, None] - np.einsum("nii->ni", inside)[:, :, None]
    turns = turns + turns @ np.where(np.abs(gaps) > _EQUAL * scale, inside / np.where(gaps == 0, 1, gaps), 0)
    orders = np.array(list(permutations(range(3))))
    nearness = np.abs(turns)[:, np.arange(3), orders].sum(axis=-1)
    best = np.argmax(nearness > nearness.max(axis=1, keepdims=True) - 1e-6, axis=1)
    turns = np.take_along_axis(turns, orders[best][:, None], axis=2)
    turns *= np.where(np.einsum("nii->ni", turns) < 0, -1.0, 1.0)[:, None]
    turns[:, :, 2] *= np.where(np.linalg.det(turns) < 0, -1.0, 1.0)[:, None]
    moments = np.einsum("nji,njk,nki->ni", turns, local, turns)
    return moments, near @ turns


def _quaternions(axes: Array) -> Array:
    """Return (P, 4) unit quaternions, real part first and not negative, of rotation matrices (P, 3, 3)."""
    if not len(axes):
        return np.zeros((0, 4))
    return np.asarray(Rotation.from_matrix(axes).as_quat(canonical=True, scalar_first=True))
