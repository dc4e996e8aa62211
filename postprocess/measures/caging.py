"""Find bodies that the bodies around them cage, and the number of contacts that cage a shape.

A body is caged if its contacts block all of its motions, without friction. At a contact with the normal n, which points
into the body, the body can move with the velocity v only if n · v ≥ 0. All motions are blocked to first order if sums
of the normals with coefficients of 0 or more give every vector. For translations v is a velocity (3 components); for
all rigid motions it is joined by an angular velocity, and the normal by its moment (6 components). A motion that no
contact on a body's sides can block, as of a rod along or about its axis, does not count. Contacts with floor and wall
are left out. Tables have this measure for runs on links.
"""

from bisect import bisect_left
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import Flags, Floats, Whole
from postprocess.geometry.segments import checked_segments, close_segments, nearest_points
from postprocess.measures.contacts import strands_of
from postprocess.measures.registry import FrameMeasure, Quantity, any_in_space
from postprocess.statistics.seeds import SeedMean, mean_over_seeds

# Least singular value, over the largest one, of directions that count for a rank.
_RANK = 1e-6
# Residual per normal of a sum that counts as 0.
_BALANCE = 1e-9


class ContactNormals(NamedTuple):
    """Contacts between segments of different bodies: P rows, two per contact, one for each of its bodies."""

    body: Whole  #: (P,) int64, index of the body in the ascending order of body numbers
    point: Floats  #: (P, 3) [m], point of contact
    normal: Floats  #: (P, 3) unit vector [-], into the body


@dataclass(frozen=True, kw_only=True, eq=False)
class Cages:
    """Whether contacts cage each of B bodies."""

    bodies: Whole = field(repr=False)  #: (B,) int64, numbers of the bodies
    contacts: Whole = field(repr=False)  #: (B,) int64, contacts of each body's segments with those of other bodies
    #: (B,) bool, whether its contacts block all translations of the body, except those that no contact can block
    translation: Flags = field(repr=False)
    #: (B,) bool, whether its contacts block all rigid motions of the body, except those that no contact can block
    motion: Flags = field(repr=False)
    #: (B,) float64 [-], fraction of all directions in which contacts let the body move, 1 without contact; found on a
    #: set of 2000 directions, so that less than 0.001 may be 0
    free: Floats = field(repr=False)


def cages(segments: ArrayLike, body: ArrayLike, *, diameter: ArrayLike, gap: float = 0.0) -> Cages:
    """Find which bodies are caged by their contacts with other bodies.

    Segments that touch along a line count as one contact.

    Args:
        segments: (M, 2, 3) axes of round sections [m].
        body: (M,) number of the body of each segment.
        diameter: Diameter of all sections, or (M,) of each segment [m].
        gap: Largest distance of two surfaces that counts as contact [m].

    Raises:
        InputError: See `checked_segments`; the diameter is not above 0, or the gap is below 0.

    Source:
        Peters, Kollmann, Barenbrug & Philipse, Phys. Rev. E 63, 021404 (2001): caging as arrest of all translations.
        Lakshminarayana, ASME paper 78-DET-32 (1978): form closure, the arrest of all motions by contacts.
    """
    segments, body = checked_segments(segments, body)
    bodies, number = np.unique(body, return_inverse=True)
    found = contact_normals(segments, number, diameter=diameter, gap=gap)
    order = np.argsort(found.body, kind="stable")
    ends = np.searchsorted(found.body[order], np.arange(len(bodies) + 1))
    directions = _directions(2000)
    translation, motion = np.zeros(len(bodies), dtype=bool), np.zeros(len(bodies), dtype=bool)
    free = np.ones(len(bodies))
    for k in range(len(bodies)):
        own = order[ends[k] : ends[k + 1]]
        axes, normals = segments[number == k], found.normal[own]
        free[k] = (directions @ normals.T >= 0).all(axis=1).mean()
        middle, size = _size(axes)
        sides = _sides(axes)
        translation[k] = positively_spans(normals @ _basis(sides[:, :3]).T)
        motion[k] = positively_spans(_wrenches((found.point[own] - middle) / size, normals) @ _basis(sides).T)
    return Cages(bodies=bodies, contacts=np.diff(ends), translation=translation, motion=motion, free=free)


