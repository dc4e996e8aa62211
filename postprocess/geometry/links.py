"""Lengths, centres, planes and shapes of smarticles, by their four vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from dem.errors import InputError

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]

Vertices = ArrayLike
"""(N, 4, 3) [m]: barb tip, hinge, hinge, barb tip of each smarticle. Functions that take them check them first, see
`checked_vertices`."""


class UndefinedMeasureError(InputError):
    """The measure has no meaning for this frame, e.g. a packing fraction of one smarticle.

    Tables over whole runs show such values as NaN; every other error stops them.
    """


def checked_vertices(vertices: Vertices) -> Floats:
    """The vertices as an array that every measure can rely on.

    Returns:
        (N, 4, 3) float64 [m].

    Raises:
        InputError: Wrong shape, a value that is not finite, or a smarticle without any length.
    """
    array = np.asarray(vertices, dtype=np.float64)
    if array.ndim != 3 or array.shape[1:] != (4, 3):
        msg = f"vertices must be (N, 4, 3) [m]: got {array.shape}; pass frame.vertices"
        raise InputError(msg)
    if not np.all(np.isfinite(array)):
        bad = int(np.nonzero(~np.isfinite(array).all(axis=(1, 2)))[0][0])
        msg = f"vertices must be finite [m]: smarticle {bad} is not; the run has blown up there"
        raise InputError(msg)
    if np.any(link_lengths(array).sum(axis=1) <= 0):
        bad = int(np.argmin(link_lengths(array).sum(axis=1)))
        msg = f"vertices of smarticle {bad} coincide (0 m long); leave it out"
        raise InputError(msg)
    return array


def link_lengths(vertices: Floats) -> Floats:
    """(N, 3) [m], lengths of barb 1, middle link and barb 2, of (N, 4, 3) [m] vertices."""
    lengths: Floats = np.linalg.norm(np.diff(vertices, axis=1), axis=2)
    return lengths


def centres_of_mass(vertices: Vertices) -> Floats:
    """Centres of mass of smarticles whose three links have the same cross-section.

    Returns:
        (N, 3) [m].
    """
    vertices = checked_vertices(vertices)
    weights = link_lengths(vertices)[:, :, None]
    middles = (vertices[:, :-1] + vertices[:, 1:]) / 2
    centres: Floats = (weights * middles).sum(axis=1) / weights.sum(axis=1)
    return centres


def bounding_spheres(vertices: Floats) -> tuple[Floats, Floats]:
    """Centres (N, 3) [m] and radii (N,) [m] of spheres that hold all four vertices of each."""
    centres = vertices.mean(axis=1)
    radii = np.linalg.norm(vertices - centres[:, None], axis=2).max(axis=1)
    return centres, radii


def close_pairs(vertices: Floats) -> tuple[Whole, Whole]:
    """Pairs of smarticles whose bounding spheres overlap: only they can touch, or pass through each other.

    Args:
        vertices: (N, 4, 3) [m].

    Returns:
        (P,) the lower and (P,) the higher index of each pair.
    """
    if len(vertices) < 2:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    centres, radii = bounding_spheres(vertices)
    pairs = cKDTree(centres).query_pairs(2 * radii.max(), output_type="ndarray")
    distance = np.linalg.norm(centres[pairs[:, 0]] - centres[pairs[:, 1]], axis=1)
    i, j = pairs[distance < radii[pairs].sum(axis=1)].astype(np.int64).T
    return i, j


def swept_axes(vertices: Floats, diameter: float) -> Floats:
    """What a sphere is swept along where engines see a smarticle: tips pulled in by the radius, hinges as they are.

    Args:
        vertices: (N, 4, 3) [m].
        diameter: Of the sphere [m].

    Returns:
        (N, 4, 3) [m]; a barb shorter than the radius shrinks to its hinge, a smarticle without barbs is pulled in at
        the ends of its middle link.

    Source:
        `dem.engine.links.shape`; the sphere chains of `dem.body.particle` lie along the same axes.
    """
    axes = vertices.copy()
    lengths = link_lengths(vertices)
    for tip, hinge, other, link in ((0, 1, 2, 0), (3, 2, 1, 2)):
        length = lengths[:, link, None]
        bare = length <= 0
        axes[:, tip] -= np.minimum(diameter / 2 / np.where(bare, 1.0, length), 1.0) * (axes[:, tip] - axes[:, hinge])
        inwards = vertices[:, other] - vertices[:, hinge]
        ends = vertices[:, hinge] + diameter / 2 * inwards / np.maximum(lengths[:, 1, None], 1e-300)
        axes[:, hinge] = np.where(bare, ends, axes[:, hinge])
        axes[:, tip] = np.where(bare, ends, axes[:, tip])
    return axes


def plane_frames(vertices: Floats) -> Floats:
    """Right-handed axes of the best-fitting plane of each smarticle.

    The normal is the direction of least spread of the four vertices: unlike a cross product of
    two links it is as good for every shape, and it averages over slightly bent hinges. Of a
    straight smarticle it is some vector across it.

    Args:
        vertices: (N, 4, 3) [m].

    Returns:
        (N, 3, 3), rows: two axes in the plane and the normal.
    """
    _, _, axes = np.linalg.svd(vertices - vertices.mean(axis=1, keepdims=True))
    axes[np.linalg.det(axes) < 0, 2] *= -1
    frames: Floats = axes
    return frames
