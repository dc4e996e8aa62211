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
from dem.engine.links.compiler import part
from dem.engine.links.contact.nearest import nearest_on_segments
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


@part
def _near(segments: Array, p: int, q: int, reach: float) -> bool:
    """Whether two axes are nearer than `reach` [m]."""
    ux, uy, uz = segments[p, 3], segments[p, 4], segments[p, 5]
    vx, vy, vz = segments[q, 3], segments[q, 4], segments[q, 5]
    wx, wy, wz = segments[p, 0] - segments[q, 0], segments[p, 1] - segments[q, 1], segments[p, 2] - segments[q, 2]
    # Most are told apart by the lines that they are on, without a division.
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    across = wx * nx + wy * ny + wz * nz
    squared = reach * reach
    if across * across > squared * (nx * nx + ny * ny + nz * nz):
        return False
    s, t = nearest_on_segments(
        ux * ux + uy * uy + uz * uz,
        ux * vx + uy * vy + uz * vz,
        vx * vx + vy * vy + vz * vz,
        ux * wx + uy * wy + uz * wz,
        vx * wx + vy * wy + vz * wz,
    )
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return bool(x * x + y * y + z * z < squared)


@part
def tighten(shape: Shape, bodies: Bodies, pairs: Pairs, least: float, most: float, time: float) -> None:
    """Make the tight list from the wide one; see `mark` for the skins."""
    mark(shape, bodies, pairs.near_marks, pairs.near_centres, least, most, time)
    marks, first, second = pairs.near_marks, pairs.first, pairs.second
    diameter = 2 * shape.radius
    count = 0
    for k in range(pairs.counts[0]):
        p, q = first[k], second[k]
        reach = diameter + marks[p, 6] + marks[q, 6]
        # Contacts stay in the list until the step in which they end has forgotten them.
        if pairs.used[k] or _near(bodies.segments, p, q, reach):
            pairs.near[count] = k
            count += 1
    pairs.counts[1] = count
    pairs.counts[3] += 1


@part
def build(
    shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells,
    inner: float, least: float, most: float, time: float, piece: float,
) -> int:  # fmt: skip
    """Make the wide list anew, and carry over what contacts remember.

    Every link is cut into pieces, and noted in all cells that the middles of its pieces are in. Two links that are
    nearer than the greatest reach have pieces whose middles are nearer than it and a piece, in cells of that size that
    touch each other.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles.
        pairs: the list; all but the tight list is written.
        cells: scratch.
        inner: the thickest skin that the tight list will have [m]; the wide list leaves room for it.
        least: the thinnest skin [m].
        most: the thickest skin [m].
        time: for which a skin is to be good [s].
        piece: length of the longest piece [m].

    Returns:
        GOOD, or FULL where there is no room for all pairs or pieces: then the list is as it was.
    """
    segments, owners, starts = bodies.segments, cells.owners, cells.starts
    count = segments.shape[0]
    size = 2 * (shape.radius + most + inner) + piece
    x0, y0, z0 = math.inf, math.inf, math.inf
    x1, y1, z1 = -math.inf, -math.inf, -math.inf
    for p in range(count):
        x, y, z = segments[p, 0], segments[p, 1], segments[p, 2]
        x0, y0, z0 = min(x0, x, x + segments[p, 3]), min(y0, y, y + segments[p, 4]), min(z0, z, z + segments[p, 5])
        x1, y1, z1 = max(x1, x, x + segments[p, 3]), max(y1, y, y + segments[p, 4]), max(z1, z, z + segments[p, 5])
    room = starts.shape[0] - 2
    nx, ny, nz = 1 + _cell(x1 - x0, size, room), 1 + _cell(y1 - y0, size, room), 1 + _cell(z1 - z0, size, room)
    # What lies beyond the last cell is put into it: links that are neighbours stay in cells that touch.
    while nx * ny * nz > room:
        if nx >= ny and nx >= nz:
            nx = (nx + 1) // 2
        elif ny >= nz:
            ny = (ny + 1) // 2
        else:
            nz = (nz + 1) // 2
    total = nx * ny * nz
    for cell in range(total + 2):
        starts[cell] = 0
    number = 0
    for p in range(count):
        cuts, last = _cuts(segments, p, piece), -1
        cells.begins[p] = number
        if number + cuts > cells.cells.shape[0]:
            return FULL
        for k in range(cuts):
            s = (k + 0.5) / cuts
            a = _cell(segments[p, 0] + s * segments[p, 3] - x0, size, nx - 1)
            b = _cell(segments[p, 1] + s * segments[p, 4] - y0, size, ny - 1)
            c = _cell(segments[p, 2] + s * segments[p, 5] - z0, size, nz - 1)
            cell = (a * ny + b) * nz + c
            if cell != last:
                cells.cells[number] = cell
                starts[cell + 1] += 1
                number += 1
                last = cell
    cells.begins[count] = number
    for cell in range(total):
        starts[cell + 1] += starts[cell]
    starts[total + 1] = number
    # Filled from behind, each cell's start moves down to where it belongs: cell c is starts[c + 1] … starts[c + 2].
    for p in range(count - 1, -1, -1):
        for k in range(cells.begins[p + 1] - 1, cells.begins[p] - 1, -1):
            place = starts[cells.cells[k] + 1] - 1
            starts[cells.cells[k] + 1] = place
            owners[place] = p
    mark(shape, bodies, cells.marks, cells.centres, least, most, time)
    found = _search(shape, bodies, cells, nx, ny, nz, 2 * (shape.radius + inner))
    if found < 0:
        return FULL
    _carry(pairs, cells, found, count)
    mark(shape, bodies, pairs.wide_marks, pairs.wide_centres, least, most, time)
    pairs.counts[0] = found
    pairs.counts[2] += 1
    return GOOD


