"""Find which smarticles touch, lie close to each other, or touch nothing.

Contacts are counted by the engine and pairs found from vertices: a frame holds how many others each smarticle touches,
not which. Where a scene asks for the forces at contacts these are recorded beside, see `force_chains`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import (
    Chain,
    Flags,
    Floats,
    Vertices,
    Whole,
    checked_vertices,
    link_lengths,
    spheres,
    strands,
    swept_axes,
)
from postprocess.measures.registry import FrameMeasure, Quantity, in_space

# Pairs of links held in memory at a time.
_CHUNK = 200_000
# How far from floor and wall, in radii of the sphere, something still touches them: walls of 64 facets stand off a
# circle by 0.1 % of its radius.
_REACH = 1.05


class ContactPairs(NamedTuple):
    """Pairs of smarticles whose centrelines come close; the edges of a contact graph."""

    i: Whole  #: (P,) int64, the lower index
    j: Whole  #: (P,) int64, the higher index
    distance: Floats  #: (P,) float64 [m], the least distance of their centrelines


def contact_pairs(vertices: Vertices, distance: float) -> ContactPairs:
    """Find pairs of smarticles whose centrelines come as close as a distance [m], sorted by i, then j.

    With spheres of diameter d along the links, d finds the pairs that touch; boxes of section t1 × t2 can touch at any
    distance from min(t1, t2) to (t1² + t2²)^½.

    Raises:
        InputError: Bad distance.
    """
    vertices = checked_vertices(vertices)
    if not (math.isfinite(distance) and distance > 0):
        raise InputError(f"distance must be above 0 m: got {distance} m; a link's thickness is usual")
    count = len(vertices)
    starts, ends = vertices[:, :-1].reshape(-1, 3), vertices[:, 1:].reshape(-1, 3)
    a, b = _close_links(starts, ends, link_lengths(vertices).ravel(), distance)
    gaps = np.empty(len(a))
    for start in range(0, len(a), _CHUNK):
        p, q = a[start : start + _CHUNK], b[start : start + _CHUNK]
        gaps[start : start + _CHUNK] = segment_distances(starts[p], ends[p], starts[q], ends[q])
    near = gaps <= distance
    return _merged(a[near] // 3, b[near] // 3, gaps[near], count)


def touching_pairs(vertices: Vertices, diameter: float) -> ContactPairs:
    """Find pairs of smarticles that touch where each is what a sphere of a diameter [m] sweeps along its links, sorted.

    On the engine "links" with links of one row these are the pairs that touch. YADE's chains have gaps between their
    beads, where others rest, and there this finds too many, see `pairs_in_contact`, which knows a run's chains.

    Raises:
        InputError: Bad diameter.
    """
    vertices = checked_vertices(vertices)
    if not (math.isfinite(diameter) and diameter > 0):
        raise InputError(f"diameter must be above 0 m: got {diameter} m; give Run.sphere_diameter")
    # Contacts that only just touch are lost to the rounding of vertices otherwise.
    return contact_pairs(swept_axes(vertices, diameter), diameter * (1 + 1e-9))


def pairs_in_contact(frame: Frame, run: Run) -> ContactPairs:
    """Find pairs of smarticles that touch by their shapes in the run's engine, sorted by i, then j.

    In three runs on YADE (40 smarticles of draft fidelity, pitch 1.3; 60 of standard, pitch 1; 30 of reference, two
    rows; poured and shaken) this finds 1.000 times the engine's pairs at rest after pouring, every smarticle with as
    many as the engine said, 1.005 to 1.014 while poured, 1.000 to 1.007 at rest again, and 1.06, 1.06 and 1.11 while
    shaken, where contacts that open may carry no force. Of the first two `touching_pairs`, which knows no gaps between
    beads, finds 1.2 at rest and 4 shaken; axes within 1.05 diameters, 1.4 and 6. On links of one strand (40 of draft)
    and of two (40 of reference) it is 1.000 in every phase.

    Returns:
        The pairs; distances are those of spheres or strands.

    Raises:
        InputError: The scene of the run cannot be read.
    """
    vertices, chain = checked_vertices(frame.vertices), chain_of(run)
    if chain.pitch > 0:
        return pairs_of_spheres(spheres(vertices, chain), chain.diameter)
    each = strands(vertices, chain)
    # Contacts that only just touch are lost to the rounding of vertices otherwise.
    pairs = contact_pairs(each.reshape(-1, 4, 3), chain.diameter * (1 + 1e-9))
    return _merged(pairs.i // chain.rows, pairs.j // chain.rows, pairs.distance, len(vertices))


def chain_of(run: Run) -> Chain:
    """Return the chain that stands for a smarticle of a run.

    Raises:
        InputError: The scene of the run cannot be read.
    """
    fidelity = run.scene.get("fidelity")
    rows = 1 if fidelity is None else fidelity["rows"]
    pitch = 1.0 if fidelity is None else fidelity["pitch"]
    return Chain(
        diameter=run.manifest.sphere_diameter_m,
        rows=rows,
        width=run.manifest.thickness_normal_m,
        pitch=pitch * run.manifest.sphere_diameter_m if run.manifest.engine == "yade" else 0.0,
        bulge=run.manifest.bulge_m,
    )


def pairs_of_spheres(centres: Floats, diameter: float) -> ContactPairs:
    """Find pairs of smarticles of whose spheres, of centres (N, S, 3) [m] and one diameter [m], two touch."""
    count, each, _ = centres.shape
    points = centres.reshape(-1, 3)
    pairs = cKDTree(points).query_pairs(diameter, output_type="ndarray").astype(np.int64)
    pairs = pairs[pairs[:, 0] // each != pairs[:, 1] // each]
    gaps = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    return _merged(pairs[:, 0] // each, pairs[:, 1] // each, gaps, count)


def _merged(a: Whole, b: Whole, gaps: Floats, count: int) -> ContactPairs:
    """Keep one pair for all contacts of two smarticles, with the least distance; none with itself."""
    apart = a != b
    a, b, gaps = a[apart], b[apart], gaps[apart]
    keys, which = np.unique(np.minimum(a, b) * count + np.maximum(a, b), return_inverse=True)
    least = np.full(len(keys), np.inf)
    np.minimum.at(least, which, gaps)
    return ContactPairs(keys // max(count, 1), keys % max(count, 1), least)


def segment_distances(p0: Floats, p1: Floats, q0: Floats, q1: Floats) -> Floats:
    """Compute least distances (n,) [m] of segments p0–p1 from segments q0–q1, ends (n, 3) [m].

    Either the least distance is at an end of one segment, or it is that of the two lines and is reached inside both.
    Taking the best of the five holds for parallel segments and for segments of no length as well.
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
    distances: Floats = np.where(inside, np.minimum(across, ends), ends)
    return distances


