"""Motion of flexible bodies: nodes with mass, segments that stretch and roll, bending and twist between segments.

Between two segments with tangents t, t', directors d1, d1' and d2 = t × d1, the discrete elastic rod of Bergou et al.,
ACM Trans. Graph. 27, 63 (2008) and 29, 116 (2010), has the angles

    κ1 = b·(d2 + d2')/2,   κ2 = -b·(d1 + d1')/2,   ν = 2 tan(m/2),   b = 2 t × t'/(1 + t·t'),

m the twist, and with ℓ the length at rest the energy (EI/2ℓ) |κ - κ̄|² + (GJ/2ℓ) ν² + (EA/2ℓ) (|e| - ℓ)². Forces and
torques are its derivatives: forces add up to nothing, and neither do moments of forces and torques about axes.
Directors turn with their segments without twist, and besides by the roll, which has an inertia of its own, so that
friction rolls a filament as it does a rigid bar.

Leapfrog, as for rigid bodies: velocities belong to the middles of sub-steps.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dem.engine.links.arrays import (
    AXIS,
    MOMENT,
    ORIGIN,
    SPIN,
    STRAIN_RATE,
    VELOCITY,
    Array,
    Bodies,
    Filaments,
    Parts,
    Segments,
)
from dem.engine.links.compiler import inlined, kernel, part
from dem.engine.links.contact.barrier import LONGEST, STRIDE, Step
from dem.engine.links.motion.planar import direction
from dem.engine.links.shapes import INVERSE
from dem.engine.links.vectors import Vector, add, along, cross, dot, put, put_more, scale, sub, vector

# Columns of a rod: length of a segment at rest ℓ [m]; EA/ℓ [N/m], EI/ℓ and GJ/ℓ [N m], times of Kelvin and Voigt of
# stretching and of bending [s]; a segment's inertia about its axis [kg m²]; drag of half a segment across and along
# [N s/m], of a segment's roll [N m s]; weight over mass and g [1]; squares of the greatest frequencies of bending
# and of twisting [1/s²].
LENGTH, STRETCHING, BENDING, TWISTING, STRETCHING_TIME, BENDING_TIME = range(6)
AXIAL, ACROSS, ALONG, ROLLING, WEIGHT, STIFFEST, STIFFEST_TWIST, ROD = range(6, 14)
# Columns of a gait: ψ [rad], its rate [rad/s], sense ±1, mean reversals per second, time to the next one [s], reversals
# that were drawn, seed and number of the filament; a factor on the preferred angles, its target, and the rate at which
# it gets there [1/s].
PSI, RATE, SENSE, REVERSALS, WAIT, DRAWN, SEED, NUMBER, FACTOR, TARGET, CHANGE, GAIT = range(12)
# Work [J]: what internal damping and the liquid's drag took, what activity and grips gave.
DAMPED, DRAGGED, ACTIVE, GRIPPED, SUMS = range(5)
GRIP = 8  # `Filaments.grip` is the grip's number times this, plus the directions that it holds
RESOLVED = 1.4  # ω dt, as in `dem.engine.links.stable_step`


# -- from nodes to segments --------------------------------------------------------------------------------------


@part
def move_segments(filaments: Any, parts: Parts, segments: Segments) -> None:
    """Write how the segments of all filaments move, from the velocities of their nodes.

    Args:
        parts: `motion` and `stretch` are written.
        segments: `bends.ends` is written.
    """
    if filaments is None:
        return
    for f in range(filaments.body.shape[0]):
        first, last, body = filaments.begin[f], filaments.begin[f + 1] - 1, filaments.body[f]
        to_part, to_segment = parts.begin[body] - first, segments.begin[body] - first
        for i in range(first, last):
            start, end = vector(filaments.velocity[i], 0), vector(filaments.velocity[i + 1], 0)
            axis, opening, extent = vector(filaments.tangent[i], 0), sub(end, start), filaments.extent[i]
            motion, stretch = parts.motion[to_part + i], parts.stretch[to_part + i]
            put(motion, VELOCITY, scale(0.5, add(start, end)))
            put(motion, SPIN, along(scale(filaments.spin[i], axis), 1 / extent, cross(axis, opening)))
            stretch[STRAIN_RATE] = dot(opening, axis) / extent
            put(segments.bends.ends[to_segment + i], 0, start)
            put(segments.bends.ends[to_segment + i], 3, end)


@part
def pose_filaments(filaments: Any, bodies: Bodies, parts: Parts, segments: Segments) -> None:
    """Bring everything up to date that follows from the nodes of filaments.

    Args:
        bodies: `position` and `velocity` are written.
        parts: `motion` and `stretch` are written.
        segments: `line` and `bends.ends` are written.
    """
    if filaments is None:
        return
    for f in range(filaments.body.shape[0]):
        first, last, body = filaments.begin[f], filaments.begin[f + 1] - 1, filaments.body[f]
        to_part, to_segment = parts.begin[body] - first, segments.begin[body] - first
        place, velocity, mass = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        for i in range(first, last + 1):
            start, own = vector(filaments.position[i], 0), filaments.mass[i]
            place, velocity = along(place, own, start), along(velocity, own, vector(filaments.velocity[i], 0))
            mass += own
            if i == last:
                break
            edge, line, stretch = (
                sub(vector(filaments.position[i + 1], 0), start),
                segments.line[to_segment + i],
                parts.stretch[to_part + i],
            )
            put(line, 0, start)
            put(line, 3, edge)
            line[INVERSE] = 1 / dot(edge, edge)
            put(parts.motion[to_part + i], ORIGIN, along(start, 0.5, edge))
            put(stretch, AXIS, vector(filaments.tangent[i], 0))
            stretch[MOMENT] = 0.0
        put(bodies.position[body], 0, scale(1 / mass, place))
        put(bodies.velocity[body], 0, scale(1 / mass, velocity))
    move_segments(filaments, parts, segments)


@kernel
def pose_filaments_from_python(filaments: Filaments, bodies: Bodies, parts: Parts, segments: Segments) -> None:
    """Call `pose_filaments` from Python."""
    pose_filaments(filaments, bodies, parts, segments)


# -- forces ------------------------------------------------------------------------------------------------------


@inlined
def _two(row: Array, angle: Vector) -> tuple[float, float]:
    """Return the preferred angles at a node [rad], from its wave and cosine, sine and factor of the filament's."""
    c, s, factor = angle
    return factor * row[0] * (c * row[1] - s * row[2]), factor * row[0] * (s * row[1] + c * row[2])


