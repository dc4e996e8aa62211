"""Motion of linkages: rigid links, springs that keep their joints together, and laws of the joints.

Links are moved by the kernels of rigid bodies. A joint adds to the loads of both links

- a pin: a spring and a dashpot between the ends of the links. Their force acts at one point on both links;
- a spring and a dashpot against rotations about all directions that are no axes, see `joints.pins_of`;
- the torque τ of the joint's law about each axis. The angle θ about an axis is that of d, a direction of the link
  after, from u towards w; u and w are fixed in the link before, across the axis. A small rotation δφ of the link after
  changes θ by g·δφ, with g = d × (c w - s u)/(c² + s²), c = d·u, s = d·w. So τ g on the link after and -τ g on the link
  before do the work τ dθ, also if the axes of both links are not quite parallel.

Forces and torques come in pairs, so that momentum and angular momentum are kept to rounding. Springs are derivatives of
energies, so that leapfrog keeps the energy of passive joints up to an oscillation that falls with the square of the
step.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from dem.engine.links.arrays import Array, Bodies, Linkages
from dem.engine.links.compiler import inlined, kernel, part
from dem.engine.links.contact.barrier import Step
from dem.engine.links.contact.pairs import velocity_at
from dem.engine.links.motion.bending import ACTIVE, DAMPED, FACTOR, GRIPPED, PSI, turn_wave
from dem.engine.links.motion.moving import drift, gather, kick, resolve_speeds
from dem.engine.links.motion.planar import direction
from dem.engine.links.motion.poses import find_motions, pose
from dem.engine.links.vectors import Vector, add, along, cross, dot, moving, put, put_more, scale, sub, turned, vector

FREE, ELASTIC, MOTOR, NONE = range(4)  # laws; NONE: there is no joint after the last link
# Columns of a joint: distances of the pin from the middles of the links before and after [m]; stiffness [N/m] and
# damping [N s/m] of the pin; both against rotations about directions that are no axes [N m/rad, N m s/rad];
# stiffness [N m/rad] and damping [N m s/rad] of the law; torque at which it yields, or limit of a motor, and moment at
# which it breaks [N m]; greatest speed of a command [rad/s]; first axis, and the second one or one across [1].
BEFORE, AFTER, PIN, PIN_DAMPING, OFF, OFF_DAMPING, STIFFNESS, DAMPING, MOST, BREAKS, SPEED = range(11)
AXIS, ACROSS, JOINT = 11, 14, 17
# Columns of a swing: angle at the start, centre and amplitude [rad], cosine and sine of the phase.
QUIET, CENTRE, AMPLITUDE, COSINE, SINE, SWING = range(6)
# Columns of `lost`, from which work and dissipation follow: force of the pin's dashpot [N] and where it acts [m],
# torques of dashpots and of motors [N m], power of dashpots and of motors before the kick [W].
RESISTING, PLACE, RESISTING_TORQUE, MOTOR_TORQUE, RESISTING_POWER, MOTOR_POWER, LOST = 0, 3, 6, 9, 12, 13, 14

Quaternion = tuple[float, float, float, float]


# -- from links to segments --------------------------------------------------------------------------------------


@part
def pose_linkages(linkages: Any) -> None:
    """Compute positions and motion of linkages, and of their parts and segments, from the links.

    Args:
        linkages: `position` and `velocity` of `bodies`, `motion` of `parts`, `line` and `bends.ends` of `segments` are
            written.
    """
    if linkages is None:
        return
    links, shapes, bodies = linkages.links, linkages.shapes, linkages.bodies
    parts, segments = linkages.parts, linkages.segments
    pose(shapes, links, linkages.parts, linkages.segments, None)
    for f in range(linkages.body.shape[0]):
        place, velocity, mass = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        for i in range(linkages.begin[f], linkages.begin[f + 1]):
            own, start = shapes.mass[links.shape[i]], vector(segments.line[i], 0)
            place = along(place, own, vector(links.position[i], 0))
            velocity = along(velocity, own, vector(links.velocity[i], 0))
            mass += own
            put(segments.bends.ends[i], 0, velocity_at(parts, i, start))
            put(segments.bends.ends[i], 3, velocity_at(parts, i, add(start, vector(segments.line[i], 3))))
        put(bodies.position[linkages.body[f]], 0, scale(1 / mass, place))
        put(bodies.velocity[linkages.body[f]], 0, scale(1 / mass, velocity))


@kernel
def pose_linkages_from_python(linkages: Linkages) -> None:
    """Do what `pose_linkages` does, for calls from Python."""
    pose_linkages(linkages)


# -- rotations ---------------------------------------------------------------------------------------------------


@inlined
def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation b followed by a, as a quaternion (w, x, y, z)."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@inlined
def _inverse(a: Quaternion) -> Quaternion:
    return a[0], -a[1], -a[2], -a[3]


@inlined
def _quaternion(row: Array) -> Quaternion:
    return row[0], row[1], row[2], row[3]


@inlined
def _reversed(angles: Array) -> Vector:
    """Return the rotation vector of angles in the order of the axes z, y, x [rad]."""
    return angles[2], angles[1], angles[0]


@inlined
def _vector_of(a: Quaternion) -> Vector:
    """Return the rotation vector of a unit quaternion, of up to half a turn [rad]."""
    sign = 1.0 if a[0] >= 0.0 else -1.0
    half = math.sqrt(a[1] * a[1] + a[2] * a[2] + a[3] * a[3])
    factor = 2 * math.atan2(half, sign * a[0]) / half if half > 0.0 else 2.0
    return sign * factor * a[1], sign * factor * a[2], sign * factor * a[3]


@inlined
def _rotation_by(v: Vector) -> Quaternion:
    """Return the unit quaternion of a rotation vector [rad]."""
    size = math.sqrt(dot(v, v))
    c, s = direction(0.5 * size)
    s = s / size if size > 0.0 else 0.5
    return c, s * v[0], s * v[1], s * v[2]


@inlined
def _wrapped(angle: float) -> float:
    """Return an angle of up to half a turn [rad]."""
    return angle - 2 * math.pi * math.floor(angle / (2 * math.pi) + 0.5)


@inlined
def _angle(d: Vector, u: Vector, w: Vector) -> tuple[float, Vector]:
    """Return the angle from u towards w of d's projection on their plane [rad], and its gradient [1].

    The change of the angle in a small rotation of d is the gradient times this rotation. u and w are perpendicular unit
    vectors.
    """
    c, s = dot(d, u), dot(d, w)
    return math.atan2(s, c), scale(1 / (c * c + s * s), cross(d, sub(scale(c, w), scale(s, u))))


class Turn(NamedTuple):
    """Rotation of the link after a joint with one or two axes against the link before."""

    #: How far the joint is off its axes [1]: with two axes the cosine of the angle between them; with one axis 1 less
    #: the cosine of the angle between the axis of the link before and that of the link after
    off: float
    across: Vector  #: Axis of the torque that restores the axes, times the sine of the angle in `off` [1]
    one: float  #: Angle about the first axis [rad]
    two: float  #: Angle about the second axis [rad]; 0 if there is one axis
    first: Vector  #: Gradient of the first angle by a rotation of the link after [1]
    second: Vector  #: Gradient of the second angle by a rotation of the link after [1]


@inlined
def _turn(linkages: Linkages, j: int) -> Turn:
    """Return the rotation at a joint with one or two axes."""
    row, links = linkages.row[j], linkages.links
    a1, u1 = turned(links, j, *vector(row, AXIS)), turned(links, j, *vector(row, ACROSS))
    a2, u2 = turned(links, j + 1, *vector(row, AXIS)), turned(links, j + 1, *vector(row, ACROSS))
    w1 = cross(a1, u1)
    angle, first = _angle(u2, u1, w1)
    if linkages.axes[j] == 1:
        return Turn(1 - dot(a1, a2), cross(a2, a1), angle, 0.0, first, (0.0, 0.0, 0.0))
    # The second axis is fixed in the link after; seen from there the first one turns the other way.
    other, second = _angle(a1, a2, cross(u2, a2))
    return Turn(dot(a1, u2), cross(u2, a1), angle, -other, first, second)


@inlined
def _rotation(linkages: Linkages, j: int) -> Quaternion:
    """Return the rotation of the link after against the link before, in the frame of the link before."""
    turn = linkages.links.turn
    return _product(_inverse(_quaternion(turn[j])), _quaternion(turn[j + 1]))


@inlined
def _gap(linkages: Linkages, j: int) -> tuple[Vector, Vector]:
    """Return the place of a joint and its gap [m].

    The place is the middle between both ends, the gap the end of the link after less that of the link before.
    """
    row, axes, position = linkages.row[j], linkages.links.axes, linkages.links.position
    x1 = axes[j, 0, 0], axes[j, 1, 0], axes[j, 2, 0]
    x2 = axes[j + 1, 0, 0], axes[j + 1, 1, 0], axes[j + 1, 2, 0]
    one, two = along(vector(position[j], 0), row[BEFORE], x1), along(vector(position[j + 1], 0), -row[AFTER], x2)
    return scale(0.5, add(one, two)), sub(two, one)


@inlined
def _stored(linkages: Linkages, j: int) -> tuple[float, float, float]:
    """Return the energies of a joint's pin, elastic law, and directions in which links cannot turn [J]."""
    row, law, elastic, off = linkages.row[j], linkages.law[j], 0.0, 0.0
    _, gap = _gap(linkages, j)
    if linkages.axes[j] < 3:
        turn = _turn(linkages, j)
        off = turn.off if linkages.axes[j] == 1 else 0.5 * turn.off * turn.off
        one, two = _wrapped(turn.one - linkages.rest[j, 0]), _wrapped(turn.two - linkages.rest[j, 1])
        elastic = one * one + (two * two if linkages.axes[j] == 2 else 0.0)
    else:
        e = _vector_of(_product(_rotation(linkages, j), _inverse(_quaternion(linkages.rest[j]))))
        elastic = dot(e, e)
    if law != ELASTIC:
        elastic = 0.0
    return 0.5 * row[PIN] * dot(gap, gap), 0.5 * row[STIFFNESS] * elastic, row[OFF] * off


