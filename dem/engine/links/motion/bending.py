"""Motion of filaments: nodes with mass, segments that stretch and roll, bending and twist in between.

Between two segments with tangents t, t', directors d1, d1' and d2 = t × d1, the discrete elastic rod of Bergou et al.,
ACM Trans. Graph. 27, 63 (2008) and 29, 116 (2010), has the angles

    κ1 = b·(d2 + d2')/2,   κ2 = -b·(d1 + d1')/2,   ν = 2 tan(m/2),   b = 2 t × t'/(1 + t·t'),

with the twist m between the directors of both segments. With the length ℓ of a segment at rest, its vector e and the
preferred values κ̄, the energy is (EI/2ℓ) |κ - κ̄|² + (GJ/2ℓ) ν² + (EA/2ℓ) (|e| - ℓ)². Forces and torques are its
derivatives. So the sum of all forces is zero, and so is the sum of their moments and of all torques about axes.

Directors follow the tangent of their segment without twist, and turn about it as the segment rolls. Rolling has an
inertia of its own, so that friction rolls a filament like a rigid bar. As for rigid bodies the scheme is leapfrog:
velocities belong to the middles of sub-steps.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

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
from dem.engine.links.contact.barrier import LONGEST, SLACK, STRIDE, Step
from dem.engine.links.motion.planar import direction
from dem.engine.links.shapes import INVERSE
from dem.engine.links.vectors import Vector, add, along, cross, dot, put, put_more, scale, sub, vector

# Columns of a rod: length of a segment at rest ℓ [m]; EA/ℓ [N/m], EI/ℓ and GJ/ℓ [N m], times of Kelvin and Voigt of
# stretching and twisting, and of bending [s]; a segment's inertia about its axis [kg m²]; drag of half a segment across
# and along [N s/m], of a segment's roll [N m s]; weight over mass and g [1]; squares of the greatest frequencies of
# bending and of twisting [1/s²].
LENGTH, STRETCHING, BENDING, TWISTING, STRETCHING_TIME, BENDING_TIME = range(6)
AXIAL, ACROSS, ALONG, ROLLING, WEIGHT, STIFFEST, STIFFEST_TWIST, ROD = range(6, 14)
# Columns of a gait: ψ [rad], its rate [rad/s], sense ±1, mean reversals per second, time to the next one [s], reversals
# that were drawn, seed and number of the filament; a factor on the preferred angles, its target, and the rate at which
# it gets there [1/s].
PSI, RATE, SENSE, REVERSALS, WAIT, DRAWN, SEED, NUMBER, FACTOR, TARGET, CHANGE, GAIT = range(12)
# Work [J]: what internal damping and the liquid's drag took, what activity and grips gave.
DAMPED, DRAGGED, ACTIVE, GRIPPED, SUMS = range(5)
GRIP = 8  # `Filaments.grip` is the grip's number times this, plus the directions that it holds
RESOLVED = 1.4  # greatest ω dt of a mode, of the 2 up to which leapfrog is stable without dashpots


# -- from nodes to segments --------------------------------------------------------------------------------------


@part
def move_segments(filaments: Any, parts: Parts, segments: Segments) -> None:
    """Compute the motion of the segments of all filaments from the velocities of the nodes.

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
    """Compute positions and motion of filaments and their segments from the nodes.

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
    """Do what `pose_filaments` does, for calls from Python."""
    pose_filaments(filaments, bodies, parts, segments)


# -- forces ------------------------------------------------------------------------------------------------------


class Piece(NamedTuple):
    """Direction and motion of one segment."""

    t: Vector  #: Tangent [1]
    d: Vector  #: First director [1]
    e: Vector  #: Second director, t × d [1]
    inverse: float  #: 1 over the length of the segment [1/m]
    opening: Vector  #: Velocity of the end relative to the start, over the length of the segment [1/s]
    spin: float  #: Rate at which the segment rolls about its axis [rad/s]


class Bend(NamedTuple):
    """Angles between two segments, in the symbols of the module; all are pure numbers [1]."""

    k1: float  #: κ1
    k2: float  #: κ2
    twist: float  #: ν
    binormal: Vector  #: b
    tangent: Vector  #: Sum of both tangents over 1 + t·t'
    first: Vector  #: Sum of both first directors over 1 + t·t'
    second: Vector  #: Sum of both second directors over 1 + t·t'
    #: Dot products with b: first and second director of the first segment, then of the second segment
    along: tuple[float, float, float, float]


@inlined
def _piece(filaments: Filaments, i: int) -> Piece:
    """Return direction and motion of segment `i`."""
    t, d, inverse = vector(filaments.tangent[i], 0), vector(filaments.director[i], 0), 1 / filaments.extent[i]
    opening = sub(vector(filaments.velocity[i + 1], 0), vector(filaments.velocity[i], 0))
    return Piece(t, d, cross(t, d), inverse, scale(inverse, opening), filaments.spin[i])


@inlined
def _bend_of(one: Piece, two: Piece) -> Bend:
    """Return the angles between two successive segments."""
    inverse = 1 / (1 + dot(one.t, two.t))
    binormal, d, e = scale(2 * inverse, cross(one.t, two.t)), add(one.d, two.d), add(one.e, two.e)
    d1, e1, d2, e2 = dot(one.d, binormal), dot(one.e, binormal), dot(two.d, binormal), dot(two.e, binormal)
    # The first director, carried to the second segment without twist, in that segment's frame.
    off = dot(one.d, two.t) * inverse
    sine = off * dot(one.t, two.e) - dot(one.d, two.e)
    cosine = dot(one.d, two.d) - off * dot(one.t, two.d)
    return Bend(
        0.5 * (e1 + e2), -0.5 * (d1 + d2), 2 * sine / (1 + cosine), binormal, scale(inverse, add(one.t, two.t)),
        scale(inverse, d), scale(inverse, e), (d1, e1, d2, e2),
    )  # fmt: skip


@inlined
def _push_bend(out: Array, i: int, moments: Vector, one: Piece, two: Piece, bend: Bend) -> None:
    """Add the forces and torques of bending and twisting between the segments i - 1 and i to `out`.

    Args:
        out: (n, 4) force on each node [N], torque about each segment's axis [N m].
        i: number of the node between the two segments.
        moments: derivatives of the energy by κ1, κ2 and the twist m [N m].
        one: segment i - 1.
        two: segment i.
        bend: angles between the two segments.
    """
    m1, m2, twist = moments
    d1, e1, d2, e2 = bend.along
    c = sub(scale(m1, bend.second), scale(m2, bend.first))
    rest = sub(scale(0.5 * twist, bend.binormal), scale(m1 * bend.k1 + m2 * bend.k2, bend.tangent))
    a = scale(one.inverse, add(cross(two.t, c), rest))
    b = scale(two.inverse, sub(rest, cross(one.t, c)))
    put_more(out[i - 1], 0, a)
    put_more(out[i], 0, sub(b, a))
    put_more(out[i + 1], 0, scale(-1.0, b))
    out[i - 1, 3] += 0.5 * (m1 * d1 + m2 * e1) + twist
    out[i, 3] += 0.5 * (m1 * d2 + m2 * e2) - twist


@inlined
def _rates(one: Piece, two: Piece, bend: Bend, slope: float) -> Vector:
    """Return the rates of change of κ1 and κ2, and that of ν times dν/dm [1/s].

    For κ1, κ2, ν and the twist m see the top of this module.

    Args:
        one: the first segment.
        two: the next segment.
        bend: angles between the two segments.
        slope: dν/dm [1].
    """
    d1, e1, d2, e2 = bend.along
    both = add(one.opening, two.opening)
    g, growth = sub(cross(one.opening, two.t), cross(two.opening, one.t)), dot(both, bend.tangent)
    return (
        dot(bend.second, g) - bend.k1 * growth - 0.5 * (one.spin * d1 + two.spin * d2),
        -dot(bend.first, g) - bend.k2 * growth - 0.5 * (one.spin * e1 + two.spin * e2),
        slope * slope * (0.5 * dot(bend.binormal, both) + two.spin - one.spin),
    )


@inlined
def _resolve(step: Step, stiffness: float, damping: float) -> None:
    """Increase `step.need` if a mode of vibration is too fast, or too strongly damped, for a time step.

    Args:
        step: `need` is increased.
        stiffness: square of the mode's frequency [1/s²].
        damping: rate at which dashpots slow the mode [1/s].
    """
    k, c = stiffness * step.whole * step.whole, damping * step.whole
    # A step h is stable while K h² + 2 C h is up to 4, also one that is longer than needed by the `SLACK`.
    if (k > RESOLVED * RESOLVED) | (SLACK * (SLACK * k + 2 * c) > 4.0):
        step.need[0] = max(step.need[0], math.sqrt(k) / RESOLVED, 0.25 * SLACK * (c + math.sqrt(c * c + 4 * k)))


@inlined
def _push_node(
    filaments: Filaments, i: int, rod: Array, angle: Vector, one: Piece, two: Piece, ledger: Any, step: Step
) -> float:
    """Add the forces and torques of bending and twisting at inner node `i`, and update its preferred κ.

    Args:
        rod: (ROD,) constants of the filament; for the columns see `LENGTH`.
        angle: cosine and sine of ψ, and the factor on the preferred κ [1].
        one: the segment before the node.
        two: the segment after the node.
        ledger: None: internal damping is part of the forces; otherwise it is added to `filaments.damping`.
        step: its number of sub-steps is increased if needed.

    Returns:
        Work of the change of the preferred κ [J].
    """
    bend = _bend_of(one, two)
    stiffness, twisting, time = rod[BENDING], rod[TWISTING], rod[BENDING_TIME]
    preferred, wave, (c, s, factor) = filaments.preferred[i], filaments.wave[i], angle
    u1, u2 = bend.k1 - preferred[0], bend.k2 - preferred[1]
    preferred[0] = factor * wave[0] * (c * wave[1] - s * wave[2])
    preferred[1] = factor * wave[0] * (s * wave[1] + c * wave[2])
    v1, v2 = bend.k1 - preferred[0], bend.k2 - preferred[1]
    slope = 1 + 0.25 * bend.twist * bend.twist  # of ν by the twist
    moments = stiffness * v1, stiffness * v2, twisting * bend.twist * slope
    r1, r2, r3 = _rates(one, two, bend, slope)
    # The mean over the bends before and after the last sub-step, during which the preferred κ changed: second order.
    work = 0.5 * stiffness * (v1 * v1 + v2 * v2 - u1 * u1 - u2 * u2)
    work += 0.5 * stiffness * step.past * ((u1 - v1) * r1 + (u2 - v2) * r2)
    damping = time * stiffness * r1, time * stiffness * r2, rod[STRETCHING_TIME] * twisting * r3
    if ledger is None:
        moments = add(moments, damping)
    else:
        _push_bend(filaments.damping, i, damping, one, two, bend)
    _push_bend(filaments.force, i, moments, one, two, bend)
    # The energy stiffens as the angle θ grows: κ = 2 tan(θ/2), κ'² + κ κ'' = (1 + q) (1 + 3 q) with q = tan²(θ/2), and
    # κ'² = (1 + q)². The twist likewise.
    q, p = 0.25 * dot(bend.binormal, bend.binormal), slope - 1
    _resolve(step, rod[STIFFEST] * (1 + q) * (1 + 3 * q), time * rod[STIFFEST] * (1 + q) * (1 + q))
    # Where a filament is bent, its rolling bends it sideways: 4 q EI/ℓ over a segment's inertia, which is small.
    sideways, twisted = rod[STIFFEST] + 4 * q * stiffness / rod[AXIAL], rod[STIFFEST_TWIST] * slope
    damped = time * sideways + rod[STRETCHING_TIME] * twisted * slope
    _resolve(step, sideways + twisted * (1 + 3 * p), damped)
    return float(work)


@inlined
def _push_segment(
    filaments: Filaments, i: int, rod: Array, own: Piece, stretch: float, load: Array, out: Array
) -> None:
    """Add the forces and torques on segment `i`: of contacts, stretching, drag, and gyroscopic forces.

    Gyroscopic forces turn the angular momentum of rolling with the axis.

    Args:
        rod: (ROD,) constants of the filament; for the columns see `LENGTH`.
        own: direction and motion of the segment.
        stretch: sum over contacts of axial force times axial distance from the centre [N m].
        load: (6,) force [N] and torque about the centre [N m] of contacts.
        out: (n, 4) array to which forces of internal damping are added [N].
    """
    t, half, torque = own.t, scale(0.5, vector(load, 0)), vector(load, 3)
    # Of forces ± at both nodes: the couple of contacts, the spin that turns with the axis, the axial spring.
    pair = add(cross(torque, t), scale(rod[AXIAL] * own.spin, cross(t, own.opening)))
    pair = along(scale(own.inverse, pair), stretch * own.inverse - rod[STRETCHING] * _stretched(filaments, i, rod), t)
    put_more(filaments.force[i], 0, sub(half, pair))
    put_more(filaments.force[i + 1], 0, add(half, pair))
    filaments.force[i, 3] += dot(torque, t)
    resisting = rod[STRETCHING] * rod[STRETCHING_TIME] * filaments.extent[i] * dot(own.opening, t)
    put_more(out[i], 0, scale(resisting, t))
    put_more(out[i + 1], 0, scale(-resisting, t))
    if rod[ACROSS] > 0.0:
        more = rod[ACROSS] - rod[ALONG]
        for k in range(i, i + 2):
            velocity = vector(filaments.velocity[k], 0)
            put_more(filaments.drag[k], 0, along(scale(-rod[ACROSS], velocity), more * dot(velocity, t), t))


@inlined
def _stretched(filaments: Filaments, i: int, rod: Array) -> float:
    """Return the length of segment `i` less its length at rest [m]."""
    return float(filaments.extent[i] - rod[LENGTH])


@inlined
def _damping_of(ledger: Any, force: Array, damping: Array) -> Array:
    """Return the array for forces of internal damping: `damping` if a ledger is kept, otherwise `force`."""
    if ledger is None:
        return force
    return damping


@part
def push_nodes(filaments: Any, parts: Parts, gravity: float, ledger: Any, step: Step) -> None:
    """Write all forces on nodes and all torques about the axes of segments.

    Args:
        filaments: `force`, `damping`, `drag`, `preferred` and `sums` are written.
        parts: the parts, with the loads of contacts.
        gravity: g [m/s²].
        ledger: forces that dissipate energy; None if dissipation is not recorded.
        step: `need` is increased if bending or twisting is too stiff for a time step.
    """
    if filaments is None:
        return
    out = _damping_of(ledger, filaments.force, filaments.damping)
    for f in range(filaments.body.shape[0]):
        first, last, rod, gait = filaments.begin[f], filaments.begin[f + 1] - 1, filaments.rod[f], filaments.gait[f]
        to_part = parts.begin[filaments.body[f]] - first
        for i in range(first, last + 1):
            for d in range(4):
                filaments.force[i, d] = filaments.damping[i, d] = filaments.drag[i, d] = 0.0
            filaments.force[i, 2] = -gravity * rod[WEIGHT] * filaments.mass[i]
        c, s = direction(gait[PSI])
        before, work = _piece(filaments, first), 0.0
        for i in range(first, last):
            own = _piece(filaments, i)
            _push_segment(filaments, i, rod, own, parts.stretch[to_part + i, MOMENT], parts.load[to_part + i], out)
            if i > first:
                work += _push_node(filaments, i, rod, (c, s, gait[FACTOR]), before, own, ledger, step)
            before = own
        filaments.sums[ACTIVE] += work


@part
def resolve_nodes(filaments: Any, radii: Array, bodies: Bodies, step: Step) -> None:
    """Increase `step.need` if a node would move too far in a time step.

    Args:
        filaments: the filaments, with their present forces.
        radii: (K,) radii of the thinnest segments of each shape [m].
        step: `need` is increased.
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
    """Change the velocities of nodes and the spins of segments by the present forces.

    Args:
        filaments: `velocity`, `spin`, `grip_force` and `sums` are written.
        dt: time over which the forces act [s].
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
    """Return a random number between 0 and 1, by the seed, the filament's number and that of the draw.

    Source: the finalizer of SplitMix64, Steele, Lea and Flood, OOPSLA 2014, applied once for each argument.
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
    """Return a random time from one reversal of a filament's wave to the next [s].

    Args:
        gait: (GAIT,) state of the wave; for the columns see `PSI`. The number of draws, `DRAWN`, is increased by 1.
    """
    gait[DRAWN] += 1
    return float(-math.log(_uniform(int(gait[SEED]), int(gait[NUMBER]), int(gait[DRAWN]))) / gait[REVERSALS])


