"""Rigid boundaries on the engine links: floor, round wall of one or more tiers, hooks, or a channel."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dem.engine.links.arrays import BOUNDARIES, CHANNEL, FLOOR, LOWER, PLATE, UPPER, WALL, Ground
from dem.engine.links.world import World
from dem.errors import RunError
from dem.setting.container import Cylinder
from dem.setting.hooks import Cross
from dem.setting.plane import Channel

Array = NDArray[np.float64]


def ground_for(cylinder: Cylinder, hooks: tuple[Cross, Cross] | None, channel: Channel | None) -> Ground:
    """Return the boundaries at the start: floor at z = 0, or the table of a plane."""
    place = np.zeros(BOUNDARIES)
    place[PLATE] = math.inf
    if channel is not None:
        place[FLOOR] = channel.table
    if hooks is not None:
        place[[LOWER, UPPER]] = [cross.height for cross in hooks]
    return Ground(
        bottoms=np.array([cylinder.bottom, *(bottom for bottom, _ in cylinder.upper)]),
        radii=np.array([cylinder.radius, *(radius for _, radius in cylinder.upper)]),
        top=cylinder.height,
        flags=np.array([int(channel is None), 0]),
        place=place,
        speed=np.zeros(BOUNDARIES),
        rise=np.zeros(BOUNDARIES),
        base=np.zeros(BOUNDARIES),
        shaken=np.zeros(BOUNDARIES, dtype=np.int64),
        wave=np.zeros(3),
        force=np.zeros((BOUNDARIES, 3)),
        sums=np.zeros((BOUNDARIES, 3)),
    )


class LinksBoundaries:
    """`dem.engine.interface.Boundaries` on links.

    `removed` is `LinksLedger.removed`, which calls its argument, a function that removes contacts, and counts the
    energy of these contacts as dissipated.
    """

    def __init__(
        self, world: World, cylinder: Cylinder, *, shaken: bool, removed: Callable[[Callable[[], None]], None]
    ) -> None:
        self._world = world
        self._top = cylinder.height
        self._shaken = shaken
        self._removed = removed
        self._starts = world.ground.place.copy()

    @property
    def _ground(self) -> Ground:
        return self._world.ground

    # -- how they stand ----------------------------------------------------------------------------------------

    @property
    def floor(self) -> float:
        return float(self._ground.place[FLOOR])

    @property
    def velocity(self) -> float:
        return float(self._ground.speed[FLOOR])

    @property
    def walled(self) -> bool:
        """Whether there is a wall, or walls of a channel."""
        channel = self._world.channel
        return bool(self._ground.flags[0]) or (channel is not None and math.isfinite(channel[0]))

    @property
    def wall_bottom(self) -> float:
        return float(self._ground.place[WALL] + self._ground.bottoms[0]) if self._ground.flags[0] else math.inf

    @property
    def enclosed(self) -> bool:
        return bool(self._ground.flags[0]) and self.wall_bottom < self.floor

    @property
    def raised(self) -> float | None:
        if not self.enclosed:
            return None
        grips, lifted = self._world.grips, 0.0
        if grips is not None:
            lifted = float(grips.moved[:, 2].max(initial=0.0))
        if self._world.hooks is None:
            return lifted
        height = self.upper_height - self.floor
        return None if height > self._top else max(lifted, height - float(self._starts[UPPER]))

    @property
    def upper_height(self) -> float:
        return float(self._ground.place[UPPER])

    @property
    def plate_height(self) -> float | None:
        height = float(self._ground.place[PLATE])
        return height if math.isfinite(height) else None

    # -- how they move -----------------------------------------------------------------------------------------

    def shake(self, *, amplitude: float, frequency: float, walls: bool = True, from_rest: bool = False) -> None:
        if not self._shaken:
            raise RunError("the engine was built without a shaker")
        ground, hooked, world = self._ground, walls and self._world.hooks is not None, self._world
        ground.base[:] = ground.place
        ground.speed[:] = ground.rise
        ground.shaken[:] = [1, walls and ground.flags[0], hooked, hooked, 0, 0, walls and self.plate_height is not None]
        ground.wave[:] = amplitude, 2 * math.pi * frequency, world.time
        if world.grips is not None:
            world.grips.rides[0] = float(walls)
        if from_rest:
            ground.base[ground.shaken != 0] += amplitude
            ground.wave[2] += 0.25 / frequency

    def stop_shaking(self) -> None:
        self._ground.shaken[:] = 0
        self._ground.wave[:] = 0.0
        self._ground.speed[:] = self._ground.rise

    def lift_wall(self, speed: float) -> None:
        self._move(WALL, speed)
        if not self._ground.flags[1]:
            self._ground.flags[1] = 1
            self._world.add_rim(float(self._ground.bottoms[0]), float(self._ground.radii[0]))

    def raise_upper(self, speed: float) -> None:
        self._move(UPPER, speed)

    def place_plate(self, height: float) -> None:
        self._ground.place[PLATE] = self._ground.base[PLATE] = height

    def move_plate(self, speed: float) -> None:
        before = float(self._ground.speed[PLATE])
        self._move(PLATE, speed)
        if not self._ground.shaken[PLATE]:
            # The next force acts for half a step before now and half a step after; then the speed follows `rise`.
            self._ground.speed[PLATE] = 0.5 * (before + speed)

    def remove_plate(self) -> None:
        self._removed(self._world.remove_plate)

    def _move(self, part: int, speed: float) -> None:
        self._ground.rise[part] = speed
        if not self._ground.shaken[part]:  # otherwise the next step computes it
            self._ground.speed[part] = speed

    def stop(self) -> None:
        self._ground.rise[:] = 0.0
        self.stop_shaking()

    def remove_wall(self) -> None:
        self._removed(self._world.remove_wall)

    # -- what they feel ----------------------------------------------------------------------------------------

    @property
    def hook_sums(self) -> Array:
        return self._ground.sums[LOWER : UPPER + 1].copy() if self._world.hooks is not None else np.zeros((0, 3))

    @property
    def channel_sums(self) -> Array:
        channel = self._world.channel
        there = channel is not None and math.isfinite(channel[0])
        return self._ground.sums[CHANNEL:PLATE].copy() if there else np.zeros((0, 3))

    @property
    def plate_sum(self) -> Array:
        total: Array = self._ground.sums[PLATE].copy()
        return total

    @property
    def container_force(self) -> Array:
        """(3,) force of the bodies on floor and wall in the last step [N]."""
        force: Array = self._ground.force[: WALL + 1].sum(axis=0)
        return force

    def parts(self) -> dict[str, tuple[int, float]]:
        """Return index and rise of the boundaries between which bodies can be squeezed.

        Keys are "the lower hook", "the upper hook" and, if there is a wall, "the wall"; values the index in
        `Ground.place` and the rise relative to the floor since the start [m]. Empty without hooks.
        """
        if self._world.hooks is None:
            return {}
        moved = self._ground.place[: UPPER + 1] - self._starts[: UPPER + 1]  # not the plate's, which may be at inf
        rise = moved - moved[FLOOR]
        found = {"the lower hook": (LOWER, 0.0), "the upper hook": (UPPER, float(rise[UPPER]))}
        return found | ({"the wall": (WALL, float(rise[WALL]))} if self._ground.flags[0] else {})
