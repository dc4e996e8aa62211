"""Many steps in one call: everything that happens in a step, in order."""

from __future__ import annotations

import math
from typing import Any

from dem.engine.links.arrays import Array, Bodies, Cells, Ends, Ground, Law, Pairs
from dem.engine.links.compiler import inlined, kernel, part
from dem.engine.links.contact.bars import push_hooks
from dem.engine.links.contact.cords import pull
from dem.engine.links.contact.pairs import push_apart
from dem.engine.links.contact.rims import push_rims
from dem.engine.links.contact.walls import push_sideways, push_up
from dem.engine.links.motion.motoring import look
from dem.engine.links.motion.moving import drift, kick
from dem.engine.links.motion.poses import find_motion, find_spin, pose
from dem.engine.links.neighbours.lists import FULL, GOOD, build, tighten
from dem.engine.links.neighbours.skins import moved
from dem.engine.links.shape import Shape

LOST, WORK = 0, 1  # places in `totals`
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
    find_velocities(shape, bodies, motors, 0, bodies.position.shape[0])
    return dissipated(bodies, ledger, dt)


@inlined
def find_velocities(shape: Shape, bodies: Bodies, motors: Any, begin: int, stop: int) -> None:
    """Bring velocities of smarticles from `begin` up to `stop` up to date after a kick."""
    for i in range(begin, stop):
        find_spin(bodies, i, motors)
        find_motion(shape, bodies, i, motors)


@inlined
def dissipated(bodies: Bodies, ledger: Array, dt: float) -> float:
    """What `settle` returns, once velocities are known; the ledger is emptied."""
    motion, position, total = bodies.motion, bodies.position, 0.0
    for n in range(1, int(ledger[0, 0]) + 1):
        row = ledger[n]
        total -= row[10]
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
    steps: int, made: int, begin: float, dt: float, gravity: float, planar: bool, skins: Array, shape: Shape,
    law: Law, wall_law: Law, bodies: Bodies, pairs: Pairs, cells: Cells, ends: Ends, ground: Ground, motors: Any,
    hooks: Any, rims: Any, channel: Any, cords: Any, ledger: Any, out: Array, row: Array, totals: Array,
) -> int:  # fmt: skip
    """Make steps.

    Args:
        steps: how many.
        made: how many were made since `begin`.
        begin: when steps of this length began [s].
        dt: time step [s].
        gravity: g, downwards [m/s²].
        planar: whether all motion is confined to a horizontal plane.
        skins: see `look_for_neighbours`.
        shape: what all smarticles have in common.
        law: of their contacts.
        wall_law: of their contacts with fixtures.
        bodies: the smarticles.
        pairs: which of their links are near each other.
        cells: scratch.
        ends: what contacts with fixtures remember.
        ground: the fixtures.
        motors: None while welded.
        hooks: None where there are none.
        rims: None where the wall has no edges that links can reach.
        channel: (1,) half the distance of the walls that stand in for the container [m]; None for a container.
        cords: None where no string is tied.
        ledger: of forces that dissipate; None where nobody asks.
        out: scratch of `dem.engine.links.contact.meeting.meet`.
        row: (PLANE,) scratch.
        totals: (2,) energy dissipated, work of the fixtures [J]; added to.

    Returns:
        Steps that were made; fewer where a list is full.
    """
    n = bodies.position.shape[0]
    for step in range(steps):
        shaken_to(ground, begin + (made + step) * dt)
        if motors is not None and motors.due[1] == 0:
            look(shape, bodies, motors)
        pose(shape, bodies, motors)
        if look_for_neighbours(shape, bodies, pairs, cells, skins) == FULL:
            return step
        bodies.load[:] = 0.0
        ground.force[:] = 0.0
        if motors is not None:
            bodies.shares[:] = 0.0
        lost = push_apart(shape, law, bodies, pairs, motors, ledger, dt, out)
        if channel is None:
            lost += push_up(shape, wall_law, bodies, ends, ground, motors, ledger, dt, 0, n)
        else:
            lost += push_sideways(shape, wall_law, bodies, ends, ground, channel[0], motors, ledger, dt, 0, n)
        if rims is not None:
            lost += push_rims(shape, wall_law, bodies, ground, rims, motors, ledger, dt, 0, n)
        if hooks is not None:
            lost += push_hooks(shape, wall_law, bodies, ground, hooks, motors, ledger, dt, out, 0, n)
        if cords is not None:
            totals[WORK] += pull(shape, bodies, cords, motors, dt)
        for k in range(6):
            for d in range(3):
                ground.sums[k, d] += ground.force[k, d]
            if k < 4:
                totals[WORK] -= ground.force[k, 2] * ground.speed[k] * dt
        kick(shape, bodies, motors, gravity, planar, dt, 0, n)
        if motors is not None:
            motors.elapsed[0] += dt
        if ledger is not None:
            totals[LOST] += lost + settle(shape, bodies, motors, ledger, dt)
        drift(shape, bodies, motors, dt, row, 0, n)
        if motors is not None:
            motors.due[1] -= 1
        for k in range(4):
            if not ground.shaken[k]:
                ground.place[k] += ground.speed[k] * dt
    shaken_to(ground, begin + (made + steps) * dt)
    return steps
