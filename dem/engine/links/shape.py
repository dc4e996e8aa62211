"""A smarticle as this engine sees it: masses, lengths, and the strands that its links are made of.

Every link is swept by one sphere along one segment, or along several parallel ones: its strands. That is the limit of
the sphere chains of `dem.body.particle` as their pitch goes to zero: same section, same tips.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.body.particle import Boxes, Particle

Array = NDArray[np.float64]


class Shape(NamedTuple):
    """What all smarticles have in common, for the kernels. Lengths in m, masses in kg, inertias in kg m²."""

    mass: float  #: Of a smarticle
    middle_mass: float  #: Of the middle link
    barb_mass: float  #: Of one barb
    half: float  #: Half the length of the middle link: the hinges are this far from its centre
    arm: float  #: Half the length of a barb: its centre of mass is this far from the hinge
    middle_inertia: Array  #: (3,) of the middle link about its centre: along it, in the plane, along the normal
    barb_inertia: Array  #: (3,) the same of a barb
    end: float  #: How far the middle link's axis reaches from its centre: the hinges, but for a bar without barbs
    tip: float  #: How far a barb's axis reaches from the hinge: its tip less the radius
    radius: float  #: Of the sphere that sweeps the links
    offsets: Array  #: (strands,) of the strands along the normal
    kinds: NDArray[np.int64]  #: (links,) which links carry contact: 0 barb 1, 1 the middle link, 2 barb 2
    inverses: Array  #: (3,) inverse squares of the lengths of the links' axes [1/m²]
    reach: float  #: How far the axes of the links reach from the centre of mass, in the shape that it is poured in


def shape_of(particle: Particle) -> Shape:
    """The shape of a particle.

    Sources: tips pulled in by the radius, hinges inside the middle link: as spheres are put in `dem.body.particle`.
    """
    boxes, radius = particle.boxes, particle.radius
    masses, inertias = boxes.link_masses, boxes.link_inertias
    length, barb = boxes.middle_length, boxes.barb_length
    rows = particle.chain.rows
    reach = (boxes.thickness_normal - particle.chain.diameter) / 2
    end, tip = length / 2 if barb > 0 else length / 2 - radius, max(0.0, barb - radius)
    barbed = barb > radius  # the tip of a shorter one is inside the sphere at the hinge
    return Shape(
        mass=boxes.mass,
        middle_mass=float(masses[1]),
        barb_mass=float(masses[0]),
        half=length / 2,
        arm=barb / 2,
        middle_inertia=np.ascontiguousarray(inertias[1]),
        barb_inertia=np.ascontiguousarray(inertias[0]),
        end=end,
        tip=tip,
        radius=radius,
        offsets=np.zeros(1) if rows == 1 else np.linspace(-reach, reach, rows),
        kinds=np.array([0, 1, 2] if barbed else [1], dtype=np.int64),
        inverses=np.array([1 / extent**2 if extent > 0 else 0.0 for extent in (tip, 2 * end, tip)]),
        reach=_reach(boxes),
    )


def _reach(boxes: Boxes) -> float:
    return float(np.linalg.norm(boxes.vertices, axis=1).max())
