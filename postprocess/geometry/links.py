"""Compute lengths, centres of mass and planes of smarticles, and the spheres that represent them.

Frames hold the vertices of the centrelines alone. The spheres of a smarticle follow from its vertices and from the rows
and the pitch of its chain. Several rows lie side by side along the normal of the smarticle's plane; a straight
smarticle has no such plane, and an arbitrary plane through it is used. The engine `links` has strands in place of rows:
the volumes that a sphere sweeps along the links.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from dem.errors import InputError, shown
from dem.record.frame import Frame
from dem.record.frames import FrameSequence
from dem.record.run import Run

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]

Vertices = ArrayLike
"""(N, 4, 3) [m]: barb tip, hinge, hinge and barb tip of each smarticle, not yet checked; see `checked_vertices`."""

# Copies of `dem.body.particle.HINGE_CLEARANCE` and `INWARDS`; a test compares them.
_CLEARANCE, _INWARDS = 0.01, math.radians(15)


class UndefinedMeasureError(InputError):
    """Raised if a measure is undefined for a frame, such as the packing fraction of one smarticle.

    Tables of whole runs show such a value as NaN; every other error ends the measurement.
    """


def floats(name: str, given: object, way_out: str) -> Floats:
    """Return data as an array of numbers; InputError, which names the data and a way out, if they are none."""
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {shown(given)} is no array of numbers; {way_out}") from None


def checked_vertices(vertices: Vertices) -> Floats:
    """Return vertices as a float64 array (N, 4, 3) [m] after checking them.

    InputError for a wrong shape, a value that is not finite, or a smarticle of length 0.
    """
    array = floats("vertices", vertices, "pass a frame, or frame.vertices")
    if array.ndim == 3 and array.shape[1] == 0 and len(array):
        raise InputError(
            f"{len(array)} bodies of a scene with the key particle have no barbs: use frame.segments, frame.bodies"
        )
    if array.ndim != 3 or array.shape[1:] != (4, 3):
        raise InputError(f"vertices must be (N, 4, 3) [m]: got {array.shape}; pass frame.vertices")
    finite = np.isfinite(array).all(axis=(1, 2))
    if not finite.all():
        msg = f"vertices must be finite [m]: smarticle {int(np.argmin(finite))} is not; the run has blown up there"
        raise InputError(msg)
    lengths = link_lengths(array).sum(axis=1)
    if np.any(lengths <= 0):
        raise InputError(f"vertices of smarticle {int(np.argmin(lengths))} coincide (0 m long); leave it out")
    return array


def link_lengths(vertices: Floats) -> Floats:
    """Return the lengths of barb 1, middle link and barb 2 of each smarticle, (N, 3) [m]."""
    lengths: Floats = np.linalg.norm(np.diff(vertices, axis=1), axis=2)
    return lengths


def centres_of_mass(bodies: Vertices | Frame | FrameSequence | Run) -> Floats:
    """Return the centres of mass of all bodies [m].

    Args:
        bodies: A frame with bodies of any shape; a run, or some of its frames; or vertices (N, 4, 3) [m] of smarticles
            whose three links have equal cross-sections.

    Returns:
        (N, 3), or (T, N, 3) for T frames, with NaN where a body is not poured yet.

    Raises:
        InputError: Vertices have another shape, or a file of the run is missing or damaged.
    """
    if isinstance(bodies, Frame):
        return bodies.bodies.position_m
    if isinstance(bodies, Run | FrameSequence):
        return over_time(bodies.frames if isinstance(bodies, Run) else bodies, lambda frame: frame.bodies.position_m)
    vertices = checked_vertices(bodies)
    weights = link_lengths(vertices)[:, :, None]
    middles = (vertices[:, :-1] + vertices[:, 1:]) / 2
    centres: Floats = (weights * middles).sum(axis=1) / weights.sum(axis=1)
    return centres


def over_time(frames: FrameSequence, take: Callable[[Frame], Floats]) -> Floats:
    """Return values (T, N, …) of the bodies of T frames, in the order of their numbers.

    `take` returns the values (n, …) of the bodies of a frame; a body that is not poured yet has NaN.
    """
    each = [(frame.smarticle_ids, take(frame)) for frame in frames]
    numbers = np.unique(np.concatenate([ids for ids, _ in each])) if each else np.empty(0, np.int64)
    found = np.full((len(each), len(numbers), *(each[0][1].shape[1:] if each else (3,))), np.nan)
    for row, (ids, values) in zip(found, each, strict=True):
        row[np.searchsorted(numbers, ids)] = values
    return found


def bounding_spheres(vertices: Floats) -> tuple[Floats, Floats]:
    """Return centres (N, 3) [m] and radii (N,) [m] of spheres around the four vertices of each smarticle."""
    centres = vertices.mean(axis=1)
    return centres, np.linalg.norm(vertices - centres[:, None], axis=2).max(axis=1)


def close_pairs(vertices: Floats) -> tuple[Whole, Whole]:
    """Find the pairs of smarticles whose bounding spheres overlap, by their vertices (N, 4, 3) [m].

    All other pairs neither touch nor cross. Returns the lower indices (P,) and the higher indices (P,) of the P pairs.
    """
    if len(vertices) < 2:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    centres, radii = bounding_spheres(vertices)
    pairs = cKDTree(centres).query_pairs(2 * radii.max(), output_type="ndarray")
    distance = np.linalg.norm(centres[pairs[:, 0]] - centres[pairs[:, 1]], axis=1)
    i, j = pairs[distance < radii[pairs].sum(axis=1)].astype(np.int64).T
    return i, j


def swept_axes(vertices: Floats, diameter: float) -> Floats:
    """Return the axes (N, 4, 3) [m] of the bodies that a sphere sweeps along each smarticle.

    An axis consists of the three centrelines, with both tips moved inwards by the sphere's radius, so that the body
    ends at the tips. A barb shorter than the radius shrinks to its hinge; without barbs the ends of the middle link
    move inwards.

    Source: `dem.engine.links.shapes`; the sphere chains of `dem.body.particle` lie along these axes too.
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
    """Return right-handed axes, the rows (N, 3, 3), of each smarticle's best-fitting plane, normal last.

    The normal is the direction in which the four vertices spread least, by singular value decomposition. It averages
    over vertices that are not quite in one plane. The normal of a straight smarticle is an arbitrary vector across it.
    """
    _, _, axes = np.linalg.svd(vertices - vertices.mean(axis=1, keepdims=True))
    axes[np.linalg.det(axes) < 0, 2] *= -1
    frames: Floats = axes
    return frames


