"""The lists of neighbours, made by several threads; the same lists in the same order as one thread makes.

Every function here is called by all threads at once, each with its number `mine`; between two barriers no thread writes
what another one reads.
"""

from __future__ import annotations

from dem.engine.links.arrays import Array, Bodies, Cells, Pairs
from dem.engine.links.compiler import part
from dem.engine.links.neighbours.lists import FULL, GOOD, find_near, keep_marks, put_back, take_out, take_over
from dem.engine.links.neighbours.search import (
    Grid,
    begin_rows,
    corners,
    draw_boxes,
    find_bins,
    find_pairs,
    grid_over,
    put_in_row,
    sort_bins,
)
from dem.engine.links.neighbours.skins import mark_centres, mark_links, moved_beyond, moves
from dem.engine.links.shape import Shape
from dem.engine.links.stepping import NEAR_LEAST, NEAR_MOST, NEAR_TIME, STRIP, WIDE_LEAST, WIDE_MOST, WIDE_TIME
from dem.engine.links.team.barrier import wait
from dem.engine.links.team.shared import NEAR, Shared, share

CORNERS = 3  # from this place on in `sums`; sums proper come before


@part
def look_together(
    mine: int, threads: int, shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells, skins: Array, shared: Shared
) -> int:
    """See `dem.engine.links.stepping.look_for_neighbours`; all smarticles are posed when it returns."""
    near, wide = (pairs.near_marks, pairs.near_centres), (pairs.wide_marks, pairs.wide_centres)
    if not _moved(mine, threads, shape, bodies, near[0], near[1], shared):
        return GOOD
    if _moved(mine, threads, shape, bodies, wide[0], wide[1], shared):
        if _build(mine, threads, shape, bodies, pairs, cells, skins, shared) == FULL:
            return FULL
    _tighten(mine, threads, shape, bodies, pairs, cells, skins, shared)
    return GOOD


@part
def _moved(mine: int, threads: int, shape: Shape, bodies: Bodies, marks: Array, centres: Array, shared: Shared) -> bool:
    """See `dem.engine.links.neighbours.skins.moved`."""
    n, each = bodies.position.shape[0], shape.kinds.shape[0] * shape.offsets.shape[0]
    begin, stop = share(n, mine, threads)
    x, y, z = moves(bodies, centres, begin, stop)
    x, y, z = _mean(mine, threads, shared, x, y, z, n)
    shared.tally[mine, NEAR] = moved_beyond(bodies, marks, x, y, z, each * begin, each * stop)
    wait(shared.gate, threads)
    beyond = 0
    for t in range(threads):
        beyond |= shared.tally[t, NEAR]
    return beyond != 0


@part
def _mean(mine: int, threads: int, shared: Shared, x: float, y: float, z: float, n: int) -> tuple[float, float, float]:
    """The sums of all threads over n; a barrier."""
    sums = shared.sums
    sums[mine, 0], sums[mine, 1], sums[mine, 2] = x, y, z
    wait(shared.gate, threads)
    x, y, z = 0.0, 0.0, 0.0
    for t in range(threads):
        x, y, z = x + sums[t, 0], y + sums[t, 1], z + sums[t, 2]
    return x / n, y / n, z / n


@part
def _tighten(
    mine: int, threads: int, shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells, skins: Array, shared: Shared
) -> None:
    """See `dem.engine.links.neighbours.lists.tighten`."""
    n = bodies.position.shape[0]
    begin, stop = share(n, mine, threads)
    x, y, z = mark_centres(bodies, pairs.near_centres, begin, stop)
    x, y, z = _mean(mine, threads, shared, x, y, z, n)
    mark_links(
        shape, bodies, pairs.near_marks, skins[NEAR_LEAST], skins[NEAR_MOST], skins[NEAR_TIME], x, y, z, begin, stop
    )
    wait(shared.gate, threads)
    begin, stop = share(pairs.counts[0], mine, threads)
    count = find_near(shape, bodies, pairs, cells.lower, begin, stop)
    shared.tally[mine, NEAR] = count
    wait(shared.gate, threads)
    place, total = 0, 0
    for t in range(threads):
        place += shared.tally[t, NEAR] if t < mine else 0
        total += shared.tally[t, NEAR]
    for k in range(count):
        pairs.near[place + k] = cells.lower[begin + k]
    if mine == 0:
        pairs.counts[1] = total
        pairs.counts[3] += 1
    wait(shared.gate, threads)


