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
        deepest: overlap of the deepest contact [m].
        deep: (N,) bool, smarticles with a contact that is deeper than asked for.
        elastic_energy: no less than what the springs of all contacts and hinges hold [J].
    """

    deepest: float
    deep: NDArray[np.bool_]
    elastic_energy: float


def measure_strain(yade: Yade, assembly: Assembly, law: ContactLaw, limit: float) -> Strain:
    """Look at all contacts and hinges of a running simulation.

    Args:
        yade: the simulation.
        assembly: the smarticles in it.
        law: of all contacts.
        limit: overlap [m] of contacts whose smarticles are to be named.
    """
    hinges = assembly.hinges
    # Made in every run: without hinges every interaction is a contact, and none is asked for its bodies.
    contacts = contacts_of(yade, assembly) if hinges is not None else (c for c in yade.omega.interactions if c.isReal)
    depths = np.array([contact.geom.penetrationDepth for contact in contacts])
    deepest = float(depths.max(initial=0.0))
    deep = np.zeros(assembly.count, dtype=np.bool_)
    if not deepest <= limit:
        for contact in contacts_of(yade, assembly):
            if not contact.geom.penetrationDepth <= limit:
                number = map(assembly.smarticle_of.get, (contact.id1, contact.id2))
                deep[[k for k in number if k is not None]] = True
    normal = law.normal_stiffness / 2 * float((np.fmax(depths, 0.0) ** 2).sum())
    # Friction bounds what tangential springs hold by what normal ones do.
    friction = max(law.friction, law.wall_friction)
    tangential = friction**2 * law.normal_stiffness / law.tangential_stiffness * normal
    return Strain(deepest, deep, normal + tangential + (0.0 if hinges is None else hinges.elastic_energy()))
