"""Which links are near each other: a wide list, rebuilt seldom, and a tight one inside it, which steps look at.

A list holds every pair whose axes are nearer than a diameter plus its skin. It is good until two links may have come
nearer by the skin: until some point has moved by half of it, apart from what all have moved on average, since a shaken
pile moves as a whole. The ends of a link tell, as no point between them moves farther. Both lists are in an order that
depends on the positions alone, and the memory of a contact goes with its pair.
"""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array, Bodies, Cells, Pairs
from dem.engine.links.compiler import kernel
from dem.engine.links.nearest import nearest_on_segments
from dem.engine.links.shape import Shape

GOOD, REBUILD, FULL = 0, 1, 2


@kernel
def moved(bodies: Bodies, marks: Array, centres: Array) -> float:
    """The farthest that an end of a link has moved since `marks` (N S, 6) were taken, apart from the mean [m].

    Args:
        bodies: the smarticles.
        marks: starts and ends of all links then.
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
    most = 0.0
    for p in range(segments.shape[0]):
        ax, ay, az = segments[p, 0] - x, segments[p, 1] - y, segments[p, 2] - z
        start = (ax - marks[p, 0]) ** 2 + (ay - marks[p, 1]) ** 2 + (az - marks[p, 2]) ** 2
        ax, ay, az = ax + segments[p, 3], ay + segments[p, 4], az + segments[p, 5]
        end = (ax - marks[p, 3]) ** 2 + (ay - marks[p, 4]) ** 2 + (az - marks[p, 5]) ** 2
        most = max(most, start, end)
    return math.sqrt(most)


@kernel
def mark(bodies: Bodies, marks: Array, centres: Array) -> None:
    """Take note of where all links are, see `moved`; both arrays are written."""
    segments = bodies.segments
    for p in range(segments.shape[0]):
        for d in range(3):
            marks[p, d] = segments[p, d]
            marks[p, 3 + d] = segments[p, d] + segments[p, 3 + d]
    centres[:] = bodies.position


@kernel
def _distance(segments: Array, p: int, q: int) -> float:
    """Squared distance of two axes [m²]."""
    ux, uy, uz = segments[p, 3], segments[p, 4], segments[p, 5]
    vx, vy, vz = segments[q, 3], segments[q, 4], segments[q, 5]
    wx, wy, wz = segments[p, 0] - segments[q, 0], segments[p, 1] - segments[q, 1], segments[p, 2] - segments[q, 2]
    s, t = nearest_on_segments(
        ux * ux + uy * uy + uz * uz,
        ux * vx + uy * vy + uz * vz,
        vx * vx + vy * vy + vz * vz,
        ux * wx + uy * wy + uz * wz,
        vx * wx + vy * wy + vz * wz,
    )
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return x * x + y * y + z * z


@kernel
def tighten(shape: Shape, bodies: Bodies, pairs: Pairs, skin: float) -> None:
    """Make the tight list from the wide one, with a skin [m] of its own."""
    reach = (2 * shape.radius + skin) ** 2
    count = 0
    for k in range(pairs.counts[0]):
        # Contacts stay in the list until the step in which they end has forgotten them.
        if _distance(bodies.segments, pairs.first[k], pairs.second[k]) < reach or pairs.used[k]:
            pairs.near[count] = k
            count += 1
    pairs.counts[1] = count
    pairs.counts[3] += 1
    mark(bodies, pairs.near_marks, pairs.near_centres)


@kernel
def build(shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells, skin: float, piece: float) -> int:
    """Make the wide list anew, and carry over what contacts remember.

    Every link is cut into pieces. Two links that are nearer than the reach have pieces whose middles are nearer than
    the reach and a piece, in cells of that size that touch each other.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles.
        pairs: the list; all but the tight list is written.
        cells: scratch.
        skin: of the list [m].
        piece: length of the longest piece [m].

    Returns:
        GOOD, or FULL where there is no room for all pairs or pieces: then the list is as it was.
    """
    segments, owners, places = bodies.segments, cells.owners, cells.places
    count = segments.shape[0]
    reach = 2 * shape.radius + skin
    size = reach + piece
    x0, y0, z0 = math.inf, math.inf, math.inf
    x1, y1, z1 = -math.inf, -math.inf, -math.inf
    for p in range(count):
        x, y, z = segments[p, 0], segments[p, 1], segments[p, 2]
        x0, y0, z0 = min(x0, x, x + segments[p, 3]), min(y0, y, y + segments[p, 4]), min(z0, z, z + segments[p, 5])
        x1, y1, z1 = max(x1, x, x + segments[p, 3]), max(y1, y, y + segments[p, 4]), max(z1, z, z + segments[p, 5])
    room = cells.starts.shape[0] - 2
    nx, ny, nz = 1 + _cell(x1 - x0, size, room), 1 + _cell(y1 - y0, size, room), 1 + _cell(z1 - z0, size, room)
    # What lies beyond the last cell is put into it: links that are neighbours stay in cells that touch.
    while nx * ny * nz > room:
        if nx >= ny and nx >= nz:
            nx = (nx + 1) // 2
        elif ny >= nz:
            ny = (ny + 1) // 2
        else:
            nz = (nz + 1) // 2
    starts = cells.starts
    starts[:] = 0
    number = 0
    for p in range(count):
        cuts = _cuts(segments, p, piece)
        if number + cuts > cells.cells.shape[0]:
            return FULL
        for k in range(cuts):
            s = (k + 0.5) / cuts
            a = _cell(segments[p, 0] + s * segments[p, 3] - x0, size, nx - 1)
            b = _cell(segments[p, 1] + s * segments[p, 4] - y0, size, ny - 1)
            c = _cell(segments[p, 2] + s * segments[p, 5] - z0, size, nz - 1)
            cell = (a * ny + b) * nz + c
            cells.cells[number] = cell
            starts[cell + 1] += 1
            number += 1
    for cell in range(nx * ny * nz):
        starts[cell + 1] += starts[cell]
    starts[nx * ny * nz + 1] = number
    # Filled from behind, each cell's start moves down to where it belongs.
    number -= 1
    for p in range(count - 1, -1, -1):
        cuts = _cuts(segments, p, piece)
        for k in range(cuts - 1, -1, -1):
            cell = cells.cells[number]
            number -= 1
            place = starts[cell + 1] - 1
            starts[cell + 1] = place
            s = (k + 0.5) / cuts
            owners[place] = p
            for d in range(3):
                places[place, d] = segments[p, d] + s * segments[p, 3 + d]
    # Now cell c is starts[c + 1] … starts[c + 2].
    found = _search(shape, bodies, cells, (nx, ny, nz), (x0, y0, z0), size, reach, piece, pairs)
    if found < 0:
        return FULL
    _carry(pairs, cells, found, count)
    mark(bodies, pairs.wide_marks, pairs.wide_centres)
    pairs.counts[0] = found
    pairs.counts[2] += 1
    return GOOD


@kernel
def _cell(offset: float, size: float, last: int) -> int:
    return int(min(max(offset / size, 0.0), float(last)))


@kernel
def _cuts(segments: Array, p: int, piece: float) -> int:
    squared = segments[p, 3] ** 2 + segments[p, 4] ** 2 + segments[p, 5] ** 2
    return int(math.ceil(math.sqrt(squared) / piece))


@kernel
def _search(
    shape: Shape, bodies: Bodies, cells: Cells, shape_of_grid: tuple[int, int, int],
    origin: tuple[float, float, float], size: float, reach: float, piece: float, pairs: Pairs,
) -> int:  # fmt: skip
    """Write all pairs into the scratch list of `cells`; their number, or -1 where there is no room."""
    segments, owners, places, starts = bodies.segments, cells.owners, cells.places, cells.starts
    nx, ny, nz = shape_of_grid
    count, each = segments.shape[0], shape.kinds.shape[0] * shape.offsets.shape[0]
    pieces_near, links_near = (reach + piece) ** 2, reach * reach
    capacity = cells.first.shape[0]
    cells.seen[:] = -1
    total = 0
    number = 0
    for p in range(count):
        body = p // each
        cuts = _cuts(segments, p, piece)
        for k in range(cuts):
            s = (k + 0.5) / cuts
            x, y, z = (
                segments[p, 0] + s * segments[p, 3],
                segments[p, 1] + s * segments[p, 4],
                segments[p, 2] + s * segments[p, 5],
            )
            cell = cells.cells[number]
            number += 1
            a, b, c = cell // (ny * nz), (cell // nz) % ny, cell % nz
            for aa in range(max(0, a - 1), min(nx, a + 2)):
                for bb in range(max(0, b - 1), min(ny, b + 2)):
                    # Cells along z are neighbours in memory.
                    row = (aa * ny + bb) * nz
                    begin, end = starts[row + max(0, c - 1) + 1], starts[row + min(nz, c + 2) + 1]
                    for m in range(begin, end):
                        q = owners[m]
                        if q <= p or cells.seen[q] == p:
                            continue
                        dx, dy, dz = places[m, 0] - x, places[m, 1] - y, places[m, 2] - z
                        if dx * dx + dy * dy + dz * dz > pieces_near or q // each == body:
                            continue
                        cells.seen[q] = p
                        if _distance(segments, p, q) < links_near:
                            if total == capacity:
                                return -1
                            cells.first[total] = p
                            cells.second[total] = q
                            total += 1
    return total


@kernel
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
