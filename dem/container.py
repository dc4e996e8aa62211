"""The container: an upright cylinder of flat facets, closed at the bottom."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dem.library import Yade

WALL_MATERIAL = "wall"


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """The container as the engine builds it. Lengths in m."""

    radius: float
    height: float
    facets: int

    @property
    def corner_radius(self) -> float:
        """Distance [m] of the wall's edges from the axis: the polygon has the area of the circle."""
        turn = 2 * math.pi / self.facets
        return self.radius * math.sqrt(turn / math.sin(turn))

    @property
    def inner_radius(self) -> float:
        """Distance [m] of the wall's flats from the axis, a little less than the radius."""
        return self.corner_radius * math.cos(math.pi / self.facets)


def add_container(yade: Yade, cylinder: Cylinder) -> list[int]:
    """Add the container, its floor at z = 0.

    Returns:
        Ids of its bodies; the floor is the last.
    """
    # A polygon of the same area as the circle; it starts below the floor so that no gap opens at the edge.
    n = cylinder.facets
    corner = cylinder.corner_radius
    low, high = -0.1 * cylinder.radius, cylinder.height
    angles = 2 * math.pi * np.arange(n + 1) / n
    ring = np.stack([corner * np.cos(angles), corner * np.sin(angles)], axis=1)
    bodies = []
    for (x0, y0), (x1, y1) in pairwise(ring):
        a, b = yade.vector(x0, y0, low), yade.vector(x1, y1, low)
        c, d = yade.vector(x1, y1, high), yade.vector(x0, y0, high)
        bodies += [
            yade.utils.facet([a, b, c], material=WALL_MATERIAL, fixed=True),
            yade.utils.facet([a, c, d], material=WALL_MATERIAL, fixed=True),
        ]
    # sense=1: the floor pushes upwards whatever happens, so nothing that is pressed through comes out below.
    bodies.append(yade.utils.wall(0, axis=2, sense=1, material=WALL_MATERIAL))
    return [yade.omega.bodies.append(body) for body in bodies]
