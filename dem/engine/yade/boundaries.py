"""What does not give way to smarticles: the container's floor and wall, the hooks, or the walls of a channel."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.forces import CHANNEL, FLOOR, LOWER_HOOK, WALL
from dem.engine.yade.container import WALL_MATERIAL, add_channel, add_container
from dem.engine.yade.library import Yade
from dem.errors import RunError
from dem.setting.container import Cylinder
from dem.setting.hooks import Cross
from dem.setting.plane import Channel

Array = NDArray[np.float64]


class YadeBoundaries:
    """The fixed bodies of a simulation, how they move, and what they feel.

    Args:
        yade: the simulation.
        cylinder: the container; its floor is at z = 0 at the start.
        hooks: the lower and the upper hook; None: nothing of a hook exists.
        channel: table and walls instead of the container, for motion in a plane.
    """

    def __init__(
        self, yade: Yade, cylinder: Cylinder, hooks: tuple[Cross, Cross] | None, channel: Channel | None = None
    ) -> None:
        self._yade = yade
        self._top, self._bottom = cylinder.height, cylinder.bottom
        self._planar = channel is not None
        self.container = add_container(yade, cylinder) if channel is None else add_channel(yade, channel)
        """Ids of the container's bodies that are there, the floor last."""
        self.hooks: tuple[tuple[int, ...], ...] = tuple(_add_cross(yade, cross) for cross in hooks or ())
        """Ids of the bars of the lower and the upper hook; empty in scenes without."""
        self._upper_start = hooks[1].height if hooks else 0.0
        # Bodies whose forces are added up step by step, together for each hook or wall of a channel.
        self.felt: tuple[tuple[int, ...], ...] = self.hooks
        if self._planar:
            self.felt = tuple((wall,) for wall in self.container[:-1])
        self.moving: list[int] = []
        """Ids of the bodies that move at present, all at one velocity."""
        self._sums = [yade.vector(0, 0, 0) for _ in self.felt]
        self.book_removal: Callable[[Callable[[], None]], None] = lambda remove: remove()
        """Called with what takes contacts away, by whoever keeps an energy ledger."""

    def bind(self) -> None:
        """Take hold of YADE's objects; loading replaces them all."""
        bodies = self._yade.omega.bodies
        # The wall may be gone from what was loaded.
        self.container = [body for body in self.container if bodies[body] is not None]
        self._floor = bodies[self.container[-1]].state
        engines, moved = self._yade.omega.engines, self._yade.classes.HarmonicMotionEngine
        self._shaker = next((engine for engine in engines if isinstance(engine, moved)), None)
        self._upper = bodies[self.hooks[1][0]].state if self.hooks else None

    @property
    def memory(self) -> dict[str, Any]:
        """Plain data that `restore` needs besides the loaded simulation."""
        return {"moving": self.moving, "sums": self._totals.tolist()}

    def restore(self, memory: Mapping[str, Any]) -> None:
        """Go on from where `memory` was taken."""
        self.moving = list(memory["moving"])
        self._sums = [self._yade.vector(*row) for row in memory["sums"]]

    @property
    def bodies(self) -> list[int]:
        """Ids of all bodies that are there."""
        return [*self.container, *(bar for hook in self.hooks for bar in hook)]

    @property
    def floor(self) -> float:
        """See `dem.engine.interface.Boundaries`."""
        return float(self._floor.pos[2])

    @property
    def velocity(self) -> float:
        """See `dem.engine.interface.Boundaries`."""
        return float(self._floor.vel[2])

    # -- motion ------------------------------------------------------------------------------------------------

    def _move(self, bodies: Sequence[int], speed: float) -> None:
        for body in bodies:
            self._yade.omega.bodies[body].state.vel = self._yade.vector(0, 0, speed)
        self.moving = list(bodies)

    def shake(self, *, amplitude: float, frequency: float, walls: bool = True) -> None:
        """See `dem.engine.interface.Boundaries`."""
        if self._shaker is None:
            msg = "the engine was built without a shaker"
            raise RunError(msg)
        # YADE sets v(t) = -Aω sin(ωt + φ) before the integrator moves by v dt. Half a step is added to the phase, so
        # that each move uses the velocity at its middle and the position follows z(t) to second order, without drift.
        omega, simulation = 2 * math.pi * frequency, self._yade.omega
        phase = -math.pi / 2 - omega * (simulation.time - simulation.dt / 2)
        self._shaker.A = self._yade.vector(0, 0, amplitude)
        self._shaker.f = self._yade.vector(0, 0, frequency)
        self._shaker.fi = self._yade.vector(0, 0, phase)
        self._shaker.ids = self.moving = self.bodies if walls else self.container[-1:]
        self._shaker.dead = False

    def stop(self) -> None:
        """See `dem.engine.interface.Boundaries`."""
        if self._shaker is not None:
            self._shaker.dead = True
        self._move(self.bodies, 0.0)
        self.moving = []

    def power(self) -> float:
        """Power of what moves on the smarticles in the step that was just made [W]."""
        # What smarticles exert on it is the opposite of what it exerts on them.
        lift = self._yade.utils.sumForces(self.moving, self._yade.vector(0, 0, 1))
        return -float(lift * self._yade.omega.bodies[self.moving[0]].state.vel[2])

    # -- wall --------------------------------------------------------------------------------------------------

    @property
    def walled(self) -> bool:
        """Whether the wall is there, wherever it is."""
        return len(self.container) > 1

    @property
    def wall_bottom(self) -> float:
        """Height of the wall's lower edge [m]; inf without a wall."""
        if not self.walled:
            return math.inf
        facet = self._yade.omega.bodies[self.container[0]]
        return float(facet.state.pos[2] + min(corner[2] for corner in facet.shape.vertices))

    def lift_wall(self, speed: float) -> None:
        """Move the wall upwards at a speed [m/s] from now on."""
        self._move(self.container[:-1], speed)

    def remove_wall(self) -> None:
        """See `dem.engine.interface.Boundaries`."""
        self.book_removal(self._remove_wall)

    def _remove_wall(self) -> None:
        self.moving = []
        for body in self.container[:-1]:
            self._yade.omega.bodies.erase(body)
        self.container = self.container[-1:]

    # -- hooks -------------------------------------------------------------------------------------------------

    @property
    def upper_height(self) -> float:
        """Height of the upper hook's centre [m]."""
        assert self._upper is not None  # asked of scenes with hooks only
        return float(self._upper.pos[2])

    def raise_upper(self, speed: float) -> None:
        """Move the upper hook upwards at a speed [m/s] from now on."""
        self._move(self.hooks[1], speed)

    def feel(self) -> None:
        """Take note of the forces on hooks or walls of a channel in the step that was just made."""
        force = self._yade.omega.forces.f
        for k, (first, *others) in enumerate(self.felt):
            total = force(first)
            for body in others:
                total = total + force(body)
            self._sums[k] += total

    @property
    def hook_sums(self) -> Array:
        """(2, 3) forces of the smarticles on the lower and the upper hook, summed over all steps so far [N].

        A difference of two over the steps between them is a mean that misses no impact.
        """
        return self._totals[: len(self.hooks)]

    @property
    def channel_sums(self) -> Array:
        """(2, 3) the same for the lower and the upper wall of a channel; (0, 3) without walls."""
        return self._totals[len(self.hooks) :]

    @property
    def _totals(self) -> Array:
        return np.array([[s[0], s[1], s[2]] for s in self._sums]).reshape(-1, 3)

    def parts(self) -> Mapping[str, tuple[Sequence[int], float]]:
        """What smarticles can hold on to, in scenes with hooks: ids of its bodies, and how far it was raised [m].

        Raised against the floor, since the start.
        """
        if not self.hooks:
            return {}
        floor, wall = self.floor, self.container[:-1]
        found: dict[str, tuple[Sequence[int], float]] = {
            "the lower hook": (self.hooks[0], 0.0),
            "the upper hook": (self.hooks[1], self.upper_height - floor - self._upper_start),
        }
        return found | ({"the wall": (wall, self.wall_bottom - floor - self._bottom)} if wall else {})

    @property
    def part_of(self) -> Mapping[int, int]:
        """Place in `dem.body.forces.BOUNDARIES` by id of body."""
        *walls, floor = self.container
        numbers = [CHANNEL + k for k in range(len(walls))] if self._planar else [WALL] * len(walls)
        found = {floor: FLOOR, **dict(zip(walls, numbers, strict=True))}
        return found | {bar: LOWER_HOOK + k for k, bars in enumerate(self.hooks) for bar in bars}

    # -- what smarticles may do --------------------------------------------------------------------------------

    @property
    def enclosed(self) -> bool:
        """Whether nothing can leave the container: the wall is there, and begins below the floor."""
        return not self._planar and self.walled and self.wall_bottom < self.floor

    @property
    def raised(self) -> float | None:
        """How far the pile may have been raised by a hook [m]; None where nothing holds it back any more.

        That is when the wall is gone or lifted, or a hook was pulled out over it; or in a plane, where walls hold but
        the container's limits do not apply.
        """
        if not self.enclosed:
            return None
        if self._upper is None:
            return 0.0
        height = self.upper_height - self.floor
        # Moved by the floor's velocity, step by step: apart from it by rounding, when it was never raised.
        return None if height > self._top else max(0.0, height - self._upper_start)


def _add_cross(yade: Yade, cross: Cross) -> tuple[int, ...]:
    """Add the bars of a hook.

    Boxes, not rows of spheres: the faces are flat and the edges square as asked for, a sphere has one contact with a
    bar wherever it touches it, and forces are those of two bodies.
    """
    return tuple(
        int(
            yade.omega.bodies.append(
                yade.utils.box(
                    yade.vector(*bar.middle, cross.height), yade.vector(*bar.half), material=WALL_MATERIAL, fixed=True
                )
            )
        )
        for bar in cross.bars
    )
