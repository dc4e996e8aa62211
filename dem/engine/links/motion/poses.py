"""Compute the positions of segments and the velocities of parts from the state of the bodies."""

from __future__ import annotations

from typing import Any

from dem.engine.links.arrays import ORIGIN, SPIN, VELOCITY, Array, Bodies, Parts, Segments
from dem.engine.links.compiler import inlined, kernel, part
from dem.engine.links.motion.planar import planar_at, rates, spin_of
from dem.engine.links.shapes import Planar, Shapes, is_flexible
from dem.engine.links.vectors import Vector, add, moving, put, put_more, scale, sub, turned, turned_back, vector


@inlined
def turn_axes(bodies: Bodies, i: int) -> None:
    """Compute the rotation matrix of body `i` from its quaternion, and write it into `bodies.axes`."""
    a, b, c, d = bodies.turn[i, 0], bodies.turn[i, 1], bodies.turn[i, 2], bodies.turn[i, 3]
    axes = bodies.axes
    axes[i, 0, 0] = 1 - 2 * (c * c + d * d)
    axes[i, 0, 1] = 2 * (b * c - d * a)
    axes[i, 0, 2] = 2 * (b * d + c * a)
    axes[i, 1, 0] = 2 * (b * c + d * a)
    axes[i, 1, 1] = 1 - 2 * (b * b + d * d)
    axes[i, 1, 2] = 2 * (c * d - b * a)
    axes[i, 2, 0] = 2 * (b * d - c * a)
    axes[i, 2, 1] = 2 * (c * d + b * a)
    axes[i, 2, 2] = 1 - 2 * (b * b + c * c)


@inlined
def along_normal(bodies: Bodies, i: int) -> float:
    """Return the angular momentum of a smarticle along its normal [kg m²/s]."""
    return turned_back(bodies, i, vector(bodies.momentum[i], 0))[2]


@inlined
def find_spin(bodies: Bodies, i: int, hinged: Any) -> None:
    """Compute the angular velocity of body `i` from its angular momentum, and write it into `bodies.spin`.

    While smarticles are articulated (`hinged` is not None), the angular momentum of turning barbs is subtracted.
    """
    row, internal = bodies.plane[i], 0.0
    if hinged is not None:
        internal = row[18] * bodies.rate[i, 0] + row[19] * bodies.rate[i, 1]
    x, y, z = turned_back(bodies, i, vector(bodies.momentum[i], 0))
    x, y, z = spin_of(row, x, y, z, internal)
    put(bodies.spin[i], 0, turned(bodies, i, x, y, z))


@inlined
def _move(parts: Parts, row: int, velocity: Vector, spin: Vector, origin: Vector) -> None:
    motion = parts.motion[row]
    put(motion, VELOCITY, velocity)
    put(motion, SPIN, spin)
    put(motion, ORIGIN, origin)


@inlined
def find_motion(shapes: Shapes, bodies: Bodies, parts: Parts, i: int, hinged: Any) -> None:
    """Write velocity, angular velocity and reference point of each part of body `i` into `parts.motion`.

    The reference point of all parts is the body's centre of mass. `hinged` is None while smarticles are welded.
    """
    row, position = parts.begin[i], vector(bodies.position[i], 0)
    velocity, spin = vector(bodies.velocity[i], 0), vector(bodies.spin[i], 0)
    if hinged is not None and shapes.hinged[bodies.shape[i]]:
        planar, plane = planar_at(shapes, bodies.shape[i]), bodies.plane[i]
        rate1, rate2, share = bodies.rate[i, 0], bodies.rate[i, 1], planar.barb_mass / planar.mass
        # The centre of mass moves in the middle link's frame, so that frame moves the other way.
        ux = -share * (plane[6] * rate1 + plane[8] * rate2)
        uy = -share * (plane[7] * rate1 + plane[9] * rate2)
        frame, normal = add(velocity, turned(bodies, i, ux, uy, 0.0)), turned(bodies, i, 0.0, 0.0, 1.0)
        # A barb turns about its hinge, not about the centre of mass: - s α̇ z × hinge, with z × (x, y) = (-y, x).
        x1, x2, y = -planar.half - plane[0], planar.half - plane[0], -plane[1]
        one, two = turned(bodies, i, -rate1 * y, rate1 * x1, 0.0), turned(bodies, i, rate2 * y, -rate2 * x2, 0.0)
        _move(parts, row, add(frame, one), sub(spin, scale(rate1, normal)), position)
        _move(parts, row + 1, frame, spin, position)
        _move(parts, row + 2, add(frame, two), add(spin, scale(rate2, normal)), position)
    else:
        _move(parts, row, velocity, spin, position)


