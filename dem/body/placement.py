"""Poses of bodies: random poses without overlap, and poses fitted to recorded vertices."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from dem.arrays import Array, Numbers
from dem.body.kinds import Body
from dem.body.linear import applied, eigen_symmetric, turned
from dem.body.loops import Curves, bars_of, loops_of
from dem.body.particle import Boxes
from dem.errors import RunError

CLEARANCE = 0.02  # free distance kept between surfaces, in sphere diameters
ATTEMPTS = 200  # poses tried per smarticle before the slab is made higher
GROWTH = 0.25  # increase of the slab's height, over its height
MOST_GROWTH = 40  # increases of the slab's height before placement fails


@dataclass(frozen=True)
class Bent:
    """Shape of a body that bends, where it is not the shape in which it is poured."""

    points: Array  #: (n, 3) nodes of a filament, or middles of the links of a linkage [m]
    turns: Array | None = None  #: (n, 3, 3) frames of the links of a linkage, x along each and z its normal
    angles: Array | None = None  #: (n - 1, 3) angles about the axes of its joints [rad]


@dataclass(frozen=True)
class Poses:
    """Poses of k bodies."""

    positions: Array  #: (k, 3) centres of mass [m]
    rotations: tuple[Rotation, ...]  #: k rotations from the body frame to the laboratory frame
    kinds: Numbers | None = None  #: (k,) kind of each body in a mixture; None: smarticles
    bent: tuple[Bent, ...] | None = None  #: k shapes of bodies that bend; None: as they are poured


def place_layer(
    bodies: Body | Sequence[Body],
    *,
    count: int,
    radius: float,
    bottom: float,
    height: float,
    obstacles: Array,
    rng: np.random.Generator,
    narrower: Callable[[Array], Array] | None = None,
    thickest: float = 0.0,
    curves: Sequence[Array] = (),
    thinnest: float = 0.0,
) -> Poses:
    """Return random poses of `count` bodies without overlap and without links, in a slab of a cylinder.

    Orientations are uniform over all rotations, centres uniform over the cylinder's section, and heights of the lowest
    points uniform over the slab. Poses that overlap are drawn again, and so are poses in which closed curves of two
    bodies are linked, with a linking number other than 0, see `dem.body.loops`: no pour links them, and nothing parts
    them. A slab that is too full is made higher; RunError if there is still no room after it was made higher
    `MOST_GROWTH` times.

    Args:
        bodies: one body, which is placed `count` times, or `count` bodies.
        radius: inner radius of the cylinder [m].
        bottom: height of the slab's lower face [m]; no sphere reaches below it.
        height: height of the slab [m].
        obstacles: (n, 3) centres of spheres that are already there [m].
        narrower: function from heights (n,) to inner radii (n,) of the cylinder [m], which must not increase with
            height; None: `radius` everywhere.
        thickest: radius of the largest obstacles, if it is above the radii of all `bodies` [m].
        curves: corners (n, 3) of closed curves of bodies that are already there [m].
        thinnest: diameter of the thinnest bar [m], which decides what counts as closed, see `loops_of`.
    """
    each = bodies if isinstance(bodies, Sequence) else [bodies] * count
    thickest = max(thickest, *(body.radius for body in each))
    spacing = 2 * thickest * (1 + CLEARANCE)
    margin = thickest * (1 + 2 * CLEARANCE)
    widest = radius - margin
    # Trees of spheres, each smaller than the one before it, so that a new body is not sorted in among all.
    trees = [cKDTree(obstacles)] if len(obstacles) else []
    known = {id(body): (bars_of(body), loops_of(body, thinnest=thinnest)) for body in each}
    present = Curves(curves)
    positions: list[Array] = []
    rotations: list[Rotation] = []
    increases = 0
    while len(positions) < count:
        particle = each[len(positions)]
        for _ in range(ATTEMPTS):
            rotation = Rotation.random(random_state=rng)
            turn = rotation.as_matrix()
            spheres = turned(turn, particle.outline)
            distance, angle = radius * math.sqrt(rng.random()), 2 * math.pi * rng.random()
            lift = rng.random()
            lowest = spheres[:, 2].min() - particle.radius
            centre = np.array([distance * math.cos(angle), distance * math.sin(angle), bottom + lift * height - lowest])
            spheres += centre
            off_axis = np.hypot(spheres[:, 0], spheres[:, 1])
            if off_axis.max() > widest:
                continue
            # The radius at the tops of the spheres counts, so that they touch neither wall nor ceiling of a tier.
            if narrower is not None and (off_axis > narrower(spheres[:, 2] + margin) - margin).any():
                continue
            if any(tree.query(spheres, distance_upper_bound=spacing)[0].min() < spacing for tree in trees):
                continue
            bars, loops = known[id(particle)]
            corners = [applied(turn, loop.corners(bars)) + centre for loop in loops]
            if present.linked(corners):
                continue
            present.add(corners)
            positions.append(centre)
            rotations.append(rotation)
            while trees and trees[-1].n <= len(spheres):
                spheres = np.concatenate([trees.pop().data, spheres])
            trees.append(cKDTree(spheres))
            break
        else:
            height *= 1 + GROWTH
            increases += 1
            if increases > MOST_GROWTH:
                raise RunError(
                    f"only {len(positions)} of {count} bodies of a layer found room in a container of radius "
                    f"{radius:g} m; lower phases.0.per_layer or widen container.radius_m"
                )
    return Poses(np.array(positions), tuple(rotations))


def fitted_poses(boxes: Boxes, vertices: Array) -> tuple[Poses, Array]:
    """Fit the pose of rigid links, `boxes`, to the vertices of each smarticle, by least squares.

    Vertices do not determine the rotation of a straight shape about its length. The angle of this rotation is then
    arbitrary, but equal vertices give equal angles.

    Vertices (N, 4, 3) are barb tip, hinge, hinge, barb tip [m]. Returns the largest distance (N,) of a fitted vertex
    [m], too.

    Source: Horn, J. Opt. Soc. Am. A 4, 629 (1987).
    """
    positions, turns, deviations = fitted(boxes.vertices, vertices)
    return Poses(positions, tuple(Rotation.from_matrix(turn) for turn in turns)), deviations


def fitted(shape: Array, points: Array) -> tuple[Array, Array, Array]:
    """Fit the poses of a rigid shape, points (V, 3) in its frame [m], to those of N bodies (N, V, 3), by least squares.

    Returns positions (N, 3) of the frame [m], rotations (N, 3, 3), and the largest distance (N,) of a fitted point [m].
    """
    centre, shape_centre = points.mean(axis=1), shape.mean(axis=0)
    turns = _turns(np.einsum("nvi,vj->nij", points - centre[:, None], shape - shape_centre))
    positions = centre - applied(turns, shape_centre[None])[:, 0]
    placed = np.einsum("nij,vj->nvi", turns, shape) + positions[:, None]
    deviations: Array = np.linalg.norm(placed - points, axis=-1).max(axis=1)
    return positions, turns, deviations


def _turns(moments: Array) -> Array:
    """Return (N, 3, 3) rotations R that make trace(Rᵀ M) largest, for `moments` M (N, 3, 3)."""
    largest = np.abs(moments).max(axis=(1, 2), keepdims=True)
    m = moments / np.where(largest > 0, largest, 1)  # zero: all points are in one place
    n = np.empty((len(m), 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        n[:, 1 + i, 1 + i] = m[:, i, i] - m[:, j, j] - m[:, k, k]
        n[:, 0, 1 + i] = n[:, 1 + i, 0] = m[:, k, j] - m[:, j, k]
        n[:, 1 + j, 1 + k] = n[:, 1 + k, 1 + j] = m[:, j, k] + m[:, k, j]
    n[:, 0, 0] = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    values, vectors = eigen_symmetric(n)
    w, x, y, z = np.take_along_axis(vectors, values.argmax(axis=1)[:, None, None], axis=2)[:, :, 0].T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
