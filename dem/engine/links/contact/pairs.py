"""Forces of smarticles on each other."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Array, Bodies, Law, Pairs
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.barrier import Step, resolve, stretch
from dem.engine.links.contact.law import resist, share_of_step
from dem.engine.links.contact.meeting import (
    BARE,
    CARRIED,
    DISTANCE,
    FORCE,
    HARDENING,
    LOAD,
    NORMAL,
    PLACE,
    POINTS,
    SHARE,
    meet_at,
    meets_elsewhere,
)
from dem.engine.links.shape import Shape
from dem.engine.links.vectors import (
    Lines,
    Vector,
    add,
    along,
    between,
    cross,
    dot,
    lines,
    moving,
    nearest,
    put_more,
    scale,
    sub,
    vector,
)

# Columns of the ledger: rows of two bodies in `Bodies.motion` and their smarticles (-1: a boundary), point of contact
# [m], force on the first one [N], half of its power with the velocities before [W], what its spring took up [J].
ROWS, OWNERS, POINT, PUSH, POWER, GAIN = 0, 2, 4, 7, 10, 11

assert BARE >= 5  # two ends of a stretch, three pairs of hinges


@inlined
def push(bodies: Bodies, i: int, kind: int, hinged: Any, place: Vector, force: Vector) -> None:
    """Let a force act on a point of a smarticle.

    Args:
        bodies: the smarticles; `load`, or `shares` while articulated, is added to.
        kind: the link.
        place: the point [m].
        force: on it [N].
    """
    row = i if hinged is None else 3 * i + kind
    load = bodies.load if hinged is None else bodies.shares
    put_more(load[row], 0, force)
    put_more(load[row], 3, cross(sub(place, vector(bodies.position[i], 0)), force))


@inlined
def enter(
    ledger: Array, rows: tuple[int, int], owners: tuple[int, int], place: Vector, force: Vector, power: float,
    gain: float,
) -> None:  # fmt: skip
    """Enter a force beyond a normal spring's, whose dissipation follows once velocities after it are known.

    Args:
        ledger: (n, LEDGER); row 0 begins with the number of rows in use.
        rows: of the two bodies in `Bodies.motion`; -1 for a boundary.
        owners: the two smarticles; -1 for a boundary.
        place: point of contact [m].
        force: on the first one [N].
        power: half of its power with the velocities before [W].
        gain: what its spring took up [J].
    """
    n = int(ledger[0, 0]) + 1
    ledger[0, 0] = n
    row = ledger[n]
    row[0], row[1], row[2], row[3] = rows[0], rows[1], owners[0], owners[1]
    row[4], row[5], row[6] = place
    row[7], row[8], row[9] = force
    row[10], row[11] = power, gain


@inlined
def velocity_at(bodies: Bodies, i: int, row: int, place: Vector) -> Vector:
    """Return the velocity of a point of a rigid body of smarticle i, whose `motion` has a row [m/s]."""
    motion = bodies.motion[row]
    return moving(vector(motion, 0), vector(motion, 3), sub(place, vector(bodies.position[i], 0)))


@inlined
def motion_at(
    bodies: Bodies, owners: tuple[int, int], rows: tuple[int, int], place: Vector, normal: Vector
) -> tuple[Vector, float]:
    """Return the velocity of one body against another at a point [m/s], and the sum of their turns [rad/s].

    Args:
        owners: the two smarticles.
        rows: of the two bodies in `Bodies.motion`.
        place: the point [m].
        normal: that turns are about [1].
    """
    one, other = bodies.motion[rows[0]], bodies.motion[rows[1]]
    velocity = sub(velocity_at(bodies, owners[0], rows[0], place), velocity_at(bodies, owners[1], rows[1], place))
    return velocity, dot(add(vector(one, 3), vector(other, 3)), normal)


@inlined
def _push_both(
    bodies: Bodies, owners: tuple[int, int], kinds: tuple[int, int], hinged: Any, place: Vector, force: Vector
) -> None:
    push(bodies, owners[0], kinds[0], hinged, place, force)
    push(bodies, owners[1], kinds[1], hinged, place, scale(-1.0, force))


@inlined
def _rub(
    law: Law, bodies: Bodies, owners: tuple[int, int], kinds: tuple[int, int], hinged: Any, ledger: Any, step: Step,
    place: Vector, normal: Vector, depth: float, load: float, carried: float, share: float, hardening: float,
    slip: Array,
) -> float:  # fmt: skip
    """Let two links push each other apart at a point; the rate at which they close [m/s].

    Args:
        bodies: the smarticles; `load` or `shares` is written.
        owners: the two smarticles.
        kinds: their links.
        place: the point [m].
        normal: from the second link to the first [1].
        depth: overlap [m].
        load: of the normal spring [N].
        carried: the part of it that friction and dashpot go with [N].
        share: of a whole contact [1].
        hardening: of the dashpot [1].
        slip: (4,) of the tangential spring; brought up to date.
    """
    rows = owners
    if hinged is not None:
        rows = 3 * owners[0] + kinds[0], 3 * owners[1] + kinds[1]
    velocity, turning = motion_at(bodies, owners, rows, place, normal)
    closing = -dot(velocity, normal)
    acting = share_of_step(depth, closing, step.past)
    load, carried = load * acting, carried * acting
    force, stored = (0.0, 0.0, 0.0), slip[3]
    if carried > 0.0:
        twist = 0.5 * step.past * turning
        force = resist(law, carried, share, hardening, normal, velocity, twist, step.past, slip)
        if ledger is not None:
            enter(ledger, rows, owners, place, force, 0.5 * dot(force, velocity), slip[3] - stored)
    _push_both(bodies, owners, kinds, hinged, place, along(force, load, normal))
    return closing


@part
def push_apart(
    shape: Shape, law: Law, bodies: Bodies, pairs: Pairs, hinged: Any, ledger: Any, step: Step, out: Array
) -> float:
    """Add the forces of all pairs that touch.

    Args:
        bodies: the smarticles; `load` or `shares`, and `deepest` are written.
        pairs: pairs that may touch; `slip` and `used` are brought up to date.
        out: (ROWS, COLUMNS) scratch.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    segments, diameter, inverses = bodies.segments, 2 * shape.radius, shape.inverses
    reach = diameter * diameter
    lost = 0.0
    for k in range(_find_touching(shape, bodies, pairs)):
        pair, s, t = pairs.touching[k], pairs.nearest[k, 0], pairs.nearest[k, 1]
        p, q = pairs.first[pair], pairs.second[pair]
        i, j, kind_p, kind_q = pairs.owner[p], pairs.owner[q], pairs.kind[p], pairs.kind[q]
        both = lines(segments[p], segments[q], inverses[kind_p], inverses[kind_q])
        gap = between(both, s, t)
        squared = dot(gap, gap)
        if squared >= reach:
            lost += _forget(pairs, pair, 7)
            continue
        owners, kinds, distance = (i, j), (kind_p, kind_q), math.sqrt(squared)
        depth, used, closing = diameter - distance, 1, 0.0
        others = meets_elsewhere(both, reach, kind_p != 1, kind_q != 1)
        if (others == 0) & (distance < diameter):
            # Nine of ten: one point, and nothing that a branch would have to be predicted for.
            place = scale(0.5, along(add(along(both.p, s, both.u), both.q), t, both.v))
            u, slope, hardening = stretch(depth, diameter)
            load = law.stiffness * u * slope
            closing = _rub(
                law, bodies, owners, kinds, hinged, ledger, step, place, scale(1 / distance, gap), depth, load, load,
                1.0, hardening, pairs.slip[pair, 0],
            )  # fmt: skip
        else:
            bare = meet_at(both, s, t, gap, distance, diameter, law.stiffness, kind_p != 1, kind_q != 1, out)
            used = 0
            for slot in range(POINTS):
                row = out[slot]
                if row[SHARE] <= 0.0:
                    continue
                used |= 1 << slot
                load, carried = row[LOAD], row[CARRIED]
                share = row[SHARE] if carried == load else row[SHARE] * carried / load
                if carried <= 0.0:
                    lost += _forget(pairs, pair, 1 << slot)
                rate = _rub(
                    law, bodies, owners, kinds, hinged, ledger, step, vector(row, PLACE), vector(row, NORMAL),
                    diameter - row[DISTANCE], load, carried, share, row[HARDENING], pairs.slip[pair, slot],
                )  # fmt: skip
                closing = max(closing, rate)
            for slot in range(POINTS, POINTS + bare):
                _push_both(bodies, owners, kinds, hinged, vector(out[slot], PLACE), vector(out[slot], FORCE))
        if pairs.used[pair] & ~used:
            lost += _forget(pairs, pair, pairs.used[pair] & ~used)
        pairs.used[pair] = used
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
        both: Lines = lines(segments[p], segments[q], inverses[kind[p]], inverses[kind[q]])
        s, t = nearest(both)
        gap = between(both, s, t)
        pairs.touching[count], pairs.nearest[count, 0], pairs.nearest[count, 1] = pair, s, t
        count += (dot(gap, gap) < reach) | (pairs.used[pair] != 0)
    return count


@inlined
def _forget(pairs: Pairs, pair: int, points: int) -> float:
    """End the contacts at some points of a pair, given as bits.

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
