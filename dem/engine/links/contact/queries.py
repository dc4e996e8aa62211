"""Query the contacts at one instant: touching bodies, extremes, energies, and forces for output.

A query changes nothing in the simulation. The wide list must be valid at this instant. Forces are computed as
at the beginning of the next step, but with a time step of 0 and with copies of the tangential springs, so that no
spring is stretched. Bare forces (see `meeting`) are recorded as points of the contact of their pair.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from dem.engine.links.arrays import Array, Bodies, Boundaries, Ground, Indices, Kept, Law, Pairs, Parts, Segments
from dem.engine.links.compiler import inlined, kernel, part
from dem.engine.links.contact import boundaries as rows_of
from dem.engine.links.contact.barrier import stretch
from dem.engine.links.contact.boundaries import contacts_with_boundaries, place_and_motion
from dem.engine.links.contact.law import resist
from dem.engine.links.contact.meeting import (
    CARRIED,
    ENERGY,
    FORCE,
    HARDENING,
    LOAD,
    NORMAL,
    PLACE,
    POINTS,
    SHARE,
    in_overlap,
    meet,
)  # fmt: skip
from dem.engine.links.contact.pairs import motion_at
from dem.engine.links.shapes import RADIUS
from dem.engine.links.vectors import Vector, along, dot, put, scale, sub, vector

FASTEST, LOWEST, HIGHEST, WIDEST, DEEPEST, BETWEEN, ELASTIC = range(7)  # places in what `find_extremes` writes

# Columns of a recorded point: both bodies as `dem.body.forces.at_links` and `at_boundaries` number them, normal force
# [N], point [m], tangential force and the whole one on the first body [N].
FIRST, SECOND, PRESSED, POINT, FRICTION, WHOLE, WIDTH = 0, 1, 2, 3, 6, 9, 12

# Columns of `boundaries`, which compiled code takes as constants from here.
SLOT, PART, DEPTH, FACTOR, ROOM, AT, PARTLY = (
    rows_of.SLOT, rows_of.PART, rows_of.DEPTH, rows_of.FACTOR, rows_of.ROOM, rows_of.NORMAL, rows_of.SHARE,
)  # fmt: skip


class Found(NamedTuple):
    """Results of a query of all contacts."""

    met: Indices  #: (P, 2) numbers of the two bodies of each pair of segments that touch
    touches: Any  #: (N,) number of points of contact of each body
    held: Any  #: (N, 7) whether each body touches each boundary, in the order of `Ground.force`
    depth: Array  #: (N,) largest overlap of each body, over that at which axes, or an axis and a surface, meet [1]
    out: Array  #: Scratch of `meet`
    rows: Array  #: Scratch of `contacts_of_segment`


@part
def _query_pairs(segments: Segments, pairs: Pairs, stiffness: float, found: Found) -> tuple[int, float]:
    """Find all contacts between bodies, among the pairs of segments in the wide list.

    Args:
        stiffness: kn [N/m].
        found: results; `met`, `touches` and `depth` are updated.

    Returns:
        Number of rows of `found.met` that were written, and energy of all normal springs between bodies [J].
    """
    line, count, energy, out = segments.line, 0, 0.0, found.out
    for k in range(pairs.counts[0]):
        p, q = pairs.first[k], pairs.second[k]
        if meet(line[p], line[q], stiffness, segments.shared[p], segments.shared[q], out) == 0:
            continue
        energy += out[ENERGY, 0]
        i, j, points = segments.body[p], segments.body[q], 0
        for slot in range(POINTS):
            if out[slot, SHARE] > 0.0 and out[slot, CARRIED] > 0.0:
                points += 1
        if points == 0:
            continue
        found.met[count, 0], found.met[count, 1] = i, j
        count += 1
        for body in (i, j):
            found.touches[body] += points
            found.depth[body] = max(found.depth[body], out[ENERGY, 1] / (line[p, RADIUS] + line[q, RADIUS]))
    return count, energy


@part
def _query_boundaries(
    segments: Segments, ground: Ground, channel: Any, hooks: Any, rims: Any, stiffness: float, found: Found
) -> float:
    """Find all contacts of bodies with boundaries; return the energy of their normal springs [J].

    Args:
        channel: (1,) half the distance of a channel's walls [m]; None in a container.
        hooks: the hooks; None: no hooks.
        rims: edges of the wall that links can reach; None: no such edges.
        stiffness: kn of contacts with boundaries [N/m].
        found: results; `touches`, `held` and `depth` are updated.
    """
    squares = 0.0
    for p in range(segments.line.shape[0]):
        i = segments.body[p]
        count = contacts_with_boundaries(segments, ground, channel, hooks, rims, p, found.rows, found.out)
        for k in range(count):
            contact = found.rows[k]
            found.touches[i] += 1
            found.held[i, int(contact[PART])] = True
            found.depth[i] = max(found.depth[i], contact[DEPTH] / contact[ROOM])
            u, _, _ = stretch(contact[DEPTH], contact[ROOM])
            squares += u * u * contact[FACTOR]
    return 0.5 * stiffness * squares


@kernel
def query_all(
    segments: Segments, pairs: Pairs, kept: Kept, boundaries: Boundaries, stiffness: float, wall_stiffness: float,
    found: Found,
) -> tuple[int, float]:  # fmt: skip
    """Find all contacts, of bodies with each other and with boundaries.

    Args:
        pairs: lists of near segments; contacts between bodies are found in the wide list.
        kept: memory of the contacts with boundaries; read for the energy of tangential springs.
        stiffness: kn of contacts between bodies [N/m].
        wall_stiffness: kn of contacts with boundaries [N/m].
        found: results; `touches`, `held` and `depth` must be zero before the call.

    Returns:
        Number of rows of `found.met` that were written, and energy of all springs [J].
    """
    count, energy = _query_pairs(segments, pairs, stiffness, found)
    energy += _query_boundaries(
        segments, boundaries.ground, boundaries.channel, boundaries.hooks, boundaries.rims, wall_stiffness, found
    )
    return count, energy + _sheared(pairs, kept)


@kernel
def find_extremes(
    bodies: Bodies, segments: Segments, depths: Array, velocities: Array, energy: float, extremes: Array
) -> None:
    """Compute extremes over all bodies.

    A run is checked against limits of speed, position, overlap and energy. If the extremes are within these limits, a
    full check of all bodies is not needed.

    Args:
        depths: (N,) see `Found.depth`.
        velocities: (M, 3) velocities of the centres of all links, or bars [m/s].
        energy: energy of all springs of contacts [J].
        extremes: (7,) written: largest speed of `velocities` [m/s], NaN if any speed or overlap is not finite; heights
            of the lowest and of the highest end of an axis [m]; largest distance of an end from the container's axis
            [m]; largest overlap now, and since the last query, over the overlap at which axes meet [1]; `energy`.
    """
    line = segments.line
    fastest, total = 0.0, 0.0
    for i in range(velocities.shape[0]):
        velocity = vector(velocities[i], 0)
        square = dot(velocity, velocity)
        total += square
        fastest = max(fastest, square)
    lowest, highest, widest = math.inf, -math.inf, 0.0
    for p in range(line.shape[0]):
        for end in range(2):
            x, y, z = along(vector(line[p], 0), float(end), vector(line[p], 3))
            lowest, highest, widest = min(lowest, z), max(highest, z), max(widest, x * x + y * y)
    deepest, between = 0.0, 0.0
    for i in range(depths.shape[0]):
        deepest = max(deepest, depths[i])
        # One that is no number must not be lost in the comparison.
        between = bodies.deepest[i] if not bodies.deepest[i] <= between else between
        total += bodies.deepest[i]
    extremes[FASTEST] = fastest**0.5 if math.isfinite(total) else math.nan
    extremes[LOWEST], extremes[HIGHEST], extremes[WIDEST] = lowest, highest, widest**0.5
    extremes[DEEPEST], extremes[BETWEEN], extremes[ELASTIC] = deepest, between, energy


@inlined
def _sheared(pairs: Pairs, kept: Kept) -> float:
    """Return the energy of all tangential springs [J]."""
    energy = 0.0
    for k in range(pairs.counts[0]):
        if pairs.used[k]:
            for slot in range(pairs.slip.shape[1]):
                energy += pairs.slip[k, slot, 3]
    for p in range(kept.slip.shape[0]):
        if kept.contacts[p]:
            for slot in range(kept.slip.shape[1]):
                energy += kept.slip[p, slot, 3]
    return energy


# -- forces for output -------------------------------------------------------------------------------------------


@inlined
def _write(
    rows: Array, count: int, first: float, second: float, load: float, carried: float, place: Vector, normal: Vector,
    force: Vector,
) -> int:  # fmt: skip
    """Write a point of contact into row `count`, if `rows` has this row; return `count` + 1.

    Args:
        rows: (…, WIDTH) written; for the columns see `FIRST`.
        count: number of the row.
        first: code of the first link in contact, see `dem.body.forces.at_links`.
        second: code of the second link or of the boundary.
        load: force of the normal spring [N].
        carried: part of `load` that sets the friction limit [N].
        place: point of contact [m].
        normal: normal of the contact, towards the first link [1].
        force: force on the first link without that of the normal spring [N].
    """
    if count < rows.shape[0]:
        row, pressing = rows[count], dot(force, normal)
        row[FIRST], row[SECOND], row[PRESSED] = first, second, max(0.0, carried + pressing)
        put(row, POINT, place)
        put(row, FRICTION, sub(force, scale(pressing, normal)))
        put(row, WHOLE, along(force, load, normal))
    return count + 1


@inlined
def _copy(slip: Array, kept: Array) -> None:
    for d in range(4):
        slip[d] = kept[d]


@kernel
def forces_of_pairs(
    law: Law, bodies: Bodies, parts: Parts, segments: Segments, pairs: Pairs, links: Indices, dt: float, out: Array,
    slip: Array, rows: Array,
) -> int:  # fmt: skip
    """Write the forces of bodies on each other, one row per point of contact and per bare force.

    Args:
        pairs: pairs that may touch, with their tangential springs.
        links: (Q,) code of each segment's link, see `dem.body.forces.at_links`.
        dt: length of the next step [s], in which tangential springs are stretched before their forces act.
        out: scratch of `meet`.
        slip: (4,) scratch.
        rows: (…, WIDTH) written; for the columns see `FIRST`.

    Returns:
        Number of rows that are needed; rows that do not fit into `rows` are not written.
    """
    line, count = segments.line, 0
    for k in range(pairs.counts[0]):
        p, q = pairs.first[k], pairs.second[k]
        met = meet(line[p], line[q], law.stiffness, segments.shared[p], segments.shared[q], out)
        if met == 0:
            continue
        i, j, moving = segments.body[p], segments.body[q], (segments.part[p], segments.part[q])
        damping, first, second = law.damping[bodies.shape[i], bodies.shape[j]], links[p], links[q]
        for slot in range(POINTS):
            row = out[slot]
            share, load, carried = row[SHARE], row[LOAD], row[CARRIED]
            if share <= 0.0:
                continue
            normal, force = vector(row, NORMAL), (0.0, 0.0, 0.0)
            place = in_overlap(vector(row, PLACE), normal, (line[p, RADIUS], line[q, RADIUS]))
            if carried > 0.0:
                velocity, turning = motion_at(parts, moving, place, normal)
                _copy(slip, pairs.slip[k, slot])
                share = share if carried == load else share * carried / load
                twist = 0.5 * dt * turning
                force = resist(law, damping, carried, share, row[HARDENING], normal, velocity, twist, dt, slip)
            count = _write(rows, count, first, second, load, carried, place, normal, force)
        for bare in range(POINTS, POINTS + met - 1):
            # A spring's, without a normal of its own: nothing of it is friction.
            place, force = vector(out[bare], PLACE), vector(out[bare], FORCE)
            count = _write(rows, count, first, second, 0.0, 0.0, place, (0.0, 0.0, 0.0), force)
            if count <= rows.shape[0]:
                rows[count - 1, FRICTION:WHOLE] = 0.0
    return count


@kernel
def forces_of_boundaries(
    law: Law, bodies: Bodies, parts: Parts, segments: Segments, kept: Kept, known: Boundaries, links: Indices,
    dt: float, out: Array, contacts: Array, slip: Array, rows: Array,
) -> int:  # fmt: skip
    """Write the forces of boundaries on bodies, one row per contact.

    Args:
        kept: memory of the contacts, with their tangential springs.
        known: the boundaries.
        links: (Q,) code of each segment's link, see `dem.body.forces.at_links`.
        dt: length of the next step [s], in which tangential springs are stretched before their forces act.
        out: scratch of `meet`.
        contacts: scratch of `contacts_of_segment`.
        slip: (4,) scratch.
        rows: (…, WIDTH) written; for the columns see `FIRST`.

    Returns:
        Number of rows that are needed; rows that do not fit into `rows` are not written.
    """
    count = 0
    for p in range(segments.line.shape[0]):
        radius, damping = segments.line[p, RADIUS], law.damping[bodies.shape[segments.body[p]], 0]
        number = contacts_with_boundaries(
            segments, known.ground, known.channel, known.hooks, known.rims, p, contacts, out
        )
        for k in range(number):
            contact = contacts[k]
            share, normal = contact[PARTLY], vector(contact, AT)
            place, velocity, speed, turning = place_and_motion(radius, parts, known.ground, segments.part[p], contact)
            relative = velocity[0], velocity[1], velocity[2] - speed
            _copy(slip, kept.slip[p, int(contact[SLOT])])
            u, slope, hardening = stretch(contact[DEPTH], contact[ROOM])
            load = law.stiffness * u * slope * share
            twist = 0.5 * dt * turning
            force = resist(law, damping, load, share, hardening, normal, relative, twist, dt, slip)
            count = _write(rows, count, links[p], -1 - contact[PART], load, load, place, normal, force)
    return count
