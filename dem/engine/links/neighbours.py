"""Which links are near each other: a wide list, rebuilt seldom, and a tight one inside it, which steps look at.

Every link has a skin of its own: how far its ends, and so all of it, may move until the list is made anew, apart from
what all have moved on average, since a shaken pile moves as a whole. Links that are fast have thick skins and those
that lie still thin ones, so that all are used up at about the same time. A list holds every pair whose axes are nearer
than a diameter and both skins. Both lists are in an order that depends on the positions alone, and the memory of a
contact goes with its pair.
"""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array, Bodies, Cells, Pairs
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.nearest import nearest
from dem.engine.links.shape import Shape

GOOD, REBUILD, FULL = 0, 1, 2


@part
def moved(bodies: Bodies, marks: Array, centres: Array) -> bool:
    """Whether an end of a link has moved by more than the link's skin since `marks` were taken, apart from the mean.

    Args:
        bodies: the smarticles.
        marks: (N S, 7) starts and ends of all links then, and their skins [m].
        centres: (N, 3) centres of mass then [m].
    """
    position, segments = bodies.position, bodies.segments
    n = position.shape[0]
    x, y, z = 0.0, 0.0, 0.0
    for i in range(n):
        x += position[i, 0] - centres[i, 0]
        y += position[i, 1] - centres[i, 1]
        z += position[i, 2] - centres[i, 2]
    x, y, z = x / n, y / n, z / n
    over = False
    for p in range(segments.shape[0]):
        ax, ay, az = segments[p, 0] - x, segments[p, 1] - y, segments[p, 2] - z
        start = (ax - marks[p, 0]) ** 2 + (ay - marks[p, 1]) ** 2 + (az - marks[p, 2]) ** 2
        ax, ay, az = ax + segments[p, 3], ay + segments[p, 4], az + segments[p, 5]
        end = (ax - marks[p, 3]) ** 2 + (ay - marks[p, 4]) ** 2 + (az - marks[p, 5]) ** 2
        over |= max(start, end) > marks[p, 6] * marks[p, 6]
    return over


@part
def mark(shape: Shape, bodies: Bodies, marks: Array, centres: Array, least: float, most: float, time: float) -> None:
    """Take note of where all links are, and give each a skin, see `moved`; both arrays are written.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles.
        marks: (N S, 7).
        centres: (N, 3).
        least: the thinnest skin [m].
        most: the thickest skin [m].
        time: for which a skin is to be good at the present speed [s].
    """
    segments, position, velocity, spin = bodies.segments, bodies.position, bodies.velocity, bodies.spin
    n = position.shape[0]
    each = shape.kinds.shape[0] * shape.offsets.shape[0]
    x, y, z = 0.0, 0.0, 0.0
    for i in range(n):
        x, y, z = x + velocity[i, 0], y + velocity[i, 1], z + velocity[i, 2]
        for d in range(3):
            centres[i, d] = position[i, d]
    x, y, z = x / n, y / n, z / n
    for p in range(segments.shape[0]):
        for d in range(3):
            marks[p, d] = segments[p, d]
            marks[p, 3 + d] = segments[p, d] + segments[p, 3 + d]
        i = p // each
        wx, wy, wz = spin[i, 0], spin[i, 1], spin[i, 2]
        fastest = 0.0
        for end in range(2):
            rx = marks[p, 3 * end] - position[i, 0]
            ry = marks[p, 3 * end + 1] - position[i, 1]
            rz = marks[p, 3 * end + 2] - position[i, 2]
            vx = velocity[i, 0] - x + wy * rz - wz * ry
            vy = velocity[i, 1] - y + wz * rx - wx * rz
            vz = velocity[i, 2] - z + wx * ry - wy * rx
            fastest = max(fastest, vx * vx + vy * vy + vz * vz)
        marks[p, 6] = min(most, least + time * math.sqrt(fastest))


