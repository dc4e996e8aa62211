"""Compute the points where two segments push each other apart, and the forces there, from one energy.

Two swept segments have their greatest overlap δ0 at their nearest points. They lie along each other over a stretch of
length ℓ. δ1 and δ2 are the overlaps at the two ends of this stretch, between the end of one link and the nearest point
of the other link; they are 0 if these two points do not touch. With the stretched overlap u(δ) of
`dem.engine.links.contact.barrier` the energy is

    E = kn/2 (u0² + g(ℓ) (u1 u2 / u0)²),   g from 0 to 1 as ℓ grows from 0 to a diameter.

Ordinary contacts have u = δ. Links that cross have δ1 δ2 = 0 and one contact. Parallel links have δ0 = δ1 = δ2 and two
contacts, at the ends of the stretch. Tilted links have δ0 = δ1 and two contacts, with δ1 and δ2, so that a bar that
rests on a bar resists tilting. Between these cases the energy is smooth: at no angle does a force jump. The forces are
the derivatives of the energy. Nearest points are extremal and ends are fixed on the links. So forces act along the
normals of the three pairs of points, and, where ℓ changes, along the first link:

    f0 = kn u0 u0' (1 - g x1² x2²),  f1 = kn g u1 u1' x2²,  f2 = kn g u2 u2' x1²,  x = u/u0,
    f_ℓ = kn/2 (u1 u2/u0)² g'.

At a joint two segments of a body have a common end. If both touch another segment, the overlap at the joint would count
twice. It counts in the energy of the earlier segment; from the energy E of the later segment kn/2 u_h² is subtracted,
with u_h from the overlap between the joint and the other segment. If joints of both bodies are near each other, a term
is subtracted for each joint, and the energy between both joints is added. The rest of E goes to zero as the point of
contact moves to the joint, so that a bend is as stiff as a straight bar. Forces from f_ℓ and from joints are bare
forces: they have no friction and no dashpot.
"""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.barrier import stretch
from dem.engine.links.shapes import AT_END, AT_START, RADIUS
from dem.engine.links.vectors import (
    Lines,
    Vector,
    add,
    along,
    between,
    clamp,
    dot,
    lines,
    nearest,
    put,
    scale,
    square,
    sub,
    vector,
)  # fmt: skip

# Rows that `meet` writes: three points of contact, then bare forces: forces without friction and dashpot.
POINTS, BARE = 3, 10
ENERGY = POINTS + BARE  # row whose first number is E
ROWS = ENERGY + 1
# Columns of a point of contact: position [m], normal from the second link to the first [1], load of the normal spring
# [N], the part of the load that friction and dashpot follow [N], fraction of a full contact's springs and dashpots that
# acts here [1] (0: no contact), hardening of the dashpot [1], distance of the axes [m]. Of a bare force: position [m],
# force on the first link [N]. Of the energy: E [J], and the greatest overlap [m].
PLACE, NORMAL, LOAD, CARRIED, SHARE, HARDENING, DISTANCE, COLUMNS = 0, 3, 6, 7, 8, 9, 10, 11
FORCE = 3


@part
def meet(p: Array, q: Array, stiffness: float, shared_p: int, shared_q: int, out: Array) -> int:
    """Find the points of contact of two segments, and the forces there.

    Args:
        p: (LINE,) the first segment.
        q: (LINE,) the second segment.
        stiffness: kn [N/m].
        shared_p: bits `shapes.AT_START` and `shapes.AT_END`. A bit is set if this end of the first segment is a joint
            with an earlier segment of its body.
        shared_q: the same bits for the second segment.
        out: (ROWS, COLUMNS) written; for the columns see `PLACE`.

    Returns:
        0 if the segments do not touch, otherwise 1 + the number of bare forces, which have no friction and no dashpot.
    """
    both, diameter = lines(p, q), p[RADIUS] + q[RADIUS]
    s, t = nearest(both)
    gap = between(both, s, t)
    squared = dot(gap, gap)
    if squared >= diameter * diameter:
        return 0
    return 1 + meet_at(both, s, t, gap, math.sqrt(squared), diameter, stiffness, shared_p, shared_q, out)


