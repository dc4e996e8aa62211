"""Grips, gaits and energies of linkages on the engine links."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from dem.body.filament import Activity, FilamentEnergies
from dem.body.linkage import Linkage, Undulation
from dem.engine.interface import JointReadings
from dem.engine.links.arrays import Linkages
from dem.engine.links.joints import swings_of
from dem.engine.links.motion import bending, joining
from dem.engine.links.world import World

Array = NDArray[np.float64]


class LinksLinkages:
    """`dem.engine.interface.Filaments` on links, for worlds with linkages."""

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def _all(self) -> Linkages:
        assert self._world.linkages is not None
        return self._world.linkages

    def _links(self, linkage: int) -> slice:
        begin = self._all.begin
        return slice(int(begin[linkage]), int(begin[linkage + 1]))

    def points(self, linkage: int) -> Array:
        """Return the middles (n, 3) of the links of a linkage [m], as a view of the engine's array."""
        return self._all.links.position[self._links(linkage)]

    def grip(self, links: Mapping[int, Sequence[int]]) -> int:
        """Hold links by a new grip, which is at rest; return its number.

        Args:
            links: numbers of the held links, which do not turn, by the number of their linkage; -1 is its last link.
        """
        all_, number = self._all, len(self._all.grip_speed)
        for linkage, own in links.items():
            all_.grip[self._links(linkage)][list(own)] = number + 1
        more = {name: np.append(getattr(all_, name), np.zeros((1, 3)), axis=0) for name in ("grip_speed", "grip_force")}
        self._world.linkages = all_._replace(**more)
        return number

    def move(self, grip: int, velocity: tuple[float, float, float]) -> None:
        """Move a grip with a velocity [m/s] from now on."""
        self._all.grip_speed[grip] = velocity

    def release(self, grip: int | None = None) -> None:
        """Release all links that a grip holds; None: the links of all grips."""
        own = self._all.grip
        own[(own != 0) & ((grip is None) | (own == (grip or 0) + 1))] = 0

    @property
    def held(self) -> int:
        """Number of linkages of which at least one link is held by a grip."""
        own = self._all
        return len(np.unique(np.searchsorted(own.begin, np.flatnonzero(own.grip), side="right")))

    def force(self, grip: int | None = None) -> Array:
        """Return the force (3,) of a grip on its links in the last step [N]; None: the sum over all grips."""
        forces = self._all.grip_force
        force: Array = forces.sum(axis=0) if grip is None else forces[grip].copy()
        return force

    def act(self, activity: Activity | Undulation | None, *, ramp: float = 0.0) -> None:
        """Set the gait of the motors of all linkages from now on.

        Args:
            activity: swings of motors; None: they return to the angles at the start.
            ramp: time in which the swings grow from 0 [s].
        """
        assert not isinstance(activity, Activity)  # the scene was checked
        own, gait = self._all, self._all.gait
        for number, body in enumerate(own.body):
            linkage = self._linkage(int(body))
            swings = [] if activity is None else activity.swings_of(linkage)
            own.swing[self._links(number)] = swings_of(linkage, swings)
        gait[:, bending.RATE] = 0.0 if activity is None else activity.rate
        gait[:, bending.REVERSALS] = 0.0 if activity is None else activity.reversal_rate
        if activity is not None and activity.together:
            gait[:, bending.PSI], gait[:, bending.SENSE] = 0.0, 1.0
        gait[:, bending.WAIT] = math.inf
        gait[:, bending.FACTOR] = 1.0 if ramp == 0 else 0.0
        gait[:, bending.CHANGE] = math.inf if ramp == 0 else 1.0 / ramp

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

    @property
    def energies(self) -> FilamentEnergies:
        """Present energies, and energies exchanged up to now.

        `stretching` is the energy of pins, `bending` that of elastic joints.
        """
        found, world = np.zeros(5), self._world
        world.posed()
        jointed = world.jointed
        assert jointed is not None
        joining.measure_linkages(jointed, world.gravity, found)
        return FilamentEnergies(*(float(value) for value in (*found, *self._all.sums)))