# -- forces ------------------------------------------------------------------------------------------------------


@inlined
def _follow(linkages: Linkages, j: int, axis: int, wave: Vector, past: float) -> tuple[float, float]:
    """Move a motor's command towards its schedule; return the command [rad] and its rate [rad/s].

    Args:
        wave: cosine and sine of the wave's angle ψ, and the factor on the swing, below 1 in a ramp.
        past: length of the last step [s].
    """
    swing, (c, s, factor) = linkages.swing[j, axis], wave
    there = swing[CENTRE] - swing[QUIET] + swing[AMPLITUDE] * (s * swing[COSINE] + c * swing[SINE])
    most, before = linkages.row[j, SPEED] * past, linkages.command[j, axis]
    change = min(most, max(-most, swing[QUIET] + factor * there - before))
    linkages.command[j, axis] = before + change
    return before + change, change / past


@inlined
def _bend(
    linkages: Linkages, j: int, axis: int, angle: float, rate: float, wave: Vector, past: float
) -> tuple[float, float, float]:
    """Return the torques of spring, dashpot and motor about an axis [N m]; springs yield at their limit.

    Args:
        angle: present angle about the axis [rad].
        rate: rate of this angle [rad/s].
        wave: cosine and sine of ψ, and the factor on the swing.
        past: time since the last step [s].
    """
    row, law = linkages.row[j], linkages.law[j]
    stiffness, most, spring, resisting, motor = row[STIFFNESS], row[MOST], 0.0, 0.0, 0.0
    if law == ELASTIC:
        e, last = _wrapped(angle - linkages.rest[j, axis]), _wrapped(linkages.angle[j, axis] - linkages.rest[j, axis])
        if stiffness * abs(e) > most:
            kept = math.copysign(most / stiffness, e)
            linkages.rest[j, axis] += e - kept
            # Leapfrog does the work of the mean of the torques of both steps.
            linkages.sums[DAMPED] += 0.5 * stiffness * (last + kept) * (e - kept)
            e = kept
        spring, resisting = -stiffness * e, -row[DAMPING] * rate
    if law == MOTOR:
        command, speed = _follow(linkages, j, axis, wave, past)
        motor = stiffness * _wrapped(command - angle) + row[DAMPING] * (speed - rate)
        motor = min(most, max(-most, motor))
    linkages.angle[j, axis], linkages.torque[j, axis] = angle, spring + resisting + motor
    return spring, resisting, motor


