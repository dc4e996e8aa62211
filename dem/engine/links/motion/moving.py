"""Move the bodies by one step: a kick changes momenta, then a drift moves and turns all bodies.

The scheme is leapfrog: momenta are at the middles of steps, positions at their ends. Between kicks a body keeps its
angular momentum L in the laboratory exactly. It turns by the implicit midpoint rule for L' = L × ω in the body frame,
which conserves L² and the kinetic energy L·I⁻¹L/2, since both are quadratic. The rotation matrix is Cayley's, which
turns L in the body frame by this rule.
"""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Array, Bodies, Parts, Segments
from dem.engine.links.compiler import inlined, part
from dem.engine.links.contact.barrier import LONGEST, STRIDE, Step
from dem.engine.links.contact.pairs import velocity_at
from dem.engine.links.motion.holding import is_held
from dem.engine.links.motion.motoring import ITERATIONS, contact_torques, free_torques, middle_of_step
from dem.engine.links.motion.planar import planar_at, rates, spin_of
from dem.engine.links.motion.poses import along_normal
from dem.engine.links.shapes import Shapes, is_flexible
from dem.engine.links.vectors import along, dot, turned_back, vector


@inlined
def gather(bodies: Bodies, parts: Parts) -> None:
    """Write the sum of the loads on each body's parts into `bodies.load`."""
    for i in range(bodies.position.shape[0]):
        for d in range(6):
            bodies.load[i, d] = 0.0
        for row in range(parts.begin[i], parts.begin[i + 1]):
            for d in range(6):
                bodies.load[i, d] += parts.load[row, d]


@part
def kick(
    shapes: Shapes, bodies: Bodies, parts: Parts, motors: Any, gravity: float, planar: bool, dt: float, grips: Any
) -> None:
    """Change momenta of bodies that no grip holds by the forces in `load`, by weight and by motors.

    Args:
        bodies: `velocity` and `momentum` are written.
        parts: the parts, with loads; loads on barbs change their angles.
        motors: the motors, of which `impulse`, `momentum` and `work` are written; None while smarticles are welded.
        gravity: g [m/s²].
        planar: whether bodies move only in the xy plane and turn only about z, without weight.
        dt: time for which the forces act [s]: half of the last and half of the next sub-step.
        grips: the grips; None where there are none.
    """
    velocity, momentum, load, across = bodies.velocity, bodies.momentum, bodies.load, 0.0 if planar else 1.0
    for i in range(velocity.shape[0]):
        if is_flexible(shapes.flexible, bodies.shape[i]) or is_held(grips, i):
            continue
        share = dt / shapes.mass[bodies.shape[i]]
        velocity[i, 0] += share * load[i, 0]
        velocity[i, 1] += share * load[i, 1]
        velocity[i, 2] += across * (share * load[i, 2] - dt * gravity)
        momentum[i, 0] += across * dt * load[i, 3]
        momentum[i, 1] += across * dt * load[i, 4]
        momentum[i, 2] += dt * load[i, 5]
        if motors is not None and shapes.hinged[bodies.shape[i]]:
            q1, q2 = contact_torques(planar_at(shapes, bodies.shape[i]), bodies, parts, i)
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
def resolve_speeds(
    shapes: Shapes, bodies: Bodies, parts: Parts, segments: Segments, gravity: float, step: Step, grips: Any
) -> None:
    """Increase `step.need` if a segment could enter another segment too deeply within a time step.

    Args:
        bodies: the bodies, with the present forces in `load`.
        gravity: g [m/s²].
        step: `need` is increased.
        grips: the grips, whose forces do not move the bodies that they hold; None if there are no grips.
    """
    velocity, spin, load = bodies.velocity, bodies.spin, bodies.load
    for i in range(velocity.shape[0]):
        k = bodies.shape[i]
        if is_flexible(shapes.flexible, k) or is_held(grips, i):
            continue
        limit, reach, per_force = LONGEST * shapes.radius[k], shapes.reach[k], step.whole / shapes.mass[k]
        gain = per_force * per_force * (load[i, 0] ** 2 + load[i, 1] ** 2 + load[i, 2] ** 2)
        speed = velocity[i, 0] ** 2 + velocity[i, 1] ** 2 + velocity[i, 2] ** 2
        turning = reach * reach * (spin[i, 0] ** 2 + spin[i, 1] ** 2 + spin[i, 2] ** 2)
        # A sum of three is at most the root of three times their squares: most are slow, and need no root.
        if (gain + speed + turning) * (3.0 * step.whole * step.whole) > limit * limit:
            stride = step.whole * (_fastest_end(parts, segments, i) + math.sqrt(gain) + step.whole * gravity)
            if stride > limit:
                step.need[0] = max(step.need[0], stride / (STRIDE * shapes.radius[k]))


@part
def _fastest_end(parts: Parts, segments: Segments, i: int) -> float:
    """Return the greatest speed of an end of an axis of body `i` [m/s] at the beginning of the step.

    The rotation of a link about its own axis does not count, since it moves no end.
    """
    most = 0.0
    for p in range(segments.begin[i], segments.begin[i + 1]):
        for end in range(2):
            place = along(vector(segments.line[p], 0), end, vector(segments.line[p], 3))
            velocity = velocity_at(parts, segments.part[p], place)
            most = max(most, dot(velocity, velocity))
    return math.sqrt(most)


@part
def drift(shapes: Shapes, bodies: Bodies, motors: Any, dt: float, row: Array) -> None:
    """Move and turn all bodies by a step.

    Args:
        bodies: `position` and `turn` are written, while articulated also `alpha`, `plane` and `rate`.
        motors: the motors; None while smarticles are welded.
        dt: time step [s].
        row: (PLANE,) scratch.
    """
    position, velocity, turn = bodies.position, bodies.velocity, bodies.turn
    for i in range(position.shape[0]):
        if is_flexible(shapes.flexible, bodies.shape[i]):
            continue
        for d in range(3):
            position[i, d] += dt * velocity[i, d]
        if motors is not None and shapes.hinged[bodies.shape[i]]:
            wx, wy, wz = middle_of_step(planar_at(shapes, bodies.shape[i]), bodies, motors, i, dt, row)
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
    """Return the angular velocity of rigid body `i` at the middle of the step, in its own frame [rad/s]."""
    row, half = bodies.plane[i], 0.5 * dt
    l0, l1, l2 = turned_back(bodies, i, vector(bodies.momentum[i], 0))
    x, y, z = l0, l1, l2
    for _ in range(ITERATIONS):
        wx, wy, wz = spin_of(row, x, y, z, 0.0)
        x, y, z = l0 + half * (y * wz - z * wy), l1 + half * (z * wx - x * wz), l2 + half * (x * wy - y * wx)
    return spin_of(row, x, y, z, 0.0)