def caging_number(segments: ArrayLike, *, trials: int = 400, seed: int = 0) -> SeedMean:
    """Compute the mean number of random contacts on the sides of a body that block all its motions.

    Contacts are independent, and equally likely everywhere on the sides of the round segments. Motions that no such
    contact can block do not count: a rod has 4 motions, every other shape 6. The number of a rod is 9, twice its
    motions plus one; that of a U with equal links is 14.6. In a pile with fewer contacts per body, bodies are caged
    only if contacts are not random.

    Args:
        segments: (M, 2, 3) segments of one body [m].
        trials: Number of random sequences of contacts.
        seed: Seed of the random numbers.

    Returns:
        The mean over the trials, with its standard error and 95 % interval.

    Raises:
        InputError: See `checked_segments`; fewer than 2 trials; or 5000 contacts are not enough.

    Source:
        Peters et al., Phys. Rev. E 63, 021404 (2001): 2 d + 1 for d motions if any d contacts are independent, by
        Wendel, Math. Scand. 11, 109 (1962). Wouterse, Luding & Philipse, Granular Matter 11, 169 (2009): 9 for thin
        rods; packings have 9.8 contacts.
    """
    axes, _ = checked_segments(segments, np.zeros(len(np.asarray(segments)), dtype=np.int64))
    if trials < 2 or len(axes) == 0:
        raise InputError(f"a caging number needs 1 segment and 2 trials or more: got {len(axes)}, {trials}")
    random, basis = np.random.default_rng(seed), _basis(_sides(axes))
    middle, size = _size(axes)
    along = axes[:, 1] - axes[:, 0]
    lengths = np.linalg.norm(along, axis=1)

    def draw(count: int) -> Floats:
        which = random.choice(len(axes), size=count, p=lengths / lengths.sum())
        points = (axes[which, 0] + random.uniform(size=(count, 1)) * along[which] - middle) / size
        normal = np.cross(random.normal(size=(count, 3)), along[which])
        return _wrenches(points, normal / np.linalg.norm(normal, axis=1, keepdims=True)) @ basis.T

    needed: list[float] = []
    for _ in range(trials):
        contacts = draw(64)
        while not positively_spans(contacts):
            if len(contacts) > 5000:
                raise InputError("5000 random contacts do not block all motions; a segment is far shorter than others")
            contacts = np.concatenate([contacts, draw(len(contacts))])
        # A further contact never frees a body.
        counts = range(1, len(contacts) + 1)
        needed.append(counts[bisect_left(counts, True, key=lambda count: positively_spans(contacts[:count]))])
    return mean_over_seeds(needed)


def contact_normals(segments: Floats, number: Whole, *, diameter: ArrayLike, gap: float = 0.0) -> ContactNormals:
    """Find the contacts between segments of different bodies.

    Args:
        segments: (M, 2, 3) axes of round sections [m].
        number: (M,) index of each segment's body, from 0.
        diameter: Diameter of all sections, or (M,) of each segment [m].
        gap: Largest distance of two surfaces that counts as contact [m].

    Raises:
        InputError: A diameter is not above 0, or the gap is below 0.
    """
    sizes = np.asarray(diameter, dtype=np.float64)
    if sizes.shape not in {(), (len(segments),)} or not np.all(np.isfinite(sizes) & (sizes > 0)) or not gap >= 0:
        raise InputError(
            f"a contact needs one diameter above 0 m, or one per segment, and a gap of 0 m or more: got {sizes} m, "
            f"{gap} m"
        )
    radius = np.broadcast_to(sizes / 2, len(segments))
    i, j = close_segments(segments[:, 0], segments[:, 1], number, 2 * radius.max(initial=0) + gap)
    first, second = nearest_points(segments[i], segments[j])
    apart = first - second
    distance = np.linalg.norm(apart, axis=1)
    # Axes that meet have no normal.
    touching = (distance <= radius[i] + radius[j] + gap) & (distance > 0)
    i, j = i[touching], j[touching]
    normal = apart[touching] / distance[touching, None]
    point = first[touching] - (radius[i] / (radius[i] + radius[j]) * distance[touching])[:, None] * normal
    return ContactNormals(
        np.concatenate([number[i], number[j]]), np.tile(point, (2, 1)), np.concatenate([normal, -normal])
    )


