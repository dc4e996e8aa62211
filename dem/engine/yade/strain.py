"""How far contacts and hinges are strained: what the watchdog asks of the engine."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from dem.engine.yade.assembly import Assembly
from dem.engine.yade.dissipation import contacts_of
from dem.engine.yade.fixtures import Fixtures
from dem.engine.yade.library import Yade
from dem.physics.stability import ContactLaw

Array = NDArray[np.float64]

APART = 0.1  # of the depth that is too deep; fixtures that have moved against each other by less have not


@dataclass(frozen=True)
class Held:
    """A smarticle between two fixtures that have moved apart: what gives way is the contact alone.

    Args:
        smarticle: its number.
        between: names of the two fixtures.
        apart: by how much they have moved against each other since the start [m].
    """

    smarticle: int
    between: tuple[str, str]
    apart: float


@dataclass(frozen=True)
class Strain:
    """All contacts and hinges at one instant.

    Args:
        deepest: overlap of the deepest contact [m].
        deep: (N,) bool, smarticles with a contact that is deeper than asked for.
        elastic_energy: no less than what the springs of all contacts and hinges hold [J].
        held: those of the deep ones that two fixtures hold.
    """

    deepest: float
    deep: NDArray[np.bool_]
    elastic_energy: float
    held: tuple[Held, ...] = ()


def measure_strain(yade: Yade, assembly: Assembly, fixtures: Fixtures, law: ContactLaw, limit: float) -> Strain:
    """Look at all contacts and hinges of a running simulation.

    Args:
        yade: the simulation.
        assembly: the smarticles in it.
        fixtures: what does not give way.
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
        held = _held(yade, assembly, fixtures, deep, APART * limit)
    normal = law.normal_stiffness / 2 * float((np.fmax(depths, 0.0) ** 2).sum())
    # Friction bounds what tangential springs hold by what normal ones do.
    friction = max(law.friction, law.wall_friction)
    tangential = friction**2 * law.normal_stiffness / law.tangential_stiffness * normal
    return Strain(deepest, deep, normal + tangential + (0.0 if hinges is None else hinges.elastic_energy()), held)


def _held(
    yade: Yade, assembly: Assembly, fixtures: Fixtures, deep: NDArray[np.bool_], least: float
) -> tuple[Held, ...]:
    """Smarticles among the `deep` ones (N,) that touch two fixtures which have moved apart by `least` [m] or more."""
    parts = fixtures.parts()
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
