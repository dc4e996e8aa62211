"""Find pairs of smarticles that touch or are close to each other, and smarticles that touch nothing.

A frame holds the number of contacts of each smarticle as counted by the engine, not the pairs. The pairs are found
from the vertices. Recorded forces at contacts are the subject of `force_chains`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from dem.errors import InputError
from dem.record.document import Kind
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import (
    Chain,
    Flags,
    Floats,
    Vertices,
    Whole,
    checked_vertices,
    spheres,
    strands,
)
from postprocess.geometry.segments import close_segments, inner_axes
from postprocess.measures.registry import FrameMeasure, Quantity, in_one_cylinder

# Pairs of links per block, which limits memory.
_CHUNK = 200_000
# Largest distance from floor or wall that counts as contact, over the sphere's radius: a wall of 64 facets deviates
# from a circle by 0.1 % of its radius.
_REACH = 1.05


class ContactPairs(NamedTuple):
    """P pairs of smarticles that touch or are close to each other; the edges of a contact graph."""

    i: Whole  #: (P,) int64, the lower index of each pair
    j: Whole  #: (P,) int64, the higher index of each pair
    distance: Floats  #: (P,) float64 [m], least distance between axes or sphere centres


def contact_pairs(vertices: Vertices, distance: float) -> ContactPairs:
    """Find pairs of smarticles whose centrelines are at most a distance [m] apart, sorted by i, then j.

    Boxes of cross-section t1 × t2 can touch at centreline distances from min(t1, t2) to (t1² + t2²)^½. InputError if
    the distance is not above 0.
    """
    vertices = checked_vertices(vertices)
    if not (math.isfinite(distance) and distance > 0):
        raise InputError(f"distance must be above 0 m: got {distance} m; a link's thickness is usual")
    count = len(vertices)
    starts, ends = vertices[:, :-1].reshape(-1, 3), vertices[:, 1:].reshape(-1, 3)
    a, b = close_segments(starts, ends, np.repeat(np.arange(count), 3), distance)
    gaps = np.empty(len(a))
    for start in range(0, len(a), _CHUNK):
        p, q = a[start : start + _CHUNK], b[start : start + _CHUNK]
        gaps[start : start + _CHUNK] = segment_distances(starts[p], ends[p], starts[q], ends[q])
    near = gaps <= distance
    return _merged(a[near] // 3, b[near] // 3, gaps[near], count)


def pairs_in_contact(frame: Frame, run: Run) -> ContactPairs:
    """Find the pairs of smarticles that touch in the run's engine, sorted by i, then j.

    Two smarticles touch if a sphere or strand (the volume that a sphere sweeps along a link) of one touches one of the
    other.

    On the engine `links` the number of pairs equals that which the engine itself counts, in all phases. On YADE the two
    numbers are equal at rest after pouring; they differ by at most 1.4 % while pouring and 0.7 % at rest after shaking.
    While a pile is shaken, this function finds 6 to 11 % more pairs than YADE. YADE counts only contacts with a force,
    and spheres that still overlap while they move apart may have none. These percentages are from runs of 40 smarticles
    at draft, 60 at standard and 30 at reference fidelity.

    The least distance is that of two sphere centres or of two strands' axes.
    """
    vertices, chain = checked_vertices(frame.vertices), chain_of(run)
    if chain.pitch > 0:
        return pairs_of_spheres(spheres(vertices, chain), chain.diameter)
    # Recorded vertices are rounded, which would lose contacts of zero overlap.
    return pairs_of_strands(vertices, chain, chain.diameter * (1 + 1e-9))


def pairs_of_strands(vertices: Floats, chain: Chain, distance: float) -> ContactPairs:
    """Find the pairs of N smarticles of which two strands' axes are at most `distance` [m] apart.

    Vertices (N, 4, 3) are in [m]. Chains of spheres count as the strands that envelop them.
    """
    each = strands(vertices, chain)
    pairs = contact_pairs(each.reshape(-1, 4, 3), distance)
    return _merged(pairs.i // chain.rows, pairs.j // chain.rows, pairs.distance, len(vertices))


def chain_of(run: Run) -> Chain:
    """Return the sphere chain or strands by which the engine of a run represents a smarticle."""
    fidelity = run.scene.get("fidelity")
    rows = 1 if fidelity is None else fidelity["rows"]
    pitch = 1.0 if fidelity is None else fidelity["pitch"]
    return Chain(
        diameter=run.manifest.sphere_diameter_m,
        rows=rows,
        width=run.manifest.thickness_normal_m,
        pitch=pitch * run.manifest.sphere_diameter_m if run.manifest.engine != "links" else 0.0,
        bulge=run.manifest.bulge_m,
    )


class Strands(NamedTuple):
    """K strands: spheres that are swept along straight axes, and represent the bodies of a frame."""

    axes: Floats  #: (K, 2, 3) float64 [m], both ends of each axis; they coincide for links of length 0
    body: Whole  #: (K,) int64, index of the body
    link: Whole  #: (K,) int64, number of the link, or bar, in its body
    diameter: Floats  #: (K,) float64 [m], diameter of the swept sphere


def strands_of(frame: Frame, run: Run) -> Strands:
    """Return the strands that represent all bodies of a frame in the run's engine.

    Those of the engine `links` are exact: strands touch where they touch in the run. For an engine with chains of
    spheres they are the envelopes of the chains.
    """
    chain = chain_of(run)
    if frame.bars is None:
        each = strands(checked_vertices(frame.vertices), chain)
        axes = np.stack([each[:, :, :-1], each[:, :, 1:]], axis=3)
        body, _, link = np.indices(axes.shape[:3]).reshape(3, -1)
        return Strands(axes.reshape(-1, 2, 3), body, link, np.full(len(body), chain.diameter))
    kinds, kind = run.manifest.kinds or (), frame.kind[frame.body]
    diameter = np.array([one.sphere_diameter_m for one in kinds])[kind]
    offsets = [_offsets(one, chain.rows) for one in kinds]
    own = np.repeat(np.arange(len(kind)), [len(offsets[k]) for k in kind])
    aside = np.concatenate([np.zeros(0), *(offsets[k] for k in kind)])
    # The round caps of filaments reach beyond their ends.
    caps = np.array([one.capped for one in kinds])[kind]
    inner = inner_axes(frame.segments, np.where(caps, 0.0, diameter / 2))
    axes = inner[own] + (aside[:, None] * frame.bars.normals[own])[:, None]
    return Strands(axes, frame.body[own], frame.link[own], diameter[own])


def _offsets(kind: Kind, rows: int) -> Floats:
    """Return the offsets (n,) [m] of a bar's strands from its axis, along its normal.

    A bar with a flat side wider than a strand has n = `rows` strands; every other bar has one strand on its axis.

    Source: `dem.scene.scene.Scene.mixture`, `dem.engine.links.shapes.rigid_shape`.
    """
    reach = (kind.thickness_normal_m - kind.sphere_diameter_m) / 2
    return np.linspace(-reach, reach, rows) if rows > 1 and reach > 0 and not kind.round else np.zeros(1)


def pairs_of_spheres(centres: Floats, diameter: float) -> ContactPairs:
    """Find pairs of smarticles that have touching spheres, by centres (N, S, 3) and diameter [m]."""
    count, each, _ = centres.shape
    points = centres.reshape(-1, 3)
    pairs = cKDTree(points).query_pairs(diameter, output_type="ndarray").astype(np.int64)
    pairs = pairs[pairs[:, 0] // each != pairs[:, 1] // each]
    gaps = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    return _merged(pairs[:, 0] // each, pairs[:, 1] // each, gaps, count)


def _merged(a: Whole, b: Whole, gaps: Floats, count: int) -> ContactPairs:
    """Merge all contacts of smarticles a[k] and b[k] into one pair with the least gap; drop a[k] == b[k].

    `a`, `b` and `gaps` [m] have the shape (n,); `count` is the number of smarticles.
    """
    apart = a != b
    a, b, gaps = a[apart], b[apart], gaps[apart]
    keys, which = np.unique(np.minimum(a, b) * count + np.maximum(a, b), return_inverse=True)
    least = np.full(len(keys), np.inf)
    np.minimum.at(least, which, gaps)
    return ContactPairs(keys // max(count, 1), keys % max(count, 1), least)


def segment_distances(p0: Floats, p1: Floats, q0: Floats, q1: Floats) -> Floats:
    """Compute the least distances (n,) [m] between line segments p0 p1 and q0 q1 with ends (n, 3) [m].

    The least distance lies at one of the four ends, or between points inside both segments. The smallest of these five
    distances is right for parallel segments and for segments without length, too.
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
    # For nearly parallel segments the division would amplify rounding; their least distance lies at an end.
    skew = determinant > 1e-12 * uu * vv
    safe = np.where(skew, determinant, 1.0)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    inside = skew & (s > 0) & (s < 1) & (t > 0) & (t < 1)
    across = np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1)
    distances: Floats = np.where(inside, np.minimum(across, ends), ends)
    return distances


