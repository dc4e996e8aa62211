"""Many steps in one call, on several threads: what `dem.engine.links.stepping` does, by the same parts."""

from __future__ import annotations

from typing import Any

from dem.engine.links.arrays import Array, Bodies, Cells, Ends, Ground, Law, Pairs
from dem.engine.links.compiler import inlined, part, released
from dem.engine.links.contact.bars import push_hooks
from dem.engine.links.contact.cords import pull
from dem.engine.links.contact.pairs import find_touching, push_touching
from dem.engine.links.contact.rims import push_rims
from dem.engine.links.contact.walls import push_sideways, push_up
from dem.engine.links.motion.motoring import look_some
from dem.engine.links.motion.moving import drift, kick
from dem.engine.links.motion.poses import pose_some
from dem.engine.links.neighbours.lists import FULL
from dem.engine.links.shape import Shape
from dem.engine.links.stepping import LOST, WORK, dissipated, find_velocities, shaken_to
from dem.engine.links.team.barrier import over, wait
from dem.engine.links.team.lists import look_together
from dem.engine.links.team.shared import TOUCHING, Shared, gather, share

BLOCK = 64  # smarticles; those at floor and wall cost more and are neighbours in memory: each thread has some of them


@part
def push_apart_together(
    mine: int, threads: int, shape: Shape, law: Law, own: Bodies, pairs: Pairs, hinged: Any, ledger: Any, dt: float,
    out: Array, shared: Shared,
) -> float:  # fmt: skip
    """See `dem.engine.links.contact.pairs.push_apart`: those that touch are counted, and shared out evenly."""
    begin, stop = share(pairs.counts[1], mine, threads)
    shared.tally[mine, TOUCHING] = find_touching(shape, own, pairs, begin, stop)
    wait(shared.gate, threads)
    total = 0
    for t in range(threads):
        total += shared.tally[t, TOUCHING]
    first, last = share(total, mine, threads)
    lost, before = 0.0, 0
    for t in range(threads):
        begin, stop = share(pairs.counts[1], t, threads)
        after = before + shared.tally[t, TOUCHING]
        low, high = max(first, before), min(last, after)
        if low < high:
            lost += push_touching(
                shape, law, own, pairs, hinged, ledger, dt, out, begin + low - before, begin + high - before
            )
        before = after
    return lost


