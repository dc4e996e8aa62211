"""Grips that hold rigid bodies on the engine links."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.engine.links.arrays import PER_GRIP, Grips
from dem.engine.links.world import World, longer

Array = NDArray[np.float64]


class LinksGrips:
    """`dem.engine.interface.Grips` on links, for worlds with `grips`."""

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def _all(self) -> Grips:
        assert self._world.grips is not None
        return self._world.grips

    def hold(self, bodies: Sequence[int]) -> int:
        own, number = self._all, len(self._all.speed)
        own.of[list(bodies)] = number + 1
        own.made[0] += 1
        more: dict[str, Any] = {name: longer(getattr(own, name), number + 1) for name in PER_GRIP}
        self._world.grips = own._replace(**more)
        return number

    def move(self, grip: int, velocity: tuple[float, float, float]) -> None:
        self._all.speed[grip] = velocity

    def release(self) -> None:
        self._all.of[:] = 0
        none: dict[str, Any] = {name: np.zeros((0, 3)) for name in PER_GRIP}
        self._world.grips = self._all._replace(**none)

    @property
    def made(self) -> int:
        return int(self._all.made[0])

    @property
    def sums(self) -> Array:
        return self._all.sums.copy()

    @property
    def pushed(self) -> Array:
        return self._all.pushed.copy()

    @property
    def moved(self) -> Array:
        return self._all.moved.copy()

    @property
    def counts(self) -> NDArray[np.int64]:
        return np.bincount(self._all.of, minlength=1 + len(self._all.speed))[1:]

    @property
    def places(self) -> Array:
        of, positions = self._all.of, self._world.bodies.position
        totals = [positions[of == k + 1].sum(axis=0) for k in range(len(self._all.speed))]
        return np.array(totals).reshape(-1, 3) / np.maximum(1, self.counts)[:, None]

    @property
    def weights(self) -> Array:
        own, world = self._all, self._world
        masses = world.shapes.mass[world.bodies.shape]
        return np.asarray(world.gravity * np.bincount(own.of, masses, minlength=1 + len(own.speed))[1:])
