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

    Args:
        position: (N, 3) centres of mass [m].
        turn: (N, 4) unit quaternions (w, x, y, z), middle link to laboratory [1].
        velocity: (N, 3) of the centres of mass [m/s].
        momentum: (N, 3) angular momenta about the centres of mass, in the laboratory frame [kg m²/s].
        alpha: (N, 2) angles of the barbs [rad].
        rate: (N, 2) their rates [rad/s]; 0 while welded.
        plane: (N, PLANE) plane geometry, see `dem.engine.links.motion.planar.lay_out`.
        spin: (N, 3) angular velocities of the middle links, laboratory frame [rad/s].
        axes: (N, 3, 3) rotation matrices, middle link to laboratory [1].
        segments: (N S, 6) start of each link's axis, at the hinge, and vector to its end [m]; S links and strands.
        motion: (N, 6) or (3 N, 6) velocity at the centre of mass [m/s] and angular velocity [rad/s] of each rigid
            body: of whole smarticles while welded, of links while articulated.
        load: (N, 6) force [N] and torque about the centre of mass [N m] of contacts in this step, without weight.
        shares: (3 N, 6) the same on each link while articulated; (0, 6) while welded.
        deepest: (N,) deepest contact since the last question, as the step after would take it [m].
    """

    position: Array
    turn: Array
    velocity: Array
    momentum: Array
    alpha: Array
    rate: Array
    plane: Array
    spin: Array
    axes: Array
    segments: Array
    motion: Array
    load: Array
    shares: Array
    deepest: Array


class Pairs(NamedTuple):
    """Pairs of links that are near each other, P of them, in rows by the first link.

    Args:
        first: (P,) the link with the lower number.
        second: (P,) the other one.
        slip: (P, SLOTS, 4) stretch of the tangential springs at each point [m], and their energy [J].
        used: (P,) which of the points touched in the last step, as bits.
        near: (P,) places in this list of the pairs that are so near that they can touch soon; the tight list.
        touching: (P,) places of the pairs that touch or did so in the last step.
        nearest: (P, 2) where these are nearest to each other, in lengths of either link.
        counts: (4,) pairs, near pairs, times the list was built, times the tight one was.
        wide_marks: (N S, 7) ends of all links when the list was built and their skins [m].
        near_marks: (N S, 7) the same for the tight list.
        wide_centres: (N, 3) centres of mass when the list was built [m].
        near_centres: (N, 3) the same for the tight list [m].
        owner: (N S,) smarticle that each link belongs to.
        kind: (N S,) which of its links it is: 0 barb 1, 1 the middle link, 2 barb 2.
    """

    first: Indices
    second: Indices
    slip: Array
    used: NDArray[np.uint8]
    near: Indices
    touching: Indices
    nearest: Array
    counts: NDArray[np.int64]
    wide_marks: Array
    near_marks: Array
    wide_centres: Array
    near_centres: Array
    owner: Indices
    kind: Indices


class Cells(NamedTuple):
    """What the search for neighbours needs for itself.

    Args:
        keys: (N S,) bin of each link.
        order: (N S,) links by bin, in order within each.
        starts: (bins + 2,) where each bin begins in `order`, from the second number on.
        marks: (N S, 7) as in `Pairs`.
        centres: (N, 3) as in `Pairs`.
        boxes: (6, N S) lower and upper corners of boxes about links [m], by bin; many are asked for one coordinate.
        lines: (N S, 8) their segments, skins [m] and inverse squared lengths [1/m²], by bin.
        close: (2 N S,) places in `order` of links that may be near the one that is looked at; then scratch.
        places: (N S,) which row of the list each link's pairs are in.
        rows: (N S + 2,) where the list's rows begin.
        lower: (P,) links with the lower numbers, as pairs are found.
        upper: (P,) the others.
        first: (P,) the same by rows.
        second: (P,) the same by rows.
        slip: (P, SLOTS, 4) what the list before remembers.
        used: (P,) the same.
    """

    keys: Indices
    order: Indices
    starts: Indices
    marks: Array
    centres: Array
    boxes: Array
    lines: Array
    close: Indices
    places: Indices
    rows: Indices
    lower: Indices
    upper: Indices
    first: Indices
    second: Indices
    slip: Array
    used: NDArray[np.uint8]


class Law(NamedTuple):
    """Spring, dashpot and friction of a contact: between links, or of a link and a boundary.

    Args:
        stiffness: kn [N/m].
        shear: ks [N/m].
        damping: cn [N s/m].
        shear_damping: cs [N s/m], while it sticks.
        friction: Coulomb coefficient [1].
    """

    stiffness: float
    shear: float
    damping: float
    shear_damping: float
    friction: float


class Kept(NamedTuple):
    """What contacts of links with boundaries remember from step to step, see `dem.engine.links.contact.boundaries`.

    Args:
        slip: (N S, slots, 4) stretch of the tangential springs [m], and their energy [J].
        used: (N S, slots) whether a contact was there in the last step.
        contacts: (N S,) contacts of a link in the last step.
    """

    slip: Array
    used: NDArray[np.uint8]
    contacts: NDArray[np.uint8]


class Ground(NamedTuple):
    """Boundaries that ends of links meet, and how they all move. Parts: floor, wall, lower hook, upper hook.

    Args:
        bottoms: (tiers,) where each tier of the wall begins, from the lowest up, above the wall's place [m].
        radii: (tiers,) of the tiers [m].
        top: where the wall ends, above its place [m].
        flags: (2,) whether the wall is there, and whether it was lifted: then it has an outside.
        place: (4,) heights of the parts [m].
        speed: (4,) their velocities [m/s].
        base: (4,) heights that shaking began at [m].
        shaken: (4,) whether a part is shaken.
        wave: (3,) amplitude [m], 2πf [rad/s] and begin [s] of the shaking.
        force: (6, 3) of the smarticles on the parts and on a channel's lower and upper wall in the last step [N].
        sums: (6, 3) the same, summed over all steps [N].
    """

    bottoms: Array
    radii: Array
    top: float
    flags: NDArray[np.int64]
    place: Array
    speed: Array
    base: Array
    shaken: NDArray[np.int64]
    wave: Array
    force: Array
    sums: Array


class Hooks(NamedTuple):
    """Two hooks of two bars or more each, lying along x and y; their heights are in `Ground.place`.

    Args:
        counts: (2,) bars of the lower and the upper hook; the arrays have room for B, those of the one with more.
        bars: (2, B, 6) start of each bar's axis from the vertical axis, and vector to its end [m]; heights, which are
            in `Ground.place`, are written where they are needed.
        radius: of the bars [m].
    """

    counts: NDArray[np.int64]
    bars: Array
    radius: float


class Rims(NamedTuple):
    """Round edges of the wall that links can bend around: between tiers, and below a wall that is lifted.

    Args:
        heights: (rims,) above the wall's place [m].
        radii: (rims,) [m].
    """

    heights: Array
    radii: Array


class Boundaries(NamedTuple):
    """All boundaries. What a scene lacks is None, and kernels are compiled without it.

    Args:
        ground: floor and wall, and how all boundaries move.
        channel: (1,) half the distance of the walls that stand in for the container [m]; None for a container.
        hooks: None where there are none.
        rims: None where the wall has no edges that links can reach.
    """

    ground: Ground
    channel: Any
    hooks: Any
    rims: Any


class Cords(NamedTuple):
    """Strings tied to links, k of them.

    Args:
        owner: (k, 2) smarticle and link.
        along: (k,) place of the knot along the link's axis from the link's centre [m].
        anchor: (k, 3) where the other ends are [m].
        start: (k, 3) where they were when the strings were tied [m].
        speed: (k,) of the other ends, along x [m/s].
        law: (3,) length when slack [m], stiffness [N/m], damping [N s/m].
        sums: (k, 3) forces on the links, summed over all steps [N].
        knot: (k, 3) where the strings are tied [m].
    """

    owner: NDArray[np.int64]
    along: Array
    anchor: Array
    start: Array
    speed: Array
    law: Array
    sums: Array
    knot: Array


class Motoring(NamedTuple):
    """Two motors on each of N smarticles.

    Args:
        law: 0 halt, 1 stall, 2 ease, 3 slip, 4 servo.
        speed: ω, the greatest speed [rad/s].
        limit: (N, 2) τ_max [N m].
        stiffness: (N, 2) of the shaft of a slip or servo motor [N m/rad].
        damping: of a servo [N m s/rad].
        acceleration: (N, 2) the greatest change of a prescribed rate [rad/s²].
        command: (N, 2) angles that the motors hold [rad].
        schedule: (N, 2) angles that they were told [rad].
        torque: (N, 2) mean torques on the barbs between the last two looks [N m].
        work: (N, 2) done on the links up to the last look, and for slip and servo up to now [J].
        halted: (N, 2) whether a motor wanted to advance at the last look and did not.
        begun: (N, 2) angles at the last look [rad].
        momentum: (N, 2) p after the last look; for slip and servo p now [kg m²/s].
        impulse: (N, 2) ∫ of all torques but the motors' since the last look; for slip and servo of the motors' [N m s].
        elapsed: (1,) time since the last look [s].
        interval: time between two looks [s].
        period: the same in steps.
        targets: (looks, N, 2) angles at the ends of the periods to come according to the schedule [rad].
        due: (2,) the row of `targets` that the next look goes by, and the steps until then; -1: no look is due.
        jump: (N, 2) by how much the prescribed rates have changed at a control update before the next kick [rad/s].
        over: (N,) how often in a row a barb of each smarticle was found at τ_max, one after the other, for ease.
    """

    law: int
    speed: float
    limit: Array
    stiffness: Array
    damping: float
    acceleration: Array
    command: Array
    schedule: Array
    torque: Array
    work: Array
    halted: NDArray[np.bool_]
    begun: Array
    momentum: Array
    impulse: Array
    elapsed: Array
    interval: float
    period: int
    targets: Array
    due: NDArray[np.int64]
    jump: Array
    over: NDArray[np.int64]


class System(NamedTuple):
    """One simulation, as kernels get it.

    Args:
        shape: what all smarticles have in common.
        law: of their contacts.
        wall_law: of their contacts with boundaries.
        bodies: the smarticles.
        pairs: which of their links are near each other.
        kept: what contacts with boundaries remember.
        boundaries: floor, wall, hooks, channel.
        gravity: g, downwards [m/s²].
        planar: whether all motion is confined to a horizontal plane.
        skins: see `dem.engine.links.neighbours.lists.update_lists`.
        motors: None while welded.
        cords: None where no string is tied.
        ledger: (n, LEDGER) forces that dissipate, see `dem.engine.links.contact.pairs.enter`; None where nothing asks.
    """

    shape: Shape
    law: Law
    wall_law: Law
    bodies: Bodies
    pairs: Pairs
    kept: Kept
    boundaries: Boundaries
    gravity: float
    planar: bool
    skins: Array
    motors: Any
    cords: Any
    ledger: Any


class Scratch(NamedTuple):
    """Arrays that are written before they are read.

    Args:
        cells: of the search for neighbours.
        met: (ROWS, COLUMNS) of `dem.engine.links.contact.meeting.meet`.
        contacts: (slots, COLUMNS) of `dem.engine.links.contact.boundaries.contacts_of_link`.
        plane: (PLANE,) plane geometry of a smarticle.
    """

    cells: Cells
    met: Array
    contacts: Array
    plane: Array


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
