"""Nearest points of segments.

Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
"""

from __future__ import annotations

from dem.engine.links.compiler import inlined

PARALLEL = 1e-12  # sin² of the angle below which a solution for crossing lines has no digits left


@inlined
def nearest_on_segments(a: float, b: float, c: float, d: float, e: float) -> tuple[float, float]:
    """Parameters (s, t) in [0, 1] of the nearest points p + s u and q + t v of two segments.

    Args:
        a: u·u, positive.
        b: u·v.
        c: v·v, positive.
        d: u·(p - q).
        e: v·(p - q).
    """
    return nearest(a, b, c, d, e, 1 / a, 1 / c)


@inlined
def nearest(
    a: float, b: float, c: float, d: float, e: float, inverse_a: float, inverse_c: float
) -> tuple[float, float]:
    """The same where 1/a and 1/c are known, which links keep all their lives: divisions would take half the time."""
    determinant = a * c - b * b
    s = min(1.0, max(0.0, (b * e - c * d) / determinant)) if determinant > PARALLEL * a * c else 0.0
    # Selections rather than branches, which nobody could predict: half of all nearest points are ends.
    t = (b * s + e) * inverse_c
    inside = min(1.0, max(0.0, t))
    at_end = min(1.0, max(0.0, (b * inside - d) * inverse_a))
    return s if t == inside else at_end, inside
