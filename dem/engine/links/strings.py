"""The two strings of a chain on the engine links."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dem.body.chain import Tie
from dem.engine.links.arrays import Cords
from dem.engine.links.contact.cords import find_knots
from dem.engine.links.world import World
from dem.physics.contact import StringLaw

Array = NDArray[np.float64]


class LinksStrings:
    """`dem.engine.interface.Strings` on links."""

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def tied(self) -> bool:
        return self._world.cords is not None

    def tie(self, ties: Sequence[Tie], law: StringLaw, speeds: Sequence[float]) -> None:
        count = len(ties)
        cords = Cords(
            owner=np.array([(tie.smarticle, tie.link) for tie in ties], dtype=np.int64).reshape(count, 2),
            along=np.array([tie.along for tie in ties], dtype=np.float64),
            anchor=np.zeros((count, 3)),
            start=np.zeros((count, 3)),
            speed=np.zeros(count),
            law=np.array([law.length, law.stiffness, law.damping], dtype=np.float64),
            sums=np.zeros((count, 3)),
            knot=np.zeros((count, 3)),
        )
        find_knots(self._world.posed(), cords)
        for k, speed in enumerate(speeds):
            x, y = cords.knot[k, :2]
            away = math.copysign(1.0, x)
            cords.anchor[k] = x + away * math.sqrt(law.length**2 - y**2), 0.0, 0.0
            cords.speed[k] = away * speed
        cords.start[:] = cords.anchor
        self._world.cords = cords

    def untie(self) -> None:
        self._world.cords = None

    @property
    def sums(self) -> Array:
        return self._at_work.sums.copy()

    @property
    def pulled(self) -> float:
        cords = self._at_work
        return float(np.ptp(cords.anchor[:, 0]) - np.ptp(cords.start[:, 0]))

    @property
    def ties(self) -> Array:
        cords = self._at_work
        find_knots(self._world.posed(), cords)
        return cords.knot.copy()

    @property
    def _at_work(self) -> Cords:
        assert self._world.cords is not None  # asked while strings are tied only
        return self._world.cords
