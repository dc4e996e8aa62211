"""Grips, ramp and energies, which filaments and linkages have in common on the engine links."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.filament import FilamentEnergies
from dem.engine.links.arrays import Filaments, Linkages
from dem.engine.links.motion import bending
from dem.engine.links.world import World, longer

Array = NDArray[np.float64]


class FlexibleBodies:
    """Base of the classes that implement `dem.engine.interface.Filaments` on links.

    Members are the nodes of filaments, or the links of linkages. The entry of a member in `grip` of the arrays is 0 if
    it is free, otherwise `PER_GRIP` times the number of the grip that holds it, plus 1 to `PER_GRIP`.
    """

    PER_GRIP: int

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def _all(self) -> Filaments | Linkages:
        """Arrays of all bodies."""
        raise NotImplementedError

    def _replace(self, fields: dict[str, Any]) -> None:
        """Replace fields of the arrays of all bodies."""
        raise NotImplementedError

    def _measure(self, found: Array) -> None:
        """Write the five present energies, in the order of `FilamentEnergies` [J]."""
        raise NotImplementedError

    def _members(self, body: int) -> slice:
        """Return the rows of the members of a body in the arrays."""
        begin = self._all.begin
        return slice(int(begin[body]), int(begin[body + 1]))

    def _hold(self, members: Mapping[int, Sequence[int]], directions: int) -> int:
        """Hold members by a new grip, which is at rest; return its number.

        Members are given by the number of their body; negative numbers count from its end. `directions`, from 1 to
        `PER_GRIP`, is added to the entries in `grip`.
        """
        all_, number = self._all, len(self._all.grip_speed)
        for body, held in members.items():
            all_.grip[self._members(body)][list(held)] = self.PER_GRIP * number + directions
        self._replace({name: longer(getattr(all_, name), number + 1) for name in ("grip_speed", "grip_force")})
        return number

    def move(self, grip: int, velocity: tuple[float, float, float]) -> None:
        """Move a grip with a velocity (x, y, z) [m/s] from now on."""
        self._all.grip_speed[grip] = velocity

    def release(self, grip: int | None = None) -> None:
        """Release all nodes or links that a grip holds; None: those of all grips."""
        held = self._all.grip
        held[(grip is None) | ((held - 1) // self.PER_GRIP == grip)] = 0

    @property
    def held(self) -> int:
        """Number of bodies of which a grip holds at least one node or link."""
        own = self._all
        return len(np.unique(np.searchsorted(own.begin, np.flatnonzero(own.grip), side="right")))

    def force(self, grip: int | None = None) -> Array:
        """Return the force (3,) of a grip on its nodes or links in the last step [N]; None: of all grips."""
        forces = self._all.grip_force
        force: Array = forces.sum(axis=0) if grip is None else forces[grip].copy()
        return force

    def _begin_ramp(self, ramp: float) -> None:
        """Let the factor on all waves grow from 0 to 1 in a time `ramp` [s], and draw new times of reversals."""
        gait = self._all.gait
        gait[:, bending.WAIT] = math.inf
        gait[:, bending.FACTOR] = 1.0 if ramp == 0 else 0.0
        gait[:, bending.TARGET] = 1.0
        gait[:, bending.CHANGE] = math.inf if ramp == 0 else 1.0 / ramp

    @property
    def energies(self) -> FilamentEnergies:
        """Present energies, and energies exchanged up to now."""
        found = np.zeros(5)
        self._measure(found)
        return FilamentEnergies(*(float(value) for value in (*found, *self._all.sums)))