@part
def push_from_fixtures(
    mine: int, threads: int, shape: Shape, wall_law: Law, own: Bodies, ends: Ends, ground: Ground, motors: Any,
    hooks: Any, rims: Any, channel: Any, ledger: Any, dt: float, out: Array,
) -> float:  # fmt: skip
    """Add the forces of all fixtures on a thread's part of the smarticles.

    Returns:
        Energy of tangential springs whose contacts have ended [J].
    """
    lost, n = 0.0, own.position.shape[0]
    for block in range(mine, (n + BLOCK - 1) // BLOCK, threads):
        i, j = block * BLOCK, min(n, (block + 1) * BLOCK)
        if channel is None:
            lost += push_up(shape, wall_law, own, ends, ground, motors, ledger, dt, i, j)
        else:
            lost += push_sideways(shape, wall_law, own, ends, ground, channel[0], motors, ledger, dt, i, j)
        if rims is not None:
            lost += push_rims(shape, wall_law, own, ground, rims, motors, ledger, dt, i, j)
        if hooks is not None:
            lost += push_hooks(shape, wall_law, own, ground, hooks, motors, ledger, dt, out, i, j)
    return lost


@inlined
def note_forces(ground: Ground, shared: Shared, totals: Array, dt: float) -> None:
    """Add up what all threads found on the fixtures, and what these work."""
    for k in range(6):
        for d in range(3):
            for t in range(shared.forces.shape[0]):
                ground.force[k, d] += shared.forces[t, k, d]
            ground.sums[k, d] += ground.force[k, d]
        if k < 4:
            totals[WORK] -= ground.force[k, 2] * ground.speed[k] * dt


@released
def advance_together(
    mine: int, threads: int, shared: Shared, own: Bodies,
    steps: int, made: int, begin: float, dt: float, gravity: float, planar: bool, skins: Array, shape: Shape,
    law: Law, wall_law: Law, bodies: Bodies, pairs: Pairs, cells: Cells, ends: Ends, ground: Ground, motors: Any,
    hooks: Any, rims: Any, channel: Any, cords: Any, ledger: Any, out: Array, row: Array, totals: Array,
) -> int:  # fmt: skip
    """Make steps, as one of some threads that all call this at once.

    Args:
        mine: the thread's number, from 0.
        threads: how many there are.
        shared: what they can all see.
        own: the smarticles, with `load`, `shares` and `deepest` of this thread; of the first one they are those
            of `bodies`.
        steps: from here on as in `dem.engine.links.stepping.advance`, but where said.
        made: the same.
        begin: the same [s].
        dt: the same [s].
        gravity: the same [m/s²].
        planar: the same.
        skins: the same.
        shape: the same.
        law: the same.
        wall_law: the same.
        bodies: the same.
        pairs: the same.
        cells: the same, with `close` of this thread.
        ends: the same.
        ground: the same, with `force` of this thread; of the first one it is the real one.
        motors: the same.
        hooks: the same.
        rims: the same.
        channel: the same.
        cords: the same.
        ledger: of this thread.
        out: of this thread.
        row: of this thread.
        totals: as in `advance`; written by the first thread.

    Returns:
        Steps that were made; fewer where a list is full, or where a thread has failed.
    """
    n, hinged = bodies.position.shape[0], motors is not None
    i, j = share(n, mine, threads)
    # Every thread counts for itself; the first one notes it where no other thread will look.
    next_row, left, elapsed = 0, -1, 0.0
    if motors is not None:
        next_row, left, elapsed = motors.due[0], motors.due[1], motors.elapsed[0]
    for step in range(steps):
        if over(shared.gate):
            return step
        if mine == 0:
            shaken_to(ground, begin + (made + step) * dt)
        if motors is not None:
            if left == 0:
                now = min(next_row, motors.targets.shape[0] - 1)
                look_some(bodies, motors, now, elapsed, i, j)
                next_row, left, elapsed = now + 1, motors.period, 0.0
        pose_some(shape, bodies, motors, i, j)
        bodies.load[i:j] = 0.0
        if hinged:
            bodies.shares[3 * i : 3 * j] = 0.0
        found = look_together(mine, threads, shape, bodies, pairs, cells, skins, shared)
        if motors is not None:
            if mine == 0:
                motors.due[0], motors.due[1], motors.elapsed[0] = next_row, left, elapsed
        if found == FULL:
            return step
        ground.force[:] = 0.0
        lost = push_apart_together(mine, threads, shape, law, own, pairs, motors, ledger, dt, out, shared)
        lost += push_from_fixtures(
            mine, threads, shape, wall_law, own, ends, ground, motors, hooks, rims, channel, ledger, dt, out
        )
        if cords is not None:  # alone in its line: then what is not called for is not compiled
            if mine == 0:
                totals[WORK] += pull(shape, bodies, cords, motors, dt)
        wait(shared.gate, threads)
        if mine == 0:
            note_forces(ground, shared, totals, dt)
        gather(shared, bodies, hinged, i, j)
        kick(shape, bodies, motors, gravity, planar, dt, i, j)
        if ledger is not None:
            find_velocities(shape, bodies, motors, i, j)
            wait(shared.gate, threads)
            shared.lost[mine, 0] = lost + dissipated(bodies, ledger, dt)
            wait(shared.gate, threads)
            if mine == 0:
                for t in range(threads):
                    totals[LOST] += shared.lost[t, 0]
        drift(shape, bodies, motors, dt, row, i, j)
        left, elapsed = left - 1, elapsed + dt
        if motors is not None:
            if mine == 0:
                motors.due[1], motors.elapsed[0] = left, elapsed
        if mine == 0:
            for k in range(4):
                if not ground.shaken[k]:
                    ground.place[k] += ground.speed[k] * dt
    if mine == 0:
        shaken_to(ground, begin + (made + steps) * dt)
    return steps
