"""Find all pairs of segments that are nearer to each other than a limit.

The limit is the sum of both radii, both skins (distances by which segments may move until the next search) and a
constant distance, the bare reach. First near links are found, then their strands, which are segments side by side. A
link counts as one segment in the middle of its strands, with a radius that encloses them.

Every link has a box about all its segments, enlarged by their radii, their skins and half the bare reach. Boxes are
sorted by their lower corners into strips along y and, within a strip, into short bins along x. All boxes that can
overlap a given box then lie in a few contiguous ranges of memory, from the bin of its lower corner to the bin of its
upper corner. Boxes and middles are copied in this order.

Up to `FEW` segments, the list of pairs is in the order of the segments' numbers. More segments do not fit into a
processor's cache; their list is in the order of the bins, so that a step reads near segments one after the other.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from dem.engine.links.arrays import Array, Cells, Indices, Segments
from dem.engine.links.compiler import inlined, part
from dem.engine.links.shapes import INVERSE, LINE, RADIUS
from dem.engine.links.vectors import add, between, cross, dot, lines, nearest, put, scale, sub, vector

FEW = 3000  # segments; up to so many the list is in the order of their numbers
SKIN = LINE  # place in a row of `Cells.lines`


class Grid(NamedTuple):
    """Strips along y, divided into bins along x."""

    bare: float  #: Bare reach of a pair: distance that is added to radii and skins [m]
    x: float  #: Lower end of the bins along x [m]
    y: float  #: Lower end of the strips along y [m]
    tallest: float  #: Largest extent of a box along y [m]
    size: float  #: Size of a bin along x [m]
    width: float  #: Width of a strip along y [m]
    columns: int  #: Number of bins of a strip
    strips: int  #: Number of strips


@inlined
def off_lines(line: Array, p: int, q: int, reach: float) -> bool:
    """Return whether the infinite lines through two axes are farther apart than `reach` [m].

    The axes are those of the segments in the rows p and q of `line` (…, LINE).
    """
    one, other = line[p], line[q]
    normal = cross(vector(one, 3), vector(other, 3))
    across = dot(sub(vector(one, 0), vector(other, 0)), normal)
    return bool(across * across > reach * reach * dot(normal, normal))


@inlined
def near_each_other(line: Array, p: int, q: int, reach: float) -> bool:
    """Return whether the axes of the segments in the rows p and q of `line` are nearer than `reach` [m]."""
    both = lines(line[p], line[q])
    s, t = nearest(both)
    gap = between(both, s, t)
    return bool(dot(gap, gap) < reach * reach)


@inlined
def _cannot_touch(bends: Any, p: int, q: int) -> bool:
    """Return whether two segments p and q of one body can never touch.

    These are all segments of a rigid body, and segments of a filament with near numbers, see `Bends.apart`.
    """
    if bends is None:
        return True
    return bool((bends.apart[p] == 0) | (abs(p - q) < bends.apart[p]))


@part
def search(segments: Segments, cells: Cells, bare: float, piece: float) -> int:
    """Write all near pairs into `cells.first` and `cells.second`, grouped by the first segment.

    Args:
        segments: positions of segments, and the link and body of each.
        cells: `marks` must be filled; the rest is written.
        bare: distance that is added to radii and skins of a pair [m].
        piece: width of a strip [m].

    Returns:
        Number of pairs, or -1 if there is no room for all.
    """
    count = cells.marks.shape[0]
    find_boxes(segments, cells, bare)
    grid = grid_over(cells, bare, piece)
    sort_bins(cells, grid)
    copy_by_bin(segments, cells)
    number = find_pairs(segments, cells, grid)
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
    """Return the number of the bin that contains a coordinate, from 0 to `last`; NaN gives 0.

    Args:
        offset: the coordinate, from the lower end of the first bin [m].
        size: size of a bin [m].
        last: number of the last bin, which contains all larger coordinates.
    """
    return int(min(offset / size, float(last))) if offset > 0.0 else 0


@inlined
def find_boxes(segments: Segments, cells: Cells, bare: float) -> None:
    """Write the boxes of all links, enlarged by radii, skins and half the bare reach, into `cells.own`."""
    for link in range(cells.keys.shape[0]):
        box = cells.own[link]
        for d in range(3):
            box[d], box[3 + d] = math.inf, -math.inf
        for p in range(segments.first[link], segments.first[link + 1]):
            mark, more = cells.marks[p], 0.5 * bare + segments.line[p, RADIUS] + cells.marks[p, 6]
            for d in range(3):
                box[d] = min(box[d], min(mark[d], mark[3 + d]) - more)
                box[3 + d] = max(box[3 + d], max(mark[d], mark[3 + d]) + more)


@inlined
def grid_over(cells: Cells, bare: float, piece: float) -> Grid:
    """Return strips and bins for the boxes of all links, which must be in `cells.own`.

    Args:
        bare: bare reach, which the grid stores [m].
        piece: width of a strip [m]; bins are a quarter of it long.
    """
    x0, y0, x1, y1, tallest = math.inf, math.inf, -math.inf, -math.inf, 0.0
    for link in range(cells.keys.shape[0]):
        box = cells.own[link]
        x0, x1 = min(x0, box[0]), max(x1, box[0])
        y0, y1, tallest = min(y0, box[1]), max(y1, box[1]), max(tallest, box[4] - box[1])
    room = cells.starts.shape[0] - 2
    ny = 1 + _bin(y1 - y0, piece, int(math.sqrt(room)) - 1)
    nx = 1 + _bin(x1 - x0, 0.25 * piece, room // ny - 1)
    # As wide as need be: of links that are far away, the last strips and bins have all.
    return Grid(bare, x0, y0, tallest, 0.25 * piece, piece, nx, ny)


@inlined
def sort_bins(cells: Cells, grid: Grid) -> None:
    """Sort links into bins; `keys`, `order` and `starts` of `cells` are written."""
    keys, starts, order = cells.keys, cells.starts, cells.order
    count, total = keys.shape[0], grid.columns * grid.strips
    for link in range(count):
        x, y = cells.own[link, 0], cells.own[link, 1]
        strip = _bin(y - grid.y, grid.width, grid.strips - 1)
        keys[link] = strip * grid.columns + _bin(x - grid.x, grid.size, grid.columns - 1)
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
def copy_by_bin(segments: Segments, cells: Cells) -> None:
    """Copy boxes and middles of links in the order of the bins, and number the groups of pairs.

    A group has all pairs with the same first segment. The fields `boxes`, `lines` and `places` of `cells` are written.
    """
    line, few, n = segments.line, cells.marks.shape[0] <= FEW, 0
    for m in range(cells.keys.shape[0]):
        link = cells.order[m]
        for d in range(6):
            cells.boxes[d, m] = cells.own[link, d]
        p, last, skin = segments.first[link], segments.first[link + 1] - 1, 0.0
        for q in range(p, last + 1):
            cells.places[q], skin = q if few else n, max(skin, cells.marks[q, 6])
            n += 1
        middle, across = cells.lines[m], sub(vector(line[last], 0), vector(line[p], 0))
        put(middle, 0, scale(0.5, add(vector(line[p], 0), vector(line[last], 0))))
        put(middle, 3, vector(line[p], 3))
        middle[INVERSE], middle[RADIUS] = line[p, INVERSE], line[p, RADIUS] + 0.5 * math.sqrt(dot(across, across))
        middle[SKIN] = skin


@inlined
def _boxed(
    boxes: Array, close: Indices, count: int, start: int, stop: int,
    ly: float, lz: float, hx: float, hy: float, hz: float,
) -> int:  # fmt: skip
    """Append to `close` those indices from `start` to `stop` - 1 whose boxes may overlap a given box.

    The given box's lower x is not compared: the boxes begin in its bin or in later bins. The first loop is vectorised
    by the compiler. In the second loop every index is written, and overwritten by the next one if its box does not
    overlap, so that no branch is needed.

    Args:
        boxes: (6, L) lower x, y, z and upper x, y, z of all boxes [m].
        close: indices in the first half; the second half is scratch.
        count: number of indices in `close` before.
        start: first index to try.
        stop: last index to try, plus one.
        ly: lower y of the given box [m].
        lz: lower z of the given box [m].
        hx: upper x of the given box [m].
        hy: upper y of the given box [m].
        hz: upper z of the given box [m].

    Returns:
        New number of indices in `close`.
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
def find_pairs(segments: Segments, cells: Cells, grid: Grid) -> int:
    """Write all near pairs of segments that can touch into `cells.lower` and `cells.upper`.

    Args:
        segments: the segments, with their links and bodies.
        cells: links sorted into bins, with boxes and middles from `copy_by_bin`.
        grid: the bins.

    Returns:
        Number of pairs, or -1 if there is no room for all.
    """
    number, capacity, line, first, marks = 0, cells.lower.shape[0], segments.line, segments.first, cells.marks
    rows, starts, keys, boxes, order = cells.lines, cells.starts, cells.keys, cells.boxes, cells.order
    close, lower, upper = cells.close, cells.lower, cells.upper
    nx, ny, x0, y0, size, width = grid.columns, grid.strips, grid.x, grid.y, grid.size, grid.width
    for m in range(keys.shape[0]):
        ly, lz, hx, hy, hz = boxes[1, m], boxes[2, m], boxes[3, m], boxes[4, m], boxes[5, m]
        link = order[m]
        key, p0 = keys[link], first[link]
        own, mine = segments.body[p0], key // nx
        column, last = key - mine * nx, _bin(hx - x0, size, nx - 1)
        boxed, hits = 0, 0
        for strip in range(_bin(ly - grid.tallest - y0, width, ny - 1), _bin(hy - y0, width, ny - 1) + 1):
            # Of two links that begin in the same bins along x, the one in the lower strip finds the other.
            start = starts[strip * nx + column + (1 if strip >= mine else 2)]
            if strip == mine:
                start = m + 1
            boxed = _boxed(boxes, close, boxed, start, starts[strip * nx + last + 2], ly, lz, hx, hy, hz)
        skin = grid.bare + rows[m, RADIUS] + rows[m, SKIN]
        for k in range(boxed):
            b = close[k]
            close[hits] = b
            q = first[order[b]]
            hits += not (
                off_lines(rows, m, b, skin + rows[b, RADIUS] + rows[b, SKIN])
                | ((segments.body[q] == own) & _cannot_touch(segments.bends, p0, q))
            )
        for k in range(hits):
            b = close[k]
            i, j = min(link, order[b]), max(link, order[b])
            strands = (first[i + 1] - first[i]) * (first[j + 1] - first[j])
            if number + strands > capacity:
                return -1
            lower[number], upper[number] = first[i], first[j]
            near = near_each_other(rows, m, b, skin + rows[b, RADIUS] + rows[b, SKIN])
            if strands == 1:
                number += near
            elif near:
                for p in range(first[i], first[i + 1]):
                    for q in range(first[j], first[j + 1]):
                        lower[number], upper[number] = p, q
                        reach = grid.bare + line[p, RADIUS] + marks[p, 6] + line[q, RADIUS] + marks[q, 6]
                        number += near_each_other(line, p, q, reach)
    return number
