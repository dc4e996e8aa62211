"""One step of the smarticles: momenta change by the forces of this instant, then everything moves.

Leapfrog: momenta of the middle of a step, positions of its ends. Between kicks a smarticle keeps its angular momentum
in the laboratory exactly; it turns by the implicit midpoint rule for L' = L × ω, which keeps L² and the kinetic energy
L·I⁻¹L/2 as well, both being quadratic: free spins keep their energy for ever. The turn is Cayley's, which moves L in
the body frame by just that rule.
"""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Array, Bodies
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.barrier import LONGEST, STRIDE, Step
from dem.engine.links.contact.pairs import velocity_at
from dem.engine.links.motion.motoring import ITERATIONS, contact_torques, free_torques, middle_of_step
from dem.engine.links.motion.planar import rates, spin_of
from dem.engine.links.motion.poses import SLIP, along_normal
from dem.engine.links.shape import Shape
from dem.engine.links.vectors import along, dot, vector


@part
def kick(shape: Shape, bodies: Bodies, motors: Any, gravity: float, planar: bool, past: float, dt: float) -> None:
    """Change momenta by the forces in `load` or `shares`, by weight and by motors.

    Args:
        bodies: the smarticles; `velocity`, `momentum` and, while articulated, `load` are written.
        motors: None while welded; `impulse`, and for free angles `momentum` and `work`, are written.
        past: length of the last sub-step [s].
        dt: time over which they act [s], half of the last and half of the next sub-step.
    """
    velocity, momentum, load = bodies.velocity, bodies.momentum, bodies.load
    share, across = dt / shape.mass, 0.0 if planar else 1.0
    for i in range(velocity.shape[0]):
        if motors is not None:
            for d in range(6):
                load[i, d] = bodies.shares[3 * i, d] + bodies.shares[3 * i + 1, d] + bodies.shares[3 * i + 2, d]
        velocity[i, 0] += share * load[i, 0]
        velocity[i, 1] += share * load[i, 1]
        velocity[i, 2] += across * (share * load[i, 2] - dt * gravity)
        momentum[i, 0] += across * dt * load[i, 3]
        momentum[i, 1] += across * dt * load[i, 4]
        momentum[i, 2] += dt * load[i, 5]
        if motors is not None:
            q1, q2 = contact_torques(shape, bodies, i)
            if motors.law < SLIP:
                motors.impulse[i, 0] += dt * q1
                motors.impulse[i, 1] += dt * q2
                # Half a sub-step of these forces went along the rates before the control update.
                motors.work[i, 0] += 0.5 * past * q1 * motors.jump[i, 0]
                motors.work[i, 1] += 0.5 * past * q2 * motors.jump[i, 1]
                motors.jump[i, 0] = motors.jump[i, 1] = 0.0
            else:
                row, normal = bodies.plane[i], along_normal(bodies, i)
                p1, p2 = motors.momentum[i, 0] + dt * q1, motors.momentum[i, 1] + dt * q2
                r1, r2 = rates(row, normal, p1, p2)
                t1, t2 = free_torques(bodies, motors, i, r1, r2, dt)
                p1, p2 = p1 + dt * t1, p2 + dt * t2
                r1, r2 = rates(row, normal, p1, p2)
                motors.work[i, 0] += 0.5 * dt * t1 * (bodies.rate[i, 0] + r1)
                motors.work[i, 1] += 0.5 * dt * t2 * (bodies.rate[i, 1] + r2)
                motors.impulse[i, 0] += dt * t1
                motors.impulse[i, 1] += dt * t2
                motors.momentum[i, 0], motors.momentum[i, 1] = p1, p2
                bodies.rate[i, 0], bodies.rate[i, 1] = r1, r2


