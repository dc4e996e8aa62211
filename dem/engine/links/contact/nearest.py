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
    determinant = a * c - b * b
    s = min(1.0, max(0.0, (b * e - c * d) / determinant)) if determinant > PARALLEL * a * c else 0.0
    # Selections rather than branches, which nobody could predict: half of all nearest points are ends.
    t = (b * s + e) / c
    inside = min(1.0, max(0.0, t))
    at_end = min(1.0, max(0.0, (b * inside - d) / a))
    return s if t == inside else at_end, inside