@inlined
def _turn_any(linkages: Linkages, j: int, spin: Vector, wave: Vector, past: float) -> tuple[Vector, Vector, Vector]:
    """Return the torques of spring, dashpot and motor of a joint with three axes on the link after [N m].

    Args:
        spin: spin of the link after less that of the link before [rad/s].
        wave: cosine and sine of ψ, and the factor on the swing.
        past: time since the last step [s].
    """
    row, law, none = linkages.row[j], linkages.law[j], (0.0, 0.0, 0.0)
    rotation, before = _rotation(linkages, j), _rotation_by(_reversed(linkages.angle[j]))
    x, y, z = _vector_of(rotation)
    linkages.angle[j, 0], linkages.angle[j, 1], linkages.angle[j, 2] = z, y, x  # in the order of the axes
    stiffness, most, target = row[STIFFNESS], row[MOST], _quaternion(linkages.rest[j])
    if law == MOTOR:
        old = _rotation_by(_reversed(linkages.command[j]))
        z, _ = _follow(linkages, j, 0, wave, past)
        y, _ = _follow(linkages, j, 1, wave, past)
        x, _ = _follow(linkages, j, 2, wave, past)
        target = _rotation_by((x, y, z))
        of_command = scale(1 / past, _vector_of(_product(target, _inverse(old))))
        spin = sub(spin, turned(linkages.links, j, *of_command))
    e = _vector_of(_product(rotation, _inverse(target)))
    size = math.sqrt(dot(e, e))
    if law == ELASTIC and stiffness * size > most:
        kept, last = most / (stiffness * size), _vector_of(_product(before, _inverse(target)))
        linkages.sums[DAMPED] += 0.5 * stiffness * (1 - kept) * dot(along(last, kept, e), e)  # as about one axis
        e = scale(kept, e)
        rest, target = linkages.rest[j], _product(_inverse(_rotation_by(e)), rotation)
        rest[0], rest[1], rest[2], rest[3] = target
    spring, resisting = scale(-stiffness, turned(linkages.links, j, *e)), scale(-row[DAMPING], spin)
    total = add(spring, resisting)
    size = math.sqrt(dot(total, total))
    if law == MOTOR and size > most:
        total = scale(most / size, total)
    axes = linkages.links.axes
    for k in range(3):
        linkages.torque[j, k] = (
            axes[j, 0, 2 - k] * total[0] + axes[j, 1, 2 - k] * total[1] + axes[j, 2, 2 - k] * total[2]
        )
    if law == MOTOR:
        return none, none, total
    return spring, resisting, none


