"""Shapes of bodies on the engine links: segments that are swept by spheres, with masses and inertias.

A flat link consists of several parallel swept segments, its strands. Strands are the limit of the sphere chains of
`dem.body.particle` at a pitch of zero, with equal sections and tips. A smarticle is the shape whose barbs turn about
two hinges; other shapes are rigid bodies, or filaments, which `dem.engine.links.motion.bending` moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.body.bars import Bars, first_ends, owners
from dem.body.filament import Filament
from dem.body.kinds import Kind
from dem.body.linkage import Linkage
from dem.body.particle import Particle
from dem.engine.links.compiler import inlined
from dem.physics.contact import typical_effective_mass

Array = NDArray[np.float64]

# Columns of a segment: start of its axis and vector to its end [m], inverse squared length [1/m²], radius [m].
START, VECTOR, INVERSE, RADIUS, LINE = 0, 3, 6, 7, 8
AT_START, AT_END = 1, 2  # bits: the segment starts, or ends, at a joint that another segment of the body owns
# Bit: the energy of two such segments is the mean over both orders of them, see `contact.meeting`. Bars of smarticles
# are so long that the order makes no difference to most of their contacts; they, filaments and chains do without.
EITHER_ORDER = 4


class Planar(NamedTuple):
    """Geometry of three hinged links in a plane. Lengths in m, masses in kg, inertias in kg m²."""

    mass: float  #: Mass of a smarticle
    middle_mass: float  #: Mass of the middle link
    barb_mass: float  #: Mass of one barb
    half: float  #: Half the length of the middle link: distance of the hinges from its centre
    arm: float  #: Half the length of a barb: distance of its centre of mass from the hinge
    end: float  #: Distance of the ends of the middle link's axis from its centre: `half`; without barbs, a radius less
    tip: float  #: Distance of the end of a barb's axis from the hinge: the barb's length less the radius
    middle_xx: float  #: Inertia of the middle link about its length, through its centre
    middle_yy: float  #: Inertia of the middle link about the in-plane axis across it, through its centre
    middle_zz: float  #: Inertia of the middle link about the normal, through its centre
    barb_xx: float  #: Inertia of a barb about its length, through its centre
    barb_yy: float  #: Inertia of a barb about the in-plane axis across it, through its centre
    barb_zz: float  #: Inertia of a barb about the normal, through its centre


@dataclass(frozen=True, kw_only=True)
class Shape:
    """Shape of a body, in a frame with its origin at the centre of mass.

    The axes of the frame are those of the middle link of a smarticle, the principal axes of a
    rigid body, or those of the laboratory for a filament; the segments of a linkage are those of its links as poured.
    """

    mass: float  #: Mass of the body [kg]
    #: (4,) inertia xx, yy, zz and xy of a rigid body [kg m²]; 0 for a smarticle, whose inertia depends on angles
    inertia: Array
    lines: Array  #: (M, LINE) segments, link by link; for the columns see `START`
    link: NDArray[np.int64]  #: (M,) link of each segment; for a smarticle 0 barb 1, 1 middle link, 2 barb 2
    shared: NDArray[np.uint8]  #: (M,) ends that another segment owns, `AT_START` and `AT_END`; or `EITHER_ORDER`
    effective_mass: float  #: Harmonic mean of the effective mass over points and directions [kg]; damping depends on it
    planar: Planar | None = None  #: Geometry of a smarticle; None for other bodies
    filament: Filament | None = None  #: Kind of filament of a flexible body; None for other bodies
    linkage: Linkage | None = None  #: Links and joints of a linkage; None for other bodies

    @property
    def flexible(self) -> bool:
        """Whether each link is a part that kernels of filaments or linkages move."""
        return self.filament is not None or self.linkage is not None

    @property
    def reach(self) -> float:
        """Largest distance of the links' axes from the centre of mass [m], at a smarticle's initial angles."""
        starts, ends = self.lines[:, :3], self.lines[:, :3] + self.lines[:, 3:6]
        return float(np.linalg.norm(np.concatenate([starts, ends]), axis=1).max(initial=0.0))


class Shapes(NamedTuple):
    """All K shapes of a pile with their M segments, as arrays for the kernels."""

    mass: Array  #: (K,) masses of the bodies [kg]
    radius: Array  #: (K,) radii of the thinnest segments [m]
    reach: Array  #: (K,) largest distances of the links' axes from the centre of mass [m]
    hinged: NDArray[np.uint8]  #: (K,) whether the shape is a smarticle, whose barbs can turn
    planar: Array  #: (K, 13) fields of `Planar`; 0 for rigid bodies
    first: NDArray[np.int64]  #: (K + 1,) index in `lines` of the first segment of each shape, then M
    lines: Array  #: (M, LINE) segments in the frame of the body; for the columns see `START`
    link: NDArray[np.int64]  #: (M,) link of each segment
    flexible: Any  #: (K,) whether kernels of filaments or linkages move such bodies; None if they move none


@inlined
def is_flexible(flexible: Any, kind: int) -> bool:
    """Return whether bodies of shape `kind` are flexible; `flexible`: `Shapes.flexible`."""
    if flexible is None:
        return False
    return bool(flexible[kind] != 0)


def table_of(shapes: Sequence[Shape]) -> Shapes:
    """Return shapes as arrays for the kernels."""
    flexible = np.array([shape.flexible for shape in shapes], dtype=np.uint8)
    return Shapes(
        mass=np.array([shape.mass for shape in shapes]),
        radius=np.array([shape.lines[:, RADIUS].min() for shape in shapes]),
        reach=np.array([shape.reach for shape in shapes]),
        hinged=np.array([shape.planar is not None for shape in shapes], dtype=np.uint8),
        planar=np.array([shape.planar or np.zeros(len(Planar._fields)) for shape in shapes]),
        first=np.cumsum([0, *(len(shape.lines) for shape in shapes)]),
        lines=np.concatenate([shape.lines for shape in shapes]),
        link=np.concatenate([shape.link for shape in shapes]),
        flexible=flexible if flexible.any() else None,
    )


def planar_of(particle: Particle) -> Planar:
    """Return the planar geometry of a smarticle.

    Like the spheres of `dem.body.particle`, axes of barbs end a radius before the tip, and the axis of the middle link
    ends at the hinges.
    """
    boxes, radius = particle.boxes, particle.radius
    length, barb = boxes.middle_length, boxes.barb_length
    return Planar(
        boxes.mass, float(boxes.link_masses[1]), float(boxes.link_masses[0]), length / 2, barb / 2,
        length / 2 if barb > 0 else length / 2 - radius, max(0.0, barb - radius),
        *(float(moment) for link in (1, 0) for moment in boxes.link_inertias[link]),
    )  # fmt: skip


def smarticle_shape(particle: Particle) -> Shape:
    """Return the shape of a smarticle, with its barbs at their initial angles."""
    boxes, planar, strands = particle.boxes, planar_of(particle), particle.offsets
    directions, (x, y, _) = boxes.directions, boxes.plain_centre_of_mass
    axes = [(1, -planar.end, 2 * planar.end)]
    if boxes.barb_length > particle.radius:  # the tip of a shorter one is inside the sphere at the hinge
        axes = [(0, -planar.half, planar.tip), *axes, (2, planar.half, planar.tip)]
    rows = [[start - x, -y, z, *(extent * directions[link])] for link, start, extent in axes for z in strands]
    links = np.repeat([link for link, _, _ in axes], len(strands))
    return Shape(
        mass=boxes.mass,
        inertia=np.zeros(4),  # it follows from the angles
        lines=_lines(np.array(rows), particle.radius),
        link=links,
        # Barbs start at hinges, where the middle link ends.
        shared=np.where(links == 1, 0, AT_START).astype(np.uint8),
        effective_mass=typical_effective_mass(particle),
        planar=planar,
    )


def kind_shape(kind: Kind) -> Shape:
    """Return the shape of a kind of body."""
    if kind.filament is not None:
        return filament_shape(kind.filament)
    shape = rigid_shape(kind.bars, kind.rows, kind.radius)
    shape = replace(shape, effective_mass=typical_effective_mass(kind), linkage=kind.linkage)
    if kind.linkage is not None:
        # Links that fold touch each other but for neighbours: none owns the joint where a third one touches.
        return replace(shape, shared=np.zeros_like(shape.shared))
    return replace(shape, shared=shape.shared | np.uint8(EITHER_ORDER))


def link_shapes(kind: Kind) -> list[Shape]:
    """Return the shapes of the links of a linkage, each along x of its own frame; none of another body."""
    found = []
    for number, piece in enumerate(kind.pieces):
        own, free = piece.bars, kind.bars.free[number]
        half = float(own.lengths[0]) / 2 - kind.radius * free
        shape = rigid_shape(own, 1, kind.radius)
        found.append(replace(shape, lines=_lines(np.array([[-half[0], 0.0, 0.0, half.sum(), 0.0, 0.0]]), kind.radius)))
    return found


def rigid_shape(bars: Bars, rows: int = 1, radius: float | None = None) -> Shape:
    """Return the shape of a rigid body of bars.

    Each bar has `rows` strands. The diameter of a single strand is the mean width of the section; that of several
    strands is the bar's thickness in the plane. The radius of the strands is in [m]; None: from `Bars.radius`.
    """
    radius = bars.radius(rows) if radius is None else radius
    reach = 0.0 if rows == 1 else bars.thickness_normal / 2 - radius
    starts, ends = bars.axes(radius)
    # (bars, rows, 3): strands along each bar's normal.
    offsets = np.linspace(-reach, reach, rows)[:, None] * bars.frames[:, None, :, 2]
    points = np.stack([starts[:, None] + offsets, ends[:, None] + offsets], axis=2).reshape(-1, 2, 3)
    later = ~owners(first_ends(points), np.repeat((~bars.free).all(axis=1), 2 * rows)).reshape(-1, 2)
    xx, yy, zz = bars.inertia
    return Shape(
        mass=bars.mass,
        inertia=np.array([xx, yy, zz, 0.0]),
        lines=_lines(np.concatenate([points[:, 0], points[:, 1] - points[:, 0]], axis=1), radius),
        link=np.repeat(np.arange(len(starts)), rows),
        # Strands of bars that are twisted against each other do not meet, and count apart.
        shared=(later * [AT_START, AT_END]).sum(axis=1).astype(np.uint8),
        effective_mass=bars.effective_mass,
    )


def filament_shape(filament: Filament) -> Shape:
    """Return the shape of a filament, straight along x."""
    count, length = filament.nodes - 1, filament.segment_length
    axes = np.zeros((count, 6))
    axes[:, 0], axes[:, 3] = (np.arange(count) - count / 2) * length, length
    return Shape(
        mass=filament.mass,
        inertia=np.zeros(4),  # nodes move by themselves
        lines=_lines(axes, filament.diameter / 2),
        link=np.arange(count),
        shared=np.where(np.arange(count) > 0, AT_START, 0).astype(np.uint8),
        effective_mass=filament.effective_mass,
        filament=filament,
    )


def _lines(axes: Array, radius: float) -> Array:
    """Return segments (M, LINE) of a radius [m] from axes (M, 6): start, and vector from start to end [m]."""
    squares = (axes[:, 3:6] ** 2).sum(axis=1)
    inverses = np.divide(1.0, squares, out=np.zeros(len(axes)), where=squares > 0)
    return np.column_stack([axes, inverses, np.full(len(axes), radius)])