def _close_links(starts: Floats, ends: Floats, lengths: Floats, distance: float) -> tuple[Whole, Whole]:
    """Find pairs of links of different smarticles whose bounding spheres come close enough."""
    if len(starts) == 0:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    middles = (starts + ends) / 2
    pairs = cKDTree(middles).query_pairs(lengths.max() + distance, output_type="ndarray")
    a, b = pairs.astype(np.int64).T
    apart = np.linalg.norm(middles[a] - middles[b], axis=1)
    keep = (a // 3 != b // 3) & (apart <= (lengths[a] + lengths[b]) / 2 + distance)
    return a[keep], b[keep]


def _point_distances(points: Floats, origins: Floats, along: Floats) -> Floats:
    """Compute distances (n,) [m] of points from segments given by an end and a vector."""
    offset = points - origins
    share = np.clip(_dot(offset, along) / np.maximum(_dot(along, along), 1e-300), 0, 1)
    distances: Floats = np.linalg.norm(offset - share[:, None] * along, axis=1)
    return distances


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("nc,nc->n", a, b)
    return product


def without_support(
    vertices: Vertices, contacts: ArrayLike, *, diameter: float, floor_z: float, wall_radius: float | None
) -> Flags:
    """Find rattlers (N,): smarticles that nothing holds, neither another one, nor the floor, nor the wall.

    They carry no force for certain. One that does touch something may carry none as well: that would take the forces,
    which frames do not hold.

    Args:
        contacts: (N,) how many other smarticles each one touches, `Frame.contacts`.
        diameter: Of the sphere that sweeps the links [m], `Run.sphere_diameter`.
        floor_z: Height of the floor [m].
        wall_radius: Of the wall about the axis x = y = 0 [m]; None: there is no wall.

    Source:
        Agnolin & Roux, Phys. Rev. E 76, 061302 (2007): grains that carry no force are left out of the coordination
        number.
    """
    held = np.asarray(contacts) > 0
    held |= on_floor(vertices, diameter=diameter, floor_z=floor_z)
    if wall_radius is not None:
        held |= at_wall(vertices, diameter=diameter, wall_radius=wall_radius).any(axis=1)
    return ~held


def on_floor(vertices: Vertices, *, diameter: float, floor_z: float) -> Flags:
    """Find smarticles (N,) that touch the floor at a height [m]; arguments as `without_support`."""
    axes = swept_axes(checked_vertices(vertices), diameter)
    touching: Flags = axes[..., 2].min(axis=1) - floor_z <= _REACH * diameter / 2
    return touching


def at_wall(vertices: Vertices, *, diameter: float, wall_radius: float) -> Flags:
    """Find vertices (N, 4) that touch the wall: a straight link does so at its ends first.

    Arguments as `without_support`.
    """
    axes = swept_axes(checked_vertices(vertices), diameter)
    touching: Flags = wall_radius - np.hypot(axes[..., 0], axes[..., 1]) <= _REACH * diameter / 2
    return touching


def _statistics_of(frame: Frame, _: Run) -> tuple[float, float, float]:
    return float(frame.contacts.std()), float(frame.contacts.max()), float((frame.contacts == 0).mean())


def _rattlers_of(frame: Frame, run: Run) -> tuple[float]:
    loose = without_support(
        frame.vertices,
        frame.contacts,
        diameter=run.manifest.sphere_diameter_m,
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
        take=_statistics_of,
    ),
    FrameMeasure(
        name="rattlers",
        place=52,
        quantities=(Quantity("rattlers", "-"),),
        take=_rattlers_of,
        # The walls of a mould's tiers are not one wall.
        available_for=lambda run: in_space(run) and run.manifest.container_tiers == 1,
    ),
)
