"""Find the points of a fine grid that lie inside the boxes of the links."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from dem.errors import InputError
from postprocess.geometry.links import (
    Flags,
    Floats,
    UndefinedMeasureError,
    Vertices,
    Whole,
    checked_vertices,
    link_lengths,
    plane_frames,
)

# Point tests per block, which limits memory.
_CHUNK = 1_000_000
# An arbitrary fixed rotation of the grid, so that boxes along x, y or z are not special.
_TURN = Rotation.from_quat([2**0.5 - 1, 3**0.5 - 1, 5**0.5 - 2, 1.0]).as_matrix()


@dataclass(frozen=True, kw_only=True)
class Region:
    """An upright cylinder around x = y = 0."""

    radius: float  #: Radius [m]
    bottom: float  #: Height of the lower end [m]
    top: float  #: Height of the upper end [m]

    @property
    def volume(self) -> float:
        """Volume [m³]."""
        return math.pi * self.radius**2 * (self.top - self.bottom)

    @property
    def inner(self) -> Region:
        """Inner cylinder away from wall, floor and surface: 0.75 of the radius, 20 % to 80 % of the height."""
        height = self.top - self.bottom
        return Region(radius=0.75 * self.radius, bottom=self.bottom + 0.2 * height, top=self.bottom + 0.8 * height)

    def contains(self, points: Floats) -> Flags:
        """Return which points (n, 3) [m] lie inside: (n,) bool."""
        x, y, z = points.T
        inside: Flags = (x**2 + y**2 < self.radius**2) & (z > self.bottom) & (z < self.top)
        return inside


def solid_fraction(
    vertices: Vertices,
    region: Region,
    *,
    thickness_normal: float,
    thickness_in_plane: float,
    pitch: float | None = None,
) -> float:
    """Return the fraction [-] of a region's volume inside the boxes of the links, by a grid of points.

    A point in two boxes counts once. The boxes of a smarticle overlap at its hinges, so the volume of a U is smaller
    than t1 t2 (w + 2l), by about 1 % for usual sizes. UndefinedMeasureError if there is no material in the region.

    Args:
        thickness_normal: t1, along the normal of the smarticle's plane [m].
        thickness_in_plane: t2, in the smarticle's plane [m].
        pitch: Distance of neighbouring points of the grid [m]; half the smaller thickness if not given.
    """
    points, pitch = solid_points(
        vertices, thickness_normal=thickness_normal, thickness_in_plane=thickness_in_plane, pitch=pitch, region=region
    )
    if len(points) == 0:
        msg = "no material in the inner region of the pile: the pile is too low or too thin there"
        raise UndefinedMeasureError(msg)
    return float(len(points) * pitch**3 / region.volume)


def solid_points(
    vertices: Vertices,
    *,
    thickness_normal: float,
    thickness_in_plane: float,
    pitch: float | None = None,
    region: Region | None = None,
) -> tuple[Floats, float]:
    """Find the points of a cubic grid that lie inside the boxes of the links; return also their pitch [m].

    Each of the points (n, 3) [m] is returned once. The cross-section of a straight smarticle may be turned around its
    length by any angle, which its vertices do not determine; an arbitrary angle is used. InputError for bad sizes.

    Args:
        thickness_normal: t1, along the normal of the smarticle's plane [m].
        thickness_in_plane: t2, in the smarticle's plane [m].
        pitch: Distance of neighbouring points [m]; half the smaller thickness if not given.
        region: Region to which points are restricted; None: no restriction.
    """
    vertices = checked_vertices(vertices)
    sizes = (thickness_normal, thickness_in_plane)
    pitch = min(sizes) / 2 if pitch is None else pitch
    if not (min(sizes) > 0 and 0 < pitch <= min(sizes)):
        raise InputError(
            f"thicknesses must be above 0 m and the pitch between 0 m and the smaller one: "
            f"got t1 {sizes[0]} m, t2 {sizes[1]} m, pitch {pitch} m"
        )
    found = [np.empty((0, 3), dtype=np.int64)]
    for indices in _grid_points(vertices, thickness_normal, thickness_in_plane, pitch, region):
        found.append(indices if region is None else indices[region.contains(pitch * indices @ _TURN)])
    return pitch * _distinct(np.concatenate(found)) @ _TURN, pitch


def _grid_points(
    vertices: Floats, normal: float, in_plane: float, pitch: float, region: Region | None
) -> Iterator[Whole]:
    """Yield indices (n, 3) of grid points inside the boxes of the links; an index may be repeated.

    The grid is rotated by `_TURN`. Each box is cut into pieces about as long as thick, so that few grid points must be
    tested for each piece. Thicknesses are t1 along the normal of the smarticle's plane and t2 in it, the pitch is the
    distance of grid points [m]. Points are restricted to the neighbourhood of a region, if given.
    """
    lengths = link_lengths(vertices)
    # A link without length (l = 0) has no direction, and yields no piece.
    along = np.diff(vertices, axis=1) / np.maximum(lengths, 1e-300)[..., None]
    across = np.cross(plane_frames(vertices)[:, None, 2], along)
    across /= np.maximum(np.linalg.norm(across, axis=2), 1e-300)[..., None]
    cuts = np.ceil(lengths / max(normal, in_plane)).astype(int).ravel()
    link = np.repeat(np.arange(len(cuts)), cuts)
    step = np.arange(len(link)) - np.repeat(np.cumsum(cuts) - cuts, cuts)
    start, end = vertices[:, :-1].reshape(-1, 3)[link], vertices[:, 1:].reshape(-1, 3)[link]
    centres = start + ((step + 0.5) / cuts[link])[:, None] * (end - start)
    axes = np.stack([along, across, np.cross(along, across)], axis=-2).reshape(-1, 3, 3)[link]
    section = np.broadcast_to([in_plane / 2, normal / 2], (len(link), 2))
    halves = np.column_stack([lengths.ravel()[link] / cuts[link] / 2, section])
    reach = float(np.linalg.norm(halves, axis=1).max(initial=0.0))
    if region is not None:  # pieces that may overlap the region
        x, y, z = centres.T
        keep = np.hypot(x, y) < region.radius + reach
        keep &= (z > region.bottom - reach) & (z < region.top + reach)
        centres, axes, halves = centres[keep], axes[keep], halves[keep]
    centres, axes = centres @ _TURN.T, axes @ _TURN.T
    first = np.ceil((centres - reach) / pitch).astype(np.int64)
    steps = np.arange(int(np.ceil(2 * reach / pitch)) + 1)
    size = max(1, _CHUNK // len(steps) ** 3)
    for begin in range(0, len(centres), size):
        part = slice(begin, begin + size)
        # (p, 3, n): coordinates of the grid's planes around each piece.
        planes = pitch * (first[part, :, None] + steps) - centres[part, :, None]
        inside = np.ones((len(planes), *[len(steps)] * 3), dtype=bool)
        for axis, half in zip(axes[part].swapaxes(0, 1), halves[part].T, strict=True):
            # The dot product of axis and point is a sum of one term per plane, which needs less memory.
            x, y, z = (axis[:, :, None] * planes).swapaxes(0, 1)
            local = (x[:, :, None] + y[:, None, :])[..., None] + z[:, None, None, :]
            inside &= np.abs(local) <= half[:, None, None, None]
        piece, *offset = np.nonzero(inside)
        yield first[part][piece] + np.stack(offset, axis=1)


def _distinct(indices: Whole) -> Whole:
    """Return indices (n, 3) without repetitions."""
    if len(indices) == 0:
        return indices
    # One number per point sorts much faster than rows of three numbers.
    low = indices.min(axis=0)
    shape = tuple(indices.max(axis=0) - low + 1)
    keys = np.unique(np.ravel_multi_index(tuple((indices - low).T), shape))
    distinct: Whole = np.stack(np.unravel_index(keys, shape), axis=1) + low
    return distinct
