"""Count the crossings of bodies of any shape that span a polygon.

An open bent body spans the polygon of its corners, closed by the straight line between its free ends, as a U, C, Z or
hook does; a ring spans its own polygon. A segment of another body crosses it as a link crosses the plane of a
smarticle, see `postprocess.measures.entanglement`, and smarticles have the crossings that are counted there. These
bodies span no polygon: a straight one, one that branches or has several pieces (a star, a cross), and one whose corners
do not lie in a plane. The average crossing number is defined for these, too.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from postprocess.geometry.links import Flags, Floats, UndefinedMeasureError, Whole, bounding_spheres
from postprocess.geometry.segments import Curve, checked_segments, curves
from postprocess.measures.entanglement import STRAIGHT, passing_segments

FLAT = 0.1  #: Largest distance of a corner from the plane of its body, over the body's radius, for a flat body [-]


@dataclass(frozen=True, kw_only=True, eq=False)
class PolygonCrossings:
    """Crossings of B bodies, and the P ordered pairs (i, j) where j passes through the polygon of i."""

    bodies: Whole = field(repr=False)  #: (B,) int64, numbers of the bodies
    crossings: Whole = field(repr=False)  #: (B,) int64, segments of others through the polygon; 0 without a polygon
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
        """Mean crossings of the bodies that span a polygon [-]."""
        return float(self.crossings[self.has_polygon].mean())


def polygon_crossings(segments: ArrayLike, body: ArrayLike) -> PolygonCrossings:
    """Count the segments of others that pass through the polygon of each body.

    Args:
        segments: (M, 2, 3) [m].
        body: (M,) number of the body of each segment.

    Raises:
        InputError: See `checked_segments`.
        UndefinedMeasureError: No body spans a polygon; the message has the reason for the first one.

    Source:
        Savoie et al., Soft Matter 2023, ⟨N⟩ of smarticles; here for any flat curve.
    """
    segments, body = checked_segments(segments, body)
    found = curves(segments, body)
    flaws = tuple(_flaw(one) for one in found)
    if all(flaws):
        first = f"body {found[0].body} {flaws[0]}" if found else "there is no body"
        raise UndefinedMeasureError(
            f"no body spans a polygon: {first}; the average crossing number is defined for every shape"
        )
    bodies, number = np.unique(body, return_inverse=True)
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
        passing = passing_segments(corners, polygon, segments[other])
        pairs = np.stack([owner[polygon[passing]], number[other[passing]]], axis=1)
        unique, times = np.unique(pairs, axis=0, return_counts=True)
        counts = np.concatenate([counts, np.column_stack([unique.reshape(-1, 2), times])])
    i, j, passed = counts[np.lexsort((counts[:, 1], counts[:, 0]))].T
    crossings = np.bincount(i, passed, minlength=len(bodies)).astype(np.int64)
    return PolygonCrossings(bodies=bodies, crossings=crossings, flaws=flaws, i=i, j=j, segments=passed)


def _flaw(curve: Curve) -> str:
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
