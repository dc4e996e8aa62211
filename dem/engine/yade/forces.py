"""Forces at contacts, read from YADE's interactions: those of the last step.

Without what a tangential dashpot adds while its contact does not slide: YADE keeps that nowhere, and it is nothing in a
pile at rest.
"""

from __future__ import annotations

import numpy as np

from dem.body.forces import ContactForces, at_boundaries, at_links, contacts_of_points
from dem.engine.yade.assembly import Assembly
from dem.engine.yade.boundaries import YadeBoundaries
from dem.engine.yade.dissipation import contacts_of
from dem.engine.yade.library import Yade


def contact_forces(yade: Yade, assembly: Assembly, boundaries: YadeBoundaries) -> ContactForces:
    """Forces at all contacts; those of spheres of one pair of links are one contact.

    Args:
        yade: the simulation.
        assembly: the smarticles in it.
        boundaries: what does not give way.
    """
    smarticles = {sphere: at_links(*told) for sphere, told in assembly.link_of.items()}
    parts = {body: at_boundaries(part) for body, part in boundaries.part_of.items()}
    rows = []
    for contact in contacts_of(yade, assembly):
        geom, phys = contact.geom, contact.phys
        n, p, pressed, sheared = geom.normal, geom.contactPoint, phys.normalForce, phys.shearForce
        codes = [smarticles[body] if body in smarticles else parts[body] for body in (contact.id1, contact.id2)]
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
    )
