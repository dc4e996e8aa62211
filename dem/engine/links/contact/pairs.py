"""Kernels of contact forces between bodies."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import (
    AXIS,
    MOMENT,
    ORIGIN,
    SPIN,
    STRAIN_RATE,
    VELOCITY,
    Array,
    Bodies,
    Law,
    Pairs,
    Parts,
    Segments,
)
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.barrier import Step, resolve, stretch
from dem.engine.links.contact.law import resist, share_of_step
from dem.engine.links.contact.meeting import (
    CARRIED,
    DISTANCE,
    FORCE,
    HARDENING,
    LOAD,
    NORMAL,
    PLACE,
    POINTS,
    SHARE,
    in_overlap,
    meet_at,
    meets_elsewhere,
)
from dem.engine.links.shapes import RADIUS
from dem.engine.links.vectors import (
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

# Columns of the ledger: both parts (-1: a boundary), point of contact [m], force on the first part [N], half of its
# power with the velocities before the kick [W], energy that the tangential spring took up [J].
ROWS, POINT, PUSH, POWER, GAIN = 0, 2, 5, 8, 9


@inlined
def _extended(stretch: Any, row: int, velocity: Vector, arm: Vector) -> Vector:
    """Return `velocity` plus the velocity that the stretching of part `row` causes at a point [m/s].

    Args:
        stretch: `Parts.stretch`; None if no body is flexible.
        row: number of the part.
        velocity: velocity of the point if the part did not stretch [m/s].
        arm: vector from the part's reference point to the point [m].
    """
    if stretch is None:
        return velocity
    axis = vector(stretch[row], AXIS)
    return along(velocity, stretch[row, STRAIN_RATE] * dot(arm, axis), axis)


@inlined
def _extend(stretch: Any, row: int, arm: Vector, force: Vector) -> None:
    """Add the stretching moment of a force on a part to `stretch`.

    It is axial force times axial component of `arm`, the vector from the part's reference point to the force [m].
    """
    if stretch is None:
        return
    axis = vector(stretch[row], AXIS)
    stretch[row, MOMENT] += dot(arm, axis) * dot(force, axis)


@inlined
def push(parts: Parts, row: int, place: Vector, force: Vector) -> None:
    """Add a force at a point of a part to the part's load.

    Args:
        parts: `load` is written.
        row: number of the part.
        place: the point [m].
        force: force on the part [N].
    """
    load = parts.load[row]
    put_more(load, 0, force)
    arm = sub(place, vector(parts.motion[row], ORIGIN))
    put_more(load, 3, cross(arm, force))
    _extend(parts.stretch, row, arm, force)


@inlined
def enter(ledger: Array, rows: tuple[int, int], place: Vector, force: Vector, power: float, gain: float) -> None:
    """Append a contact force, without the force of the normal spring, to the ledger.

    Args:
        ledger: (n, LEDGER); row 0 begins with the number of rows in use.
        rows: numbers of the two parts in contact; -1 for a boundary.
        place: point of contact [m].
        force: force on the first part [N].
        power: half of the power of `force` at the velocities before the kick [W]. The other half, at the velocities
            after the kick, is added by `dem.engine.links.stepping.settle`.
        gain: energy that the tangential spring took up [J].
    """
    n = int(ledger[0, 0]) + 1
    ledger[0, 0] = n
    row = ledger[n]
    row[0], row[1] = rows
    row[2], row[3], row[4] = place
    row[5], row[6], row[7] = force
    row[8], row[9] = power, gain


@inlined
def velocity_at(parts: Parts, row: int, place: Vector) -> Vector:
    """Return the velocity of a point of a part [m/s]."""
    motion = parts.motion[row]
    arm = sub(place, vector(motion, ORIGIN))
    return _extended(parts.stretch, row, moving(vector(motion, VELOCITY), vector(motion, SPIN), arm), arm)


@inlined
def motion_at(parts: Parts, rows: tuple[int, int], place: Vector, normal: Vector) -> tuple[Vector, float]:
    """Return the relative velocity of two parts at a point, and the sum of their spins about a normal.

    Args:
        rows: numbers of both parts.
        place: the point [m].
        normal: unit vector [1].

    Returns:
        Velocity of the first part relative to the second [m/s]; sum of both angular velocities about `normal` [rad/s].
    """
    velocity = sub(velocity_at(parts, rows[0], place), velocity_at(parts, rows[1], place))
    one, other = parts.motion[rows[0]], parts.motion[rows[1]]
    return velocity, dot(add(vector(one, SPIN), vector(other, SPIN)), normal)


@inlined
def _push_both(parts: Parts, rows: tuple[int, int], place: Vector, force: Vector) -> None:
    push(parts, rows[0], place, force)
    push(parts, rows[1], place, scale(-1.0, force))


@inlined
def _rub(
    law: Law, damping: float, parts: Parts, rows: tuple[int, int], ledger: Any, step: Step,
    place: Vector, normal: Vector, depth: float, load: float, carried: float, share: float, hardening: float,
    slip: Array,
) -> float:  # fmt: skip
    """Add the forces of two segments on each other at a point of contact.

    Args:
        damping: cn of a contact of these bodies [N s/m].
        parts: forces are added to `load`.
        rows: numbers of both parts.
        ledger: list of forces and their power, see `enter`; None: it is not needed.
        step: time since the last forces; its number of sub-steps is increased if needed.
        place: the point [m].
        normal: unit vector from the second segment to the first [1].
        depth: overlap [m].
        load: force of the normal spring [N].
        carried: part of `load` that sets the friction limit [N]; 0: no friction and no dashpot here.
        share: fraction of a full contact's springs and dashpots that acts here [1].
        hardening: factor on the dashpot [1].
        slip: (4,) stretch [m] and energy [J] of the tangential spring; updated.

    Returns:
        Rate at which the overlap grows [m/s].
    """
    velocity, turning = motion_at(parts, rows, place, normal)
    closing = -dot(velocity, normal)
    acting = share_of_step(depth, closing, step.past)
    load, carried = load * acting, carried * acting
    force, stored = (0.0, 0.0, 0.0), slip[3]
    if carried > 0.0:
        twist = 0.5 * step.past * turning
        force = resist(law, damping, carried, share, hardening, normal, velocity, twist, step.past, slip)
        if ledger is not None:
            enter(ledger, rows, place, force, 0.5 * dot(force, velocity), slip[3] - stored)
    _push_both(parts, rows, place, along(force, load, normal))
    return closing


@part
def push_apart(
    law: Law, bodies: Bodies, parts: Parts, segments: Segments, pairs: Pairs, ledger: Any, step: Step, out: Array
) -> float:
    """Add the forces of all pairs that touch.

    Args:
        bodies: `deepest` is increased where an overlap is larger.
        parts: forces are added to `load`.
        pairs: pairs that may touch; `slip` and `used` are updated.
        ledger: list of forces and their power, see `enter`; None: it is not needed.
        step: time since the last forces; its number of sub-steps is increased if needed.
        out: (ROWS, COLUMNS) scratch.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    line, lost = segments.line, 0.0
    for k in range(_find_touching(line, pairs)):
        pair, s, t = pairs.touching[k], pairs.nearest[k, 0], pairs.nearest[k, 1]
        p, q = pairs.first[pair], pairs.second[pair]
        radii = line[p, RADIUS], line[q, RADIUS]
        both, diameter = lines(line[p], line[q]), radii[0] + radii[1]
        gap = between(both, s, t)
        squared, reach = dot(gap, gap), diameter * diameter
        if squared >= reach:
            lost += _forget(pairs, pair, 7)
            continue
        i, j, rows, distance = (
            segments.body[p],
            segments.body[q],
            (segments.part[p], segments.part[q]),
            math.sqrt(squared),
        )
        depth, used, closing, damping = diameter - distance, 1, 0.0, law.damping[bodies.shape[i], bodies.shape[j]]
        shared_p, shared_q = segments.shared[p], segments.shared[q]
        others = meets_elsewhere(both, reach, shared_p, shared_q)
        if (others == 0) & (distance < diameter):
            # Nine of ten: one point, and nothing that a branch would have to be predicted for.
            halfway = scale(0.5, along(add(along(both.p, s, both.u), both.q), t, both.v))
            normal = scale(1 / distance, gap)
            u, slope, hardening = stretch(depth, diameter)
            load = law.stiffness * u * slope
            closing = _rub(
                law, damping, parts, rows, ledger, step, in_overlap(halfway, normal, radii), normal, depth, load, load,
                1.0, hardening, pairs.slip[pair, 0],
            )  # fmt: skip
        else:
            bare = meet_at(both, s, t, gap, distance, diameter, law.stiffness, shared_p, shared_q, out)
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
                normal = vector(row, NORMAL)
                place = in_overlap(vector(row, PLACE), normal, radii)
                rate = _rub(
                    law, damping, parts, rows, ledger, step, place, normal,
                    diameter - row[DISTANCE], load, carried, share, row[HARDENING], pairs.slip[pair, slot],
                )  # fmt: skip
                closing = max(closing, rate)
            for slot in range(POINTS, POINTS + bare):
                _push_both(parts, rows, vector(out[slot], PLACE), vector(out[slot], FORCE))
        if pairs.used[pair] & ~used:
            lost += _forget(pairs, pair, pairs.used[pair] & ~used)
        pairs.used[pair] = used
        resolve(step, depth, diameter, closing)
        filled = depth / diameter
        bodies.deepest[i] = max(bodies.deepest[i], filled)
        bodies.deepest[j] = max(bodies.deepest[j], filled)
    return lost


