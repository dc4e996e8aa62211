"""All arrays of one simulation, and their changes between calls of the kernels."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.forces import at_links
from dem.body.kinds import Mixture
from dem.body.linear import matrix_product
from dem.body.particle import LINKS, Particle
from dem.body.placement import Poses
from dem.body.state import FilamentState, LinkageState, PileState, RigidState, State
from dem.engine.links.arrays import (
    BOUNDARIES,
    LEDGER,
    MOTION,
    PLANE,
    PLATE,
    STRETCH,
    WALL,
    Bends,
    Bodies,
    Boundaries,
    Cells,
    Cords,
    Filaments,
    Grips,
    Ground,
    Hooks,
    Kept,
    Law,
    Linkages,
    Motoring,
    Pairs,
    Parts,
    Rims,
    Scratch,
    Segments,
    System,
    bodies_for,
    cells_for,
    joined,
    pairs_for,
)
from dem.engine.links.contact import boundaries, meeting
from dem.engine.links.contact.boundaries import END_SLOTS, slots_for
from dem.engine.links.contact.queries import (
    WIDTH,
    Found,
    find_extremes,
    forces_of_boundaries,
    forces_of_pairs,
    query_all,
)
from dem.engine.links.joints import linkages_at
from dem.engine.links.joints import none_of as no_linkages
from dem.engine.links.motion.bending import pose_filaments_from_python
from dem.engine.links.motion.joining import pose_linkages_from_python
from dem.engine.links.motion.planar import invert, lay_out
from dem.engine.links.motion.poses import find_links, pose_all
from dem.engine.links.neighbours.lists import FULL, build_from_python
from dem.engine.links.rods import apart, filaments_at, none_of
from dem.engine.links.shapes import LINE, RADIUS, Shape, kind_shape, link_shapes, smarticle_shape, table_of
from dem.engine.links.stepping import PAST, Clock, advance
from dem.errors import reject
from dem.physics.contact import ContactLaw
from dem.setting.hooks import Bar

Array = NDArray[np.float64]

# Thinnest and thickest skins of both lists, and the width of a strip of the search, in diameters of the thickest
# segment; `STRANDS` are skins where links have several strands. Measured on a shaken pile of 270, see `benchmarks/`.
NEAR_SKINS, WIDE_SKINS, STRIP = (0.04, 0.15), (0.05, 2.0), 4.0
STRANDS = (0.06, 0.225), (0.225, 3.0)
NEAR_STEPS, WIDE_STEPS = 6, 40  # steps that a skin of the tight and of the wide list should last
FAR = 1e30  # m; recorded coordinate of segments that did not exist when the list was built
LISTS = ("first", "second", "slip", "used", "near")  # fields of `Pairs` that are kept
FRESH = ("touching", "nearest")  # fields of `Pairs` that every step writes anew
GROWTH = 1.5  # factor on the length of a list that is full


@dataclass(frozen=True)
class Contacts:
    """All contacts at one instant."""

    #: (M, 2) numbers of two bodies that touch, the lower number first; a pair may occur more than once
    pairs: NDArray[np.int64]
    touches: NDArray[np.int64]  #: (N,) number of points of contact of each body
    depths: Array  #: (N,) largest overlap of each body, over that at which axes, or an axis and a surface, meet [1]
    held: NDArray[np.bool_]  #: (N, 7) whether each body touches each boundary, in the order of `Ground.force`
    elastic_energy: float  #: Energy in the springs of all contacts [J]


@dataclass
class World:
    """All data of a simulation, and methods that change it between calls of the kernels.

    Kinds of bodies are numbered in this order: the smarticle, if `particle` is given; the kinds of `mixture`; the
    shapes in `more`.
    """

    particle: Particle | None  #: Smarticle of which all smarticles are copies; None: a pile without smarticles
    contact: ContactLaw  #: The contact law
    ground: Ground  #: Floor and wall, and the motion of all boundaries
    gravity: float  #: g, downwards [m/s²]
    planar: bool  #: Whether all motion is confined to the plane z = 0
    keep_ledger: bool  #: Whether to sum the energy that contacts dissipate
    more: tuple[Shape, ...] = ()  #: Shapes of further kinds of bodies
    mixture: Mixture | None = None  #: Kinds of bodies other than smarticles
    wave_seed: int = 0  #: Seed of the waves of filaments and linkages, for initial phases and times of reversals
    steps: int = 0  #: Number of steps made since the start
    time_step: float = math.nan  #: Length of further steps, dt [s]
    motors: Motoring | None = None  #: The motors; None before the first articulation
    articulated: bool = False  #: Whether barbs can turn at present
    begin: float = 0.0  #: Time at which steps of the present length began [s]
    made: int = 0  #: Number of steps of the present length so far
    #: (TOTALS,) sums and state of the sub-steps; for the indices see `stepping.LOST`
    totals: Array = field(default_factory=lambda: np.array([0.0, 0.0, math.nan, 1.0, 1.0, 0.0]))
    hooks: Hooks | None = None
    rims: Rims | None = None
    channel: Array | None = None
    cords: Cords | None = None
    filaments: Filaments | None = None  #: Arrays of filaments; None if no body is a filament
    linkages: Linkages | None = None  #: Arrays of linkages; None if no body is a linkage
    grips: Grips | None = None  #: Arrays of the grips of rigid bodies; None in scenes without them

    def __post_init__(self) -> None:
        own = () if self.particle is None else (smarticle_shape(self.particle),)
        mixed = () if self.mixture is None else tuple(map(kind_shape, self.mixture.kinds))
        self.kinds = (*own, *mixed, *self.more)
        self.shapes = table_of(self.kinds)
        law, masses = self.contact, np.array([kind.effective_mass for kind in self.kinds])
        # The law's dashpots are those of two smarticles and of one; damping goes with the root of the effective mass.
        pairs = np.sqrt(2 * masses * masses[:, None] / ((masses + masses[:, None]) * masses[0]))
        walls = np.sqrt(masses / masses[0])[:, None]
        self.laws = tuple(
            Law(law.normal_stiffness, law.tangential_stiffness, damping, law.tangential_damping, friction)
            for damping, friction in (
                (law.normal_damping * pairs, law.friction),
                (law.wall_damping * walls, law.wall_friction),
            )
        )
        if any(kind.filament is not None for kind in self.kinds):
            self.filaments = none_of()
        if self.mixture is not None and self.mixture.jointed:
            self.linkages = no_linkages([shape for kind in self.mixture.kinds for shape in link_shapes(kind)])
        self.bodies: Bodies = bodies_for(0)
        self.pairs: Pairs = pairs_for(0, 0, 256)
        self.cells: Cells = cells_for(0, 0, 0, 256)
        self._lay_out_parts()
        self.kept = no_contacts(0, END_SLOTS)
        self.ledger: Array | None = np.zeros((256, LEDGER)) if self.keep_ledger else None
        self.meeting, self.plane = np.zeros((meeting.ROWS, meeting.COLUMNS)), np.zeros(PLANE)
        diameter = 2 * float(self.shapes.lines[:, RADIUS].max())
        several = any(len(np.unique(kind.link)) < len(kind.link) for kind in self.kinds)
        near, wide = STRANDS if several else (NEAR_SKINS, WIDE_SKINS)
        self.skins = diameter * np.array([*near, 0.0, *wide, 0.0, STRIP])

    @property
    def count(self) -> int:
        """Number of bodies present."""
        return len(self.bodies.position)

    @property
    def each(self) -> int:
        """Largest number of links of a body, but at least 3."""
        return max(LINKS, 1 + max(int(kind.link.max()) for kind in self.kinds))

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.begin + self.made * self.time_step

    @property
    def hinged(self) -> Motoring | None:
        """The motors as argument of kernels: None while smarticles are welded."""
        return self.motors if self.articulated else None

    def set_time_step(self, time_step: float) -> None:
        """Set the length of all further steps [s]."""
        if self.made:
            self.begin, self.made = self.time, 0
        if not self.totals[PAST] < self.time_step:  # no sub-step, which would have to be kept
            self.totals[PAST] = time_step
        self.time_step = time_step
        self.skins[[2, 5]] = NEAR_STEPS * time_step, WIDE_STEPS * time_step

    def add(self, poses: Poses, *, speed: float = 0.0) -> None:
        """Add bodies at poses, smarticles welded; they fall at a speed [m/s] without rotation."""
        turns = np.array([rotation.as_matrix() for rotation in poses.rotations]).reshape(-1, 3, 3)
        if self.filaments is not None:
            self._add_posed_filaments(poses, turns, speed)
            return
        if self.linkages is not None:
            self._add_posed_linkages(poses, turns, speed)
            return
        if poses.kinds is not None:
            self.add_bodies(poses.kinds, poses.positions, turns, speed=speed)
            return
        assert self.particle is not None  # poses without kinds are those of smarticles
        # Poses are those of the principal axes; here the axes are the middle link's.
        middle = self.particle.boxes.link_rotations[1]
        self.add_bodies(0, poses.positions, matrix_product(turns, middle), speed=speed)

    def add_bodies(self, shape: int | NDArray[np.int64], positions: Array, turns: Array, *, speed: float = 0.0) -> None:
        """Add bodies that fall without rotation.

        Args:
            shape: number of the shape in `kinds`, or (n,) one for each body.
            positions: (n, 3) centres of mass [m].
            turns: (n, 3, 3) rotations from the frame of the body to the laboratory frame.
            speed: downward speed of the bodies [m/s].
        """
        fresh = bodies_for(len(positions))
        fresh.position[:] = positions
        fresh.velocity[:, 2] = -speed
        fresh.shape[:] = shape
        for i, turn in enumerate(turns):
            kind = self.kinds[fresh.shape[i]]
            fresh.turn[i] = quaternion_of(turn)
            if kind.planar is not None:
                assert self.particle is not None  # the shape of smarticles follows from it
                fresh.alpha[i] = self.particle.boxes.angles
                lay_out(kind.planar, *self.particle.boxes.angles, fresh.plane[i])
            elif not kind.flexible:
                fresh.plane[i, 14:18] = kind.inertia
                invert(fresh.plane[i])
        self.bodies = joined(self.bodies, fresh)
        if self.grips is not None:
            self.grips = self.grips._replace(of=longer(self.grips.of, self.count))
        self._lay_out_parts()
        old = self.pairs
        self.pairs = pairs_for(self.count, len(self.segments.line), len(old.first))._replace(
            counts=old.counts, **{name: getattr(old, name) for name in (*LISTS, *FRESH)}
        )
        self.forget_places()
        self._make_room_at_boundaries()
        self.make_room()

    def _add_posed_filaments(self, poses: Poses, turns: Array, speed: float) -> None:
        """Add filaments at poses, with rotations `turns` (N, 3, 3), in the shape in which they are poured."""
        assert self.mixture is not None
        assert poses.kinds is not None
        rng = np.random.default_rng([self.wave_seed, self.count])
        for k, (shape, position, turn) in enumerate(zip(poses.kinds, poses.positions, turns, strict=True)):
            if poses.bent is None:
                ends = self.mixture.kinds[shape].bars.ends
                points = matrix_product(np.concatenate([ends[:, 0], ends[-1:, 1]]), turn.T) + position
            else:
                points = poses.bent[k].points
            velocities = np.zeros_like(points)
            velocities[:, 2] = -speed
            start = rng.uniform(0, 2 * math.pi, 1)
            self.add_filaments(int(shape), points[None], velocities=velocities[None], starts=start, seed=self.wave_seed)

    def add_filaments(
        self, shape: int, points: Array, *, velocities: Array | None = None, starts: Array | None = None, seed: int = 0
    ) -> None:
        """Add F filaments of one shape.

        Args:
            shape: number of the shape in `kinds`.
            points: (F, nodes, 3) positions of the nodes [m].
            velocities: (F, nodes, 3) velocities of the nodes [m/s]; None: at rest.
            starts: (F,) initial angle ψ of each filament's preferred curvature [rad]; None: 0.
            seed: seed of the times at which preferred curvatures reverse, together with the filament's number.
        """
        filament = self.kinds[shape].filament
        assert filament is not None
        assert self.filaments is not None
        assert not self.planar
        first, masses = self.count, filament.masses
        centres = (masses[:, None] * points).sum(axis=1) / masses.sum()
        self.add_bodies(shape, centres, np.tile(np.eye(3), (len(points), 1, 1)))
        bodies = np.arange(first, self.count)
        self.filaments = filaments_at(self.filaments, filament, bodies, points, velocities, starts, seed)

    def _add_posed_linkages(self, poses: Poses, turns: Array, speed: float) -> None:
        """Add linkages at poses, with rotations `turns` (N, 3, 3), in the shape in which they are poured."""
        assert self.mixture is not None
        assert poses.kinds is not None
        assert self.linkages is not None
        assert not self.planar
        first, rng = self.count, np.random.default_rng([self.wave_seed, self.count])
        self.add_bodies(poses.kinds, poses.positions, turns, speed=speed)
        begins = np.cumsum([0, *self.mixture.sizes])
        for body, (k, place, turn) in enumerate(zip(poses.kinds, poses.positions, turns, strict=True), first):
            kind = self.mixture.kinds[k]
            assert kind.linkage is not None
            links = bodies_for(len(kind.bars.points))
            links.position[:] = matrix_product(kind.bars.ends.mean(axis=1), turn.T) + place
            links.turn[:] = [quaternion_of(own) for own in matrix_product(turn, kind.bars.frames)]
            bent = None if poses.bent is None else poses.bent[body - first]
            if bent is not None:
                assert bent.turns is not None  # links have frames
                links.position[:] = bent.points
                links.turn[:] = [quaternion_of(own) for own in bent.turns]
            links.velocity[:, 2] = -speed
            links.shape[:] = begins[k] + np.arange(len(links.shape))
            self.linkages = linkages_at(
                self.linkages, kind.linkage, body, links,
                self.contact.scaled(dashpots=math.sqrt(self.kinds[k].effective_mass / self.kinds[0].effective_mass)),
                start=float(rng.uniform(0, 2 * math.pi)), seed=self.wave_seed,
                angles=None if bent is None else bent.angles,
            )  # fmt: skip

    def _lay_out_parts(self) -> None:
        """Make the arrays of parts and segments for the present bodies."""
        shapes, kinds = self.bodies.shape, self.kinds
        flexible = np.array([kind.flexible for kind in kinds])
        sizes = np.array([len(kind.lines) for kind in kinds])
        parts = np.where(flexible, sizes, [3 if kind.planar is not None else 1 for kind in kinds])[shapes]
        flexible, sizes = flexible[shapes], sizes[shapes]
        begin = np.cumsum([0, *parts]).astype(np.int32)
        rows = int(begin[-1])
        stretch = None if self.filaments is None else np.zeros((rows, STRETCH))
        self.parts = Parts(begin, np.zeros((rows, MOTION)), np.zeros((rows, 6)), stretch)
        body = np.repeat(np.arange(self.count, dtype=np.int32), sizes)
        # Links of a body in the order of its segments, and a number for each in the pile.
        own = np.concatenate([np.zeros(0, np.int64), *(kinds[k].link for k in shapes)])
        fresh = np.append(True, (np.diff(own) != 0) | (np.diff(body) != 0)) if len(own) else np.zeros(0, np.bool_)
        hinged, bent = np.repeat(self.shapes.hinged[shapes], sizes), np.repeat(flexible, sizes)
        moved = hinged if self.articulated else 0  # links that move by themselves
        #: (Q,) code of each segment's link, from `at_links`
        self.links = at_links(body.astype(np.int64), own, self.each).astype(np.int32)
        self.segments = Segments(
            line=np.concatenate([np.zeros((0, LINE)), *(kinds[k].lines for k in shapes)]),
            begin=np.cumsum([0, *sizes]).astype(np.int32),
            body=body,
            part=(begin[body] + (moved + bent) * own).astype(np.int32),
            shared=np.concatenate([np.zeros(0, np.uint8), *(kinds[k].shared for k in shapes)]),
            first=np.append(np.flatnonzero(fresh), len(own)).astype(np.int32),
            bends=None if self.shapes.flexible is None else self._bends(sizes),
        )

    def _bends(self, sizes: NDArray[np.int64]) -> Bends:
        """Return `Segments.bends` for the present bodies; `sizes`: (N,) number of segments of each."""
        least = np.array([_apart(kind) for kind in self.kinds], dtype=np.int32)
        return Bends(np.repeat(least[self.bodies.shape], sizes), np.zeros((int(sizes.sum()), 6)))

    def _make_room_at_boundaries(self) -> None:
        """Enlarge the memory of contacts with boundaries to the present number of segments and boundaries."""
        old, new = self.kept, no_contacts(len(self.segments.line), slots_for(self.hooks, self.rims))
        rows, slots = old.used.shape
        new.slip[:rows, :slots], new.used[:rows, :slots], new.contacts[:rows] = old.slip, old.used, old.contacts
        self.kept = new

    def add_hooks(self, hooks: Sequence[Sequence[Bar]]) -> None:
        """Add the lower and the upper hook, given by their bars; call this before bodies and rims are added."""
        assert not self.count
        counts = np.array([len(bars) for bars in hooks])
        most = int(counts.max())
        segments, radius = np.zeros((2, most, LINE)), 0.0
        for hook, bars in enumerate(hooks):
            for k, (middle, halves) in enumerate(bars):
                # Round, as thick as the square ones that other engines have.
                along, radius = int(np.argmax(halves)), float(np.min(halves))
                segments[hook, k, :2] = middle
                segments[hook, k, along] -= halves[along] - radius
                length = 2 * (halves[along] - radius)
                segments[hook, k, 3 + along] = length
                segments[hook, k, 6:] = 1 / length**2, radius
        self.hooks = Hooks(counts, segments, radius)
        self._make_room_at_boundaries()

    def add_rim(self, height: float, radius: float) -> None:
        """Add a round edge of the wall, with its height above the wall's `place` [m] and its radius [m]."""
        old = self.rims or Rims(np.zeros(0), np.zeros(0))
        self.rims = Rims(np.append(old.heights, height), np.append(old.radii, radius))
        self._make_room_at_boundaries()

    def remove_wall(self) -> None:
        """Remove the wall and the memory of contacts with it."""
        first = slots_for(self.hooks, None)
        ends = [slot for slot in range(END_SLOTS) if slot % boundaries.SURFACES not in (0, boundaries.COVER)]
        self._forget_boundary(WALL, [*ends, *range(first, slots_for(self.hooks, self.rims))])
        self.ground.flags[0] = 0
        self.rims = None
        self.kept = Kept(self.kept.slip[:, :first].copy(), self.kept.used[:, :first].copy(), self.kept.contacts)

    def allow_grips(self) -> None:
        """Let grips hold bodies later; must be called before bodies are added."""
        none = np.zeros((0, 3))
        rows = none, none.copy(), none.copy(), none.copy(), none.copy()
        self.grips = Grips(np.zeros(0, np.int64), *rows, np.zeros(1), np.zeros(1, np.int64))

    def remove_plate(self) -> None:
        """Remove the plate and the memory of contacts with it."""
        self._forget_boundary(PLATE, range(boundaries.COVER, END_SLOTS, boundaries.SURFACES))
        self.ground.place[PLATE] = math.inf

    def _forget_boundary(self, part: int, slots: Sequence[int]) -> None:
        """Stop a boundary, and remove the memory of contacts in some slots.

        Args:
            part: row of the boundary in `Ground`.
            slots: columns of its contacts in `Kept`.
        """
        self.kept.slip[:, slots] = 0.0
        self.kept.used[:, slots] = 0
        self.kept.contacts[:] = self.kept.used.sum(axis=1)
        self.ground.speed[part] = self.ground.rise[part] = 0.0
        self.ground.shaken[part] = 0

    def set_articulated(self, articulated: bool) -> None:
        """Make each link of a smarticle a part of its own, or the whole smarticle one part."""
        self.articulated = articulated
        self._lay_out_parts()

    def forget_places(self) -> None:
        """Make the next step rebuild both lists of near segments."""
        for marks in (self.pairs.wide_marks, self.pairs.near_marks):
            marks[:, :6], marks[:, 6] = FAR, 0.0

    def make_room(self, capacity: int = 0) -> None:
        """Enlarge all lists for the present bodies, and for at least `capacity` pairs."""
        rows, links = len(self.segments.line), len(self.segments.first) - 1
        capacity = max(capacity, 12 * rows + 256, len(self.pairs.first))
        # Those of a checkpoint are as long as what is in them, each of its own length.
        short = [name for name in (*LISTS, *FRESH) if len(getattr(self.pairs, name)) < capacity]
        self.pairs = self.pairs._replace(**{name: longer(getattr(self.pairs, name), capacity) for name in short})
        if len(self.cells.marks) != rows or len(self.cells.first) != capacity:
            self.cells = cells_for(self.count, links, rows, capacity)
        if self.ledger is not None:
            entries = 3 * capacity // 2 + 6 * rows
            if len(self.ledger) < entries:
                self.ledger = np.zeros((entries, LEDGER))

    def advance(self, steps: int) -> None:
        """Advance by a number of steps; lists of pairs are enlarged whenever they are full."""
        target = self.made + steps
        while self.made < target:
            made = self._call(target - self.made)
            self.made += made
            self.steps += made
            if self.made < target:
                self.make_room(int(GROWTH * len(self.pairs.first)))

    def _call(self, steps: int) -> int:
        clock = Clock(self.begin, self.made, self.time_step)
        made: int = advance(steps, clock, self.system, self.scratch, self.totals)
        return made

    @property
    def system(self) -> System:
        """All data that kernels read or write, except scratch arrays."""
        law, wall_law = self.laws
        return System(
            self.shapes, law, wall_law, self.bodies, self.parts, self.segments, self.pairs, self.kept, self._known,
            self.gravity, self.planar, self.skins, self.hinged, self.cords, self.ledger, self.filaments, self.jointed,
            self.grips,
        )  # fmt: skip

    @property
    def jointed(self) -> Linkages | None:
        """Linkages as argument of kernels: with parts and segments by link, one of each per link."""
        if self.linkages is None:
            return None
        each = np.arange(len(self.segments.line) + 1, dtype=np.int32)
        parts, segments = self.parts._replace(begin=each), self.segments._replace(begin=each)
        return self.linkages._replace(bodies=self.bodies, parts=parts, segments=segments)

    @property
    def _known(self) -> Boundaries:
        return Boundaries(self.ground, self.channel, self.hooks, self.rims)

    @property
    def scratch(self) -> Scratch:
        """Scratch arrays of the kernels."""
        rows = np.zeros((self.kept.used.shape[1], boundaries.COLUMNS))
        return Scratch(self.cells, self.meeting, rows, self.plane)

    def posed(self) -> Bodies:
        """Return the bodies, after computing axes, spins, motion of parts and positions of segments."""
        pose_all(self.shapes, self.bodies, self.parts, self.segments, self.hinged)
        if self.filaments is not None:
            pose_filaments_from_python(self.filaments, self.bodies, self.parts, self.segments)
        if (jointed := self.jointed) is not None:
            pose_linkages_from_python(jointed)
        return self.bodies

    def state(self) -> PileState:
        """Return poses and velocities of all bodies.

        Raises:
            RunError: a position or velocity is not finite.
        """
        bodies, n = self.posed(), self.count
        states = (bodies.position, bodies.velocity, bodies.spin)
        broken = ~np.logical_and.reduce([np.isfinite(values).all(axis=1) for values in states])
        reject(
            broken,
            self.time,
            "positions or velocities are no numbers, the simulation has blown up",
            "lower fidelity.time_step_fraction",
        )
        if self.mixture is not None and self.filaments is not None:
            own = self.filaments
            return FilamentState(
                self.mixture,
                bodies.shape.astype(np.int64),
                *(each.copy() for each in (own.position, own.velocity, own.spin)),
            )
        if self.mixture is not None and self.linkages is not None:
            links = self.linkages.links
            each = (links.position, links.axes, links.velocity, links.spin)
            return LinkageState(
                self.mixture,
                bodies.shape.astype(np.int64),
                RigidState(self.mixture.pieces, links.shape.astype(np.int64), *(values.copy() for values in each)),
            )
        if self.mixture is not None:
            moving = (bodies.position.copy(), bodies.axes.copy(), bodies.velocity.copy(), bodies.spin.copy())
            return RigidState(self.mixture, bodies.shape.astype(np.int64), *moving)
        assert self.particle is not None  # a pile of shapes in `more` has no state for output
        places, velocities, spins = (np.empty((n, 3, 3)) for _ in range(3))
        frames = np.empty((n, 3, 3, 3))
        find_links(bodies, self.parts, 3 if self.articulated else 1, places, frames, velocities, spins)
        return State(self.particle.boxes, places, frames, velocities, spins)

    def list_near(self) -> None:
        """Build the wide list for bodies that have just been added, so that `contacts` finds theirs.

        The next step builds it again.
        """
        self.posed()
        while build_from_python(self.bodies, self.segments, self.pairs, self.cells, self.skins) == FULL:
            self.make_room(int(GROWTH * len(self.pairs.first)))
        self.forget_places()

    def contacts(self) -> Contacts:
        """Return all present contacts; the simulation is not changed.

        Contacts between bodies are found in the wide list of `pairs`, which is still valid after the last step. It
        lacks contacts of bodies that were added after this step, unless `list_near` was called.
        """
        self.posed()
        found, count, energy = self._query()
        return Contacts(found.met[:count].astype(np.int64), found.touches, found.depth, found.held, energy)

    def _query(self) -> tuple[Found, int, float]:
        found, (law, wall_law) = self._room(), self.laws
        count, energy = query_all(
            self.segments, self.pairs, self.kept, self._known, law.stiffness, wall_law.stiffness, found
        )
        return found, count, energy

    def _room(self) -> Found:
        n = self.count
        return Found(
            np.zeros((self.pairs.counts[0], 2), np.int32), np.zeros(n, np.int64), np.zeros((n, BOUNDARIES), np.bool_),
            np.zeros(n), self.meeting, self.scratch.contacts,
        )  # fmt: skip

    def extremes(self, velocities: Array) -> list[float]:
        """Return the 7 numbers that `queries.find_extremes` writes, for the last state that `state` returned.

        Args:
            velocities: (M, 3) velocities of the centres of all links, or bars, in this state [m/s].
        """
        found, (query, _, energy) = np.empty(7), self._query()
        find_extremes(self.bodies, self.segments, query.depth, velocities, energy, found)
        return [float(value) for value in found]

    def forces(self) -> Array:
        """Return the forces at all P points of contact, (P, WIDTH); for the columns see `queries.FIRST`."""
        self.posed()
        slip, contacts, (law, wall_law) = np.zeros(4), self.scratch.contacts, self.laws
        bodies, parts, segments, known = self.bodies, self.parts, self.segments, self._known
        return np.concatenate(
            [
                _rows(
                    lambda rows: forces_of_pairs(
                        law, bodies, parts, segments, self.pairs, self.links, self.time_step, self.meeting, slip, rows
                    )
                ),
                _rows(
                    lambda rows: forces_of_boundaries(
                        wall_law, bodies, parts, segments, self.kept, known, self.links, self.time_step, self.meeting,
                        contacts, slip, rows,
                    )
                ),
            ]
        )  # fmt: skip

    # -- checkpoints -------------------------------------------------------------------------------------------

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """Arrays of the simulation's state by name, for `restore`."""
        found: dict[str, NDArray[Any]] = {"totals": self.totals, "fast": self.skins}
        pairs, near = int(self.pairs.counts[0]), int(self.pairs.counts[1])
        for group, values in self._groups().items():
            for name, array in values._asdict().items():
                if isinstance(array, np.ndarray):
                    found[f"{group}.{name}"] = array
        for name in LISTS:
            found[f"pairs.{name}"] = getattr(self.pairs, name)[: near if name == "near" else pairs]
        for name in FRESH:
            found[f"pairs.{name}"] = getattr(self.pairs, name)[:0]
        return found

    def _groups(self) -> dict[str, Any]:
        groups = {
            "bodies": self.bodies,
            "pairs": self.pairs,
            "kept": self.kept,
            "ground": self.ground,
            "hooks": self.hooks,
            "rims": self.rims,
            "cords": self.cords,
            "filaments": self.filaments,
            "grips": self.grips,
            "linkages": self.linkages,
            "jointed": None if self.linkages is None else self.linkages.links,
        }
        return {name: group for name, group in groups.items() if group is not None}

    @property
    def memory(self) -> dict[str, Any]:
        """Numbers of the simulation's state by name, for `restore`."""
        return {
            "steps": self.steps,
            "time_step": self.time_step,
            "begin": self.begin,
            "made": self.made,
            "articulated": self.articulated,
        }

    def restore(self, arrays: dict[str, NDArray[Any]], memory: Mapping[str, Any]) -> None:
        """Restore the state that `arrays` and `memory` returned."""

        def group(kind: Any, name: str) -> Any:
            return kind(**{field: arrays[f"{name}.{field}"] for field in kind._fields})

        self.steps, self.time_step, self.begin, self.made, self.articulated = (
            memory[name] for name in ("steps", "time_step", "begin", "made", "articulated")
        )
        self.totals, self.skins = arrays["totals"], arrays["fast"]
        self.bodies, self.pairs = group(Bodies, "bodies"), group(Pairs, "pairs")
        self._lay_out_parts()
        fixed: dict[str, Any] = {name: arrays[f"ground.{name}"] for name in Ground._fields if name != "top"}
        self.ground = self.ground._replace(**fixed)
        self.rims = group(Rims, "rims") if "rims.heights" in arrays else None
        self.kept = group(Kept, "kept")
        self.cords = group(Cords, "cords") if "cords.anchor" in arrays else None
        self.filaments = group(Filaments, "filaments") if "filaments.body" in arrays else None
        self.grips = group(Grips, "grips") if "grips.of" in arrays else None
        if self.linkages is not None:
            own = {name[9:]: array for name, array in arrays.items() if name.startswith("linkages.")}
            self.linkages = self.linkages._replace(**own, links=group(Bodies, "jointed"))  # type: ignore[arg-type]
        self.make_room()


