"""What is asked of the contacts at one instant: who touches whom, and what their springs hold."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Array, Bodies, Ground, Indices, Kept, Pairs
from dem.engine.links.compiler import kernel, part
from dem.engine.links.contact.barrier import stretch
from dem.engine.links.contact.boundaries import DEPTH, FACTOR, PART, ROOM, contacts_with_boundaries
from dem.engine.links.contact.meeting import ENERGY, POINTS, meet
from dem.engine.links.shape import Shape

FASTEST, LOWEST, HIGHEST, WIDEST, DEEPEST, BETWEEN, ELASTIC = range(7)  # places in what `glance` finds


@part
def look_at_pairs(
    shape: Shape, bodies: Bodies, pairs: Pairs, stiffness: float, met: Indices, touches: Any, depth: Array, out: Array
) -> tuple[int, float]:
    """Look at all pairs of links that the wide list holds, which must be good for this instant.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles, posed.
        pairs: the list.
        stiffness: kn [N/m].
        met: (P, 2) written: numbers of the smarticles whose links touch, in order.
        touches: (N,) points of contact of each smarticle; added to.
        depth: (N,) deepest contact of each smarticle [m]; brought up to date.
        out: scratch of `meet`.

    Returns:
        Rows of `met` that were written, and the energy of all normal springs [J].
    """
    links, each = shape.kinds.shape[0], shape.kinds.shape[0] * shape.offsets.shape[0]
    diameter, count, energy = 2 * shape.radius, 0, 0.0
    for k in range(pairs.counts[0]):
        p, q = pairs.first[k], pairs.second[k]
        bend_p, bend_q = shape.kinds[p % links] != 1, shape.kinds[q % links] != 1
        if meet(bodies.segments[p], bodies.segments[q], diameter, stiffness, bend_p, bend_q, out) == 0:
            continue
        energy += out[ENERGY, 0]
        i, j, points = p // each, q // each, 0
        for slot in range(POINTS):
            if out[slot, 8] > 0.0 and out[slot, 7] > 0.0:
                points += 1
        if points == 0:
            continue
        met[count, 0], met[count, 1] = i, j
        count += 1
        for body in (i, j):
            touches[body] += points
        overlap = out[ENERGY, 1]
        depth[i], depth[j] = max(depth[i], overlap), max(depth[j], overlap)
    return count, energy


@part
def look_at_boundaries(
    shape: Shape, bodies: Bodies, ground: Ground, channel: Any, hooks: Any, rims: Any, stiffness: float,
    touches: Any, held: Any, depth: Array, out: Array, rows: Array,
) -> float:  # fmt: skip
    """Look at all contacts with boundaries.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles, posed.
        ground: the boundaries.
        channel: (1,) half the distance of the walls of a channel [m]; None for a container.
        hooks: None where there are none.
        rims: None where the wall has none.
        stiffness: kn [N/m].
        touches: (N,) points of contact of each smarticle; added to.
        held: (N, 6) whether each smarticle touches each part; written.
        depth: (N,) deepest contact of each smarticle [m]; brought up to date. At a boundary the same
            share of the room in which axes, or axis and surface, meet.
        out: scratch of `meet`.
        rows: scratch.

    Returns:
        Energy of all normal springs [J].
    """
    segments, each, squares = bodies.segments, shape.kinds.shape[0] * shape.offsets.shape[0], 0.0
    for p in range(segments.shape[0]):
        i = p // each
        for k in range(contacts_with_boundaries(shape, segments, ground, channel, hooks, rims, p, rows, out)):
            contact = rows[k]
            touches[i] += 1
            held[i, int(contact[PART])] = True
            depth[i] = max(depth[i], 2 * shape.radius * contact[DEPTH] / contact[ROOM])
            u, _, _ = stretch(contact[DEPTH], contact[ROOM])
            squares += u * u * contact[FACTOR]
    return 0.5 * stiffness * squares


@kernel
def look_at_all(
    shape: Shape, bodies: Bodies, pairs: Pairs, ground: Ground, channel: Any, hooks: Any, rims: Any, stiffness: float,
    wall_stiffness: float, met: Indices, touches: Any, held: Any, depth: Array, out: Array, rows: Array,
) -> tuple[int, float]:  # fmt: skip
    """Look at all contacts; see `look_at_pairs` and `look_at_boundaries`.

    Returns:
        Rows of `met` that were written, and the energy of all normal springs [J].
    """
    count, energy = look_at_pairs(shape, bodies, pairs, stiffness, met, touches, depth, out)
    energy += look_at_boundaries(
        shape, bodies, ground, channel, hooks, rims, wall_stiffness, touches, held, depth, out, rows
    )
    return count, energy


@kernel
def glance(
    shape: Shape, bodies: Bodies, pairs: Pairs, kept: Kept, ground: Ground, channel: Any, hooks: Any, rims: Any,
    stiffness: float, wall_stiffness: float, velocities: Array, met: Indices, touches: Any, held: Any, depth: Array,
    out: Array, rows: Array, found: Array,
) -> None:  # fmt: skip
    """Find the extremes of all smarticles in one call, which is what a watchdog asks as long as nothing is wrong.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles, posed.
        pairs: as in `look_at_pairs`.
        kept: what contacts with boundaries remember.
        ground: the boundaries.
        channel: as in `look_at_boundaries`.
        hooks: the same.
        rims: the same.
        stiffness: kn between smarticles [N/m].
        wall_stiffness: kn with boundaries [N/m].
        velocities: (N, 3, 3) of the links' centres [m/s].
        met: scratch.
        touches: scratch.
        held: scratch.
        depth: zeros; scratch.
        out: scratch.
        rows: scratch.
        found: (7,) written: largest speed of a link [m/s]; height of the lowest and of the highest end of an axis [m];
            distance of the farthest one from the vertical axis [m]; deepest contact now and between two looks [m];
            energy of all springs of contacts [J]. A speed that is no number makes the first one no number.
    """
    _, energy = look_at_pairs(shape, bodies, pairs, stiffness, met, touches, depth, out)
    energy += look_at_boundaries(
        shape, bodies, ground, channel, hooks, rims, wall_stiffness, touches, held, depth, out, rows
    )
    for k in range(pairs.counts[0]):
        if pairs.used[k]:
            for slot in range(pairs.slip.shape[1]):
                energy += pairs.slip[k, slot, 3]
    for p in range(kept.slip.shape[0]):
        if kept.contacts[p]:
            for slot in range(kept.slip.shape[1]):
                energy += kept.slip[p, slot, 3]
    fastest, total = 0.0, 0.0
    for i in range(velocities.shape[0]):
        for link in range(3):
            x, y, z = velocities[i, link, 0], velocities[i, link, 1], velocities[i, link, 2]
            square = x * x + y * y + z * z
            total += square
            fastest = max(fastest, square)
    lowest, highest, widest = math.inf, -math.inf, 0.0
    segments = bodies.segments
    for p in range(segments.shape[0]):
        for end in range(2):
            x, y = segments[p, 0] + end * segments[p, 3], segments[p, 1] + end * segments[p, 4]
            z = segments[p, 2] + end * segments[p, 5]
            lowest, highest, widest = min(lowest, z), max(highest, z), max(widest, x * x + y * y)
    deepest, between = 0.0, 0.0
    for i in range(depth.shape[0]):
        deepest = max(deepest, depth[i])
        # One that is no number must not be lost in the comparison.
        between = bodies.deepest[i] if not bodies.deepest[i] <= between else between
        total += bodies.deepest[i]
    found[FASTEST] = fastest**0.5 if math.isfinite(total) else math.nan
    found[LOWEST], found[HIGHEST], found[WIDEST] = lowest, highest, widest**0.5
    found[DEEPEST], found[BETWEEN], found[ELASTIC] = deepest, between, energy
