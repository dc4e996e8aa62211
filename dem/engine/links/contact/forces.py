"""Forces at the points at which links touch at one instant, for who records them; nothing of the simulation changes.

They are those that the next step begins with, but for the stretch that tangential springs gain in that step: the same
geometry and the same law, over no time and on copies of the springs. What acts without friction along a link, or takes
back what a hinge has twice, goes with the points of its pair.
"""

from __future__ import annotations

from typing import Any

from dem.engine.links.arrays import LOWER, WALL, Array, Bodies, Ends, Ground, Law, Pairs
from dem.engine.links.compiler import inlined, kernel
from dem.engine.links.contact.bars import meet_bar
from dem.engine.links.contact.law import resist
from dem.engine.links.contact.meeting import POINTS, meet
from dem.engine.links.contact.pairs import motion_at
from dem.engine.links.contact.queries import depth_at, normal_at
from dem.engine.links.contact.rims import nearest_to_circle
from dem.engine.links.shape import Shape

FIRST, SECOND, LOAD, POINT, FRICTION, FORCE = 0, 1, 2, 3, 6, 9  # columns of a row
WIDTH = 12


@inlined
def _write(
    rows: Array, count: int, first: int, second: int, load: float, carried: float,
    x: float, y: float, z: float, nx: float, ny: float, nz: float, fx: float, fy: float, fz: float,
) -> int:  # fmt: skip
    """Write one point, see `forces_of_pairs`; `count` + 1.

    Args:
        rows: written where there is room.
        count: place.
        first: what touches.
        second: what is touched.
        load: of the spring [N].
        carried: the part of it that dashpot and friction go with [N].
        x: the point [m].
        y: the same.
        z: the same.
        nx: normal [1].
        ny: the same.
        nz: the same.
        fx: force beyond the spring's [N].
        fy: the same.
        fz: the same.
    """
    if count < rows.shape[0]:
        row, along = rows[count], fx * nx + fy * ny + fz * nz
        row[0], row[1], row[2] = first, second, max(0.0, carried + along)
        row[3], row[4], row[5] = x, y, z
        row[6], row[7], row[8] = fx - along * nx, fy - along * ny, fz - along * nz
        row[9], row[10], row[11] = fx + load * nx, fy + load * ny, fz + load * nz
    return count + 1


@kernel
def forces_of_pairs(
    shape: Shape, law: Law, bodies: Bodies, pairs: Pairs, hinged: Any, out: Array, slip: Array, rows: Array
) -> int:
    """Forces of smarticles on each other.

    Args:
        shape: what all smarticles have in common.
        law: of their contacts.
        bodies: the smarticles, posed.
        pairs: the wide list, which must be good for this instant.
        hinged: None while welded.
        out: scratch of `meet`.
        slip: (4,) scratch.
        rows: (…, WIDTH) written: both as `dem.body.forces.at_links` has them, normal force [N], point [m],
            tangential force and the whole one on the first [N].

    Returns:
        Rows that were written, or would have been: there may be more than there is room for.
    """
    links, each = shape.kinds.shape[0], shape.kinds.shape[0] * shape.offsets.shape[0]
    diameter, count = 2 * shape.radius, 0
    for k in range(pairs.counts[0]):
        p, q = pairs.first[k], pairs.second[k]
        i, j, kind_p, kind_q = p // each, q // each, shape.kinds[p % links], shape.kinds[q % links]
        found = meet(bodies.segments[p], bodies.segments[q], diameter, law.stiffness, kind_p != 1, kind_q != 1, out)
        if found == 0:
            continue
        first, second = 3 * i + kind_p, 3 * j + kind_q
        row_i, row_j = (i, j) if hinged is None else (first, second)
        for slot in range(POINTS):
            weight, load, carried = out[slot, 8], out[slot, 6], out[slot, 7]
            if weight <= 0.0:
                continue
            x, y, z, nx, ny, nz = out[slot, 0], out[slot, 1], out[slot, 2], out[slot, 3], out[slot, 4], out[slot, 5]
            fx, fy, fz = 0.0, 0.0, 0.0
            if carried > 0.0:
                mx, my, mz, _ = motion_at(bodies, i, j, row_i, row_j, x, y, z, nx, ny, nz)
                for d in range(4):
                    slip[d] = pairs.slip[k, slot, d]
                share = weight if carried == load else weight * carried / load
                fx, fy, fz = resist(law, carried, share, nx, ny, nz, mx, my, mz, 0.0, 0.0, slip)
            count = _write(rows, count, first, second, load, carried, x, y, z, nx, ny, nz, fx, fy, fz)
        for bare in range(POINTS, POINTS + found - 1):
            # A spring's, without a normal of its own: nothing of it is friction.
            count = _write(
                rows, count, first, second, 0.0, 0.0, out[bare, 0], out[bare, 1], out[bare, 2], 0.0, 0.0, 0.0,
                out[bare, 3], out[bare, 4], out[bare, 5],
            )  # fmt: skip
            if count <= rows.shape[0]:
                rows[count - 1, FRICTION:FORCE] = 0.0
    return count


