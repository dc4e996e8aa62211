"""Contacts of links with boundaries: floor, plate, round wall with edges, walls of a channel, hooks.

`contacts_of_segment` alone computes the geometry of these contacts. Forces, queries and recorded contacts read the rows
that it writes.

A straight link touches a plane, and the inside of a round wall, with its ends: no other point is nearer. A joint counts
once, as an end of the first of the joined segments. A link touches a round edge with one point. The bars of hooks are
swept segments, so that links touch them as they touch other links. The force along a link that slides off the end of a
bar is left out; it is less than a hundredth of the normal force.
"""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import (
    CHANNEL,
    FLOOR,
    LOWER,
    PLATE,
    SPIN,
    WALL,
    Array,
    Bodies,
    Ground,
    Hooks,
    Kept,
    Law,
    Parts,
    Rims,
    Segments,
)  # fmt: skip
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact import meeting
from dem.engine.links.contact.barrier import Step, resolve, stretch
from dem.engine.links.contact.law import resist, share_of_step
from dem.engine.links.contact.meeting import POINTS, meet
from dem.engine.links.contact.pairs import enter, push, velocity_at
from dem.engine.links.shapes import AT_START, RADIUS
from dem.engine.links.vectors import Vector, add, along, dot, put, scale, sub, vector

# Columns of a row that `contacts_of_segment` writes: slot in the memory of contacts; index of the boundary; overlap
# [m]; fraction of a full contact's springs and dashpots that acts here [1]; energy over kn/2 u² [1]; the point on the
# link's axis [m]; normal, from the boundary [1]; overlap at which axes, or an axis and a surface, would meet [m].
SLOT, PART, DEPTH, SHARE, FACTOR, AXIS, NORMAL, ROOM, COLUMNS = 0, 1, 2, 3, 4, 5, 8, 11, 12
SURFACES = 4  # of an end of a link: floor, wall, a tier's ceiling and edge, plate
COVER = 3
END_SLOTS = 2 * SURFACES

GOLDEN = (math.sqrt(5) - 1) / 2
SAMPLES, TURNS = 8, 32  # places along a link that are tried, and narrowings about the best: to 2e-7 of its length

# Columns and places of `meeting`, which compiled code takes as constants from here.
MET_PLACE, MET_NORMAL, MET_SHARE, MET_DISTANCE = meeting.PLACE, meeting.NORMAL, meeting.SHARE, meeting.DISTANCE


def slots_for(hooks: Hooks | None, rims: Rims | None) -> int:
    """Return the largest number of contacts of a segment with boundaries; `hooks`, `rims`: None if absent."""
    bars = 0 if hooks is None else 2 * hooks.bars.shape[1]
    return END_SLOTS + POINTS * bars + (0 if rims is None else len(rims.radii))


@inlined
def _note(
    rows: Array, count: int, slot: int, part_of: int, depth: float, room: float, point: Vector, normal: Vector
) -> int:
    """Write a full contact into row `count` of `rows`; return the new number of rows.

    A full contact has the value 1 in the columns `SHARE` and `FACTOR`.

    Args:
        rows: (slots, COLUMNS) written; for the columns see `SLOT`.
        count: number of rows so far.
        slot: column of the contact in the memory of contacts, `Kept`.
        part_of: index of the boundary in `Ground.force`.
        depth: overlap [m].
        room: overlap at which the link's axis would reach the surface, or the axis of the bar [m].
        point: the point on the link's axis [m].
        normal: unit vector from the boundary to the link [1].
    """
    row = rows[count]
    row[SLOT], row[PART], row[DEPTH], row[SHARE], row[FACTOR], row[ROOM] = slot, part_of, depth, 1.0, 1.0, room
    put(row, AXIS, point)
    put(row, NORMAL, normal)
    return count + 1


