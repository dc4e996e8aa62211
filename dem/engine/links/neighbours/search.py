"""All pairs of links that are nearer than their skins and a diameter, found anew.

Every link has a box about itself, its skin and half of what a pair needs besides. Boxes are sorted into strips along y
and, within a strip, into short bins along x, by their lower corners: all that can overlap a box are in a few runs of
neighbours in memory, from its own bin up to that of its upper corner. What is asked of links is copied in that order.

The list is in the order of the links' numbers; that of many links in the order of the bins, so that a step meets links
that are near each other one after the other, since all of them do not fit into a processor's cache.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from dem.engine.links.arrays import Array, Bodies, Cells, Indices, Pairs
from dem.engine.links.compiler import inlined, part
from dem.engine.links.shape import Shape
from dem.engine.links.vectors import between, cross, dot, lines, nearest, sub, vector

FEW = 3000  # links; up to so many the list is in the order of their numbers
SKIN, INVERSE = 6, 7  # places in a row of `Cells.lines`


class Grid(NamedTuple):
    """The bins."""

    bare: float  #: Reach of a pair without skins [m]
    x: float  #: Where bins begin along x [m]
    y: float  #: The same along y
    tallest: float  #: Extent of the largest box along y [m]
    size: float  #: Of a bin along x [m]
    width: float  #: Of a strip, along y [m]
    columns: int  #: Bins along x
    strips: int  #: Along y


@inlined
def off_lines(segments: Array, p: int, q: int, reach: float) -> bool:
    """Return whether the lines that two axes are on are farther apart than `reach` [m]; without a division."""
    one, other = segments[p], segments[q]
    normal = cross(vector(one, 3), vector(other, 3))
    across = dot(sub(vector(one, 0), vector(other, 0)), normal)
    return bool(across * across > reach * reach * dot(normal, normal))


@inlined
def near_each_other(segments: Array, p: int, q: int, reach: float, inverse_p: float, inverse_q: float) -> bool:
    """Return whether two axes, of known inverse squared lengths [1/m²], are nearer than `reach` [m]."""
    both = lines(segments[p], segments[q], inverse_p, inverse_q)
    s, t = nearest(both)
    gap = between(both, s, t)
    return bool(dot(gap, gap) < reach * reach)


@part
def search(shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells, bare: float, piece: float) -> int:
    """Write all pairs into the scratch list of `cells`, in rows by the first link.

    Args:
        pairs: tells owners and kinds.
        cells: `marks` are filled; the rest is written.
        bare: reach of a pair without skins [m].
        piece: width of a strip [m].

    Returns:
        Their number, or -1 where there is no room.
    """
    count = cells.marks.shape[0]
    x0, x1, y0, y1, tallest = corners(cells.marks, bare)
    grid = grid_over(x0, x1, y0, y1, tallest, bare, piece, cells.starts.shape[0] - 2)
    find_bins(cells, grid)
    sort_bins(cells, grid)
    draw_boxes(shape, bodies, pairs, cells, grid)
    number = find_pairs(pairs, cells, grid)
    if number < 0:
        return -1
    for p in range(count + 2):
        cells.rows[p] = 0
    for k in range(number):
        cells.rows[cells.places[cells.lower[k]] + 2] += 1
    # Lengths of rows, each at its number + 2, become where rows begin, one place further down.
    for row in range(count):
        cells.rows[row + 2] += cells.rows[row + 1]
    for k in range(number):
        # A row's end moves to where it belongs, as rows fill.
        p = cells.lower[k]
        row = cells.places[p]
        place = cells.rows[row + 1]
        cells.rows[row + 1] = place + 1
        cells.first[place], cells.second[place] = p, cells.upper[k]
    return number


@inlined
def _bin(offset: float, size: float, last: int) -> int:
    """Which bin an offset is in; what lies beyond the last one is in it, and so is what is no number."""
    return int(min(offset / size, float(last))) if offset > 0.0 else 0


@inlined
def _box(marks: Array, p: int, d: int, more: float) -> tuple[float, float]:
    """Lower and upper bound of a link along an axis with its skin and more [m]."""
    start, end, more = marks[p, d], marks[p, 3 + d], more + marks[p, 6]
    return min(start, end) - more, max(start, end) + more


@inlined
def corners(marks: Array, bare: float) -> tuple[float, float, float, float, float]:
    """Bounds along x and y of the lower corners of the boxes of all links, and the tallest along y [m]."""
    x0, y0, x1, y1, tallest = math.inf, math.inf, -math.inf, -math.inf, 0.0
    for p in range(marks.shape[0]):
        low, high = _box(marks, p, 0, 0.5 * bare)
        x0, x1 = min(x0, low), max(x1, low)
        low, high = _box(marks, p, 1, 0.5 * bare)
        y0, y1, tallest = min(y0, low), max(y1, low), max(tallest, high - low)
    return x0, x1, y0, y1, tallest


@inlined
def grid_over(x0: float, x1: float, y0: float, y1: float, tallest: float, bare: float, piece: float, room: int) -> Grid:
    """Bins for what `corners` found; there is room for so many."""
    ny = 1 + _bin(y1 - y0, piece, int(math.sqrt(room)) - 1)
    nx = 1 + _bin(x1 - x0, 0.25 * piece, room // ny - 1)
    # As wide as need be: of links that are far away, the last strips and bins have all.
    return Grid(bare, x0, y0, tallest, 0.25 * piece, piece, nx, ny)


@inlined
def find_bins(cells: Cells, grid: Grid) -> None:
    """Write the bins of all links into `keys`."""
    for p in range(cells.keys.shape[0]):
        x, _ = _box(cells.marks, p, 0, 0.5 * grid.bare)
        y, _ = _box(cells.marks, p, 1, 0.5 * grid.bare)
        strip = _bin(y - grid.y, grid.width, grid.strips - 1)
        cells.keys[p] = strip * grid.columns + _bin(x - grid.x, grid.size, grid.columns - 1)


@inlined
def sort_bins(cells: Cells, grid: Grid) -> None:
    """Write all links into `order` bin by bin, and where each bin begins into `starts`."""
    keys, starts, order = cells.keys, cells.starts, cells.order
    count, total = keys.shape[0], grid.columns * grid.strips
    for key in range(total + 2):
        starts[key] = 0
    for p in range(count):
        starts[keys[p] + 1] += 1
    for key in range(total):
        starts[key + 1] += starts[key]
    starts[total + 1] = count
    # Filled from behind, each bin's start moves down to where it belongs: bin k is starts[k + 1] … starts[k + 2].
    for p in range(count - 1, -1, -1):
        place = starts[keys[p] + 1] - 1
        starts[keys[p] + 1] = place
        order[place] = p


@inlined
def draw_boxes(shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells, grid: Grid) -> None:
    """Write what the search needs of the links, in `order`, and which rows they get."""
    few = cells.keys.shape[0] <= FEW
    for m in range(cells.keys.shape[0]):
        p = cells.order[m]
        cells.places[p] = p if few else m
        for d in range(6):
            cells.lines[m, d] = bodies.segments[p, d]
        cells.lines[m, SKIN], cells.lines[m, INVERSE] = cells.marks[p, 6], shape.inverses[pairs.kind[p]]
        for d in range(3):
            cells.boxes[d, m], cells.boxes[3 + d, m] = _box(cells.marks, p, d, 0.5 * grid.bare)


@inlined
def _boxed(
    boxes: Array, close: Indices, count: int, start: int, stop: int,
    ly: float, lz: float, hx: float, hy: float, hz: float,
) -> int:  # fmt: skip
    """Write places from `start` up to `stop` whose boxes overlap one into `close`, from place `count` on.

    Two loops: the first one is done for several boxes at once by the processor, as it has no order to keep; in the
    second every place is written down, and the next one over it unless it counts, without a branch.

    Returns:
        The place after the last.
    """
    number, room = stop - start, close.shape[0] // 2
    if number <= 0:
        return count
    overlap = close[room : room + number]
    x, low_y, low_z = boxes[0, start:stop], boxes[1, start:stop], boxes[2, start:stop]
    high_y, high_z = boxes[4, start:stop], boxes[5, start:stop]
    for k in range(number):
        overlap[k] = (low_y[k] <= hy) & (high_y[k] >= ly) & (low_z[k] <= hz) & (high_z[k] >= lz) & (x[k] <= hx)
    for k in range(number):
        close[count] = start + k
        count += overlap[k]
    return count


@part
def find_pairs(pairs: Pairs, cells: Cells, grid: Grid) -> int:
    """Write all pairs into `lower` and `upper`.

    Args:
        pairs: has the owners.
        cells: sorted, and boxes drawn.
        grid: the bins.

    Returns:
        Their number, or -1 where there is no room.
    """
    number, capacity = 0, cells.lower.shape[0]
    rows, starts, keys, order, boxes = cells.lines, cells.starts, cells.keys, cells.order, cells.boxes
    owner, close, lower, upper = pairs.owner, cells.close, cells.lower, cells.upper
    nx, ny, x0, y0, size, width = grid.columns, grid.strips, grid.x, grid.y, grid.size, grid.width
    for m in range(keys.shape[0]):
        p = order[m]
        ly, lz, hx, hy, hz = boxes[1, m], boxes[2, m], boxes[3, m], boxes[4, m], boxes[5, m]
        own, mine, skin = owner[p], keys[p] // nx, grid.bare + rows[m, SKIN]
        column, last = keys[p] - mine * nx, _bin(hx - x0, size, nx - 1)
        boxed = 0
        for strip in range(_bin(ly - grid.tallest - y0, width, ny - 1), _bin(hy - y0, width, ny - 1) + 1):
            # Of two links that begin in the same bins along x, the one in the lower strip finds the other.
            start = starts[strip * nx + column + (1 if strip >= mine else 2)]
            if strip == mine:
                start = m + 1
            boxed = _boxed(boxes, close, boxed, start, starts[strip * nx + last + 2], ly, lz, hx, hy, hz)
        hits = 0
        for k in range(boxed):
            n = close[k]
            close[hits] = n
            hits += not (off_lines(rows, m, n, skin + rows[n, SKIN]) | (owner[order[n]] == own))
        if number + hits > capacity:
            return -1
        for k in range(hits):
            n = close[k]
            q = order[n]
            lower[number], upper[number] = min(p, q), max(p, q)
            number += near_each_other(rows, m, n, skin + rows[n, SKIN], rows[m, INVERSE], rows[n, INVERSE])
    return number
