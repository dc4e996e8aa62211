"""Count all and escaped smarticles; measure how a pile without a wall spreads and tilts."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.bars import body_centres
from postprocess.geometry.links import (
    Floats,
    UndefinedMeasureError,
    Vertices,
    centres_of_mass,
    checked_vertices,
    link_lengths,
)
from postprocess.measures.clusters import contact_clusters, entanglement_clusters
from postprocess.measures.contacts import chain_of
from postprocess.measures.heights import least_reaching
from postprocess.measures.registry import FrameMeasure, Quantity, Shown, any_in_space, in_space

TOUCHING = 1.05
"""Largest distance of two strands' axes at which smarticles count as neighbours, over their diameter [-].

The 5 % keep contacts that open and close while a pile settles. Neighbours need not touch: on YADE there are 1.4 times
as many neighbours as touching pairs at rest after pouring, 1.9 to 2.1 times at rest after shaking, and 6 times while
shaken.
`contacts.pairs_in_contact` finds the pairs that touch."""

OUTSIDE = 0.5
"""Distance beyond the former wall at which a smarticle has come off the pile, over w [-].

A smarticle reaches about w/2 from its centre of mass, so at this distance no part of it lies inside the former wall.
The distance is measured from the present middle of the pile: a pile that fell over as a whole has lost no smarticle."""


@dataclass(frozen=True, kw_only=True)
class FreePile:
    """Measures of a pile without a wall."""

    touching: float  #: Fraction of the smarticles in the largest cluster of neighbours, see `TOUCHING` [-]
    entangled: float  #: Fraction of the smarticles in the largest cluster joined by crossings [-]
    radius_half: float  #: Radius around the vertical through the centre of mass that holds 50 % of the material [m]
    radius_most: float  #: Radius around the vertical through the centre of mass that holds 95 % of the material [m]
    sloughed: float  #: Fraction of the smarticles that have come off the pile, see `OUTSIDE` [-]
    tilt: float  #: Angle of the pile from the vertical [degree], see `tilt`
    offset: float  #: Horizontal distance of the centre of mass from the foot [m]


def free_pile(
    vertices: Vertices, run: Run, *, floor_z: float = 0.0, foot: tuple[float, float] = (0.0, 0.0)
) -> FreePile:
    """Measure a pile without a wall, by its vertices (N, 4, 3) [m] and the height of its floor [m].

    The foot, x and y [m], is the point on which the pile stood, best the centre of mass before the wall was removed.
    """
    vertices = checked_vertices(vertices)
    centre, chain = centre_of_mass(vertices), chain_of(run)
    # Outliers have little influence on medians.
    middle = np.median(centres_of_mass(vertices)[:, :2], axis=0)
    return FreePile(
        touching=contact_clusters(vertices, chain, TOUCHING * chain.diameter).largest,
        entangled=entanglement_clusters(vertices).largest,
        radius_half=spread_radius(vertices, share=0.5),
        radius_most=spread_radius(vertices, share=0.95),
        sloughed=share_outside(
            vertices, run.manifest.container_radius_m + OUTSIDE * run.manifest.middle_length_m, axis=middle
        ),
        tilt=math.degrees(tilt(vertices, foot=foot, floor_z=floor_z)),
        offset=math.hypot(centre[0] - foot[0], centre[1] - foot[1]),
    )


def centre_of_mass(vertices: Vertices) -> Floats:
    """Return the centre of mass (3,) [m] of the whole pile; UndefinedMeasureError if it is empty."""
    vertices = checked_vertices(vertices)
    if len(vertices) == 0:
        raise UndefinedMeasureError("a centre of mass needs at least 1 smarticle: got 0")
    # Smarticles may differ in length, so their centres are weighted by it.
    weights = link_lengths(vertices).sum(axis=1)
    centre: Floats = np.average(centres_of_mass(vertices), axis=0, weights=weights)
    return centre


def spread_radius(vertices: Vertices, *, share: float) -> float:
    """Return the radius [m] around the vertical axis through the centre of mass that holds a fraction of the material.

    The material is spread evenly along each link's centreline. The part of each centreline inside a circle, seen from
    above, is exact; the radius is found by bisection. InputError unless the fraction `share` is above 0 and up to 1.
    """
    vertices = checked_vertices(vertices)
    if not 0 < share <= 1:
        raise InputError(f"share must be above 0 and up to 1 of the material: got {share}; 0.95 is usual")
    points = vertices[:, :, :2] - centre_of_mass(vertices)[:2]
    start, along = points[:, :-1].reshape(-1, 2), np.diff(points, axis=1).reshape(-1, 2)
    weights = link_lengths(vertices).ravel()
    level = share * weights.sum()
    farthest = float(np.linalg.norm(points, axis=2).max())
    return least_reaching(lambda radius: float(weights @ _shares_within(start, along, radius)), level, 0.0, farthest)


def share_outside(vertices: Vertices, radius: float, *, axis: ArrayLike = (0.0, 0.0)) -> float:
    """Return the fraction [-] of smarticles outside a cylinder around a vertical axis.

    The position of a smarticle is its centre of mass. The cylinder has a radius [m] and an axis through x and y [m].
    UndefinedMeasureError if there is no smarticle.
    """
    centres = centres_of_mass(vertices)
    if len(centres) == 0:
        raise UndefinedMeasureError("a fraction of smarticles needs at least 1 smarticle: got 0")
    return float((np.hypot(*(centres[:, :2] - np.asarray(axis)).T) > radius).mean())


def tilt(vertices: Vertices, *, foot: tuple[float, float] = (0.0, 0.0), floor_z: float = 0.0) -> float:
    """Return the angle [rad] between the vertical and the line from a pile's foot to its centre of mass.

    A rigid rotation of a pile about its foot, x and y [m], changes the tilt by the angle of rotation; a pile that
    spreads evenly to all sides keeps the tilt 0. The principal axis of inertia is no substitute: it is horizontal in
    every pile lower than about 1.7 times its radius. UndefinedMeasureError if the centre of mass is not above the
    floor.
    """
    x, y, z = centre_of_mass(vertices) - [*foot, floor_z]
    if not z > 0:
        raise UndefinedMeasureError(f"the centre of mass is {-z:g} m below the floor; check floor_z")
    return math.atan2(math.hypot(x, y), z)


def _shares_within(start: Floats, along: Floats, radius: float) -> Floats:
    """Return the fraction of each line segment inside a circle around the origin, (n,).

    `start` (n, 2) are the first ends [m], `along` (n, 2) the vectors to the other ends [m].
    """
    square, mixed = (along**2).sum(axis=1), (start * along).sum(axis=1)
    inside = radius**2 - (start**2).sum(axis=1)
    # A vertical link is a point seen from above.
    upright = square <= 1e-24 + 1e-18 * radius**2
    safe = np.where(upright, 1.0, square)
    root = mixed**2 + safe * inside
    reach = np.sqrt(np.maximum(root, 0.0))
    first, last = (np.clip((-mixed + sign * reach) / safe, 0, 1) for sign in (-1, 1))
    shares: Floats = np.where(upright, (inside >= 0).astype(float), np.where(root > 0, last - first, 0.0))
    return shares


def _free_pile_of(frame: Frame, run: Run) -> tuple[float, ...]:
    if run.manifest.walled(frame.phase):
        return (math.nan,) * 6
    pile = free_pile(frame.vertices, run, floor_z=frame.floor_z)
    return pile.touching, pile.entangled, pile.radius_half, pile.radius_most, pile.sloughed, pile.tilt


def escaped(frame: Frame, run: Run) -> int:
    """Count the bodies whose centre of mass is outside the container's radius or below its floor."""
    centres = body_centres(frame)
    outside = np.hypot(centres[:, 0], centres[:, 1]) > run.manifest.container_radius_m
    return int((outside | (centres[:, 2] < frame.floor_z)).sum())


MEASURES = (
    FrameMeasure(
        name="smarticles",
        place=10,
        quantities=(Quantity("smarticles", "-", Shown(heading="smarticles", place=0, form=".4g")),),
        take=lambda frame, _: (frame.count,),
    ),
    FrameMeasure(
        name="escaped",
        place=20,
        quantities=(Quantity("escaped", "-"),),
        take=lambda frame, run: (escaped(frame, run),),
        available_for=any_in_space,
    ),
    FrameMeasure(
        name="free pile",
        place=60,
        quantities=(
            Quantity("largest cluster by contact", "-"),
            Quantity("largest cluster by crossings", "-"),
            Quantity("spread radius 50 %", "m"),
            Quantity("spread radius 95 %", "m"),
            Quantity("sloughed", "-"),
            Quantity("tilt", "degree"),
        ),
        take=_free_pile_of,
        # The last phase of such a run has no wall any more.
        available_for=lambda run: in_space(run) and not run.manifest.walled(run.phases[-1].index),
    ),
)