@inlined
def contacts_of_segment(
    segments: Segments, ground: Ground, channel: Any, hooks: Any, rims: Any, p: int, rows: Array, met: Array
) -> int:
    """Find the contacts of a segment with all boundaries.

    Args:
        segments: all segments, with their positions.
        ground: floor and wall, and the heights of all boundaries.
        channel: (1,) half the distance of a channel's walls [m]; None in a container.
        hooks: the hooks; None: no hooks.
        rims: edges of the wall that links can reach; None: no such edges.
        p: number of the segment; contacts at a joint belong to the first of the joined segments.
        rows: (slots, COLUMNS) written, one contact per row; for the columns see `SLOT`.
        met: scratch of `meeting.meet`.

    Returns:
        Number of rows that were written.
    """
    link, shared, count = segments.line[p], segments.shared[p], 0
    radius = link[RADIUS]
    for end in range(2):
        if shared & (AT_START << end):
            continue
        point = vector(link, 0)
        if end == 1:
            point = add(point, vector(link, 3))
        x, y, z = point
        if channel is not None:
            for side in range(2):
                inward = 1.0 if side == 0 else -1.0
                depth = radius - channel[0] - inward * y
                if depth > 0.0:
                    slot = SURFACES * end + side
                    count = _note(rows, count, slot, CHANNEL + side, depth, radius, point, (0.0, inward, 0.0))
        else:
            depth = radius - (z - ground.place[FLOOR])
            if depth > 0.0:
                count = _note(rows, count, SURFACES * end, FLOOR, depth, radius, point, (0.0, 0.0, 1.0))
            depth = radius - (ground.place[PLATE] - z)
            if depth > 0.0:
                count = _note(rows, count, SURFACES * end + COVER, PLATE, depth, radius, point, (0.0, 0.0, -1.0))
            inner = ground.radii[ground.radii.shape[0] - 1] - radius
            if ground.flags[0] != 0 and x * x + y * y > inner * inner:
                count = _contacts_with_wall(radius, ground, SURFACES * end, point, rows, count)
    if hooks is not None:
        count = _contacts_with_hooks(link, ground, hooks, rows, count, met)
    if rims is not None:
        first = END_SLOTS
        if hooks is not None:
            first += 2 * POINTS * hooks.bars.shape[1]
        count = _contacts_with_rims(link, ground, rims, first, rows, count)
    return count


@inlined
def _is_clear(link: Array, ground: Ground, channel: Any, hooks: Any, rims: Any) -> bool:
    """Return whether a segment touches no boundary, in one comparison; False where this is not known."""
    if channel is not None or hooks is not None or rims is not None:
        return False
    x, y, z = vector(link, 0)
    x1, y1, z1 = add((x, y, z), vector(link, 3))
    radius = link[RADIUS]
    inner = ground.radii[ground.radii.shape[0] - 1] - radius
    return bool(
        (radius - (min(z, z1) - ground.place[FLOOR]) <= 0.0)
        & (radius - (ground.place[PLATE] - max(z, z1)) <= 0.0)
        & ((ground.flags[0] == 0) | (max(x * x + y * y, x1 * x1 + y1 * y1) <= inner * inner))
    )


@inlined
def _contacts_with_wall(radius: float, ground: Ground, slot: int, point: Vector, rows: Array, count: int) -> int:
    """Append the contacts of one end of a link with the wall, its edges and its ceilings to `rows`.

    Args:
        radius: radius of the link [m].
        ground: the wall.
        slot: first column of this end in the memory of contacts, `Kept`. Contacts with the wall have the columns
            `slot` + 1 and `slot` + 2.
        point: the end of the link's axis [m].
        rows: (slots, COLUMNS) written; for the columns see `SLOT`.
        count: number of rows before the call.

    Returns:
        Number of rows after the call.
    """
    x, y, z = point
    height, r, tiers = z - ground.place[WALL], math.sqrt(x * x + y * y), ground.radii.shape[0]
    lifted = ground.flags[1] != 0
    if height > ground.top:
        return count
    ex, ey = x / r, y / r
    # The edge that the end may touch: the lower one of a wall that it is under, or the next tier's.
    above, away, edge = 0.0, 0.0, 0
    if lifted and height < ground.bottoms[0]:
        edge, above, away = 1, height - ground.bottoms[0], r - ground.radii[0]
    else:
        tier = 0
        while tier + 1 < tiers and height > ground.bottoms[tier + 1]:
            tier += 1
        gap, sign = ground.radii[tier] - r, -1.0
        if lifted and gap < 0.0:
            gap, sign = -gap, 1.0
        if gap < radius:
            count = _note(rows, count, slot + 1, WALL, radius - gap, radius, point, (sign * ex, sign * ey, 0.0))
        if tier + 1 < tiers and height > ground.bottoms[tier + 1] - radius:
            edge, above, away = 2, height - ground.bottoms[tier + 1], r - ground.radii[tier + 1]
            if away >= 0.0:
                return _note(rows, count, slot + 2, WALL, radius + above, radius, point, (0.0, 0.0, -1.0))
    if edge:
        distance = math.sqrt(away * away + above * above)
        if 0.0 < distance < radius:
            normal = ex * away / distance, ey * away / distance, above / distance
            count = _note(rows, count, slot + edge, WALL, radius - distance, radius, point, normal)
    return count


