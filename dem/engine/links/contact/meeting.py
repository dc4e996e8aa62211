"""How two links push each other apart: where, and with what springs, derived from one energy.

For two swept segments with the greatest overlap δ0, at their nearest points, and overlaps δ1 and δ2 at the two ends of
the stretch over which they lie along each other (at the end of one link and the nearest point of the other; 0 where
these do not touch), of length ℓ, and with u(δ) the stretched overlap of `dem.engine.links.contact.barrier`,

    E = kn/2 (u0² + g(ℓ) (u1 u2 / u0)²),   g from 0 to 1 as ℓ grows from 0 to a diameter.

Ordinary contacts have u = δ. Links that cross have δ1 δ2 = 0 and one contact. Links that lie on each other have
δ0 = δ1 = δ2 and two contacts, at the ends; tilted ones have δ0 = δ1 and again two, of δ1 and δ2, so that a bar rests on
a bar and resists tilting. Between these the energy is smooth: there is no angle at which links change from one to two
contacts, and nothing jumps. The
forces are its derivatives. Nearest points and ends are extremal or fixed, so that forces act along the normals of the
three pairs of points alone, and along the first link where ℓ changes:

    f0 = kn u0 u0' (1 - g x1² x2²),  f1 = kn g u1 u1' x2²,  f2 = kn g u2 u2' x1²,  x = u/u0,
    f_ℓ = kn/2 (u1 u2/u0)² g'.

A barb begins at a hinge, where the middle link ends: what overlaps there would count twice. E of a barb is therefore
less by kn/2 u_h², of the overlap of the hinge itself with the other link, which the middle link's own E has; for two
barbs less by both hinges' and more by that of hinge against hinge. What remains goes to zero as the point of contact
moves to the hinge, and a bend is as stiff as a bar.
"""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.barrier import stretch
from dem.engine.links.contact.nearest import nearest

# Rows of what `meet` writes: three points that can rub, then forces without friction, each with its place.
POINTS, BARE = 3, 6
ENERGY = POINTS + BARE  # row whose first number is E
ROWS = ENERGY + 1
PX, NX, LOAD, CARRIED, WEIGHT, HARDENING, DISTANCE = 0, 3, 6, 7, 8, 9, 10
COLUMNS = 11


@inlined
def _clamp(value: float) -> float:
    return min(1.0, max(0.0, value))


@part
def meet(p: Array, q: Array, diameter: float, stiffness: float, bend_p: bool, bend_q: bool, out: Array) -> int:
    """Points of contact of two links, and the springs there.

    Args:
        p: (6,) start of the first link's axis and vector to its end [m].
        q: (6,) the same of the second one.
        diameter: of both, or the sum of two radii [m].
        stiffness: kn [N/m].
        bend_p: whether the first link is a barb, which starts at a hinge.
        bend_q: the same of the second one.
        out: (ROWS, COLUMNS) written. Rows below POINTS: place [m], normal from the second to the first [1], load of the
            spring [N], the part of it that friction and dashpot go with [N], share of a whole contact [1], hardening of
            the dashpot [1], distance of the axes [m]; weight 0: none. Further rows: place [m], force on the first link
            [N].
            Row ENERGY: E [J], and the greatest overlap [m].

    Returns:
        0 where the links are apart, otherwise 1 + the number of rows with bare forces.
    """
    wx, wy, wz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    ux, uy, uz, vx, vy, vz = p[3], p[4], p[5], q[3], q[4], q[5]
    a, b, c = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    d, e = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    inverse_a, inverse_c = 1 / a, 1 / c
    s, t = nearest(a, b, c, d, e, inverse_a, inverse_c)
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    squared = x * x + y * y + z * z
    if squared >= diameter * diameter:
        return 0
    return 1 + meet_at(
        p, q, diameter, stiffness, bend_p, bend_q, a, b, c, d, e, s, t, inverse_a, inverse_c,
        x, y, z, math.sqrt(squared), out,
    )  # fmt: skip


