"""Forces of the hooks' square bars on links.

A link has up to three contacts with a bar, as links have with each other: at the nearest point, and at both ends of the
stretch over which it lies on the bar. The force along a link that slides off a bar's end is left out: it is less than a
hundredth of the normal one, and the bars stand still or are drawn at a given speed.
"""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import LOWER, Array, Bodies, Ground, Hooks, Law
from dem.engine.links.compiler import part
from dem.engine.links.contact.walls import rub
from dem.engine.links.shape import Shape

TURNS = 60  # of a search that ends when it has the answer to the last digit, mostly after three
FINE = 1e-15


@part
def _beyond(value: float, half: float) -> float:
    """How far a coordinate is outside of ±half, with its sign [m]."""
    return value - half if value > half else (value + half if value < -half else 0.0)


@part
def nearest_to_box(x: float, y: float, z: float, link: Array, half: Array) -> float:
    """Parameter in [0, 1] of the point of a link's axis that is nearest to a box about the origin.

    The squared distance is convex and made of parabolas; Newton's method finds the right one within a few steps, and
    bisection where it leaves the bracket.

    Args:
        x: start of the axis, from the middle of the box [m].
        y: the same.
        z: the same.
        link: (6,) of which the last three numbers are the vector to the end of the axis [m].
        half: (3,) half edges of the box [m].
    """
    ux, uy, uz = link[3], link[4], link[5]
    low, high, s = 0.0, 1.0, 0.5
    for _ in range(TURNS):
        a, b, c = _beyond(x + s * ux, half[0]), _beyond(y + s * uy, half[1]), _beyond(z + s * uz, half[2])
        slope = a * ux + b * uy + c * uz
        bend = (ux * ux if a != 0.0 else 0.0) + (uy * uy if b != 0.0 else 0.0) + (uz * uz if c != 0.0 else 0.0)
        if bend == 0.0 or slope == 0.0:
            return s
        if slope > 0.0:
            high = s
        else:
            low = s
        if high - low < FINE:
            return s
        new = s - slope / bend
        if new <= low or new >= high:
            # At the end of the link, or on another parabola.
            end = 1.0 if slope < 0.0 else 0.0
            if (slope < 0.0 and high == 1.0) or (slope > 0.0 and low == 0.0):
                a = _beyond(x + end * ux, half[0])
                b = _beyond(y + end * uy, half[1])
                c = _beyond(z + end * uz, half[2])
                if (a * ux + b * uy + c * uz) * slope >= 0.0:
                    return end
            new = 0.5 * (low + high)
        s = new
    return s


@part
def meet_bar(
    x: float, y: float, z: float, link: Array, half: Array, radius: float, stiffness: float, out: Array
) -> int:
    """Points of contact of a link with a bar, and the springs there, as `meet` has them for two links.

    Args:
        x: start of the link's axis, from the middle of the bar [m].
        y: the same.
        z: the same.
        link: (6,) see `nearest_to_box`.
        half: (3,) half edges of the bar [m].
        radius: of the link [m].
        stiffness: kn [N/m].
        out: rows of place on the link's axis, from the middle of the bar [m], normal from the bar to the link [1], load
            [N], depth [m], share of a whole contact [1]; written.

    Returns:
        Number of points, 0 where they are apart.
    """
    s = nearest_to_box(x, y, z, link, half)
    deepest = _row(x, y, z, link, half, radius, s, out[0])
    if deepest <= 0.0:
        return 0
    out[0, 6], out[0, 8] = stiffness * deepest, 1.0
    # The stretch that lies on the bar: within its edges, but for those of the face that is touched.
    face, most = 0, 0.0
    for d in range(3):
        if abs(out[0, 3 + d]) > most:
            face, most = d, abs(out[0, 3 + d])
    low, high = 0.0, 1.0
    for d in range(3):
        begin, u = (x, y, z)[d], link[3 + d]
        if d != face:
            if abs(u) < 1e-12:
                if abs(begin) > half[d]:
                    return 1
            else:
                a, b = (-half[d] - begin) / u, (half[d] - begin) / u
                low, high = max(low, min(a, b)), min(high, max(a, b))
    if high <= low:
        return 1
    depth1 = min(_row(x, y, z, link, half, radius, low, out[1]), deepest)
    depth2 = min(_row(x, y, z, link, half, radius, high, out[2]), deepest)
    if depth1 <= 0.0 or depth2 <= 0.0:
        return 1
    along = (high - low) * math.sqrt(link[3] ** 2 + link[4] ** 2 + link[5] ** 2) / (2 * radius)
    grown = along * along * (3 - 2 * along) if along < 1.0 else 1.0
    first, second = (depth1 / deepest) ** 2, (depth2 / deepest) ** 2
    out[0, 8] = 1 - grown * first * second
    out[1, 8], out[2, 8] = grown * second, grown * first
    out[0, 6], out[1, 6], out[2, 6] = (
        stiffness * deepest * out[0, 8],
        stiffness * depth1 * out[1, 8],
        stiffness * depth2 * out[2, 8],
    )
    return 3