@inlined
def _contacts_with_rims(link: Array, ground: Ground, rims: Rims, first: int, rows: Array, count: int) -> int:
    """Append the contacts of a link, between its two ends, with the circular edges of the wall to `rows`.

    Args:
        link: (LINE,) segment of the link.
        ground: the wall.
        rims: edges of the wall.
        first: column of the first edge in the memory of contacts, `Kept`.
        rows: (slots, COLUMNS) written; for the columns see `SLOT`.
        count: number of rows before the call.

    Returns:
        Number of rows after the call.
    """
    if ground.flags[0] == 0:
        return count
    z, uz, radius = link[2], link[5], link[RADIUS]
    for rim in range(rims.radii.shape[0]):
        height, round_ = ground.place[WALL] + rims.heights[rim], rims.radii[rim]
        if min(z, z + uz) - radius < height < max(z, z + uz) + radius:
            s = nearest_to_circle(link, round_, height)
            squared = _squared(link, s, round_, height)
            if 0.0 < squared < radius * radius and 1e-6 < s < 1 - 1e-6:
                distance = math.sqrt(squared)
                x, y, z_at = along(vector(link, 0), s, vector(link, 3))
                up, r = z_at - height, math.sqrt(x * x + y * y)
                out, up = (r - round_) / (r * distance), up / distance
                depth, normal = radius - distance, (out * x, out * y, up)
                count = _note(rows, count, first + rim, WALL, depth, radius, (x, y, z_at), normal)
    return count


@inlined
def _contacts_with_hooks(link: Array, ground: Ground, hooks: Hooks, rows: Array, count: int, met: Array) -> int:
    """Append the contacts of a segment with both hooks to `rows`.

    Args:
        link: (LINE,) the segment.
        ground: the heights of the hooks.
        hooks: the hooks.
        rows: (slots, COLUMNS) written; for the columns see `SLOT`.
        count: number of rows before the call.
        met: scratch of `meeting.meet`.

    Returns:
        Number of rows after the call.
    """
    reach = link[RADIUS] + hooks.radius
    for hook in range(2):
        height = ground.place[LOWER + hook]
        if not min(link[2], link[2] + link[5]) - reach < height:
            continue
        if not max(link[2], link[2] + link[5]) + reach > height:
            continue
        for k in range(hooks.counts[hook]):
            bar = hooks.bars[hook, k]
            bar[2] = height
            apart = False
            for d in range(2):
                least = max(min(link[d], link[d] + link[3 + d]), min(bar[d], bar[d] + bar[3 + d]))
                most = min(max(link[d], link[d] + link[3 + d]), max(bar[d], bar[d] + bar[3 + d]))
                apart |= least - most > reach
            if apart or meet(link, bar, 1.0, 0, 0, met) == 0:
                continue
            share = met[0, MET_SHARE]
            for point in range(POINTS):
                row = met[point]
                if row[MET_SHARE] > 0.0:
                    half, slot = 0.5 * row[MET_DISTANCE], END_SLOTS + POINTS * (hook * hooks.bars.shape[1] + k) + point
                    normal = vector(row, MET_NORMAL)
                    place = along(vector(row, MET_PLACE), half, normal)
                    depth = reach - row[MET_DISTANCE]
                    count = _note(rows, count, slot, LOWER + hook, depth, reach, place, normal)
                    # E = kn/2 u0² (2 - share) goes with the first point; where that has no share, all are as deep.
                    written = rows[count - 1]
                    written[SHARE] = row[MET_SHARE]
                    if share > 0.0:
                        written[FACTOR] = 2.0 - share if point == 0 else 0.0
    return count


# Not inlined, for queries, in which speed matters less.
contacts_with_boundaries = part(contacts_of_segment.py_func)  # type: ignore[attr-defined] # Numba's, once compiled


# -- forces ------------------------------------------------------------------------------------------------------


@inlined
def place_and_motion(
    radius: float, parts: Parts, ground: Ground, row: int, contact: Array
) -> tuple[Vector, Vector, float, float]:
    """Return the position of a contact of a segment with a boundary, and the velocities there.

    Args:
        radius: radius of the segment [m].
        row: number of the part with which the segment moves.
        contact: (COLUMNS,) the contact; for the columns see `SLOT`.

    Returns:
        Position [m]; velocity of the part there [m/s]; vertical velocity of the boundary [m/s]; angular velocity of the
        part about the normal [rad/s].
    """
    normal, part_of = vector(contact, NORMAL), int(contact[PART])
    place = sub(vector(contact, AXIS), scale(radius - 0.5 * contact[DEPTH], normal))
    return place, velocity_at(parts, row, place), ground.speed[part_of], dot(vector(parts.motion[row], SPIN), normal)


