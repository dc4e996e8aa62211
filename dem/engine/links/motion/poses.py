"""From the state of smarticles to where their links are and how these move."""

from __future__ import annotations

from typing import Any

from dem.engine.links.arrays import Array, Bodies
from dem.engine.links.compiler import inlined, kernel
from dem.engine.links.motion.planar import rates, spin_of
from dem.engine.links.shape import Shape
from dem.engine.links.vectors import moving, put, put_more, vector

SLIP = 3  # laws of motors from here on leave the angles free


@inlined
def turn_axes(bodies: Bodies, i: int) -> None:
    """Write the rotation matrix of a smarticle's quaternion into `axes`."""
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
    """Angular momentum of a smarticle along its normal [kg m²/s]."""
    axes, momentum = bodies.axes, bodies.momentum
    return float(axes[i, 0, 2] * momentum[i, 0] + axes[i, 1, 2] * momentum[i, 1] + axes[i, 2, 2] * momentum[i, 2])


@inlined
def find_spin(bodies: Bodies, i: int, hinged: Any) -> None:
    """Write ω of a smarticle into `spin`, from its angular momentum and what its barbs have of it."""
    axes, momentum, row = bodies.axes, bodies.momentum, bodies.plane[i]
    mx, my, mz = momentum[i, 0], momentum[i, 1], momentum[i, 2]
    internal = 0.0
    if hinged is not None:
        internal = row[18] * bodies.rate[i, 0] + row[19] * bodies.rate[i, 1]
    wx, wy, wz = spin_of(
        row,
        axes[i, 0, 0] * mx + axes[i, 1, 0] * my + axes[i, 2, 0] * mz,
        axes[i, 0, 1] * mx + axes[i, 1, 1] * my + axes[i, 2, 1] * mz,
        axes[i, 0, 2] * mx + axes[i, 1, 2] * my + axes[i, 2, 2] * mz,
        internal,
    )
    for d in range(3):
        bodies.spin[i, d] = axes[i, d, 0] * wx + axes[i, d, 1] * wy + axes[i, d, 2] * wz


@inlined
def find_motion(shape: Shape, bodies: Bodies, i: int, hinged: Any) -> None:
    """Write the velocities of a smarticle's rigid bodies into `motion`, as seen at the centre of mass.

    A point x of a link moves with motion[:3] + motion[3:] × (x - position).
    """
    motion, velocity, spin = bodies.motion, bodies.velocity, bodies.spin
    if hinged is None:
        for d in range(3):
            motion[i, d], motion[i, 3 + d] = velocity[i, d], spin[i, d]
    else:
        axes, row, share = bodies.axes, bodies.plane[i], shape.barb_mass / shape.mass
        rate1, rate2 = bodies.rate[i, 0], bodies.rate[i, 1]
        # The centre of mass moves in the middle link's frame, so that frame moves the other way.
        ux = -share * (row[6] * rate1 + row[8] * rate2)
        uy = -share * (row[7] * rate1 + row[9] * rate2)
        for d in range(3):
            frame = velocity[i, d] + axes[i, d, 0] * ux + axes[i, d, 1] * uy
            normal = axes[i, d, 2]
            motion[3 * i, d] = motion[3 * i + 1, d] = motion[3 * i + 2, d] = frame
            motion[3 * i, 3 + d] = spin[i, d] - rate1 * normal
            motion[3 * i + 1, 3 + d] = spin[i, d]
            motion[3 * i + 2, 3 + d] = spin[i, d] + rate2 * normal
            # A barb turns about its hinge, not about the centre of mass: - s α̇ z × hinge, with z × (x, y) = (-y, x).
            x1, x2, y = -shape.half - row[0], shape.half - row[0], -row[1]
            motion[3 * i, d] += rate1 * (-axes[i, d, 0] * y + axes[i, d, 1] * x1)
            motion[3 * i + 2, d] -= rate2 * (-axes[i, d, 0] * y + axes[i, d, 1] * x2)


