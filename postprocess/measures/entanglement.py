"""Find which links pass through which smarticles.

The plane of smarticle A is its quadrilateral barb tip, hinge, hinge, barb tip, closed across the mouth. A link of
another smarticle B passes through it if its ends lie strictly on the two sides of the plane and it meets the plane
strictly inside the quadrilateral. Touching is not passing: a link that ends in the plane, lies in it, or meets an edge
of the quadrilateral does not count, to within 1e-9 of A's size. Barbs at unequal angles make the quadrilateral concave
or cross itself; inside is then what its outline winds around.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import (
    Flags,
    Floats,
    Vertices,
    Whole,
    bounding_spheres,
    checked_vertices,
    close_pairs,
    link_lengths,
    plane_frames,
)
from postprocess.measures.registry import FrameMeasure, Quantity, Shown, in_space

STRAIGHT = 0.99  #: Tip-to-tip distance over unfolded length above which a smarticle counts as straight [-]

_TOLERANCE = 1e-9
# Pairs of smarticles held in memory at a time.
_CHUNK = 100_000


class CrossingPairs(NamedTuple):
    """Pairs of smarticles of which one passes through the other; the edges of a directed graph."""

    i: Whole  #: (P,) int64, the smarticle passed through
    j: Whole  #: (P,) int64, the smarticle that passes
    links: Whole  #: (P,) int64, how many of j's links pass, 1 to 3


class LinkPassages(NamedTuple):
    """Links that pass through smarticles, one by one."""

    i: Whole  #: (P,) int64, the smarticle passed through
    j: Whole  #: (P,) int64, the smarticle that passes
    link: Whole  #: (P,) int64, which of j's links: 0 barb 1, 1 middle, 2 barb 2
    point: Floats  #: (P, 3) [m], where it meets the plane of i


@dataclass(frozen=True, kw_only=True, eq=False)
class Entanglement:
    """Crossings of all smarticles of a frame."""

    #: (N,) int64, links of others through each smarticle's plane; 0 without a plane
    crossings: Whole = field(repr=False)
    has_plane: Flags = field(repr=False)  #: (N,) bool, False for (nearly) straight smarticles, which have no plane
    mean: float  #: Mean over the smarticles that have a plane [-]; NaN if none has


def entanglement(vertices: Vertices) -> Entanglement:
    """Compute the crossings of all smarticles and their mean, ⟨N⟩.

    Source:
        Savoie et al., Soft Matter 2023, ⟨N⟩. Unlike in that paper's own code, straight smarticles are skipped as A
        only, and a smarticle that passes twice counts twice.
    """
    vertices = checked_vertices(vertices)
    planes, crossings = has_plane(vertices), link_crossings(vertices)
    mean = float(crossings[planes].mean()) if np.any(planes) else float("nan")
    return Entanglement(crossings=crossings, has_plane=planes, mean=mean)


def link_crossings(vertices: Vertices) -> Whole:
    """Count the links of other smarticles through each smarticle's plane: (N,); 0 for straight ones.

    Source:
        Savoie et al., Soft Matter 2023, ⟨N⟩; the module's docstring has the rule at the boundary.

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
    """Find the pairs behind `link_crossings`, for graphs of entanglement, sorted by i, then j."""
    vertices = checked_vertices(vertices)
    i, j = _close_pairs(vertices, has_plane(vertices))
    links = _passing(vertices, i, j).sum(axis=1)
    kept = np.nonzero(links)[0]
    order = kept[np.lexsort((j[kept], i[kept]))]
    return CrossingPairs(i[order], j[order], links[order])


def link_passages(vertices: Vertices) -> LinkPassages:
    """Find the passages that `link_crossings` counts, each with its place, sorted by i, then j, then link."""
    vertices = checked_vertices(vertices)
    i, j = _close_pairs(vertices, has_plane(vertices))
    pair, link = np.nonzero(_passing(vertices, i, j))
    order = np.lexsort((link, j[pair], i[pair]))
    i, j, link = i[pair][order], j[pair][order], link[order]
    normal, centre = plane_frames(vertices)[i, 2], vertices[i].mean(axis=1)
    start, end = vertices[j, link], vertices[j, link + 1]
    below, above = (np.einsum("pc,pc->p", ends - centre, normal) for ends in (start, end))
    share = below / (below - above)
    return LinkPassages(i, j, link.astype(np.int64), start + share[:, None] * (end - start))