@part
def push_boundaries(
    law: Law, bodies: Bodies, parts: Parts, segments: Segments, kept: Kept, ground: Ground, channel: Any, hooks: Any,
    rims: Any, ledger: Any, step: Step, rows: Array, met: Array,
) -> float:  # fmt: skip
    """Add the forces of all boundaries on all segments.

    Args:
        law: law of contacts with boundaries.
        bodies: `deepest` is increased where an overlap is larger.
        parts: forces are added to `load`.
        kept: memory of the contacts; updated.
        ground: forces of the bodies on boundaries are added to `force`.
        channel: (1,) half the distance of a channel's walls [m]; None in a container.
        hooks: the hooks; None: no hooks.
        rims: edges of the wall that links can reach; None: no such edges.
        ledger: list of forces and their power, see `pairs.enter`; None: it is not needed.
        step: time since the last forces; its number of sub-steps is increased if needed.
        rows: scratch of `contacts_of_segment`.
        met: scratch of `meeting.meet`.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    lost = 0.0
    for p in range(segments.line.shape[0]):
        if kept.contacts[p] == 0 and _is_clear(segments.line[p], ground, channel, hooks, rims):
            continue
        count = contacts_of_segment(segments, ground, channel, hooks, rims, p, rows, met)
        if count == 0 and kept.contacts[p] == 0:
            continue
        for k in range(count):
            contact = rows[k]
            slot = int(contact[SLOT])
            _rub(law, bodies, parts, segments, p, ground, ledger, step, contact, kept.slip[p, slot])
            kept.used[p, slot] |= 2
        for slot in range(kept.used.shape[1]):
            if kept.used[p, slot] == 1:
                lost += kept.slip[p, slot, 3]
                kept.slip[p, slot] = 0.0
            kept.used[p, slot] >>= 1
        kept.contacts[p] = count
    return lost


@inlined
def _rub(
    law: Law, bodies: Bodies, parts: Parts, segments: Segments, p: int, ground: Ground, ledger: Any, step: Step,
    contact: Array, slip: Array,
) -> None:  # fmt: skip
    """Add the force of a boundary on segment `p` to `parts.load`, and its opposite to `ground.force`.

    Args:
        ledger: list of forces and their power, see `pairs.enter`; None: it is not needed.
        step: time since the last forces; its number of sub-steps is increased if needed.
        contact: (COLUMNS,) the contact, a row of `contacts_of_segment`; for the columns see `SLOT`.
        slip: (4,) stretch [m] and energy [J] of the tangential spring; updated.
    """
    i, row, damping = segments.body[p], segments.part[p], law.damping[bodies.shape[segments.body[p]], 0]
    depth, share, room, normal = contact[DEPTH], contact[SHARE], contact[ROOM], vector(contact, NORMAL)
    place, velocity, speed, turning = place_and_motion(segments.line[p, RADIUS], parts, ground, row, contact)
    relative = velocity[0], velocity[1], velocity[2] - speed
    u, slope, hardening = stretch(depth, room)
    closing = (speed - velocity[2]) * normal[2] - velocity[0] * normal[0] - velocity[1] * normal[1]
    load = law.stiffness * u * slope * share * share_of_step(depth, closing, step.past)
    stored, twist = slip[3], 0.5 * step.past * turning
    force = resist(law, damping, load, share, hardening, normal, relative, twist, step.past, slip)
    resolve(step, depth, room, closing)
    bodies.deepest[i] = max(bodies.deepest[i], depth / room)
    if ledger is not None:
        # The boundary keeps its speed: of the mean of before and after, twice its half.
        power = 0.5 * dot(force, (velocity[0], velocity[1], velocity[2] - 2 * speed))
        enter(ledger, (row, -1), place, force, power, slip[3] - stored)
    force = along(force, load, normal)
    push(parts, row, place, force)
    part_of = int(contact[PART])
    put(ground.force[part_of], 0, sub(vector(ground.force[part_of], 0), force))


# -- a link and a circle -----------------------------------------------------------------------------------------


@part
def _squared(link: Array, s: float, radius: float, height: float) -> float:
    """Return the squared distance [m²] of the point `s`, 0 to 1, of a link from a circle about the z-axis."""
    x, y, z = along(vector(link, 0), s, vector(link, 3))
    out, up = math.sqrt(x * x + y * y) - radius, z - height
    return float(out * out + up * up)


@part
def nearest_to_circle(link: Array, radius: float, height: float) -> float:
    """Return the place on a link's axis, 0 to 1, that is nearest to a horizontal circle about the z-axis.

    Args:
        link: (6,) start of the axis and vector to its end [m].
        radius: radius of the circle [m].
        height: height of the circle [m].
    """
    # A line can come near a circle twice: the best of some points says about which.
    best, least = 0, math.inf
    for k in range(SAMPLES + 1):
        found = _squared(link, k / SAMPLES, radius, height)
        if found < least:
            best, least = k, found
    low, high = max(0.0, (best - 1) / SAMPLES), min(1.0, (best + 1) / SAMPLES)
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_a, at_b = _squared(link, a, radius, height), _squared(link, b, radius, height)
    for _ in range(TURNS):
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - GOLDEN * (high - low)
            at_a = _squared(link, a, radius, height)
        else:
            low, a, at_a = a, b, at_b
            b = low + GOLDEN * (high - low)
            at_b = _squared(link, b, radius, height)
    return 0.5 * (low + high)
