"""Grips, gaits and energies of linkages on the engine links."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.filament import Activity
from dem.body.linkage import Linkage, Undulation
from dem.engine.interface import JointReadings
from dem.engine.links.arrays import Linkages
from dem.engine.links.flexible import FlexibleBodies
from dem.engine.links.joints import swings_of
from dem.engine.links.motion import bending, joining

Array = NDArray[np.float64]


class LinksLinkages(FlexibleBodies):
    """`dem.engine.interface.Filaments` on links, for linkages."""

    PER_GRIP = 1

    @property
    def _all(self) -> Linkages:
        assert self._world.linkages is not None
        return self._world.linkages

    def _replace(self, fields: dict[str, Any]) -> None:
        self._world.linkages = self._all._replace(**fields)

    def points(self, linkage: int) -> Array:
        """Return the middles (n, 3) of a linkage's links [m], as a view of the engine's array."""
        return self._all.links.position[self._members(linkage)]

    def grip(self, links: Mapping[int, Sequence[int]]) -> int:
        """Hold links by a new grip, which is at rest; return its number. Held links do not turn.

        Links are given by the number of their linkage; -1 is its last link.
        """
        return self._hold(links, 1)

    def act(self, activity: Activity | Undulation | None, *, ramp: float = 0.0) -> None:
        """Set the gait of the motors of all linkages from now on.

        Without an activity they return to the angles at the start. Swings grow from 0 in the time `ramp` [s].
        """
        assert not isinstance(activity, Activity)  # the scene was checked
        own, gait = self._all, self._all.gait
        for number, body in enumerate(own.body):
            linkage = self._linkage(int(body))
            swings = [] if activity is None else activity.swings_of(linkage)
            own.swing[self._members(number)] = swings_of(linkage, swings)
        gait[:, bending.RATE] = 0.0 if activity is None else activity.rate
        gait[:, bending.REVERSALS] = 0.0 if activity is None else activity.reversal_rate
        if activity is not None and activity.together:
            gait[:, bending.PSI], gait[:, bending.SENSE] = 0.0, 1.0
        self._begin_ramp(ramp)

    def _linkage(self, body: int) -> Linkage:
        found: Linkage | None = self._world.kinds[self._world.bodies.shape[body]].linkage
        assert found is not None
        return found

    def mean_unbalanced(self) -> float:
        """Return the mean net force on a linkage over its weight [1], held ones left out; 0 if all are held."""
        world, own = self._world, self._all
        free = np.add.reduceat(own.grip, own.begin[:-1]) == 0
        weights = world.shapes.mass[world.bodies.shape] * world.gravity
        net = np.linalg.norm(world.bodies.load[:, :3] - weights[:, None] * [0.0, 0.0, 1.0], axis=1)
        return float(net[free].mean() / weights[free].mean()) if free.any() else 0.0

    @property
    def angles(self) -> Array:
        """(L, 3) angles about the axes of all joints in the last step [rad].

        A joint has the number of the link before it. Free joints with three axes keep the angles at the start.
        """
        return self._all.angle

    @property
    def torques(self) -> Array:
        """(L, 3) torques of springs, dashpots and motors about the axes of all joints in the last step [N m]."""
        return self._all.torque

    @property
    def joints(self) -> JointReadings:
        """State of the joints of all linkages."""
        own = self._all
        torque = float(np.abs(own.torque[own.law == joining.MOTOR]).max(initial=0.0))
        return JointReadings(motor_torque=torque, broken=int(own.broken.sum()))

    def _measure(self, found: Array) -> None:
        """Write kinetic and potential energy; those of pins, of elastic joints and of resisted twists [J].

        They are `stretching`, `bending` and `twisting` of `FilamentEnergies`.
        """
        world = self._world
        world.posed()
        jointed = world.jointed
        assert jointed is not None
        joining.measure_linkages(jointed, world.gravity, found)
