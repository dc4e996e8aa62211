"""Forces of floor and wall on the ends of links.

A plane, and the inside of a round wall, are met by a straight link with its ends: they tell all. Hinges count once, as
ends of the middle link.
"""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import CHANNEL, FLOOR, SURFACES, WALL, Array, Bodies, Ends, Ground, Law
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.law import resist
from dem.engine.links.contact.pairs import push, put_down
from dem.engine.links.shape import Shape


@inlined
def rub(
    shape: Shape, law: Law, bodies: Bodies, ground: Ground, hinged: Any, ledger: Any, dt: float,
    p: int, part_of: int, load: float, weight: float, slip: Array,
    x: float, y: float, z: float, nx: float, ny: float, nz: float,
) -> None:  # fmt: skip
    """Let a fixture push a link at a point.

    Args:
        shape: what all smarticles have in common.
        law: of contacts with fixtures.
        bodies: the smarticles; `load` or `shares` is written.
        ground: the fixtures; `force` is written.
        hinged: None while welded.
        ledger: of forces that dissipate; None where nobody asks.
        dt: time step [s].
        p: the link.
        part_of: the fixture, a row of `Ground.force`.
        load: of the normal spring [N].
        weight: share of a whole contact [1].
        slip: (4,) what the contact remembers; brought up to date.
        x: point of contact [m].
        y: the same.
        z: the same.
        nx: normal, from the fixture to the link [1].
        ny: the same.
        nz: the same.
    """
    links = shape.kinds.shape[0]
    i, kind = p // (links * shape.offsets.shape[0]), shape.kinds[p % links]
    row = i
    if hinged is not None:
        row = 3 * i + kind
    motion, position = bodies.motion, bodies.position
    rx, ry, rz = x - position[i, 0], y - position[i, 1], z - position[i, 2]
    ax, ay, az = motion[row, 3], motion[row, 4], motion[row, 5]
    vx = motion[row, 0] + ay * rz - az * ry
    vy = motion[row, 1] + az * rx - ax * rz
    vz = motion[row, 2] + ax * ry - ay * rx
    speed = ground.speed[part_of] if part_of < CHANNEL else 0.0
    stored = slip[3]
    twist = 0.5 * dt * (ax * nx + ay * ny + az * nz)
    fx, fy, fz = resist(law, load, weight, nx, ny, nz, vx, vy, vz - speed, twist, dt, slip)
    if ledger is not None:
        # The fixture keeps its speed: of the mean of before and after, twice its half.
        known = 0.5 * dt * (fx * vx + fy * vy + fz * (vz - 2 * speed)) + slip[3] - stored
        put_down(ledger, (row, -1), (i, -1), x, y, z, fx, fy, fz, known)
    fx, fy, fz = fx + load * nx, fy + load * ny, fz + load * nz
    push(shape, bodies, i, kind, hinged, x, y, z, fx, fy, fz)
    ground.force[part_of, 0] -= fx
    ground.force[part_of, 1] -= fy
    ground.force[part_of, 2] -= fz


@inlined
def press(
    shape: Shape, law: Law, bodies: Bodies, ends: Ends, ground: Ground, hinged: Any, ledger: Any, dt: float,
    p: int, end: int, surface: int, part_of: int, depth: float,
    x: float, y: float, z: float, nx: float, ny: float, nz: float,
) -> None:  # fmt: skip
    """Let a fixture push an end of a link, where the sphere about it is `depth` [m] deep in a surface.

    Args:
        shape: as in `rub`.
        law: as in `rub`.
        bodies: as in `rub`; `deepest` is written as well.
        ends: what contacts remember; brought up to date.
        ground: as in `rub`.
        hinged: as in `rub`.
        ledger: as in `rub`.
        dt: as in `rub`.
        p: the link.
        end: 0 its start, 1 its end.
        surface: which one, for memory.
        part_of: the fixture.
        depth: of the contact [m].
        x: end of the link's axis [m].
        y: the same.
        z: the same.
        nx: normal, from the fixture to the link [1].
        ny: the same.
        nz: the same.
    """
    arm = shape.radius - 0.5 * depth
    rub(
        shape, law, bodies, ground, hinged, ledger, dt, p, part_of, law.stiffness * depth, 1.0,
        ends.slip[p, end, surface], x - arm * nx, y - arm * ny, z - arm * nz, nx, ny, nz,
    )  # fmt: skip
    ends.used[p, end] |= 1 << surface
    if part_of == WALL and ground.flags[1] != 0:
        # A lifted wall has two sides: who is a radius deep has come through. The other surfaces have one.
        i = p // (shape.kinds.shape[0] * shape.offsets.shape[0])
        bodies.deepest[i] = max(bodies.deepest[i], 2 * depth)


@inlined
def end_contacts(ends: Ends, p: int, end: int, now: int) -> float:
    """Forget contacts of an end of a link that have ended.

    Args:
        ends: what contacts remember; brought up to date.
        p: the link.
        end: 0 its start, 1 its end.
        now: the surfaces that it touches, as bits.

    Returns:
        Energy that their tangential springs held [J].
    """
    energy = 0.0
    over = ends.used[p, end] & ~now
    if over:
        for surface in range(SURFACES):
            if over & (1 << surface):
                energy += ends.slip[p, end, surface, 3]
                for d in range(4):
                    ends.slip[p, end, surface, d] = 0.0
    ends.used[p, end] = now
    return energy