@inlined
def _moving(links: Bodies, i: int, place: Vector) -> Vector:
    """Return the velocity of a point of a link [m/s]."""
    return moving(vector(links.velocity[i], 0), vector(links.spin[i], 0), sub(place, vector(links.position[i], 0)))


@inlined
def _push_joint(linkages: Linkages, j: int, wave: Vector, past: float) -> None:
    """Add the forces and torques of a joint to the loads of both links."""
    row, links, lost, none = linkages.row[j], linkages.links, linkages.lost[j], (0.0, 0.0, 0.0)
    place, gap = _gap(linkages, j)
    velocity = sub(_moving(links, j + 1, place), _moving(links, j, place))
    spin = sub(vector(links.spin[j + 1], 0), vector(links.spin[j], 0))
    resisting = scale(-row[PIN_DAMPING], velocity)
    force = along(resisting, -row[PIN], gap)
    held, spring, damped, motor = none, none, none, none
    if linkages.axes[j] < 3:
        turn = _turn(linkages, j)
        held = scale(row[OFF] * (1.0 if linkages.axes[j] == 1 else -turn.off), turn.across)
        # Of one axis the spin across it; of two the spin across both.
        damped = along(spin, -dot(spin, turn.first) / dot(turn.first, turn.first), turn.first)
        one, resists, drives = _bend(linkages, j, 0, turn.one, dot(spin, turn.first), wave, past)
        spring, motor = scale(one, turn.first), scale(drives, turn.first)
        more = scale(resists, turn.first)
        if linkages.axes[j] == 2:
            damped = scale(dot(spin, turn.across), turn.across)
            one, resists, drives = _bend(linkages, j, 1, turn.two, dot(spin, turn.second), wave, past)
            spring, motor = along(spring, one, turn.second), along(motor, drives, turn.second)
            more = along(more, resists, turn.second)
        damped = along(more, -row[OFF_DAMPING], damped)
        held = add(held, spring)
    elif linkages.law[j] != FREE:
        held, damped, motor = _turn_any(linkages, j, spin, wave, past)
    if dot(held, held) > row[BREAKS] * row[BREAKS]:
        _, elastic, off = _stored(linkages, j)
        linkages.sums[DAMPED] += elastic + off
        linkages.axes[j], linkages.law[j], linkages.broken[j] = 3, FREE, 1
        linkages.torque[j, 0] = linkages.torque[j, 1] = linkages.torque[j, 2] = 0.0
        held, damped, motor = none, none, none
    put(lost, RESISTING, resisting)
    put(lost, PLACE, place)
    put(lost, RESISTING_TORQUE, damped)
    put(lost, MOTOR_TORQUE, motor)
    lost[RESISTING_POWER], lost[MOTOR_POWER] = dot(resisting, velocity) + dot(damped, spin), dot(motor, spin)
    torque = add(add(held, damped), motor)
    put_more(links.load[j], 0, scale(-1.0, force))
    put_more(links.load[j + 1], 0, force)
    put_more(links.load[j], 3, scale(-1.0, add(torque, cross(sub(place, vector(links.position[j], 0)), force))))
    put_more(links.load[j + 1], 3, add(torque, cross(sub(place, vector(links.position[j + 1], 0)), force)))