@inlined
def _bend(
    out: Array, i: int, moments: Vector, angles: tuple[float, float], one: tuple[Vector, Vector, float],
    two: tuple[Vector, Vector, float], binormal: Vector, middle: tuple[Vector, Vector, Vector],
) -> None:  # fmt: skip
    """Add forces and torques of moments between the segments i - 1 and i.

    Args:
        out: (n, 4) added to.
        moments: derivatives of the energy by κ1, κ2 and the twist [N m].
        angles: κ1 and κ2 [rad].
        one: tangent, director [1] and length [m] of the first segment.
        two: those of the second one.
        binormal: b [1].
        middle: sums of both tangents, of both first and of both second directors, over 1 + t·t' [1].
    """
    m1, m2, twist = moments
    (t, d, length), (t2, d2, length2), (tangent, first, second) = one, two, middle
    c = sub(scale(m1, second), scale(m2, first))
    rest = sub(scale(0.5 * twist, binormal), scale(m1 * angles[0] + m2 * angles[1], tangent))
    a = scale(1 / length, add(cross(t2, c), rest))
    b = scale(1 / length2, sub(rest, cross(t, c)))
    put_more(out[i - 1], 0, a)
    put_more(out[i], 0, sub(b, a))
    put_more(out[i + 1], 0, scale(-1.0, b))
    out[i - 1, 3] += 0.5 * dot(along(scale(m1, d), m2, cross(t, d)), binormal) + twist
    out[i, 3] += 0.5 * dot(along(scale(m1, d2), m2, cross(t2, d2)), binormal) - twist


