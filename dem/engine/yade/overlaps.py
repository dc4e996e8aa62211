"""How deep contacts are, read from YADE."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from dem.engine.yade.assembly import Assembly
from dem.engine.yade.boundaries import YadeBoundaries
from dem.engine.yade.dissipation import contacts_of
from dem.engine.yade.library import Yade
from dem.physics.contact import ContactLaw
from dem.physics.overlaps import APART, Held, Overlaps


def measure_overlaps(
    yade: Yade, assembly: Assembly, boundaries: YadeBoundaries, law: ContactLaw, limit: float
) -> Overlaps:
    """Look at all contacts and hinges of a running simulation.

    Args:
        yade: the simulation.
        assembly: the smarticles in it.
        boundaries: what does not give way.
        law: of all contacts.
        limit: overlap [m] of contacts whose smarticles are to be named.
    """
    hinges = assembly.hinges
    # Made in every run: without hinges every interaction is a contact, and none is asked for its bodies.
    contacts = contacts_of(yade, assembly) if hinges is not None else (c for c in yade.omega.interactions if c.isReal)
    depths = np.array([contact.geom.penetrationDepth for contact in contacts])
    deepest = float(depths.max(initial=0.0))
    deep = np.zeros(assembly.count, dtype=np.bool_)
    held: tuple[Held, ...] = ()
    if not deepest <= limit:
        for contact in contacts_of(yade, assembly):
            if not contact.geom.penetrationDepth <= limit:
                number = map(assembly.smarticle_of.get, (contact.id1, contact.id2))
                deep[[k for k in number if k is not None]] = True
        held = _held(yade, assembly, boundaries, deep, APART * limit)
    normal = law.normal_stiffness / 2 * float((np.fmax(depths, 0.0) ** 2).sum())
    # Friction bounds what tangential springs hold by what normal ones do.
    friction = max(law.friction, law.wall_friction)
    tangential = friction**2 * law.normal_stiffness / law.tangential_stiffness * normal
    return Overlaps(deepest, deep, normal + tangential + (0.0 if hinges is None else hinges.elastic_energy()), held)


def _held(
    yade: Yade, assembly: Assembly, boundaries: YadeBoundaries, deep: NDArray[np.bool_], least: float
) -> tuple[Held, ...]:
    """Smarticles among the `deep` ones (N,) that touch two boundaries which have moved apart by `least` [m] or more."""
    parts = boundaries.parts()
    part_of = {body: name for name, (bodies, _) in parts.items() for body in bodies}
    touched: dict[int, set[str]] = defaultdict(set)
    for contact in contacts_of(yade, assembly) if parts else ():
        for one, other in ((contact.id1, contact.id2), (contact.id2, contact.id1)):
            k, name = assembly.smarticle_of.get(one), part_of.get(other)
            if k is not None and name is not None and deep[k]:
                touched[k].add(name)
    found = []
    for k, names in sorted(touched.items()):
        for first, second in combinations([name for name in parts if name in names], 2):
            apart = abs(parts[first][1] - parts[second][1])
            if apart > least:
                found.append(Held(k, (first, second), apart))
    return tuple(found)
