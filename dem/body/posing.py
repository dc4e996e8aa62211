"""Pose bodies by given bars: rigid bodies as a whole, filaments by their nodes, linkages link by link."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from dem.arrays import Array
from dem.body.bars import JOINED
from dem.body.kinds import Kind
from dem.body.linear import by_element, dot, matrix_product
from dem.body.linkage import Joint, Linkage
from dem.body.loops import bars_of
from dem.body.particle import Particle
from dem.body.placement import Bent, fitted
from dem.errors import InputError

# Largest distance of a given point from the body's own, in diameters: far less than a contact of the body's weight.
MOST_OFF = 0.02
SHARPEST = math.radians(150.0)  # angle between neighbouring segments of a filament, whose bending grows without bound
ROLLS = 90  # angles about the first link that are tried for hinges


class Pose(NamedTuple):
    """Pose of one body."""

    position: Array  #: (3,) centre of mass [m]
    turn: Array  #: (3, 3) rotation from the body frame to the laboratory frame
    bent: Bent | None  #: Shape of a body that bends


def posed(body: Particle | Kind, segments: Array) -> Pose:
    """Return the pose of a body whose bars are given by both ends (S, 2, 3) [m], in the order of its bars.

    InputError, which begins with what is wrong, if bars have other lengths or joints than the body.
    """
    bars = len(body.bars.points) if isinstance(body, Kind) else len(body.boxes.vertices) - 1
    if len(segments) != bars:
        raise InputError(f"{len(segments)} bars, but a {_name(body)} has {bars}; {_points(body, bars)}")
    if isinstance(body, Kind) and body.bends:
        return _of_bent(body, segments)
    local = bars_of(body)
    offs = []
    for flip in (False, True):  # a path passes some bars from their end to their start
        there = _directed(segments, local, flip=flip)
        positions, turns, off = fitted(local.reshape(-1, 3), there.reshape(1, -1, 3))
        if off[0] <= MOST_OFF * 2 * body.radius:
            return Pose(positions[0], turns[0], None)
        offs.append(float(off[0]))
    lengths, own = (np.linalg.norm(bars[:, 1] - bars[:, 0], axis=1) for bars in (segments, local))
    raise InputError(
        f"its points are up to {1e3 * min(offs):.3g} mm off the {_name(body)}, at most {_allowed(body)} are allowed; "
        f"{_lengths(lengths, own)}"
    )


def _directed(segments: Array, local: Array, *, flip: bool) -> Array:
    """Return bars (S, 2, 3), each from its start to its end, where bars of the shape `local` (S, 2, 3) have theirs.

    The first bar is reversed if `flip`. Others are directed such that bars with a common end in the shape have it here.
    """
    found, todo = segments.copy(), set(range(1, len(segments)))
    found[0] = found[0, ::-1] if flip else found[0]
    known = [0]
    for j in known:
        for k in sorted(todo):
            apart = np.linalg.norm(local[j][:, None] - local[k], axis=-1)
            a, b = np.unravel_index(apart.argmin(), apart.shape)
            if apart[a, b] > JOINED * math.dist(*local[j]):
                continue
            ways = np.linalg.norm(found[k] - found[j, a], axis=-1)
            found[k] = found[k, ::-1] if ways[1 - b] < ways[b] else found[k]
            todo.remove(k)
            known.append(k)
    return found


def _name(body: Particle | Kind) -> str:
    return body.name if isinstance(body, Kind) else "smarticle"


def _points(body: Particle | Kind, bars: int) -> str:
    path = not isinstance(body, Kind) or bool(np.allclose(body.bars.ends[1:, 0], body.bars.ends[:-1, 1]))
    return f"give {bars + 1} points in a row" if path else "give each bar by two points, with a column bar"


def _allowed(body: Particle | Kind) -> str:
    return f"{1e3 * MOST_OFF * 2 * body.radius:.3g} mm"


def _lengths(given: Array, own: Array) -> str:
    k = int(np.abs(given - own).argmax())
    if np.isclose(given[k], own[k], rtol=1e-3):
        return "its bars have the right lengths but stand at other angles; give points of the shape in the scene"
    return f"bar {k} is {1e3 * given[k]:.4g} mm long, that of the scene {1e3 * own[k]:.4g} mm; correct points or scene"


def _of_bent(kind: Kind, segments: Array) -> Pose:
    gaps = np.linalg.norm(segments[1:, 0] - segments[:-1, 1], axis=1)
    if gaps.max(initial=0.0) > MOST_OFF * kind.diameter:
        k = int(gaps.argmax())
        raise InputError(
            f"bars {k} and {k + 1} are {1e3 * gaps[k]:.3g} mm apart; give the points of a {kind.name} in a row"
        )
    points = np.concatenate([segments[:, 0], segments[-1:, 1]])
    edges = np.diff(points, axis=0)
    lengths, own = np.linalg.norm(edges, axis=1), kind.bars.lengths
    if kind.filament is not None:
        own = np.full(len(lengths), kind.filament.segment_length)
    if np.abs(lengths - own).max() > MOST_OFF * kind.diameter:
        raise InputError(f"{_lengths(lengths, own)} (within {_allowed(kind)})")
    tangents = edges / lengths[:, None]
    if kind.filament is not None:
        turns = by_element(math.acos, np.clip((tangents[1:] * tangents[:-1]).sum(axis=1), -1, 1))
        if turns.max() > SHARPEST:
            k = int(turns.argmax())
            raise InputError(f"it turns by {math.degrees(turns[k]):.0f}° at point {k + 1}; at most 150° are possible")
        masses = kind.filament.masses
        return Pose(_mean(points, masses), np.eye(3), Bent(points))
    assert kind.linkage is not None
    frames, angles, off = _frames(kind.linkage, tangents)
    worst = int(off.argmax())
    if off[worst] * own[worst + 1] > MOST_OFF * kind.diameter:
        raise InputError(
            f"joint {worst} would have to turn by {math.degrees(off[worst]):.2g}° about what is none of its axes; give "
            "points that its joints can reach, or other axes"
        )
    masses = np.array([link.mass for link in kind.linkage.links])
    middles = (points[1:] + points[:-1]) / 2
    return Pose(_mean(middles, masses), np.eye(3), Bent(middles, frames, angles))


def _mean(places: Array, masses: Array) -> Array:
    """Return the mean place (3,) of places (n, 3) [m], weighted by masses (n,)."""
    return np.asarray((masses[:, None] * places).sum(axis=0) / masses.sum())


def _frames(linkage: Linkage, tangents: Array) -> tuple[Array, Array, Array]:
    """Return frames (n, 3, 3) of links along given directions (n, 3), angles of joints (n - 1, 3), and what is amiss.

    The latter are angles (n - 1,) [rad] between each link and the nearest direction that its joint allows. The first
    link is rolled about its axis such that they are as small as possible.
    """
    start = _across(tangents[0])

    def rolled(angle: float) -> tuple[Array, Array, Array]:
        turn = Rotation.from_rotvec(angle * tangents[0]).as_matrix()
        return _followed(linkage.joints, tangents, matrix_product(turn, start))

    def amiss(angle: float) -> float:
        return float((rolled(angle)[2] ** 2).sum())

    if all(len(joint.axes) == 3 for joint in linkage.joints):
        return rolled(0.0)
    step = 2 * math.pi / ROLLS
    best = min((k * step for k in range(ROLLS)), key=lambda angle: round(amiss(angle), 12))
    found = minimize_scalar(amiss, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-10})
    return rolled(float(found.x) if found.fun < amiss(best) else best)


def _across(tangent: Array) -> Array:
    """Return a frame (3, 3) with x along a unit vector."""
    least = np.eye(3)[np.abs(tangent).argmin()]
    z = least - dot(least, tangent) * tangent
    z /= math.hypot(*z)
    return np.stack([tangent, np.cross(z, tangent), z], axis=1)


def _followed(joints: Sequence[Joint], tangents: Array, frame: Array) -> tuple[Array, Array, Array]:
    frames, angles, off = [frame], np.zeros((len(joints), 3)), np.zeros(len(joints))
    for k, (joint, tangent) in enumerate(zip(joints, tangents[1:], strict=True)):
        wanted = matrix_product(frames[-1].T, tangent[:, None])[:, 0]
        own, turn = _turned(joint, wanted)
        angles[k, : len(own)] = own
        off[k] = math.atan2(math.hypot(*np.cross(turn[:, 0], wanted)), dot(turn[:, 0], wanted))
        frames.append(matrix_product(frames[-1], turn))
    return np.array(frames), angles, off


def _turned(joint: Joint, wanted: Array) -> tuple[list[float], Array]:
    """Return angles [rad] and rotation (3, 3) of a joint that bring x as near as possible to a direction (3,)."""
    x = np.array([1.0, 0.0, 0.0])
    axes = [np.array(axis) for axis in joint.axes]
    if len(axes) == 3:
        normal, cosine = np.cross(x, wanted), float(wanted[0])
        sine = math.hypot(*normal)
        # Straight back: about the first axis across the link.
        direction = normal / sine if sine > 1e-12 else np.array([0.0, 0.0, 1.0])
        vector = math.atan2(sine, cosine) * direction
        return [dot(vector, axis) for axis in axes], Rotation.from_rotvec(vector).as_matrix()
    if len(axes) == 1:
        angle = _about(axes[0], x, wanted)
        return [angle], Rotation.from_rotvec(angle * axes[0]).as_matrix()
    # The first axis keeps its part of the direction, which the second one must give.
    first, second = axes
    along = second * second[0]
    a, b, c = (dot(each, first) for each in (x - along, np.cross(second, x), along))
    size, phase = math.hypot(a, b), math.atan2(b, a)
    reach = math.acos(min(1.0, max(-1.0, (dot(wanted, first) - c) / size))) if size > 1e-12 else 0.0
    found = []
    for angle in (math.remainder(phase + sign * reach, 2 * math.pi) for sign in (1, -1)):
        inner = Rotation.from_rotvec(angle * second).as_matrix()
        outer = _about(first, inner[:, 0], wanted)
        found.append(([outer, angle], matrix_product(Rotation.from_rotvec(outer * first).as_matrix(), inner)))
    return min(found, key=lambda pair: round(max(map(abs, pair[0])), 9))


def _about(axis: Array, start: Array, wanted: Array) -> float:
    """Return the angle [rad] about an axis (3,) by which a direction comes nearest to another one."""
    across = start - axis * dot(axis, start)
    return math.atan2(dot(wanted, np.cross(axis, start)), dot(wanted, across))
