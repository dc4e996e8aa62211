"""Describe bodies of any shape by their segments: check them, join them to curves, find near segments.

A body is a set of straight segments, the axes of its parts. `segments` is an array (M, 2, 3) [m] with both ends of each
segment, `body` an array (M,) with the number of the body that each segment belongs to. Results have one value per body,
in ascending order of these numbers.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from dem.errors import InputError
from dem.record.frame import Frame
from postprocess.geometry.links import Floats, Whole

JOINED = 1e-6  #: Ends at most this far apart are one corner; over the mean length of a segment [-]


class Segments(NamedTuple):
    """M segments of B bodies."""

    segments: Floats  #: (M, 2, 3) float64 [m], both ends of each segment
    body: Whole  #: (M,) int64, number of the body that each segment belongs to


class Extents(NamedTuple):
    """Boxes around B bodies, along the coordinate axes."""

    low: Floats  #: (B, 3) float64 [m], least coordinates
    high: Floats  #: (B, 3) float64 [m], largest coordinates


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """The segments of one body in the order in which they follow each other."""

    body: int  #: Number of the body
    #: (n, 3) float64 [m], corners in order; a closed curve does not repeat its first corner; empty if there is a flaw
    corners: Floats = field(repr=False)
    closed: bool  #: Whether the last corner is joined to the first one, as in a ring
    flaw: str = ""  #: Reason why the segments do not form one curve; empty if they do


def segments_of(frame: Frame) -> Segments:
    """Return the segments of all bodies of a frame, without links of length 0.

    The number of a body is its index in the frame, as in `Frame.contacts`.
    """
    real = np.any(frame.segments[:, 0] != frame.segments[:, 1], axis=1)
    return Segments(frame.segments[real], frame.body[real])


def checked_segments(segments: ArrayLike, body: ArrayLike) -> Segments:
    """Return segments as float64 (M, 2, 3) [m] and body as int64 (M,) after checking them.

    InputError for a wrong shape, a value that is not finite, a body that is no whole number, or a segment of length 0.
    """
    ends, owner = np.asarray(segments, dtype=np.float64), np.asarray(body)
    if ends.ndim != 3 or ends.shape[1:] != (2, 3):
        raise InputError(f"segments must be (M, 2, 3) [m], the two ends of each segment: got {ends.shape}")
    if owner.shape != ends.shape[:1] or not (owner.size == 0 or np.issubdtype(owner.dtype, np.integer)):
        raise InputError(
            f"body must be {len(ends)} whole numbers, one per segment: got an array {owner.shape} of {owner.dtype}"
        )
    finite = np.isfinite(ends).all(axis=(1, 2))
    if not finite.all():
        raise InputError(f"segments must be finite [m]: segment {int(np.argmin(finite))} is not; leave it out")
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    if np.any(lengths == 0):
        raise InputError(f"segment {int(np.argmin(lengths))} has a length of 0 m; leave it out")
    return Segments(ends, owner.astype(np.int64))


def curves(segments: ArrayLike, body: ArrayLike) -> tuple[Curve, ...]:
    """Join the segments of each body to a curve, open or closed.

    Ends at most `JOINED` apart are one corner. An open curve starts at the free end that comes first in `segments`, a
    closed one at the first end of its first segment. A body that branches or has several pieces gets a curve without
    corners, and the reason as `flaw`.

    Raises:
        InputError: See `checked_segments`.
    """
    segments, body = checked_segments(segments, body)
    ends = corner_numbers(segments)
    sorted_ = np.argsort(body, kind="stable")
    bodies, first = np.unique(body[sorted_], return_index=True)
    found = []
    # Without segments `split` returns one empty part.
    for number, own in zip(bodies, np.split(sorted_, first[1:]), strict=False):
        order, closed, flaw = _walk(ends[own])
        corners = segments[own].reshape(-1, 3)[order] if not flaw else np.empty((0, 3))
        found.append(Curve(body=int(number), corners=corners, closed=closed, flaw=flaw))
    return tuple(found)


def checked_curves(segments: ArrayLike, body: ArrayLike, what: str) -> tuple[Curve, ...]:
    """Return `curves`; raise InputError, which names the wanted quantity `what`, if a body is no curve."""
    found = curves(segments, body)
    for curve in found:
        if curve.flaw:
            raise InputError(f"body {curve.body} has no {what}: it {curve.flaw}; leave its segments out")
    return found


def only_curves(segments: Floats, body: Whole) -> Segments:
    """Return the segments of all bodies that are one curve; `body` (M,) is the body of each segment."""
    joined = [one.body for one in curves(segments, body) if not one.flaw]
    return Segments(segments[np.isin(body, joined)], body[np.isin(body, joined)])


def padded(found: tuple[Curve, ...]) -> Floats:
    """Return the corners of B curves as one array (B, n, 3) [m]; shorter curves repeat their last corner.

    n is the largest number of corners. No curve may have a flaw, because it would have no corners.
    """
    longest = max((len(curve.corners) for curve in found), default=1)
    rows = [np.pad(one.corners, ((0, longest - len(one.corners)), (0, 0)), mode="edge") for one in found]
    return np.array(rows, dtype=np.float64).reshape(len(rows), longest, 3)


def extents(segments: ArrayLike, body: ArrayLike) -> Extents:
    """Return the boxes around all bodies, in the ascending order of their numbers.

    Segments are (M, 2, 3) [m], `body` (M,) are the numbers of their bodies; `checked_segments` states the errors.
    """
    segments, body = checked_segments(segments, body)
    bodies, number = np.unique(body, return_inverse=True)
    low, high = np.full((len(bodies), 3), np.inf), np.full((len(bodies), 3), -np.inf)
    np.minimum.at(low, number, segments.min(axis=1))
    np.maximum.at(high, number, segments.max(axis=1))
    return Extents(low, high)


def inner_axes(segments: Floats, radius: Floats) -> Floats:
    """Return segments (M, 2, 3) [m] whose free ends are moved inwards by radii (M,) [m].

    An end is free if no other segment meets it. A sphere of that radius whose centre moves along the result ends at the
    tips of the body; engines place their spheres in the same way. No end moves beyond the middle of its segment.
    """
    corners = corner_numbers(segments)
    free = np.bincount(corners.ravel())[corners] == 1
    along = segments[:, 1] - segments[:, 0]
    fraction = np.minimum(radius / np.linalg.norm(along, axis=1), 0.5)
    moved = (fraction[:, None] * free)[..., None] * along[:, None]
    inner: Floats = segments + moved * np.array([1.0, -1.0])[:, None]
    return inner


def close_segments(starts: Floats, ends: Floats, body: Whole, distance: float) -> tuple[Whole, Whole]:
    """Find pairs of segments of different bodies whose bounding spheres are at most a distance [m] apart.

    Segments are given by starts and ends (M, 3) [m] and their bodies (M,). Returns the indices of the first and of the
    second segment of each of the P pairs, (P,) each.
    """
    if len(starts) == 0:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    lengths = np.linalg.norm(ends - starts, axis=1)
    middles = (starts + ends) / 2
    pairs = cKDTree(middles).query_pairs(lengths.max() + distance, output_type="ndarray")
    a, b = pairs.astype(np.int64).T
    apart = np.linalg.norm(middles[a] - middles[b], axis=1)
    keep = (body[a] != body[b]) & (apart <= (lengths[a] + lengths[b]) / 2 + distance)
    return a[keep], b[keep]


def nearest_points(first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Return the nearest points (P, 3), (P, 3) [m] of pairs of segments (P, 2, 3) [m].

    Parallel segments that face each other have many nearest points; one pair of them is returned.

    Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    u, v, w = first[:, 1] - first[:, 0], second[:, 1] - second[:, 0], first[:, 0] - second[:, 0]
    uu, uv, vv, uw, vw = (np.einsum("pc,pc->p", a, b) for a, b in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    determinant = uu * vv - uv**2
    # For nearly parallel segments the division would amplify rounding.
    skew = determinant > 1e-12 * uu * vv
    s = np.where(skew, np.clip((uv * vw - uw * vv) / np.where(skew, determinant, 1.0), 0, 1), 0.0)
    t = np.clip((uv * s + vw) / vv, 0, 1)
    s = np.clip((uv * t - uw) / uu, 0, 1)
    return first[:, 0] + s[:, None] * u, second[:, 0] + t[:, None] * v


def corner_numbers(segments: Floats) -> Whole:
    """Number the points at which ends of segments meet: (M, 2), one number per end.

    Ends of different bodies that meet have equal numbers, too.
    """
    points = segments.reshape(-1, 3)
    if len(points) == 0:
        return np.empty((0, 2), dtype=np.int64)
    reach = JOINED * float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).mean())
    i, j = cKDTree(points).query_pairs(reach, output_type="ndarray").T
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(len(points), len(points)))
    numbers: Whole = connected_components(graph, directed=False)[1].astype(np.int64).reshape(-1, 2)
    return numbers


def _walk(ends: Whole) -> tuple[list[int], bool, str]:
    """Follow the segments of a body from corner to corner, by the corner numbers (m, 2) of their ends.

    Returns three values. The first is a list of the corners in order: the number 2 s + e is end e (0 or 1) of segment
    s. The second is whether the curve is closed. The third is the flaw, see `Curve.flaw`; with a flaw the list is
    empty.
    """
    at: dict[int, list[int]] = {}
    for number, corner in enumerate(ends.ravel().tolist()):
        at.setdefault(corner, []).append(number)
    if any(len(numbers) > 2 for numbers in at.values()):
        return [], False, "branches, or meets itself, as a star and a cross do"
    free = min((numbers[0] for numbers in at.values() if len(numbers) == 1), default=None)
    here = 0 if free is None else free
    order, passed = [here], 0
    while True:
        passed += 1
        there = here ^ 1
        onwards = [number for number in at[int(ends.flat[there])] if number != there]
        if not onwards or onwards[0] == order[0]:
            order += [there] if free is not None else []
            break
        here = onwards[0]
        order.append(here)
    if passed < len(ends):
        return [], False, "has several pieces that do not touch"
    if free is None and len(order) < 3:
        return [], False, "goes to and fro along one line"
    return order, free is None, ""