@inlined
def place_links(shape: Shape, bodies: Bodies, i: int) -> None:
    """Write the axes of a smarticle's links into `segments`, strand by strand."""
    axes, position, row, segments = bodies.axes, bodies.position, bodies.plane[i], bodies.segments
    links = shape.kinds.shape[0]
    for strand in range(shape.offsets.shape[0]):
        z = shape.offsets[strand]
        for link in range(links):
            kind = shape.kinds[link]
            if kind == 1:
                x, y, ux, uy = -shape.end - row[0], -row[1], 2 * shape.end, 0.0
            elif kind == 0:
                x, y, ux, uy = -shape.half - row[0], -row[1], shape.tip * row[10], shape.tip * row[11]
            else:
                x, y, ux, uy = shape.half - row[0], -row[1], shape.tip * row[12], shape.tip * row[13]
            p = (i * shape.offsets.shape[0] + strand) * links + link
            for d in range(3):
                ex, ey = axes[i, d, 0], axes[i, d, 1]
                segments[p, d] = position[i, d] + ex * x + ey * y + axes[i, d, 2] * z
                segments[p, 3 + d] = ex * ux + ey * uy


@kernel
def pose(shape: Shape, bodies: Bodies, hinged: Any) -> None:
    """Bring everything up to date that follows from the state of the smarticles.

    Args:
        bodies: the smarticles; `axes`, `spin`, `segments` and `motion` are written, and
            `rate` where angles are free.
        hinged: the motors; None while welded: then no barb moves by itself.
    """
    for i in range(bodies.position.shape[0]):
        turn_axes(bodies, i)
        if hinged is not None and hinged.law >= SLIP:
            p1, p2 = hinged.momentum[i, 0], hinged.momentum[i, 1]
            bodies.rate[i, 0], bodies.rate[i, 1] = rates(bodies.plane[i], along_normal(bodies, i), p1, p2)
        find_spin(bodies, i, hinged)
        find_motion(shape, bodies, i, hinged)
        place_links(shape, bodies, i)


@kernel
def find_links(bodies: Bodies, hinged: bool, places: Array, frames: Array, velocities: Array, spins: Array) -> None:
    """Write where all links are and how they move.

    Args:
        hinged: whether links have velocities of their own.
        places: (N, 3, 3) written: centres of the links [m].
        frames: (N, 3, 3, 3) written: along, across and normal to each link, in columns [1].
        velocities: (N, 3, 3) written: of the centres [m/s].
        spins: (N, 3, 3) written: angular velocities [rad/s].
    """
    axes, plane, motion = bodies.axes, bodies.plane, bodies.motion
    for i in range(bodies.position.shape[0]):
        for k in range(3):
            # Barb 1 and barb 2 about the centre of mass; the middle link is where the centre of mass is not.
            x, y, ex, ey = -plane[i, 0], -plane[i, 1], 1.0, 0.0
            if k == 0:
                x, y, ex, ey = plane[i, 2], plane[i, 3], plane[i, 10], plane[i, 11]
            elif k == 2:
                x, y, ex, ey = plane[i, 4], plane[i, 5], plane[i, 12], plane[i, 13]
            row = 3 * i + k if hinged else i
            for d in range(3):
                frames[i, k, d, 0] = axes[i, d, 0] * ex + axes[i, d, 1] * ey
                frames[i, k, d, 1] = axes[i, d, 1] * ex - axes[i, d, 0] * ey
                frames[i, k, d, 2] = axes[i, d, 2]
                places[i, k, d] = axes[i, d, 0] * x + axes[i, d, 1] * y
                spins[i, k, d] = motion[row, 3 + d]
            arm, spin = vector(places[i, k], 0), vector(spins[i, k], 0)
            put(velocities[i, k], 0, moving(vector(motion[row], 0), spin, arm))
            put_more(places[i, k], 0, vector(bodies.position[i], 0))
