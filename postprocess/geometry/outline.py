"""The region of space that a pile takes up as a body: what a ball that rolls around it cannot reach.

Links are thin and the space between them is most of a pile, so its shape is that of a region and not of the links. Here
it is the closing of the links by a ball: the ball keeps its distance from the links and from the floor, and what none
of its places covers belongs to the pile. A gap that the ball does not fit into is part of the pile, one that it
enters from outside is not; a flat face stays where it is, so a pile that fills a box has the box's volume.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import distance_transform_edt

from dem.errors import InputError
from postprocess.geometry.links import Flags, Floats, UndefinedMeasureError, checked_vertices
from postprocess.geometry.voxel import Region

BALL = 0.25
"""Radius of the ball over w [-].

It must not fit between links that are packed as loosely as poured ones: of straight lines laid at random with the
length per volume of U-shapes at φ = 0.1, 0.158 /mm², none comes within r of a point with probability exp(-0.158 π r²);
with the links' own half thickness r = 3.5 mm, that is 0.2 %. At half of that density it is 5 %."""

FINENESS = 4  #: Voxels to the ball's radius

_MOST_VOXELS = 40_000_000


@dataclass(frozen=True, kw_only=True, eq=False)
class Outlines:
    """The regions of one or more piles on one grid of voxels above the floor."""

    pitch: float  #: Side of a voxel [m]
    origin: Floats  #: (3,) [m], centre of the first voxel, above the floor
    inside: Flags = field(repr=False)  #: (P, x, y, z) bool, which voxels belong to each pile

    def within(self, region: Region) -> Flags:
        """Return which voxels (x, y, z) have their centre in a cylinder whose heights are above the floor."""
        x, y, z = (
            start + self.pitch * np.arange(count)
            for start, count in zip(self.origin, self.inside.shape[1:], strict=True)
        )
        off_axis = np.hypot(x[:, None], y)
        mask: Flags = (off_axis < region.radius)[:, :, None] & ((z > region.bottom) & (z < region.top))
        return mask


def outlines(
    piles: Sequence[ArrayLike],
    *,
    thickness: float,
    ball: float,
    pitch: float | None = None,
    regions: Sequence[Region] = (),
) -> Outlines:
    """Find the regions that piles take up, all on one grid.

    A flat face is found to within half a voxel, a volume therefore to much less.

    Args:
        piles: Vertices of each, heights above the floor.
        thickness: Of the links, taken as round [m].
        ball: Radius of the ball [m]; see `BALL`.
        pitch: Side of a voxel [m]; a fourth of the ball's radius if not given.
        regions: What the grid must hold besides the piles.

    Raises:
        InputError: Bad sizes, or piles that need more voxels than there is memory for.
        UndefinedMeasureError: There is no smarticle.
    """
    checked = [checked_vertices(vertices) for vertices in piles]
    pitch = ball / FINENESS if pitch is None else pitch
    for name, size in (("thickness", thickness), ("ball", ball), ("pitch", pitch)):
        if not (math.isfinite(size) and size > 0):
            raise InputError(f"{name} must be above 0 m: got {size} m")
    if not checked or min(map(len, checked)) == 0:
        raise UndefinedMeasureError("the outline of a pile needs at least 1 smarticle: got 0")
    corners = [corner for vertices in checked for corner in (vertices.min(axis=(0, 1)), vertices.max(axis=(0, 1)))]
    for region in regions:
        for sign, height in ((-1, region.bottom), (1, region.top)):
            corners.append(np.array([sign * region.radius, sign * region.radius, height]))
    # Around the piles there is room for the ball on every side.
    margin = 2 * ball + thickness + 2 * pitch
    first, last = np.min(corners, axis=0) - margin, np.max(corners, axis=0) + margin
    # The floor is a face of voxels.
    first[2] = pitch * (math.floor(min(first[2], -margin) / pitch) + 0.5)
    counts = np.ceil((last - first) / pitch).astype(int) + 1
    if math.prod(counts.tolist()) > _MOST_VOXELS:
        raise InputError(f"a grid of {' x '.join(map(str, counts))} voxels is too large: raise the pitch, {pitch:g} m")
    axes = [start + pitch * np.arange(count) for start, count in zip(first, counts, strict=True)]
    bodies = [_closed(vertices, axes, ball=ball, thickness=thickness) for vertices in checked]
    floor = round((pitch / 2 - first[2]) / pitch)
    origin = first + floor * pitch * np.array([0.0, 0.0, 1.0])
    return Outlines(pitch=pitch, origin=origin, inside=np.stack(bodies)[..., floor:])


def _closed(vertices: Floats, axes: Sequence[Floats], *, ball: float, thickness: float) -> Flags:
    """Find voxels, given by the coordinates of their centres, that no ball covers clear of links and floor."""
    first, pitch = np.array([axis[0] for axis in axes]), float(axes[0][1] - axes[0][0])
    # Where the ball's centre cannot be; the floor holds it off as links do.
    blocked = np.zeros(tuple(map(len, axes)), dtype=bool)
    blocked |= axes[2] < ball
    reach = ball + thickness / 2
    for start, end in zip(vertices[:, :-1].reshape(-1, 3), vertices[:, 1:].reshape(-1, 3), strict=True):
        low = np.floor((np.minimum(start, end) - reach - first) / pitch).astype(int)
        high = np.ceil((np.maximum(start, end) + reach - first) / pitch).astype(int) + 1
        box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        blocked[box] |= _near_link(tuple(axis[part] for axis, part in zip(axes, box, strict=True)), start, end, reach)
    # The nearest free voxel's centre lies beyond where freedom begins: by half a voxel behind a face along the grid, by
    # an eighth or so behind any other one, where many voxels are nearly as near.
    free_at = (distance_transform_edt(blocked) - 0.25) * pitch
    closed: Flags = free_at > ball
    return closed


def _near_link(axes: tuple[Floats, ...], start: Floats, end: Floats, reach: float) -> Flags:
    """Find points of a grid, given by its coordinates, within a distance [m] of a link's centreline."""
    along = end - start
    square = float(along @ along)
    x, y, z = (axis - place for axis, place in zip(axes, start, strict=True))
    dot = (x * along[0])[:, None, None] + (y * along[1])[:, None] + z * along[2]
    share = np.clip(dot / square, 0, 1) if square else np.zeros_like(dot)
    apart = (x**2)[:, None, None] + (y**2)[:, None] + z**2
    # |p - s a|^2, of the foot s of the perpendicular kept on the link.
    near: Flags = apart - 2 * share * dot + share**2 * square < reach**2
    return near
