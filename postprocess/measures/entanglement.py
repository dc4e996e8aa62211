"""Find the links that pass through the planes of other smarticles.

The quadrilateral of a smarticle has the corners barb tip, hinge, hinge, barb tip; its fourth side closes the mouth. A
link of another smarticle passes through the plane of the smarticle if the link's ends lie strictly on opposite sides
of the plane and the link meets the plane strictly inside the quadrilateral. A corner in the plane, or a row of corners
in it, counts as one passage if the links that leave it go to both sides, and as none if they go to one side. A tip that
ends in the plane does not pass, and what meets an edge does not, within 1e-9 of the smarticle's size. Barbs at unequal
angles make the quadrilateral concave or self-intersecting; its inside is then where its winding number is not zero.

`polygon_crossings` counts for bodies of any shape. An open bent body spans the polygon of its corners, closed by the
straight line between its free ends, as a U, C, Z or hook does; a ring spans its own polygon. These bodies span no
polygon: a straight one, one that branches or has several pieces (a star, a cross), and one whose corners do not lie in
a plane. The average crossing number is defined for these, too.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import (
    Flags,
    Floats,
    UndefinedMeasureError,
    Vertices,
    Whole,
    bounding_spheres,
    checked_vertices,
    close_pairs,
    link_lengths,
    plane_frames,
)
from postprocess.geometry.segments import Curve, checked_segments, corner_numbers, curves, segments_of
from postprocess.measures.registry import FrameMeasure, Quantity, Shown, rigid_in_space

STRAIGHT = 0.99  #: Tip-to-tip distance over unfolded length above which a body counts as straight [-]
FLAT = 0.1  #: Largest distance of a corner from the plane of its body, over the body's radius, for a flat body [-]

_TOLERANCE = 1e-9
# Pairs of polygons and segments per block, which limits memory.
_CHUNK = 300_000


class CrossingPairs(NamedTuple):
    """P ordered pairs of smarticles (i, j), where j passes through the plane of i."""

    i: Whole  #: (P,) int64, indices of the smarticles whose plane is crossed
    j: Whole  #: (P,) int64, indices of the smarticles that pass through
    links: Whole  #: (P,) int64, number of links of j that pass through, 1 to 3


class LinkPassages(NamedTuple):
    """P crossings: a link of smarticle j that passes through the plane of smarticle i."""

    i: Whole  #: (P,) int64, indices of the smarticles whose plane is crossed
    j: Whole  #: (P,) int64, indices of the smarticles that pass through
    link: Whole  #: (P,) int64, link of j: 0 barb 1, 1 middle link, 2 barb 2
    point: Floats  #: (P, 3) [m], point at which the link meets the plane of i


@dataclass(frozen=True, kw_only=True, eq=False)
class Entanglement:
    """Crossings of all N smarticles of a frame."""

    #: (N,) int64, number of links of others through each smarticle's plane; 0 for a smarticle without a plane
    crossings: Whole = field(repr=False)
    has_plane: Flags = field(repr=False)  #: (N,) bool, False for (nearly) straight smarticles, which have no plane
    mean: float  #: ⟨N⟩, mean crossings of the smarticles that have a plane [-]; NaN if none has


@dataclass(frozen=True, kw_only=True, eq=False)
class PolygonCrossings:
    """Crossings of B bodies, and the P ordered pairs (i, j) where j passes through the polygon of i."""

    bodies: Whole = field(repr=False)  #: (B,) int64, numbers of the bodies
    #: (B,) int64, number of segments of other bodies through the body's polygon; 0 without a polygon
    crossings: Whole = field(repr=False)
    flaws: tuple[str, ...] = field(repr=False)  #: (B,) reason why a body spans no polygon; empty if it spans one
    i: Whole = field(repr=False)  #: (P,) int64, index in `bodies` of the body that is crossed
    j: Whole = field(repr=False)  #: (P,) int64, index in `bodies` of the body that passes through
    segments: Whole = field(repr=False)  #: (P,) int64, number of segments of j that pass through

    @property
    def has_polygon(self) -> Flags:
        """Whether each body spans a polygon: (B,) bool."""
        return np.array([not flaw for flaw in self.flaws], dtype=bool)

    @property
    def mean(self) -> float:
        """Mean number of crossings of the bodies that span a polygon [-]."""
        return float(self.crossings[self.has_polygon].mean())


def entanglement(vertices: Vertices) -> Entanglement:
    """Compute the crossings of all smarticles and their mean, ⟨N⟩.

    Source:
        Savoie et al., Soft Matter 2023, ⟨N⟩. Two rules differ from the paper's code: links of straight smarticles count
        where they pass through the planes of others, and a smarticle that passes with two links counts twice.
    """
    vertices = checked_vertices(vertices)
    planes, crossings = has_plane(vertices), link_crossings(vertices)
    mean = float(crossings[planes].mean()) if np.any(planes) else float("nan")
    return Entanglement(crossings=crossings, has_plane=planes, mean=mean)


def link_crossings(vertices: Vertices) -> Whole:
    """Count the links of other smarticles that pass through each smarticle's plane: (N,) int64.

    Straight smarticles have no plane and the count 0.

    Source:
        Savoie et al., Soft Matter 2023, ⟨N⟩; the docstring of this module states which links pass.

    Example:
        >>> u = np.array([[-1.0, 2, 0], [-1, 0, 0], [1, 0, 0], [1, 2, 0]])
        >>> other = np.array([[0.0, 3, -1], [0, 1, -1], [0, 1, 1], [0, 3, 1]])
        >>> link_crossings([u, other])
        array([1, 0])
    """
    vertices = checked_vertices(vertices)
    pairs = crossing_pairs(vertices)
    counts = np.zeros(len(vertices), dtype=np.int64)
    np.add.at(counts, pairs.i, pairs.links)
    return counts


def crossing_pairs(vertices: Vertices) -> CrossingPairs:
    """Find the pairs (i, j) where smarticle j passes through the plane of i, sorted by i, then j."""
    vertices = checked_vertices(vertices)
    i, j = _close_pairs(vertices, has_plane(vertices))
    links = _passing(vertices, i, j).sum(axis=1)
    kept = np.nonzero(links)[0]
    order = kept[np.lexsort((j[kept], i[kept]))]
    return CrossingPairs(i[order], j[order], links[order])


def link_passages(vertices: Vertices) -> LinkPassages:
    """Find every crossing with its position, sorted by i, then j, then link; `link_crossings` counts them."""
    vertices = checked_vertices(vertices)
    i, j = _close_pairs(vertices, has_plane(vertices))
    pair, link = np.nonzero(_passing(vertices, i, j))
    order = np.lexsort((link, j[pair], i[pair]))
    i, j, link = i[pair][order], j[pair][order], link[order]
    normal, centre = plane_frames(vertices)[i, 2], vertices[i].mean(axis=1)
    start, end = vertices[j, link], vertices[j, link + 1]
    first, last = (np.einsum("pc,pc->p", ends - centre, normal) for ends in (start, end))
    fraction = first / (first - last)
    return LinkPassages(i, j, link.astype(np.int64), start + fraction[:, None] * (end - start))


def polygon_crossings(segments: ArrayLike, body: ArrayLike) -> PolygonCrossings:
    """Count the segments of other bodies that pass through the polygon of each body.

    Args:
        segments: (M, 2, 3) both ends of all segments [m].
        body: (M,) number of the body of each segment.

    Raises:
        InputError: See `checked_segments`.
        UndefinedMeasureError: No body spans a polygon; the message has the reason for the first one.

    Source:
        Savoie et al., Soft Matter 2023, ⟨N⟩ of smarticles; here for any flat curve.

    Example:
        >>> t = 2 * np.pi * np.arange(60) / 60
        >>> ring = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
        >>> rings = np.stack([ring, ring[:, [0, 2, 1]] + [1.0, 0, 0]])
        >>> segments = np.stack([rings, np.roll(rings, -1, axis=1)], axis=2).reshape(120, 2, 3)
        >>> polygon_crossings(segments, np.repeat([0, 1], 60)).crossings
        array([1, 1])
    """
    segments, body = checked_segments(segments, body)
    found = curves(segments, body)
    flaws = tuple(polygon_flaw(one) for one in found)
    if all(flaws):
        first = f"body {found[0].body} {flaws[0]}" if found else "there is no body"
        raise UndefinedMeasureError(
            f"no body spans a polygon: {first}; the average crossing number is defined for every shape"
        )
    bodies, number = np.unique(body, return_inverse=True)
    # Ends of different bodies that meet have equal numbers of corners.
    meets = corner_numbers(segments)
    _, first, ends = np.unique(number[:, None] * len(meets) * 2 + meets, return_index=True, return_inverse=True)
    ends = ends.reshape(-1, 2)
    # Ends of one corner may differ by rounding: a plane between them would be passed by neither segment.
    segments = segments.reshape(-1, 3)[first][ends]
    middles = segments.mean(axis=1)
    half = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1) / 2
    tree, reach = cKDTree(middles), half.max()
    counts = np.zeros((0, 3), dtype=np.int64)
    # Polygons of equal numbers of corners are one array.
    for size in sorted({len(one.corners) for one, flaw in zip(found, flaws, strict=True) if not flaw}):
        owner = np.array([k for k, one in enumerate(found) if not flaws[k] and len(one.corners) == size])
        corners = np.array([found[k].corners for k in owner])
        centres, radii = bounding_spheres(corners)
        near = tree.query_ball_point(centres, radii + reach)
        polygon = np.repeat(np.arange(len(owner)), [len(one) for one in near])
        other = np.concatenate([np.array(one, dtype=np.int64) for one in near])
        apart = number[other] != owner[polygon]
        polygon, other = polygon[apart], other[apart]
        passing = _passing_segments(corners, polygon, segments[other], ends[other])
        pairs = np.stack([owner[polygon[passing]], number[other[passing]]], axis=1)
        unique, times = np.unique(pairs, axis=0, return_counts=True)
        counts = np.concatenate([counts, np.column_stack([unique.reshape(-1, 2), times])])
    i, j, passed = counts[np.lexsort((counts[:, 1], counts[:, 0]))].T
    crossings = np.bincount(i, passed, minlength=len(bodies)).astype(np.int64)
    return PolygonCrossings(bodies=bodies, crossings=crossings, flaws=flaws, i=i, j=j, segments=passed)


def has_plane(vertices: Vertices) -> Flags:
    """Return which of N smarticles are bent enough to span a plane: (N,) bool.

    A smarticle has no plane if its tips are farther apart than `STRAIGHT` times 2l + w, or if all four vertices lie on
    one line.
    """
    vertices = checked_vertices(vertices)
    unfolded = link_lengths(vertices).sum(axis=1)
    mouth = np.linalg.norm(vertices[:, 3] - vertices[:, 0], axis=1)
    spread = np.linalg.svd(vertices - vertices.mean(axis=1, keepdims=True), compute_uv=False)
    bent: Flags = (mouth <= STRAIGHT * unfolded) & (spread[:, 1] > 1e-6 * unfolded)
    return bent


def polygon_flaw(curve: Curve) -> str:
    """Return the reason why a body spans no polygon; empty if it spans one."""
    if curve.flaw:
        return curve.flaw
    corners = curve.corners
    length = float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())
    if not curve.closed and float(np.linalg.norm(corners[-1] - corners[0])) > STRAIGHT * length:
        return f"is straight: its ends are more than {STRAIGHT} of its length apart"
    centred: Floats = corners - corners.mean(axis=0)
    _, spread, axes = np.linalg.svd(centred)
    if spread[1] <= 1e-6 * length:
        return "is straight: its corners lie on one line"
    off = float(np.abs(centred @ axes[2]).max() / np.linalg.norm(centred, axis=1).max())
    return f"is not flat: a corner is {off:.2g} of its radius off its plane, above {FLAT}" if off > FLAT else ""


def _close_pairs(vertices: Floats, planes: Flags) -> tuple[Whole, Whole]:
    """Find the ordered pairs (i, j) where smarticle i has a plane through which j may pass.

    The bounding spheres of i and j overlap. `planes` (N,) marks the smarticles that have a plane. Returns the indices i
    (P,) and j (P,).
    """
    low, high = close_pairs(vertices)
    i, j = np.concatenate([low, high]), np.concatenate([high, low])
    return i[planes[i]], j[planes[i]]


def _passing(vertices: Floats, i: Whole, j: Whole) -> Flags:
    """Return which links of each j pass through the plane of its i: (P, 3) bool."""
    links = np.stack([vertices[:, :-1], vertices[:, 1:]], axis=2)
    ends = vertices.shape[1] * j[:, None, None] + np.stack([np.arange(3), np.arange(1, 4)], axis=1)
    passing = _passing_segments(vertices, np.repeat(i, 3), links[j].reshape(-1, 2, 3), ends.reshape(-1, 2))
    return passing.reshape(-1, 3)


def _passing_segments(corners: Floats, polygon: Whole, segments: Floats, ends: Whole) -> Flags:
    """Return which segments pass through a polygon: (P,) bool.

    Corners of N polygons are (N, n, 3) [m], the last one joined to the first. Segments are (P, 2, 3) [m], each compared
    with the polygon whose index is in `polygon` (P,). `ends` (P, 2) numbers the corners of the bodies at their ends.
    """
    centres, radii = bounding_spheres(corners)
    frames = plane_frames(corners)
    outlines = np.einsum("nkc,nac->nka", corners - centres[:, None], frames[:, :2])
    passing = np.zeros(len(polygon), dtype=bool)
    sides = np.zeros((len(polygon), 2), dtype=np.int8)

    def inside(points: Floats, which: Whole) -> Flags:
        """Return whether points (p, 3) [m], from the centres of polygons `which` (p,), are in them: (p,) bool."""
        flat = np.einsum("pc,pac->pa", points, frames[which, :2])
        found: Flags = _winding(flat, outlines[which], _TOLERANCE * radii[which]) != 0
        return found

    for start in range(0, len(polygon), _CHUNK):
        which = polygon[start : start + _CHUNK]
        relative = segments[start : start + _CHUNK] - centres[which, None]
        heights = np.einsum("pkc,pc->pk", relative, frames[which, 2])
        heights[np.abs(heights) <= _TOLERANCE * radii[which, None]] = 0.0
        sides[start : start + _CHUNK] = np.sign(heights)
        row = np.nonzero(heights[:, 0] * heights[:, 1] < 0)[0]
        first, last = heights[row].T
        from_, to = relative[row, 0], relative[row, 1]
        passing[start + row] = inside(from_ + (first / (first - last))[:, None] * (to - from_), which[row])
    # A segment that leaves a corner in the plane: whether it passes depends on the others that leave this corner.
    leaving = np.nonzero((sides == 0).sum(axis=1) == 1)[0]
    if len(leaving):
        end = np.argmin(np.abs(sides[leaving]), axis=1)
        points = segments[leaving, end] - centres[polygon[leaving]]
        corner = _corners_in_plane(polygon, sides, ends)[leaving, end]
        passing[leaving] = _through_corners(corner, sides[leaving].sum(axis=1), inside(points, polygon[leaving]))
    return passing


def _corners_in_plane(polygon: Whole, sides: NDArray[np.int8], ends: Whole) -> Whole:
    """Number the corners that lie in the plane of a polygon: (P, 2), equal numbers for corners joined in the plane.

    `polygon` (P,) is the polygon with which a segment is compared, `sides` (P, 2) are the signs of the heights of its
    ends above the plane, `ends` (P, 2) their corners. Only numbers of ends in the plane have a meaning.
    """
    keys = polygon[:, None] * (ends.max() + 1) + ends
    known, number = np.unique(keys, return_inverse=True)
    number = number.reshape(keys.shape)
    a, b = number[(sides == 0).all(axis=1)].T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(known), len(known)))
    found: Whole = connected_components(graph, directed=False)[1].astype(np.int64)[number]
    return found


def _through_corners(corner: Whole, side: Whole, inside: Flags) -> Flags:
    """Return which segments that leave a corner in the plane of a polygon count as its passage: (p,) bool.

    At a corner (p,) whose segments go to both sides (p,), +1 and -1, the segments to the side with fewer pass. `inside`
    (p,): whether their ends in the plane are in the polygon; a row of corners with one outside does not pass.
    """
    up, down = np.bincount(corner, side > 0), np.bincount(corner, side < 0)
    outside = np.bincount(corner, ~inside) > 0
    fewer = np.where(up <= down, 1, -1)
    passing: Flags = (side == fewer[corner]) & ~outside[corner] & (np.minimum(up, down)[corner] > 0)
    return passing


def _winding(points: Floats, corners: Floats, tolerance: Floats) -> Whole:
    """Compute the winding numbers (n,) of polygons (n, k, 2) around points (n, 2) [m].

    A point nearer to an edge than its tolerance (n,) [m] has the winding number 0.
    """
    starts = corners - points[:, None]
    ends = np.roll(starts, -1, axis=1)
    edges = ends - starts
    left = starts[..., 0] * ends[..., 1] - starts[..., 1] * ends[..., 0]
    upward = (starts[..., 1] <= 0) & (ends[..., 1] > 0) & (left > 0)
    downward = (starts[..., 1] > 0) & (ends[..., 1] <= 0) & (left < 0)
    winding = upward.sum(axis=1) - downward.sum(axis=1)
    # An edge without length (l = 0) must not divide by 0.
    squared = np.maximum((edges**2).sum(axis=2), 1e-300)
    fraction = np.clip(-(starts * edges).sum(axis=2) / squared, 0, 1)
    gaps = np.linalg.norm(starts + fraction[..., None] * edges, axis=2).min(axis=1)
    winding[gaps <= tolerance] = 0
    counts: Whole = winding.astype(np.int64)
    return counts


def frame_crossings(frame: Frame) -> tuple[Whole, Flags]:
    """Return the crossings (N,) of the bodies of a frame, and whether each one spans a polygon (N,)."""
    if frame.bars is None:
        return link_crossings(frame.vertices), has_plane(frame.vertices)
    try:
        found = polygon_crossings(*segments_of(frame))
    except UndefinedMeasureError:
        return np.zeros(frame.count, dtype=np.int64), np.zeros(frame.count, dtype=bool)
    return found.crossings, found.has_polygon


def _entanglement_of(frame: Frame, _: Run) -> tuple[float, int]:
    crossings, planes = frame_crossings(frame)
    return float(crossings[planes].mean()) if planes.any() else math.nan, int(planes.sum())


MEASURES = (
    FrameMeasure(
        name="entanglement",
        place=40,
        quantities=(
            Quantity("crossings mean", "-", Shown(heading="⟨N⟩", place=20, form=".2f")),
            Quantity("smarticles with a plane", "-"),
        ),
        take=_entanglement_of,
        available_for=rigid_in_space,
    ),
)
