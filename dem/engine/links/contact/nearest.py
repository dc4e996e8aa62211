"""Nearest points of segments.

Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
"""

from __future__ import annotations

from dem.engine.links.compiler import part

PARALLEL = 1e-12  # sin² of the angle below which a solution for crossing lines has no digits left


@part
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
    s = 0.0
    if determinant > PARALLEL * a * c:
        s = min(1.0, max(0.0, (b * e - c * d) / determinant))
    t = (b * s + e) / c
    if t < 0.0:
        t = 0.0
        s = min(1.0, max(0.0, -d / a))
    elif t > 1.0:
        t = 1.0
        s = min(1.0, max(0.0, (b - d) / a))
    return s, t