def _point_distances(points: Floats, origins: Floats, along: Floats) -> Floats:
    """Compute the distances (n,) [m] of points (n, 3) from segments with one end at `origins` (n, 3) [m].

    The other ends are at `origins + along`.
    """
    offset = points - origins
    fraction = np.clip(_dot(offset, along) / np.maximum(_dot(along, along), 1e-300), 0, 1)
    distances: Floats = np.linalg.norm(offset - fraction[:, None] * along, axis=1)
    return distances


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("nc,nc->n", a, b)
    return product


def without_support(
    vertices: Vertices, contacts: ArrayLike, *, chain: Chain, floor_z: float, wall_radius: float | None
) -> Flags:
    """Return which of N smarticles touch no other smarticle, no floor and no wall (rattlers): (N,) bool.

    Smarticles whose contacts carry no force are not found, because frames do not record whether a contact carries a
    force.

    Args:
        vertices: (N, 4, 3) [m].
        contacts: (N,) number of other smarticles that each smarticle touches, `Frame.contacts`.
        chain: Sizes of the strands.
        floor_z: Height of the floor [m].
        wall_radius: Radius of the wall around the axis x = y = 0 [m]; None: there is no wall.

    Source:
        Agnolin & Roux, Phys. Rev. E 76, 061302 (2007): grains that carry no force are left out of the coordination
        number.
    """
    held = np.asarray(contacts) > 0
    held |= on_floor(vertices, chain=chain, floor_z=floor_z)
    if wall_radius is not None:
        held |= at_wall(vertices, chain=chain, wall_radius=wall_radius).any(axis=1)
    return ~held


