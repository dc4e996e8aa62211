"""Contacts of links with boundaries: floor, round wall, its edges, the walls of a channel, and hooks.

`contacts_of_link` is the only place that knows their geometry. Forces, queries and recorded contacts read its rows.

A plane, and the inside of a round wall, are met by a straight link with its ends: they tell all. Hinges count once, as
ends of the middle link. A link meets a round edge with one point. The bars of hooks are swept segments, as links are,
and meet them as other links do; the force along a link that slides off the end of a bar is left out, less than a
hundredth of the normal one.
"""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import CHANNEL, FLOOR, LOWER, WALL, Array, Bodies, Ground, Hooks, Kept, Law, Rims
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.barrier import Step, resolve, stretch
from dem.engine.links.contact.law import resist, share_of_step
from dem.engine.links.contact.meeting import POINTS, meet
from dem.engine.links.contact.pairs import push, put_down
from dem.engine.links.shape import Shape

# Columns of a row that `contacts_of_link` writes: place in what contacts remember; the boundary; overlap [m]; share of
# a whole contact [1]; energy over kn/2 u² [1]; the point on the link's axis [m]; normal, from the boundary [1]; overlap
# at which axes meet, or an axis and a surface [m].
SLOT, PART, DEPTH, WEIGHT, FACTOR, AXIS, NORMAL, ROOM, COLUMNS = 0, 1, 2, 3, 4, 5, 8, 11, 12
SURFACES = 3  # of an end of a link
END_SLOTS = 2 * SURFACES

GOLDEN = (math.sqrt(5) - 1) / 2
SAMPLES, TURNS = 8, 32  # places along a link that are tried, and narrowings about the best: to 2e-7 of its length


def slots_for(hooks: Hooks | None, rims: Rims | None) -> int:
    """Return the number of contacts with boundaries that a link can have."""
    bars = 0 if hooks is None else 2 * hooks.bars.shape[1]
    return END_SLOTS + POINTS * bars + (0 if rims is None else len(rims.radii))


@inlined
def _note(
    rows: Array, count: int, slot: int, part_of: int, depth: float, room: float,
    x: float, y: float, z: float, nx: float, ny: float, nz: float,
) -> int:  # fmt: skip
    """Write a whole contact at a point of an axis; the number of rows."""
    row = rows[count]
    row[0], row[1], row[2], row[3], row[4] = slot, part_of, depth, 1.0, 1.0
    row[5], row[6], row[7], row[8], row[9], row[10], row[11] = x, y, z, nx, ny, nz, room
    return count + 1


@inlined
def contacts_of_link(
    shape: Shape, segments: Array, ground: Ground, channel: Any, hooks: Any, rims: Any, p: int, kind: int, rows: Array,
    meeting: Array,
) -> int:  # fmt: skip
    """Find the contacts of a link with all boundaries.

    Args:
        shape: what all smarticles have in common.
        segments: (N S, 6) axes of the links [m].
        ground: the boundaries and where they are.
        channel: (1,) half the distance of the walls that stand in for the container [m]; None for a container.
        hooks: None where there are none.
        rims: None where the wall has no edges that links can reach.
        p: the link.
        kind: 1 for a middle link; the others are barbs, whose starts are ends of the middle link.
        rows: (slots, COLUMNS) written, see `SLOT`.
        meeting: scratch of `meet`.

    Returns:
        Rows that were written.
    """
    radius, count = shape.radius, 0
    for end in range(0 if kind == 1 else 1, 2):
        x, y, z = segments[p, 0], segments[p, 1], segments[p, 2]
        if end == 1:
            x, y, z = x + segments[p, 3], y + segments[p, 4], z + segments[p, 5]
        if channel is not None:
            for side in range(2):
                inward = 1.0 if side == 0 else -1.0
                depth = radius - channel[0] - inward * y
                if depth > 0.0:
                    slot = SURFACES * end + side
                    count = _note(rows, count, slot, CHANNEL + side, depth, radius, x, y, z, 0.0, inward, 0.0)
        else:
            depth = radius - (z - ground.place[FLOOR])
            if depth > 0.0:
                count = _note(rows, count, SURFACES * end, FLOOR, depth, radius, x, y, z, 0.0, 0.0, 1.0)
            inner = ground.radii[ground.radii.shape[0] - 1] - radius
            if ground.flags[0] != 0 and x * x + y * y > inner * inner:
                count = _contacts_with_wall(radius, ground, SURFACES * end, x, y, z, rows, count)
    if hooks is not None:
        count = _contacts_with_hooks(radius, segments, ground, hooks, p, rows, count, meeting)
    if rims is not None:
        first = END_SLOTS
        if hooks is not None:
            first += 2 * POINTS * hooks.bars.shape[1]
        count = _contacts_with_rims(radius, segments, ground, rims, p, first, rows, count)
    return count