@part
def _build(
    mine: int, threads: int, shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells, skins: Array, shared: Shared
) -> int:
    """See `dem.engine.links.neighbours.lists.build`."""
    n, each = bodies.position.shape[0], shape.kinds.shape[0] * shape.offsets.shape[0]
    begin, stop = share(n, mine, threads)
    x, y, z = mark_centres(bodies, cells.centres, begin, stop)
    x, y, z = _mean(mine, threads, shared, x, y, z, n)
    mark_links(shape, bodies, cells.marks, skins[WIDE_LEAST], skins[WIDE_MOST], skins[WIDE_TIME], x, y, z, begin, stop)
    grid = _grid(mine, threads, cells, 2 * (shape.radius + skins[NEAR_MOST]), skins[STRIP], each, begin, stop, shared)
    find_bins(cells, grid, each * begin, each * stop)
    wait(shared.gate, threads)
    if mine == 0:
        sort_bins(cells, grid)
    wait(shared.gate, threads)
    draw_boxes(shape, bodies, pairs, cells, grid, each * begin, each * stop)
    wait(shared.gate, threads)
    room, limit = share(cells.lower.shape[0], mine, threads)
    shared.tally[mine, NEAR] = find_pairs(pairs, cells, grid, each * begin, each * stop, room, limit)
    wait(shared.gate, threads)
    found = 0
    for t in range(threads):
        if shared.tally[t, NEAR] < 0:
            return FULL
        room, limit = share(cells.lower.shape[0], t, threads)
        found += shared.tally[t, NEAR] - room
    _sort_rows(mine, threads, cells, each * begin, each * stop, shared)
    old, old_stop = share(pairs.counts[0], mine, threads)
    kept = take_out(pairs, cells, old, old_stop)
    wait(shared.gate, threads)
    room, limit = share(found, mine, threads)
    take_over(pairs, cells, room, limit)
    keep_marks(shape, pairs, cells, begin, stop)
    wait(shared.gate, threads)
    put_back(pairs, cells, old, kept)
    if mine == 0:
        pairs.counts[0] = found
        pairs.counts[2] += 1
    wait(shared.gate, threads)
    return GOOD


@part
def _grid(
    mine: int, threads: int, cells: Cells, bare: float, piece: float, each: int, begin: int, stop: int, shared: Shared
) -> Grid:
    """The bins over all links; a barrier."""
    sums = shared.sums
    x0, x1, y0, y1, tallest = corners(cells.marks, bare, each * begin, each * stop)
    sums[mine, CORNERS], sums[mine, CORNERS + 1], sums[mine, CORNERS + 2] = x0, x1, y0
    sums[mine, CORNERS + 3], sums[mine, CORNERS + 4] = y1, tallest
    wait(shared.gate, threads)
    for t in range(threads):
        x0, x1 = min(x0, sums[t, CORNERS]), max(x1, sums[t, CORNERS + 1])
        y0, y1 = min(y0, sums[t, CORNERS + 2]), max(y1, sums[t, CORNERS + 3])
        tallest = max(tallest, sums[t, CORNERS + 4])
    return grid_over(x0, x1, y0, y1, tallest, bare, piece, cells.starts.shape[0] - 2)


@part
def _sort_rows(mine: int, threads: int, cells: Cells, begin: int, stop: int, shared: Shared) -> None:
    """Put all pairs that were found into rows; each thread sees to those from `begin` up to `stop`."""
    rows, lower, capacity = cells.rows, cells.lower, cells.lower.shape[0]
    if mine == 0:
        rows[0] = rows[1] = 0
    for row in range(begin, stop):
        rows[row + 2] = 0
    for t in range(threads):
        room, _ = share(capacity, t, threads)
        for k in range(room, shared.tally[t, NEAR]):
            row = cells.places[lower[k]]
            if begin <= row < stop:
                rows[row + 2] += 1
    wait(shared.gate, threads)
    if mine == 0:
        begin_rows(cells)
    wait(shared.gate, threads)
    for t in range(threads):
        room, _ = share(capacity, t, threads)
        for k in range(room, shared.tally[t, NEAR]):
            if begin <= cells.places[lower[k]] < stop:
                put_in_row(cells, k)
    wait(shared.gate, threads)
