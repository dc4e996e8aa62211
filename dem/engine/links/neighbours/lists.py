"""Which links are near each other: a wide list, rebuilt seldom, and a tight one inside it, which steps look at.

A list holds every pair whose axes are nearer than a diameter and both skins. Both lists are in an order that depends on
the positions alone, and the memory of a contact goes with its pair.
"""

from __future__ import annotations

from dem.engine.links.arrays import Bodies, Cells, Indices, Pairs
from dem.engine.links.compiler import inlined, part
from dem.engine.links.neighbours.search import near_each_other, off_lines, search
from dem.engine.links.neighbours.skins import mark
from dem.engine.links.shape import Shape

GOOD, FULL = 0, 1


@part
def tighten(shape: Shape, bodies: Bodies, pairs: Pairs, least: float, most: float, time: float) -> None:
    """Make the tight list from the wide one; see `mark` for the skins."""
    mark(shape, bodies, pairs.near_marks, pairs.near_centres, least, most, time)
    pairs.counts[1] = find_near(shape, bodies, pairs, pairs.near, 0, pairs.counts[0])
    pairs.counts[3] += 1


@inlined
def find_near(shape: Shape, bodies: Bodies, pairs: Pairs, near: Indices, begin: int, stop: int) -> int:
    """Write those pairs from `begin` up to `stop` that belong into the tight list into `near`, from `begin` on.

    Returns:
        Their number.
    """
    marks, first, second, used = pairs.near_marks, pairs.first, pairs.second, pairs.used
    diameter, inverses, kind = 2 * shape.radius, shape.inverses, pairs.kind
    count = begin
    # Every pair is written down, and the next one over it unless it counts: no branch, which would be mispredicted.
    for k in range(begin, stop):
        p, q = first[k], second[k]
        near[count] = k
        count += (used[k] != 0) | (not off_lines(bodies.segments, p, q, diameter + marks[p, 6] + marks[q, 6]))
    lines, count = count, begin
    for m in range(begin, lines):
        k = near[m]
        p, q = first[k], second[k]
        near[count] = k
        # Contacts stay in the list until the step in which they end has forgotten them.
        count += (used[k] != 0) | near_each_other(
            bodies.segments, p, q, diameter + marks[p, 6] + marks[q, 6], inverses[kind[p]], inverses[kind[q]]
        )
    return count - begin


@part
def build(
    shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells,
    inner: float, least: float, most: float, time: float, piece: float,
) -> int:  # fmt: skip
    """Make the wide list anew, and carry over what contacts remember.

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
    found = search(shape, bodies, pairs, cells, 2 * (shape.radius + inner), piece)
    if found < 0:
        return FULL
    _carry(pairs, cells, found)
    keep_marks(shape, pairs, cells, 0, cells.centres.shape[0])
    pairs.counts[0] = found
    pairs.counts[2] += 1
    return GOOD


@inlined
def keep_marks(shape: Shape, pairs: Pairs, cells: Cells, begin: int, stop: int) -> None:
    """Let the marks of smarticles from `begin` up to `stop` in `cells` be those of the list."""
    each = shape.kinds.shape[0] * shape.offsets.shape[0]
    for p in range(each * begin, each * stop):
        for d in range(7):
            pairs.wide_marks[p, d] = cells.marks[p, d]
    for i in range(begin, stop):
        for d in range(3):
            pairs.wide_centres[i, d] = cells.centres[i, d]


@part
def _carry(pairs: Pairs, cells: Cells, found: int) -> None:
    """Let the new list of `cells` take the place of the old one, with what contacts remember."""
    kept = take_out(pairs, cells, 0, pairs.counts[0])
    take_over(pairs, cells, 0, found)
    put_back(pairs, cells, 0, kept)


@inlined
def take_out(pairs: Pairs, cells: Cells, begin: int, stop: int) -> int:
    """Move what contacts among the pairs from `begin` up to `stop` remember into `cells`, from place `begin` on.

    Returns:
        The place after the last.
    """
    slip, used, kept = cells.slip, cells.used, begin
    for k in range(begin, stop):
        if pairs.used[k]:
            cells.lower[kept], cells.upper[kept], used[kept] = pairs.first[k], pairs.second[k], pairs.used[k]
            for slot in range(3):
                for d in range(4):
                    slip[kept, slot, d] = pairs.slip[k, slot, d]
                    pairs.slip[k, slot, d] = 0.0
            pairs.used[k] = 0
            kept += 1
    return kept


@inlined
def take_over(pairs: Pairs, cells: Cells, begin: int, stop: int) -> None:
    """Let the new pairs from `begin` up to `stop` take the place of the old ones, without memory."""
    for k in range(begin, stop):
        pairs.first[k], pairs.second[k], pairs.used[k] = cells.first[k], cells.second[k], 0


@inlined
def put_back(pairs: Pairs, cells: Cells, begin: int, stop: int) -> None:
    """Give back what was taken out at places from `begin` up to `stop`."""
    rows, slip, used = cells.rows, cells.slip, cells.used
    for k in range(begin, stop):
        row, q = cells.places[cells.lower[k]], cells.upper[k]
        for m in range(rows[row], rows[row + 1]):
            if pairs.second[m] == q:
                pairs.used[m] = used[k]
                for slot in range(3):
                    for d in range(4):
                        pairs.slip[m, slot, d] = slip[k, slot, d]
                break