@inlined
def _contacts_with_wall(
    radius: float, ground: Ground, slot: int, x: float, y: float, z: float, rows: Array, count: int
) -> int:
    """Find the contacts of an end with wall and ceilings; the number of rows."""
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
            count = _note(rows, count, slot + 1, WALL, radius - gap, radius, x, y, z, sign * ex, sign * ey, 0.0)
        if tier + 1 < tiers and height > ground.bottoms[tier + 1] - radius:
            edge, above, away = 2, height - ground.bottoms[tier + 1], r - ground.radii[tier + 1]
            if away >= 0.0:
                return _note(rows, count, slot + 2, WALL, radius + above, radius, x, y, z, 0.0, 0.0, -1.0)
    if edge:
        distance = math.sqrt(away * away + above * above)
        if 0.0 < distance < radius:
            nx, ny, nz = ex * away / distance, ey * away / distance, above / distance
            count = _note(rows, count, slot + edge, WALL, radius - distance, radius, x, y, z, nx, ny, nz)
    return count


@inlined
def _contacts_with_rims(
    radius: float, segments: Array, ground: Ground, rims: Rims, p: int, first: int, rows: Array, count: int
) -> int:
    """Find the contacts of a link, but for its ends, with round edges of the wall; the number of rows."""
    if ground.flags[0] == 0:
        return count
    z, uz = segments[p, 2], segments[p, 5]
    for rim in range(rims.radii.shape[0]):
        height, round_ = ground.place[WALL] + rims.heights[rim], rims.radii[rim]
        if min(z, z + uz) - radius < height < max(z, z + uz) + radius:
            s = nearest_to_circle(segments[p], round_, height)
            squared = _squared(segments[p], s, round_, height)
            if 0.0 < squared < radius * radius and 1e-6 < s < 1 - 1e-6:
                distance = math.sqrt(squared)
                x, y = segments[p, 0] + s * segments[p, 3], segments[p, 1] + s * segments[p, 4]
                up, r = z + s * uz - height, math.sqrt(x * x + y * y)
                out, up = (r - round_) / (r * distance), up / distance
                depth = radius - distance
                count = _note(rows, count, first + rim, WALL, depth, radius, x, y, z + s * uz, out * x, out * y, up)
    return count


@inlined
def _contacts_with_hooks(
    radius: float, segments: Array, ground: Ground, hooks: Hooks, p: int, rows: Array, count: int, meeting: Array
) -> int:
    """Find the contacts of a link with the bars of both hooks; the number of rows."""
    reach = radius + hooks.radius
    for hook in range(2):
        height = ground.place[LOWER + hook]
        if not min(segments[p, 2], segments[p, 2] + segments[p, 5]) - reach < height:
            continue
        if not max(segments[p, 2], segments[p, 2] + segments[p, 5]) + reach > height:
            continue
        for k in range(hooks.counts[hook]):
            bar = hooks.bars[hook, k]
            bar[2] = height
            apart = False
            for d in range(2):
                least = max(min(segments[p, d], segments[p, d] + segments[p, 3 + d]), min(bar[d], bar[d] + bar[3 + d]))
                most = min(max(segments[p, d], segments[p, d] + segments[p, 3 + d]), max(bar[d], bar[d] + bar[3 + d]))
                apart |= least - most > reach
            if apart or meet(segments[p], bar, reach, 1.0, False, False, meeting) == 0:
                continue
            share = meeting[0, 8]
            for point in range(POINTS):
                row = meeting[point]
                if row[8] > 0.0:
                    half, slot = 0.5 * row[10], END_SLOTS + POINTS * (hook * hooks.bars.shape[1] + k) + point
                    count = _note(
                        rows, count, slot, LOWER + hook, reach - row[10], reach,
                        row[0] + half * row[3], row[1] + half * row[4], row[2] + half * row[5], row[3], row[4], row[5],
                    )  # fmt: skip
                    # E = kn/2 u0² (2 - share) goes with the first point; where that has no weight, all are as deep.
                    written = rows[count - 1]
                    written[3] = row[8]
                    if share > 0.0:
                        written[4] = 2.0 - share if point == 0 else 0.0
    return count


@part
def contacts_with_boundaries(
    shape: Shape, segments: Array, ground: Ground, channel: Any, hooks: Any, rims: Any, p: int, rows: Array,
    meeting: Array,
) -> int:  # fmt: skip
    """Find the contacts of a link where nobody is in a hurry; see `contacts_of_link`."""
    kind = shape.kinds[p % shape.kinds.shape[0]]
    return contacts_of_link(shape, segments, ground, channel, hooks, rims, p, kind, rows, meeting)


# -- forces ------------------------------------------------------------------------------------------------------


@inlined
def place_and_motion(
    shape: Shape, bodies: Bodies, ground: Ground, i: int, row: int, contact: Array
) -> tuple[float, float, float, float, float, float, float, float]:
    """Where a contact is [m], the velocity of the link there [m/s], the boundary's [m/s] and the turn about the normal.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles.
        ground: the boundaries.
        i: the smarticle.
        row: of the link in `Bodies.motion`.
        contact: (COLUMNS,) see `SLOT`.
    """
    motion, position = bodies.motion, bodies.position
    arm = shape.radius - 0.5 * contact[2]
    x, y, z = contact[5] - arm * contact[8], contact[6] - arm * contact[9], contact[7] - arm * contact[10]
    rx, ry, rz = x - position[i, 0], y - position[i, 1], z - position[i, 2]
    ax, ay, az = motion[row, 3], motion[row, 4], motion[row, 5]
    vx = motion[row, 0] + ay * rz - az * ry
    vy = motion[row, 1] + az * rx - ax * rz
    vz = motion[row, 2] + ax * ry - ay * rx
    part_of = int(contact[1])
    speed = ground.speed[part_of] if part_of < CHANNEL else 0.0
    return x, y, z, vx, vy, vz, speed, ax * contact[8] + ay * contact[9] + az * contact[10]


