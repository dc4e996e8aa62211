"""Vectors as tuples of three numbers, which need no allocation, and nearest points of two segments."""

from typing import NamedTuple, TypeAlias

from dem.engine.links.arrays import Array, Bodies
from dem.engine.links.compiler import inlined
from dem.engine.links.shapes import INVERSE, START, VECTOR

Vector: TypeAlias = tuple[float, float, float]

PARALLEL = 1e-12  # sin² of the angle below which a solution for crossing lines has no digits left


@inlined
def vector(row: Array, begin: int) -> Vector:
    """Return three numbers of a row, from index `begin` on."""
    return row[begin], row[begin + 1], row[begin + 2]


@inlined
def put(row: Array, begin: int, a: Vector) -> None:
    """Write a vector into a row, from index `begin` on."""
    row[begin], row[begin + 1], row[begin + 2] = a


@inlined
def put_more(row: Array, begin: int, a: Vector) -> None:
    """Add a vector to three numbers of a row, from index `begin` on."""
    row[begin] += a[0]
    row[begin + 1] += a[1]
    row[begin + 2] += a[2]


@inlined
def add(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def sub(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def scale(s: float, a: Vector) -> Vector:
    """Return s a."""
    return s * a[0], s * a[1], s * a[2]


@inlined
def along(a: Vector, s: float, b: Vector) -> Vector:
    """Return a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@inlined
def dot(a: Vector, b: Vector) -> float:
    """Return a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def square(a: Vector) -> float:
    """Return a · a."""
    return dot(a, a)


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """Return a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def moving(v: Vector, w: Vector, r: Vector) -> Vector:
    """Return v + w × r, the velocity at a point of a rigid body.

    Args:
        v: velocity of a reference point of the body.
        w: angular velocity of the body.
        r: vector from the reference point to the point.
    """
    return (
        v[0] + w[1] * r[2] - w[2] * r[1],
        v[1] + w[2] * r[0] - w[0] * r[2],
        v[2] + w[0] * r[1] - w[1] * r[0],
    )


@inlined
def turned(bodies: Bodies, i: int, x: float, y: float, z: float) -> Vector:
    """Transform a vector from the frame of body `i` to the laboratory frame."""
    axes = bodies.axes
    return (
        axes[i, 0, 0] * x + axes[i, 0, 1] * y + axes[i, 0, 2] * z,
        axes[i, 1, 0] * x + axes[i, 1, 1] * y + axes[i, 1, 2] * z,
        axes[i, 2, 0] * x + axes[i, 2, 1] * y + axes[i, 2, 2] * z,
    )


@inlined
def turned_back(bodies: Bodies, i: int, a: Vector) -> Vector:
    """Transform a vector from the laboratory frame to the frame of body `i`."""
    axes = bodies.axes
    return (
        axes[i, 0, 0] * a[0] + axes[i, 1, 0] * a[1] + axes[i, 2, 0] * a[2],
        axes[i, 0, 1] * a[0] + axes[i, 1, 1] * a[1] + axes[i, 2, 1] * a[2],
        axes[i, 0, 2] * a[0] + axes[i, 1, 2] * a[1] + axes[i, 2, 2] * a[2],
    )


class Lines(NamedTuple):
    """Two segments p + s u and q + t v, with s and t from 0 to 1, and products of their vectors."""

    p: Vector  #: Start of the first segment [m]
    q: Vector  #: Start of the second segment [m]
    u: Vector  #: Vector from start to end of the first segment [m]
    v: Vector  #: Vector from start to end of the second segment [m]
    w: Vector  #: p - q [m]
    a: float  #: u · u [m²]
    b: float  #: u · v [m²]
    c: float  #: v · v [m²]
    d: float  #: u · w [m²]
    e: float  #: v · w [m²]
    inverse_a: float  #: 1/a [1/m²], stored with the segment, since a division is slow
    inverse_c: float  #: 1/c [1/m²]


@inlined
def lines(p: Array, q: Array) -> Lines:
    """Return two segments as `Lines`, from rows (LINE,) with the columns of `shapes.START`."""
    start, other, u, v = vector(p, START), vector(q, START), vector(p, VECTOR), vector(q, VECTOR)
    w = sub(start, other)
    return Lines(
        start, other, u, v, w, dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w), p[INVERSE], q[INVERSE]
    )  # fmt: skip


@inlined
def exchanged(both: Lines) -> Lines:
    """Return two segments in the other order."""
    return Lines(
        both.q, both.p, both.v, both.u, scale(-1.0, both.w), both.c, both.b, both.a, -both.e, -both.d, both.inverse_c,
        both.inverse_a,
    )  # fmt: skip


@inlined
def between(both: Lines, s: float, t: float) -> Vector:
    """Return the vector from the point q + t v of the second segment to p + s u of the first [m]."""
    return sub(along(both.w, s, both.u), scale(t, both.v))


@inlined
def clamp(value: float) -> float:
    """Return a value limited to the range from 0 to 1."""
    return min(1.0, max(0.0, value))


@inlined
def nearest(both: Lines) -> tuple[float, float]:
    """Return s and t, from 0 to 1, of the nearest points p + s u and q + t v of two segments.

    Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    a, b, c, d, e = both.a, both.b, both.c, both.d, both.e
    determinant = a * c - b * b
    s = clamp((b * e - c * d) / determinant) if determinant > PARALLEL * a * c else 0.0
    # Selections rather than branches, which nothing can predict: half of all nearest points are ends.
    t = (b * s + e) * both.inverse_c
    inside = clamp(t)
    at_end = clamp((b * inside - d) * both.inverse_a)
    return s if t == inside else at_end, inside