@inlined
def _touch(
    shape: Shape, law: Law, bodies: Bodies, ground: Ground, hinged: Any, p: int, part_of: int,
    load: float, weight: float, kept: Array, slip: Array,
    x: float, y: float, z: float, nx: float, ny: float, nz: float, rows: Array, count: int,
) -> int:  # fmt: skip
    """Write what a fixture does to a link at a point, as `dem.engine.links.contact.walls.rub` does it; `count` + 1."""
    links = shape.kinds.shape[0]
    i, kind = p // (links * shape.offsets.shape[0]), shape.kinds[p % links]
    row = i if hinged is None else 3 * i + kind
    motion, position = bodies.motion, bodies.position
    rx, ry, rz = x - position[i, 0], y - position[i, 1], z - position[i, 2]
    ax, ay, az = motion[row, 3], motion[row, 4], motion[row, 5]
    vx = motion[row, 0] + ay * rz - az * ry
    vy = motion[row, 1] + az * rx - ax * rz
    vz = motion[row, 2] + ax * ry - ay * rx
    speed = ground.speed[part_of] if part_of < 4 else 0.0
    for d in range(4):
        slip[d] = kept[d]
    fx, fy, fz = resist(law, load, weight, nx, ny, nz, vx, vy, vz - speed, 0.0, 0.0, slip)
    return _write(rows, count, 3 * i + kind, -1 - part_of, load, load, x, y, z, nx, ny, nz, fx, fy, fz)


@kernel
def forces_of_fixtures(
    shape: Shape, law: Law, bodies: Bodies, ends: Ends, ground: Ground, channel: Any, hooks: Any, rims: Any,
    hinged: Any, out: Array, slip: Array, rows: Array,
) -> int:  # fmt: skip
    """Forces of fixtures on smarticles; what is written and returned as in `forces_of_pairs`.

    Args:
        shape: what all smarticles have in common.
        law: of contacts with fixtures.
        bodies: the smarticles, posed.
        ends: what contacts of ends remember.
        ground: the fixtures.
        channel: (1,) half the distance of the walls of a channel [m]; None for a container.
        hooks: None where there are none.
        rims: None where the wall has none.
        hinged: None while welded.
        out: scratch.
        slip: (4,) scratch.
        rows: (…, WIDTH) written; the second one as `dem.body.forces.at_fixtures` has it.
    """
    segments, radius, count = bodies.segments, shape.radius, 0
    links = shape.kinds.shape[0]
    for p in range(segments.shape[0]):
        for end in range(0 if shape.kinds[p % links] == 1 else 1, 2):
            x, y, z = segments[p, 0], segments[p, 1], segments[p, 2]
            if end == 1:
                x, y, z = x + segments[p, 3], y + segments[p, 4], z + segments[p, 5]
            for surface in range(3):
                part_of, depth = depth_at(ground, channel, radius, surface, x, y, z)
                if depth > 0.0:
                    nx, ny, nz = normal_at(ground, channel, surface, x, y, z)
                    arm = radius - 0.5 * depth
                    count = _touch(
                        shape, law, bodies, ground, hinged, p, part_of, law.stiffness * depth, 1.0,
                        ends.slip[p, end, surface], slip, x - arm * nx, y - arm * ny, z - arm * nz, nx, ny, nz,
                        rows, count,
                    )  # fmt: skip
        if rims is not None and ground.flags[0] != 0:
            for rim in range(rims.radii.shape[0]):
                height, round_ = ground.place[WALL] + rims.heights[rim], rims.radii[rim]
                s = nearest_to_circle(segments[p], round_, height)
                x, y = segments[p, 0] + s * segments[p, 3], segments[p, 1] + s * segments[p, 4]
                z, r = segments[p, 2] + s * segments[p, 5], (x * x + y * y) ** 0.5
                distance = ((z - height) ** 2 + (r - round_) ** 2) ** 0.5
                depth = radius - distance
                if depth > 0.0 and distance > 0.0 and 1e-6 < s < 1 - 1e-6:
                    away, arm = (r - round_) / (r * distance), radius - 0.5 * depth
                    nx, ny, nz = away * x, away * y, (z - height) / distance
                    count = _touch(
                        shape, law, bodies, ground, hinged, p, WALL, law.stiffness * depth, 1.0, rims.slip[p, rim],
                        slip, x - arm * nx, y - arm * ny, z - arm * nz, nx, ny, nz, rows, count,
                    )  # fmt: skip
        if hooks is not None:
            for hook in range(2):
                for bar in range(hooks.counts[hook]):
                    east, north = hooks.middles[hook, bar, 0], hooks.middles[hook, bar, 1]
                    height = ground.place[LOWER + hook]
                    x, y, z = segments[p, 0] - east, segments[p, 1] - north, segments[p, 2] - height
                    half = hooks.halves[hook, bar]
                    for slot in range(meet_bar(x, y, z, segments[p], half, radius, law.stiffness, out)):
                        row = out[slot]
                        if row[8] > 0.0:
                            arm, nx, ny, nz = radius - 0.5 * row[7], row[3], row[4], row[5]
                            count = _touch(
                                shape, law, bodies, ground, hinged, p, LOWER + hook, row[6], row[8],
                                hooks.slip[p, hook, bar, slot], slip, row[0] - arm * nx + east,
                                row[1] - arm * ny + north, row[2] - arm * nz + height, nx, ny, nz, rows, count,
                            )  # fmt: skip
    return count
