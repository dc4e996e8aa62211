"""Count smarticles and those that escaped; measure how a pile without a wall spreads, leans and sheds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import (
    Floats,
    UndefinedMeasureError,
    Vertices,
    centres_of_mass,
    checked_vertices,
    link_lengths,
)
from postprocess.measures.clusters import contact_clusters, entanglement_clusters
from postprocess.measures.heights import least_reaching
from postprocess.measures.registry import FrameMeasure, Quantity, Shown, in_space

TOUCHING = 1.05
"""Distance of centrelines over the diameter of the spheres up to which two smarticles count as touching [-].

Spheres that touch are a diameter apart or, pressed, less; beads rest in the gaps of the other chain, so that
centrelines come nearer still. A twentieth more keeps contacts that open and close while a pile settles.

It measures nearness, not contact: of piles on YADE it finds 1.4 times as many pairs as touch at rest after pouring,
1.9 to 2.1 at rest after shaking, 6 while shaken; see `contacts.pairs_in_contact`, which finds those that touch."""

OUTSIDE = 0.5
"""How far beyond the wall that was, in w, a centre of mass must be to have come off the pile [-].

A smarticle reaches about w/2 from its centre of mass: it then lies as a whole where no smarticle was. Distances are
from the middle of the pile, wherever that is by now: a pile that fell over as a whole has shed nothing."""


@dataclass(frozen=True, kw_only=True)
class FreePile:
    """A pile without a wall."""

    touching: float  #: Share of the smarticles in the largest cluster joined by contact [-]
    entangled: float  #: Share of them in the largest cluster joined by entanglement [-]
    radius_half: float  #: Radius about the vertical through the centre of mass that holds half of the material [m]
    radius_most: float  #: Radius that holds 95 % of it [m]
    sloughed: float  #: Share of the smarticles farther from the pile's middle than the wall was, see `OUTSIDE` [-]
    tilt: float  #: Angle of the pile from the vertical [degree], see `tilt`
    offset: float  #: Distance of the centre of mass from the vertical through the foot [m]


def free_pile(
    vertices: Vertices, run: Run, *, floor_z: float = 0.0, foot: tuple[float, float] = (0.0, 0.0)
) -> FreePile:
    """Measure a pile without a wall, of a run's container and smarticles.

    Args:
        floor_z: Height of the floor [m].
        foot: x and y of the point that the pile stands on [m]: the container's axis if not given, better the place
            of the centre of mass while the wall was there.

    Raises:
        UndefinedMeasureError: There is no smarticle.
    """
    vertices = checked_vertices(vertices)
    centre = centre_of_mass(vertices)
    return FreePile(
        touching=contact_clusters(vertices, TOUCHING * run.manifest.sphere_diameter_m).largest,
        entangled=entanglement_clusters(vertices).largest,
        radius_half=spread_radius(vertices, share=0.5),
        radius_most=spread_radius(vertices, share=0.95),
        sloughed=share_outside(
            vertices, run.manifest.container_radius_m + OUTSIDE * run.manifest.middle_length_m, axis=middle(vertices)
        ),
        tilt=math.degrees(tilt(vertices, foot=foot, floor_z=floor_z)),
        offset=math.hypot(centre[0] - foot[0], centre[1] - foot[1]),
    )


def centre_of_mass(vertices: Vertices) -> Floats:
    """Return the centre of mass (3,) [m] of the whole pile.

    Raises:
        UndefinedMeasureError: There is no smarticle.
    """
    vertices = checked_vertices(vertices)
    if len(vertices) == 0:
        raise UndefinedMeasureError("a centre of mass needs at least 1 smarticle: got 0")
    # Smarticles may differ in length, so their centres are weighted by it.
    weights = link_lengths(vertices).sum(axis=1)
    centre: Floats = np.average(centres_of_mass(vertices), axis=0, weights=weights)
    return centre


def spread_radius(vertices: Vertices, *, share: float, axis: tuple[float, float] | None = None) -> float:
    """Find the radius [m] about a vertical axis that holds a share of the links' material, above 0 and up to 1.

    The material is spread evenly along each link's centreline. What of a link lies within a radius is where a straight
    line is inside a circle, seen from above; the radius is found by bisection: exact, without sampling. The axis, x and
    y [m], is that of the pile's centre of mass if not given.

    Raises:
        InputError: Bad share.
        UndefinedMeasureError: There is no smarticle.
    """
    vertices = checked_vertices(vertices)
    if not 0 < share <= 1:
        raise InputError(f"share must be above 0 and up to 1 of the material: got {share}; 0.95 is usual")
    centre = centre_of_mass(vertices)[:2] if axis is None else np.asarray(axis)
    points = vertices[:, :, :2] - centre
    start, along = points[:, :-1].reshape(-1, 2), np.diff(points, axis=1).reshape(-1, 2)
    weights = link_lengths(vertices).ravel()
    wanted = share * weights.sum()
    farthest = float(np.linalg.norm(points, axis=2).max())
    return least_reaching(lambda radius: float(weights @ _shares_within(start, along, radius)), wanted, 0.0, farthest)


def share_outside(vertices: Vertices, radius: float, *, axis: tuple[float, float] = (0.0, 0.0)) -> float:
    """Return the share [-] of smarticles whose centre of mass is farther than a radius [m] from an axis.

    Raises:
        UndefinedMeasureError: There is no smarticle.
    """
    centres = centres_of_mass(vertices)
    if len(centres) == 0:
        raise UndefinedMeasureError("a share of smarticles needs at least 1 of them: got 0")
    return float((np.hypot(*(centres[:, :2] - axis).T) > radius).mean())


def middle(vertices: Vertices) -> tuple[float, float]:
    """Return the middle of a pile seen from above, x and y [m]: medians, which ignore strays."""
    x, y = np.median(centres_of_mass(vertices)[:, :2], axis=0)
    return float(x), float(y)


def tilt(vertices: Vertices, *, foot: tuple[float, float] = (0.0, 0.0), floor_z: float = 0.0) -> float:
    """Return the angle [rad] from the vertical to the line from a pile's foot on the floor to its centre of mass.

    A pile that is turned rigidly about its foot by an angle has that tilt; one that spreads evenly to all sides has
    none. The principal axis of the pile's inertia would not do: it lies level in every pile that is lower than about
    1.7 times its radius (a solid cylinder's axes change places there), and a leaning pile has the axis of a sheared
    one. The foot, x and y [m] on a floor of a height [m], is not the middle of what now lies on it: a column that has
    fallen over lies above the middle of its side, and would be upright.

    Raises:
        UndefinedMeasureError: There is no smarticle, or the centre of mass is not above the floor.
    """
    x, y, z = centre_of_mass(vertices) - [*foot, floor_z]
    if not z > 0:
        raise UndefinedMeasureError(f"the centre of mass is {-z:g} m below the floor; check floor_z")
    return math.atan2(math.hypot(x, y), z)


def has_toppled(offset: float, base_radius: float) -> bool:
    """Whether a pile has fallen over: its centre of mass is no longer above the base that it stood on.

    A body stands as long as the vertical through its centre of mass, at an offset [m] from that through the foot, meets
    its base, of a radius [m] before the pile was free. A pile that spreads or sheds smarticles to all sides keeps its
    centre of mass where it was.
    """
    return offset > base_radius


def _shares_within(start: Floats, along: Floats, radius: float) -> Floats:
    """Return shares (n,) of lines (start, start + along), each (n, 2), within a circle about the origin."""
    square, mixed = (along**2).sum(axis=1), (start * along).sum(axis=1)
    inside = radius**2 - (start**2).sum(axis=1)
    # Upright links are points seen from above.
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
    """Count smarticles with their centre of mass beside or below the container."""
    centres = centres_of_mass(frame.vertices)
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
        available_for=in_space,
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
        # Of a run that takes its wall away.
        available_for=lambda run: not (run.manifest.planar or run.manifest.walled(run.phases[-1].index)),
    ),
)