@inlined
def meet_at(
    p: Array, q: Array, diameter: float, stiffness: float, bend_p: bool, bend_q: bool,
    a: float, b: float, c: float, d: float, e: float, s: float, t: float,
    inverse_a: float, inverse_c: float, x: float, y: float, z: float, distance: float, out: Array,
) -> int:  # fmt: skip
    """The same for links that touch, whose nearest points are known; the number of rows with bare forces.

    Args:
        p: as in `meet`.
        q: as in `meet`.
        diameter: as in `meet`.
        stiffness: as in `meet`.
        bend_p: as in `meet`.
        bend_q: as in `meet`.
        a: u·u, of vectors p + s u and q + t v along the links, see `nearest_on_segments`.
        b: u·v.
        c: v·v.
        d: u·(p - q).
        e: v·(p - q).
        s: of the nearest point of the first link.
        t: of that of the second one.
        inverse_a: 1 / (u·u).
        inverse_c: 1 / (v·v).
        x: from the second nearest point to the first [m].
        y: the same.
        z: the same.
        distance: of the two [m].
        out: as in `meet`.
    """
    deepest = diameter - distance
    u, slope, hardening = stretch(deepest, diameter)
    _note(out, 0, p, q, s, t, x, y, z, distance, stiffness * u * slope, 1.0, hardening)
    out[1, WEIGHT] = out[2, WEIGHT] = 0.0
    out[ENERGY, 0], out[ENERGY, 1] = 0.5 * stiffness * u * u, deepest
    bare = _lie_along(p, q, a, b, d, e, inverse_a, inverse_c, deepest, u, slope, diameter, stiffness, out)
    if bend_p:
        bare = _hinge(p, q, diameter, stiffness, True, _clamp(e * inverse_c), -1.0, bare, out)
        if bend_q:
            bare = _hinge(p, q, diameter, stiffness, True, 0.0, 1.0, bare, out)
    if bend_q:
        bare = _hinge(p, q, diameter, stiffness, False, _clamp(-d * inverse_a), -1.0, bare, out)
    return bare


@inlined
def meets_elsewhere(
    p: Array, q: Array, reach: float, bend_p: bool, bend_q: bool,
    a: float, b: float, c: float, d: float, e: float, inverse_a: float, inverse_c: float,
) -> int:  # fmt: skip
    """Number of places besides the nearest points at which `meet_at` would find forces; 0 for most links that touch.

    Without a branch: what links do at their ends and hinges cannot be predicted, and a branch that is mispredicted
    takes as long as all of this. The numbers are those of `_lie_along` and `_hinge`, bit for bit.

    Args:
        p: as in `meet_at`.
        q: as in `meet_at`.
        reach: square of the diameter [m²].
        bend_p: as in `meet_at`.
        bend_q: as in `meet_at`.
        a: as in `meet_at`.
        b: as in `meet_at`.
        c: as in `meet_at`.
        d: as in `meet_at`.
        e: as in `meet_at`.
        inverse_a: as in `meet_at`.
        inverse_c: as in `meet_at`.
    """
    wx, wy, wz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    start, end = -d * inverse_a, (b - d) * inverse_a
    # Rounding keeps their order: b < 0 where the end is the lower one. Not -0, whose sign would tell.
    lower, upper = min(start, end), max(start, end)
    lower_t = 0.5 - math.copysign(0.5, b + 0.0)
    upper_t = 1.0 - lower_t
    of_start, of_end = _clamp(e * inverse_c), _clamp((b + e) * inverse_c)
    s1, t1 = 0.0 if lower <= 0.0 else lower, of_start if lower <= 0.0 else lower_t
    s2, t2 = 1.0 if upper >= 1.0 else upper, of_end if upper >= 1.0 else upper_t
    first = _squared(wx + s1 * p[3] - t1 * q[3], wy + s1 * p[4] - t1 * q[4], wz + s1 * p[5] - t1 * q[5])
    second = _squared(wx + s2 * p[3] - t2 * q[3], wy + s2 * p[4] - t2 * q[4], wz + s2 * p[5] - t2 * q[5])
    along = (upper > 0.0) & (lower < 1.0) & (first < reach) & (second < reach)
    # The hinge of the first link at the second one, that of the second at the first one, one hinge at the other.
    of_p = _squared(wx - of_start * q[3], wy - of_start * q[4], wz - of_start * q[5])
    s = _clamp(start)
    of_q = _squared(p[0] + s * p[3] - q[0], p[1] + s * p[4] - q[1], p[2] + s * p[5] - q[2])
    both = _squared(wx, wy, wz)
    return (
        int(along) + int(bend_p & (of_p < reach)) + int(bend_q & (of_q < reach)) + int(bend_p & bend_q & (both < reach))
    )


@inlined
def _squared(x: float, y: float, z: float) -> float:
    return x * x + y * y + z * z


@inlined
def _note(
    out: Array, k: int, p: Array, q: Array, s: float, t: float,
    x: float, y: float, z: float, distance: float, load: float, weight: float, hardening: float,
) -> None:  # fmt: skip
    """Write a point: half way between the two axes."""
    row = out[k]
    row[0] = 0.5 * (p[0] + s * p[3] + q[0] + t * q[3])
    row[1] = 0.5 * (p[1] + s * p[4] + q[1] + t * q[4])
    row[2] = 0.5 * (p[2] + s * p[5] + q[2] + t * q[5])
    inverse = 1 / distance
    row[3], row[4], row[5] = x * inverse, y * inverse, z * inverse
    row[6] = row[7] = load
    row[WEIGHT], row[HARDENING], row[DISTANCE] = weight, hardening, distance