@part
def push_boundaries(
    shape: Shape, law: Law, bodies: Bodies, kept: Kept, ground: Ground, channel: Any, hooks: Any, rims: Any,
    hinged: Any, ledger: Any, step: Step, rows: Array, meeting: Array,
) -> float:  # fmt: skip
    """Add the forces of all boundaries on all links.

    Args:
        shape: what all smarticles have in common.
        law: of contacts with boundaries.
        bodies: the smarticles; `load` or `shares`, and `deepest` are written.
        kept: what contacts remember; brought up to date.
        ground: the boundaries; `force` is written.
        channel: see `contacts_of_link`.
        hooks: see `contacts_of_link`.
        rims: see `contacts_of_link`.
        hinged: None while welded.
        ledger: of forces that dissipate; None where nobody asks.
        step: lengths of time around these forces.
        rows: scratch of `contacts_of_link`.
        meeting: scratch of `meet`.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    segments, links, lost, link = bodies.segments, shape.kinds.shape[0], 0.0, -1
    each = links * shape.offsets.shape[0]
    for p in range(segments.shape[0]):
        link = link + 1 if link + 1 < links else 0
        kind = shape.kinds[link]
        count = contacts_of_link(shape, segments, ground, channel, hooks, rims, p, kind, rows, meeting)
        if count == 0 and kept.contacts[p] == 0:
            continue
        i = p // each
        for k in range(count):
            contact = rows[k]
            _rub(shape, law, bodies, kept, ground, hinged, ledger, step, p, i, kind, contact)
            kept.used[p, int(contact[0])] |= 2
        for slot in range(kept.used.shape[1]):
            if kept.used[p, slot] == 1:
                lost += kept.slip[p, slot, 3]
                for d in range(4):
                    kept.slip[p, slot, d] = 0.0
            kept.used[p, slot] >>= 1
        kept.contacts[p] = count
    return lost


@inlined
def _rub(
    shape: Shape, law: Law, bodies: Bodies, kept: Kept, ground: Ground, hinged: Any, ledger: Any, step: Step,
    p: int, i: int, kind: int, contact: Array,
) -> None:  # fmt: skip
    """Let a boundary push a link at a contact."""
    row = i
    if hinged is not None:
        row = 3 * i + kind
    depth, weight, room, nx, ny, nz = contact[2], contact[3], contact[11], contact[8], contact[9], contact[10]
    part_of, slip = int(contact[1]), kept.slip[p, int(contact[0])]
    x, y, z, vx, vy, vz, speed, turning = place_and_motion(shape, bodies, ground, i, row, contact)
    u, slope, hardening = stretch(depth, room)
    closing = (speed - vz) * nz - vx * nx - vy * ny
    load = law.stiffness * u * slope * weight * share_of_step(depth, closing, step.past)
    stored, twist = slip[3], 0.5 * step.past * turning
    fx, fy, fz = resist(law, load, weight, hardening, nx, ny, nz, vx, vy, vz - speed, twist, step.past, slip)
    resolve(step, depth, room, closing)
    # As a share of the room, which is not that of two links.
    bodies.deepest[i] = max(bodies.deepest[i], 2 * shape.radius * depth / room)
    if ledger is not None:
        # The boundary keeps its speed: of the mean of before and after, twice its half.
        power = 0.5 * (fx * vx + fy * vy + fz * (vz - 2 * speed))
        put_down(ledger, (row, -1), (i, -1), x, y, z, fx, fy, fz, power, slip[3] - stored)
    fx, fy, fz = fx + load * nx, fy + load * ny, fz + load * nz
    push(shape, bodies, i, kind, hinged, x, y, z, fx, fy, fz)
    ground.force[part_of, 0] -= fx
    ground.force[part_of, 1] -= fy
    ground.force[part_of, 2] -= fz


# -- a link and a circle -----------------------------------------------------------------------------------------


@part
def _squared(link: Array, s: float, radius: float, height: float) -> float:
    """Squared distance [m²] of a point of a link's axis from a horizontal circle about the z-axis."""
    x, y, z = link[0] + s * link[3], link[1] + s * link[4], link[2] + s * link[5]
    out, up = math.sqrt(x * x + y * y) - radius, z - height
    return float(out * out + up * up)


@part
def nearest_to_circle(link: Array, radius: float, height: float) -> float:
    """Parameter in [0, 1] of the point of a link's axis that is nearest to a horizontal circle about the z-axis.

    Args:
        link: (6,) start of the axis and vector to its end [m].
        radius: of the circle [m].
        height: of the circle [m].
    """
    # A line can come near a circle twice: the best of some points tells about which.
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