@part
def turn_wave(gait: Array, dt: float) -> None:
    """Advance the wave of a filament or a linkage by a time `dt` [s].

    Args:
        gait: (GAIT,) state of the wave, for the columns see `PSI`; factor, angle ψ and sense are updated.
    """
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
    """Move all nodes by a sub-step, and turn the directors with their segments.

    Args:
        filaments: `position`, `tangent`, `extent`, `director` and `gait` are written.
        dt: length of the sub-step [s].
    """
    if filaments is None:
        return
    for f in range(filaments.body.shape[0]):
        first, last = filaments.begin[f], filaments.begin[f + 1] - 1
        turn_wave(filaments.gait[f], dt)
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
            # Against rounding: across the axis, and of unit length by one step of Newton's.
            d = along(d, -dot(d, new), new)
            put(filaments.director[i], 0, scale(1.5 - 0.5 * dot(d, d), d))
            put(filaments.tangent[i], 0, new)
            filaments.extent[i] = extent


# -- energies ----------------------------------------------------------------------------------------------------


@kernel
def measure(filaments: Filaments, gravity: float, found: Array) -> None:
    """Compute the energies of all filaments.

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
                found[2] += 0.5 * rod[STRETCHING] * _stretched(filaments, i, rod) ** 2
            if first < i < last:
                bend = _bend_of(_piece(filaments, i - 1), _piece(filaments, i))
                k1, k2 = bend.k1 - filaments.preferred[i, 0], bend.k2 - filaments.preferred[i, 1]
                found[3] += 0.5 * rod[BENDING] * (k1 * k1 + k2 * k2)
                found[4] += 0.5 * rod[TWISTING] * bend.twist**2
