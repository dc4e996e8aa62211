"""Move rigid bodies that grips hold: with their grip, and without rotation."""

from __future__ import annotations

from typing import Any

from dem.engine.links.arrays import FLOOR, Bodies, Ground
from dem.engine.links.compiler import inlined, part
from dem.engine.links.shapes import Shapes
from dem.engine.links.vectors import add, along, dot, put, put_more, scale, sub, vector


@inlined
def is_held(grips: Any, i: int) -> bool:
    """Return whether a grip holds body `i`; `grips` is None where there are none."""
    if grips is None:
        return False
    return bool(grips.of[i] != 0)


@part
def hold(
    grips: Any, shapes: Shapes, bodies: Bodies, ground: Ground, gravity: float, acting: float, weight: float
) -> float:
    """Give held bodies the velocity of their grip instead of a kick, and return the work of all grips [J].

    Args:
        grips: `force`, `sums` and `pushed` are written; None: nothing is held.
        bodies: `velocity` and `momentum` of held bodies are written.
        acting: time for which the forces in `bodies.load` act [s].
        weight: length of the sub-step over that of a step [1].
    """
    work = 0.0
    if grips is None:
        return work
    grips.force[:] = 0.0
    for i in range(bodies.position.shape[0]):
        if grips.of[i] == 0:
            continue
        k, mass, before = grips.of[i] - 1, shapes.mass[bodies.shape[i]], vector(bodies.velocity[i], 0)
        after = add(vector(grips.speed[k], 0), (0.0, 0.0, grips.rides[0] * ground.speed[FLOOR]))
        pulled = sub(vector(bodies.load[i], 0), (0.0, 0.0, mass * gravity))
        # What the grip adds to the impulses of contacts and weight, along the mean of both velocities.
        impulse = along(scale(mass, sub(after, before)), -acting, pulled)
        turning = along(vector(bodies.momentum[i], 0), acting, vector(bodies.load[i], 3))
        work += 0.5 * (dot(impulse, add(before, after)) - dot(turning, vector(bodies.spin[i], 0)))
        put_more(grips.force[k], 0, scale(-1.0 / acting, impulse))
        put_more(grips.pushed[k], 0, scale(weight, vector(bodies.load[i], 0)))
        put(bodies.velocity[i], 0, after)
        put(bodies.momentum[i], 0, (0.0, 0.0, 0.0))
    for k in range(grips.force.shape[0]):
        for d in range(3):
            grips.sums[k, d] += weight * grips.force[k, d]
    return work


@part
def carry_grips(grips: Any, length: float) -> None:
    """Add the displacements of all grips in a sub-step of a length [s] to `grips.moved`."""
    if grips is not None:
        for k in range(grips.moved.shape[0]):
            for d in range(3):
                grips.moved[k, d] += grips.speed[k, d] * length