@part
def push_up(
    shape: Shape, law: Law, bodies: Bodies, ends: Ends, ground: Ground, hinged: Any, ledger: Any, dt: float,
    begin: int, stop: int,
) -> float:  # fmt: skip
    """Add the forces of floor and wall on smarticles from `begin` up to `stop`; other arguments as in `press`.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    segments, radius = bodies.segments, shape.radius
    links, lost, link = shape.kinds.shape[0], 0.0, -1
    each = links * shape.offsets.shape[0]
    floor, lift = ground.place[0], ground.place[1]
    walled, lifted = ground.flags[0] != 0, ground.flags[1] != 0
    tiers = ground.radii.shape[0]
    inner = ground.radii[tiers - 1] - radius
    least = inner * inner if walled else math.inf
    for p in range(each * begin, each * stop):
        link = link + 1 if link + 1 < links else 0
        for end in range(0 if shape.kinds[link] == 1 else 1, 2):
            x, y, z = segments[p, 0], segments[p, 1], segments[p, 2]
            if end == 1:
                x, y, z = x + segments[p, 3], y + segments[p, 4], z + segments[p, 5]
            before = ends.used[p, end]
            squared = x * x + y * y
            low = z - floor < radius
            if not (low or before or squared > least):
                continue
            ends.used[p, end] = 0
            if low:
                depth = radius - (z - floor)
                press(
                    shape,
                    law,
                    bodies,
                    ends,
                    ground,
                    hinged,
                    ledger,
                    dt,
                    p,
                    end,
                    0,
                    FLOOR,
                    depth,
                    x,
                    y,
                    z,
                    0.0,
                    0.0,
                    1.0,
                )
            if squared > least:
                _wall(shape, law, bodies, ends, ground, hinged, ledger, dt, p, end, x, y, z, lift, lifted)
            now = ends.used[p, end]
            ends.used[p, end] = before
            lost += end_contacts(ends, p, end, now)
    return lost


@inlined
def _wall(
    shape: Shape, law: Law, bodies: Bodies, ends: Ends, ground: Ground, hinged: Any, ledger: Any, dt: float,
    p: int, end: int, x: float, y: float, z: float, lift: float, lifted: bool,
) -> None:  # fmt: skip
    """Let wall and ceilings push an end of a link."""
    radius, tiers = shape.radius, ground.radii.shape[0]
    height, r = z - lift, math.sqrt(x * x + y * y)
    if height > ground.top:
        return
    ex, ey = x / r, y / r
    if lifted and height < ground.bottoms[0]:
        # Under the wall: its lower edge is all that there is of it.
        _edge(
            shape, law, bodies, ends, ground, hinged, ledger, dt, p, end, 1, x, y, z, ex, ey,
            r - ground.radii[0], height - ground.bottoms[0],
        )  # fmt: skip
        return
    tier = 0
    while tier + 1 < tiers and height > ground.bottoms[tier + 1]:
        tier += 1
    depth = r + radius - ground.radii[tier]
    if lifted and r > ground.radii[tier]:
        depth = ground.radii[tier] + radius - r
        ex, ey = -ex, -ey
    if depth > 0.0:
        press(
            shape, law, bodies, ends, ground, hinged, ledger, dt, p, end, 1, WALL, depth, x, y, z, -ex, -ey, 0.0
        )  # fmt: skip
    if tier + 1 < tiers and height > ground.bottoms[tier + 1] - radius:
        above = height - ground.bottoms[tier + 1]
        if r >= ground.radii[tier + 1]:
            press(
                shape, law, bodies, ends, ground, hinged, ledger, dt, p, end, 2, WALL, radius + above,
                x, y, z, 0.0, 0.0, -1.0,
            )  # fmt: skip
        else:
            _edge(
                shape, law, bodies, ends, ground, hinged, ledger, dt, p, end, 2, x, y, z, ex, ey,
                r - ground.radii[tier + 1], above,
            )  # fmt: skip


@inlined
def _edge(
    shape: Shape, law: Law, bodies: Bodies, ends: Ends, ground: Ground, hinged: Any, ledger: Any, dt: float,
    p: int, end: int, surface: int, x: float, y: float, z: float, ex: float, ey: float, out: float, up: float,
) -> None:  # fmt: skip
    """Let a round edge push an end that is `out` [m] outside of it and `up` [m] above it, (ex, ey) outwards."""
    distance = math.sqrt(out * out + up * up)
    if distance < shape.radius and distance > 0.0:
        press(
            shape, law, bodies, ends, ground, hinged, ledger, dt, p, end, surface, WALL, shape.radius - distance,
            x, y, z,
            ex * out / distance, ey * out / distance, up / distance,
        )  # fmt: skip


@part
def push_sideways(
    shape: Shape, law: Law, bodies: Bodies, ends: Ends, ground: Ground, half: float, hinged: Any, ledger: Any,
    dt: float, begin: int, stop: int,
) -> float:  # fmt: skip
    """Add the forces of the walls y = ±`half` [m] of a channel; other arguments as in `push_up`.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    segments, radius = bodies.segments, shape.radius
    links, lost = shape.kinds.shape[0], 0.0
    each = links * shape.offsets.shape[0]
    for p in range(each * begin, each * stop):
        for end in range(0 if shape.kinds[p % links] == 1 else 1, 2):
            x, y, z = segments[p, 0], segments[p, 1], segments[p, 2]
            if end == 1:
                x, y, z = x + segments[p, 3], y + segments[p, 4], z + segments[p, 5]
            before = ends.used[p, end]
            ends.used[p, end] = 0
            for side in range(2):
                normal = 1.0 if side == 0 else -1.0
                depth = radius - half - normal * y
                if depth > 0.0:
                    press(
                        shape, law, bodies, ends, ground, hinged, ledger, dt, p, end, side, CHANNEL + side, depth,
                        x, y, z, 0.0, normal, 0.0,
                    )  # fmt: skip
            now = ends.used[p, end]
            ends.used[p, end] = before
            lost += end_contacts(ends, p, end, now)
    return lost