@part
def _cell(offset: float, size: float, last: int) -> int:
    return int(min(max(offset / size, 0.0), float(last)))


@part
def _cuts(segments: Array, p: int, piece: float) -> int:
    squared = segments[p, 3] ** 2 + segments[p, 4] ** 2 + segments[p, 5] ** 2
    return math.ceil(math.sqrt(squared) / piece)


@part
def _search(shape: Shape, bodies: Bodies, cells: Cells, nx: int, ny: int, nz: int, bare: float) -> int:
    """Write all pairs into the scratch list of `cells`; their number, or -1 where there is no room.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles.
        cells: filled; `first`, `second` and the notes of what was seen are written.
        nx: cells along x.
        ny: cells along y.
        nz: cells along z.
        bare: reach of a pair without skins [m].
    """
    segments, owners, starts, marks = bodies.segments, cells.owners, cells.starts, cells.marks
    seen, visited, places, begins = cells.seen, cells.visited, cells.cells, cells.begins
    first, second = cells.first, cells.second
    count, each = segments.shape[0], shape.kinds.shape[0] * shape.offsets.shape[0]
    capacity = first.shape[0]
    for p in range(count):
        seen[p] = -1
    for cell in range(nx * ny * nz):
        visited[cell] = -1
    boxes = cells.boxes
    for p in range(count):
        for d in range(3):
            boxes[p, d] = min(marks[p, d], marks[p, 3 + d]) - marks[p, 6]
            boxes[p, 3 + d] = max(marks[p, d], marks[p, 3 + d]) + marks[p, 6]
    total = 0
    for p in range(count):
        x0, y0, z0 = boxes[p, 0] - bare, boxes[p, 1] - bare, boxes[p, 2] - bare
        x1, y1, z1 = boxes[p, 3] + bare, boxes[p, 4] + bare, boxes[p, 5] + bare
        # Links of the same smarticle come right after each other.
        after = (p // each + 1) * each - 1
        mine = bare + marks[p, 6]
        for k in range(begins[p], begins[p + 1]):
            cell = places[k]
            a, b, c = cell // (ny * nz), (cell // nz) % ny, cell % nz
            for aa in range(max(0, a - 1), min(nx, a + 2)):
                for bb in range(max(0, b - 1), min(ny, b + 2)):
                    for cc in range(max(0, c - 1), min(nz, c + 2)):
                        other = (aa * ny + bb) * nz + cc
                        if visited[other] == p:
                            continue
                        visited[other] = p
                        # Links stand in order in a cell: from behind, until they have had their turn already.
                        m = starts[other + 2] - 1
                        begin = starts[other + 1]
                        while m >= begin:
                            q = owners[m]
                            m -= 1
                            if q <= after:
                                break
                            if seen[q] == p:
                                continue
                            seen[q] = p
                            if (
                                (boxes[q, 0] > x1)
                                | (boxes[q, 1] > y1)
                                | (boxes[q, 2] > z1)
                                | (boxes[q, 3] < x0)
                                | (boxes[q, 4] < y0)
                                | (boxes[q, 5] < z0)
                            ):
                                continue
                            reach = mine + marks[q, 6]
                            if _near(segments, p, q, reach):
                                if total == capacity:
                                    return -1
                                first[total] = p
                                second[total] = q
                                total += 1
    return total


@part
def _carry(pairs: Pairs, cells: Cells, found: int, links: int) -> None:
    """Let the new list of `cells` take the place of the old one, with what contacts remember."""
    rows, old = cells.rows, pairs.counts[0]
    rows[:] = 0
    for k in range(old):
        rows[pairs.first[k] + 1] += 1
    for p in range(links):
        rows[p + 1] += rows[p]
    for k in range(found):
        p, q = cells.first[k], cells.second[k]
        cells.used[k] = 0
        for m in range(rows[p], rows[p + 1]):
            if pairs.second[m] == q:
                if pairs.used[m]:
                    cells.used[k] = pairs.used[m]
                    for slot in range(3):
                        for d in range(4):
                            cells.slip[k, slot, d] = pairs.slip[m, slot, d]
                break
    for k in range(found):
        pairs.first[k], pairs.second[k], pairs.used[k] = cells.first[k], cells.second[k], cells.used[k]
        for slot in range(3):
            for d in range(4):
                pairs.slip[k, slot, d] = cells.slip[k, slot, d] if cells.used[k] else 0.0
