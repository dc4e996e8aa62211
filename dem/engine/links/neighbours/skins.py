"""Skins: distances by which segments may move before a list of near segments is rebuilt.

Every segment has a skin: the distance by which its ends, and so all its points, may move relative to the mean motion of
all bodies. The mean motion does not count, since a shaken pile moves as a whole. Fast segments have thick skins and
slow ones thin skins, so that all skins are used up at about the same time.
"""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Array, Bodies, Segments
from dem.engine.links.compiler import inlined, part
from dem.engine.links.vectors import Vector, add, dot, moving, put, square, sub, vector


@part
def moved(bodies: Bodies, segments: Segments, marks: Array, centres: Array) -> bool:
    """Return whether an end of any segment has moved by more than its skin since `marks` were recorded.

    Args:
        marks: (Q, 7) recorded starts and ends of all segments, and their skins [m].
        centres: (N, 3) recorded centres of mass [m], from which the mean motion follows.
    """
    mean, line = (0.0, 0.0, 0.0), segments.line
    n = bodies.position.shape[0]
    for i in range(n):
        mean = add(mean, sub(vector(bodies.position[i], 0), vector(centres[i], 0)))
    mean = mean[0] / n, mean[1] / n, mean[2] / n
    for p in range(line.shape[0]):
        at = sub(vector(line[p], 0), mean)
        start = square(sub(at, vector(marks[p], 0)))
        end = square(sub(add(at, vector(line[p], 3)), vector(marks[p], 3)))
        if max(start, end) > marks[p, 6] * marks[p, 6]:
            return True
    return False


@inlined
def _at_end(bends: Any, p: int, end: int, mean: Vector, rigid: Vector) -> Vector:
    """Return the velocity of an end of segment `p` less the mean velocity of all bodies [m/s].

    Args:
        bends: data of flexible bodies; None where no body is flexible.
        end: 0 for the start, 1 for the end.
        mean: mean velocity of all bodies [m/s].
        rigid: the result if the body is rigid [m/s].
    """
    if bends is None or bends.apart[p] == 0:
        return rigid
    return sub(vector(bends.ends[p], 3 * end), mean)


@part
def mark(
    bodies: Bodies, segments: Segments, marks: Array, centres: Array, least: float, most: float, time: float
) -> None:
    """Record the positions of all segments and bodies, and give each segment a skin.

    Args:
        marks: (Q, 7) written, see `moved`.
        centres: (N, 3) written: centres of mass [m].
        least: the thinnest skin [m].
        most: the thickest skin [m].
        time: time that a skin should last at the present speed [s].
    """
    line = segments.line
    n, mean = bodies.position.shape[0], (0.0, 0.0, 0.0)
    for i in range(n):
        mean = add(mean, vector(bodies.velocity[i], 0))
        put(centres[i], 0, vector(bodies.position[i], 0))
    mean = mean[0] / n, mean[1] / n, mean[2] / n
    for p in range(line.shape[0]):
        start = vector(line[p], 0)
        put(marks[p], 0, start)
        put(marks[p], 3, add(start, vector(line[p], 3)))
        i = segments.body[p]
        fastest = 0.0
        for end in range(2):
            arm = sub(vector(marks[p], 3 * end), vector(bodies.position[i], 0))
            velocity = moving(sub(vector(bodies.velocity[i], 0), mean), vector(bodies.spin[i], 0), arm)
            velocity = _at_end(segments.bends, p, end, mean, velocity)
            fastest = max(fastest, dot(velocity, velocity))
        marks[p, 6] = min(most, least + time * math.sqrt(fastest))
