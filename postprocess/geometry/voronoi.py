"""Compute local packing fractions from approximate set-Voronoi cells of the smarticles."""

from itertools import chain

import numpy as np
from scipy.spatial import QhullError, Voronoi, cKDTree

from dem.errors import InputError
from postprocess.geometry.links import (
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

TOGETHER = 60_000  #: Most points per call of Qhull, which takes about 15 kB of memory per point


def local_packing(
    vertices: Vertices, container: Region, region: Region, *, solid_volume: float, spacing: float | None = None
) -> tuple[float, Floats]:
    """Compute the packing fraction in a region by the set-Voronoi cells of its smarticles.

    The packing fraction is the total solid volume of these smarticles over the total volume of their cells [-]. The
    function also returns the cell volumes of all smarticles, (N,) [m³]; infinite or 0 for a smarticle without a cell.

    The set-Voronoi cell of a smarticle is the volume that is nearer to it than to any other smarticle. Here it is the
    union of the Voronoi cells of points along its centrelines. Mirror images of the points bound the cells at floor,
    wall and lid; the lid lies at the highest point of the smarticles with their centre of mass inside the container.
    UndefinedMeasureError if no smarticle is in the region, or one of them has no closed cell.

    Args:
        container: The container from its floor to the pile's height.
        region: Region in which the centres of mass of the counted smarticles lie.
        solid_volume: Volume of one smarticle [m³].
        spacing: Largest distance of points along a link [m]; w/8 if not given. In piles of 270 the result for w/8
            deviates by at most 0.5 % from the limit of small spacings.

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
    contained = vertices[centres[:, 2] < container.top]
    # Half a spacing higher, so that the highest point does not coincide with its image.
    lid = float(contained[:, :, 2].max(initial=container.top)) + spacing / 2
    points, owners = _sample(vertices, spacing)
    x, y = points[:, :2].T
    # No image would bound the cells of points outside the container.
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
    return float(interior.sum() * solid_volume / total), volumes


def _sample(vertices: Floats, spacing: float) -> tuple[Floats, Whole]:
    """Return points along all links, (n, 3) [m], and the index of the smarticle of each point, (n,).

    Successive points of a link are at most `spacing` [m] apart; none lies at a hinge.
    """
    # Rounding of lengths must not give one of several equal links an extra point.
    cuts = np.ceil(link_lengths(vertices) / spacing - 1e-6).astype(int).ravel()
    link = np.repeat(np.arange(len(cuts)), cuts)
    step = np.arange(len(link)) - np.repeat(np.cumsum(cuts) - cuts, cuts)
    fraction = (step + 0.5) / cuts[link]
    start = vertices[:, :-1].reshape(-1, 3)[link]
    along = np.diff(vertices, axis=1).reshape(-1, 3)[link]
    return start + fraction[:, None] * along, link // 3


def _mirrored(points: Floats, container: Region, lid: float, band: float) -> Floats:
    """Return mirror images of points nearer than `band` [m] to floor, wall, or lid at the height `lid`."""
    floor = points[points[:, 2] < container.bottom + band] * [1, 1, -1]
    floor[:, 2] += 2 * container.bottom
    top = points[points[:, 2] > lid - band] * [1, 1, -1]
    top[:, 2] += 2 * lid
    distance = np.hypot(*points[:, :2].T)
    # A point on the axis has no direction to the wall.
    near = (distance > container.radius - band) & (distance > 1e-3 * container.radius)
    wall = points[near].copy()
    stretch = (2 * container.radius - distance[near]) / distance[near]
    wall[:, :2] *= stretch[:, None]
    return np.concatenate([floor, top, wall])


def _cell_volumes(points: Floats, count: int, *, reach: float, together: int = TOGETHER) -> Floats:
    """Compute the Voronoi volumes (count,) [m³] of the first `count` points among points (n, 3) [m].

    The volume of an open cell is infinite. To limit memory the first `count` points are divided into slabs along x,
    with at most `together` points each. The cells of a slab are computed from all points that are at most `reach` [m]
    away from it along x.

    A corner of a cell is the centre of a sphere through the cell's own point that contains no other point. A cell is
    therefore final if the spheres of all its corners lie inside the searched region. All other cells are computed again
    from the points within a radius of 2 `reach` around their own points. This radius is doubled until it exceeds the
    diameters of these spheres, or all points are searched.
    """
    if count <= together:
        return _cells(points)[0][:count]
    volumes, tree, across = np.empty(count), cKDTree(points), points[:, 0]
    for slab in np.array_split(np.argsort(across[:count], kind="stable"), -(-count // together)):
        low, high = across[slab[0]] - reach, across[slab[-1]] + reach
        near, missing, radius = np.flatnonzero((across >= low) & (across <= high)), slab, reach
        cells, _, lowest, highest = _cells(points[near])
        final = (lowest > low) & (highest < high)
        while True:
            places = np.searchsorted(near, missing)
            known = final[places]
            volumes[missing[known]] = cells[places[known]]
            missing, radius = missing[~known], 2 * radius
            if not len(missing):
                break
            near = np.unique(np.concatenate(tree.query_ball_point(points[missing], radius)).astype(np.int64))
            cells, farthest, *_ = _cells(points[near])
            final = (2 * farthest < radius) | (len(near) == len(points))
    return volumes


def _cells(points: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Compute the Voronoi cells of points (n, 3) [m].

    A cell is the union of pyramids with their apex at its point and a face as base. The height of a pyramid is half the
    distance to the neighbour behind the face. Each corner of a cell is the centre of a sphere through the cell's point.

    Returns:
        Four arrays:
        Volumes of the cells, (n,) [m³]; infinite for open cells.
        Largest radius of the spheres of each cell: the distance from its point to its farthest corner, (n,) [m].
        Least x of the spheres of each cell, (n,) [m].
        Greatest x of the spheres of each cell, (n,) [m].
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
    # Corners relative to one of the face: cross products of long vectors would lose digits.
    reference = diagram.vertices[np.repeat(corners[starts], sizes)]
    areas = np.add.reduceat(
        np.cross(diagram.vertices[corners] - reference, diagram.vertices[followers] - reference), starts
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