@part
def push_joints(linkages: Any, gravity: float, step: Step) -> None:
    """Compute the loads of contacts and joints on all links.

    Args:
        linkages: the linkages, with the loads of contacts in `parts`; all arrays but constants are written.
        gravity: g [m/s²].
        step: `need` is increased if a link moves too fast for a time step.
    """
    if linkages is None:
        return
    gather(linkages.links, linkages.parts)
    for f in range(linkages.body.shape[0]):
        gait = linkages.gait[f]
        c, s = direction(gait[PSI])
        for j in range(linkages.begin[f], linkages.begin[f + 1] - 1):
            _push_joint(linkages, j, (c, s, gait[FACTOR]), step.past)
    resolve_speeds(linkages.shapes, linkages.links, linkages.parts, linkages.segments, gravity, step, None)


# -- motion ------------------------------------------------------------------------------------------------------


@inlined
def _hold(linkages: Linkages, gravity: float, dt: float) -> None:
    """Replace loads on held links by loads that give them the velocity of their grip, and no rotation."""
    links = linkages.links
    linkages.grip_force[:] = 0.0
    for i in range(links.position.shape[0]):
        if linkages.grip[i] == 0:
            continue
        held, mass, load = linkages.grip[i] - 1, linkages.shapes.mass[links.shape[i]], links.load[i]
        before, after = vector(links.velocity[i], 0), vector(linkages.grip_speed[held], 0)
        needed = along(scale(mass / dt, sub(after, before)), mass * gravity, (0.0, 0.0, 1.0))
        torque = scale(-1 / dt, vector(links.momentum[i], 0))
        force, turning = sub(needed, vector(load, 0)), sub(torque, vector(load, 3))
        put_more(linkages.grip_force[held], 0, force)
        linkages.sums[GRIPPED] += 0.5 * dt * (dot(force, add(before, after)) + dot(turning, vector(links.spin[i], 0)))
        put(load, 0, needed)
        put(load, 3, torque)