def positively_spans(vectors: Floats) -> bool:
    """Return whether every d-dimensional vector is a sum of vectors (P, d) with coefficients of 0 or more.

    If n are the normals of contacts, this means that v = 0 is the only motion v with v · n ≥ 0 for all n.
    """
    count, rank = vectors.shape
    if count <= rank or np.linalg.matrix_rank(vectors, tol=_RANK * count) < rank:
        return False
    # With the full rank, a combination 0 with positive coefficients is enough: Σ (μ + 1) n = 0, μ ≥ 0, up to scale.
    _, residual = nnls(vectors.T, -vectors.sum(axis=0), maxiter=100 * count)
    return bool(residual <= _BALANCE * count)


def _wrenches(points: Floats, normals: Floats) -> Floats:
    """Return the wrenches (P, 6), force and moment, of unit forces along normals (P, 3) at points (P, 3)."""
    return np.concatenate([normals, np.cross(points, normals)], axis=1)


def _sides(axes: Floats) -> Floats:
    """Return wrenches (4 m, 6) that span the wrenches of all contacts on a body's sides.

    A wrench is a unit force and its moment; that of every contact is a linear combination of the returned ones. `axes`
    (m, 2, 3) [m] are the segments of the body. Moments are about the middle of the body and divided by its size, see
    `_size`, so that all components are comparable.
    """
    middle, size = _size(axes)
    ends = (axes - middle) / size
    across = np.linalg.svd((ends[:, 1] - ends[:, 0])[:, None])[2][:, 1:]
    return np.concatenate([_wrenches(ends[:, end], across[:, one]) for end in (0, 1) for one in (0, 1)])


def _basis(vectors: Floats) -> Floats:
    """Return orthonormal vectors (k, d) that span all vectors (n, d)."""
    _, sizes, axes = np.linalg.svd(vectors)
    basis: Floats = axes[: int((sizes > _RANK * sizes[0]).sum())]
    return basis


def _size(axes: Floats) -> tuple[Floats, float]:
    """Return the mean of the ends of a body's segments, (3,) [m], and the largest distance from it [m]."""
    middle = axes.mean(axis=(0, 1))
    return middle, float(np.linalg.norm(axes - middle, axis=2).max())


def _directions(count: int) -> Floats:
    """Return unit vectors (count, 3) spread evenly over the sphere, on a golden spiral."""
    k = np.arange(count) + 0.5
    z, azimuth = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    across = np.sqrt(1 - z**2)
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), z], axis=1)


def _cages_of(frame: Frame, run: Run) -> tuple[float, float, float]:
    axes, body, _, diameter = strands_of(frame, run)
    real = np.any(axes[:, 0] != axes[:, 1], axis=1)  # barbs of length 0 are no segments
    # Recorded positions are rounded, which would lose contacts of zero overlap.
    found = cages(axes[real], body[real], diameter=diameter[real], gap=1e-9 * float(diameter.max()))
    return float(found.translation.mean()), float(found.motion.mean()), float(found.contacts.mean())


MEASURES = (
    FrameMeasure(
        name="caging",
        place=53,
        quantities=(
            Quantity("caged against translation", "-"),
            Quantity("caged", "-"),
            Quantity("contacts of segments mean", "-"),
        ),
        take=_cages_of,
        # On other engines spheres touch, whose chains have gaps.
        available_for=lambda run: any_in_space(run) and run.manifest.engine == "links",
        costly=True,
        on_request=True,
    ),
)
