"""Rigid boundaries in YADE: floor and wall of flat facets, hooks, or table and walls of a channel."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from dem.arrays import Array
from dem.body.forces import CHANNEL, FLOOR, LOWER_HOOK, WALL
from dem.body.linear import by_element
from dem.engine.yade.construction import WALL_MATERIAL
from dem.engine.yade.library import Yade, rows_of
from dem.errors import RunError
from dem.setting.container import Cylinder
from dem.setting.hooks import Cross
from dem.setting.plane import Channel


class YadeBoundaries:
    """`dem.engine.interface.Boundaries` on YADE.

    `hooks` are the lower and the upper hook; a channel replaces the container. At the start the floor is at z = 0.
    """

    def __init__(
        self, yade: Yade, cylinder: Cylinder, hooks: tuple[Cross, Cross] | None, channel: Channel | None = None
    ) -> None:
        self._yade = yade
        self._top, self._bottom = cylinder.height, cylinder.bottom
        self._planar = channel is not None
        self.container = add_container(yade, cylinder) if channel is None else add_channel(yade, channel)
        """Ids of the present bodies of the container, the floor last."""
        self.hooks: tuple[tuple[int, ...], ...] = tuple(add_cross(yade, cross) for cross in hooks or ())
        """Ids of the bars of the lower and the upper hook."""
        self._upper_start = hooks[1].height if hooks else 0.0
        self.measured = tuple((wall,) for wall in self.container[:-1]) if self._planar else self.hooks
        """Ids of the bodies of each hook, or of each wall of a channel, whose force is summed over steps."""
        self.moving: list[int] = []  #: Ids of the bodies that move at present, all at one velocity
        self._sums = [yade.vector(0, 0, 0) for _ in self.measured]
        self.book_removal: Callable[[Callable[[], None]], None] = lambda remove: remove()
        """Function that calls its argument, which removes contacts; replaced by the energy ledger's method."""

    def bind(self) -> None:
        """Look up YADE's objects again, after loading has replaced them."""
        bodies = self._yade.omega.bodies
        # The loaded simulation may have no wall.
        self.container = [body for body in self.container if bodies[body] is not None]
        self._floor = bodies[self.container[-1]].state
        engines, moved = self._yade.omega.engines, self._yade.classes.HarmonicMotionEngine
        self._shaker = next((engine for engine in engines if isinstance(engine, moved)), None)
        self._upper = bodies[self.hooks[1][0]].state if self.hooks else None

    @property
    def memory(self) -> dict[str, Any]:
        return {"moving": self.moving, "sums": self._totals.tolist()}

    def restore(self, memory: Mapping[str, Any]) -> None:
        self.moving = list(memory["moving"])
        self._sums = [self._yade.vector(*row) for row in memory["sums"]]

    @property
    def floor(self) -> float:
        return float(self._floor.pos[2])

    @property
    def velocity(self) -> float:
        return float(self._floor.vel[2])

    @property
    def walled(self) -> bool:
        return len(self.container) > 1

    @property
    def wall_bottom(self) -> float:
        if not self.walled:
            return math.inf
        facet = self._yade.omega.bodies[self.container[0]]
        return float(facet.state.pos[2] + min(corner[2] for corner in facet.shape.vertices))

    @property
    def enclosed(self) -> bool:
        return not self._planar and self.walled and self.wall_bottom < self.floor

    @property
    def raised(self) -> float | None:
        # A pile is no longer enclosed once the wall is gone or lifted, or a hook was pulled out above it; in a plane
        # there are walls, but the container's limits do not apply.
        if not self.enclosed:
            return None
        if self._upper is None:
            return 0.0
        height = self.upper_height - self.floor
        # Hook and floor move by equal steps: without a pull their distance changes by rounding only.
        return None if height > self._top else max(0.0, height - self._upper_start)

    @property
    def upper_height(self) -> float:
        assert self._upper is not None  # asked of scenes with hooks only
        return float(self._upper.pos[2])

    def parts(self) -> Mapping[str, tuple[Sequence[int], float]]:
        """Return ids and rise of the boundaries between which smarticles can be squeezed.

        Returns:
            Keys are "the lower hook", "the upper hook" and, if there is a wall, "the wall". A value has the ids of the
            boundary's bodies in YADE, and its rise relative to the floor since the start [m]. Empty without hooks.
        """
        if not self.hooks:
            return {}
        wall = self.container[:-1]
        found: dict[str, tuple[Sequence[int], float]] = {
            "the lower hook": (self.hooks[0], 0.0),
            "the upper hook": (self.hooks[1], self.upper_height - self.floor - self._upper_start),
        }
        return found | ({"the wall": (wall, self.wall_bottom - self.floor - self._bottom)} if wall else {})

    @property
    def part_of(self) -> Mapping[int, int]:
        """Index in `dem.body.forces.BOUNDARIES` of each YADE body that is a floor, wall or hook, by its id."""
        *walls, floor = self.container
        numbers = [CHANNEL + k for k in range(len(walls))] if self._planar else [WALL] * len(walls)
        found = {floor: FLOOR, **dict(zip(walls, numbers, strict=True))}
        return found | {bar: LOWER_HOOK + k for k, bars in enumerate(self.hooks) for bar in bars}

    def _move(self, bodies: Sequence[int], speed: float) -> None:
        for body in bodies:
            self._yade.omega.bodies[body].state.vel = self._yade.vector(0, 0, speed)
        self.moving = list(bodies)

    @property
    def _bodies(self) -> list[int]:
        return [*self.container, *(bar for hook in self.hooks for bar in hook)]

    def shake(self, *, amplitude: float, frequency: float, walls: bool = True, from_rest: bool = False) -> None:
        if self._shaker is None:
            raise RunError("the engine was built without a shaker")
        # YADE sets v(t) = -Aω sin(ωt + φ) before the integrator moves by v dt. Half a step is added to the phase, so
        # that each move uses the velocity at its middle and the position follows z(t) to second order, without drift.
        omega, simulation = 2 * math.pi * frequency, self._yade.omega
        phase = (-math.pi if from_rest else -math.pi / 2) - omega * (simulation.time - simulation.dt / 2)
        self._shaker.A = self._yade.vector(0, 0, amplitude)
        self._shaker.f = self._yade.vector(0, 0, frequency)
        self._shaker.fi = self._yade.vector(0, 0, phase)
        self._shaker.ids = self.moving = self._bodies if walls else self.container[-1:]
        self._shaker.dead = False

    def stop_shaking(self) -> None:
        self.stop()

    def lift_wall(self, speed: float) -> None:
        self._move(self.container[:-1], speed)

    def raise_upper(self, speed: float) -> None:
        self._move(self.hooks[1], speed)

    def stop(self) -> None:
        if self._shaker is not None:
            self._shaker.dead = True
        self._move(self._bodies, 0.0)
        self.moving = []

    plate_height = None

    @property
    def plate_sum(self) -> Array:
        return np.zeros(3)

    def place_plate(self, height: float) -> None:
        raise RunError("engine: yade has no plates")

    def move_plate(self, speed: float) -> None:
        """Do nothing without a plate."""

    def remove_plate(self) -> None:
        """Do nothing without a plate."""

    def remove_wall(self) -> None:
        self.book_removal(self._remove_wall)

    def _remove_wall(self) -> None:
        self.moving = []
        for body in self.container[:-1]:
            self._yade.omega.bodies.erase(body)
        self.container = self.container[-1:]

    def power(self) -> float:
        """Return the power that moving boundaries exerted on smarticles in the last step [W]."""
        # YADE sums the forces on the boundaries, opposite to those on smarticles.
        lift = self._yade.utils.sumForces(self.moving, self._yade.vector(0, 0, 1))
        return -float(lift * self._yade.omega.bodies[self.moving[0]].state.vel[2])

    def sum_forces(self) -> None:
        """Add the last step's forces on hooks, or on walls of a channel, to their sums over steps."""
        force = self._yade.omega.forces.f
        for k, (first, *others) in enumerate(self.measured):
            total = force(first)
            for body in others:
                total = total + force(body)
            self._sums[k] += total

    @property
    def hook_sums(self) -> Array:
        return self._totals[: len(self.hooks)]

    @property
    def channel_sums(self) -> Array:
        return self._totals[len(self.hooks) :]

    @property
    def _totals(self) -> Array:
        return rows_of(self._sums)


