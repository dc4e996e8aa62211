"""Closed curves of bodies, and whether curves of two bodies are linked.

A curve is closed if it consists of bars that are joined, or if it has gates: gaps from a free end to another bar of the
same rigid body through which nothing passes. The distance of the axes at a gate is below √2 (r + s), with the radius r
of the body and the radius s of the thinnest bar of a scene. A bar needs 2 (r + s). Two gates of widths a and b cross
each other only if the bars at their ends, (a² + b²)^½ / 2 apart, do not touch, which these widths exclude. Chains and
filaments open and close as they bend, so that they have no such curves.
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
from dem.body.state import PileState, bars_by_body

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
    """Return closed curves of a body, of which every other one is a sum.

    The diameter of the thinnest bar of the scene, `thinnest` [m], decides what is a gate.
    """
    if body.filament is not None or body.linkage is not None:
        return []
    segments = bars_of(body)
    (numbers,) = np.nonzero(np.abs(segments[:, 1] - segments[:, 0]).max(axis=1) > 0)  # barbs may have no length
    segments = segments[numbers]
    nodes = first_ends(segments).reshape(-1, 2)
    free = np.bincount(nodes.ravel(), minlength=nodes.size)[nodes] == 1
    # Axes of swept bars begin and end a radius within free ends.
    inset = np.minimum(
        0.5, free * (body.radius / np.sqrt(((segments[:, 1] - segments[:, 0]) ** 2).sum(axis=1)))[:, None]
    )
    ends = np.array([0.0, 1.0]) + inset * [1.0, -1.0]
    places = [(k // 2, float(share)) for k, share in enumerate(ends.ravel())]
    edges = [(int(a), int(b)) for a, b in nodes]
    for tip, bar, share in _gates(segments, nodes, ends, (2 * body.radius + thinnest) / math.sqrt(2)):
        edges += [(tip, len(places)), (len(places), int(nodes[bar, 0]))]
        places.append((bar, share))
    return [
        Loop(numbers[[places[k][0] for k in cycle]], np.array([places[k][1] for k in cycle]))
        for cycle in _cycles(edges, len(places))
    ]


def curves_of(state: PileState, bodies: Sequence[Body], *, thinnest: float) -> list[list[Array]]:
    """Return corners (n, 3) [m] of the closed curves of each body of a pile, of which `bodies` has one of each kind."""
    loops = [loops_of(body, thinnest=thinnest) for body in bodies]
    if not any(loops):
        return [[]] * state.count
    kinds = np.zeros(state.count, np.int64) if state.bodies is None else state.bodies.kind
    bars = bars_by_body(state)
    return [[loop.corners(own) for loop in loops[kind]] for kind, own in zip(kinds, bars, strict=True)]


def _gates(segments: Array, nodes: Numbers, ends: Array, least: float) -> list[tuple[int, int, float]]:
    """Return gates: the node of a free end, the bar whose axis is nearer to it than `least` [m], and the share there.

    Axes begin and end at the shares `ends` (S, 2) of the segments (S, 2, 3), whose ends are the given nodes (S, 2).
    """
    starts, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    squares, found = (along**2).sum(axis=1), []
    counts = np.bincount(nodes.ravel())
    for own, end in np.argwhere(counts[nodes] == 1):
        tip = starts[own] + ends[own, end] * along[own]
        shares = np.clip(((tip - starts) * along).sum(axis=1) / squares, ends[:, 0], ends[:, 1])
        apart = np.sqrt(((starts + shares[:, None] * along - tip) ** 2).sum(axis=1))
        for bar in np.flatnonzero(apart < least):
            at = nodes[bar][np.abs(shares[bar] - ends[bar]) < AT_AN_END]
            # A neighbour is nearest where it is joined, which encloses nothing; two free ends make one gate.
            if bar != own and not set(at) & set(nodes[own]) and (bar > own or (counts[at] != 1).all()):
                found.append((int(nodes[own, end]), int(bar), float(shares[bar])))
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
        volume = (u * np.cross(w, v)).sum(axis=-1)
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
