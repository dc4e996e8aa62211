"""The arrays that kernels work on, and how they grow. Everything is contiguous; nothing is allocated in a step."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.engine.links.shapes import LINE, Shapes

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

PLANE = 22  # numbers that describe the plane geometry of a smarticle, see `dem.engine.links.motion.planar`
FLOOR, WALL, LOWER, UPPER, CHANNEL = range(5)  # rows of `Ground.force`; the channel has two
BINS = 4  # of the search for neighbours, per link
LEDGER = 10  # numbers of a row of the ledger, see `dem.engine.links.contact.pairs.enter`
SLOTS = 3  # points at which a pair of segments can touch, see `dem.engine.links.contact.meeting`
# Columns of a rigid part: velocity at a point [m/s], angular velocity [rad/s], that point [m].
VELOCITY, SPIN, ORIGIN, MOTION = 0, 3, 6, 9
# Columns of a part that stretches: its axis [1], rate of strain [1/s], first moment of axial forces [N m].
AXIS, STRAIN_RATE, MOMENT, STRETCH = 0, 3, 4, 5


class Bodies(NamedTuple):
    """N bodies. The first group is their state, the rest follows from it at the beginning of every step.

    Velocities and momenta belong to the middle of the step before, as in all leapfrog schemes.
    """

    position: Array  #: (N, 3) centres of mass [m]
    turn: Array  #: (N, 4) unit quaternions (w, x, y, z), frame of the body to laboratory [1]
    velocity: Array  #: (N, 3) of the centres of mass [m/s]
    momentum: Array  #: (N, 3) angular momenta about the centres of mass, in the laboratory frame [kg m²/s]
    alpha: Array  #: (N, 2) angles of a smarticle's barbs [rad]
    rate: Array  #: (N, 2) their rates [rad/s]; 0 while welded
    shape: Indices  #: (N,) which kind of body each is
    plane: Array  #: (N, PLANE) plane geometry, see `dem.engine.links.motion.planar.lay_out`; of all bodies the inertia
    spin: Array  #: (N, 3) angular velocities of the bodies' frames, laboratory frame [rad/s]
    axes: Array  #: (N, 3, 3) rotation matrices, frame of the body to laboratory [1]
    load: Array  #: (N, 6) force [N] and torque about the centre of mass [N m] of contacts in this step, without weight
    deepest: Array  #: (N,) deepest contact since the last query, over the overlap at which axes meet [1]


class Parts(NamedTuple):
    """Rigid parts of bodies, R of them: three of a smarticle, of which the first is all of it while welded."""

    begin: Indices  #: (N + 1,) where the parts of each body begin
    motion: Array  #: (R, MOTION) how each part moves, see `VELOCITY`
    load: Array  #: (R, 6) force [N] and torque about `ORIGIN` [N m] of contacts in this step
    #: (R, STRETCH) of parts that stretch along an axis: the axis [1], rate of strain [1/s], first moment along the axis
    #: of the axial forces of contacts [N m]; None where no body is flexible
    stretch: Any


class Segments(NamedTuple):
    """Segments of all bodies, Q of them, and links, L of them, whose strands they are."""

    line: Array  #: (Q, LINE) in the laboratory frame, see `dem.engine.links.shapes`
    begin: Indices  #: (N + 1,) where the segments of each body begin
    body: Indices  #: (Q,) body that each belongs to
    part: Indices  #: (Q,) rigid part that each moves with
    shared: NDArray[np.uint8]  #: (Q,) see `dem.engine.links.shapes.AT_START`
    first: Indices  #: (L + 1,) where the segments of each link begin
    bends: Any  #: `Bends`; None where no body is flexible


class Bends(NamedTuple):
    """What is known besides of the segments of flexible bodies."""

    apart: Indices  #: (Q,) by how much numbers of segments of one body differ at least if they can touch; 0: never
    ends: Array  #: (Q, 6) velocities of start and end of a segment of a flexible body [m/s]


class Pairs(NamedTuple):
    """Pairs of segments that are near each other, P of them, in rows by the first one."""

    first: Indices  #: (P,) the segment with the lower number
    second: Indices  #: (P,) the other one
    slip: Array  #: (P, SLOTS, 4) stretch of the tangential springs at each point [m], and their energy [J]
    used: NDArray[np.uint8]  #: (P,) which of the points touched in the last step, as bits
    near: Indices  #: (P,) places in this list of the pairs that are so near that they can touch soon; the tight list
    touching: Indices  #: (P,) places of the pairs that touch or did so in the last step
    nearest: Array  #: (P, 2) where these are nearest to each other, in lengths of either segment
    counts: NDArray[np.int64]  #: (4,) pairs, near pairs, times the list was built, times the tight one was
    wide_marks: Array  #: (Q, 7) ends of all segments when the list was built and their skins [m]
    near_marks: Array  #: (Q, 7) the same for the tight list
    wide_centres: Array  #: (N, 3) centres of mass when the list was built [m]
    near_centres: Array  #: (N, 3) the same for the tight list [m]


class Cells(NamedTuple):
    """Arrays of the search for neighbours."""

    keys: Indices  #: (L,) bin of each link
    order: Indices  #: (L,) links by bin, in order within each
    starts: Indices  #: (bins + 2,) where each bin begins in `order`, from the second number on
    marks: Array  #: (Q, 7) as in `Pairs`
    centres: Array  #: (N, 3) as in `Pairs`
    own: Array  #: (L, 6) lower and upper corners of the box about each link [m]
    boxes: Array  #: (6, L) the same by bin; one coordinate of many is read at once
    strands: Indices  #: (L + 1,) where the segments of each link begin in `lines`
    lines: Array  #: (Q, LINE + 1) segments and their skins [m], by bin
    numbers: Indices  #: (Q,) segment of each of these rows
    close: Indices  #: (2 L,) places in `order` of links whose boxes overlap that of one link; then scratch
    places: Indices  #: (Q,) which row of the list each segment's pairs are in
    rows: Indices  #: (Q + 2,) where the list's rows begin
    lower: Indices  #: (P,) segments with the lower numbers, as pairs are found
    upper: Indices  #: (P,) the others
    first: Indices  #: (P,) the same by rows
    second: Indices  #: (P,) the same by rows
    slip: Array  #: (P, SLOTS, 4) that of the list before
    used: NDArray[np.uint8]  #: (P,) that of the list before


class Law(NamedTuple):
    """Spring, dashpot and friction of a contact: between bodies, or of a body and a boundary."""

    stiffness: float  #: kn [N/m]
    shear: float  #: ks [N/m]
    damping: Array  #: (K, K) cn by the shapes of both bodies, (K, 1) against boundaries [N s/m]
    shear_damping: float  #: cs over cn [1], while it sticks
    friction: float  #: Coulomb coefficient [1]


class Kept(NamedTuple):
    """Memory of contacts with boundaries, see `dem.engine.links.contact.boundaries`."""

    slip: Array  #: (Q, slots, 4) stretch of the tangential springs [m], and their energy [J]
    used: NDArray[np.uint8]  #: (Q, slots) whether a contact was there in the last step
    contacts: NDArray[np.uint8]  #: (Q,) contacts of a segment in the last step


class Ground(NamedTuple):
    """Boundaries that ends of links meet, and how they all move. Parts: floor, wall, lower hook, upper hook."""

    bottoms: Array  #: (tiers,) where each tier of the wall begins, from the lowest up, above the wall's place [m]
    radii: Array  #: (tiers,) of the tiers [m]
    top: float  #: Where the wall ends, above its place [m]
    flags: NDArray[np.int64]  #: (2,) whether the wall is there, and whether it was lifted: then it has an outside
    place: Array  #: (4,) heights of the parts [m]
    speed: Array  #: (4,) their velocities [m/s]
    base: Array  #: (4,) heights that shaking began at [m]
    shaken: NDArray[np.int64]  #: (4,) whether a part is shaken
    wave: Array  #: (3,) amplitude [m], 2πf [rad/s] and begin [s] of the shaking
    force: Array  #: (6, 3) of the bodies on the parts and on a channel's lower and upper wall in the last step [N]
    sums: Array  #: (6, 3) the same, summed over all steps [N]


class Hooks(NamedTuple):
    """Two hooks of two bars or more each, lying along x and y; their heights are in `Ground.place`."""

    #: (2,) bars of the lower and the upper hook; the arrays have room for B, those of the one with more
    counts: NDArray[np.int64]
    #: (2, B, LINE) each bar's axis, from the vertical axis; heights, which are in `Ground.place`, are written where
    #: they are needed
    bars: Array
    radius: float  #: Of the bars [m]


class Rims(NamedTuple):
    """Round edges of the wall that links can bend around: between tiers, and below a wall that is lifted."""

    heights: Array  #: (rims,) above the wall's place [m]
    radii: Array  #: (rims,) [m]


class Boundaries(NamedTuple):
    """All boundaries. Where a scene has none of a sort it is None, and kernels are compiled without it."""

    ground: Ground  #: Floor and wall, and how all boundaries move
    channel: Any  #: (1,) half the distance of the walls that stand in for the container [m]; None for a container
    hooks: Any  #: None where there are none
    rims: Any  #: None where the wall has no edges that links can reach


class Cords(NamedTuple):
    """Strings tied to links of smarticles, k of them."""

    owner: NDArray[np.int64]  #: (k, 2) smarticle and link
    along: Array  #: (k,) place of the knot along the link's axis from the link's centre [m]
    anchor: Array  #: (k, 3) where the other ends are [m]
    start: Array  #: (k, 3) where they were when the strings were tied [m]
    speed: Array  #: (k,) of the other ends, along x [m/s]
    law: Array  #: (3,) length when slack [m], stiffness [N/m], damping [N s/m]
    sums: Array  #: (k, 3) forces on the links, summed over all steps [N]
    knot: Array  #: (k, 3) where the strings are tied [m]


class Motoring(NamedTuple):
    """Two motors on each of N bodies; those of rigid bodies do nothing."""

    law: int  #: 0 halt, 1 stall, 2 ease, 3 slip, 4 servo
    speed: float  #: ω, the greatest speed [rad/s]
    limit: Array  #: (N, 2) τ_max [N m]
    stiffness: Array  #: (N, 2) of the shaft of a slip or servo motor [N m/rad]
    damping: float  #: Of a servo [N m s/rad]
    acceleration: Array  #: (N, 2) the greatest change of a prescribed rate [rad/s²]
    command: Array  #: (N, 2) angles that the motors hold [rad]
    schedule: Array  #: (N, 2) angles of the schedule [rad]
    torque: Array  #: (N, 2) mean torques on the barbs between the last two control updates [N m]
    work: Array  #: (N, 2) done on the links up to the last control update, and for slip and servo up to now [J]
    halted: NDArray[np.bool_]  #: (N, 2) whether a motor wanted to advance at the last control update and did not
    begun: Array  #: (N, 2) angles at the last control update [rad]
    momentum: Array  #: (N, 2) p after the last control update; for slip and servo p now [kg m²/s]
    #: (N, 2) ∫ of all torques but the motors' since the last control update; for slip and servo of the motors' [N m s]
    impulse: Array
    elapsed: Array  #: (1,) time since the last control update [s]
    interval: float  #: Time between two control updates [s]
    period: int  #: That time in steps
    targets: Array  #: (updates, N, 2) angles at the ends of the periods to come according to the schedule [rad]
    #: (2,) the row of `targets` of the next control update, and the steps until then; -1: none is due
    due: NDArray[np.int64]
    #: (N, 2) by how much the prescribed rates have changed at a control update before the next kick [rad/s]
    jump: Array
    #: (N,) how often in a row a barb of each smarticle was found at τ_max, one after the other, for ease
    over: NDArray[np.int64]


class Filaments(NamedTuple):
    """F flexible bodies with n nodes in all. A segment has the number of the node that it starts at.

    See `dem.engine.links.motion.bending` for the columns.
    """

    body: Indices  #: (F,) body that each filament is
    begin: Indices  #: (F + 1,) where the nodes of each begin
    rod: Array  #: (F, ROD) constants of each
    gait: Array  #: (F, GAIT) of preferred curvature
    wave: Array  #: (n, 3) preferred angle at a node [rad], cosine and sine of its phase
    preferred: Array  #: (n, 2) preferred angles at nodes now [rad]
    mass: Array  #: (n,) [kg]
    position: Array  #: (n, 3) [m]
    velocity: Array  #: (n, 3) [m/s]
    spin: Array  #: (n,) rate of roll of a segment about its axis [rad/s]
    tangent: Array  #: (n, 3) direction of a segment [1]
    extent: Array  #: (n,) length of a segment [m]
    director: Array  #: (n, 3) direction across a segment, which turns with its material [1]
    force: Array  #: (n, 4) on a node [N], and torque about a segment's axis [N m]; all but the next two
    damping: Array  #: (n, 4) of internal damping
    drag: Array  #: (n, 4) of the liquid
    grip: NDArray[np.int64]  #: (n,) grip that holds a node, times 8, plus 1, 2, 4 for held x, y, z; 0: free
    grip_speed: Array  #: (G, 3) velocities of the grips [m/s]
    grip_force: Array  #: (G, 3) forces of the grips on their nodes in the last step [N]
    sums: Array  #: (SUMS,) see `dem.engine.links.motion.bending.DAMPED`


class System(NamedTuple):
    """One simulation, as kernels get it."""

    shapes: Shapes  #: The kinds of bodies
    law: Law  #: Of their contacts
    wall_law: Law  #: Of their contacts with boundaries
    bodies: Bodies  #: The bodies
    parts: Parts  #: How their rigid parts move, and what acts on these
    segments: Segments  #: Where their segments are
    pairs: Pairs  #: Which segments are near each other
    kept: Kept  #: Memory of contacts with boundaries
    boundaries: Boundaries  #: Floor, wall, hooks, channel
    gravity: float  #: g, downwards [m/s²]
    planar: bool  #: Whether all motion is confined to a horizontal plane
    skins: Array  #: See `dem.engine.links.neighbours.lists.update_lists`
    motors: Any  #: None while welded
    cords: Any  #: None where no string is tied
    #: (n, LEDGER) forces that dissipate, see `dem.engine.links.contact.pairs.enter`; None where nothing reads it
    ledger: Any
    filaments: Any  #: `Filaments`; None where no body is flexible


class Scratch(NamedTuple):
    """Arrays that are written before they are read."""

    cells: Cells  #: Of the search for neighbours
    met: Array  #: (ROWS, COLUMNS) of `dem.engine.links.contact.meeting.meet`
    contacts: Array  #: (slots, COLUMNS) of `dem.engine.links.contact.boundaries.contacts_of_segment`
    plane: Array  #: (PLANE,) plane geometry of a smarticle


def bodies_for(count: int) -> Bodies:
    """Return arrays for so many bodies."""
    f = np.zeros
    return Bodies(
        f((count, 3)), f((count, 4)), f((count, 3)), f((count, 3)), f((count, 2)), f((count, 2)), f(count, np.int32),
        f((count, PLANE)), f((count, 3)), f((count, 3, 3)), f((count, 6)), f(count),
    )  # fmt: skip


def joined(one: Bodies, other: Bodies) -> Bodies:
    """Return the bodies of both, those of `one` first."""
    return Bodies(*(np.concatenate([a, b]) for a, b in zip(one, other, strict=True)))


def pairs_for(bodies: int, segments: int, capacity: int) -> Pairs:
    """Return an empty list with room for `capacity` pairs of the segments of some bodies."""
    return Pairs(
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros((capacity, SLOTS, 4)),
        np.zeros(capacity, np.uint8),
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros((capacity, 2)),
        np.zeros(4, np.int64),
        np.zeros((segments, 7)),
        np.zeros((segments, 7)),
        np.zeros((bodies, 3)),
        np.zeros((bodies, 3)),
    )


def cells_for(bodies: int, links: int, segments: int, capacity: int) -> Cells:
    """Return room for a search among the links of some bodies, and for so many pairs."""
    return Cells(
        np.zeros(links, np.int32),
        np.zeros(links, np.int32),
        np.zeros(BINS * links + 66, np.int32),
        np.zeros((segments, 7)),
        np.zeros((bodies, 3)),
        np.zeros((links, 6)),
        np.zeros((6, links)),
        np.zeros(links + 1, np.int32),
        np.zeros((segments, LINE + 1)),
        np.zeros(segments, np.int32),
        np.zeros(2 * links, np.int32),
        np.zeros(segments, np.int32),
        np.zeros(segments + 2, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros((capacity, SLOTS, 4)),
        np.zeros(capacity, np.uint8),
    )
