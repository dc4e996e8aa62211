"""Forces at the points at which links touch at one instant, for who records them; nothing of the simulation changes.

They are those that the next step begins with, but for the stretch that tangential springs gain in that step: the same
geometry and the same law, over no time and on copies of the springs. What acts without friction along a link, or takes
back what a hinge has twice, goes with the points of its pair.
"""

from __future__ import annotations

from typing import Any

from dem.engine.links.arrays import Array, Bodies, Ground, Kept, Law, Pairs
from dem.engine.links.compiler import inlined, kernel
from dem.engine.links.contact.barrier import stretch
from dem.engine.links.contact.boundaries import contacts_with_boundaries, place_and_motion
from dem.engine.links.contact.law import resist
from dem.engine.links.contact.meeting import HARDENING, POINTS, meet
from dem.engine.links.contact.pairs import motion_at
from dem.engine.links.shape import Shape

FIRST, SECOND, LOAD, POINT, FRICTION, FORCE = 0, 1, 2, 3, 6, 9  # columns of a row
WIDTH = 12


@inlined
def _write(
    rows: Array, count: int, first: float, second: float, load: float, carried: float,
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
                fx, fy, fz = resist(law, carried, share, out[slot, HARDENING], nx, ny, nz, mx, my, mz, 0.0, 0.0, slip)
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


@kernel
def forces_of_boundaries(
    shape: Shape, law: Law, bodies: Bodies, kept: Kept, ground: Ground, channel: Any, hooks: Any, rims: Any,
    hinged: Any, out: Array, contacts: Array, slip: Array, rows: Array,
) -> int:  # fmt: skip
    """Forces of boundaries on smarticles; what is written and returned as in `forces_of_pairs`.

    Args:
        shape: what all smarticles have in common.
        law: of contacts with boundaries.
        bodies: the smarticles, posed.
        kept: what contacts remember.
        ground: the boundaries.
        channel: (1,) half the distance of the walls of a channel [m]; None for a container.
        hooks: None where there are none.
        rims: None where the wall has none.
        hinged: None while welded.
        out: scratch of `meet`.
        contacts: scratch.
        slip: (4,) scratch.
        rows: (…, WIDTH) written; the second one as `dem.body.forces.at_boundaries` has it.
    """
    segments, links, count = bodies.segments, shape.kinds.shape[0], 0
    for p in range(segments.shape[0]):
        i, kind = p // (links * shape.offsets.shape[0]), shape.kinds[p % links]
        row = i if hinged is None else 3 * i + kind
        for k in range(contacts_with_boundaries(shape, segments, ground, channel, hooks, rims, p, contacts, out)):
            contact = contacts[k]
            weight, nx, ny, nz = contact[3], contact[8], contact[9], contact[10]
            x, y, z, vx, vy, vz, speed, _ = place_and_motion(shape, bodies, ground, i, row, contact)
            for d in range(4):
                slip[d] = kept.slip[p, int(contact[0]), d]
            u, slope, hardening = stretch(contact[2], contact[11])
            load = law.stiffness * u * slope * weight
            fx, fy, fz = resist(law, load, weight, hardening, nx, ny, nz, vx, vy, vz - speed, 0.0, 0.0, slip)
            count = _write(rows, count, 3 * i + kind, -1 - contact[1], load, load, x, y, z, nx, ny, nz, fx, fy, fz)
    return count
