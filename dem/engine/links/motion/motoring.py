"""Kernels of the motors: torques and work, prescribed rates, and torques at free angles.

Under the laws halt, stall and ease a motor is the limit of a stiff shaft: it prescribes the rate of an angle, which is
constant between two control updates. The mean torque of the motor since the last control update follows from the
momentum p that belongs to the angle (see `planar`): τ = dp/dt - ∂T/∂α - Q, with the generalised force Q of contacts.
Weight has no such force, since angles do not move the centre of mass. At a control update the rate jumps by at most
the change that τ_max would cause in a control period at a free barb (`Motoring.acceleration`), so that a motor reverses
only as fast as its torque allows. A motor stops at once, since a gear holds without torque of the motor. The work
includes the energy of a jump, exactly; the torque that the law compares with τ_max does not, since it is the load.

Under the laws slip and servo the angle is free: p is part of the state. The torque τ is that of a spring to the
command, capped at τ_max, and for a servo also of a damper. The spring acts at the mean of the angles half a step before
and half a step after, the damper at the rate after, so that both are stable at any stiffness and damping.

Work and change of kinetic energy agree to second order in the time step; in kicks and jumps they agree exactly.
"""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array, Bodies, Motoring, Parts
from dem.engine.links.compiler import inlined, kernel, part
from dem.engine.links.motion.planar import (
    inverses,
    lagrange_force,
    lay_out_at,
    lay_out_near,
    mobility,
    momenta,
    planar_at,
    rates,
    spin_by,
    spin_of,
)
from dem.engine.links.motion.poses import SLIP, along_normal, turn_axes
from dem.engine.links.shapes import Planar, Shapes
from dem.engine.links.vectors import turned_back, vector
from dem.physics import motor

BRAKING = 0.5  # of the greatest deceleration is used on the way to a target, so that it is not passed
_halts, _speed_factor = inlined(motor.halts), inlined(motor.speed_factor)
ITERATIONS = 3  # of the implicit midpoint rule; each gains the factor of the turn in a step


@kernel
def engage(shapes: Shapes, bodies: Bodies, motors: Motoring) -> None:
    """Start all motors at the present angles, without torque; `motors` and `bodies.rate` are written."""
    for i in range(bodies.position.shape[0]):
        if not shapes.hinged[bodies.shape[i]]:
            continue
        lay_out_at(planar_at(shapes, bodies.shape[i]), bodies.alpha[i, 0], bodies.alpha[i, 1], bodies.plane[i])
        turn_axes(bodies, i)
        p1, p2 = momenta(bodies.plane[i], along_normal(bodies, i), 0.0, 0.0)
        motors.momentum[i, 0], motors.momentum[i, 1] = p1, p2
        for k in range(2):
            alpha = bodies.alpha[i, k]
            bodies.rate[i, k] = 0.0
            motors.command[i, k] = motors.schedule[i, k] = motors.begun[i, k] = alpha
            motors.torque[i, k] = motors.impulse[i, k] = 0.0
            motors.halted[i, k] = False
    motors.elapsed[0] = 0.0


@kernel
def release(shapes: Shapes, bodies: Bodies, motors: Motoring) -> float:
    """Stop all barbs, which makes smarticles rigid; `bodies.rate` is written, and `motors` as by `note`.

    Returns:
        Lost kinetic energy of the links' relative motion [J].
    """
    lost = 0.0
    note(shapes, bodies, motors)
    for i in range(bodies.position.shape[0]):
        if not shapes.hinged[bodies.shape[i]]:
            continue
        row, normal = bodies.plane[i], along_normal(bodies, i)
        p1, p2 = momenta(row, normal, bodies.rate[i, 0], bodies.rate[i, 1])
        q1, q2 = momenta(row, normal, 0.0, 0.0)
        lost += 0.5 * (bodies.rate[i, 0] * (p1 - q1) + bodies.rate[i, 1] * (p2 - q2))
        bodies.rate[i, 0] = bodies.rate[i, 1] = 0.0
    return lost


