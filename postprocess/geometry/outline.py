"""Find the region inside the outline of a pile: the morphological closing of its links by a ball.

The ball may be at every position at which it overlaps neither a link nor the floor. All space that no such ball covers
belongs to the pile. A gap narrower than the ball is thus part of the pile; a wider gap that is open to the outside is
not. Flat faces keep their position, so that a pile that fills a box has the volume of the box.
"""

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

The ball must not fit between the links of a poured pile. Random straight lines with 0.158 mm of length per
mm³, as U-shapes have at φ = 0.1, leave room for a ball of radius r = 3.5 mm (half a link's thickness included) at a
random point with the probability exp(-0.158 π r²) = 0.2 %. At half of that density the probability is 5 %."""

FINENESS = 4  #: Number of voxels per radius of the ball

_MOST_VOXELS = 40_000_000


@dataclass(frozen=True, kw_only=True, eq=False)
class Outlines:
    """Regions of P piles on a common grid of voxels above the floor."""

    pitch: float  #: Side of a voxel [m]
    origin: Floats  #: (3,) [m], centre of the first voxel; z from the floor
    inside: Flags = field(repr=False)  #: (P, X, Y, Z) bool, whether a voxel belongs to a pile

    def within(self, region: Region) -> Flags:
        """Return whether each voxel's centre lies in a cylinder with heights above the floor: (X, Y, Z) bool."""
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
    """Find the regions inside the outlines of piles, on a grid that also contains the given regions.

    The position of a flat face is accurate to half a voxel. Each pile is an array of vertices (N, 4, 3) [m] with z
    above the floor. Links are round with the diameter `thickness` [m]. `ball` is the radius of the ball [m], see
    `BALL`. `pitch` is the side of a voxel [m]; a fourth of the ball's radius if not given.
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
    # The ball must be able to pass around the piles on every side.
    margin = 2 * ball + thickness + 2 * pitch
    first, last = np.min(corners, axis=0) - margin, np.max(corners, axis=0) + margin
    # The floor must coincide with faces of voxels.
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
    """Return which voxels belong to the closed pile, (X, Y, Z) bool.

    These are the voxels that the ball cannot cover without overlapping a link or the floor. `ball` is its radius [m],
    `thickness` the diameter of the links [m]. Axes are the coordinates of the voxels' centres along x, y and z [m].
    """
    first, pitch = np.array([axis[0] for axis in axes]), float(axes[0][1] - axes[0][0])
    # Voxels at which the ball's centre cannot be.
    blocked = np.zeros(tuple(map(len, axes)), dtype=bool)
    blocked |= axes[2] < ball
    reach = ball + thickness / 2
    for start, end in zip(vertices[:, :-1].reshape(-1, 3), vertices[:, 1:].reshape(-1, 3), strict=True):
        low = np.floor((np.minimum(start, end) - reach - first) / pitch).astype(int)
        high = np.ceil((np.maximum(start, end) + reach - first) / pitch).astype(int) + 1
        box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        blocked[box] |= _near_link(tuple(axis[part] for axis, part in zip(axes, box, strict=True)), start, end, reach)
    # The centre of the nearest free voxel lies beyond the boundary of the free region: by half a voxel at a face along
    # the grid, by about an eighth at other faces. 0.25 is a mean.
    free_at = (distance_transform_edt(blocked) - 0.25) * pitch
    closed: Flags = free_at > ball
    return closed


def _near_link(axes: tuple[Floats, ...], start: Floats, end: Floats, reach: float) -> Flags:
    """Return which points of the grid on `axes` are nearer than `reach` [m] to the centreline of a link."""
    along = end - start
    square = float(along @ along)
    x, y, z = (axis - place for axis, place in zip(axes, start, strict=True))
    dot = (x * along[0])[:, None, None] + (y * along[1])[:, None] + z * along[2]
    # |p - s a|², where s a is the point of the link that is nearest to p.
    s = np.clip(dot / square, 0, 1) if square else np.zeros_like(dot)
    apart = (x**2)[:, None, None] + (y**2)[:, None] + z**2
    near: Flags = apart - 2 * s * dot + s**2 * square < reach**2
    return near
