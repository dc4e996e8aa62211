"""Forces of strings: springs with a dashpot that pull and never push, as `dem.physics.contact.StringLaw` says."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Bodies, Cords
from dem.engine.links.compiler import kernel, part
from dem.engine.links.contact.barrier import Step
from dem.engine.links.contact.pairs import push
from dem.engine.links.shape import Shape


@part
def find_knot(shape: Shape, bodies: Bodies, cords: Cords, k: int) -> None:
    """Write where a string is tied into `knot`; needs `plane` and `axes`."""
    i, kind = cords.owner[k, 0], cords.owner[k, 1]
    row, axes = bodies.plane[i], bodies.axes
    if kind == 1:
        x, y = -row[0] + cords.along[k], -row[1]
    elif kind == 0:
        x, y = row[2] + cords.along[k] * row[10], row[3] + cords.along[k] * row[11]
    else:
        x, y = row[4] + cords.along[k] * row[12], row[5] + cords.along[k] * row[13]
    for d in range(3):
        cords.knot[k, d] = bodies.position[i, d] + axes[i, d, 0] * x + axes[i, d, 1] * y


@kernel
def find_knots(shape: Shape, bodies: Bodies, cords: Cords) -> None:
    """Write where all strings are tied into `knot`; needs smarticles that are posed."""
    for k in range(cords.along.shape[0]):
        find_knot(shape, bodies, cords, k)


@part
def pull(shape: Shape, bodies: Bodies, cords: Cords, hinged: Any, step: Step) -> float:
    """Add the forces of the strings.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles; `load` or `shares` is written.
        cords: the strings; `sums` and `knot` are written.
        hinged: None while welded.
        step: lengths of time around these forces.

    Returns:
        Power of the strings on the links [W].
    """
    power, motion, position = 0.0, bodies.motion, bodies.position
    for k in range(cords.along.shape[0]):
        find_knot(shape, bodies, cords, k)
        i, kind = cords.owner[k, 0], cords.owner[k, 1]
        row = i
        if hinged is not None:
            row = 3 * i + kind
        x, y, z = cords.knot[k, 0], cords.knot[k, 1], cords.knot[k, 2]
        rx, ry, rz = x - position[i, 0], y - position[i, 1], z - position[i, 2]
        vx = motion[row, 0] + motion[row, 4] * rz - motion[row, 5] * ry
        vy = motion[row, 1] + motion[row, 5] * rx - motion[row, 3] * rz
        vz = motion[row, 2] + motion[row, 3] * ry - motion[row, 4] * rx
        ex, ey, ez = cords.anchor[k, 0] - x, cords.anchor[k, 1] - y, cords.anchor[k, 2] - z
        length = math.sqrt(ex * ex + ey * ey + ez * ez)
        ex, ey, ez = ex / length, ey / length, ez / length
        rate = ex * (cords.speed[k] - vx) - ey * vy - ez * vz
        tension, stretch = 0.0, length - cords.law[0]
        if stretch > 0.0:
            tension = max(0.0, cords.law[1] * stretch + cords.law[2] * rate)
        fx, fy, fz = tension * ex, tension * ey, tension * ez
        push(shape, bodies, i, kind, hinged, x, y, z, fx, fy, fz)
        weight = step.past / step.whole
        cords.sums[k, 0] += weight * fx
        cords.sums[k, 1] += weight * fy
        cords.sums[k, 2] += weight * fz
        power += fx * vx + fy * vy + fz * vz
    return power
