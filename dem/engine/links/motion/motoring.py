"""Kernels of the motors: control updates, and the torques of shafts on the angles.

A motor turns one end of its shaft to the command at constant speed in each control period, and the barb is at the
other end. So barbs turn freely against a spring, and the momentum p conjugate to an angle (see `planar`) is part of
the state. The torque τ is that of a spring, and of a damper if there is one, between angle and command. The laws slip
and servo cap τ at τ_max. Under halt, stall and ease the command stops while τ is at τ_max or above; τ can exceed τ_max
by stiffness × speed × control period, however stiff contacts are. A command that jumped at each control update would
set stiff shafts ringing. The spring takes the mean of the angles half a step before and half a step after, the damper
takes the rate after the step, so that both are stable at any stiffness and damping.

The work of the motors and the change of kinetic energy agree to second order in the time step, and exactly in kicks.
"""

from __future__ import annotations

import math

from dem.engine.links.arrays import Array, Bodies, Motoring, Parts
from dem.engine.links.compiler import inlined, kernel, part
from dem.engine.links.motion.planar import (
    lagrange_force,
    lay_out_at,
    lay_out_near,
    momenta,
    planar_at,
    rates,
    spin_of,
)
from dem.engine.links.motion.poses import along_normal, turn_axes
from dem.engine.links.shapes import Planar, Shapes
from dem.engine.links.vectors import turned_back, vector
from dem.physics import motor
from dem.physics.motor import SLIP

_halts, _speed_factor = inlined(motor.halts), inlined(motor.speed_factor)
ITERATIONS = 3  # of the implicit midpoint rule; each gains the factor of the turn in a step
HINGED_ITERATIONS = 2  # two leave 7e-6 of the energy that a free gait exchanges, three 2e-6


@kernel
def engage(shapes: Shapes, bodies: Bodies, motors: Motoring) -> None:
    """Start all motors with commands at the present angles; `motors` and `bodies.rate` are written."""
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
            motors.command[i, k] = motors.schedule[i, k] = alpha
            motors.pace[i, k] = motors.torque[i, k] = motors.impulse[i, k] = 0.0
            motors.halted[i, k] = False
    motors.elapsed[0] = 0.0


@kernel
def release(shapes: Shapes, bodies: Bodies, motors: Motoring) -> float:
    """Stop all barbs, which makes smarticles rigid; `bodies.rate`, `bodies.axes` and `motors` are written.

    Returns:
        Kinetic energy of the links' relative motion, which is lost [J].
    """
    lost = 0.0
    for i in range(bodies.position.shape[0]):
        if not shapes.hinged[bodies.shape[i]]:
            continue
        _average(motors, i)
        turn_axes(bodies, i)
        row, normal = bodies.plane[i], along_normal(bodies, i)
        r1, r2 = rates(row, normal, motors.momentum[i, 0], motors.momentum[i, 1])
        p1, p2 = momenta(row, normal, r1, r2)
        q1, q2 = momenta(row, normal, 0.0, 0.0)
        lost += 0.5 * (r1 * (p1 - q1) + r2 * (p2 - q2))
        bodies.rate[i, 0] = bodies.rate[i, 1] = 0.0
    motors.elapsed[0] = 0.0
    return lost


@inlined
def _average(motors: Motoring, i: int) -> None:
    """Write the mean torques of smarticle `i` since the last control update, and reset their integrals."""
    for k in range(2):
        if motors.elapsed[0] > 0.0:
            motors.torque[i, k] = motors.impulse[i, k] / motors.elapsed[0]
        motors.impulse[i, k] = 0.0


@part
def update(shapes: Shapes, bodies: Bodies, motors: Motoring) -> None:
    """Make a control update: compute commands for the control period that begins.

    Targets are the row of `motors.targets` that is due; after the last row, the last row is used again.

    Args:
        motors: the motors, whose commands, torques and counters are written.
    """
    now, interval = min(motors.due[0], motors.targets.shape[0] - 1), motors.interval
    motors.due[0], motors.due[1] = now + 1, motors.period
    for i in range(bodies.position.shape[0]):
        if not shapes.hinged[bodies.shape[i]]:
            continue
        _average(motors, i)
        for k in range(2):
            target, torque = motors.targets[now, i, k], motors.torque[i, k]
            over = abs(torque) >= motors.limit[i, k] * (1 - 1e-9)
            motors.over[i] = motors.over[i] + 1 if over else 0
            most = motors.speed * interval * _speed_factor(motors.law, over)
            advance = min(most, max(-most, target - motors.command[i, k]))
            motors.halted[i, k] = _halts(motors.law, over, advance, torque, motors.over[i])
            if motors.law < SLIP and motors.halted[i, k]:
                advance = 0.0
            motors.command[i, k] += advance
            motors.pace[i, k] = advance / interval
            motors.schedule[i, k] = target
    motors.elapsed[0] = 0.0


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
    """Return the torques of both motors of smarticle `i` [N m].

    The equations are implicit: torques depend on rates after the step, and these rates depend on the torques.

    Args:
        bodies: the smarticles, with `rate` before the step.
        r1: rate that angle 1 would have after the step without motors [rad/s].
        r2: rate that angle 2 would have after the step without motors [rad/s].
        dt: time step [s].
    """
    row = bodies.plane[i]
    m1, m2, m12 = row[24], row[25], row[26]
    left = max(0.0, motors.interval - motors.elapsed[0])
    command1 = motors.command[i, 0] - left * motors.pace[i, 0]
    command2 = motors.command[i, 1] - left * motors.pace[i, 1]
    # The spring at the mean of the angles half a step before and after, which keeps its energy; the damper after.
    gain1, gain2 = 0.25 * dt * motors.stiffness[i, 0], 0.25 * dt * motors.stiffness[i, 1]
    free1 = motors.stiffness[i, 0] * (command1 - bodies.alpha[i, 0]) + gain1 * bodies.rate[i, 0]
    free2 = motors.stiffness[i, 1] * (command2 - bodies.alpha[i, 1]) + gain2 * bodies.rate[i, 1]
    gain1, gain2 = gain1 + motors.damping, gain2 + motors.damping
    free1, free2 = free1 - gain1 * r1, free2 - gain2 * r2
    if motors.law < SLIP:  # the damper of a shaft sits between motor and barb, that of a servo brakes the barb
        free1 += motors.damping * motors.pace[i, 0]
        free2 += motors.damping * motors.pace[i, 1]
    # τ = free - gain dt M τ: 2 × 2, then one at its cap, then both.
    a, b, c, d = 1 + gain1 * dt * m1, gain1 * dt * m12, gain2 * dt * m12, 1 + gain2 * dt * m2
    determinant = a * d - b * c
    if motors.law < SLIP:
        return (d * free1 - b * free2) / determinant, (a * free2 - c * free1) / determinant
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
        bodies: the smarticles; `alpha`, `plane` and `rate` are written.
        motors: `momentum` is written.
        dt: time step [s].
        row: (PLANE,) scratch.

    Returns:
        Angular velocity at the middle of the step, in the middle link's axes [rad/s].
    """
    l0, l1, l2 = turned_back(bodies, i, vector(bodies.momentum[i], 0))
    r1, r2 = bodies.rate[i, 0], bodies.rate[i, 1]
    p1, p2 = motors.momentum[i, 0], motors.momentum[i, 1]
    half, x, y, z = 0.5 * dt, l0, l1, l2
    lay_out_near(planar, half * r1, half * r2, bodies.plane[i], row)
    g1, g2 = 0.0, 0.0
    for turn in range(HINGED_ITERATIONS):
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