@kernel
def note(shapes: Shapes, bodies: Bodies, motors: Motoring) -> None:
    """Compute torques and work since the last control update; `motors` and `bodies.axes` are written."""
    _note(shapes, bodies, motors)


@inlined
def _note(shapes: Shapes, bodies: Bodies, motors: Motoring) -> None:
    elapsed = motors.elapsed[0]
    for i in range(bodies.position.shape[0]):
        if not shapes.hinged[bodies.shape[i]]:
            continue
        row = bodies.plane[i]
        turn_axes(bodies, i)
        normal = along_normal(bodies, i)
        if motors.law >= SLIP:
            bodies.rate[i, 0], bodies.rate[i, 1] = rates(row, normal, motors.momentum[i, 0], motors.momentum[i, 1])
        p = momenta(row, normal, bodies.rate[i, 0], bodies.rate[i, 1])
        for k in range(2):
            if elapsed > 0.0:
                impulse = motors.impulse[i, k]
                if motors.law < SLIP:
                    impulse = p[k] - motors.momentum[i, k] - impulse
                    motors.work[i, k] += impulse * (bodies.alpha[i, k] - motors.begun[i, k]) / elapsed
                motors.torque[i, k] = impulse / elapsed
            motors.impulse[i, k] = 0.0
            motors.begun[i, k] = bodies.alpha[i, k]
            if motors.law < SLIP:
                motors.momentum[i, k] = p[k]
    motors.elapsed[0] = 0.0


@kernel
def work_so_far(shapes: Shapes, bodies: Bodies, motors: Motoring) -> float:
    """Return the work of all motors up to now [J]; only `bodies.axes` is written."""
    total = 0.0
    for i in range(bodies.position.shape[0]):
        if not shapes.hinged[bodies.shape[i]]:
            continue
        row = bodies.plane[i]
        turn_axes(bodies, i)
        p = momenta(row, along_normal(bodies, i), bodies.rate[i, 0], bodies.rate[i, 1])
        for k in range(2):
            total += motors.work[i, k]
            if motors.law < SLIP and motors.elapsed[0] > 0.0:
                impulse = p[k] - motors.momentum[i, k] - motors.impulse[i, k]
                total += impulse * (bodies.alpha[i, k] - motors.begun[i, k]) / motors.elapsed[0]
    return total


@part
def update(shapes: Shapes, bodies: Bodies, motors: Motoring) -> None:
    """Make a control update: compute rates or commands for the control period that begins.

    The targets are the row of `motors.targets` that is due; after the last row this row is used again.

    Args:
        bodies: the smarticles; `rate` is written.
        motors: the motors; written.
    """
    now, interval = min(motors.due[0], motors.targets.shape[0] - 1), motors.interval
    motors.due[0], motors.due[1] = now + 1, motors.period
    _note(shapes, bodies, motors)
    for i in range(bodies.position.shape[0]):
        if not shapes.hinged[bodies.shape[i]]:
            continue
        r1, r2 = bodies.rate[i, 0], bodies.rate[i, 1]
        for k in range(2):
            target = motors.targets[now, i, k]
            if motors.law >= SLIP:
                most = motors.speed * interval
                motors.command[i, k] += min(most, max(-most, target - motors.command[i, k]))
                motors.halted[i, k] = abs(motors.torque[i, k]) >= motors.limit[i, k] * (1 - 1e-9)
            else:
                bodies.rate[i, k] = _prescribed(bodies, motors, i, k, target, interval)
                motors.command[i, k] = bodies.alpha[i, k] + bodies.rate[i, k] * interval
            motors.schedule[i, k] = target
        if motors.law < SLIP:
            row, normal = bodies.plane[i], along_normal(bodies, i)
            p = momenta(row, normal, bodies.rate[i, 0], bodies.rate[i, 1])
            motors.jump[i, 0] += bodies.rate[i, 0] - r1
            motors.jump[i, 1] += bodies.rate[i, 1] - r2
            motors.work[i, 0] += 0.5 * (r1 + bodies.rate[i, 0]) * (p[0] - motors.momentum[i, 0])
            motors.work[i, 1] += 0.5 * (r2 + bodies.rate[i, 1]) * (p[1] - motors.momentum[i, 1])
            motors.momentum[i, 0], motors.momentum[i, 1] = p[0], p[1]


