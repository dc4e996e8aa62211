"""Contacts among YADE's interactions, with their overlaps and forces."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np

from dem.arrays import Flags
from dem.body.forces import ContactForces, at_boundaries, at_links, contacts_of_points
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.boundaries import YadeBoundaries
from dem.engine.yade.library import Yade
from dem.physics.contact import ContactLaw
from dem.physics.overlaps import APART, Held, Overlaps, held_between


def contacts_of(yade: Yade, assembly: Assembly) -> Iterator[Any]:
    """Yield YADE's interactions that are contacts; the others are bonds of hinges or filaments."""
    smarticle_of, bond = assembly.smarticle_of, yade.classes.CohFrictPhys
    for interaction in yade.omega.interactions:
        if not interaction.isReal or (assembly.bonded and isinstance(interaction.phys, bond)):
            continue
        if interaction.id1 in smarticle_of or interaction.id2 in smarticle_of:
            yield interaction


def contact_forces(yade: Yade, assembly: Assembly, boundaries: YadeBoundaries) -> ContactForces:
    """Return the forces at all contacts in the last step; all spheres of a pair of links make one contact.

    Tangential forces lack the part of the dashpot at contacts that stick, which YADE does not store. It is zero in a
    pile at rest.
    """
    codes_of = {sphere: at_links(*link, assembly.each) for sphere, link in assembly.link_of.items()}
    codes_of |= {body: at_boundaries(part) for body, part in boundaries.part_of.items()}
    rows = []
    for contact in contacts_of(yade, assembly):
        geom, phys = contact.geom, contact.phys
        n, p, pressed, sheared = geom.normal, geom.contactPoint, phys.normalForce, phys.shearForce
        codes = [codes_of[contact.id1], codes_of[contact.id2]]
        # YADE's forces act on the second body, and its normals point to it.
        sign = 1.0
        if codes[0] >= 0:
            sign = -1.0
        else:
            codes.reverse()
        friction = [sign * sheared[d] for d in range(3)]
        force = [sign * (pressed[d] + sheared[d]) for d in range(3)]
        load = pressed[0] * n[0] + pressed[1] * n[1] + pressed[2] * n[2]
        rows.append([*codes, load, p[0], p[1], p[2], *friction, *force])
    table = np.array(rows, dtype=np.float64).reshape(-1, 12)
    first, second = table[:, :2].astype(np.int64).T
    return contacts_of_points(
        first,
        second,
        loads=np.maximum(table[:, 2], 0.0),
        points=table[:, 3:6],
        friction=table[:, 6:9],
        forces=table[:, 9:],
        each=assembly.each,
    )


def measure_overlaps(
    yade: Yade, assembly: Assembly, boundaries: YadeBoundaries, law: ContactLaw, limit: float
) -> Overlaps:
    """Return the present overlaps; `Overlaps.deep` marks bodies with an overlap above `limit` [m]."""
    # Called often: without bonds all interactions are contacts, so that their bodies need not be looked up.
    contacts = contacts_of(yade, assembly) if assembly.bonded else (c for c in yade.omega.interactions if c.isReal)
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
    # Friction bounds the energy of tangential springs by that of normal springs.
    friction = max(law.friction, law.wall_friction)
    tangential = friction**2 * law.normal_stiffness / law.tangential_stiffness * normal
    return Overlaps(deepest, deep, normal + tangential + assembly.elastic_energy(), held)


def _held(yade: Yade, assembly: Assembly, boundaries: YadeBoundaries, deep: Flags, least: float) -> tuple[Held, ...]:
    """Return the bodies of `deep` that touch boundaries whose distance changed by over `least` [m]."""
    parts = boundaries.parts()
    part_of = {body: name for name, (bodies, _) in parts.items() for body in bodies}
    touched: dict[int, set[str]] = defaultdict(set)
    for contact in contacts_of(yade, assembly) if parts else ():
        for one, other in ((contact.id1, contact.id2), (contact.id2, contact.id1)):
            k, name = assembly.smarticle_of.get(one), part_of.get(other)
            if k is not None and name is not None and deep[k]:
                touched[k].add(name)
    return held_between(touched, {name: raised for name, (_, raised) in parts.items()}, least)
