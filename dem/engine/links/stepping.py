"""Make many time steps in one call; `advance` and `act` show all that happens in a step, in order."""

import math
from typing import Any, NamedTuple

from dem.engine.links.arrays import BOUNDARIES, Array, Bodies, Ground, Parts, Scratch, Segments, System
from dem.engine.links.compiler import kernel, part
from dem.engine.links.contact.barrier import FINEST, Step, ticks_for
from dem.engine.links.contact.boundaries import push_boundaries
from dem.engine.links.contact.cords import pull
from dem.engine.links.contact.pairs import GAIN, POINT, POWER, PUSH, ROWS, push_apart, velocity_at
from dem.engine.links.motion.bending import (
    drift_nodes,
    kick_nodes,
    move_segments,
    pose_filaments,
    push_nodes,
    resolve_nodes,
)
from dem.engine.links.motion.holding import carry_grips, hold
from dem.engine.links.motion.joining import drift_links, kick_links, pose_linkages, push_joints
from dem.engine.links.motion.motoring import update
from dem.engine.links.motion.moving import drift, gather, kick, resolve_speeds
from dem.engine.links.motion.poses import find_motions, pose
from dem.engine.links.neighbours.lists import FULL, update_lists
from dem.engine.links.shapes import Shapes
from dem.engine.links.vectors import dot, vector


class Clock(NamedTuple):
    """Clock that counts steps of equal length; the time is `begin` + `made` · `dt`."""

    begin: float  #: Time at which steps of this length began [s]
    made: int  #: Number of steps of this length made before the call
    dt: float  #: Length of a step [s]


# Indices of `totals`: energy dissipated and work of the boundaries [J], length of the last sub-step [s], sub-steps per
# step that were needed last, the most that were ever needed, and ticks of the present step that have passed.
LOST, WORK, PAST, NEED, MOST, TICK = range(6)
TOTALS = 6


@part
def shaken_to(ground: Ground, time: float) -> None:
    """Move the shaken boundaries to their heights at a time [s]; `place` and `speed` are written."""
    if ground.wave[1] > 0.0:
        phase = ground.wave[1] * (time - ground.wave[2])
        for k in range(BOUNDARIES):
            if ground.shaken[k]:
                ground.place[k] = ground.base[k] + ground.wave[0] * math.sin(phase)
                ground.speed[k] = ground.rise[k] + ground.wave[0] * ground.wave[1] * math.cos(phase)


@part
def settle(
    shapes: Shapes, bodies: Bodies, parts: Parts, segments: Segments, ledger: Array, motors: Any, filaments: Any,
    dt: float,
) -> float:  # fmt: skip
    """Return the energy that the forces in the ledger dissipated in a kick [J]; called after the kick.

    The work of a force in a kick follows from the mean of the velocities before and after the kick.

    Args:
        bodies: `spin` is written.
        parts: `motion` is written.
        ledger: forces, see `dem.engine.links.contact.pairs.enter`; emptied.
        motors: the motors; None while smarticles are welded.
        filaments: the filaments; None without flexible bodies.
        dt: time over which the forces acted [s].
    """
    total = 0.0
    find_motions(shapes, bodies, parts, motors)
    move_segments(filaments, parts, segments)
    for n in range(1, int(ledger[0, 0]) + 1):
        row = ledger[n]
        total -= dt * row[POWER] + row[GAIN]
        place, force = vector(row, POINT), vector(row, PUSH)
        for side in range(2):
            m = int(row[ROWS + side])
            if m >= 0:
                power = dot(force, velocity_at(parts, m, place))
                total += 0.5 * dt * (power if side else -power)
    ledger[0, 0] = 0.0
    return total