@inlined
def _angles(
    one: tuple[Vector, Vector, float], two: tuple[Vector, Vector, float]
) -> tuple[Vector, Vector, tuple[Vector, Vector, Vector]]:
    """Return κ1, κ2, ν [rad], the binormal b and the middle frame of two segments; see `_bend`."""
    (t, d, _), (t2, d2, _) = one, two
    inverse = 1 / (1 + dot(t, t2))
    binormal = scale(2 * inverse, cross(t, t2))
    e, e2 = cross(t, d), cross(t2, d2)
    middle = scale(inverse, add(t, t2)), scale(inverse, add(d, d2)), scale(inverse, add(e, e2))
    k1, k2 = 0.5 * dot(add(e, e2), binormal), -0.5 * dot(add(d, d2), binormal)
    carried = along(d, -dot(d, t2), middle[0])
    twist = -2 * dot(carried, e2) / (1 + dot(carried, d2))
    return (k1, k2, twist), binormal, middle


@inlined
def _segment(filaments: Filaments, i: int) -> tuple[Vector, Vector, float]:
    """Return tangent, director [1] and length [m] of a segment."""
    return vector(filaments.tangent[i], 0), vector(filaments.director[i], 0), filaments.extent[i]


@part
def _push_node(filaments: Filaments, i: int, rod: Array, angle: Vector, step: Step) -> float:
    """Add forces and torques of bending and twist at an inner node; the work of a change of its preferred angles [J].

    Args:
        angle: cosine and sine of ψ, and the factor on the preferred angles.
    """
    one, two = _segment(filaments, i - 1), _segment(filaments, i)
    (k1, k2, twist), binormal, middle = _angles(one, two)
    stiffness, preferred = rod[BENDING], filaments.preferred[i]
    u1, u2 = k1 - preferred[0], k2 - preferred[1]
    preferred[0], preferred[1] = _two(filaments.wave[i], angle)
    v1, v2 = k1 - preferred[0], k2 - preferred[1]
    work = 0.5 * stiffness * (v1 * v1 + v2 * v2 - u1 * u1 - u2 * u2)
    slope = 1 + 0.25 * twist * twist  # of ν by the twist
    moments = stiffness * v1, stiffness * v2, rod[TWISTING] * twist * slope
    _bend(filaments.force, i, moments, (k1, k2), one, two, binormal, middle)
    if rod[BENDING_TIME] > 0.0:
        velocity = vector(filaments.velocity[i], 0)
        a = scale(1 / one[2], sub(velocity, vector(filaments.velocity[i - 1], 0)))
        b = scale(1 / two[2], sub(vector(filaments.velocity[i + 1], 0), velocity))
        both = add(a, b)
        g, growth = sub(cross(a, two[0]), cross(b, one[0])), dot(both, middle[0])
        roll, roll2 = filaments.spin[i - 1], filaments.spin[i]
        turning = along(scale(0.5 * roll, one[1]), 0.5 * roll2, two[1])
        across = along(scale(0.5 * roll, cross(one[0], one[1])), 0.5 * roll2, cross(two[0], two[1]))
        rate1 = dot(middle[2], g) - k1 * growth - dot(turning, binormal)
        rate2 = -dot(middle[1], g) - k2 * growth - dot(across, binormal)
        rate3 = slope * slope * (0.5 * dot(binormal, both) + roll2 - roll)
        time = rod[BENDING_TIME]
        moments = time * stiffness * rate1, time * stiffness * rate2, time * rod[TWISTING] * rate3
        _bend(filaments.damping, i, moments, (k1, k2), one, two, binormal, middle)
    # The energy stiffens as the angle θ grows: κ = 2 tan(θ/2), κ'² + κ κ'' = (1 + q) (1 + 3 q) with q = tan²(θ/2).
    # The twist likewise, and what bends resists rolls that are not alike.
    q, p = 0.25 * dot(binormal, binormal), slope - 1
    twisted = rod[STIFFEST_TWIST] * (1 + p) * (1 + 3 * p) + 4 * q * stiffness / rod[AXIAL]
    stiffest = step.whole * step.whole * max(rod[STIFFEST] * (1 + q) * (1 + 3 * q), twisted)
    if stiffest > RESOLVED * RESOLVED:
        step.need[0] = max(step.need[0], math.sqrt(stiffest) / RESOLVED)
    return work


