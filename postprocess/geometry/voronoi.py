"""Local packing: the set-Voronoi cell of each smarticle, approximately."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from scipy.spatial import QhullError, Voronoi, cKDTree

from dem.errors import InputError
from postprocess.geometry.links import (
    Flags,
    Floats,
    UndefinedMeasureError,
    Vertices,
    Whole,
    bounding_spheres,
    centres_of_mass,
    checked_vertices,
    link_lengths,
)
from postprocess.geometry.voxel import Region

TOGETHER = 60_000  #: Most points per call of Qhull; each takes about 15 kB of memory during it


@dataclass(frozen=True, kw_only=True, eq=False)
class LocalPacking:
    """Set-Voronoi cells of the smarticles of a pile."""

    volumes: Floats = field(repr=False)  #: (N,) [m³], of the cell of each smarticle; infinite or zero where it has none
    interior: Flags = field(repr=False)  #: (N,) bool, which smarticles lie in the region asked for
    value: float  #: Solid volume over cell volume of the interior ones together [-]


def local_packing(
    vertices: Vertices, container: Region, region: Region, *, solid_volume: float, spacing: float | None = None
) -> LocalPacking:
    """Compute the packing fraction of smarticles in a region by the volume nearer to them than to others.

    Points are sampled along the centrelines, and their Voronoi cells united per smarticle. That is the set-Voronoi cell
    of thin links, up to the spacing and to differences of thickness. Images of the points mirrored in floor, wall and
    lid bound the cells there; the wall is thereby a polygon around the circle, the lid lies at the highest point of the
    smarticles below the container's top. Only smarticles with their centre of mass in the region count, so that walls
    and lid matter little.

    Args:
        container: The container from its floor to the pile's height.
        region: The smarticles with their centre of mass in here are counted.
        solid_volume: Volume of one smarticle [m³].
        spacing: Largest distance of points along a link [m]; w/8 if not given, which is within 0.5 % of the
            limit of close points in piles of 270.

    Raises:
        InputError: Bad spacing.
        UndefinedMeasureError: No smarticle in the region, or one of them has no closed cell.

    Source:
        Schaller et al., Philosophical Magazine 93 (2013) 3993 (set Voronoi diagrams).
    """
    vertices = checked_vertices(vertices)
    centres = centres_of_mass(vertices)
    interior = region.contains(centres)
    if not np.any(interior):
        raise UndefinedMeasureError("no smarticle has its centre of mass in the inner region of the pile")
    if spacing is None:
        spacing = float(np.median(link_lengths(vertices)[:, 1])) / 8
    if not spacing > 0:
        raise InputError(f"spacing of the points along the links must be above 0 m: got {spacing} m")
    below = vertices[centres[:, 2] < container.top]
    # A little higher, lest the highest point coincide with its own image.
    lid = float(below[:, :, 2].max(initial=container.top)) + spacing / 2
    points, owners = _sample(vertices, spacing)
    x, y = points[:, :2].T
    # Points outside the container have no image that would bound their cells.
    kept = (np.hypot(x, y) < container.radius) & (points[:, 2] > container.bottom)
    kept &= points[:, 2] < lid
    points, owners = points[kept], owners[kept]
    band = 2 * float(bounding_spheres(vertices)[1].max())
    images = _mirrored(points, container, lid, band)
    try:
        cells = _cell_volumes(np.concatenate([points, images]), len(points), reach=band / 4)
    except QhullError:
        msg = f"{len(vertices)} smarticles, flat or alone, do not part the container into cells: the pile is too thin"
        raise UndefinedMeasureError(msg) from None
    volumes = np.zeros(len(vertices))
    np.add.at(volumes, owners, cells)
    total = float(volumes[interior].sum())
    if not np.isfinite(total):
        raise UndefinedMeasureError("a smarticle in the inner region has no closed Voronoi cell: the pile is too thin")
    value = float(interior.sum() * solid_volume / total)
    return LocalPacking(volumes=volumes, interior=interior, value=value)


def _sample(vertices: Floats, spacing: float) -> tuple[Floats, Whole]:
    """Place points (n, 3) evenly along each link, none at a hinge; return them and their smarticles (n,)."""
    # Lengths differ by rounding, which must not give one link a point more than its equals.
    cuts = np.ceil(link_lengths(vertices) / spacing - 1e-6).astype(int).ravel()
    link = np.repeat(np.arange(len(cuts)), cuts)
    step = np.arange(len(link)) - np.repeat(np.cumsum(cuts) - cuts, cuts)
    share = (step + 0.5) / cuts[link]
    start = vertices[:, :-1].reshape(-1, 3)[link]
    along = np.diff(vertices, axis=1).reshape(-1, 3)[link]
    return start + share[:, None] * along, link // 3


def _mirrored(points: Floats, container: Region, lid: float, band: float) -> Floats:
    """Mirror the points nearer than `band` to floor, lid or wall."""
    floor = points[points[:, 2] < container.bottom + band] * [1, 1, -1]
    floor[:, 2] += 2 * container.bottom
    top = points[points[:, 2] > lid - band] * [1, 1, -1]
    top[:, 2] += 2 * lid
    distance = np.hypot(*points[:, :2].T)
    # On the axis itself there is no direction to the wall.
    near = (distance > container.radius - band) & (distance > 1e-3 * container.radius)
    wall = points[near].copy()
    stretch = (2 * container.radius - distance[near]) / distance[near]
    wall[:, :2] *= stretch[:, None]
    return np.concatenate([floor, top, wall])


def _cell_volumes(points: Floats, count: int, *, reach: float, together: int = TOGETHER) -> Floats:
    """Compute volumes (count,) of the Voronoi cells of the first of points (n, 3) [m], infinite for open ones.

    Cells are found slab by slab along x, among all points within a reach [m] of it. A point's cell among them is its
    cell among all points where the spheres around its corners through the point, in which there must be no other, do
    not go beyond. The few others are found again among all points within twice the reach of one of them, where those
    spheres lie if the reach is twice the distance of the farthest corner; and so on.
    """
    if count <= together:
        return _cells(points)[0][:count]
    volumes, tree, across = np.empty(count), cKDTree(points), points[:, 0]
    for slab in np.array_split(np.argsort(across[:count], kind="stable"), -(-count // together)):
        low, high = across[slab[0]] - reach, across[slab[-1]] + reach
        near, wanted, now = np.flatnonzero((across >= low) & (across <= high)), slab, reach
        found, _, lowest, highest = _cells(points[near])
        sure = (lowest > low) & (highest < high)
        while True:
            places = np.searchsorted(near, wanted)
            known = sure[places]
            volumes[wanted[known]] = found[places[known]]
            wanted, now = wanted[~known], 2 * now
            if not len(wanted):
                break
            near = np.unique(np.concatenate(tree.query_ball_point(points[wanted], now)).astype(np.int64))
            found, farthest, *_ = _cells(points[near])
            sure = (2 * farthest < now) | (len(near) == len(points))
    return volumes


def _cells(points: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Compute the Voronoi cells of all points.

    A cell is the sum of the pyramids from its point over its faces, whose height is half the distance to the neighbour.

    Returns:
        Volumes (n,) [m³], distances of the farthest corner, least and greatest x of the spheres around the corners
        through the point [m]; lengths are infinite for open cells.
    """
    diagram = Voronoi(points)
    pairs = np.asarray(diagram.ridge_points)
    faces = diagram.ridge_vertices
    sizes = np.fromiter(map(len, faces), dtype=np.int64, count=len(faces))
    corners = np.fromiter(chain.from_iterable(faces), dtype=np.int64, count=sizes.sum())
    starts = np.cumsum(sizes) - sizes
    open_faces = np.minimum.reduceat(corners, starts) < 0
    followers = np.roll(corners, -1)
    followers[starts + sizes - 1] = corners[starts]
    # Relative to a corner of the face: cross products of far-away vectors would cancel badly.
    reference = diagram.vertices[np.repeat(corners[starts], sizes)]
    areas = np.add.reduceat(
        np.cross(diagram.vertices[corners] - reference, diagram.vertices[followers] - reference),
        starts,
    )
    area = np.linalg.norm(areas, axis=1) / 2
    height = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1) / 2
    pyramids = np.where(open_faces, np.inf, area * height / 3)
    volumes = np.zeros(len(points))
    np.add.at(volumes, pairs.ravel(), np.repeat(pyramids, 2))
    distance = np.linalg.norm(diagram.vertices[corners] - np.repeat(points[pairs[:, 0]], sizes, axis=0), axis=1)
    place = diagram.vertices[corners, 0]

    def greatest(of_corners: Floats) -> Floats:
        of_faces = np.where(open_faces, np.inf, np.maximum.reduceat(of_corners, starts))
        found = np.full(len(points), -np.inf)
        np.maximum.at(found, pairs.ravel(), np.repeat(of_faces, 2))
        return found

    return volumes, greatest(distance), -greatest(distance - place), greatest(distance + place)
