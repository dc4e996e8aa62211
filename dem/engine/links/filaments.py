"""What a run does with filaments on the links engine, and asks of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.engine.links.arrays import Filaments
from dem.engine.links.motion import bending
from dem.engine.links.world import World

Array = NDArray[np.float64]


class FilamentEnergies(NamedTuple):
    """Energies of all filaments [J]; work since the start."""

    kinetic: float  #: Of nodes and of rolling, half a step before
    potential: float  #: Weight less buoyancy times height above z = 0
    stretching: float
    bending: float  #: Against the preferred curvature
    twisting: float
    damped: float  #: Taken by internal damping
    dragged: float  #: Taken by the liquid's drag
    active: float  #: Given by changes of the preferred curvature
    gripped: float  #: Given by grips

    @property
    def stored(self) -> float:
        """[J]."""
        return self.kinetic + self.potential + self.stretching + self.bending + self.twisting

    @property
    def residual(self) -> float:
        """What is stored, less what was given, plus what was taken; constant without contacts [J]."""
        return self.stored + self.damped + self.dragged - self.active - self.gripped


class LinksFilaments:
    """What a run does with the filaments of a world, which `World.add_filaments` adds, and asks of them."""

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def _all(self) -> Filaments:
        assert self._world.filaments is not None
        return self._world.filaments

    def points(self, filament: int) -> Array:
        """Return a view of the nodes (nodes, 3) of a filament [m]."""
        return self._all.position[self._nodes(filament)]

    def _nodes(self, filament: int) -> slice:
        begin = self._all.begin
        return slice(int(begin[filament]), int(begin[filament + 1]))

    def grip(self, nodes: Mapping[int, Sequence[int]], *, directions: str = "xyz") -> int:
        """Hold nodes by a new grip, which is at rest.

        Args:
            nodes: for each filament, its nodes that are held; negative numbers count from its end. Two neighbours
                that are held in all directions clamp the segment between them, which does not roll either.
            directions: of x, y and z, those in which nodes are held; they are free in the others.

        Returns:
            Number of the grip.
        """
        all_, number = self._all, len(self._all.grip_speed)
        bits = sum(1 << "xyz".index(each) for each in directions)
        for filament, own in nodes.items():
            all_.grip[self._nodes(filament)][list(own)] = bending.GRIP * number + bits
        more = {name: np.append(getattr(all_, name), np.zeros((1, 3)), axis=0) for name in ("grip_speed", "grip_force")}
        self._world.filaments = all_._replace(**more)
        return number

    def move(self, grip: int, velocity: tuple[float, float, float]) -> None:
        """Move a grip with a velocity [m/s] from now on: a path is a list of these."""
        self._all.grip_speed[grip] = velocity

    def release(self, grip: int) -> None:
        """Let go of all nodes that a grip holds."""
        held = (self._all.grip != 0) & (self._all.grip // bending.GRIP == grip)
        self._all.grip[held] = 0

    def force(self, grip: int) -> Array:
        """Return the force (3,) of a grip on its nodes in the last step [N]."""
        force: Array = self._all.grip_force[grip].copy()
        return force

    def act(
        self, factor: float, *, rate: float | None = None, reversal_rate: float | None = None, ramp: float = 0.0
    ) -> None:
        """Change how filaments bend by themselves.

        Args:
            factor: on the amplitudes of their preferred curvatures [1]; 0: quiet.
            rate: α [rad/s]; None: as it is.
            reversal_rate: λ [1/s]; None: as it is.
            ramp: time in which the factor changes [s].
        """
        gait = self._all.gait
        gait[:, bending.TARGET] = factor
        gait[:, bending.CHANGE] = math.inf if ramp == 0 else np.abs(factor - gait[:, bending.FACTOR]) / ramp
        if rate is not None:
            gait[:, bending.RATE] = rate
        if reversal_rate is not None:
            gait[:, bending.REVERSALS], gait[:, bending.WAIT] = reversal_rate, math.inf

    @property
    def energies(self) -> FilamentEnergies:
        """Energies at this instant, and work up to it."""
        found = np.zeros(5)
        bending.measure(self._all, self._world.gravity, found)
        return FilamentEnergies(*(float(value) for value in (*found, *self._all.sums)))
