"""How far contacts and hinges are strained: what the watchdog asks of the engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dem.assembly import Assembly
from dem.dissipation import contacts_of
from dem.library import Yade
from dem.timestep import ContactLaw

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Strain:
    """All contacts and hinges at one instant.

    Args:
        smarticles: (M, 2) int64, the two smarticles of each contact; -1 for container and hooks.
        depths: (M,) overlaps [m]; negative where a contact has just ended.
        elastic_energy: no less than what the springs of all contacts and hinges hold [J].
    """

    smarticles: NDArray[np.int64]
    depths: Array
    elastic_energy: float


def measure_strain(yade: Yade, assembly: Assembly, law: ContactLaw) -> Strain:
    """Look at all contacts and hinges of a running simulation.

    Args:
        yade: the simulation.
        assembly: the smarticles in it.
        law: of all contacts.
    """
    number = assembly.smarticle_of.get
    # One pass that reads no more than this: it is made in every run.
    rows = [(number(c.id1, -1), number(c.id2, -1), c.geom.penetrationDepth) for c in contacts_of(yade, assembly)]
    table = np.array(rows).reshape(-1, 3)
    depths = table[:, 2]
    normal = law.normal_stiffness / 2 * float((np.maximum(depths, 0.0) ** 2).sum())
    # Friction bounds what tangential springs hold by what normal ones do.
    friction = max(law.friction, law.wall_friction)
    tangential = friction**2 * law.normal_stiffness / law.tangential_stiffness * normal
    held = 0.0 if assembly.hinges is None else assembly.hinges.elastic_energy()
    return Strain(table[:, :2].astype(np.int64), depths, normal + tangential + held)
