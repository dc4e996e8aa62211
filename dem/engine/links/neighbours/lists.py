"""Lists of near segments: a wide list, rebuilt seldom, and within it a tight list, which steps read.

A list holds every pair of segments whose axes are nearer than the sum of their radii and skins. The order of both lists
depends on positions only. The memory of a contact stays with its pair when a list is rebuilt.
"""

from __future__ import annotations

from dem.engine.links.arrays import Array, Bodies, Cells, Pairs, Segments
from dem.engine.links.compiler import inlined, kernel, part
from dem.engine.links.neighbours.search import near_each_other, off_lines, search
from dem.engine.links.neighbours.skins import mark, moved
from dem.engine.links.shapes import RADIUS

GOOD, FULL = 0, 1
NEAR_LEAST, NEAR_MOST, NEAR_TIME, WIDE_LEAST, WIDE_MOST, WIDE_TIME, STRIP = range(7)  # places in `skins`


@part
def update_lists(bodies: Bodies, segments: Segments, pairs: Pairs, cells: Cells, skins: Array) -> int:
    """Rebuild the lists that are no longer valid because links have moved too far.

    Args:
        cells: scratch of the search; its length sets the largest number of pairs.
        skins: (7,) limits of skins, the distances by which segments may move before a list is rebuilt. 0 to 2, for the
            tight list: thinnest skin [m], thickest skin [m], time that a skin should last [s]. 3 to 5: the same for the
            wide list. 6: width of a strip of the search [m].

    Returns:
        GOOD, or FULL if there is no room for all pairs.
    """
    if not moved(bodies, segments, pairs.near_marks, pairs.near_centres):
        return GOOD
    if (
        moved(bodies, segments, pairs.wide_marks, pairs.wide_centres)
        and build(bodies, segments, pairs, cells, skins) == FULL
    ):
        return FULL
    _tighten(bodies, segments, pairs, skins)
    return GOOD


@part
def _tighten(bodies: Bodies, segments: Segments, pairs: Pairs, skins: Array) -> None:
    """Rebuild the tight list from the wide list; for `skins` see `update_lists`."""
    mark(bodies, segments, pairs.near_marks, pairs.near_centres, skins[NEAR_LEAST], skins[NEAR_MOST], skins[NEAR_TIME])
    marks, first, second, used, near = pairs.near_marks, pairs.first, pairs.second, pairs.used, pairs.near
    line, count = segments.line, 0
    # Every pair is written down, and the next one over it unless it counts: no branch, which would be mispredicted.
    for k in range(pairs.counts[0]):
        p, q = first[k], second[k]
        near[count] = k
        reach = line[p, RADIUS] + line[q, RADIUS] + marks[p, 6] + marks[q, 6]
        count += (used[k] != 0) | (not off_lines(line, p, q, reach))
    candidates, count = count, 0
    for m in range(candidates):
        k = near[m]
        p, q = first[k], second[k]
        near[count] = k
        reach = line[p, RADIUS] + line[q, RADIUS] + marks[p, 6] + marks[q, 6]
        # Contacts stay in the list until the step in which they end has forgotten them.
        count += (used[k] != 0) | near_each_other(line, p, q, reach)
    pairs.counts[1] = count
    pairs.counts[3] += 1


@part
def build(bodies: Bodies, segments: Segments, pairs: Pairs, cells: Cells, skins: Array) -> int:
    """Rebuild the wide list, and keep the memory of contacts.

    Args:
        pairs: the lists; fields of the tight list are not written.
        cells: scratch of the search; its length sets the largest number of pairs.
        skins: (7,) see `update_lists`.

    Returns:
        GOOD, or FULL if there is no room for all pairs; the wide list is then unchanged.
    """
    mark(bodies, segments, cells.marks, cells.centres, skins[WIDE_LEAST], skins[WIDE_MOST], skins[WIDE_TIME])
    # The tight list is good for less than its thickest skin, which the wide one leaves room for.
    found = search(segments, cells, 2 * skins[NEAR_MOST], skins[STRIP])
    if found < 0:
        return FULL
    _replace(pairs, cells, found)
    _copy(pairs.wide_marks, cells.marks)
    _copy(pairs.wide_centres, cells.centres)
    pairs.counts[0] = found
    pairs.counts[2] += 1
    return GOOD


@kernel
def build_from_python(bodies: Bodies, segments: Segments, pairs: Pairs, cells: Cells, skins: Array) -> int:
    """Rebuild the wide list; for arguments and result see `build`."""
    return build(bodies, segments, pairs, cells, skins)


@inlined
def _copy(to: Array, source: Array) -> None:
    for k in range(source.shape[0]):
        for d in range(source.shape[1]):
            to[k, d] = source[k, d]


@part
def _replace(pairs: Pairs, cells: Cells, found: int) -> None:
    """Replace the wide list by the first `found` pairs in `cells`, and keep the memory of contacts."""
    kept = 0
    for k in range(pairs.counts[0]):
        if pairs.used[k]:
            cells.lower[kept], cells.upper[kept], cells.used[kept] = pairs.first[k], pairs.second[k], pairs.used[k]
            _move(cells.slip, kept, pairs.slip, k)
            pairs.used[k] = 0
            kept += 1
    for k in range(found):
        pairs.first[k], pairs.second[k], pairs.used[k] = cells.first[k], cells.second[k], 0
    for k in range(kept):
        row, q = cells.places[cells.lower[k]], cells.upper[k]
        for m in range(cells.rows[row], cells.rows[row + 1]):
            if pairs.second[m] == q:
                pairs.used[m] = cells.used[k]
                _move(pairs.slip, m, cells.slip, k)
                break


@inlined
def _move(to: Array, m: int, source: Array, k: int) -> None:
    for slot in range(source.shape[1]):
        for d in range(4):
            to[m, slot, d] = source[k, slot, d]
            source[k, slot, d] = 0.0