@inlined
def _planar_line(planar: Planar, plane: Array, link: int) -> tuple[float, float, float, float]:
    """Return the axis of a smarticle's link, which lies in the xy plane of the body's frame.

    Args:
        plane: (PLANE,) plane geometry of the smarticle.
        link: 0 barb 1, 1 middle link, 2 barb 2.

    Returns:
        x and y of the start of the axis from the centre of mass [m]; x and y of the vector from start to end [m].
    """
    x, y, ux, uy = -planar.end - plane[0], -plane[1], 2 * planar.end, 0.0
    if link == 0:
        x, ux, uy = -planar.half - plane[0], planar.tip * plane[10], planar.tip * plane[11]
    elif link == 2:
        x, ux, uy = planar.half - plane[0], planar.tip * plane[12], planar.tip * plane[13]
    return x, y, ux, uy


@inlined
def place_segments(shapes: Shapes, bodies: Bodies, segments: Segments, i: int) -> None:
    """Write the positions of the segments of body `i` into `segments.line`."""
    k, position = bodies.shape[i], vector(bodies.position[i], 0)
    first = shapes.first[k]
    for p in range(segments.begin[i], segments.begin[i + 1]):
        m = first + p - segments.begin[i]
        own = shapes.lines[m]
        x, y, z = vector(own, 0)
        ux, uy, uz = vector(own, 3)
        if shapes.hinged[k]:
            x, y, ux, uy = _planar_line(planar_at(shapes, k), bodies.plane[i], shapes.link[m])
        put(segments.line[p], 0, add(position, turned(bodies, i, x, y, z)))
        put(segments.line[p], 3, turned(bodies, i, ux, uy, uz))


@inlined
def find_motions(shapes: Shapes, bodies: Bodies, parts: Parts, hinged: Any) -> None:
    """Write the spins of all bodies and the motion of all parts; `hinged`: motors, None while welded."""
    for i in range(bodies.position.shape[0]):
        if is_flexible(shapes.flexible, bodies.shape[i]):
            continue
        find_spin(bodies, i, hinged)
        find_motion(shapes, bodies, parts, i, hinged)


@part
def pose(shapes: Shapes, bodies: Bodies, parts: Parts, segments: Segments, hinged: Any) -> None:
    """Compute axes, spins, motion of parts and positions of segments, of bodies that are not flexible.

    Args:
        bodies: `axes` and `spin` are written, while articulated also `rate`.
        parts: `motion` is written.
        segments: `line` is written.
        hinged: the motors; None while smarticles are welded.
    """
    for i in range(bodies.position.shape[0]):
        if is_flexible(shapes.flexible, bodies.shape[i]):
            continue
        turn_axes(bodies, i)
        if hinged is not None and shapes.hinged[bodies.shape[i]]:
            p1, p2 = hinged.momentum[i, 0], hinged.momentum[i, 1]
            bodies.rate[i, 0], bodies.rate[i, 1] = rates(bodies.plane[i], along_normal(bodies, i), p1, p2)
        find_spin(bodies, i, hinged)
        find_motion(shapes, bodies, parts, i, hinged)
        place_segments(shapes, bodies, segments, i)


@kernel
def pose_all(shapes: Shapes, bodies: Bodies, parts: Parts, segments: Segments, hinged: Any) -> None:
    """Do what `pose` does, for calls from Python."""
    pose(shapes, bodies, parts, segments, hinged)


@kernel
def find_links(
    bodies: Bodies, parts: Parts, each: int, places: Array, frames: Array, velocities: Array, spins: Array
) -> None:
    """Write positions, frames and velocities of all links of smarticles.

    Args:
        bodies: the smarticles, after a call of `pose`.
        parts: the parts, after a call of `pose`.
        each: number of parts of a smarticle that move separately: 3 while articulated, 1 while welded.
        places: (N, 3, 3) written: centres of the links [m].
        frames: (N, 3, 3, 3) written: unit vectors along, across and normal to each link, in columns [1].
        velocities: (N, 3, 3) written: velocities of the centres [m/s].
        spins: (N, 3, 3) written: angular velocities of the links [rad/s].
    """
    plane = bodies.plane
    for i in range(bodies.position.shape[0]):
        normal = turned(bodies, i, 0.0, 0.0, 1.0)
        for k in range(3):
            # Barb 1 and barb 2 about the centre of mass; the middle link is where the centre of mass is not.
            x, y, ex, ey = -plane[i, 0], -plane[i, 1], 1.0, 0.0
            if k == 0:
                x, y, ex, ey = plane[i, 2], plane[i, 3], plane[i, 10], plane[i, 11]
            elif k == 2:
                x, y, ex, ey = plane[i, 4], plane[i, 5], plane[i, 12], plane[i, 13]
            motion = parts.motion[parts.begin[i] + min(k, each - 1)]
            along, across = turned(bodies, i, ex, ey, 0.0), turned(bodies, i, -ey, ex, 0.0)
            for d in range(3):
                frames[i, k, d, 0], frames[i, k, d, 1], frames[i, k, d, 2] = along[d], across[d], normal[d]
            arm = turned(bodies, i, x, y, 0.0)
            put(spins[i, k], 0, vector(motion, SPIN))
            put(velocities[i, k], 0, moving(vector(motion, VELOCITY), vector(motion, SPIN), arm))
            put(places[i, k], 0, arm)
            put_more(places[i, k], 0, vector(bodies.position[i], 0))