@part
def _push_segment(filaments: Filaments, i: int, rod: Array, stretch: float, load: Array) -> None:
    """Add forces and torques on a segment: of contacts, stretching and drag, and what keeps its spin along its axis.

    Args:
        stretch: first moment of axial forces of contacts [N m].
        load: (6,) of contacts.
    """
    t, extent, spin = vector(filaments.tangent[i], 0), filaments.extent[i], filaments.spin[i]
    start, end = vector(filaments.velocity[i], 0), vector(filaments.velocity[i + 1], 0)
    opening, half, torque = sub(end, start), scale(0.5, vector(load, 0)), vector(load, 3)
    rate = dot(opening, t)
    # Of forces ± at both nodes: the couple of contacts, the spin that turns with the axis, the axial spring.
    pair = add(cross(torque, t), scale(rod[AXIAL] * spin / extent, cross(t, opening)))
    pair = along(scale(1 / extent, pair), stretch / extent - rod[STRETCHING] * (extent - rod[LENGTH]), t)
    put_more(filaments.force[i], 0, sub(half, pair))
    put_more(filaments.force[i + 1], 0, add(half, pair))
    filaments.force[i, 3] += dot(torque, t)
    resisting = rod[STRETCHING] * rod[STRETCHING_TIME] * rate
    put_more(filaments.damping[i], 0, scale(resisting, t))
    put_more(filaments.damping[i + 1], 0, scale(-resisting, t))
    if rod[ACROSS] > 0.0:
        more = rod[ACROSS] - rod[ALONG]
        put_more(filaments.drag[i], 0, along(scale(-rod[ACROSS], start), more * dot(start, t), t))
        put_more(filaments.drag[i + 1], 0, along(scale(-rod[ACROSS], end), more * dot(end, t), t))


@part
def push_nodes(filaments: Any, parts: Parts, gravity: float, step: Step) -> None:
    """Write all forces on nodes and all torques about the axes of segments.

    Args:
        filaments: `force`, `damping`, `drag`, `preferred` and `sums` are written.
        parts: with the loads of contacts.
        gravity: g [m/s²].
        step: `need` is written.
    """
    if filaments is None:
        return
    for f in range(filaments.body.shape[0]):
        first, last, rod, gait = filaments.begin[f], filaments.begin[f + 1] - 1, filaments.rod[f], filaments.gait[f]
        to_part = parts.begin[filaments.body[f]] - first
        for i in range(first, last + 1):
            for d in range(4):
                filaments.force[i, d] = filaments.damping[i, d] = filaments.drag[i, d] = 0.0
            filaments.force[i, 2] = -gravity * rod[WEIGHT] * filaments.mass[i]
        for i in range(first, last):
            _push_segment(filaments, i, rod, parts.stretch[to_part + i, MOMENT], parts.load[to_part + i])
        c, s = direction(gait[PSI])
        for i in range(first + 1, last):
            filaments.sums[ACTIVE] += _push_node(filaments, i, rod, (c, s, gait[FACTOR]), step)


