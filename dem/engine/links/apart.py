"""Push smarticles apart, without inertia, where the poses of another engine or fidelity overlap as links of this one.

Chains of spheres come nearer to each other than strands can, since spheres of one chain sit in gaps of another chain.
Where strands begin so near, contacts are in the steep part of the barrier and throw smarticles apart. Here every
overlap moves both bodies by what removes it, weighted by mass and inertia, as the contacts of position-based dynamics
do (Müller et al., J. Vis. Commun. Image R. 18, 109 (2007)). Sweeps over all overlaps are repeated until none is left.

The strands of a link span a face. Where the faces of two links intersect, strands are on the wrong side of each other;
the nearest points of the centre lines then say which way is out. No point moves by more than a fraction of a radius in
a sweep, and centre lines that pass each other are noticed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from dem.arrays import Array, Flags, Numbers
from dem.body.linear import applied, matrix_product
from dem.body.particle import Particle
from dem.body.placement import Poses
from dem.engine.links.shapes import RADIUS, START, VECTOR, smarticle_shape
from dem.errors import InputError
from dem.setting.container import Cylinder
from dem.setting.hooks import Cross

DEEP = 0.05  # of a diameter; contacts of piles at rest are less deep, and `place` accepts as much
LEFT = 0.01  # of a diameter: what may be left of an overlap; its spring can lift a smarticle by 0.04 of a diameter
STRIDE = 0.2  # of a radius, by which a point moves at most in a sweep: no axis can jump over another one
# Part of its last displacement that a body repeats while it overlaps: eight times fewer sweeps in piles of 60, in which
# the mean displacement is then the same within 2 %.
CARRIED = 0.9
SKIN = 1.0  # in diameters; pairs of links that are nearer are listed, until a point may have moved by half of it
SWEEPS = 5000  # piles of 9 to 270 need 30 to 450
PARALLEL = 1e-6  # of its largest value: squared sine of an angle below which segments count as parallel
TOO_NEAR = 0.02  # of a diameter; centre lines that are nearer do not tell which side is which


@dataclass(frozen=True)
class Pushed:
    """Poses after smarticles were pushed apart."""

    poses: Poses
    distances: Array  #: (N,) largest displacement of a point of each smarticle's axes [m]
    deepest: float  #: Largest overlap before [m]
    highest: float  #: Height of the highest point of the axes after [m]


def pushed_apart(particle: Particle, poses: Poses, cylinder: Cylinder, hooks: Sequence[Cross] = ()) -> Pushed | None:
    """Push smarticles apart until no overlap exceeds `LEFT` diameters; None if none exceeds `DEEP` at the start.

    Overlaps are those of strands with strands, floor, wall and hooks.

    InputError, without a key, if centre lines cross or pass each other, or overlaps are left after `SWEEPS` sweeps.
    """
    pile = _Pile(particle, poses, cylinder, hooks)
    met, crossed = pile.meet()
    deepest = float(met.depths.max(initial=0.0))
    if deepest <= DEEP * pile.diameter and not crossed:
        return None
    start = pile.ends()
    for _ in range(SWEEPS):
        pile.push(met)
        met, crossed = pile.meet()
        if met.depths.max(initial=0.0) <= LEFT * pile.diameter and not crossed:
            ends = pile.ends()
            distances = np.sqrt(((ends - start) ** 2).sum(axis=-1)).max(axis=1)
            turns = tuple(Rotation.from_matrix(turn) for turn in pile.turns)
            return Pushed(Poses(pile.positions, turns), distances, deepest, float(ends[..., 2].max()))
    worst = int(met.depths.argmax())
    other = "a boundary" if met.second[worst] < 0 else f"smarticle {met.second[worst]}"
    raise InputError(
        f"after {SWEEPS} small displacements smarticle {met.first[worst]} still overlaps {other} by "
        f"{1e3 * met.depths[worst]:.2g} mm at {_at(met.places[worst])}, so that there is no room for all"
    )


class _Met(NamedTuple):
    """C overlaps."""

    first: Numbers  #: (C,) body that `normals` point to
    second: Numbers  #: (C,) the other body; -1: a boundary
    places: Array  #: (C, 3) points of contact [m]
    normals: Array  #: (C, 3) unit vectors [1]
    depths: Array  #: (C,) overlaps [m]


class _Faces(NamedTuple):
    """Links of smarticles, or bars of hooks, by centre line and by the face that their strands span."""

    body: Numbers  #: (L,) body of each; -1: a hook
    starts: Array  #: (L, 3) start of the centre line [m]
    vectors: Array  #: (L, 3) from its start to its end [m]
    halves: Array  #: (L, 3) from the centre line to the outermost strand [m]; 0: a single strand
    radii: Array  #: (L,) radius of the strands [m]

    def at(self, rows: Numbers | Flags) -> "_Faces":
        """Return some of the links."""
        return _Faces._make(values[rows] for values in self)


class _Near(NamedTuple):
    """Nearest points of two segments, pair by pair."""

    places: Array  #: (P, 3) middle between the nearest points [m]
    gaps: Array  #: (P, 3) from the point of the second segment to that of the first [m]
    distances: Array  #: (P,) [m]


class _Pile:
    """Smarticles that are pushed apart, with the list of links that are near each other."""

    def __init__(self, particle: Particle, poses: Poses, cylinder: Cylinder, hooks: Sequence[Cross]) -> None:
        shape = smarticle_shape(particle)
        self._rows = int(np.count_nonzero(shape.link == shape.link[0]))
        # Shapes are in the frame of the middle link; poses are those of the principal axes.
        turned = particle.boxes.link_rotations[1].T
        strands = matrix_product(shape.lines[:, START : START + 3], turned).reshape(-1, self._rows, 3)
        self._starts, self._halves = (strands[:, 0] + strands[:, -1]) / 2, (strands[:, -1] - strands[:, 0]) / 2
        self._vectors = matrix_product(shape.lines[:: self._rows, VECTOR : VECTOR + 3], turned)
        self._radius = float(shape.lines[0, RADIUS])
        self.diameter = 2 * self._radius
        self._inverse_inertia = particle.mass / particle.inertia  # of a body of mass 1 [1/m²]
        self._reach = particle.reach
        self.positions = poses.positions.copy()
        self.turns = np.array([rotation.as_matrix() for rotation in poses.rotations])
        self._last = np.zeros((len(self.positions), 6))  # displacements and angles of the last sweep [m, rad]
        self._cylinder = cylinder
        self._bars = _faces_of(hooks)
        self._moved = math.inf  # bound of the way of any point since pairs were listed [m]
        self._gaps: Array | None = None  # between centre lines of listed pairs, when they were last checked [m]

    def ends(self) -> Array:
        """Return (N, 4 L, 3) both ends of the outermost strands of the links [m]."""
        far = self._starts + self._vectors
        points = np.concatenate([start + side * self._halves for start in (self._starts, far) for side in (-1, 1)])
        return np.asarray(applied(self.turns, points) + self.positions[:, None])

    def _faces(self) -> _Faces:
        links = len(self._starts)
        starts = applied(self.turns, self._starts) + self.positions[:, None]
        own = _Faces(
            np.repeat(np.arange(len(self.positions)), links),
            starts.reshape(-1, 3),
            applied(self.turns, self._vectors).reshape(-1, 3),
            applied(self.turns, self._halves).reshape(-1, 3),
            np.full(starts.shape[0] * links, self._radius),
        )
        return _Faces._make(np.concatenate(both) for both in zip(own, self._bars, strict=True))

    def meet(self) -> tuple[_Met, bool]:
        """Return all overlaps, and whether faces of links intersect.

        Raises:
            InputError: centre lines cross, or have passed each other since the last call.
        """
        faces = self._faces()
        if self._gaps is not None:
            self._check_sides(faces)  # of the old list, which may end here
        if self._moved > SKIN * self._radius:
            self._list_near(faces)
        one, other = (faces.at(rows) for rows in self._listed)
        centre = self._check_sides(faces)
        through = _edges_pass(one, other) | _edges_pass(other, one)
        apart = one.at(~through), other.at(~through)
        offsets = np.linspace(-1.0, 1.0, self._rows) if self._rows > 1 else np.zeros(1)
        met = [_met_strands(*apart, *sides) for sides in product(offsets, repeat=2)]
        met.append(_met_faces(one.at(through), other.at(through), _Near(*(values[through] for values in centre))))
        met += self._met_container()
        return _Met._make(np.concatenate(columns) for columns in zip(*met, strict=True)), bool(through.any())

    def _list_near(self, faces: _Faces) -> None:
        """List the pairs of links of different bodies, and of links and hooks, that are near each other."""
        wide = float((np.sqrt((faces.halves**2).sum(axis=1)) + faces.radii).max())
        near = 2 * wide + SKIN * self.diameter
        longest = float(np.sqrt((faces.vectors**2).sum(axis=1)).max())
        tree = cKDTree(faces.starts + faces.vectors / 2)
        pairs = np.sort(tree.query_pairs(longest + near, output_type="ndarray"), axis=1)
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        first, second = pairs[faces.body[pairs[:, 0]] != faces.body[pairs[:, 1]]].T
        one, other = faces.at(first), faces.at(second)
        close = _nearest(one.starts, one.vectors, other.starts, other.vectors).distances < near
        self._listed = first[close], second[close]
        self._moved, self._gaps = 0.0, None

    def _check_sides(self, faces: _Faces) -> _Near:
        """Return the nearest points of the centre lines of listed pairs, after a check that none has passed another."""
        one, other = (faces.at(rows) for rows in self._listed)
        centre = _nearest(one.starts, one.vectors, other.starts, other.vectors)
        wrong = centre.distances < TOO_NEAR * self.diameter
        if self._gaps is not None:
            wrong |= (centre.gaps * self._gaps).sum(axis=1) < 0
        self._gaps = centre.gaps
        if wrong.any():
            k = int(wrong.argmax())
            name = "a hook" if other.body[k] < 0 else f"smarticle {other.body[k]}"
            raise InputError(
                f"the centre lines of smarticle {one.body[k]} and {name} cross at {_at(centre.places[k])}, and nothing "
                "tells on which side of each other they belong"
            )
        return centre

    def _met_container(self) -> list[_Met]:
        """Return the overlaps of the ends of strands with floor, wall and ceilings of tiers."""
        ends, radius, cylinder = self.ends(), self._radius, self._cylinder
        body, points = np.repeat(np.arange(len(ends)), ends.shape[1]), ends.reshape(-1, 3)
        heights, off_axis = points[:, 2], np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2)
        up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        inwards = points * [-1.0, -1.0, 0.0] / np.maximum(off_axis, 1e-300)[:, None]
        found = [(radius - heights, up), (off_axis + radius - cylinder.radii(heights), inwards)]
        for bottom, narrow in cylinder.upper:
            under = (heights < bottom) & (off_axis > narrow)
            found.append((np.where(under, heights + radius - bottom, 0.0), -up))
        return [_touching(_Met(body, np.full_like(body, -1), points, normals, depths)) for depths, normals in found]

    def push(self, met: _Met) -> None:
        """Move all bodies that overlap, each by the mean of what its overlaps ask for."""
        inverse = matrix_product(self.turns * self._inverse_inertia, np.swapaxes(self.turns, 1, 2))
        asked, gives = [], np.zeros(len(met.depths))
        for body, sign in ((met.first, 1.0), (met.second, -1.0)):
            free = body >= 0
            moments = np.cross(met.places - self.positions[body], met.normals)
            turning = matrix_product(inverse[body], moments[..., None])[..., 0]
            own = np.where(free, 1.0 + (moments * turning).sum(axis=1), 0.0)
            gives += own
            asked.append((body[free], free, own, sign * np.concatenate([met.normals, turning], axis=1)))
        pushes = met.depths / gives
        moves, overlaps = np.zeros((len(self.positions), 6)), np.zeros(len(self.positions))
        limits = np.zeros(len(self.positions))
        for body, free, own, ways in asked:
            overlaps += np.bincount(body, minlength=len(overlaps))
            np.maximum.at(limits, body, (own * pushes)[free])
            for d, column in enumerate((pushes[:, None] * ways)[free].T):
                moves[:, d] += np.bincount(body, weights=column, minlength=len(overlaps))
        moves /= np.maximum(1.0, overlaps)[:, None]
        moves += CARRIED * self._last
        ways, turns = (np.sqrt((part**2).sum(axis=1)) for part in (moves[:, :3], moves[:, 3:]))
        longest = ways + self._reach * turns  # an upper bound of the way of any point
        # No further than the deepest overlap asks for, so that what is carried on does not push bodies too far apart.
        share = np.minimum(1.0, np.minimum(limits, STRIDE * self._radius) / np.maximum(longest, 1e-300))
        self._moved += float((share * longest).max())
        moves *= share[:, None]
        self._last = moves
        self.positions = self.positions + moves[:, :3]
        self.turns = matrix_product(_turns_by(moves[:, 3:]), self.turns)


def _faces_of(hooks: Sequence[Cross]) -> _Faces:
    """Return the round bars of hooks."""
    bars = [(bar, cross.height) for cross in hooks for bar in cross.bars]
    starts, vectors, radii = np.zeros((len(bars), 3)), np.zeros((len(bars), 3)), np.zeros(len(bars))
    for k, (bar, height) in enumerate(bars):
        along, radii[k] = int(np.argmax(bar.half)), min(bar.half)
        vectors[k, along] = 2 * (bar.half[along] - radii[k])
        starts[k] = np.array([*bar.middle, height]) - vectors[k] / 2
    return _Faces(np.full(len(bars), -1), starts, vectors, np.zeros_like(starts), radii)


def _nearest(p: Array, u: Array, q: Array, v: Array) -> _Near:
    """Return the nearest points of segments p + s u and q + t v, s and t from 0 to 1; all are (P, 3) [m].

    Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    w = p - q
    a, b, c, d, e = ((x * y).sum(axis=1) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    determinant = a * c - b * b
    crossing = determinant > PARALLEL * a * c
    s = (b * e - c * d) / np.where(crossing, determinant, 1.0)
    # Along parallel segments the middle of the stretch where they are beside each other, so that they do not tilt.
    stretch = np.clip(np.stack([-e, c - e]) / np.where(crossing, 1.0, b), 0.0, 1.0)
    s = np.clip(np.where(crossing, s, stretch.mean(axis=0)), 0.0, 1.0)
    t = np.clip((b * s + e) / c, 0.0, 1.0)
    s = np.clip((b * t - d) / a, 0.0, 1.0)
    one, other = p + s[:, None] * u, q + t[:, None] * v
    gaps = one - other
    return _Near((one + other) / 2, gaps, np.sqrt((gaps**2).sum(axis=1)))


def _edges_pass(one: _Faces, other: _Faces) -> Flags:
    """Return (P,) whether an edge of a link's face passes through the face of another link, pair by pair."""
    normals = np.cross(other.vectors, other.halves)
    lengths, widths = (np.maximum((x**2).sum(axis=1), 1e-300) for x in (other.vectors, other.halves))
    edges = [(one.starts + side * one.halves, one.vectors) for side in (-1.0, 1.0)]
    edges += [(one.starts + end * one.vectors - one.halves, 2 * one.halves) for end in (0.0, 1.0)]
    passes = np.zeros(len(one.body), np.bool_)
    for start, vector in edges:
        rise = (vector * normals).sum(axis=1)
        slanted = rise != 0.0
        share = ((other.starts - start) * normals).sum(axis=1) / np.where(slanted, rise, 1.0)
        place = start + share[:, None] * vector - other.starts
        along, across = ((place * x).sum(axis=1) for x in (other.vectors, other.halves))
        inside = (along >= 0) & (along <= lengths) & (np.abs(across) <= widths)
        passes |= slanted & (share >= 0) & (share <= 1) & inside
    return passes


def _met_strands(one: _Faces, other: _Faces, first: float, second: float) -> _Met:
    """Return the overlaps of two strands of links, pair by pair.

    `first` and `second` say which strands: from -1 to 1 across the faces.
    """
    near = _nearest(one.starts + first * one.halves, one.vectors, other.starts + second * other.halves, other.vectors)
    return _met_along(one, other, near, one.radii + other.radii - near.distances)


def _met_faces(one: _Faces, other: _Faces, centre: _Near) -> _Met:
    """Return the overlaps of links whose faces intersect, along the shortest way between their centre lines."""
    reach = one.radii + other.radii
    for halves in (one.halves, other.halves):
        reach = reach + np.abs((halves * centre.gaps).sum(axis=1)) / centre.distances
    return _met_along(one, other, centre, reach - centre.distances)


def _met_along(one: _Faces, other: _Faces, near: _Near, depths: Array) -> _Met:
    normals = near.gaps / np.maximum(near.distances, 1e-300)[:, None]
    return _touching(_Met(one.body, other.body, near.places, normals, depths))


def _touching(met: _Met) -> _Met:
    """Return the overlaps that are deeper than 0."""
    return _Met._make(values[met.depths > 0] for values in met)


def _turns_by(angles: Array) -> Array:
    """Return rotations (n, 3, 3) by small angles (n, 3) about the axes [rad], to second order, exactly orthogonal."""
    # The unit quaternion along (1, angles/2).
    x, y, z = (angles / 2).T
    w = np.ones_like(x)
    norm = w + x * x + y * y + z * z
    rows = [
        [norm - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), norm - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), norm - 2 * (x * x + y * y)],
    ]
    return np.asarray(np.moveaxis(np.array(rows), 2, 0) / norm[:, None, None])


def _at(place: Array) -> str:
    return f"({', '.join(f'{1e3 * part:.3g}' for part in place)}) mm"