@inlined
def _prescribed(bodies: Bodies, motors: Motoring, i: int, k: int, target: float, interval: float) -> float:
    """Return the rate of an angle [rad/s] in the control period that begins: laws halt, stall and ease.

    `halted` and `over` of `motors` are written.

    Args:
        i: number of the smarticle.
        k: 0 for barb 1, 1 for barb 2.
        target: scheduled angle at the end of the period [rad].
        interval: length of the period [s].
    """
    before, most = bodies.rate[i, k], motors.acceleration[i, k]
    behind = motors.schedule[i, k] - bodies.alpha[i, k]
    # Catch up as fast as can be braked in time; what the schedule does meanwhile comes on top.
    catch_up = min(abs(behind) / interval, math.sqrt(2 * BRAKING * most * abs(behind)))
    rate = (target - motors.schedule[i, k]) / interval + math.copysign(catch_up, behind)
    torque = motors.torque[i, k]
    over = abs(torque) >= motors.limit[i, k]
    motors.over[i] = motors.over[i] + 1 if over else 0
    speed = motors.speed * _speed_factor(motors.law, over)
    rate = min(speed, max(-speed, rate))
    rate = min(before + most * interval, max(before - most * interval, rate))
    halted = _halts(motors.law, over, rate, torque, motors.over[i])
    motors.halted[i, k] = halted
    return 0.0 if halted else rate


@inlined
def contact_torques(planar: Planar, bodies: Bodies, parts: Parts, i: int) -> tuple[float, float]:
    """Return the generalised forces of contacts on both angles of smarticle `i` [N m].

    Forces on all links contribute: when an angle changes, all links move, since the centre of mass stays.
    """
    row, share, first = bodies.plane[i], planar.barb_mass / planar.mass, parts.begin[i]
    fx, fy, _ = turned_back(bodies, i, vector(bodies.load[i], 0))
    return (
        -_about_hinge(bodies, parts, i, first, -planar.half - row[0], -row[1]) - share * (row[6] * fx + row[7] * fy),
        _about_hinge(bodies, parts, i, first + 2, planar.half - row[0], -row[1]) - share * (row[8] * fx + row[9] * fy),
    )


@inlined
def _about_hinge(bodies: Bodies, parts: Parts, i: int, row: int, x: float, y: float) -> float:
    """Return the torque of contacts on a barb about its hinge, along the normal [N m].

    Args:
        row: number of the barb's part.
        x: position of the hinge from the centre of mass, in the frame of the body [m].
        y: position of the hinge from the centre of mass, in the frame of the body [m].
    """
    fx, fy, _ = turned_back(bodies, i, vector(parts.load[row], 0))
    _, _, torque = turned_back(bodies, i, vector(parts.load[row], 3))
    return float(torque - (x * fy - y * fx))


@inlined
def free_torques(bodies: Bodies, motors: Motoring, i: int, r1: float, r2: float, dt: float) -> tuple[float, float]:
    """Return the torques of both motors of smarticle `i` under the laws slip and servo [N m].

    The equations are implicit: torques depend on the rates after the step, which the torques change.

    Args:
        bodies: the smarticles; `rate` is that before the step.
        r1: rate that angle 1 would have after the step without motors [rad/s].
        r2: rate that angle 2 would have after the step without motors [rad/s].
        dt: time step [s].
    """
    m1, m2, m12 = mobility(bodies.plane[i])
    # The spring at the mean of the angles half a step before and after, which keeps its energy; the damper after.
    gain1, gain2 = 0.25 * dt * motors.stiffness[i, 0], 0.25 * dt * motors.stiffness[i, 1]
    free1 = motors.stiffness[i, 0] * (motors.command[i, 0] - bodies.alpha[i, 0]) + gain1 * bodies.rate[i, 0]
    free2 = motors.stiffness[i, 1] * (motors.command[i, 1] - bodies.alpha[i, 1]) + gain2 * bodies.rate[i, 1]
    gain1, gain2 = gain1 + motors.damping, gain2 + motors.damping
    free1, free2 = free1 - gain1 * r1, free2 - gain2 * r2
    # τ = free - gain dt M τ: 2 × 2, then one at its cap, then both.
    a, b, c, d = 1 + gain1 * dt * m1, gain1 * dt * m12, gain2 * dt * m12, 1 + gain2 * dt * m2
    determinant = a * d - b * c
    most1, most2 = motors.limit[i, 0], motors.limit[i, 1]
    t1, t2 = (d * free1 - b * free2) / determinant, (a * free2 - c * free1) / determinant
    over1, over2 = abs(t1) > most1, abs(t2) > most2
    if over1:
        t1 = math.copysign(most1, t1)
        t2 = (free2 - c * t1) / d
    if over2 or abs(t2) > most2:
        t2 = math.copysign(most2, t2)
        if not over1:
            t1 = (free1 - b * t2) / a
            t1 = min(most1, max(-most1, t1))
    return t1, t2


