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
from dem.engine.links.vectors import Vector, add, dot, moving, put, sub, vector


@part
def moved(bodies: Bodies, marks: Array, centres: Array) -> bool:
    """Return whether an end of a link has moved by more than the link's skin since `marks` were taken.

    Args:
        marks: (N S, 7) starts and ends of all links then, and their skins [m].
        centres: (N, 3) centres of mass then [m]; their mean move does not count.
    """
    mean, segments = (0.0, 0.0, 0.0), bodies.segments
    n, over = bodies.position.shape[0], False
    for i in range(n):
        mean = add(mean, sub(vector(bodies.position[i], 0), vector(centres[i], 0)))
    mean = mean[0] / n, mean[1] / n, mean[2] / n
    for p in range(segments.shape[0]):
        at = sub(vector(segments[p], 0), mean)
        start = _square(sub(at, vector(marks[p], 0)))
        end = _square(sub(add(at, vector(segments[p], 3)), vector(marks[p], 3)))
        over |= max(start, end) > marks[p, 6] * marks[p, 6]
    return over


@inlined
def _square(a: Vector) -> float:
    return a[0] ** 2 + a[1] ** 2 + a[2] ** 2


@part
def mark(shape: Shape, bodies: Bodies, marks: Array, centres: Array, least: float, most: float, time: float) -> None:
    """Write down where all links are, and give each a skin.

    Args:
        marks: (N S, 7) written, see `moved`.
        centres: (N, 3) written.
        least: the thinnest skin [m].
        most: the thickest skin [m].
        time: for which a skin is to be good at the present speed [s].
    """
    segments, each = bodies.segments, shape.kinds.shape[0] * shape.offsets.shape[0]
    n, mean = bodies.position.shape[0], (0.0, 0.0, 0.0)
    for i in range(n):
        mean = add(mean, vector(bodies.velocity[i], 0))
        put(centres[i], 0, vector(bodies.position[i], 0))
    mean = mean[0] / n, mean[1] / n, mean[2] / n
    for p in range(segments.shape[0]):
        start = vector(segments[p], 0)
        put(marks[p], 0, start)
        put(marks[p], 3, add(start, vector(segments[p], 3)))
        i = p // each
        fastest = 0.0
        for end in range(2):
            arm = sub(vector(marks[p], 3 * end), vector(bodies.position[i], 0))
            velocity = moving(sub(vector(bodies.velocity[i], 0), mean), vector(bodies.spin[i], 0), arm)
            fastest = max(fastest, dot(velocity, velocity))
        marks[p, 6] = min(most, least + time * math.sqrt(fastest))
