"""Arrays that kernels read and write, and functions that make them.

All arrays are contiguous, and none is made in a step. Kernels are compiled without fields that are None.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.engine.links.shapes import LINE, Shapes

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

PLANE = 27  # numbers that describe the plane geometry of a smarticle, see `dem.engine.links.motion.planar`
FLOOR, WALL, LOWER, UPPER, CHANNEL, PLATE, BOUNDARIES = 0, 1, 2, 3, 4, 6, 7  # rows of `Ground`; the channel has two
BINS = 4  # of the search for neighbours, per link
LEDGER = 10  # numbers of a row of the ledger, see `dem.engine.links.contact.pairs.enter`
SLOTS = 3  # points at which a pair of segments can touch, see `dem.engine.links.contact.meeting`
# Columns of a part: velocity at a point [m/s], angular velocity [rad/s], that point [m].
VELOCITY, SPIN, ORIGIN, MOTION = 0, 3, 6, 9
# Columns of a part that stretches: its axis [1], rate of strain [1/s], first moment of axial forces [N m].
AXIS, STRAIN_RATE, MOMENT, STRETCH = 0, 3, 4, 5


class Bodies(NamedTuple):
    """N bodies. The fields from `position` to `shape` are their state.

    Velocities and momenta are those at the middle of the previous step, as in all leapfrog schemes.
    """

    position: Array  #: (N, 3) centres of mass [m]
    turn: Array  #: (N, 4) unit quaternions (w, x, y, z) from the frame of the body to the laboratory frame [1]
    velocity: Array  #: (N, 3) velocities of the centres of mass [m/s]
    momentum: Array  #: (N, 3) angular momenta about the centres of mass, in the laboratory frame [kg m²/s]
    alpha: Array  #: (N, 2) angles of a smarticle's barbs [rad]; of no meaning for other bodies
    rate: Array  #: (N, 2) rates of the barbs' angles [rad/s]; 0 while welded
    shape: Indices  #: (N,) number of each body's shape in `Shapes`
    #: (N, PLANE) plane geometry of smarticles, see `dem.engine.links.motion.planar.lay_out`; of rigid bodies only the
    #: inertia, in columns 14 to 17; of no meaning for filaments
    plane: Array
    spin: Array  #: (N, 3) angular velocities of the bodies' frames, in the laboratory frame [rad/s]
    axes: Array  #: (N, 3, 3) rotation matrices from the frame of the body to the laboratory frame [1]
    load: Array  #: (N, 6) force [N] and torque about the centre of mass [N m] of contacts in this step, without weight
    deepest: Array  #: (N,) largest overlap since the last query, over the overlap at which axes meet [1]


class Parts(NamedTuple):
    """R parts of bodies: one of a rigid body, three of a smarticle, one for each segment of a filament.

    While smarticles are welded, the first part of a smarticle stands for the whole smarticle.
    """

    begin: Indices  #: (N + 1,) number of the first part of each body, then R
    #: (R, MOTION) velocity at a reference point of the part [m/s], angular velocity [rad/s] and the reference point
    #: [m], in the columns from `VELOCITY`, `SPIN` and `ORIGIN` on
    motion: Array
    load: Array  #: (R, 6) force [N] and torque about the reference point [N m] of contacts in this step
    #: (R, STRETCH) of parts that stretch: axis [1], rate of strain along the axis [1/s], and sum over contacts of axial
    #: force times axial distance from the reference point [N m]; None if no body is flexible
    stretch: Any


class Segments(NamedTuple):
    """Q segments of all bodies, which have L links in all.

    A link consists of one segment, or of several segments side by side, which are called its strands.
    """

    line: Array  #: (Q, LINE) segments in the laboratory frame; for the columns see `dem.engine.links.shapes.START`
    begin: Indices  #: (N + 1,) number of the first segment of each body, then Q
    body: Indices  #: (Q,) number of the body to which each segment belongs
    part: Indices  #: (Q,) number of the part with which each segment moves
    shared: NDArray[np.uint8]  #: (Q,) ends that another segment owns, and `EITHER_ORDER`: bits, see `shapes.AT_START`
    first: Indices  #: (L + 1,) number of the first segment of each link, then Q
    bends: Any  #: `Bends`; None where no body is flexible


class Bends(NamedTuple):
    """Further data of segments, for flexible bodies; Q is the number of segments of all bodies."""

    apart: Indices  #: (Q,) least difference between the numbers of two segments of one body that can touch; 0: none can
    ends: Array  #: (Q, 6) velocities of start and end of each segment of flexible bodies [m/s]


class Pairs(NamedTuple):
    """Lists of near segments: the wide list, and the tight list of those pairs that can touch soon.

    Arrays have room for P pairs, of which `counts` are in use. Pairs with equal `first` stand one after the other.
    """

    first: Indices  #: (P,) number of the segment with the lower number
    second: Indices  #: (P,) number of the other segment
    slip: Array  #: (P, SLOTS, 4) stretch of the tangential spring at each point of contact [m], and its energy [J]
    used: NDArray[np.uint8]  #: (P,) points of contact that touched in the last step, as bits
    near: Indices  #: (P,) tight list: indices of pairs that can touch soon
    touching: Indices  #: (P,) indices of the pairs that touch, or touched in the last step
    #: (P, 2) places s and t (0 to 1) of the nearest points along both segments of the pairs in `touching`
    nearest: Array
    counts: NDArray[np.int64]  #: (4,) number of pairs of the wide list and of the tight list, number of builds of each
    wide_marks: Array  #: (Q, 7) starts and ends of all segments when the wide list was built, and their skins [m]
    near_marks: Array  #: (Q, 7) starts and ends of all segments when the tight list was built, and their skins [m]
    wide_centres: Array  #: (N, 3) centres of mass when the wide list was built [m]
    near_centres: Array  #: (N, 3) centres of mass when the tight list was built [m]


class Cells(NamedTuple):
    """Arrays of the search for neighbours. A group consists of all pairs that have the same first segment."""

    keys: Indices  #: (L,) bin of each link
    order: Indices  #: (L,) numbers of the links sorted by bin, and within a bin by number
    starts: Indices  #: (bins + 2,) entry k + 1 is the index in `order` of the first link of bin k
    marks: Array  #: (Q, 7) starts and ends of all segments at the search, and their skins [m]
    centres: Array  #: (N, 3) centres of mass at the search [m]
    own: Array  #: (L, 6) lower and upper corner of the box about each link [m]
    boxes: Array  #: (6, L) corners of `own`, in the order of `order`; a row has one coordinate of all boxes [m]
    #: (L, LINE + 1) middles of links and their skins [m], in the order of `order`; see `search.copy_by_bin`
    lines: Array
    close: Indices  #: (2 L,) indices in `order` of links whose boxes overlap one link's box; second half: scratch
    places: Indices  #: (Q,) number of the group of each segment
    rows: Indices  #: (Q + 2,) index of the first pair of each group
    lower: Indices  #: (P,) segment with the lower number of each pair, in the order in which pairs are found
    upper: Indices  #: (P,) segment with the higher number of each pair, in the order in which pairs are found
    first: Indices  #: (P,) segment with the lower number of each pair, group by group
    second: Indices  #: (P,) segment with the higher number of each pair, group by group
    slip: Array  #: (P, SLOTS, 4) `Pairs.slip` of the contacts in the previous list
    used: NDArray[np.uint8]  #: (P,) `Pairs.used` of the contacts in the previous list


class Law(NamedTuple):
    """Spring, dashpot and friction of contacts: those between bodies, or those of bodies with boundaries."""

    stiffness: float  #: Normal stiffness kn [N/m]
    shear: float  #: Tangential stiffness ks [N/m]
    damping: Array  #: (K, K) normal damping cn by the shapes of both bodies, or (K, 1) at boundaries [N s/m]
    shear_damping: float  #: Tangential over normal damping, cs/cn, while the contact sticks [1]
    friction: float  #: Coulomb coefficient [1]


class Kept(NamedTuple):
    """Memory of contacts with boundaries; each possible contact of a segment has a fixed column, its slot."""

    slip: Array  #: (Q, slots, 4) stretch of the tangential spring [m], and its energy [J]
    used: NDArray[np.uint8]  #: (Q, slots) whether there was a contact in the last step
    contacts: NDArray[np.uint8]  #: (Q,) number of contacts of each segment in the last step


class Ground(NamedTuple):
    """Floor and wall, and the motion of all boundaries.

    Rows of arrays of 7 are floor, wall, lower hook, upper hook, a channel's lower and upper wall, and plate. The walls
    of a channel never move.
    """

    #: (tiers,) heights of the lower ends of the wall's tiers above `place` of the wall, lowest first [m]
    bottoms: Array
    radii: Array  #: (tiers,) radii of the tiers [m]
    top: float  #: Height of the wall's upper end above `place` of the wall [m]
    #: (2,) whether the wall exists, and whether it was lifted, so that links can touch its outside
    flags: NDArray[np.int64]
    place: Array  #: (7,) heights [m]; of the wall: its rise since the start; of the plate: inf while there is none
    speed: Array  #: (7,) vertical velocities [m/s]
    rise: Array  #: (7,) the part of these velocities that is not shaking [m/s]
    base: Array  #: (7,) heights about which boundaries are shaken [m]
    shaken: NDArray[np.int64]  #: (7,) whether a boundary is shaken
    wave: Array  #: (3,) amplitude [m], angular frequency 2πf [rad/s] and time of the beginning [s] of the shaking
    force: Array  #: (7, 3) forces of the bodies on the boundaries in the last step [N]
    sums: Array  #: (7, 3) these forces, summed over all steps [N]


class Hooks(NamedTuple):
    """Two hooks of two or more bars each, which lie along x and y; their heights are in `Ground.place`."""

    counts: NDArray[np.int64]  #: (2,) number of bars of the lower and of the upper hook; the larger number is B
    #: (2, B, LINE) segments of the bars; for the columns see `shapes.START`. x and y are from the container's axis.
    #: z is set from `Ground.place` before use
    bars: Array
    radius: float  #: Radius of the bars [m]


class Rims(NamedTuple):
    """Circular edges of the wall that links can touch: where a tier begins, and below a lifted wall.

    A tier is one of the wall's coaxial cylinders, which stand on each other and become narrower upwards.
    """

    heights: Array  #: (rims,) heights above `place` of the wall [m]
    radii: Array  #: (rims,) radii [m]


class Boundaries(NamedTuple):
    """All boundaries. Kernels are compiled without the boundaries that are None."""

    ground: Ground  #: Floor and wall, and the motion of all boundaries
    channel: Any  #: (1,) half the distance of a channel's walls [m], inf without walls; None in a container
    hooks: Any  #: `Hooks`; None: no hooks
    rims: Any  #: `Rims`; None: the wall has no edges that links can reach


class Cords(NamedTuple):
    """k strings. One end of a string, the knot, is tied to a link; the other end is the anchor."""

    owner: NDArray[np.int64]  #: (k, 2) smarticle and link of each knot
    along: Array  #: (k,) distance of the knot from the link's centre towards the link's end [m]
    anchor: Array  #: (k, 3) positions of the anchors [m]
    start: Array  #: (k, 3) positions of the anchors when the strings were tied [m]
    speed: Array  #: (k,) velocities of the anchors along x [m/s]
    law: Array  #: (3,) unstretched length [m], stiffness [N/m], damping [N s/m]
    sums: Array  #: (k, 3) forces on the links, summed over all steps [N]
    knot: Array  #: (k, 3) positions of the knots [m]


class Motoring(NamedTuple):
    """Two motors of each of N bodies; entries of bodies without hinges are unused."""

    law: int  #: Law of the motors at the torque limit: 0 halt, 1 stall, 2 ease, 3 slip, 4 servo
    speed: float  #: Greatest speed of a command, ω [rad/s]
    limit: Array  #: (N, 2) torque limits τ_max [N m]
    stiffness: Array  #: (N, 2) twist stiffness of the shafts [N m/rad]
    damping: float  #: Derivative gain of servos, damping of the twist of other shafts [N m s/rad]
    command: Array  #: (N, 2) angles that the motors reach at the end of the control period [rad]
    pace: Array  #: (N, 2) speeds at which the motors turn to `command` in the control period [rad/s]
    schedule: Array  #: (N, 2) angles of the schedule at the last control update [rad]
    torque: Array  #: (N, 2) mean torques on the barbs between the last two control updates [N m]
    work: Array  #: (N, 2) work on the links up to now [J]
    #: (N, 2) whether the last update halted the motor, or under slip and servo found it at its limit
    halted: NDArray[np.bool_]
    momentum: Array  #: (N, 2) momenta p conjugate to the angles, see `motion.planar` [kg m²/s]
    impulse: Array  #: (N, 2) time integral of the torques since the last control update [N m s]
    elapsed: Array  #: (1,) time since the last control update [s]
    interval: float  #: Time between two control updates, the control period [s]
    period: int  #: Number of steps in a control period
    targets: Array  #: (updates, N, 2) angles of the schedule at the ends of the next control periods [rad]
    #: (2,) row of `targets` for the next control update, and number of steps until then; below 0: none is planned
    due: NDArray[np.int64]
    #: (N,) number of consecutive updates, of barb 1 and barb 2 in turn, that found the torque at τ_max; for ease
    over: NDArray[np.int64]


class Filaments(NamedTuple):
    """F filaments with n nodes in all, and G grips. A segment has the number of the node at its start.

    Entries of segments are unused at the last node of a filament. For columns see `dem.engine.links.motion.bending`.
    """

    body: Indices  #: (F,) number of each filament among all bodies
    begin: Indices  #: (F + 1,) number of the first node of each filament, then n
    rod: Array  #: (F, ROD) constants of each filament, columns from `bending.LENGTH` on
    gait: Array  #: (F, GAIT) state of the wave of preferred curvature, columns from `bending.PSI` on
    wave: Array  #: (n, 3) of the preferred κ at each node: amplitude, cosine and sine of the phase [1]
    preferred: Array  #: (n, 2) present preferred κ1 and κ2 at each node [1]
    mass: Array  #: (n,) masses of the nodes [kg]
    position: Array  #: (n, 3) positions of the nodes [m]
    velocity: Array  #: (n, 3) velocities of the nodes [m/s]
    spin: Array  #: (n,) rate at which each segment rolls about its axis [rad/s]
    tangent: Array  #: (n, 3) unit vector along each segment [1]
    extent: Array  #: (n,) length of each segment [m]
    director: Array  #: (n, 3) first director: unit vector across each segment that turns with its material [1]
    force: Array  #: (n, 4) force on each node [N] and torque about each segment's axis [N m], less `damping` and `drag`
    damping: Array  #: (n, 4) force and torque of internal damping, if a ledger is kept [N, N m]
    drag: Array  #: (n, 4) force of the liquid's drag; torque unused [N]
    grip: NDArray[np.int64]  #: (n,) 8 times the grip that holds the node, plus 1, 2, 4 for held x, y, z; 0: free
    grip_speed: Array  #: (G, 3) velocities of the grips [m/s]
    grip_force: Array  #: (G, 3) forces of the grips on their nodes in the last step [N]
    sums: Array  #: (SUMS,) energies exchanged since the start [J], see `bending.DAMPED`


class Grips(NamedTuple):
    """G grips that hold rigid bodies."""

    of: NDArray[np.int64]  #: (N,) number of the grip that holds each body, counted from 1; 0: free
    speed: Array  #: (G, 3) velocities, without the shaking [m/s]
    moved: Array  #: (G, 3) ways at these velocities [m]
    force: Array  #: (G, 3) forces on the grips in the last step, with the weight of what they hold [N]
    sums: Array  #: (G, 3) these forces, summed over all steps [N]
    pushed: Array  #: (G, 3) forces of contacts alone on what they hold, summed over all steps [N]
    rides: Array  #: (1,) 1 where grips are shaken with the floor, else 0
    made: NDArray[np.int64]  #: (1,) number of grips since the start


PER_GRIP = ("speed", "moved", "force", "sums", "pushed")  # fields of `Grips` with a row for each grip


class Linkages(NamedTuple):
    """F linkages with L links in all, and G grips. A joint has the number of the link before it.

    Entries of joints are unused at the last link of a linkage. Each link is a body in `links`, which the kernels of
    rigid bodies move; its part and its segment have its number. For columns see `dem.engine.links.motion.joining`.
    """

    body: Indices  #: (F,) number of each linkage among all bodies
    begin: Indices  #: (F + 1,) number of the first link of each linkage, then L
    gait: Array  #: (F, GAIT) state of the wave that the motors follow, columns from `bending.PSI` on
    law: NDArray[np.int64]  #: (L,) law of each joint, see `joining.FREE`
    axes: NDArray[np.int64]  #: (L,) number of axes of each joint; 3 of a broken one
    row: Array  #: (L, JOINT) constants of each joint, columns from `joining.BEFORE` on
    swing: Array  #: (L, 3, SWING) motion of the motor about each axis, columns from `joining.QUIET` on
    rest: Array  #: (L, 4) angles at rest [rad]; of joints with three axes a quaternion [1]
    command: Array  #: (L, 3) angles that motors hold [rad]
    angle: Array  #: (L, 3) angles in the last step [rad]
    torque: Array  #: (L, 3) torque of spring, dashpot or motor about each axis in the last step [N m]
    broken: NDArray[np.uint8]  #: (L,) whether a joint is broken
    driven: NDArray[np.int64]  #: (1,) number of joints with motors
    lost: Array  #: (L, LOST) scratch: forces that take or give energy in a step, columns from `joining.RESISTING` on
    grip: NDArray[np.int64]  #: (L,) number of the grip that holds each link, plus 1; 0: free
    grip_speed: Array  #: (G, 3) velocities of the grips [m/s]
    grip_force: Array  #: (G, 3) forces of the grips on their links in the last step [N]
    sums: Array  #: (SUMS,) energies exchanged since the start [J], see `bending.DAMPED`
    links: Bodies  #: All links, as bodies
    shapes: Shapes  #: Shapes of the links of all kinds of linkages, kind by kind
    bodies: Any  #: `Bodies` of the whole pile, with one row for each linkage
    parts: Any  #: `Parts` of the whole pile, numbered by link
    segments: Any  #: `Segments` of the whole pile, numbered by link


class System(NamedTuple):
    """All data of one simulation that kernels read or write."""

    shapes: Shapes  #: Shapes of the bodies
    law: Law  #: Law of contacts between bodies
    wall_law: Law  #: Law of contacts with boundaries
    bodies: Bodies  #: The bodies
    parts: Parts  #: Parts of the bodies, with motion and loads
    segments: Segments  #: Segments of the bodies
    pairs: Pairs  #: Lists of near segments
    kept: Kept  #: Memory of contacts with boundaries
    boundaries: Boundaries  #: Floor, wall, hooks, channel
    gravity: float  #: g, downwards [m/s²]
    planar: bool  #: Whether all motion is confined to a horizontal plane
    skins: Array  #: (7,) limits of skins, see `dem.engine.links.neighbours.lists.update_lists`
    motors: Any  #: `Motoring`; None while smarticles are welded
    cords: Any  #: `Cords`; None if no string is tied
    #: (n, LEDGER) forces that dissipate energy, see `contact.pairs.enter`; None if dissipation is not recorded
    ledger: Any
    filaments: Any  #: `Filaments`; None if no body is a filament
    linkages: Any  #: `Linkages`; None if no body is a linkage
    grips: Any  #: `Grips`; None in scenes without grips of rigid bodies


class Scratch(NamedTuple):
    """Scratch arrays, whose content does not outlive a step."""

    cells: Cells  #: Scratch of the search for neighbours
    met: Array  #: (ROWS, COLUMNS) scratch of `dem.engine.links.contact.meeting.meet`
    contacts: Array  #: (slots, COLUMNS) scratch of `dem.engine.links.contact.boundaries.contacts_of_segment`
    plane: Array  #: (PLANE,) scratch for the plane geometry of a smarticle


def bodies_for(count: int) -> Bodies:
    """Return arrays of zeros for `count` bodies."""
    f = np.zeros
    return Bodies(
        f((count, 3)), f((count, 4)), f((count, 3)), f((count, 3)), f((count, 2)), f((count, 2)), f(count, np.int32),
        f((count, PLANE)), f((count, 3)), f((count, 3, 3)), f((count, 6)), f(count),
    )  # fmt: skip


def joined(one: Bodies, other: Bodies) -> Bodies:
    """Return the bodies of `one`, then the bodies of `other`, as arrays of all."""
    return Bodies(*(np.concatenate([a, b]) for a, b in zip(one, other, strict=True)))


def pairs_for(bodies: int, segments: int, capacity: int) -> Pairs:
    """Return empty lists of near segments with room for `capacity` pairs.

    Args:
        bodies: number of bodies.
        segments: number of segments of all bodies.
        capacity: largest number of pairs.
    """
    f, indices = np.zeros, np.int32
    return Pairs(
        f(capacity, indices), f(capacity, indices), f((capacity, SLOTS, 4)), f(capacity, np.uint8),
        f(capacity, indices), f(capacity, indices), f((capacity, 2)), f(4, np.int64),
        f((segments, 7)), f((segments, 7)), f((bodies, 3)), f((bodies, 3)),
    )  # fmt: skip


def cells_for(bodies: int, links: int, segments: int, capacity: int) -> Cells:
    """Return arrays for the search for neighbours, with room for `capacity` pairs.

    Args:
        bodies: number of bodies.
        links: number of links of all bodies.
        segments: number of segments of all bodies.
        capacity: largest number of pairs.
    """
    f, indices = np.zeros, np.int32
    return Cells(
        f(links, indices), f(links, indices), f(BINS * links + 66, indices), f((segments, 7)), f((bodies, 3)),
        f((links, 6)), f((6, links)), f((links, LINE + 1)), f(2 * links, indices), f(segments, indices),
        f(segments + 2, indices), f(capacity, indices), f(capacity, indices), f(capacity, indices),
        f(capacity, indices), f((capacity, SLOTS, 4)), f(capacity, np.uint8),
    )  # fmt: skip
