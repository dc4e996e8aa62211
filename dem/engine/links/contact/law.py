"""The contact law: normal spring and dashpot that never pull, tangential spring with Coulomb friction."""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array, Law
from dem.engine.links.compiler import inlined
from dem.engine.links.vectors import Vector, add, along, cross, dot, put, scale, sub, vector


@inlined
def share_of_step(depth: float, closing: float, dt: float) -> float:
    """Return a factor on the normal spring's force [1], below 1 in a contact's first and last step.

    In these two steps bodies touch for only a part of the step. With the factor, the spring does no net work over a
    whole contact, since the leapfrog scheme conserves kn/2 δ_n δ_n+1 with the overlaps δ of successive steps. With a
    factor of 1 in all steps, the spring would lose (ω dt)²/12 of its energy, where ω is the contact's angular
    frequency.

    Args:
        depth: overlap [m].
        closing: rate at which the overlap grows [m/s].
        dt: time step [s].
    """
    way = abs(closing) * dt
    return 1.0 if depth >= way else 0.5 + 0.5 * depth / way


@inlined
def resist(
    law: Law, cn: float, load: float, share: float, hardening: float, normal: Vector, velocity: Vector, twist: float,
    dt: float, slip: Array,
) -> Vector:  # fmt: skip
    """Return the force on the first body at a point of contact [N], without that of the normal spring.

    The tangential spring keeps its direction in the tangent plane and turns with the two bodies about the normal. If
    its force would exceed the friction limit, the force is reduced to the limit and the tangential dashpot does not
    act, as in YADE's `ViscElPhys`.

    Args:
        cn: damping coefficient of the normal dashpot [N s/m].
        load: force of the normal spring at this point, on which friction depends [N], 0 or more.
        share: fraction of a full contact's springs and dashpots that acts at this point [1].
        hardening: factor on the normal dashpot, see `barrier.stretch` [1].
        normal: unit vector from the second body to the first [1].
        velocity: velocity of the first body relative to the second [m/s].
        twist: mean rotation of both bodies about the normal in the step [rad].
        dt: time step [s].
        slip: (4,) stretch of the tangential spring of a full contact [m], and its energy [J]; both are updated.
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
