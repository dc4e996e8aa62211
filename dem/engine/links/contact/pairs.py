"""Forces of smarticles on each other."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Array, Bodies, Law, Pairs
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.barrier import Step, resolve, stretch
from dem.engine.links.contact.law import resist, share_of_step
from dem.engine.links.contact.meeting import BARE, DISTANCE, HARDENING, POINTS, meet_at, meets_elsewhere
from dem.engine.links.contact.nearest import nearest
from dem.engine.links.shape import Shape


@inlined
def push(
    shape: Shape, bodies: Bodies, i: int, kind: int, hinged: Any,
    x: float, y: float, z: float, fx: float, fy: float, fz: float,
) -> None:  # fmt: skip
    """Let a force act on a point of a smarticle.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles; `load`, or `shares` while articulated, is added to.
        i: the smarticle.
        kind: the link.
        hinged: None while welded.
        x: the point [m].
        y: the same.
        z: the same.
        fx: the force [N].
        fy: the same.
        fz: the same.
    """
    position = bodies.position
    row = i if hinged is None else 3 * i + kind
    load = bodies.load if hinged is None else bodies.shares
    rx, ry, rz = x - position[i, 0], y - position[i, 1], z - position[i, 2]
    load[row, 0] += fx
    load[row, 1] += fy
    load[row, 2] += fz
    load[row, 3] += ry * fz - rz * fy
    load[row, 4] += rz * fx - rx * fz
    load[row, 5] += rx * fy - ry * fx


@inlined
def put_down(
    ledger: Array, rows: tuple[int, int], owners: tuple[int, int],
    x: float, y: float, z: float, fx: float, fy: float, fz: float, power: float, gain: float,
) -> None:  # fmt: skip
    """Note a force that is not a normal spring's, to work out what it dissipates when velocities after it are known.

    Args:
        ledger: (n, LEDGER); row 0 begins with the number of rows in use.
        rows: of the two bodies in `Bodies.motion`; -1 for a boundary.
        owners: the two smarticles; -1 for a boundary.
        x: point of contact [m].
        y: the same.
        z: the same.
        fx: force on the first one [N].
        fy: the same.
        fz: the same.
        power: half of its power with the velocities before [W].
        gain: what its spring took up [J].
    """
    n = int(ledger[0, 0]) + 1
    ledger[0, 0] = n
    row = ledger[n]
    row[0], row[1], row[2], row[3] = rows[0], rows[1], owners[0], owners[1]
    row[4], row[5], row[6], row[7], row[8], row[9], row[10], row[11] = x, y, z, fx, fy, fz, power, gain


@part
def push_apart(
    shape: Shape, law: Law, bodies: Bodies, pairs: Pairs, hinged: Any, ledger: Any, step: Step, out: Array
) -> float:
    """Add the forces of all pairs that touch.

    Args:
        shape: what all smarticles have in common.
        law: of their contacts.
        bodies: the smarticles; `load` or `shares`, and `deepest` are written.
        pairs: pairs that may touch; `slip` and `used` are brought up to date.
        hinged: None while welded.
        ledger: of forces that dissipate; None where nobody asks.
        step: lengths of time around these forces.
        out: (ROWS, COLUMNS) scratch.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    segments, owner, kind = bodies.segments, pairs.owner, pairs.kind
    diameter, inverses = 2 * shape.radius, shape.inverses
    reach = diameter * diameter
    lost = 0.0
    for k in range(_find_touching(shape, bodies, pairs)):
        pair, s, t = pairs.touching[k], pairs.nearest[k, 0], pairs.nearest[k, 1]
        p, q = pairs.first[pair], pairs.second[pair]
        ux, uy, uz = segments[p, 3], segments[p, 4], segments[p, 5]
        vx, vy, vz = segments[q, 3], segments[q, 4], segments[q, 5]
        wx, wy, wz = segments[p, 0] - segments[q, 0], segments[p, 1] - segments[q, 1], segments[p, 2] - segments[q, 2]
        a, b, c = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
        d, e = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
        x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
        squared = x * x + y * y + z * z
        if squared >= reach:
            lost += _forget(pairs, pair, 7)
            continue
        i, j, kind_p, kind_q = owner[p], owner[q], kind[p], kind[q]
        distance = math.sqrt(squared)
        row_i, row_j = i, j
        if hinged is not None:
            row_i, row_j = 3 * i + kind_p, 3 * j + kind_q
        inverse_p, inverse_q = inverses[kind_p], inverses[kind_q]
        others = meets_elsewhere(
            segments[p], segments[q], reach, kind_p != 1, kind_q != 1, a, b, c, d, e, inverse_p, inverse_q
        )
        if (others == 0) & (distance < diameter):
            # Nine of ten: one point, and nothing that a branch would have to be predicted for.
            px = 0.5 * (segments[p, 0] + s * ux + segments[q, 0] + t * vx)
            py = 0.5 * (segments[p, 1] + s * uy + segments[q, 1] + t * vy)
            pz = 0.5 * (segments[p, 2] + s * uz + segments[q, 2] + t * vz)
            u, slope, hardening = stretch(diameter - distance, diameter)
            inverse, load = 1 / distance, law.stiffness * u * slope
            nx, ny, nz = x * inverse, y * inverse, z * inverse
            mx, my, mz, turning = motion_at(bodies, i, j, row_i, row_j, px, py, pz, nx, ny, nz)
            closing, depth = -(mx * nx + my * ny + mz * nz), diameter - distance
            load *= share_of_step(depth, closing, step.past)
            slip, twist = pairs.slip[pair, 0], 0.5 * step.past * turning
            stored = slip[3]
            fx, fy, fz = resist(law, load, 1.0, hardening, nx, ny, nz, mx, my, mz, twist, step.past, slip)
            if ledger is not None:
                power = 0.5 * (fx * mx + fy * my + fz * mz)
                put_down(ledger, (row_i, row_j), (i, j), px, py, pz, fx, fy, fz, power, slip[3] - stored)
            fx, fy, fz = fx + load * nx, fy + load * ny, fz + load * nz
            push(shape, bodies, i, kind_p, hinged, px, py, pz, fx, fy, fz)
            push(shape, bodies, j, kind_q, hinged, px, py, pz, -fx, -fy, -fz)
            if pairs.used[pair] & ~1:
                lost += _forget(pairs, pair, pairs.used[pair] & ~1)
            pairs.used[pair] = 1
            resolve(step, depth, diameter, closing)
            bodies.deepest[i] = max(bodies.deepest[i], depth)
            bodies.deepest[j] = max(bodies.deepest[j], depth)
            continue
        found = 1 + meet_at(
            segments[p], segments[q], diameter, law.stiffness, kind_p != 1, kind_q != 1, a, b, c, d, e, s, t,
            inverse_p, inverse_q, x, y, z, distance, out,
        )  # fmt: skip
        used, closing = 0, 0.0
        for slot in range(POINTS):
            weight = out[slot, 8]
            if weight <= 0.0:
                continue
            used |= 1 << slot
            px, py, pz = out[slot, 0], out[slot, 1], out[slot, 2]
            nx, ny, nz = out[slot, 3], out[slot, 4], out[slot, 5]
            load, carried = out[slot, 6], out[slot, 7]
            mx, my, mz, turning = motion_at(bodies, i, j, row_i, row_j, px, py, pz, nx, ny, nz)
            rate = -(mx * nx + my * ny + mz * nz)
            closing = max(closing, rate)
            acting = share_of_step(diameter - out[slot, DISTANCE], rate, step.past)
            load, carried = load * acting, carried * acting
            twist = 0.5 * step.past * turning
            fx, fy, fz = 0.0, 0.0, 0.0
            stored = pairs.slip[pair, slot, 3]
            if carried > 0.0:
                share = weight if carried == load else weight * carried / load
                fx, fy, fz = resist(
                    law,
                    carried,
                    share,
                    out[slot, HARDENING],
                    nx,
                    ny,
                    nz,
                    mx,
                    my,
                    mz,
                    twist,
                    step.past,
                    pairs.slip[pair, slot],
                )
            else:
                lost += _forget(pairs, pair, 1 << slot)
            if ledger is not None:
                power = 0.5 * (fx * mx + fy * my + fz * mz)
                gain = pairs.slip[pair, slot, 3] - stored
                put_down(ledger, (row_i, row_j), (i, j), px, py, pz, fx, fy, fz, power, gain)
            fx, fy, fz = fx + load * nx, fy + load * ny, fz + load * nz
            push(shape, bodies, i, kind_p, hinged, px, py, pz, fx, fy, fz)
            push(shape, bodies, j, kind_q, hinged, px, py, pz, -fx, -fy, -fz)
        for row in range(POINTS, POINTS + found - 1):
            px, py, pz, fx, fy, fz = out[row, 0], out[row, 1], out[row, 2], out[row, 3], out[row, 4], out[row, 5]
            push(shape, bodies, i, kind_p, hinged, px, py, pz, fx, fy, fz)
            push(shape, bodies, j, kind_q, hinged, px, py, pz, -fx, -fy, -fz)
        if pairs.used[pair] & ~used:
            lost += _forget(pairs, pair, pairs.used[pair] & ~used)
        pairs.used[pair] = used
        depth = diameter - distance
        resolve(step, depth, diameter, closing)
        bodies.deepest[i] = max(bodies.deepest[i], depth)
        bodies.deepest[j] = max(bodies.deepest[j], depth)
    return lost


