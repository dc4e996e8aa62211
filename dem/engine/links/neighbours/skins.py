"""How far links may move until a list of pairs is made anew.

Every link has a skin of its own: how far its ends, and so all of it, may move until the list is made anew, apart from
what all have moved on average, since a shaken pile moves as a whole. Links that are fast have thick skins and those
that lie still thin ones, so that all are used up at about the same time.
"""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array, Bodies
from dem.engine.links.compiler import inlined, part
from dem.engine.links.shape import Shape


@part
def moved(bodies: Bodies, marks: Array, centres: Array) -> bool:
    """Whether an end of a link has moved by more than the link's skin since `marks` were taken, apart from the mean.

    Args:
        bodies: the smarticles.
        marks: (N S, 7) starts and ends of all links then, and their skins [m].
        centres: (N, 3) centres of mass then [m].
    """
    n = bodies.position.shape[0]
    x, y, z = moves(bodies, centres, 0, n)
    return moved_beyond(bodies, marks, x / n, y / n, z / n, 0, bodies.segments.shape[0])


@inlined
def moves(bodies: Bodies, centres: Array, begin: int, stop: int) -> tuple[float, float, float]:
    """Sum of the moves of smarticles from `begin` up to `stop` away from `centres` (N, 3) [m]."""
    position = bodies.position
    x, y, z = 0.0, 0.0, 0.0
    for i in range(begin, stop):
        x += position[i, 0] - centres[i, 0]
        y += position[i, 1] - centres[i, 1]
        z += position[i, 2] - centres[i, 2]
    return x, y, z


@inlined
def moved_beyond(bodies: Bodies, marks: Array, x: float, y: float, z: float, begin: int, stop: int) -> bool:
    """Whether one of the links from `begin` up to `stop` has moved beyond its skin, apart from the mean (x, y, z)."""
    segments = bodies.segments
    over = False
    for p in range(begin, stop):
        ax, ay, az = segments[p, 0] - x, segments[p, 1] - y, segments[p, 2] - z
        start = (ax - marks[p, 0]) ** 2 + (ay - marks[p, 1]) ** 2 + (az - marks[p, 2]) ** 2
        ax, ay, az = ax + segments[p, 3], ay + segments[p, 4], az + segments[p, 5]
        end = (ax - marks[p, 3]) ** 2 + (ay - marks[p, 4]) ** 2 + (az - marks[p, 5]) ** 2
        over |= max(start, end) > marks[p, 6] * marks[p, 6]
    return over


@part
def mark(shape: Shape, bodies: Bodies, marks: Array, centres: Array, least: float, most: float, time: float) -> None:
    """Take note of where all links are, and give each a skin, see `moved`; both arrays are written.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles.
        marks: (N S, 7).
        centres: (N, 3).
        least: the thinnest skin [m].
        most: the thickest skin [m].
        time: for which a skin is to be good at the present speed [s].
    """
    n = bodies.position.shape[0]
    x, y, z = mark_centres(bodies, centres, 0, n)
    mark_links(shape, bodies, marks, least, most, time, x / n, y / n, z / n, 0, n)


@inlined
def mark_centres(bodies: Bodies, centres: Array, begin: int, stop: int) -> tuple[float, float, float]:
    """Take note of where smarticles from `begin` up to `stop` are; the sum of their velocities [m/s]."""
    position, velocity = bodies.position, bodies.velocity
    x, y, z = 0.0, 0.0, 0.0
    for i in range(begin, stop):
        x, y, z = x + velocity[i, 0], y + velocity[i, 1], z + velocity[i, 2]
        for d in range(3):
            centres[i, d] = position[i, d]
    return x, y, z


@part
def mark_links(
    shape: Shape, bodies: Bodies, marks: Array, least: float, most: float, time: float,
    x: float, y: float, z: float, begin: int, stop: int,
) -> None:  # fmt: skip
    """Take note of where the links of some smarticles are and give each a skin, see `mark`; (x, y, z) is the mean."""
    segments, position, velocity, spin = bodies.segments, bodies.position, bodies.velocity, bodies.spin
    each = shape.kinds.shape[0] * shape.offsets.shape[0]
    for p in range(each * begin, each * stop):
        for d in range(3):
            marks[p, d] = segments[p, d]
            marks[p, 3 + d] = segments[p, d] + segments[p, 3 + d]
        i = p // each
        wx, wy, wz = spin[i, 0], spin[i, 1], spin[i, 2]
        fastest = 0.0
        for end in range(2):
            rx = marks[p, 3 * end] - position[i, 0]
            ry = marks[p, 3 * end + 1] - position[i, 1]
            rz = marks[p, 3 * end + 2] - position[i, 2]
            vx = velocity[i, 0] - x + wy * rz - wz * ry
            vy = velocity[i, 1] - y + wz * rx - wx * rz
            vz = velocity[i, 2] - z + wx * ry - wy * rx
            fastest = max(fastest, vx * vx + vy * vy + vz * vz)
        marks[p, 6] = min(most, least + time * math.sqrt(fastest))