@part
def resolve_speeds(shape: Shape, bodies: Bodies, hinged: bool, gravity: float, step: Step) -> None:
    """Ask for sub-steps where a link would move far in a step, and enter another one too deep at once.

    Args:
        bodies: the smarticles, with the loads of this instant.
        hinged: whether links have velocities of their own.
        step: `need` is written.
    """
    velocity, spin, load, limit = bodies.velocity, bodies.spin, bodies.load, LONGEST * shape.radius
    per_force, square = step.whole / shape.mass, limit * limit / (3.0 * step.whole * step.whole)
    for i in range(velocity.shape[0]):
        fx, fy, fz = load[i, 0], load[i, 1], load[i, 2]
        if hinged:
            fx = bodies.shares[3 * i, 0] + bodies.shares[3 * i + 1, 0] + bodies.shares[3 * i + 2, 0]
            fy = bodies.shares[3 * i, 1] + bodies.shares[3 * i + 1, 1] + bodies.shares[3 * i + 2, 1]
            fz = bodies.shares[3 * i, 2] + bodies.shares[3 * i + 1, 2] + bodies.shares[3 * i + 2, 2]
        gain = per_force * per_force * (fx * fx + fy * fy + fz * fz)
        speed = velocity[i, 0] ** 2 + velocity[i, 1] ** 2 + velocity[i, 2] ** 2
        turning = shape.reach * shape.reach * (spin[i, 0] ** 2 + spin[i, 1] ** 2 + spin[i, 2] ** 2)
        # A sum of three is at most the root of three times their squares: most are slow, and need no root.
        if gain + speed + turning > square:
            stride = step.whole * (_fastest_end(shape, bodies, i, hinged) + math.sqrt(gain) + step.whole * gravity)
            if stride > limit:
                step.need[0] = max(step.need[0], stride / (STRIDE * shape.radius))


@part
def _fastest_end(shape: Shape, bodies: Bodies, i: int, hinged: bool) -> float:
    """Greatest speed of an end of a link's axis [m/s] as the step began: a rod that rolls moves no axis by it."""
    links, segments, most = shape.kinds.shape[0], bodies.segments, 0.0
    each = links * shape.offsets.shape[0]
    for p in range(each * i, each * (i + 1)):
        row = 3 * i + shape.kinds[p % links] if hinged else i
        for end in range(2):
            place = along(vector(segments[p], 0), end, vector(segments[p], 3))
            velocity = velocity_at(bodies, i, row, place)
            most = max(most, dot(velocity, velocity))
    return math.sqrt(most)


@part
def drift(shape: Shape, bodies: Bodies, motors: Any, dt: float, row: Array) -> None:
    """Move and turn all smarticles by a step.

    Args:
        bodies: the smarticles; `position`, `turn` and, while articulated, `alpha` are written.
        dt: time step [s].
        row: (PLANE,) scratch.
    """
    position, velocity, turn = bodies.position, bodies.velocity, bodies.turn
    for i in range(position.shape[0]):
        for d in range(3):
            position[i, d] += dt * velocity[i, d]
        if motors is not None:
            wx, wy, wz = middle_of_step(shape, bodies, motors, i, dt, row)
        else:
            wx, wy, wz = _rigid(bodies, i, dt)
        a, b, c, d = turn[i, 0], turn[i, 1], turn[i, 2], turn[i, 3]
        h = 0.5 * dt
        e = a - h * (b * wx + c * wy + d * wz)
        f = b + h * (a * wx + c * wz - d * wy)
        g = c + h * (a * wy - b * wz + d * wx)
        k = d + h * (a * wz + b * wy - c * wx)
        norm = 1 / math.sqrt(e * e + f * f + g * g + k * k)
        turn[i, 0], turn[i, 1], turn[i, 2], turn[i, 3] = e * norm, f * norm, g * norm, k * norm


@inlined
def _rigid(bodies: Bodies, i: int, dt: float) -> tuple[float, float, float]:
    """ω of a rigid smarticle at the middle of the step, in the middle link's axes [rad/s]."""
    axes, momentum, row = bodies.axes, bodies.momentum, bodies.plane[i]
    m0, m1, m2 = momentum[i, 0], momentum[i, 1], momentum[i, 2]
    l0 = axes[i, 0, 0] * m0 + axes[i, 1, 0] * m1 + axes[i, 2, 0] * m2
    l1 = axes[i, 0, 1] * m0 + axes[i, 1, 1] * m1 + axes[i, 2, 1] * m2
    l2 = axes[i, 0, 2] * m0 + axes[i, 1, 2] * m1 + axes[i, 2, 2] * m2
    x, y, z, half = l0, l1, l2, 0.5 * dt
    for _ in range(ITERATIONS):
        wx, wy, wz = spin_of(row, x, y, z, 0.0)
        x, y, z = l0 + half * (y * wz - z * wy), l1 + half * (z * wx - x * wz), l2 + half * (x * wy - y * wx)
    return spin_of(row, x, y, z, 0.0)