@inlined
def meet_at(
    both: Lines, s: float, t: float, gap: Vector, distance: float, diameter: float, stiffness: float,
    shared_p: int, shared_q: int, out: Array,
) -> int:  # fmt: skip
    """Find the points of contact of two segments that touch, and the forces there.

    Returns the number of bare forces, which have no friction and no dashpot.

    Args:
        both: the two segments.
        s: place of the nearest point along the first segment, 0 to 1.
        t: place of the nearest point along the second segment, 0 to 1.
        gap: vector from the nearest point of the second segment to the nearest point of the first [m].
        distance: length of `gap` [m].
        diameter: sum of both radii [m].
        stiffness: kn [N/m].
        shared_p: bits `shapes.AT_START` and `shapes.AT_END`. A bit is set if this end of the first segment is a joint
            with an earlier segment of its body.
        shared_q: the same bits for the second segment.
        out: (ROWS, COLUMNS) written; for the columns see `PLACE`.
    """
    deepest = diameter - distance
    u, slope, hardening = stretch(deepest, diameter)
    _note(out, 0, both, s, t, gap, distance, stiffness * u * slope, 1.0, hardening)
    out[1, SHARE] = out[2, SHARE] = 0.0
    out[ENERGY, 0], out[ENERGY, 1] = 0.5 * stiffness * u * u, deepest
    bare = _lie_along(both, deepest, u, slope, diameter, stiffness, out)
    if shared_p | shared_q:
        for bit in range(2):
            end = float(bit)
            if shared_p & (AT_START << bit):
                at = clamp((both.e + end * both.b) * both.inverse_c)
                bare = _joint(both, diameter, stiffness, end, at, -1.0, bare, out)
                for other in range(2):
                    if shared_q & (AT_START << other):
                        bare = _joint(both, diameter, stiffness, end, float(other), 1.0, bare, out)
            if shared_q & (AT_START << bit):
                at = clamp((end * both.b - both.d) * both.inverse_a)
                bare = _joint(both, diameter, stiffness, at, end, -1.0, bare, out)
    return bare


@inlined
def meets_elsewhere(both: Lines, reach: float, shared_p: int, shared_q: int) -> int:
    """Return 0 if `meet_at` finds forces at the nearest points only, otherwise a positive number.

    Segments with a joint at their end, which are rare, always give a positive number. The points are computed exactly
    as in `_lie_along` and `_joint`, so that rounding does not make the results differ. The code has no branches, since
    a mispredicted branch takes as long as the whole function.

    Args:
        both: the two segments.
        reach: square of the sum of both radii [m²].
        shared_p: bits `shapes.AT_START` and `shapes.AT_END`. A bit is set if this end of the first segment is a joint
            with an earlier segment of its body.
        shared_q: the same bits for the second segment.
    """
    b, d, e = both.b, both.d, both.e
    start, end = -d * both.inverse_a, (b - d) * both.inverse_a
    # Rounding keeps their order: b < 0 where the end is the lower one. Not -0, whose sign would count.
    lower, upper = min(start, end), max(start, end)
    lower_t = 0.5 - math.copysign(0.5, b + 0.0)
    upper_t = 1.0 - lower_t
    of_start, of_end = clamp(e * both.inverse_c), clamp((b + e) * both.inverse_c)
    s1, t1 = 0.0 if lower <= 0.0 else lower, of_start if lower <= 0.0 else lower_t
    s2, t2 = 1.0 if upper >= 1.0 else upper, of_end if upper >= 1.0 else upper_t
    first, second = square(between(both, s1, t1)), square(between(both, s2, t2))
    lie = (upper > 0.0) & (lower < 1.0) & (first < reach) & (second < reach)
    # The start of the first segment at the second one, that of the second at the first one, one start at the other.
    of_p = square(sub(both.w, scale(of_start, both.v)))
    of_q = square(sub(along(both.p, clamp(start), both.u), both.q))
    starts = square(both.w)
    start_p, start_q = (shared_p & AT_START) != 0, (shared_q & AT_START) != 0
    joints = int(start_p & (of_p < reach)) + int(start_q & (of_q < reach)) + int(start_p & start_q & (starts < reach))
    return int(lie) + joints + ((shared_p | shared_q) & AT_END)


@inlined
def _halfway(both: Lines, s: float, t: float) -> Vector:
    """Return the point half way between the point s of the first and the point t of the second axis [m]."""
    return scale(0.5, along(add(along(both.p, s, both.u), both.q), t, both.v))


@inlined
def in_overlap(halfway: Vector, normal: Vector, radii: tuple[float, float]) -> Vector:
    """Return the middle of the overlap of two segments [m], where friction acts.

    Args:
        halfway: point half way between the axes [m], which is the middle of the overlap if the radii are equal.
        normal: unit vector from the second segment to the first [1].
        radii: radii of the first and the second segment [m].
    """
    return along(halfway, 0.5 * (radii[1] - radii[0]), normal)


@inlined
def _note(
    out: Array, k: int, both: Lines, s: float, t: float, gap: Vector, distance: float, load: float, share: float,
    hardening: float,
) -> None:  # fmt: skip
    """Write a point of contact, half way between the two axes, into row `k` of `out`.

    The points at `s` along the first and `t` along the second axis (0 to 1) differ by the vector `gap` of the length
    `distance` [m]. `load` [N], `share` and `hardening` are columns of the row, see `PLACE`.
    """
    row = out[k]
    put(row, PLACE, _halfway(both, s, t))
    put(row, NORMAL, scale(1 / distance, gap))
    row[LOAD] = row[CARRIED] = load
    row[SHARE], row[HARDENING], row[DISTANCE] = share, hardening, distance