@inlined
def _off_lines(segments: Array, p: int, q: int, reach: float) -> bool:
    """Whether the lines that two axes are on are farther apart than `reach` [m]; without a division."""
    ux, uy, uz = segments[p, 3], segments[p, 4], segments[p, 5]
    vx, vy, vz = segments[q, 3], segments[q, 4], segments[q, 5]
    wx, wy, wz = segments[p, 0] - segments[q, 0], segments[p, 1] - segments[q, 1], segments[p, 2] - segments[q, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    across = wx * nx + wy * ny + wz * nz
    return bool(across * across > reach * reach * (nx * nx + ny * ny + nz * nz))


@inlined
def _near(segments: Array, p: int, q: int, reach: float, inverse_p: float, inverse_q: float) -> bool:
    """Whether two axes, of known inverse squares of their lengths [1/m²], are nearer than `reach` [m]."""
    ux, uy, uz = segments[p, 3], segments[p, 4], segments[p, 5]
    vx, vy, vz = segments[q, 3], segments[q, 4], segments[q, 5]
    wx, wy, wz = segments[p, 0] - segments[q, 0], segments[p, 1] - segments[q, 1], segments[p, 2] - segments[q, 2]
    s, t = nearest(
        ux * ux + uy * uy + uz * uz,
        ux * vx + uy * vy + uz * vz,
        vx * vx + vy * vy + vz * vz,
        ux * wx + uy * wy + uz * wz,
        vx * wx + vy * wy + vz * wz,
        inverse_p,
        inverse_q,
    )
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return bool(x * x + y * y + z * z < reach * reach)


@part
def tighten(shape: Shape, bodies: Bodies, pairs: Pairs, least: float, most: float, time: float) -> None:
    """Make the tight list from the wide one; see `mark` for the skins."""
    mark(shape, bodies, pairs.near_marks, pairs.near_centres, least, most, time)
    marks, first, second, near, used = pairs.near_marks, pairs.first, pairs.second, pairs.near, pairs.used
    diameter, inverses, kind = 2 * shape.radius, shape.inverses, pairs.kind
    count = 0
    # Every pair is written down, and the next one over it unless it counts: no branch, which would be mispredicted.
    for k in range(pairs.counts[0]):
        p, q = first[k], second[k]
        near[count] = k
        count += (used[k] != 0) | (not _off_lines(bodies.segments, p, q, diameter + marks[p, 6] + marks[q, 6]))
    lines, count = count, 0
    for m in range(lines):
        k = near[m]
        p, q = first[k], second[k]
        near[count] = k
        # Contacts stay in the list until the step in which they end has forgotten them.
        count += (used[k] != 0) | _near(
            bodies.segments, p, q, diameter + marks[p, 6] + marks[q, 6], inverses[kind[p]], inverses[kind[q]]
        )
    pairs.counts[1] = count
    pairs.counts[3] += 1


@part
def build(
    shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells,
    inner: float, least: float, most: float, time: float, piece: float,
) -> int:  # fmt: skip
    """Make the wide list anew, and carry over what contacts remember.

    Every link has a box about itself, its skin and half of what a pair needs besides. Boxes are sorted into strips
    along y and, within a strip, into short bins along x, by their lower corners: all that can overlap a box are in a
    few runs of neighbours in memory, from its own bin up to that of its upper corner.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles.
        pairs: the list; all but the tight list is written.
        cells: scratch.
        inner: the thickest skin that the tight list will have [m]; the wide list leaves room for it.
        least: the thinnest skin [m].
        most: the thickest skin [m].
        time: for which a skin is to be good [s].
        piece: width of a strip [m].

    Returns:
        GOOD, or FULL where there is no room for all pairs: then the list is as it was.
    """
    mark(shape, bodies, cells.marks, cells.centres, least, most, time)
    found = _search(shape, bodies, pairs, cells, 2 * (shape.radius + inner), piece)
    if found < 0:
        return FULL
    _carry(pairs, cells, found)
    for p in range(cells.marks.shape[0]):
        for d in range(7):
            pairs.wide_marks[p, d] = cells.marks[p, d]
    for i in range(cells.centres.shape[0]):
        for d in range(3):
            pairs.wide_centres[i, d] = cells.centres[i, d]
    pairs.counts[0] = found
    pairs.counts[2] += 1
    return GOOD


@inlined
def _bin(offset: float, size: float, last: int) -> int:
    """Which bin an offset is in; what lies beyond the last one is in it, and so is what is no number."""
    return int(min(offset / size, float(last))) if offset > 0.0 else 0


@inlined
def _box(marks: Array, p: int, d: int, more: float) -> tuple[float, float]:
    """Lower and upper bound of a link along an axis with its skin and more [m]."""
    start, end, more = marks[p, d], marks[p, 3 + d], more + marks[p, 6]
    return min(start, end) - more, max(start, end) + more


@part
def _search(shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells, bare: float, piece: float) -> int:
    """Write all pairs into the scratch list of `cells`, in rows by the first link.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles.
        pairs: tells owners and kinds.
        cells: `marks` are filled; the rest is written.
        bare: reach of a pair without skins [m].
        piece: width of a strip [m].

    Returns:
        Their number, or -1 where there is no room.
    """
    marks, starts, keys, order, boxes = cells.marks, cells.starts, cells.keys, cells.order, cells.boxes
    owner, close = pairs.owner, cells.close
    count = marks.shape[0]
    x0, y0, x1, y1, tallest = math.inf, math.inf, -math.inf, -math.inf, 0.0
    for p in range(count):
        low, high = _box(marks, p, 0, 0.5 * bare)
        x0, x1 = min(x0, low), max(x1, low)
        low, high = _box(marks, p, 1, 0.5 * bare)
        y0, y1, tallest = min(y0, low), max(y1, low), max(tallest, high - low)
    room = starts.shape[0] - 2
    ny = 1 + _bin(y1 - y0, piece, int(math.sqrt(room)) - 1)
    nx = 1 + _bin(x1 - x0, 0.25 * piece, room // ny - 1)
    # As wide as need be: of links that are far away, the last strips and bins have all.
    width, size = piece, 0.25 * piece
    total = nx * ny
    for key in range(total + 2):
        starts[key] = 0
    for p in range(count):
        x, _ = _box(marks, p, 0, 0.5 * bare)
        y, _ = _box(marks, p, 1, 0.5 * bare)
        key = _bin(y - y0, width, ny - 1) * nx + _bin(x - x0, size, nx - 1)
        keys[p] = key
        starts[key + 1] += 1
    for key in range(total):
        starts[key + 1] += starts[key]
    starts[total + 1] = count
    # Filled from behind, each bin's start moves down to where it belongs: bin k is starts[k + 1] … starts[k + 2].
    for p in range(count - 1, -1, -1):
        place = starts[keys[p] + 1] - 1
        starts[keys[p] + 1] = place
        order[place] = p
    for m in range(count):
        p = order[m]
        for d in range(3):
            boxes[m, d], boxes[m, 3 + d] = _box(marks, p, d, 0.5 * bare)
    rows, lower, upper = cells.rows, cells.lower, cells.upper
    for p in range(count + 2):
        rows[p] = 0
    capacity, number = lower.shape[0], 0
    for m in range(count):
        p = order[m]
        ly, lz, hx, hy, hz = boxes[m, 1], boxes[m, 2], boxes[m, 3], boxes[m, 4], boxes[m, 5]
        own, mine, skin = owner[p], keys[p] // nx, bare + marks[p, 6]
        inverse = shape.inverses[pairs.kind[p]]
        column, last = keys[p] - mine * nx, _bin(hx - x0, size, nx - 1)
        for strip in range(_bin(ly - tallest - y0, width, ny - 1), _bin(hy - y0, width, ny - 1) + 1):
            # Of two links that begin in the same bins along x, the one in the lower strip finds the other.
            begin = starts[strip * nx + column + (1 if strip >= mine else 2)]
            if strip == mine:
                begin = m + 1
            # Written down and overwritten without a branch, as in `tighten`.
            hits = 0
            for n in range(begin, starts[strip * nx + last + 2]):
                close[hits] = order[n]
                hits += not (
                    (boxes[n, 1] > hy)
                    | (boxes[n, 4] < ly)
                    | (boxes[n, 2] > hz)
                    | (boxes[n, 5] < lz)
                    | (boxes[n, 0] > hx)
                )
            boxed, hits = hits, 0
            for n in range(boxed):
                q = close[n]
                close[hits] = q
                hits += not (_off_lines(bodies.segments, p, q, skin + marks[q, 6]) | (owner[q] == own))
            if number + hits > capacity:
                return -1
            for n in range(hits):
                q = close[n]
                lower[number], upper[number] = min(p, q), max(p, q)
                number += _near(bodies.segments, p, q, skin + marks[q, 6], inverse, shape.inverses[pairs.kind[q]])
    for k in range(number):
        rows[lower[k] + 2] += 1
    for p in range(count):
        rows[p + 2] += rows[p + 1]
    first, second = cells.first, cells.second
    for k in range(number):
        p = lower[k]
        place = rows[p + 1]
        rows[p + 1] = place + 1
        first[place], second[place] = p, upper[k]
    return number


@part
def _carry(pairs: Pairs, cells: Cells, found: int) -> None:
    """Let the new list of `cells` take the place of the old one, with what contacts remember."""
    rows, slip, used, kept = cells.rows, cells.slip, cells.used, 0
    for k in range(pairs.counts[0]):
        if pairs.used[k]:
            cells.lower[kept], cells.upper[kept], used[kept] = pairs.first[k], pairs.second[k], pairs.used[k]
            for slot in range(3):
                for d in range(4):
                    slip[kept, slot, d] = pairs.slip[k, slot, d]
                    pairs.slip[k, slot, d] = 0.0
            pairs.used[k] = 0
            kept += 1
    for k in range(found):
        pairs.first[k], pairs.second[k], pairs.used[k] = cells.first[k], cells.second[k], 0
    for k in range(kept):
        p, q = cells.lower[k], cells.upper[k]
        for m in range(rows[p], rows[p + 1]):
            if pairs.second[m] == q:
                pairs.used[m] = used[k]
                for slot in range(3):
                    for d in range(4):
                        pairs.slip[m, slot, d] = slip[k, slot, d]
                break
