"""The inner part of a pile, away from wall, floor and free surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dem.errors import InputError
from postprocess.geometry.links import Flags, Floats, UndefinedMeasureError


@dataclass(frozen=True, kw_only=True)
class Region:
    """An upright cylinder.

    Attributes:
        radius: [m].
        bottom: Height of its lower end [m].
        top: Height of its upper end [m].
        axis: x and y of its axis [m].
    """

    radius: float
    bottom: float
    top: float
    axis: tuple[float, float] = (0.0, 0.0)

    @property
    def volume(self) -> float:
        """[m³]."""
        return math.pi * self.radius**2 * (self.top - self.bottom)

    def contains(self, points: Floats) -> Flags:
        """(n,) bool, which of (n, 3) points [m] lie inside."""
        x, y, z = points[:, 0] - self.axis[0], points[:, 1] - self.axis[1], points[:, 2]
        inside: Flags = (x**2 + y**2 < self.radius**2) & (z > self.bottom) & (z < self.top)
        return inside


def inner_region(pile: Region, *, inner: float = 0.75, low: float = 0.2, high: float = 0.8) -> Region:
    """The part of a pile that stays clear of wall, floor and free surface.

    Args:
        pile: The cylinder from the floor to the pile's height.
        inner: Radius of the part, as a share of the pile's [-].
        low: Lower cut, as a share of the pile's height [-].
        high: Upper cut, as a share of the pile's height [-].

    Raises:
        InputError: The shares are not in order between 0 and 1.
        UndefinedMeasureError: The pile has no height.
    """
    if not 0 < inner <= 1:
        msg = f"inner must be above 0 and up to 1 of the container's radius: got {inner}"
        raise InputError(msg)
    if not 0 <= low < high <= 1:
        msg = f"low and high must be in order between 0 and 1 of the height: got {low}, {high}"
        raise InputError(msg)
    height = pile.top - pile.bottom
    if not height > 0:
        msg = f"the pile has no height above its floor: {height:g} m; check floor_z"
        raise UndefinedMeasureError(msg)
    return Region(
        radius=inner * pile.radius,
        bottom=pile.bottom + low * height,
        top=pile.bottom + high * height,
        axis=pile.axis,
    )
