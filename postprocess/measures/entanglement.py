"""Find the links that pass through the planes of other smarticles.

The quadrilateral of a smarticle has the corners barb tip, hinge, hinge, barb tip; its fourth side closes the mouth. A
link of another smarticle passes through the plane of the smarticle if the link's ends lie strictly on opposite sides
of the plane and the link meets the plane strictly inside the quadrilateral. A link that ends in the plane, lies in the
plane, or meets an edge does not pass, within 1e-9 of the smarticle's size. Barbs at unequal angles make the
quadrilateral concave or self-intersecting; its inside is then where its winding number is not zero.
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
# Pairs of smarticles per block, which limits memory.
_CHUNK = 100_000


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
    """Count the links of others through each smarticle's plane: (N,) int64; 0 for straight smarticles.

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


def _close_pairs(vertices: Floats, planes: Flags) -> tuple[Whole, Whole]:
    """Find ordered pairs (i, j) of smarticles whose bounding spheres overlap and whose i has a plane."""
    low, high = close_pairs(vertices)
    i, j = np.concatenate([low, high]), np.concatenate([high, low])
    return i[planes[i]], j[planes[i]]


def _passing(vertices: Floats, i: Whole, j: Whole) -> Flags:
    """Return which links of each j pass through the plane of its i: (P, 3) bool."""
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
        first, last = heights[row, link], heights[row, link + 1]
        from_, to = relative[row, link], relative[row, link + 1]
        hits = from_ + (first / (first - last))[:, None] * (to - from_)
        flat = np.einsum("pc,pac->pa", hits, frames[a[row], :2])
        passing[start + row, link] = _winding(flat, corners[a[row]], _TOLERANCE * radii[a[row]]) != 0
    return passing


def _winding(points: Floats, corners: Floats, tolerance: Floats) -> Whole:
    """Compute the winding numbers (n,) of quadrilaterals (n, 4, 2) around points (n, 2) [m].

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