def add_container(yade: Yade, cylinder: Cylinder) -> list[int]:
    """Add a container with its floor at z = 0; return the ids of the bodies: wall from below, then floor."""
    # The polygon has the circle's area; the wall starts below the floor, so that no gap opens at the edge.
    bottoms = [cylinder.bottom, *(bottom for bottom, _ in cylinder.upper), cylinder.height]
    rings = [_ring(cylinder, radius) for radius in (cylinder.radius, *(radius for _, radius in cylinder.upper))]
    bodies = []
    for k, ring in enumerate(rings):
        bodies += list(_band(yade, (ring, bottoms[k]), (ring, bottoms[k + 1])))
        if k + 1 < len(rings):
            # The ceiling of a tier where the next tier is narrower.
            bodies += list(_band(yade, (ring, bottoms[k + 1]), (rings[k + 1], bottoms[k + 1])))
    # sense=1: the floor always pushes upwards, so that spheres pressed through it do not come out below.
    bodies.append(yade.utils.wall(0, axis=2, sense=1, material=WALL_MATERIAL))
    return [yade.omega.bodies.append(body) for body in bodies]


def _ring(cylinder: Cylinder, radius: float) -> Array:
    """Return (n + 1, 2) corners of the wall's polygon [m]; the first corner is repeated at the end."""
    corner = cylinder.corner_radius_of(radius)
    angles = 2 * math.pi * np.arange(cylinder.facets + 1) / cylinder.facets
    return np.stack([corner * by_element(math.cos, angles), corner * by_element(math.sin, angles)], axis=1)