@part
def resolve_nodes(filaments: Any, radii: Array, bodies: Bodies, step: Step) -> None:
    """Ask for sub-steps where a node would move far in a step.

    Args:
        filaments: with the forces of this instant.
        radii: (K,) of the kinds of bodies [m].
        step: `need` is written.
    """
    if filaments is None:
        return
    for f in range(filaments.body.shape[0]):
        radius, fastest = radii[bodies.shape[filaments.body[f]]], 0.0
        for i in range(filaments.begin[f], filaments.begin[f + 1]):
            gain = step.whole / filaments.mass[i]
            velocity = along(vector(filaments.velocity[i], 0), gain, vector(filaments.force[i], 0))
            fastest = max(fastest, dot(velocity, velocity))
        stride = step.whole * math.sqrt(fastest)
        if stride > LONGEST * radius:
            step.need[0] = max(step.need[0], stride / (STRIDE * radius))


# -- motion ------------------------------------------------------------------------------------------------------


@part
def kick_nodes(filaments: Any, dt: float) -> None:
    """Change the velocities of nodes and the spins of segments by the forces of this instant.

    Args:
        filaments: `velocity`, `spin`, `grip_force` and `sums` are written.
        dt: time over which they act [s].
    """
    if filaments is None:
        return
    sums = filaments.sums
    filaments.grip_force[:] = 0.0
    for f in range(filaments.body.shape[0]):
        first, last, rod = filaments.begin[f], filaments.begin[f + 1] - 1, filaments.rod[f]
        roll, inertia = dt * rod[ROLLING] / rod[AXIAL], rod[AXIAL]
        damped = dragged = 0.0
        for i in range(first, last + 1):
            share, grip = dt / filaments.mass[i], filaments.grip[i]
            for d in range(3):
                force = filaments.force[i, d] + filaments.damping[i, d] + filaments.drag[i, d]
                before = filaments.velocity[i, d]
                after = before + share * force
                if grip & (1 << d):
                    held = grip // GRIP
                    after = filaments.grip_speed[held, d]
                    reaction = (after - before) / share - force
                    filaments.grip_force[held, d] += reaction
                    sums[GRIPPED] += 0.5 * dt * reaction * (before + after)
                damped -= filaments.damping[i, d] * (before + after)
                dragged -= filaments.drag[i, d] * (before + after)
                filaments.velocity[i, d] = after
        for i in range(first, last):
            before = filaments.spin[i]
            # Drag of the roll is implicit: an axis has next to no inertia.
            after = (before + dt / inertia * (filaments.force[i, 3] + filaments.damping[i, 3])) / (1 + roll)
            if (filaments.grip[i] & filaments.grip[i + 1]) % GRIP == GRIP - 1:
                after = 0.0
            damped -= filaments.damping[i, 3] * (before + after)
            dragged += rod[ROLLING] * after * (before + after)
            filaments.spin[i] = after
        sums[DAMPED] += 0.5 * dt * damped
        sums[DRAGGED] += 0.5 * dt * dragged


@inlined
def _uniform(seed: int, number: int, event: int) -> float:
    """Return a random number between 0 and 1, which depends on the three numbers alone.

    Source: the finalizer of SplitMix64, Steele, Lea and Flood, OOPSLA 2014, once for each number.
    """
    state = np.uint64(0)
    for key in (seed, number, event):
        state = (state ^ np.uint64(key)) + np.uint64(0x9E3779B97F4A7C15)
        state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        state = state ^ (state >> np.uint64(31))
    return (float(state >> np.uint64(11)) + 0.5) * 2.0**-53


@part
def _wait(gait: Array) -> float:
    """Draw the time to the next reversal [s]."""
    gait[DRAWN] += 1
    return -math.log(_uniform(int(gait[SEED]), int(gait[NUMBER]), int(gait[DRAWN]))) / gait[REVERSALS]


