"""Measure how far smarticles are wound around each other, by Gauss's linking integral of open chains.

The integral of two closed curves is a whole number, their linking number. The integral of two open chains, such as
smarticles, is a real number: half the signed number of crossings in a projection, averaged over all directions. Unlike
the crossings of `postprocess.measures.entanglement`, it is defined for straight smarticles, too.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError
from postprocess.geometry.links import Floats, Vertices, Whole, checked_vertices, close_pairs
from postprocess.measures.registry import FrameMeasure, Quantity, in_space

# Pairs of smarticles per block, whose temporary arrays fit the cache of a core.
_CHUNK = 500


@dataclass(frozen=True, kw_only=True, eq=False)
class Linking:
    """Linking numbers Lk of P pairs of the N smarticles of a frame."""

    i: Whole = field(repr=False)  #: (P,) int64, the lower index of each pair
    j: Whole = field(repr=False)  #: (P,) int64, the higher index of each pair
    number: Floats = field(repr=False)  #: (P,) float64 [-], Lk; its sign depends on the order of the vertices
    per_smarticle: Floats = field(repr=False)  #: (N,) float64 [-], Σ|Lk| over the pairs of each smarticle

    @property
    def mean(self) -> float:
        """Mean of Σ|Lk| over all smarticles [-]; NaN if there are none."""
        return float(self.per_smarticle.mean()) if len(self.per_smarticle) else math.nan


def linking(vertices: Vertices) -> Linking:
    """Compute the linking numbers of all pairs of smarticles whose bounding spheres overlap.

    A smarticle is the open chain tip, hinge, hinge, tip. Pairs whose bounding spheres do not overlap cannot hook
    into each other, but their linking numbers fall only with the square of the distance: a sum over all pairs would
    grow with the pile.

    Source:
        See `gauss_integral`. The integral of open chains as a measure of entanglement: Panagiotou, Kröger & Millett,
        Phys. Rev. E 88, 062604 (2013).
    """
    vertices = checked_vertices(vertices)
    i, j = close_pairs(vertices)
    number = np.empty(len(i))
    for start in range(0, len(i), _CHUNK):
        part = slice(start, start + _CHUNK)
        number[part] = gauss_integral(vertices[i[part]], vertices[j[part]])
    each = np.zeros(len(vertices))
    np.add.at(each, np.concatenate([i, j]), np.abs(np.concatenate([number, number])))
    return Linking(i=i, j=j, number=number, per_smarticle=each)


def gauss_integral(first: ArrayLike, second: ArrayLike) -> Floats:
    """Compute Gauss's linking integral of pairs of polygonal chains, open or closed.

    For two straight segments (1 / 4π) ∫∫ (r₁ - r₂) · (dr₁ × dr₂) / |r₁ - r₂|³ is the solid angle, over 4π, that the
    parallelogram of all differences r₂ - r₁ subtends at the origin. It is the sum of the angles of two triangles.

    Args:
        first: (…, m, 3) corners of chains of m - 1 segments [m]; a closed chain repeats its first corner at the end.
        second: (…, n, 3) corners of chains of n - 1 segments [m].

    Returns:
        (…) integrals [-], whole numbers within rounding for closed chains. The integral of two segments that meet is
        undefined and counts as 0.

    Raises:
        InputError: An array has another shape.

    Source:
        Klenin & Langowski, Biopolymers 54, 307 (2000), method 1a, with four arcsines for the solid angle of a
        parallelogram; here with the two arctangents of van Oosterom & Strackee, IEEE Trans. Biomed. Eng. 30, 125
        (1983), which lose no digits near a right angle.

    Example:
        >>> ring = np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]])
        >>> through = ring[:, [0, 2, 1]] + [1.0, 0, 0]
        >>> round(float(gauss_integral(ring, through)), 12)
        -1.0
    """
    first, second = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    for curve in (first, second):
        if curve.ndim < 2 or curve.shape[-1] != 3 or curve.shape[-2] < 2:
            raise InputError(f"a polygon must be (…, corners, 3) [m] with 2 corners or more: got {curve.shape}")
    # Differences of all corners (…, m, n, 3); segments s and t have the four differences at [s:s+2, t:t+2].
    apart = second[..., None, :, :] - first[..., :, None, :]
    length = np.sqrt(np.einsum("...c,...c->...", apart, apart))
    a, b = apart[..., :-1, :-1, :], apart[..., :-1, 1:, :]
    c, d = apart[..., 1:, 1:, :], apart[..., 1:, :-1, :]
    la, lb, lc, ld = length[..., :-1, :-1], length[..., :-1, 1:], length[..., 1:, 1:], length[..., 1:, :-1]
    along = np.diff(first, axis=-2)[..., :, None, :]
    across = np.diff(second, axis=-2)[..., None, :, :]
    # Both triangles span the same volume with the origin: a · (b × c) = a · (c × d).
    volume = -np.einsum("...c,...c->...", a, np.cross(along, across))
    diagonal, product = _dot(a, c), la * lc
    angle = np.arctan2(volume, product * lb + _dot(a, b) * lc + _dot(b, c) * la + diagonal * lb)
    angle += np.arctan2(volume, product * ld + _dot(a, d) * lc + _dot(d, c) * la + diagonal * ld)
    # The origin lies in the plane of the parallelogram, as it does for segments that meet.
    angle[volume == 0] = 0.0
    total: Floats = angle.sum(axis=(-2, -1)) / (2 * math.pi)
    return total


def segment_integrals(first: Floats, second: Floats) -> Floats:
    """Compute Gauss's integrals of all pairs of straight segments (R, 2, 3) and (C, 2, 3) [m]: (R, C).

    The result is that of `gauss_integral`, but for many segments six times as fast.
    """
    # Components come first, so that every operation runs over contiguous arrays.
    p, q = np.moveaxis(first, 0, 2)[..., None], np.moveaxis(second, 0, 2)[:, :, None]
    a, b, c, d = q[0] - p[0], q[1] - p[0], q[1] - p[1], q[0] - p[1]

    def dot(x: Sequence[Floats] | Floats, y: Sequence[Floats] | Floats) -> Floats:
        product: Floats = x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
        return product

    la, lb, lc, ld = (np.sqrt(dot(x, x)) for x in (a, b, c, d))
    u, v = p[1] - p[0], q[1] - q[0]
    volume = -dot(a, (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]))
    diagonal, product = dot(a, c), la * lc
    angle = np.arctan2(volume, product * lb + dot(a, b) * lc + dot(b, c) * la + diagonal * lb)
    angle += np.arctan2(volume, product * ld + dot(a, d) * lc + dot(d, c) * la + diagonal * ld)
    angle[volume == 0] = 0.0
    total: Floats = angle / (2 * math.pi)
    return total


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("...c,...c->...", a, b)
    return product


MEASURES = (
    FrameMeasure(
        name="linking",
        place=42,
        quantities=(Quantity("linking mean", "-"),),
        take=lambda frame, _: (linking(frame.vertices).mean,),
        available_for=in_space,
        costly=True,
    ),
)