def on_floor(vertices: Vertices, *, chain: Chain, floor_z: float) -> Flags:
    """Return which of N smarticles touch the floor: (N,) bool.

    `chain` has the sizes of their strands, `floor_z` is the height of the floor [m].
    """
    axes = strands(checked_vertices(vertices), chain)
    touching: Flags = axes[..., 2].min(axis=(1, 2)) - floor_z <= _REACH * chain.diameter / 2
    return touching


def at_wall(vertices: Vertices, *, chain: Chain, wall_radius: float) -> Flags:
    """Return which vertices touch the wall: (N, 4) bool.

    A straight link touches a round wall with its ends first. `chain` has the sizes of the strands, `wall_radius` is the
    radius of the wall around the axis x = y = 0 [m].
    """
    axes = strands(checked_vertices(vertices), chain)
    farthest = np.hypot(axes[..., 0], axes[..., 1]).max(axis=1)
    touching: Flags = wall_radius - farthest <= _REACH * chain.diameter / 2
    return touching


def _rattlers_of(frame: Frame, run: Run) -> tuple[float]:
    loose = without_support(
        frame.vertices,
        frame.contacts,
        chain=chain_of(run),
        floor_z=frame.floor_z,
        wall_radius=run.manifest.container_radius_m if run.manifest.walled(frame.phase) else None,
    )
    return (float(loose.mean()),)


MEASURES = (
    FrameMeasure(
        name="contacts",
        place=50,
        quantities=(Quantity("contacts mean", "-"),),
        take=lambda frame, _: (float(frame.contacts.mean()),),
    ),
    FrameMeasure(
        name="contact statistics",
        place=51,
        quantities=(Quantity("contacts SD", "-"), Quantity("contacts most", "-"), Quantity("without contact", "-")),
        take=lambda frame, _: (
            float(frame.contacts.std()),
            float(frame.contacts.max()),
            float((frame.contacts == 0).mean()),
        ),
    ),
    FrameMeasure(
        name="rattlers",
        place=52,
        quantities=(Quantity("rattlers", "-"),),
        take=_rattlers_of,
        available_for=in_one_cylinder,
    ),
)