@part
def _row(x: float, y: float, z: float, link: Array, half: Array, radius: float, s: float, row: Array) -> float:
    """Write place, normal and depth of one point of a link; its depth [m], negative where it is apart."""
    px, py, pz = x + s * link[3], y + s * link[4], z + s * link[5]
    a, b, c = _beyond(px, half[0]), _beyond(py, half[1]), _beyond(pz, half[2])
    distance = math.sqrt(a * a + b * b + c * c)
    row[0], row[1], row[2] = px, py, pz
    if distance > 0.0:
        row[3], row[4], row[5] = a / distance, b / distance, c / distance
        row[7] = radius - distance
    else:
        # The axis is inside: out through the nearest face.
        ways = (half[0] - abs(px), half[1] - abs(py), half[2] - abs(pz))
        row[3] = row[4] = row[5] = 0.0
        if ways[0] <= ways[1] and ways[0] <= ways[2]:
            row[3] = math.copysign(1.0, px)
        elif ways[1] <= ways[2]:
            row[4] = math.copysign(1.0, py)
        else:
            row[5] = math.copysign(1.0, pz)
        row[7] = radius + min(ways[0], ways[1], ways[2])
    return float(row[7])


@part
def push_hooks(
    shape: Shape,
    law: Law,
    bodies: Bodies,
    ground: Ground,
    hooks: Hooks,
    hinged: Any,
    ledger: Any,
    dt: float,
    out: Array,
    begin: int,
    stop: int,
) -> float:
    """Add the forces of the hooks.

    Args:
        shape: what all smarticles have in common.
        law: of contacts with fixtures.
        bodies: the smarticles; `load` or `shares`, and `deepest` are written.
        ground: the fixtures; `force` is written.
        hooks: the hooks; what contacts remember is brought up to date.
        hinged: None while welded.
        ledger: of forces that dissipate; None where nobody asks.
        dt: time step [s].
        out: scratch.
        begin: the first smarticle.
        stop: the one after the last.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    segments, radius, lost = bodies.segments, shape.radius, 0.0
    each = shape.kinds.shape[0] * shape.offsets.shape[0]
    for hook in range(2):
        height = ground.place[LOWER + hook]
        for p in range(each * begin, each * stop):
            z, uz = segments[p, 2] - height, segments[p, 5]
            ux, uy = segments[p, 3], segments[p, 4]
            for bar in range(hooks.counts[hook]):
                east, north = hooks.middles[hook, bar, 0], hooks.middles[hook, bar, 1]
                x, y = segments[p, 0] - east, segments[p, 1] - north
                half, now = hooks.halves[hook, bar], 0
                if (
                    min(z, z + uz) < half[2] + radius
                    and max(z, z + uz) > -half[2] - radius
                    and min(x, x + ux) < half[0] + radius
                    and max(x, x + ux) > -half[0] - radius
                    and min(y, y + uy) < half[1] + radius
                    and max(y, y + uy) > -half[1] - radius
                ):
                    for slot in range(meet_bar(x, y, z, segments[p], half, radius, law.stiffness, out)):
                        row = out[slot]
                        if row[8] > 0.0:
                            now |= 1 << slot
                            arm = radius - 0.5 * row[7]
                            rub(
                                shape, law, bodies, ground, hinged, ledger, dt, p, LOWER + hook, row[6], row[8],
                                hooks.slip[p, hook, bar, slot],
                                row[0] - arm * row[3] + east, row[1] - arm * row[4] + north,
                                row[2] - arm * row[5] + height,
                                row[3], row[4], row[5],
                            )  # fmt: skip
                    if now:
                        i = p // each
                        bodies.deepest[i] = max(bodies.deepest[i], out[0, 7])
                over = hooks.used[p, hook, bar] & ~now
                if over:
                    for slot in range(3):
                        if over & (1 << slot):
                            lost += hooks.slip[p, hook, bar, slot, 3]
                            for d in range(4):
                                hooks.slip[p, hook, bar, slot, d] = 0.0
                hooks.used[p, hook, bar] = now
    return lost
