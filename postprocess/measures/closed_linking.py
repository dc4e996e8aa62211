"""Compute writhes of curves, and linking numbers of curves that are closed or are closed by a line.

The linking number of two closed curves is a whole number. It does not change unless the curves pass through each other.
An open curve is closed by the straight line between its free ends, as across the mouth of a U. The number is then whole
too, but it changes where a body passes through that line. `postprocess.measures.linking` has the integral of open
curves.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import Flags, Floats, Whole, close_pairs
from postprocess.geometry.segments import checked_curves, only_curves, padded, segments_of
from postprocess.measures.clusters import joined_clusters
from postprocess.measures.linking import gauss_integral, segment_integrals
from postprocess.measures.registry import FrameMeasure, Quantity, any_in_space

# Pairs of segments per block, which limits memory.
_CHUNK = 100_000
# Largest distance of an integral from a whole number that rounding explains; curves that touch are farther off.
_ROUNDING = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedLinking:
    """Linking numbers of the P linked pairs of B bodies; all other pairs have 0."""

    bodies: Whole = field(repr=False)  #: (B,) int64, numbers of the bodies
    closed: Flags = field(repr=False)  #: (B,) bool, False for bodies that a straight line had to close
    i: Whole = field(repr=False)  #: (P,) int64, index in `bodies` of the first body of each pair
    j: Whole = field(repr=False)  #: (P,) int64, index in `bodies` of the second body, above i
    #: (P,) float64 [-], whole numbers; the sign depends on the directions of the curves; NaN if the integral is not
    #: whole, as it is for curves that touch in one point
    number: Floats = field(repr=False)

    @property
    def per_body(self) -> Floats:
        """Sum of |Lk| over the pairs of each body: (B,) [-]."""
        total: Floats = np.zeros(len(self.bodies))
        # `np.add.at` does not broadcast its values in NumPy 2.4.
        np.add.at(total, np.concatenate([self.i, self.j]), np.abs(np.tile(self.number, 2)))
        return total

    @property
    def mean(self) -> float:
        """Mean of `per_body` [-]; NaN if there is no body."""
        return float(self.per_body.mean()) if len(self.bodies) else math.nan


def closed_linking(segments: ArrayLike, body: ArrayLike) -> ClosedLinking:
    """Compute the linking numbers of all pairs of bodies; open bodies are closed by a straight line.

    The line joins the two free ends of a body. A straight rod encloses nothing when it is closed in this way, so all
    its linking numbers are 0. Pairs whose bounding spheres do not overlap are not linked and cost nothing. All other
    pairs cost 0.6 µs per pair of their segments.

    Args:
        segments: (M, 2, 3) both ends of all segments [m].
        body: (M,) number of the body of each segment.

    Raises:
        InputError: See `checked_segments`; or a body branches or has several pieces, so that it is no curve.

    Source:
        Gauss's integral of closed polygons, see `gauss_integral`. Other closures of open curves change the number, see
        Panagiotou, Kröger & Millett, Phys. Rev. E 88, 062604 (2013).

    Example:
        >>> square = np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
        >>> rings = np.concatenate([square, square[:, [0, 2, 1]] + [1.0, 0, 0]]).reshape(2, 4, 3)
        >>> segments = np.stack([rings, np.roll(rings, -1, axis=1)], axis=2).reshape(8, 2, 3)
        >>> closed_linking(segments, np.repeat([0, 1], 4)).number
        array([-1.])
    """
    found = checked_curves(segments, body, "linking number")
    corners = padded(found)
    outlines = np.concatenate([corners, corners[:, :1]], axis=1)
    i, j = close_pairs(corners)
    number = np.empty(len(i))
    step = max(1, _CHUNK // outlines.shape[1] ** 2)
    for start in range(0, len(i), step):
        part = slice(start, start + step)
        number[part] = gauss_integral(outlines[i[part]], outlines[j[part]])
    whole = np.where(np.abs(number - number.round()) < _ROUNDING, number.round(), math.nan)
    linked = whole != 0
    return ClosedLinking(
        bodies=np.array([one.body for one in found], dtype=np.int64),
        closed=np.array([one.closed for one in found], dtype=bool),
        i=i[linked],
        j=j[linked],
        number=whole[linked],
    )


def writhe(corners: ArrayLike, *, closed: bool) -> float:
    """Compute the writhe of a polygonal curve: the mean signed number of crossings with itself [-].

    The mean is over all directions of view. The value is exact for the polygon; it is 0 for a plane curve, changes its
    sign in a mirror, and does not depend on the direction along the curve. For an open curve it is the integral over
    the curve as it is, without a closure.

    Args:
        corners: (n, 3) corners in order [m]; a closed curve does not repeat its first corner.
        closed: Whether the last corner is joined to the first one.

    Raises:
        InputError: Corners have another shape, or two that follow each other coincide.

    Source:
        Klenin & Langowski, Biopolymers 54, 307 (2000), equation 13 and method 1a: Wr = 2 Σ Ω_ij / 4π over pairs i < j.

    Example:
        >>> round(writhe([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0.5, 0.5, 1]], closed=True), 12)
        0.0
    """
    points = np.asarray(corners, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2 or not np.isfinite(points).all():
        raise InputError(f"corners must be (n, 3) finite numbers [m], 2 or more: got an array of {points.shape}")
    ends = np.stack([points, np.roll(points, -1, axis=0)], axis=1)[: None if closed else -1]
    if np.any(np.all(ends[:, 0] == ends[:, 1], axis=1)):
        raise InputError("corners that follow each other must not coincide; a closed curve does not repeat its first")
    number, total = np.arange(len(ends)), 0.0
    step = max(1, _CHUNK // len(ends))
    for start in range(0, len(ends), step):
        values = segment_integrals(ends[start : start + step], ends)
        apart = np.abs(number[start : start + step, None] - number)
        # Segments that meet at a corner lie in one plane and have no crossings.
        values[(np.minimum(apart, len(ends) - apart) if closed else apart) <= 1] = 0.0
        total += float(values.sum())
    return total


def writhes(segments: ArrayLike, body: ArrayLike) -> Floats:
    """Compute the writhe of each body, open or closed: (B,) [-].

    Bodies are in ascending order of their numbers. Segments are (M, 2, 3) [m]; `body` (M,) is the number of the body of
    each segment. InputError if a body is no curve.
    """
    found = checked_curves(segments, body, "writhe")
    return np.array([writhe(one.corners, closed=one.closed) for one in found], dtype=np.float64)


def _linking_of(frame: Frame, _: Run) -> tuple[float, float]:
    linked = closed_linking(*only_curves(*segments_of(frame)))
    if len(linked.bodies) == 0:
        return math.nan, math.nan
    return linked.mean, joined_clusters(len(linked.bodies), linked.i, linked.j).largest


MEASURES = (
    FrameMeasure(
        name="closed-linking",
        place=43,
        quantities=(Quantity("closed linking number mean", "-"), Quantity("linked graph largest share", "-")),
        take=_linking_of,
        available_for=any_in_space,
        costly=True,
        on_request=True,
    ),
)