def _band(yade: Yade, one: tuple[Array, float], other: tuple[Array, float]) -> Iterator[Any]:
    """Yield facets between two rings; a ring consists of its corners (n + 1, 2) and its height [m]."""
    for (start, end), (above_start, above_end) in zip(pairwise(one[0]), pairwise(other[0]), strict=True):
        a, b = yade.vector(*start, one[1]), yade.vector(*end, one[1])
        c, d = yade.vector(*above_end, other[1]), yade.vector(*above_start, other[1])
        yield yade.utils.facet([a, b, c], material=WALL_MATERIAL, fixed=True)
        yield yade.utils.facet([a, c, d], material=WALL_MATERIAL, fixed=True)


def add_channel(yade: Yade, channel: Channel) -> list[int]:
    """Add the channel with centrelines at z = 0; return ids of lower and upper wall, if any, and table."""
    bodies = []
    if channel.width is not None:
        # Each wall always pushes to its inner side, like the container's floor.
        for side in (-1, 1):
            place = side * channel.width / 2
            bodies.append(yade.utils.wall(place, axis=1, sense=-side, material=WALL_MATERIAL))
    bodies.append(yade.utils.wall(channel.table, axis=2, sense=1, material=WALL_MATERIAL))
    return [int(yade.omega.bodies.append(body)) for body in bodies]


def add_cross(yade: Yade, cross: Cross) -> tuple[int, ...]:
    """Add the bars of a hook as boxes, which have one contact with each sphere; return their ids."""
    boxes = [(yade.vector(*bar.middle, cross.height), yade.vector(*bar.half)) for bar in cross.bars]
    return tuple(
        int(yade.omega.bodies.append(yade.utils.box(middle, half, material=WALL_MATERIAL, fixed=True)))
        for middle, half in boxes
    )
