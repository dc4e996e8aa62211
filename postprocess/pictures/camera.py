"""How a picture looks: its size, its colouring, and a camera that has the whole pile in view."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Self

import numpy as np

from dem.errors import InputError, nearest
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.pictures.colouring import COLOURINGS, Colouring
from postprocess.pictures.surroundings import Surroundings

if TYPE_CHECKING:
    from numpy.typing import NDArray

VIEWS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"front": (-90.0, 14.0), "oblique": (-62.0, 34.0), "top": (-90.0, 90.0)}
)
"""Named views: the camera's azimuth and elevation [degree], seen from the pile."""

MILLIMETRE = 1e3
"""Drawn in mm: VTK's tolerances do not suit scenes of centimetres in m."""

FIELD_OF_VIEW = 22.0
"""Vertical [degree]."""

_LEAST_SIZE, _LARGEST_SIZE = 200, 8000
_FILL = 0.97  # share of the panel that the pile and its container may take
# In units, see `Look.unit`: width of the colour bar with its labels, height of caption and of the scale bar's strip.
_BAR, _CAPTION, _FOOT = 13.0, 11.5, 4.5
_LEAST_UNIT = 4.4  # pixel: smaller text cannot be read


@dataclass(frozen=True, kw_only=True)
class Look:
    """How a picture is to look, checked: `size` in pixel, `azimuth` and `elevation` in degree."""

    colouring: Colouring
    size: tuple[int, int]
    azimuth: float
    elevation: float

    @classmethod
    def checked(cls, *, color_by: str, size: tuple[int, int], view: str) -> Self:
        """A look by names.

        Raises:
            InputError: Unknown colouring or view, or a bad size.
        """
        if color_by not in COLOURINGS:
            msg = f"colour by {color_by!r}: is not known; {nearest(color_by, COLOURINGS)}"
            raise InputError(msg)
        if view not in VIEWS:
            msg = f"view {view!r}: is not known; {nearest(view, VIEWS)}"
            raise InputError(msg)
        if not all(_LEAST_SIZE <= side <= _LARGEST_SIZE for side in size):
            msg = f"size must be {_LEAST_SIZE} to {_LARGEST_SIZE} pixels each way: got {size[0]} x {size[1]}"
            raise InputError(msg)
        azimuth, elevation = VIEWS[view]
        return cls(colouring=COLOURINGS[color_by], size=size, azimuth=azimuth, elevation=elevation)

    @property
    def panel(self) -> tuple[int, int]:
        """Width and height of the three-dimensional part [pixel]: without caption, scale bar and colour bar, if any.

        The width is even, so that films of several runs are as wide as `.mp4` wants them.
        """
        width, height = self.size
        bar = 0.0 if self.colouring.kind == "name" else _BAR
        return 2 * int((width - bar * self.unit) / 2), round(height - _CAPTION * self.unit) - self.foot

    @property
    def foot(self) -> int:
        """Height of the strip below it [pixel]."""
        return round(_FOOT * self.unit)

    @property
    def unit(self) -> float:
        """What text is measured by: a hundredth of the picture's shorter side, or what can just be read [pixel]."""
        return max(min(self.size) / 100, _LEAST_UNIT)

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3), rows: right, up, and forward from the camera into the scene."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
        forward = -np.array(
            [
                math.cos(elevation) * math.cos(azimuth),
                math.cos(elevation) * math.sin(azimuth),
                math.sin(elevation),
            ]
        )
        return np.stack([right, np.cross(right, forward), forward])


def extent(frame: Frame, run: Run, look: Look, surroundings: Surroundings) -> NDArray[np.float64]:
    """Points (n, 3) [mm] above the floor that must be in the picture; the floor is at z = 0."""
    points = (frame.vertices.reshape(-1, 3) - [0.0, 0.0, frame.floor_z]) * MILLIMETRE
    if run.manifest.planar:
        thick = max(run.manifest.thicknesses_in_plane_m) * MILLIMETRE
        if surroundings.strings is not None:
            strings = surroundings.strings.lines(frame).reshape(-1, 3)
            points = np.concatenate([points, (strings - [0.0, 0.0, frame.floor_z]) * MILLIMETRE])
        return np.concatenate([points - thick, points + thick, channel(points, run).reshape(-1, 3)])
    if surroundings.hooks is not None:
        # The upper one may be above the pile.
        upper = circle(surroundings.hooks.length / 2, surroundings.hooks.heights(frame.time)[1])
        points = np.concatenate([points, upper * MILLIMETRE])
    top = _wall_height(float(points[:, 2].max()), run)
    return np.concatenate(
        [points, circle(run.manifest.container_radius_m * MILLIMETRE, 0.0), rims(top, run, look, surroundings)]
    )


