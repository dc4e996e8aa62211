"""Forces at all contacts of the links engine at one instant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dem.body.forces import ContactForces, contacts_of_points
from dem.engine.links.contact.forces import FORCE, FRICTION, LOAD, POINT, WIDTH, forces_of_boundaries, forces_of_pairs
from dem.engine.links.world import World

Array = NDArray[np.float64]


def contact_forces(world: World) -> ContactForces:
    """Forces at all contacts; nothing of the simulation is changed. See `World.look` for who is known."""
    bodies, hinged, slip = world.posed(), world.hinged, np.zeros(4)
    law, wall_law = world.laws
    between = _rows(
        lambda rows: forces_of_pairs(world.shape, law, bodies, world.pairs, hinged, world.meeting, slip, rows)
    )
    outside = _rows(
        lambda rows: forces_of_boundaries(
            world.shape, wall_law, bodies, world.kept, world.ground, world.channel, world.hooks, world.rims, hinged,
            world.meeting, world.scratch.contacts, slip, rows,
        )
    )  # fmt: skip
    rows = np.concatenate([between, outside])
    first, second = rows[:, :LOAD].astype(np.int64).T
    return contacts_of_points(
        first,
        second,
        loads=rows[:, LOAD],
        points=rows[:, POINT:FRICTION],
        friction=rows[:, FRICTION:FORCE],
        forces=rows[:, FORCE:],
    )


def _rows(write: Callable[[Array], int]) -> Array:
    """What a kernel writes, with as much room as it needs."""
    rows = np.zeros((256, WIDTH))
    while (count := write(rows)) > len(rows):
        rows = np.zeros((count, WIDTH))
    return rows[:count]