@inlined
def _lie_along(
    both: Lines, deepest: float, u: float, slope: float, diameter: float, stiffness: float, out: Array
) -> int:
    """Write the contacts at both ends of the length over which two segments lie along each other.

    For δ0, u0 and u0' see the top of this module. Row 0 of `out` must have the contact at the nearest points, row
    `ENERGY` its energy; both are updated.

    Args:
        both: the two segments.
        deepest: overlap δ0 at the nearest points [m].
        u: u0, the stretched overlap there [m].
        slope: u0', the derivative of u0 by δ0 [1].
        diameter: sum of both radii [m].
        stiffness: kn [N/m].
        out: (ROWS, COLUMNS) written; for the columns see `PLACE`.

    Returns:
        Number of bare forces (without friction and dashpot) that were written.
    """
    b, d, e = both.b, both.d, both.e
    # Where on the first link, in its lengths, are the second one's ends?
    start, end = -d * both.inverse_a, (b - d) * both.inverse_a
    lower, upper, lower_t, upper_t = start, end, 0.0, 1.0
    if b < 0.0:
        lower, upper, lower_t, upper_t = end, start, 1.0, 0.0
    if upper <= 0.0 or lower >= 1.0:
        return 0
    own_lower, own_upper = lower <= 0.0, upper >= 1.0
    s1, s2, t1, t2 = lower, upper, lower_t, upper_t
    if own_lower:
        s1, t1 = 0.0, clamp(e * both.inverse_c)
    if own_upper:
        s2, t2 = 1.0, clamp((b + e) * both.inverse_c)
    gap1, gap2 = between(both, s1, t1), between(both, s2, t2)
    first, second = square(gap1), square(gap2)
    if max(first, second) >= diameter * diameter:
        return 0
    first, second = math.sqrt(first), math.sqrt(second)
    # No deeper than the deepest, whatever the rounding.
    u1, slope1, hardening1 = stretch(min(diameter - first, deepest), diameter)
    u2, slope2, hardening2 = stretch(min(diameter - second, deepest), diameter)
    length = math.sqrt(both.a)
    reach = (s2 - s1) * length / diameter
    grown, growth = 1.0, 0.0
    if reach < 1.0:
        grown, growth = reach * reach * (3 - 2 * reach), 6 * reach * (1 - reach) / diameter
    inverse = 1 / u
    x, y = (u1 * inverse) ** 2, (u2 * inverse) ** 2
    share = 1 - grown * x * y
    out[0, LOAD] = out[0, CARRIED] = stiffness * u * slope * share
    out[ENERGY, 0] *= 2 - share
    out[0, SHARE] = share
    _note(out, 1, both, s1, t1, gap1, first, stiffness * grown * u1 * slope1 * y, grown * y, hardening1)
    _note(out, 2, both, s2, t2, gap2, second, stiffness * grown * u2 * slope2 * x, grown * x, hardening2)
    if growth == 0.0:
        return 0
    bare, push = 0, 0.5 * stiffness * (u1 * u2 / u) ** 2 * growth / length
    for upper_end in range(2):
        own, t, sign = (own_upper, t2, 1.0) if upper_end else (own_lower, t1, -1.0)
        if not own:
            # Only ends of the second link count: an end of the first one moves with the direction that ℓ is along.
            put(out[POINTS + bare], PLACE, along(both.q, t, both.v))
            put(out[POINTS + bare], FORCE, scale(sign * push, both.u))
            bare += 1
    return bare


@inlined
def _joint(
    both: Lines, diameter: float, stiffness: float, s: float, t: float, sign: float, bare: int, out: Array
) -> int:
    """Subtract or add the contact between the joint of one segment and a point of the other segment.

    A joint is a common end of two segments of a body; the top of this module states why its contact is subtracted or
    added. Row `ENERGY` of `out` changes by its energy. Its force is written as a bare force, without friction and
    dashpot.

    Args:
        both: the two segments, at least one of which has a joint.
        diameter: sum of both radii [m].
        stiffness: kn [N/m].
        s: place along the first segment, 0 to 1: 0 or 1 if the joint is that segment's.
        t: place along the second segment, 0 to 1: 0 or 1 if the joint is that segment's.
        sign: -1 to subtract, 1 to add.
        bare: number of bare forces that `out` has before the call.
        out: (ROWS, COLUMNS) updated; for the columns see `PLACE`.

    Returns:
        Number of bare forces after the call.
    """
    gap = sub(sub(along(both.p, s, both.u), both.q), scale(t, both.v))
    squared = dot(gap, gap)
    if squared >= diameter * diameter:
        return bare
    distance = math.sqrt(squared)
    u, slope, _ = stretch(diameter - distance, diameter)
    load = sign * stiffness * u * slope
    out[ENERGY, 0] += 0.5 * sign * stiffness * u * u
    place = _halfway(both, s, t)
    put(out[POINTS + bare], PLACE, place)
    put(out[POINTS + bare], FORCE, scale(load / distance, gap))
    # Friction and dashpots go with what is left: taken from the point that is nearest, and added to it.
    rest = -load
    for _ in range(POINTS):
        best, least = -1, math.inf
        for k in range(POINTS):
            if out[k, SHARE] > 0.0 and out[k, CARRIED] > 0.0:
                away = square(sub(vector(out[k], PLACE), place))
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
