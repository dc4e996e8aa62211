"""Closed curves of bodies, and whether curves of two bodies are linked.

A curve is closed if it consists of bars that are joined, or if it has gates: gaps from a free end to another bar of the
same rigid body that are too narrow for the thinnest bar of a scene. Chains and filaments have free ends, and bodies
that bend open and close, so that they have no such curves.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from dem.arrays import Array, Numbers
from dem.body.bars import first_ends
from dem.body.kinds import Body, Kind
from dem.body.linear import by_element
from dem.body.particle import Particle

WHOLE = 0.5  # of a linking number, which is a whole number up to rounding
AT_AN_END = 1e-6  # of a bar's length: nearest points that are nearer to an end lie at it


class Loop(NamedTuple):
    """Closed polygon whose n corners lie on the bars of a body."""

    bars: Numbers  #: (n,) bar of each corner
    shares: Array  #: (n,) distance of each corner from the start of its bar, over the bar's length [1]

    def corners(self, segments: Array) -> Array:
        """Return the corners (n, 3) [m] from both ends (S, 2, 3) of the body's bars [m]."""
        start, end = segments[self.bars, 0], segments[self.bars, 1]
        return np.asarray(start + self.shares[:, None] * (end - start))


def bars_of(body: Body) -> Array:
    """Return both ends (S, 2, 3) of the bars, or links, of a body in its frame [m]."""
    if isinstance(body, Kind):
        return body.bars.ends
    assert isinstance(body, Particle)
    vertices = body.boxes.vertices
    return np.stack([vertices[:-1], vertices[1:]], axis=1)


def loops_of(body: Body, *, thinnest: float = 0.0) -> list[Loop]:
    """Return closed curves of a body that are a basis of all: every other one is a sum of them.

    Gates are too narrow for a bar of the diameter `thinnest` [m].
    """
    if body.filament is not None or body.linkage is not None:
        return []
    segments = bars_of(body)
    segments = segments[np.abs(segments[:, 1] - segments[:, 0]).max(axis=1) > 0]  # barbs may have no length
    nodes = first_ends(segments).reshape(-1, 2)
    count = len(segments)
    places: dict[int, tuple[int, float]] = {2 * bar + end: (bar, float(end)) for bar in range(count) for end in (0, 1)}
    edges = [(int(a), int(b)) for a, b in nodes]
    for tip, bar, share in _gates(segments, nodes, 2 * body.radius + thinnest):
        places[len(places)] = (bar, share)
        edges += [(tip, len(places) - 1), (len(places) - 1, int(nodes[bar, 0]))]
    return [
        Loop(np.array([places[k][0] for k in cycle]), np.array([places[k][1] for k in cycle]))
        for cycle in _cycles(edges, len(places))
    ]


def _gates(segments: Array, nodes: Numbers, least: float) -> list[tuple[int, int, float]]:
    """Return gates: the node of a free end, the bar that is nearer to it than `least` [m], and the share there."""
    found = []
    free = [int(k) for k in np.flatnonzero(np.bincount(nodes.ravel(), minlength=2 * len(segments)) == 1)]
    for tip in free:
        place, own = segments[tip // 2, tip % 2], tip // 2
        along = segments[:, 1] - segments[:, 0]
        shares = np.clip(((place - segments[:, 0]) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        apart = np.sqrt(((segments[:, 0] + shares[:, None] * along - place) ** 2).sum(axis=1))
        for bar in np.flatnonzero(apart < least):
            share = float(shares[bar])
            end = 0 if share < AT_AN_END else 1 if share > 1 - AT_AN_END else None
            # A neighbour is nearest where it is joined, which encloses nothing.
            if bar != own and (end is None or nodes[bar, end] not in nodes[own]):
                found.append((tip, int(bar), share))
    return found


def _cycles(edges: Sequence[tuple[int, int]], count: int) -> list[list[int]]:
    """Return a basis of the cycles of a graph in one piece, each as nodes in order, from its edges."""
    ends = np.array(edges)
    graph = coo_array((np.ones(len(ends)), ends.T), shape=(count, count)).tocsr()
    _, before = breadth_first_order(graph, int(ends[0, 0]), directed=False)

    def way(node: int) -> list[int]:
        found = [node]
        while before[found[-1]] >= 0:
            found.append(int(before[found[-1]]))
        return found

    tree = {frozenset((k, int(b))) for k, b in enumerate(before) if b >= 0}
    rest = {frozenset(edge) for edge in edges} - tree
    cycles = []
    for a, b in (sorted(edge) for edge in sorted(rest, key=sorted)):
        one, other = way(a), way(b)
        shared = next(k for k in one if k in other)
        cycles.append([*one[: one.index(shared) + 1], *reversed(other[: other.index(shared)])])
    return cycles


def linking_number(one: Array, other: Array) -> int:
    """Return the linking number [1] of two closed polygons with corners (n, 3) and (m, 3) [m] that do not touch.

    It is the sum of the solid angles, over 4π, that all differences of points of two sides subtend: a parallelogram, or
    two triangles.

    Source: Gauss's integral; Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 125 (1983) for a triangle.
    """
    first, second = (np.concatenate([curve, curve[:1]]) for curve in (one, other))
    apart = second - first[:, None]
    unit = apart / np.sqrt((apart**2).sum(axis=-1, keepdims=True))
    a, b, c, d = unit[:-1, :-1], unit[:-1, 1:], unit[1:, 1:], unit[1:, :-1]
    total = 0.0
    for u, v, w in ((a, b, c), (a, c, d)):
        volume = (u * np.cross(v, w)).sum(axis=-1)
        cosines = 1 + (u * v).sum(axis=-1) + (v * w).sum(axis=-1) + (w * u).sum(axis=-1)
        total += 2 * float(by_element(math.atan2, volume, cosines).sum())
    return round(total / (4 * math.pi))


class Curves:
    """Closed curves that are in place, one body after the other."""

    def __init__(self, corners: Sequence[Array] = ()) -> None:
        self._corners: list[Array] = []
        self._balls: list[tuple[Array, float]] = []
        self.add(corners)

    def add(self, corners: Sequence[Array]) -> None:
        """Add curves, each with corners (n, 3) [m]."""
        self._corners += corners
        self._balls += map(_ball, corners)

    def linked(self, corners: Sequence[Array]) -> bool:
        """Return whether any of the curves given, with corners (n, 3) [m] each, is linked with one in place."""
        if not self._balls or not corners:
            return False
        middles, radii = (np.array(each) for each in zip(*self._balls, strict=True))
        for curve in corners:
            middle, radius = _ball(curve)
            near = ((middles - middle) ** 2).sum(axis=1) < (radii + radius) ** 2
            if any(linking_number(curve, self._corners[k]) for k in np.flatnonzero(near)):
                return True
        return False


def _ball(corners: Array) -> tuple[Array, float]:
    """Return the middle and the radius of a ball that holds a curve [m]."""
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    return middle, math.sqrt(float(((corners - middle) ** 2).sum(axis=1).max()))
