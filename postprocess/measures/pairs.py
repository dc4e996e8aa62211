"""Measure how bodies are arranged around each other: g(r), and the correlation of orientations over distance.

g(r) is the number of pairs at a distance r over that of independent random points in the same upright cylinder. Random
points thus give 1 at all distances, also near those at which the finite cylinder holds few pairs.
"""

import math
from dataclasses import dataclass, field
from numbers import Integral, Real

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from dem.errors import InputError, shown
from postprocess.geometry.links import Floats, Whole, floats

_NODES = 200  # of the quadrature over directions


@dataclass(frozen=True, kw_only=True, eq=False)
class RadialDistribution:
    """Radial distribution function g(r) of N points in B spherical shells."""

    edges_m: Floats = field(repr=False)  #: (B + 1,) edges of the shells [m]
    g: Floats = field(repr=False)  #: (B,) pairs over those of random points [-]; NaN where the cylinder holds no pair
    pairs: Whole = field(repr=False)  #: (B,) number of pairs
    ideal: Floats = field(repr=False)  #: (B,) mean number of pairs of as many random points in the cylinder
    radius_m: float  #: Radius of the cylinder [m]
    bottom_m: float  #: Height of its lower end [m]
    top_m: float  #: Height of its upper end [m]

    @property
    def radii_m(self) -> Floats:
        """(B,) middles of the shells [m]."""
        middles: Floats = (self.edges_m[:-1] + self.edges_m[1:]) / 2
        return middles


@dataclass(frozen=True, kw_only=True, eq=False)
class OrientationCorrelation:
    """Correlation of orientations of pairs of bodies in B spherical shells."""

    edges_m: Floats = field(repr=False)  #: (B + 1,) edges of the shells [m]
    nematic: Floats = field(repr=False)  #: (B,) ⟨(3 cos²γ - 1) / 2⟩, γ between the axes of a pair [-]; NaN: no pair
    polar: Floats = field(repr=False)  #: (B,) ⟨cos γ⟩ [-]; meaningless for axes of arbitrary sign
    pairs: Whole = field(repr=False)  #: (B,) number of pairs

    @property
    def radii_m(self) -> Floats:
        """(B,) middles of the shells [m]."""
        middles: Floats = (self.edges_m[:-1] + self.edges_m[1:]) / 2
        return middles


def radial_distribution(
    centres: ArrayLike,
    *,
    longest: float,
    bins: int = 50,
    radius: float | None = None,
    bottom: float | None = None,
    top: float | None = None,
) -> RadialDistribution:
    """Compute the radial distribution function g(r) of points in an upright cylinder around x = y = 0.

    The cylinder is the region of the points, not of the bodies: centres of mass keep a distance from wall and floor.
    Sizes that are left out follow from the outermost points; of N random points in a cylinder these lie inside it by
    shares of 1/N, which is corrected. In a pile whose density changes with height, g(r) includes that change.

    Args:
        centres: (N, 3) points [m], such as `centres_of_mass(frame)`.
        longest: Largest distance [m].
        bins: Number of shells, of equal thickness.
        radius: Radius of the cylinder [m].
        bottom: Height of its lower end [m].
        top: Height of its upper end [m].

    Raises:
        InputError: Fewer than 2 points or 1 shell, a value that is not finite, or a point outside the cylinder.

    Source:
        Stoyan, Kendall & Mecke, Stochastic Geometry and its Applications (1995), section 4.4: the number of pairs of
        random points at a distance follows from the set covariance of their region.
    """
    points, edges = _checked(centres, longest, bins)
    across, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    count = len(points)
    beyond = np.ptp(z) / (count - 1)
    radius = float(across.max()) * math.sqrt((count + 1) / count) if radius is None else radius
    bottom = float(z.min() - beyond) if bottom is None else bottom
    top = float(z.max() + beyond) if top is None else top
    outside = (across > radius) | (z < bottom) | (z > top)
    if not (0 < radius < math.inf and -math.inf < bottom < top < math.inf) or outside.any():
        what = f"point {int(np.argmax(outside))} is outside of it" if outside.any() else "it has no finite volume"
        raise InputError(
            f"cylinder of radius {radius:g} m from {bottom:g} m to {top:g} m: {what}; give a radius, bottom and top "
            "between which all points are"
        )
    i, j = _pairs(points, longest)
    pairs = _in_shells(points, i, j, edges)[1]
    ideal = count * (count - 1) / 2 * _shares(edges, radius, top - bottom)
    g = np.divide(pairs, ideal, out=np.full(bins, np.nan), where=ideal > 0)
    return RadialDistribution(edges_m=edges, g=g, pairs=pairs, ideal=ideal, radius_m=radius, bottom_m=bottom, top_m=top)