@part
def kick_links(linkages: Any, gravity: float, ledger: Any, dt: float) -> None:
    """Change the momenta of links by the present loads, and sum the energies that are exchanged.

    Args:
        linkages: `links`, `grip_force` and `sums` are written, and `parts.motion` if there is a ledger or a motor.
        gravity: g [m/s²].
        ledger: forces that dissipate energy; None if dissipation is not recorded.
        dt: time over which the loads act [s].
    """
    if linkages is None:
        return
    links, sums = linkages.links, linkages.sums
    _hold(linkages, gravity, dt)
    kick(linkages.shapes, links, linkages.parts, None, gravity, False, dt, None)
    if ledger is None and linkages.driven[0] == 0:
        return
    find_motions(linkages.shapes, links, linkages.parts, None)
    for f in range(linkages.body.shape[0]):
        for j in range(linkages.begin[f], linkages.begin[f + 1] - 1):
            lost = linkages.lost[j]
            place, spin = vector(lost, PLACE), sub(vector(links.spin[j + 1], 0), vector(links.spin[j], 0))
            velocity = sub(_moving(links, j + 1, place), _moving(links, j, place))
            power = dot(vector(lost, RESISTING), velocity) + dot(vector(lost, RESISTING_TORQUE), spin)
            sums[DAMPED] -= 0.5 * dt * (lost[RESISTING_POWER] + power)
            sums[ACTIVE] += 0.5 * dt * (lost[MOTOR_POWER] + dot(vector(lost, MOTOR_TORQUE), spin))


@part
def drift_links(linkages: Any, dt: float, row: Array) -> None:
    """Move all links by a sub-step, and advance the waves of their motors.

    Args:
        linkages: `links` and `gait` are written.
        dt: length of the sub-step [s].
        row: (PLANE,) scratch.
    """
    if linkages is None:
        return
    for f in range(linkages.body.shape[0]):
        turn_wave(linkages.gait[f], dt)
    drift(linkages.shapes, linkages.links, None, dt, row)


# -- energies ----------------------------------------------------------------------------------------------------


@kernel
def measure_linkages(linkages: Linkages, gravity: float, found: Array) -> None:
    """Add up the present energies of all linkages; `pose_linkages` must have been called before.

    Args:
        gravity: g [m/s²].
        found: (5,) written: kinetic energy, potential energy, energies of pins, of elastic joints, and of the springs
            against other rotations [J].
    """
    found[:] = 0.0
    links = linkages.links
    for i in range(links.position.shape[0]):
        velocity, mass = vector(links.velocity[i], 0), linkages.shapes.mass[links.shape[i]]
        found[0] += 0.5 * (mass * dot(velocity, velocity) + dot(vector(links.spin[i], 0), vector(links.momentum[i], 0)))
        found[1] += gravity * mass * links.position[i, 2]
        if linkages.law[i] != NONE:
            pin, elastic, off = _stored(linkages, i)
            found[2] += pin
            found[3] += elastic
            found[4] += off