@part
def act(
    system: System, scratch: Scratch, totals: Array, tick: int, dt: float, motors: Any, cords: Any, ledger: Any
) -> int:
    """Make one sub-step, whose length follows from the forces at its beginning.

    Args:
        system: all data of the simulation, after `pose`, with valid lists of near segments.
        scratch: arrays whose content does not outlive the call.
        totals: (TOTALS,) sums and state of the sub-steps, which are updated; for the indices see `LOST`.
        tick: ticks of the time step that have passed.
        dt: length of an undivided time step [s].
        motors: `system.motors`.
        cords: `system.cords`.
        ledger: `system.ledger`.

    Returns:
        Length of the sub-step in ticks.
    """
    shapes, bodies, parts, segments = system.shapes, system.bodies, system.parts, system.segments
    known, ground, need = system.boundaries, system.boundaries.ground, totals[NEED : NEED + 1]
    # Sub-steps grow by no more than twice: energy is kept while they change slowly.
    step, need[0] = Step(totals[PAST], dt, need), max(1.0, dt / (2.0 * totals[PAST]))
    parts.load[:] = 0.0
    ground.force[:] = 0.0
    lost = push_apart(system.law, bodies, parts, segments, system.pairs, ledger, step, scratch.met)
    lost += push_boundaries(
        system.wall_law, bodies, parts, segments, system.kept, ground, known.channel, known.hooks, known.rims, ledger,
        step, scratch.contacts, scratch.met,
    )  # fmt: skip
    pulling = 0.0
    if cords is not None:
        pulling = pull(bodies, parts, cords, motors, step)
    gather(bodies, parts)
    resolve_speeds(shapes, bodies, parts, segments, system.gravity, step, system.grips)
    push_nodes(system.filaments, parts, system.gravity, ledger, step)
    resolve_nodes(system.filaments, shapes.radius, bodies, step)
    push_joints(system.linkages, system.gravity, step)
    if motors is not None and tick == 0 and motors.due[1] == 0:
        # After the forces, whose velocities are those of before, as in the kick: so that work and dissipation agree.
        update(shapes, bodies, motors)
    totals[MOST] = max(totals[MOST], need[0])
    ticks = ticks_for(need[0], tick)
    length = dt * (ticks / FINEST)
    acting = 0.5 * (totals[PAST] + length)
    totals[PAST] = length
    totals[WORK] += acting * pulling
    weight = length / dt
    for k in range(BOUNDARIES):
        for d in range(3):
            ground.sums[k, d] += weight * ground.force[k, d]
        totals[WORK] -= ground.force[k, 2] * ground.speed[k] * acting
    kick(shapes, bodies, parts, motors, system.gravity, system.planar, acting, system.grips)
    totals[WORK] += hold(system.grips, shapes, bodies, ground, system.gravity, acting, weight)
    kick_nodes(system.filaments, acting)
    kick_links(system.linkages, system.gravity, ledger, acting)
    if motors is not None:
        motors.elapsed[0] += acting
    if ledger is not None:
        totals[LOST] += lost + settle(shapes, bodies, parts, segments, ledger, motors, system.filaments, acting)
    drift(shapes, bodies, motors, length, scratch.plane)
    drift_nodes(system.filaments, length)
    drift_links(system.linkages, length, scratch.plane)
    carry_grips(system.grips, length)
    for k in range(BOUNDARIES):
        moved = ground.rise[k] * length
        if ground.shaken[k]:
            ground.base[k] += moved
        else:
            ground.place[k] += moved
            ground.speed[k] = ground.rise[k]
    if cords is not None:
        for k in range(cords.anchor.shape[0]):
            cords.anchor[k, 0] += cords.speed[k] * length
    return ticks


@part
def count_down(motors: Any) -> None:
    """Reduce the number of steps until the next control update of the motors by one."""
    if motors is not None:
        motors.due[1] -= 1


@kernel
def advance(steps: int, clock: Clock, system: System, scratch: Scratch, totals: Array) -> int:
    """Advance a simulation by time steps.

    Args:
        steps: number of steps.
        clock: time at the beginning of the first step, and length of the steps.
        scratch: arrays whose content does not outlive a step.
        totals: (TOTALS,) sums and state of the sub-steps, which are updated; for the indices see `LOST`.

    Returns:
        Number of steps that were made, less than `steps` if the list of pairs is full.
    """
    ground, dt = system.boundaries.ground, clock.dt
    for made_now in range(steps):
        tick = int(totals[TICK])
        while tick < FINEST:
            shaken_to(ground, clock.begin + (clock.made + made_now + tick / FINEST) * dt)
            pose(system.shapes, system.bodies, system.parts, system.segments, system.motors)
            pose_filaments(system.filaments, system.bodies, system.parts, system.segments)
            pose_linkages(system.linkages)
            if update_lists(system.bodies, system.segments, system.pairs, scratch.cells, system.skins) == FULL:
                totals[TICK] = tick
                return made_now
            tick += act(system, scratch, totals, tick, dt, system.motors, system.cords, system.ledger)
        totals[TICK] = 0.0
        count_down(system.motors)
    shaken_to(ground, clock.begin + (clock.made + steps) * dt)
    return steps