@part
def _turn_wave(gait: Array, dt: float) -> None:
    """Turn the preferred curvature by a sub-step, reverse it where its time has come, and change its factor."""
    change, rest = gait[CHANGE] * dt, gait[TARGET] - gait[FACTOR]
    gait[FACTOR] = gait[TARGET] if abs(rest) <= change else gait[FACTOR] + math.copysign(change, rest)
    gait[PSI] += gait[SENSE] * gait[RATE] * dt
    if gait[REVERSALS] > 0.0:
        if math.isinf(gait[WAIT]):
            gait[WAIT] = _wait(gait)
        gait[WAIT] -= dt
        while gait[WAIT] < 0.0:
            # It has gone on for too long, and turns back by that and as much again.
            gait[PSI] += 2 * gait[SENSE] * gait[RATE] * gait[WAIT]
            gait[SENSE] = -gait[SENSE]
            gait[WAIT] += _wait(gait)


@part
def drift_nodes(filaments: Any, dt: float) -> None:
    """Move all nodes by a sub-step, and carry the directors along.

    Args:
        filaments: `position`, `tangent`, `extent`, `director` and `gait` are written.
        dt: length of the sub-step [s].
    """
    if filaments is None:
        return
    for f in range(filaments.body.shape[0]):
        first, last = filaments.begin[f], filaments.begin[f + 1] - 1
        _turn_wave(filaments.gait[f], dt)
        for i in range(first, last + 1):
            put(filaments.position[i], 0, along(vector(filaments.position[i], 0), dt, vector(filaments.velocity[i], 0)))
        for i in range(first, last):
            edge = sub(vector(filaments.position[i + 1], 0), vector(filaments.position[i], 0))
            extent = math.sqrt(dot(edge, edge))
            old, new, d = vector(filaments.tangent[i], 0), scale(1 / extent, edge), vector(filaments.director[i], 0)
            # The smallest turn from the old to the new tangent, then the roll by Cayley's rotation.
            d = along(d, -dot(d, new) / (1 + dot(old, new)), add(old, new))
            half = 0.5 * dt * filaments.spin[i]
            per = 1 / (1 + half * half)
            d = along(scale((1 - half * half) * per, d), 2 * half * per, cross(new, d))
            d = along(d, -dot(d, new), new)  # against rounding
            put(filaments.director[i], 0, scale(1 / math.sqrt(dot(d, d)), d))
            put(filaments.tangent[i], 0, new)
            filaments.extent[i] = extent


# -- energies ----------------------------------------------------------------------------------------------------


@kernel
def measure(filaments: Filaments, gravity: float, found: Array) -> None:
    """Add up the energies of all filaments.

    Args:
        gravity: g [m/s²].
        found: (5,) written: kinetic, potential, stretching, bending and twisting energy [J].
    """
    found[:] = 0.0
    for f in range(filaments.body.shape[0]):
        first, last, rod = filaments.begin[f], filaments.begin[f + 1] - 1, filaments.rod[f]
        for i in range(first, last + 1):
            velocity, mass = vector(filaments.velocity[i], 0), filaments.mass[i]
            found[0] += 0.5 * mass * dot(velocity, velocity)
            found[1] += gravity * rod[WEIGHT] * mass * filaments.position[i, 2]
            if i < last:
                found[0] += 0.5 * rod[AXIAL] * filaments.spin[i] ** 2
                found[2] += 0.5 * rod[STRETCHING] * (filaments.extent[i] - rod[LENGTH]) ** 2
            if first < i < last:
                (k1, k2, twist), _, _ = _angles(_segment(filaments, i - 1), _segment(filaments, i))
                k1, k2 = k1 - filaments.preferred[i, 0], k2 - filaments.preferred[i, 1]
                found[3] += 0.5 * rod[BENDING] * (k1 * k1 + k2 * k2)
                found[4] += 0.5 * rod[TWISTING] * twist * twist
