"""The arrays that kernels work on, and how they grow. Everything is contiguous; nothing is allocated in a step."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.engine.links.shape import Shape

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

PLANE = 22  # numbers that describe the plane geometry of a smarticle, see `dem.engine.links.motion.planar`
FLOOR, WALL, LOWER, UPPER, CHANNEL = range(5)  # rows of `Ground.force`; the channel has two
BINS = 4  # of the search for neighbours, per link
LEDGER = 12  # numbers of a row of the ledger, see `dem.engine.links.contact.pairs.enter`
SLOTS = 3  # points at which a pair of links can touch, see `dem.engine.links.contact.meeting`


class Bodies(NamedTuple):
    """N smarticles. The first group is their state, the rest follows from it at the beginning of every step.

    Velocities and momenta belong to the middle of the step before, as in all leapfrog schemes.
    """

    position: Array  #: (N, 3) centres of mass [m]
    turn: Array  #: (N, 4) unit quaternions (w, x, y, z), middle link to laboratory [1]
    velocity: Array  #: (N, 3) of the centres of mass [m/s]
    momentum: Array  #: (N, 3) angular momenta about the centres of mass, in the laboratory frame [kg m²/s]
    alpha: Array  #: (N, 2) angles of the barbs [rad]
    rate: Array  #: (N, 2) their rates [rad/s]; 0 while welded
    plane: Array  #: (N, PLANE) plane geometry, see `dem.engine.links.motion.planar.lay_out`
    spin: Array  #: (N, 3) angular velocities of the middle links, laboratory frame [rad/s]
    axes: Array  #: (N, 3, 3) rotation matrices, middle link to laboratory [1]
    segments: Array  #: (N S, 6) start of each link's axis, at the hinge, and vector to its end [m]; S links and strands
    #: (N, 6) or (3 N, 6) velocity at the centre of mass [m/s] and angular velocity [rad/s] of each rigid body: of whole
    #: smarticles while welded, of links while articulated
    motion: Array
    load: Array  #: (N, 6) force [N] and torque about the centre of mass [N m] of contacts in this step, without weight
    shares: Array  #: (3 N, 6) the same on each link while articulated; (0, 6) while welded
    deepest: Array  #: (N,) deepest contact since the last question, as the step after would take it [m]


class Pairs(NamedTuple):
    """Pairs of links that are near each other, P of them, in rows by the first link."""

    first: Indices  #: (P,) the link with the lower number
    second: Indices  #: (P,) the other one
    slip: Array  #: (P, SLOTS, 4) stretch of the tangential springs at each point [m], and their energy [J]
    used: NDArray[np.uint8]  #: (P,) which of the points touched in the last step, as bits
    near: Indices  #: (P,) places in this list of the pairs that are so near that they can touch soon; the tight list
    touching: Indices  #: (P,) places of the pairs that touch or did so in the last step
    nearest: Array  #: (P, 2) where these are nearest to each other, in lengths of either link
    counts: NDArray[np.int64]  #: (4,) pairs, near pairs, times the list was built, times the tight one was
    wide_marks: Array  #: (N S, 7) ends of all links when the list was built and their skins [m]
    near_marks: Array  #: (N S, 7) the same for the tight list
    wide_centres: Array  #: (N, 3) centres of mass when the list was built [m]
    near_centres: Array  #: (N, 3) the same for the tight list [m]
    owner: Indices  #: (N S,) smarticle that each link belongs to
    kind: Indices  #: (N S,) which of its links it is: 0 barb 1, 1 the middle link, 2 barb 2


class Cells(NamedTuple):
    """What the search for neighbours needs for itself."""

    keys: Indices  #: (N S,) bin of each link
    order: Indices  #: (N S,) links by bin, in order within each
    starts: Indices  #: (bins + 2,) where each bin begins in `order`, from the second number on
    marks: Array  #: (N S, 7) as in `Pairs`
    centres: Array  #: (N, 3) as in `Pairs`
    #: (6, N S) lower and upper corners of boxes about links [m], by bin; many are asked for one coordinate
    boxes: Array
    lines: Array  #: (N S, 8) their segments, skins [m] and inverse squared lengths [1/m²], by bin
    close: Indices  #: (2 N S,) places in `order` of links that may be near the one that is looked at; then scratch
    places: Indices  #: (N S,) which row of the list each link's pairs are in
    rows: Indices  #: (N S + 2,) where the list's rows begin
    lower: Indices  #: (P,) links with the lower numbers, as pairs are found
    upper: Indices  #: (P,) the others
    first: Indices  #: (P,) the same by rows
    second: Indices  #: (P,) the same by rows
    slip: Array  #: (P, SLOTS, 4) what the list before remembers
    used: NDArray[np.uint8]  #: (P,) the same


class Law(NamedTuple):
    """Spring, dashpot and friction of a contact: between links, or of a link and a boundary."""

    stiffness: float  #: kn [N/m]
    shear: float  #: ks [N/m]
    damping: float  #: cn [N s/m]
    shear_damping: float  #: cs [N s/m], while it sticks
    friction: float  #: Coulomb coefficient [1]


class Kept(NamedTuple):
    """What contacts of links with boundaries remember from step to step, see `dem.engine.links.contact.boundaries`."""

    slip: Array  #: (N S, slots, 4) stretch of the tangential springs [m], and their energy [J]
    used: NDArray[np.uint8]  #: (N S, slots) whether a contact was there in the last step
    contacts: NDArray[np.uint8]  #: (N S,) contacts of a link in the last step


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
    force: Array  #: (6, 3) of the smarticles on the parts and on a channel's lower and upper wall in the last step [N]
    sums: Array  #: (6, 3) the same, summed over all steps [N]


class Hooks(NamedTuple):
    """Two hooks of two bars or more each, lying along x and y; their heights are in `Ground.place`."""

    #: (2,) bars of the lower and the upper hook; the arrays have room for B, those of the one with more
    counts: NDArray[np.int64]
    #: (2, B, 6) start of each bar's axis from the vertical axis, and vector to its end [m]; heights, which are in
    #: `Ground.place`, are written where they are needed
    bars: Array
    radius: float  #: Of the bars [m]


class Rims(NamedTuple):
    """Round edges of the wall that links can bend around: between tiers, and below a wall that is lifted."""

    heights: Array  #: (rims,) above the wall's place [m]
    radii: Array  #: (rims,) [m]


class Boundaries(NamedTuple):
    """All boundaries. What a scene lacks is None, and kernels are compiled without it."""

    ground: Ground  #: Floor and wall, and how all boundaries move
    channel: Any  #: (1,) half the distance of the walls that stand in for the container [m]; None for a container
    hooks: Any  #: None where there are none
    rims: Any  #: None where the wall has no edges that links can reach


class Cords(NamedTuple):
    """Strings tied to links, k of them."""

    owner: NDArray[np.int64]  #: (k, 2) smarticle and link
    along: Array  #: (k,) place of the knot along the link's axis from the link's centre [m]
    anchor: Array  #: (k, 3) where the other ends are [m]
    start: Array  #: (k, 3) where they were when the strings were tied [m]
    speed: Array  #: (k,) of the other ends, along x [m/s]
    law: Array  #: (3,) length when slack [m], stiffness [N/m], damping [N s/m]
    sums: Array  #: (k, 3) forces on the links, summed over all steps [N]
    knot: Array  #: (k, 3) where the strings are tied [m]


class Motoring(NamedTuple):
    """Two motors on each of N smarticles."""

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


class System(NamedTuple):
    """One simulation, as kernels get it."""

    shape: Shape  #: What all smarticles have in common
    law: Law  #: Of their contacts
    wall_law: Law  #: Of their contacts with boundaries
    bodies: Bodies  #: The smarticles
    pairs: Pairs  #: Which of their links are near each other
    kept: Kept  #: What contacts with boundaries remember
    boundaries: Boundaries  #: Floor, wall, hooks, channel
    gravity: float  #: g, downwards [m/s²]
    planar: bool  #: Whether all motion is confined to a horizontal plane
    skins: Array  #: See `dem.engine.links.neighbours.lists.update_lists`
    motors: Any  #: None while welded
    cords: Any  #: None where no string is tied
    #: (n, LEDGER) forces that dissipate, see `dem.engine.links.contact.pairs.enter`; None where nothing asks
    ledger: Any


class Scratch(NamedTuple):
    """Arrays that are written before they are read."""

    cells: Cells  #: Of the search for neighbours
    met: Array  #: (ROWS, COLUMNS) of `dem.engine.links.contact.meeting.meet`
    contacts: Array  #: (slots, COLUMNS) of `dem.engine.links.contact.boundaries.contacts_of_link`
    plane: Array  #: (PLANE,) plane geometry of a smarticle


def no_bodies(links: int) -> Bodies:
    """Bodies without any smarticle, of S = `links` links and strands each."""
    f = np.zeros
    return Bodies(
        f((0, 3)), f((0, 4)), f((0, 3)), f((0, 3)), f((0, 2)), f((0, 2)), f((0, PLANE)), f((0, 3)), f((0, 3, 3)),
        f((0, 6)), f((0, 6)), f((0, 6)), f((0, 6)), f(0),
    )  # fmt: skip


def joined(one: Bodies, other: Bodies) -> Bodies:
    """The smarticles of both, those of `one` first."""
    return Bodies(*(np.concatenate(arrays) for arrays in zip(one, other, strict=True)))


def pairs_for(smarticles: int, kinds: NDArray[np.int64], capacity: int) -> Pairs:
    """An empty list with room for `capacity` pairs of links of some smarticles, whose links are of these kinds."""
    links = smarticles * len(kinds)
    return Pairs(
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros((capacity, SLOTS, 4)),
        np.zeros(capacity, np.uint8),
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros((capacity, 2)),
        np.zeros(4, np.int64),
        np.zeros((links, 7)),
        np.zeros((links, 7)),
        np.zeros((smarticles, 3)),
        np.zeros((smarticles, 3)),
        np.repeat(np.arange(smarticles, dtype=np.int32), len(kinds)),
        np.tile(kinds.astype(np.int32), smarticles),
    )


def cells_for(links: int, smarticles: int, capacity: int) -> Cells:
    """Room for a search among `links` links of some smarticles, and for so many pairs."""
    return Cells(
        np.zeros(links, np.int32),
        np.zeros(links, np.int32),
        np.zeros(BINS * links + 66, np.int32),
        np.zeros((links, 7)),
        np.zeros((smarticles, 3)),
        np.zeros((6, links)),
        np.zeros((links, 8)),
        np.zeros(2 * links, np.int32),
        np.zeros(links, np.int32),
        np.zeros(links + 2, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros(capacity, np.int32),
        np.zeros((capacity, SLOTS, 4)),
        np.zeros(capacity, np.uint8),
    )
