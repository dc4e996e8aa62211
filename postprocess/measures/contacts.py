"""Which smarticles lie close to each other, from their vertices alone."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from dem.errors import InputError
from postprocess.geometry.links import checked_vertices, link_lengths
from postprocess.measures.registry import FrameMeasure, Quantity

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Pairs of links held in memory at a time.
_CHUNK = 200_000


class ContactPairs(NamedTuple):
    """Pairs of smarticles whose centrelines come close; the edges of a contact graph.

    Attributes:
        i: (P,) int64, the lower index.
        j: (P,) int64, the higher index.
        distance: (P,) float64 [m], the least distance of their centrelines.
    """

    i: NDArray[np.int64]
    j: NDArray[np.int64]
    distance: NDArray[np.float64]


def contact_pairs(vertices: ArrayLike, distance: float) -> ContactPairs:
    """Pairs of smarticles whose centrelines come as close as a given distance.

    With spheres of diameter d along the links, d finds the pairs that touch; boxes of section
    t1 × t2 can touch at any distance from min(t1, t2) to (t1² + t2²)^½.

    Args:
        vertices: (N, 4, 3) [m], barb tip, hinge, hinge, barb tip of each smarticle.
        distance: Largest distance of the centrelines [m].

    Returns:
        The pairs, sorted by i, then j.

    Raises:
        InputError: Bad vertices or distance.
    """
    vertices = checked_vertices(vertices)
    if not (math.isfinite(distance) and distance > 0):
        msg = f"distance must be above 0 m: got {distance} m; a link's thickness is usual"
        raise InputError(msg)
    count = len(vertices)
    starts, ends = vertices[:, :-1].reshape(-1, 3), vertices[:, 1:].reshape(-1, 3)
    a, b = _close_links(starts, ends, link_lengths(vertices).ravel(), distance)
    gaps = np.empty(len(a))
    for start in range(0, len(a), _CHUNK):
        p, q = a[start : start + _CHUNK], b[start : start + _CHUNK]
        gaps[start : start + _CHUNK] = segment_distances(starts[p], ends[p], starts[q], ends[q])
    near = gaps <= distance
    i, j = a[near] // 3, b[near] // 3
    keys, which = np.unique(np.minimum(i, j) * count + np.maximum(i, j), return_inverse=True)
    least = np.full(len(keys), np.inf)
    np.minimum.at(least, which, gaps[near])
    return ContactPairs(keys // max(count, 1), keys % max(count, 1), least)


def neighbours_in_contact(vertices: ArrayLike, distance: float) -> NDArray[np.int64]:
    """How many other smarticles come as close to each one as a given distance.

    Args:
        vertices: (N, 4, 3) [m], barb tip, hinge, hinge, barb tip of each smarticle.
        distance: Largest distance of the centrelines [m].

    Returns:
        (N,) int64.

    Raises:
        InputError: Bad vertices or distance.
    """
    vertices = checked_vertices(vertices)
    pairs = contact_pairs(vertices, distance)
    counts = np.bincount(np.concatenate([pairs.i, pairs.j]), minlength=len(vertices))
    return counts.astype(np.int64)


def segment_distances(
    p0: NDArray[np.float64],
    p1: NDArray[np.float64],
    q0: NDArray[np.float64],
    q1: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Least distances of segments p0–p1 from segments q0–q1.

    Either the least distance is at an end of one segment, or it is that of the two lines and is
    reached inside both. Taking the best of the five holds for parallel segments and for segments
    of no length as well.

    Args:
        p0: (n, 3) [m].
        p1: (n, 3) [m].
        q0: (n, 3) [m].
        q1: (n, 3) [m].

    Returns:
        (n,) [m].
    """
    u, v, w = p1 - p0, q1 - q0, p0 - q0
    ends = np.minimum.reduce(
        [
            _point_distances(p0, q0, v),
            _point_distances(p1, q0, v),
            _point_distances(q0, p0, u),
            _point_distances(q1, p0, u),
        ]
    )
    uu, uv, vv = _dot(u, u), _dot(u, v), _dot(v, v)
    uw, vw = _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv**2
    # Nearly parallel: the ends decide, and the division would only amplify rounding.
    skew = determinant > 1e-12 * uu * vv
    safe = np.where(skew, determinant, 1.0)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    inside = skew & (s > 0) & (s < 1) & (t > 0) & (t < 1)
    across = np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1)
    distances: NDArray[np.float64] = np.where(inside, np.minimum(across, ends), ends)
    return distances


def _close_links(
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    lengths: NDArray[np.float64],
    distance: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of links of different smarticles whose bounding spheres come close enough."""
    if len(starts) == 0:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    middles = (starts + ends) / 2
    pairs = cKDTree(middles).query_pairs(lengths.max() + distance, output_type="ndarray")
    a, b = pairs.astype(np.int64).T
    apart = np.linalg.norm(middles[a] - middles[b], axis=1)
    keep = (a // 3 != b // 3) & (apart <= (lengths[a] + lengths[b]) / 2 + distance)
    return a[keep], b[keep]


def _point_distances(
    points: NDArray[np.float64], origins: NDArray[np.float64], along: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n,) [m], distances of points from segments given by an end and a vector."""
    offset = points - origins
    share = np.clip(_dot(offset, along) / np.maximum(_dot(along, along), 1e-300), 0, 1)
    distances: NDArray[np.float64] = np.linalg.norm(offset - share[:, None] * along, axis=1)
    return distances


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    product: NDArray[np.float64] = np.einsum("nc,nc->n", a, b)
    return product


MEASURES = (
    FrameMeasure(
        name="contacts",
        place=50,
        quantities=(Quantity("contacts mean", "-"),),
        take=lambda frame, _: (float(frame.contacts.mean()),),
    ),
)