def orientation_correlation(
    centres: ArrayLike, axes: ArrayLike, *, longest: float, bins: int = 20
) -> OrientationCorrelation:
    """Compute the correlation of the orientations of two bodies over the distance of their centres.

    Args:
        centres: (N, 3) centres of mass [m].
        axes: (N, 3) vectors of any length above 0, such as `frame.bodies.rotation[:, :, 0]` or `body_axes`.
        longest: Largest distance [m].
        bins: Number of shells, of equal thickness.

    Raises:
        InputError: Fewer than 2 points or 1 shell, a value that is not finite, or axes of another number or length 0.
    """
    points, edges = _checked(centres, longest, bins)
    vectors = floats("axes", axes, "give a direction for each point, such as frame.bodies.rotation[:, :, 0]")
    if vectors.shape != points.shape:
        raise InputError(f"axes must be {points.shape}, one for each point: got {vectors.shape}")
    lengths = np.linalg.norm(vectors, axis=1)
    right = np.isfinite(lengths) & (lengths > 0)
    if not right.all():
        wrong = int(np.argmin(right))
        raise InputError(f"axes must be finite and longer than 0: body {wrong} has {vectors[wrong]}; leave it out")
    units = vectors / lengths[:, None]
    i, j = _pairs(points, longest)
    shell, pairs = _in_shells(points, i, j, edges)
    cosines = np.einsum("pc,pc->p", units[i], units[j])

    def mean(values: Floats) -> Floats:
        found = np.full(bins, np.nan)
        np.divide(np.bincount(shell, values, minlength=bins), pairs, out=found, where=pairs > 0)
        return found

    return OrientationCorrelation(edges_m=edges, nematic=mean(1.5 * cosines**2 - 0.5), polar=mean(cosines), pairs=pairs)


def _checked(centres: ArrayLike, longest: float, bins: int) -> tuple[Floats, Floats]:
    """Return points (N, 3) [m] and the edges (bins + 1,) of shells [m] after checking them."""
    points = floats("centres", centres, "give those of one frame, centres_of_mass(frame)")
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2:
        raise InputError(f"centres must be (N, 3) [m] of 2 bodies or more: got {points.shape}; give those of one frame")
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        raise InputError(f"centres must be finite [m]: that of body {int(np.argmin(finite))} is not; leave it out")
    numbers = isinstance(longest, Real) and isinstance(bins, Integral)
    if not numbers or not (0 < longest < math.inf and bins >= 1):
        raise InputError(
            "shells need a number above 0 m as longest distance, and a whole number of bins, 1 or more: got "
            f"{shown(longest)} m, {shown(bins)} bins"
        )
    return points, np.linspace(0.0, longest, bins + 1)


def _pairs(points: Floats, longest: float) -> tuple[Whole, Whole]:
    """Return the indices (P,) and (P,) of all pairs of points that are at most `longest` [m] apart."""
    i, j = cKDTree(points).query_pairs(longest, output_type="ndarray").astype(np.int64).T
    return i, j


def _in_shells(points: Floats, i: Whole, j: Whole, edges: Floats) -> tuple[Whole, Whole]:
    """Return the shell (P,) of each pair of points, and the number (B,) of pairs in each shell."""
    apart = np.linalg.norm(points[i] - points[j], axis=1)
    shell = np.clip(np.searchsorted(edges, apart, side="right") - 1, 0, len(edges) - 2)
    return shell, np.bincount(shell, minlength=len(edges) - 1)


def _shares(edges: Floats, radius: float, height: float) -> Floats:
    """Return the probabilities (B,) that two random points in an upright cylinder are as far apart as each shell.

    The density of the distance r is 4π r² times the mean over directions of the set covariance over the square of the
    volume; the set covariance is the volume that the cylinder shares with itself shifted by r.
    """
    places, weights = np.polynomial.legendre.leggauss(8)
    half = np.diff(edges)[:, None] / 2
    r = (edges[:-1, None] + half * (1 + places)).ravel()
    nodes, parts = np.polynomial.legendre.leggauss(_NODES)
    cosine, parts = (1 + nodes) / 2, parts / 2
    aside = np.minimum(r[:, None] * np.sqrt(1 - cosine**2) / (2 * radius), 1.0)
    # The area that a disc shares with itself shifted by `aside` of its diameter.
    area = 2 * radius**2 * (np.arccos(aside) - aside * np.sqrt(1 - aside**2))
    shared = (area * np.clip(height - r[:, None] * cosine, 0, None)) @ parts
    density = 4 * np.pi * r**2 * shared / (np.pi * radius**2 * height) ** 2
    shares: Floats = (half * weights * density.reshape(len(half), -1)).sum(axis=1)
    return shares
