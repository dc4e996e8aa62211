"""What is asked of the contacts at one instant: who touches whom, and what their springs hold."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import LOWER, WALL, Array, Bodies, Ends, Ground, Indices, Pairs
from dem.engine.links.compiler import kernel, part
from dem.engine.links.contact.bars import meet_bar
from dem.engine.links.contact.meeting import ENERGY, POINTS, meet
from dem.engine.links.contact.rims import nearest_to_circle
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
        overlap = _overlap(bodies.segments[p], bodies.segments[q], diameter, stiffness, out)
        depth[i], depth[j] = max(depth[i], overlap), max(depth[j], overlap)
    return count, energy


@part
def _overlap(p: Array, q: Array, diameter: float, stiffness: float, out: Array) -> float:
    """Overlap of two links that touch [m], from the energy of the contact at their nearest points."""
    meet(p, q, diameter, stiffness, False, False, out)
    share = out[0, 8]
    return float((2 * out[ENERGY, 0] / (stiffness * (2 - share))) ** 0.5)


@part
def look_at_fixtures(
    shape: Shape, bodies: Bodies, ground: Ground, channel: Any, hooks: Any, rims: Any, stiffness: float,
    touches: Any, held: Any, depth: Array, out: Array,
) -> float:  # fmt: skip
    """Look at all contacts with fixtures.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles, posed.
        ground: the fixtures.
        channel: (1,) half the distance of the walls of a channel [m]; None for a container.
        hooks: None where there are none.
        rims: None where the wall has none.
        stiffness: kn [N/m].
        touches: (N,) points of contact of each smarticle; added to.
        held: (N, 6) whether each smarticle touches each part; written.
        depth: (N,) deepest contact of each smarticle [m]; brought up to date.
        out: scratch.

    Returns:
        Energy of all normal springs [J].
    """
    segments, radius = bodies.segments, shape.radius
    links, each = shape.kinds.shape[0], shape.kinds.shape[0] * shape.offsets.shape[0]
    squares = 0.0
    for p in range(segments.shape[0]):
        i = p // each
        for end in range(0 if shape.kinds[p % links] == 1 else 1, 2):
            x, y, z = segments[p, 0], segments[p, 1], segments[p, 2]
            if end == 1:
                x, y, z = x + segments[p, 3], y + segments[p, 4], z + segments[p, 5]
            for surface in range(3):
                part_of, found = depth_at(ground, channel, radius, surface, x, y, z)
                if found > 0.0:
                    touches[i] += 1
                    held[i, part_of] = True
                    depth[i] = max(depth[i], found)
                    squares += found * found
        if rims is not None and ground.flags[0] != 0:
            for rim in range(rims.radii.shape[0]):
                height = ground.place[WALL] + rims.heights[rim]
                s = nearest_to_circle(segments[p], rims.radii[rim], height)
                x, y = segments[p, 0] + s * segments[p, 3], segments[p, 1] + s * segments[p, 4]
                up, away = segments[p, 2] + s * segments[p, 5] - height, (x * x + y * y) ** 0.5 - rims.radii[rim]
                found = radius - (up * up + away * away) ** 0.5
                if found > 0.0 and 1e-6 < s < 1 - 1e-6:
                    touches[i] += 1
                    held[i, WALL] = True
                    depth[i] = max(depth[i], found)
                    squares += found * found
        if hooks is not None:
            for hook in range(2):
                for bar in range(hooks.counts[hook]):
                    x, y = segments[p, 0] - hooks.middles[hook, bar, 0], segments[p, 1] - hooks.middles[hook, bar, 1]
                    z = segments[p, 2] - ground.place[LOWER + hook]
                    points = meet_bar(x, y, z, segments[p], hooks.halves[hook, bar], radius, stiffness, out)
                    if points:
                        touches[i] += points
                        held[i, LOWER + hook] = True
                        depth[i] = max(depth[i], out[0, 7])
                        squares += out[0, 7] ** 2 * (2 - out[0, 8])
    return 0.5 * stiffness * squares


@kernel
def look_at_all(
    shape: Shape, bodies: Bodies, pairs: Pairs, ground: Ground, channel: Any, hooks: Any, rims: Any, stiffness: float,
    wall_stiffness: float, met: Indices, touches: Any, held: Any, depth: Array, out: Array,
) -> tuple[int, float]:  # fmt: skip
    """Look at all contacts; see `look_at_pairs` and `look_at_fixtures`.

    Returns:
        Rows of `met` that were written, and the energy of all normal springs [J].
    """
    count, energy = look_at_pairs(shape, bodies, pairs, stiffness, met, touches, depth, out)
    energy += look_at_fixtures(shape, bodies, ground, channel, hooks, rims, wall_stiffness, touches, held, depth, out)
    return count, energy


@kernel
def glance(
    shape: Shape, bodies: Bodies, pairs: Pairs, ends: Ends, ground: Ground, channel: Any, hooks: Any, rims: Any,
    stiffness: float, wall_stiffness: float, velocities: Array, met: Indices, touches: Any, held: Any, depth: Array,
    out: Array, found: Array,
) -> None:  # fmt: skip
    """Find the extremes of all smarticles in one call, which is what a watchdog asks as long as nothing is wrong.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles, posed.
        pairs: as in `look_at_pairs`.
        ends: what contacts with floor and wall remember.
        ground: the fixtures.
        channel: as in `look_at_fixtures`.
        hooks: the same.
        rims: the same.
        stiffness: kn between smarticles [N/m].
        wall_stiffness: kn with fixtures [N/m].
        velocities: (N, 3, 3) of the links' centres [m/s].
        met: scratch.
        touches: scratch.
        held: scratch.
        depth: zeros; scratch.
        out: scratch.
        found: (7,) written: largest speed of a link [m/s]; height of the lowest and of the highest end of an axis [m];
            distance of the farthest one from the vertical axis [m]; deepest contact now and between two looks [m];
            energy of all springs of contacts [J]. A speed that is no number makes the first one no number.
    """
    _, energy = look_at_pairs(shape, bodies, pairs, stiffness, met, touches, depth, out)
    energy += look_at_fixtures(shape, bodies, ground, channel, hooks, rims, wall_stiffness, touches, held, depth, out)
    for k in range(pairs.counts[0]):
        if pairs.used[k]:
            for slot in range(pairs.slip.shape[1]):
                energy += pairs.slip[k, slot, 3]
    for p in range(ends.slip.shape[0]):
        for end in range(ends.slip.shape[1]):
            for slot in range(ends.slip.shape[2]):
                energy += ends.slip[p, end, slot, 3]
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


@part
def depth_at(
    ground: Ground, channel: Any, radius: float, surface: int, x: float, y: float, z: float
) -> tuple[int, float]:
    """How deep an end of a link is in one of the surfaces that it can touch.

    The same geometry as in `dem.engine.links.contact.walls`, which adds forces.

    Returns:
        The part, and the depth [m]; not positive where they are apart.
    """
    if channel is not None:
        if surface < 2:
            return 4 + surface, radius - channel[0] + (-y if surface == 0 else y)
        return 0, 0.0
    if surface == 0:
        return 0, radius - (z - ground.place[0])
    height, r, tiers = z - ground.place[1], (x * x + y * y) ** 0.5, ground.radii.shape[0]
    lifted = ground.flags[1] != 0
    if ground.flags[0] == 0 or height > ground.top:
        return 1, 0.0
    if lifted and height < ground.bottoms[0]:
        under = ((r - ground.radii[0]) ** 2 + (height - ground.bottoms[0]) ** 2) ** 0.5
        return 1, radius - under if surface == 1 else 0.0
    tier = 0
    while tier + 1 < tiers and height > ground.bottoms[tier + 1]:
        tier += 1
    if surface == 1:
        gap = ground.radii[tier] - r
        return 1, radius - (abs(gap) if lifted else gap)
    if tier + 1 == tiers or height <= ground.bottoms[tier + 1] - radius:
        return 1, 0.0
    up, away = height - ground.bottoms[tier + 1], r - ground.radii[tier + 1]
    return 1, radius + up if away >= 0.0 else radius - (up * up + away * away) ** 0.5


@part
def normal_at(ground: Ground, channel: Any, surface: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Unit normal of one of the surfaces, towards an end of a link that touches it, see `depth_at` [1]."""
    if channel is not None:
        return 0.0, 1.0 if surface == 0 else -1.0, 0.0
    if surface == 0:
        return 0.0, 0.0, 1.0
    height, r, tiers = z - ground.place[1], (x * x + y * y) ** 0.5, ground.radii.shape[0]
    ex, ey = x / r, y / r
    lifted = ground.flags[1] != 0
    if lifted and height < ground.bottoms[0]:
        return _from_edge(ex, ey, r - ground.radii[0], height - ground.bottoms[0])
    tier = 0
    while tier + 1 < tiers and height > ground.bottoms[tier + 1]:
        tier += 1
    if surface == 1:
        return (ex, ey, 0.0) if lifted and r > ground.radii[tier] else (-ex, -ey, 0.0)
    up, away = height - ground.bottoms[tier + 1], r - ground.radii[tier + 1]
    return (0.0, 0.0, -1.0) if away >= 0.0 else _from_edge(ex, ey, away, up)


@part
def _from_edge(ex: float, ey: float, out: float, up: float) -> tuple[float, float, float]:
    """Unit vector from a round edge to what is `out` [m] outside of it and `up` [m] above it, (ex, ey) outwards."""
    distance = (out * out + up * up) ** 0.5
    return ex * out / distance, ey * out / distance, up / distance
