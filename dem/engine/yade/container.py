"""What holds smarticles in YADE: a container of flat facets on a floor, or the table and walls of motion in a plane."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.engine.yade.library import Yade
from dem.setting.container import Cylinder
from dem.setting.plane import Channel

Array = NDArray[np.float64]

WALL_MATERIAL = "wall"


def add_container(yade: Yade, cylinder: Cylinder) -> list[int]:
    """Add the container, its floor at z = 0.

    Returns:
        Ids of its bodies: the wall from below, and the floor last.
    """
    # A polygon of the same area as the circle; it starts below the floor so that no gap opens at the edge.
    bottoms = [cylinder.bottom, *(bottom for bottom, _ in cylinder.upper), cylinder.height]
    rings = [_ring(cylinder, radius) for radius in (cylinder.radius, *(radius for _, radius in cylinder.upper))]
    bodies = []
    for k, ring in enumerate(rings):
        bodies += list(_band(yade, (ring, bottoms[k]), (ring, bottoms[k + 1])))
        if k + 1 < len(rings):
            # The ceiling of the part of a tier that the next one does not cover.
            bodies += list(_band(yade, (ring, bottoms[k + 1]), (rings[k + 1], bottoms[k + 1])))
    # sense=1: the floor pushes upwards whatever happens, so nothing that is pressed through comes out below.
    bodies.append(yade.utils.wall(0, axis=2, sense=1, material=WALL_MATERIAL))
    return [yade.omega.bodies.append(body) for body in bodies]


def _ring(cylinder: Cylinder, radius: float) -> Array:
    """(n + 1, 2) corners of the wall's polygon [m], the first one again at the end."""
    corner = cylinder.corner_radius_of(radius)
    angles = 2 * math.pi * np.arange(cylinder.facets + 1) / cylinder.facets
    return np.stack([corner * np.cos(angles), corner * np.sin(angles)], axis=1)


def _band(yade: Yade, one: tuple[Array, float], other: tuple[Array, float]) -> Iterator[Any]:
    """Facets between two rings, each with its height [m]."""
    for (start, end), (above_start, above_end) in zip(pairwise(one[0]), pairwise(other[0]), strict=True):
        a, b = yade.vector(*start, one[1]), yade.vector(*end, one[1])
        c, d = yade.vector(*above_end, other[1]), yade.vector(*above_start, other[1])
        yield yade.utils.facet([a, b, c], material=WALL_MATERIAL, fixed=True)
        yield yade.utils.facet([a, c, d], material=WALL_MATERIAL, fixed=True)


def add_channel(yade: Yade, channel: Channel) -> list[int]:
    """Add walls and table, the centrelines' plane at z = 0.

    Only the inertia about z matters there, so that YADE may integrate rotations as those of a sphere.

    Returns:
        Ids of the lower and the upper wall, where there are walls, and of the table last.
    """
    bodies = []
    if channel.width is not None:
        # As the container's floor, each pushes to its own side whatever happens.
        for side in (-1, 1):
            place = side * channel.width / 2
            bodies.append(yade.utils.wall(place, axis=1, sense=-side, material=WALL_MATERIAL))
    bodies.append(yade.utils.wall(channel.table, axis=2, sense=1, material=WALL_MATERIAL))
    return [int(yade.omega.bodies.append(body)) for body in bodies]
