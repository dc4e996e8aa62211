"""The contact law: a linear spring and a dashpot that never pull, and a tangential spring with Coulomb friction."""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array, Law
from dem.engine.links.compiler import inlined
from dem.engine.links.vectors import Vector, add, along, cross, dot, put, scale, sub, vector


@inlined
def share_of_step(depth: float, closing: float, dt: float) -> float:
    """Return the share of the spring's force that acts where a contact begins or ends within a step [1].

    The leapfrog scheme keeps kn/2 δ_n δ_n+1 of consecutive overlaps. With this share, 1 inside of a contact, the sum of
    a contact's work is zero however its first and last overlap lie between 0 and a step's way; with the whole force a
    contact takes (ω dt)²/12 of its energy away, ω its frequency.

    Args:
        depth: overlap [m].
        closing: rate at which it grows [m/s].
        dt: time step [s].
    """
    way = abs(closing) * dt
    return 1.0 if depth >= way else 0.5 + 0.5 * depth / way


@inlined
def resist(
    law: Law, cn: float, load: float, share: float, hardening: float, normal: Vector, velocity: Vector, twist: float,
    dt: float, slip: Array,
) -> Vector:  # fmt: skip
    """Return the force on the first body at a point beyond the spring's [N].

    The tangential spring keeps its direction in the tangent plane and turns with the two bodies about the normal. Where
    it would exceed friction it is cut to it, and the tangential dashpot is silent: as YADE's `ViscElPhys` does.

    Args:
        cn: of the normal dashpot [N s/m].
        load: of the normal spring here [N], not negative.
        share: of a whole contact's springs and dashpots that acts here [1].
        hardening: of the normal dashpot, see `barrier.stretch` [1].
        normal: from the second body to the first [1].
        velocity: of the first body against the second [m/s].
        twist: mean turn of both bodies about the normal in a step [rad].
        dt: time step [s].
        slip: (4,) stretch of the tangential spring [m], of a whole contact, and its energy [J]; brought up to date.
    """
    approach = dot(velocity, normal)
    pressed = load - cn * share * hardening * approach
    pressed = max(pressed, 0.0)
    sliding = sub(velocity, scale(approach, normal))
    stretch = vector(slip, 0)
    stretch = along(stretch, twist, cross(normal, stretch))
    stretch = add(sub(stretch, scale(dot(stretch, normal), normal)), scale(dt, sliding))
    stiffness, limit = law.shear * share, law.friction * pressed
    length = dot(stretch, stretch)
    squared = stiffness * stiffness * length
    damping = cn * law.shear_damping * share
    # Selections rather than a branch, which nothing can predict. The root of a square is exact: below the limit the
    # ratio is 1 at least.
    ratio = limit / math.sqrt(squared)
    cut = ratio if ratio < 1.0 else 1.0
    damping = 0.0 if squared > limit * limit else damping
    stretch = scale(cut, stretch)
    put(slip, 0, stretch)
    slip[3] = 0.5 * stiffness * length * (cut * cut)
    return sub(sub(scale(pressed - load, normal), scale(stiffness, stretch)), scale(damping, sliding))