@inlined
def _find_touching(shape: Shape, bodies: Bodies, pairs: Pairs) -> int:
    """Write which of the near pairs touch, or did so in the last step, into `touching` and `nearest`; their number.

    Without a branch, which would be mispredicted.
    """
    segments, kind, inverses, diameter = bodies.segments, pairs.kind, shape.inverses, 2 * shape.radius
    reach = diameter * diameter
    count = 0
    for k in range(pairs.counts[1]):
        pair = pairs.near[k]
        p, q = pairs.first[pair], pairs.second[pair]
        ux, uy, uz = segments[p, 3], segments[p, 4], segments[p, 5]
        vx, vy, vz = segments[q, 3], segments[q, 4], segments[q, 5]
        wx, wy, wz = segments[p, 0] - segments[q, 0], segments[p, 1] - segments[q, 1], segments[p, 2] - segments[q, 2]
        a, b, c = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
        d, e = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
        s, t = nearest(a, b, c, d, e, inverses[kind[p]], inverses[kind[q]])
        x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
        pairs.touching[count], pairs.nearest[count, 0], pairs.nearest[count, 1] = pair, s, t
        count += (x * x + y * y + z * z < reach) | (pairs.used[pair] != 0)
    return count


@inlined
def motion_at(
    bodies: Bodies, i: int, j: int, row_i: int, row_j: int,
    x: float, y: float, z: float, nx: float, ny: float, nz: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Velocity of the first body against the second at a point [m/s]; sum of their turns about a normal [rad/s].

    Args:
        bodies: the smarticles.
        i: the first smarticle.
        j: the second one.
        row_i: of the first body in `Bodies.motion`.
        row_j: of the second one.
        x: the point [m].
        y: the same.
        z: the same.
        nx: the normal [1].
        ny: the same.
        nz: the same.
    """
    position, motion = bodies.position, bodies.motion
    rx, ry, rz = x - position[i, 0], y - position[i, 1], z - position[i, 2]
    gx, gy, gz = x - position[j, 0], y - position[j, 1], z - position[j, 2]
    ax, ay, az = motion[row_i, 3], motion[row_i, 4], motion[row_i, 5]
    bx, by, bz = motion[row_j, 3], motion[row_j, 4], motion[row_j, 5]
    return (
        motion[row_i, 0] + ay * rz - az * ry - (motion[row_j, 0] + by * gz - bz * gy),
        motion[row_i, 1] + az * rx - ax * rz - (motion[row_j, 1] + bz * gx - bx * gz),
        motion[row_i, 2] + ax * ry - ay * rx - (motion[row_j, 2] + bx * gy - by * gx),
        (ax + bx) * nx + (ay + by) * ny + (az + bz) * nz,
    )


@inlined
def _forget(pairs: Pairs, pair: int, points: int) -> float:
    """Contacts at some points of a pair have ended.

    Returns:
        What their tangential springs held [J].
    """
    energy = 0.0
    for slot in range(POINTS):
        if points & (1 << slot):
            energy += pairs.slip[pair, slot, 3]
            for d in range(4):
                pairs.slip[pair, slot, d] = 0.0
    pairs.used[pair] &= ~points & 7
    return energy


assert BARE >= 5  # two ends of a stretch, three pairs of hinges