@inlined
def _find_touching(line: Array, pairs: Pairs) -> int:
    """Find the pairs of the tight list that touch, or touched in the last step; return their number.

    `touching` and `nearest` of `pairs` are written. The code has no branches, which would be mispredicted.
    """
    count = 0
    for k in range(pairs.counts[1]):
        pair = pairs.near[k]
        p, q = pairs.first[pair], pairs.second[pair]
        both, reach = lines(line[p], line[q]), line[p, RADIUS] + line[q, RADIUS]
        s, t = nearest(both)
        gap = between(both, s, t)
        pairs.touching[count], pairs.nearest[count, 0], pairs.nearest[count, 1] = pair, s, t
        count += (dot(gap, gap) < reach * reach) | (pairs.used[pair] != 0)
    return count


@inlined
def _forget(pairs: Pairs, pair: int, points: int) -> float:
    """End contacts of a pair: set their tangential springs to zero.

    Args:
        pair: index of the pair.
        points: points at which contacts end, as bits.

    Returns:
        Energy that the tangential springs had [J].
    """
    energy = 0.0
    for slot in range(POINTS):
        if points & (1 << slot):
            energy += pairs.slip[pair, slot, 3]
            pairs.slip[pair, slot] = 0.0
    pairs.used[pair] &= ~points & 7
    return energy
