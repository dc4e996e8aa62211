"""Forces of strings by `dem.physics.contact.StringLaw`: springs with a dashpot that never push."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Bodies, Cords, Parts
from dem.engine.links.compiler import kernel, part
from dem.engine.links.contact.barrier import Step
from dem.engine.links.contact.pairs import push, velocity_at
from dem.engine.links.vectors import add, dot, put, put_more, scale, sub, turned, vector


@part
def find_knot(bodies: Bodies, cords: Cords, k: int) -> None:
    """Write the position of a knot into `cords.knot[k]`, from `plane`, `axes` and `position` of `bodies`."""
    i, kind = cords.owner[k, 0], cords.owner[k, 1]
    row = bodies.plane[i]
    if kind == 1:
        x, y = -row[0] + cords.along[k], -row[1]
    elif kind == 0:
        x, y = row[2] + cords.along[k] * row[10], row[3] + cords.along[k] * row[11]
    else:
        x, y = row[4] + cords.along[k] * row[12], row[5] + cords.along[k] * row[13]
    put(cords.knot[k], 0, add(vector(bodies.position[i], 0), turned(bodies, i, x, y, 0.0)))


@kernel
def find_knots(bodies: Bodies, cords: Cords) -> None:
    """Write the positions of all knots into `cords.knot`; `pose` must have been called before."""
    for k in range(cords.along.shape[0]):
        find_knot(bodies, cords, k)


@part
def pull(bodies: Bodies, parts: Parts, cords: Cords, hinged: Any, step: Step) -> float:
    """Add the forces of the strings.

    Args:
        parts: forces are added to `load`.
        cords: the strings. `knot` is written. Forces times the fraction of a time step that has passed since the last
            forces are added to `sums`.
        hinged: the motors; None while smarticles are welded.
        step: time since the last forces, and length of a time step; read only.

    Returns:
        Power of the strings on the links [W].
    """
    power = 0.0
    for k in range(cords.along.shape[0]):
        find_knot(bodies, cords, k)
        i, kind = cords.owner[k, 0], cords.owner[k, 1]
        row = parts.begin[i]
        if hinged is not None:
            row += kind
        knot = vector(cords.knot[k], 0)
        velocity, way = velocity_at(parts, row, knot), sub(vector(cords.anchor[k], 0), knot)
        length = math.sqrt(dot(way, way))
        x, y, z = way[0] / length, way[1] / length, way[2] / length
        rate = x * (cords.speed[k] - velocity[0]) - y * velocity[1] - z * velocity[2]
        tension, stretch = 0.0, length - cords.law[0]
        if stretch > 0.0:
            tension = max(0.0, cords.law[1] * stretch + cords.law[2] * rate)
        force = scale(tension, (x, y, z))
        push(parts, row, knot, force)
        put_more(cords.sums[k], 0, scale(step.past / step.whole, force))
        power += dot(force, velocity)
    return power