@inlined
def _lie_along(
    p: Array, q: Array, a: float, b: float, d: float, e: float, inverse_a: float, inverse_c: float,
    deepest: float, u: float, slope: float, diameter: float, stiffness: float, out: Array,
) -> int:  # fmt: skip
    """Add what the two ends of the stretch carry over which links lie along each other; the number of bare forces."""
    # Where on the first link, in its lengths, are the second one's ends?
    start, end = -d * inverse_a, (b - d) * inverse_a
    lower, upper, lower_t, upper_t = start, end, 0.0, 1.0
    if b < 0.0:
        lower, upper, lower_t, upper_t = end, start, 1.0, 0.0
    if upper <= 0.0 or lower >= 1.0:
        return 0
    own_lower, own_upper = lower <= 0.0, upper >= 1.0
    s1, s2, t1, t2 = lower, upper, lower_t, upper_t
    if own_lower:
        s1, t1 = 0.0, _clamp(e * inverse_c)
    if own_upper:
        s2, t2 = 1.0, _clamp((b + e) * inverse_c)
    wx, wy, wz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    x1, y1, z1 = wx + s1 * p[3] - t1 * q[3], wy + s1 * p[4] - t1 * q[4], wz + s1 * p[5] - t1 * q[5]
    first = x1 * x1 + y1 * y1 + z1 * z1
    x2, y2, z2 = wx + s2 * p[3] - t2 * q[3], wy + s2 * p[4] - t2 * q[4], wz + s2 * p[5] - t2 * q[5]
    second = x2 * x2 + y2 * y2 + z2 * z2
    if max(first, second) >= diameter * diameter:
        return 0
    first, second = math.sqrt(first), math.sqrt(second)
    # No deeper than the deepest, whatever the rounding.
    u1, slope1, hardening1 = stretch(min(diameter - first, deepest), diameter)
    u2, slope2, hardening2 = stretch(min(diameter - second, deepest), diameter)
    length = math.sqrt(a)
    along = (s2 - s1) * length / diameter
    grown, growth = 1.0, 0.0
    if along < 1.0:
        grown, growth = along * along * (3 - 2 * along), 6 * along * (1 - along) / diameter
    inverse = 1 / u
    x, y = (u1 * inverse) ** 2, (u2 * inverse) ** 2
    share = 1 - grown * x * y
    out[0, 6] = out[0, 7] = stiffness * u * slope * share
    out[ENERGY, 0] *= 2 - share
    out[0, 8] = share
    _note(out, 1, p, q, s1, t1, x1, y1, z1, first, stiffness * grown * u1 * slope1 * y, grown * y, hardening1)
    _note(out, 2, p, q, s2, t2, x2, y2, z2, second, stiffness * grown * u2 * slope2 * x, grown * x, hardening2)
    if growth == 0.0:
        return 0
    bare, push = 0, 0.5 * stiffness * (u1 * u2 / u) ** 2 * growth / length
    for upper_end in range(2):
        own, t, sign = (own_upper, t2, 1.0) if upper_end else (own_lower, t1, -1.0)
        if not own:
            # Only ends of the second link count: an end of the first one moves with the direction that ℓ is along.
            row = out[POINTS + bare]
            for k in range(3):
                row[k], row[3 + k] = q[k] + t * q[3 + k], sign * push * p[3 + k]
            bare += 1
    return bare


@inlined
def _hinge(
    p: Array, q: Array, diameter: float, stiffness: float, of_first: bool, other: float, sign: float,
    bare: int, out: Array,
) -> int:  # fmt: skip
    """Take off (sign -1) or add the contact of a hinge with a point of the other link; the number of bare forces."""
    s, t = (0.0, other) if of_first else (other, 0.0)
    x, y, z = p[0] + s * p[3] - q[0] - t * q[3], p[1] + s * p[4] - q[1] - t * q[4], p[2] + s * p[5] - q[2] - t * q[5]
    squared = x * x + y * y + z * z
    if squared >= diameter * diameter:
        return bare
    distance = math.sqrt(squared)
    u, slope, _ = stretch(diameter - distance, diameter)
    load = sign * stiffness * u * slope
    out[ENERGY, 0] += 0.5 * sign * stiffness * u * u
    row = out[POINTS + bare]
    row[0] = 0.5 * (p[0] + s * p[3] + q[0] + t * q[3])
    row[1] = 0.5 * (p[1] + s * p[4] + q[1] + t * q[4])
    row[2] = 0.5 * (p[2] + s * p[5] + q[2] + t * q[5])
    push = load / distance
    row[3], row[4], row[5] = push * x, push * y, push * z
    # Friction and dashpots go with what is left: taken from the point that is nearest, and added to the same.
    rest = -load
    for _ in range(POINTS):
        best, least = -1, math.inf
        for k in range(POINTS):
            if out[k, WEIGHT] > 0.0 and out[k, CARRIED] > 0.0:
                away = (out[k, 0] - row[0]) ** 2 + (out[k, 1] - row[1]) ** 2 + (out[k, 2] - row[2]) ** 2
                if away < least:
                    best, least = k, away
        if best < 0:
            break
        taken = min(rest, out[best, CARRIED])
        out[best, CARRIED] -= taken
        rest -= taken
        if rest <= 0.0:
            break
    return bare + 1