@dataclass(frozen=True, kw_only=True)
class Chain:
    """Sizes of the spheres or strands by which an engine represents a smarticle.

    A strand is the volume that a sphere sweeps as it moves along the three links.
    """

    diameter: float  #: Diameter of the spheres [m]
    rows: int  #: Number of rows or strands side by side along the smarticle's normal
    width: float  #: Total width of all rows, along the normal [m]
    pitch: float  #: Largest distance of neighbouring spheres along a link [m]; 0 for strands
    bulge: float = 0.0  #: Extra thickness of the middle link on either side in the plane [m]; 0 for strands


def strands(vertices: Floats, chain: Chain) -> Floats:
    """Return the axes (N, R, 4, 3) [m] of the R strands that represent each smarticle, side by side.

    A strand is the volume that a sphere sweeps along its axis; `swept_axes` describes one axis (4, 3).
    """
    return _side_by_side(swept_axes(vertices, chain.diameter), vertices, chain)


def spheres(vertices: Floats, chain: Chain) -> Floats:
    """Return the centres (N, S, 3) [m] of the S spheres of each smarticle.

    The spheres at the hinges belong to the middle link. The first sphere of a barb is a little more than a diameter
    from the hinge. The surface of its last sphere touches the tip.

    Source: `dem.body.particle`.
    """
    lengths = link_lengths(vertices).mean(axis=0)
    parts = []
    for link, (start, end) in enumerate(((1, 0), (1, 2), (2, 3))):
        along = vertices[:, end] - vertices[:, start]
        along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
        stations = _stations(float(lengths[link]), chain, middle=link == 1, barbs=bool(lengths[[0, 2]].any()))
        points = vertices[:, start, None] + stations[:, None] * along[:, None]
        if link == 1 and chain.bulge:
            across = np.cross(plane_frames(vertices)[:, 2], along)[:, None]
            count = 2 * math.ceil(chain.bulge / chain.diameter) + 1  # rows side by side in the plane
            parts += [points + side * across for side in np.linspace(-chain.bulge, chain.bulge, count)]
        else:
            parts.append(points)
    return _side_by_side(np.concatenate(parts, axis=1), vertices, chain).reshape(len(vertices), -1, 3)


def _side_by_side(points: Floats, vertices: Floats, chain: Chain) -> Floats:
    """Repeat points (N, P, 3) of smarticles in R rows shifted along each smarticle's normal: (N, R, P, 3)."""
    if chain.rows == 1:
        return points[:, None]
    reach = (chain.width - chain.diameter) / 2
    offsets = np.linspace(-reach, reach, chain.rows)[:, None] * plane_frames(vertices)[:, None, 2]
    shifted: Floats = points[:, None] + offsets[:, :, None]
    return shifted


def _stations(length: float, chain: Chain, *, middle: bool, barbs: bool) -> Floats:
    """Return the distances (S,) [m] of the sphere centres of a link from its first hinge.

    `middle`: the link is the middle link; `barbs`: the smarticle has barbs.
    """
    if middle:
        inset = 0.0 if barbs else chain.diameter / 2
        start, end = inset, length - inset
    else:
        start, end = chain.diameter * (1 + _CLEARANCE), length - chain.diameter / 2
        if chain.bulge:
            start = (chain.bulge + start) / math.cos(_INWARDS)
        if end <= 0:
            return np.empty(0)
        if end <= start:
            return np.array([end])
    return np.linspace(start, end, max(2, math.ceil((end - start) / chain.pitch - 1e-9) + 1))