@inlined
def middle_of_step(
    planar: Planar, bodies: Bodies, motors: Motoring, i: int, dt: float, row: Array
) -> tuple[float, float, float]:
    """Change the angles of smarticle `i` by a step at constant momentum, by the implicit midpoint rule.

    Args:
        bodies: the smarticles; `alpha` and `plane` are written, and for free angles `rate`.
        motors: `impulse` is written, for free angles `momentum` instead.
        dt: time step [s].
        row: (PLANE,) scratch.

    Returns:
        Angular velocity at the middle of the step, in the middle link's axes [rad/s].
    """
    l0, l1, l2 = turned_back(bodies, i, vector(bodies.momentum[i], 0))
    free = motors.law >= SLIP
    r1, r2 = bodies.rate[i, 0], bodies.rate[i, 1]
    p1, p2 = motors.momentum[i, 0], motors.momentum[i, 1]
    half, x, y, z = 0.5 * dt, l0, l1, l2
    lay_out_near(planar, half * r1, half * r2, bodies.plane[i], row)
    if not free:
        flat, normal = inverses(row)
        internal = row[18] * r1 + row[19] * r2
        for _ in range(ITERATIONS):
            wx, wy, wz = spin_by(row, flat, normal, x, y, z, internal)
            x, y, z = l0 + half * (y * wz - z * wy), l1 + half * (z * wx - x * wz), l2 + half * (x * wy - y * wx)
        wx, wy, wz = spin_by(row, flat, normal, x, y, z, internal)
        motors.impulse[i, 0] += dt * lagrange_force(planar, row, 0, wx, wy, wz, r1, r2)
        motors.impulse[i, 1] += dt * lagrange_force(planar, row, 1, wx, wy, wz, r1, r2)
    else:
        g1, g2 = 0.0, 0.0
        for turn in range(ITERATIONS):
            if turn:
                lay_out_near(planar, half * r1, half * r2, bodies.plane[i], row)
            r1, r2 = rates(row, z, p1 + half * g1, p2 + half * g2)
            wx, wy, wz = spin_of(row, x, y, z, row[18] * r1 + row[19] * r2)
            g1, g2 = (
                lagrange_force(planar, row, 0, wx, wy, wz, r1, r2),
                lagrange_force(planar, row, 1, wx, wy, wz, r1, r2),
            )
            x, y, z = l0 + half * (y * wz - z * wy), l1 + half * (z * wx - x * wz), l2 + half * (x * wy - y * wx)
        wx, wy, wz = spin_of(row, x, y, z, row[18] * r1 + row[19] * r2)
        bodies.rate[i, 0], bodies.rate[i, 1] = r1, r2
        motors.momentum[i, 0] = p1 + dt * g1
        motors.momentum[i, 1] = p2 + dt * g2
    if r1 != 0.0 or r2 != 0.0:
        bodies.alpha[i, 0] += dt * r1
        bodies.alpha[i, 1] += dt * r2
        lay_out_at(planar, bodies.alpha[i, 0], bodies.alpha[i, 1], bodies.plane[i])
    return wx, wy, wz