def _apart(kind: Shape) -> int:
    """Return the least difference of numbers of two segments of a body that can touch; 0: none can."""
    if kind.linkage is not None:
        return 2  # links with a common joint cannot
    return 0 if kind.filament is None else apart(kind.filament)


def quaternion_of(matrix: Array) -> Array:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix (3, 3)."""
    m = matrix
    squares = np.array([m.trace(), *np.diag(m)])
    k = int(squares.argmax())
    if k == 0:
        q = np.array([1 + m.trace(), m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    elif k == 1:
        q = np.array([m[2, 1] - m[1, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]])
    elif k == 2:
        q = np.array([m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 1 + m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]])
    else:
        q = np.array([m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 + m[2, 2] - m[0, 0] - m[1, 1]])
    a, b, c, d = (float(value) for value in q)
    unit: Array = q / math.sqrt(a * a + b * b + c * c + d * d)
    return unit


def no_contacts(segments: int, slots: int) -> Kept:
    """Return an empty memory of contacts with boundaries; `slots`: most contacts of a segment."""
    return Kept(np.zeros((segments, slots, 4)), np.zeros((segments, slots), np.uint8), np.zeros(segments, np.uint8))


def longer(array: NDArray[Any], length: int) -> NDArray[Any]:
    """Return the array (n, …) with rows of zeros appended up to `length` rows."""
    more = np.zeros((length - len(array), *array.shape[1:]), array.dtype)
    return np.concatenate([array, more])


def _rows(write: Callable[[Array], int]) -> Array:
    """Return all rows that a kernel writes into an array (…, WIDTH) that is enlarged as needed.

    Args:
        write: function that writes as many rows as fit into its argument, and returns the number of rows needed.
    """
    rows = np.zeros((256, WIDTH))
    while (count := write(rows)) > len(rows):
        rows = np.zeros((count, WIDTH))
    return rows[:count]