def has_plane(vertices: Vertices) -> Flags:
    """Find smarticles (N,) that are bent enough to span a plane.

    Others have tips further apart than 0.99 (2l + w), or all four vertices on one line.
    """
    vertices = checked_vertices(vertices)
    unfolded = link_lengths(vertices).sum(axis=1)
    mouth = np.linalg.norm(vertices[:, 3] - vertices[:, 0], axis=1)
    spread = np.linalg.svd(vertices - vertices.mean(axis=1, keepdims=True), compute_uv=False)
    bent: Flags = (mouth <= STRAIGHT * unfolded) & (spread[:, 1] > 1e-6 * unfolded)
    return bent


def _close_pairs(vertices: Floats, planes: Flags) -> tuple[Whole, Whole]:
    """Find ordered pairs (i with a plane, j) whose bounding spheres overlap."""
    low, high = close_pairs(vertices)
    i, j = np.concatenate([low, high]), np.concatenate([high, low])
    return i[planes[i]], j[planes[i]]


def _passing(vertices: Floats, i: Whole, j: Whole) -> Flags:
    """Find which links of j pass through i: (P, 3)."""
    centres, radii = bounding_spheres(vertices)
    frames = plane_frames(vertices)
    corners = np.einsum("nkc,nac->nka", vertices - centres[:, None], frames[:, :2])
    passing = np.zeros((len(i), 3), dtype=bool)
    for start in range(0, len(i), _CHUNK):
        a, b = i[start : start + _CHUNK], j[start : start + _CHUNK]
        relative = vertices[b] - centres[a, None]
        heights = np.einsum("pkc,pc->pk", relative, frames[a, 2])
        heights[np.abs(heights) <= _TOLERANCE * radii[a, None]] = 0.0
        row, link = np.nonzero(heights[:, :-1] * heights[:, 1:] < 0)
        below, above = heights[row, link], heights[row, link + 1]
        from_, to = relative[row, link], relative[row, link + 1]
        hits = from_ + (below / (below - above))[:, None] * (to - from_)
        flat = np.einsum("pc,pac->pa", hits, frames[a[row], :2])
        passing[start + row, link] = _winding(flat, corners[a[row]], _TOLERANCE * radii[a[row]]) != 0
    return passing


def _winding(points: Floats, corners: Floats, tolerance: Floats) -> Whole:
    """Count how often outlines with corners (n, 4, 2) wind around points (n, 2) [m]; 0 as near an edge as (n,) [m]."""
    starts = corners - points[:, None]
    ends = np.roll(starts, -1, axis=1)
    edges = ends - starts
    left = starts[..., 0] * ends[..., 1] - starts[..., 1] * ends[..., 0]
    upward = (starts[..., 1] <= 0) & (ends[..., 1] > 0) & (left > 0)
    downward = (starts[..., 1] > 0) & (ends[..., 1] <= 0) & (left < 0)
    winding = upward.sum(axis=1) - downward.sum(axis=1)
    # Nearest point of each edge; an edge of no length (l = 0) is its starting point.
    squared = np.maximum((edges**2).sum(axis=2), 1e-300)
    share = np.clip(-(starts * edges).sum(axis=2) / squared, 0, 1)
    gaps = np.linalg.norm(starts + share[..., None] * edges, axis=2).min(axis=1)
    winding[gaps <= tolerance] = 0
    counts: Whole = winding.astype(np.int64)
    return counts


def _entanglement_of(frame: Frame, _: Run) -> tuple[float, int]:
    tangle = entanglement(frame.vertices)
    return tangle.mean, int(tangle.has_plane.sum())


MEASURES = (
    FrameMeasure(
        name="entanglement",
        place=40,
        quantities=(
            Quantity("crossings mean", "-", Shown(heading="⟨N⟩", place=20, form=".2f")),
            Quantity("planes", "-"),
        ),
        take=_entanglement_of,
        available_for=in_space,
    ),
)