def rims(top: float, run: Run, look: Look, surroundings: Surroundings) -> NDArray[np.float64]:
    """Points (n, 3) [mm] of a wall that is drawn up to `top` [mm]; none in a plane."""
    parts = [np.empty((0, 3))]
    for radius, height in [] if run.manifest.planar else wall_corners(top, run, surroundings)[1:]:
        rim = circle(radius, height)
        # The front is cut open.
        parts.append(rim if look.elevation >= 90 else rim[rim @ look.axes[2] > look.axes[2, 2] * height])
    return np.concatenate(parts)


def wall_corners(top: float, run: Run, surroundings: Surroundings) -> list[tuple[float, float]]:
    """Radius and height of the corners of the wall from the floor up [mm]; the highest part ends at `top` [mm].

    The top tier of a mould is high enough to pour through; it is cut as well, but not all of it.
    """
    corners = [(radius * MILLIMETRE, height * MILLIMETRE) for radius, height in surroundings.corners]
    if corners:
        *below, (radius, height) = corners
        least = below[-1][1] + run.manifest.middle_length_m * MILLIMETRE / 4
        return [*below, (radius, min(height, max(top, least)))]
    radius = run.manifest.container_radius_m * MILLIMETRE
    return [(radius, 0.0), (radius, top)]


def channel(points: NDArray[np.float64], run: Run) -> NDArray[np.float64]:
    """(walls, 2, 3) [mm]: the two walls of a plane from above, as long as points (n, 3) [mm] reach; none without."""
    if run.manifest.channel_width_m is None:
        return np.empty((0, 2, 3))
    half, top = run.manifest.channel_width_m * MILLIMETRE / 2, run.manifest.thickness_normal_m * MILLIMETRE
    ends = points[:, 0].min(), points[:, 0].max()
    return np.array([[[x, side * half, top] for x in ends] for side in (-1, 1)])


def _wall_height(top: float, run: Run) -> float:
    """Height up to which the wall is drawn [mm]: above the pile, in whole quarters of w."""
    step = run.manifest.middle_length_m * MILLIMETRE / 4
    return max(4.0, math.ceil(top / step) + 1.0) * step


def circle(radius: float, z: float, points: int = 181) -> NDArray[np.float64]:
    """(points, 3): a level circle about the axis, in the unit of its radius."""
    angle = np.linspace(0, 2 * math.pi, points)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(points, z)], axis=1)


def millimetres_per_pixel(position: NDArray[np.float64], focus: NDArray[np.float64], height: int) -> float:
    """How long a pixel is at the distance of the focal point, in a picture of a height [pixel]."""
    distance = float(np.linalg.norm(np.asarray(position) - np.asarray(focus)))
    return 2 * distance * math.tan(math.radians(FIELD_OF_VIEW / 2)) / height


def fitted_camera(
    points: NDArray[np.float64], axes: NDArray[np.float64], aspect: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position and focal point of the nearest camera that has all points in its picture.

    Args:
        points: (n, 3).
        axes: (3, 3), rows: right, up, forward.
        aspect: Width over height of the picture.

    Returns:
        Position (3,) and focal point (3,).
    """
    tangent = math.tan(math.radians(FIELD_OF_VIEW / 2)) * _FILL
    tangents = np.array([tangent * aspect, tangent])
    x, depth = points @ axes[:2].T, points @ axes[2]
    # |x - c| <= tangent (distance + depth): for each direction two families of straight lines in
    # (c, distance); where their upper envelopes meet lies the centre with the least distance.
    high = (x / tangents - depth[:, None]).max(axis=0)
    low = (-x / tangents - depth[:, None]).max(axis=0)
    distance = float(((high + low) / 2).max())
    # The other direction has room to spare, which goes to both sides alike.
    low, high = x.min(axis=0), x.max(axis=0)
    for _ in range(60):
        centre = (low + high) / 2
        share = (x - centre) / (distance + depth)[:, None]
        right = share.max(axis=0) + share.min(axis=0) > 0
        low, high = np.where(right, centre, low), np.where(right, high, centre)
    middle = (depth.min() + depth.max()) / 2
    focus = centre @ axes[:2] + middle * axes[2]
    return focus - (distance + middle) * axes[2], focus
