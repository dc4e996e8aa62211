"""Many steps in one call: everything that happens in a step, in order."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from dem.engine.links.arrays import Array, Bodies, Cells, Ground, Kept, Law, Pairs
from dem.engine.links.compiler import kernel, part
from dem.engine.links.contact.barrier import FINEST, Step, ticks_for
from dem.engine.links.contact.boundaries import push_boundaries
from dem.engine.links.contact.cords import pull
from dem.engine.links.contact.pairs import push_apart
from dem.engine.links.motion.motoring import look
from dem.engine.links.motion.moving import drift, kick, resolve_speeds
from dem.engine.links.motion.poses import find_motion, find_spin, pose
from dem.engine.links.neighbours.lists import FULL, GOOD, build, tighten
from dem.engine.links.neighbours.skins import moved
from dem.engine.links.shape import Shape


class Clock(NamedTuple):
    """Time of the steps of one length.

    Args:
        begin: when they began [s].
        made: how many were made since.
        dt: their length [s].
    """

    begin: float
    made: int
    dt: float


class System(NamedTuple):
    """What every simulation has.

    Args:
        shape: what all smarticles have in common.
        law: of their contacts.
        wall_law: of their contacts with boundaries.
        bodies: the smarticles.
        pairs: which of their links are near each other.
        kept: what contacts with boundaries remember.
        ground: the boundaries.
        gravity: g, downwards [m/s²].
        planar: whether all motion is confined to a horizontal plane.
        skins: see `look_for_neighbours`.
    """

    shape: Shape
    law: Law
    wall_law: Law
    bodies: Bodies
    pairs: Pairs
    kept: Kept
    ground: Ground
    gravity: float
    planar: bool
    skins: Array


class Scratch(NamedTuple):
    """Arrays that are written before they are read.

    Args:
        cells: of the search for neighbours.
        meeting: (ROWS, COLUMNS) of `dem.engine.links.contact.meeting.meet`.
        contacts: (slots, COLUMNS) of `dem.engine.links.contact.boundaries.contacts_of_link`.
        plane: (PLANE,) plane geometry of a smarticle.
    """

    cells: Cells
    meeting: Array
    contacts: Array
    plane: Array


# Places in `totals`: energy dissipated and work of the boundaries [J], length of the last sub-step [s], sub-steps per
# step that were needed last, the most that were, and ticks of the present step that have passed.
LOST, WORK, PAST, NEED, MOST, TICK = range(6)
TOTALS = 6
NEAR_LEAST, NEAR_MOST, NEAR_TIME, WIDE_LEAST, WIDE_MOST, WIDE_TIME, STRIP = range(7)  # places in `skins`


@part
def shaken_to(ground: Ground, time: float) -> None:
    """Put what is shaken where it is at a time [s]; `place` and `speed` are written."""
    if ground.wave[1] > 0.0:
        phase = ground.wave[1] * (time - ground.wave[2])
        for k in range(4):
            if ground.shaken[k]:
                ground.place[k] = ground.base[k] + ground.wave[0] * math.sin(phase)
                ground.speed[k] = ground.wave[0] * ground.wave[1] * math.cos(phase)


@part
def look_for_neighbours(shape: Shape, bodies: Bodies, pairs: Pairs, cells: Cells, skins: Array) -> int:
    """Bring the lists up to date where links have moved too far; GOOD, or FULL.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles, posed.
        pairs: written.
        cells: scratch.
        skins: (7,) of the tight and of the wide list: thinnest and thickest skin [m], time that skins are to be good
            for [s]; then the width of a strip, see `build` [m].
    """
    if not moved(bodies, pairs.near_marks, pairs.near_centres):
        return GOOD
    # The tight list is good for less than its thickest skin, which the wide one leaves room for.
    if moved(bodies, pairs.wide_marks, pairs.wide_centres):
        inner, least, most = skins[NEAR_MOST], skins[WIDE_LEAST], skins[WIDE_MOST]
        if build(shape, bodies, pairs, cells, inner, least, most, skins[WIDE_TIME], skins[STRIP]) == FULL:
            return FULL
    tighten(shape, bodies, pairs, skins[NEAR_LEAST], skins[NEAR_MOST], skins[NEAR_TIME])
    return GOOD


@part
def settle(shape: Shape, bodies: Bodies, motors: Any, ledger: Array, dt: float) -> float:
    """Energy that the forces in the ledger dissipated in the step [J]; velocities after the kick are now known.

    A force takes from the kinetic energy what it does along the mean of the velocities before and after.

    Args:
        shape: what all smarticles have in common.
        bodies: the smarticles; `spin` and `motion` are written.
        motors: None while welded.
        ledger: see `dem.engine.links.contact.pairs.put_down`; emptied.
        dt: time step [s].
    """
    motion, position, total = bodies.motion, bodies.position, 0.0
    for i in range(position.shape[0]):
        find_spin(bodies, i, motors)
        find_motion(shape, bodies, i, motors)
    for n in range(1, int(ledger[0, 0]) + 1):
        row = ledger[n]
        total -= dt * row[10] + row[11]
        for side in range(2):
            m, i = int(row[side]), int(row[2 + side])
            if m >= 0:
                x, y, z = row[4] - position[i, 0], row[5] - position[i, 1], row[6] - position[i, 2]
                vx = motion[m, 0] + motion[m, 4] * z - motion[m, 5] * y
                vy = motion[m, 1] + motion[m, 5] * x - motion[m, 3] * z
                vz = motion[m, 2] + motion[m, 3] * y - motion[m, 4] * x
                power = row[7] * vx + row[8] * vy + row[9] * vz
                total += 0.5 * dt * (power if side else -power)
    ledger[0, 0] = 0.0
    return total


@kernel
def advance(
    steps: int, clock: Clock, system: System, scratch: Scratch, totals: Array,
    motors: Any, channel: Any, hooks: Any, rims: Any, cords: Any, ledger: Any,
) -> int:  # fmt: skip
    """Make steps.

    What a scene may lack comes as arguments of its own: a kernel is compiled without it where it is None.

    Args:
        steps: how many.
        clock: when these steps are.
        system: smarticles, boundaries and their laws.
        scratch: written.
        totals: (TOTALS,) see `LOST`; brought up to date.
        motors: None while welded.
        channel: (1,) half the distance of the walls that stand in for the container [m]; None for a container.
        hooks: None where there are none.
        rims: None where the wall has no edges that links can reach.
        cords: None where no string is tied.
        ledger: of forces that dissipate; None where nobody asks.

    Returns:
        Steps that were made; fewer where a list is full.
    """
    shape, bodies, pairs, ground, gravity = system.shape, system.bodies, system.pairs, system.ground, system.gravity
    dt, need = clock.dt, totals[NEED : NEED + 1]
    for made_now in range(steps):
        tick = int(totals[TICK])
        while tick < FINEST:
            shaken_to(ground, clock.begin + (clock.made + made_now + tick / FINEST) * dt)
            if motors is not None and motors.due[1] == 0 and tick == 0:
                look(shape, bodies, motors)
            pose(shape, bodies, motors)
            if look_for_neighbours(shape, bodies, pairs, scratch.cells, system.skins) == FULL:
                totals[TICK] = tick
                return made_now
            step, need[0] = Step(totals[PAST], dt, need), 1.0
            bodies.load[:] = 0.0
            ground.force[:] = 0.0
            if motors is not None:
                bodies.shares[:] = 0.0
            lost = push_apart(shape, system.law, bodies, pairs, motors, ledger, step, scratch.meeting)
            lost += push_boundaries(
                shape, system.wall_law, bodies, system.kept, ground, channel, hooks, rims, motors, ledger, step,
                scratch.contacts, scratch.meeting,
            )  # fmt: skip
            pulling = 0.0
            if cords is not None:
                pulling = pull(shape, bodies, cords, motors, step)
            resolve_speeds(shape, bodies, motors is not None, gravity, step)
            # What the forces of this instant ask for decides how far they carry.
            totals[MOST] = max(totals[MOST], need[0])
            ticks = ticks_for(need[0], tick)
            length = dt * (ticks / FINEST)
            acting = 0.5 * (totals[PAST] + length)
            totals[PAST] = length
            totals[WORK] += acting * pulling
            weight = length / dt
            for k in range(6):
                for d in range(3):
                    ground.sums[k, d] += weight * ground.force[k, d]
                if k < 4:
                    totals[WORK] -= ground.force[k, 2] * ground.speed[k] * acting
            kick(shape, bodies, motors, gravity, system.planar, acting)
            if motors is not None:
                motors.elapsed[0] += acting
            if ledger is not None:
                totals[LOST] += lost + settle(shape, bodies, motors, ledger, acting)
            drift(shape, bodies, motors, length, scratch.plane)
            for k in range(4):
                if not ground.shaken[k]:
                    ground.place[k] += ground.speed[k] * length
            if cords is not None:
                for k in range(cords.anchor.shape[0]):
                    cords.anchor[k, 0] += cords.speed[k] * length
            tick += ticks
        totals[TICK] = 0.0
        if motors is not None:
            motors.due[1] -= 1
    shaken_to(ground, clock.begin + (clock.made + steps) * dt)
    return steps
