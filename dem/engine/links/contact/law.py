"""The contact law: a linear spring and a dashpot that never pull, and a tangential spring with Coulomb friction."""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array, Law
from dem.engine.links.compiler import inlined


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
    law: Law,
    load: float,
    weight: float,
    hardening: float,
    nx: float,
    ny: float,
    nz: float,
    vx: float,
    vy: float,
    vz: float,
    twist: float,
    dt: float,
    slip: Array,
) -> tuple[float, float, float]:
    """Force on the first body at a point, beyond the spring's.

    The tangential spring keeps its direction in the tangent plane and turns with the two bodies about the normal. Where
    it would exceed friction it is cut to it, and the tangential dashpot is silent: as YADE's `ViscElPhys` does.

    Args:
        law: of the contact.
        load: of the normal spring here [N], not negative.
        weight: share of a whole contact's springs and dashpots that act here [1].
        hardening: of the normal dashpot, see `barrier.stretch` [1].
        nx: normal, from the second body to the first [1].
        ny: the same.
        nz: the same.
        vx: velocity of the first body against the second [m/s].
        vy: the same.
        vz: the same.
        twist: mean turn of both bodies about the normal in a step [rad].
        dt: time step [s].
        slip: (4,) stretch of the tangential spring [m], of a whole contact, and its energy [J]; brought up to date.
    """
    approach = vx * nx + vy * ny + vz * nz
    normal = load - law.damping * weight * hardening * approach
    normal = max(normal, 0.0)
    tx, ty, tz = vx - approach * nx, vy - approach * ny, vz - approach * nz
    sx, sy, sz = slip[0], slip[1], slip[2]
    sx, sy, sz = (
        sx + twist * (ny * sz - nz * sy),
        sy + twist * (nz * sx - nx * sz),
        sz + twist * (nx * sy - ny * sx),
    )
    off = sx * nx + sy * ny + sz * nz
    sx, sy, sz = sx - off * nx + tx * dt, sy - off * ny + ty * dt, sz - off * nz + tz * dt
    stiffness, limit = law.shear * weight, law.friction * normal
    length = sx * sx + sy * sy + sz * sz
    squared = stiffness * stiffness * length
    damping = law.shear_damping * weight
    slip[3] = 0.5 * stiffness * length
    # Selections rather than a branch, which nobody could predict. The root of a square is exact: below the limit the
    # ratio is 1 at least.
    ratio = limit / math.sqrt(squared)
    cut = ratio if ratio < 1.0 else 1.0
    damping = 0.0 if squared > limit * limit else damping
    sx, sy, sz = sx * cut, sy * cut, sz * cut
    slip[3] *= cut * cut
    slip[0], slip[1], slip[2] = sx, sy, sz
    viscous = normal - load
    return (
        viscous * nx - stiffness * sx - damping * tx,
        viscous * ny - stiffness * sy - damping * ty,
        viscous * nz - stiffness * sz - damping * tz,
    )
