"""Forces of the wall's round edges on links that reach across them."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import WALL, Array, Bodies, Ground, Law, Rims
from dem.engine.links.compiler import part
from dem.engine.links.contact.walls import rub
from dem.engine.links.shape import Shape

GOLDEN = (math.sqrt(5) - 1) / 2
SAMPLES, TURNS = 8, 32  # places along a link that are tried, and narrowings about the best: to 2e-7 of its length


@part
def _squared(link: Array, s: float, radius: float, height: float) -> float:
    """Squared distance [m²] of a point of a link's axis from a horizontal circle about the z-axis."""
    x, y, z = link[0] + s * link[3], link[1] + s * link[4], link[2] + s * link[5]
    out, up = math.sqrt(x * x + y * y) - radius, z - height
    return float(out * out + up * up)


@part
def nearest_to_circle(link: Array, radius: float, height: float) -> float:
    """Parameter in [0, 1] of the point of a link's axis that is nearest to a horizontal circle about the z-axis.

    Args:
        link: (6,) start of the axis and vector to its end [m].
        radius: of the circle [m].
        height: of the circle [m].
    """
    # A line can come near a circle twice: the best of some points tells about which.
    best, least = 0, math.inf
    for k in range(SAMPLES + 1):
        found = _squared(link, k / SAMPLES, radius, height)
        if found < least:
            best, least = k, found
    low, high = max(0.0, (best - 1) / SAMPLES), min(1.0, (best + 1) / SAMPLES)
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_a, at_b = _squared(link, a, radius, height), _squared(link, b, radius, height)
    for _ in range(TURNS):
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - GOLDEN * (high - low)
            at_a = _squared(link, a, radius, height)
        else:
            low, a, at_a = a, b, at_b
            b = low + GOLDEN * (high - low)
            at_b = _squared(link, b, radius, height)
    return 0.5 * (low + high)


@part
def push_rims(
    shape: Shape, law: Law, bodies: Bodies, ground: Ground, rims: Rims, hinged: Any, ledger: Any, dt: float,
    begin: int, stop: int,
) -> float:  # fmt: skip
    """Add the forces of the rims on links between their ends; for the ends themselves the wall cares.

    Args:
        shape: what all smarticles have in common.
        law: of contacts with fixtures.
        bodies: the smarticles; `load` or `shares`, and `deepest` are written.
        ground: the fixtures; `force` is written.
        rims: the edges; what contacts remember is brought up to date.
        hinged: None while welded.
        ledger: of forces that dissipate; None where nobody asks.
        dt: time step [s].
        begin: the first smarticle.
        stop: the one after the last.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    if ground.flags[0] == 0:
        return 0.0
    segments, radius, lost = bodies.segments, shape.radius, 0.0
    each = shape.kinds.shape[0] * shape.offsets.shape[0]
    for rim in range(rims.radii.shape[0]):
        height, round_ = ground.place[WALL] + rims.heights[rim], rims.radii[rim]
        for p in range(each * begin, each * stop):
            low = min(segments[p, 2], segments[p, 2] + segments[p, 5]) - radius
            high = max(segments[p, 2], segments[p, 2] + segments[p, 5]) + radius
            touching = False
            if low < height < high:
                s = nearest_to_circle(segments[p], round_, height)
                squared = _squared(segments[p], s, round_, height)
                if squared < radius * radius and squared > 0.0 and 1e-6 < s < 1 - 1e-6:
                    touching = True
                    distance = math.sqrt(squared)
                    x, y = segments[p, 0] + s * segments[p, 3], segments[p, 1] + s * segments[p, 4]
                    z = segments[p, 2] + s * segments[p, 5]
                    r = math.sqrt(x * x + y * y)
                    nx, ny = (r - round_) * x / (r * distance), (r - round_) * y / (r * distance)
                    nz, depth = (z - height) / distance, radius - distance
                    arm = radius - 0.5 * depth
                    rub(
                        shape, law, bodies, ground, hinged, ledger, dt, p, WALL, law.stiffness * depth, 1.0,
                        rims.slip[p, rim], x - arm * nx, y - arm * ny, z - arm * nz, nx, ny, nz,
                    )  # fmt: skip
                    bodies.deepest[p // each] = max(bodies.deepest[p // each], depth)
            if rims.used[p, rim] and not touching:
                lost += rims.slip[p, rim, 3]
                for d in range(4):
                    rims.slip[p, rim, d] = 0.0
            rims.used[p, rim] = touching
    return lost
