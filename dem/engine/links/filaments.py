"""What a run does with filaments on the links engine, and asks of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from dem.body.filament import Activity, Filament, FilamentEnergies, PreferredCurvature
from dem.body.linkage import Undulation
from dem.engine.links.arrays import Filaments
from dem.engine.links.motion import bending
from dem.engine.links.rods import wave_of
from dem.engine.links.world import World

Array = NDArray[np.float64]


class LinksFilaments:
    """`dem.engine.interface.Filaments` on links: what a run does with the filaments of a world, and asks of them."""

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

    def release(self, grip: int | None = None) -> None:
        """Let go of all nodes that a grip holds; None: all grips."""
        own = self._all.grip
        own[(own != 0) & ((grip is None) | (own // bending.GRIP == grip))] = 0

    @property
    def held(self) -> int:
        """Number of filaments that a grip holds."""
        own = self._all
        return len(np.unique(np.searchsorted(own.begin, np.flatnonzero(own.grip), side="right")))

    def force(self, grip: int | None = None) -> Array:
        """Return the force (3,) of a grip on its nodes in the last step [N]; None: of all grips together."""
        forces = self._all.grip_force
        force: Array = forces.sum(axis=0) if grip is None else forces[grip].copy()
        return force

    def act(self, activity: Activity | Undulation | None, *, ramp: float = 0.0) -> None:
        """Let filaments bend by themselves from now on; the turn of each wave and its reversals go on.

        Args:
            activity: what they do; None: they return to the curvature that they prefer at rest.
            ramp: time in which the new curvature grows from 0 [s].
        """
        assert not isinstance(activity, Undulation)  # the scene was checked
        gait = self._all.gait
        for number, filament in self._kinds_of():
            own = filament.curvature or PreferredCurvature(amplitudes=0.0)
            if activity is not None:
                turn = 2 * math.pi * filament.segment_length / activity.wavelength
                own = PreferredCurvature(
                    amplitudes=activity.curvature,
                    phases=turn * np.arange(filament.nodes - 2, dtype=np.float64),
                    rate=activity.rate,
                    reversal_rate=activity.reversal_rate,
                )
            self._all.wave[self._nodes(number)] = wave_of(filament, own)
            gait[number, bending.RATE], gait[number, bending.REVERSALS] = own.rate, own.reversal_rate
        gait[:, bending.WAIT] = math.inf
        gait[:, bending.FACTOR] = 1.0 if ramp == 0 else 0.0
        gait[:, bending.TARGET] = 1.0
        gait[:, bending.CHANGE] = math.inf if ramp == 0 else 1.0 / ramp

    def _kinds_of(self) -> Iterator[tuple[int, Filament]]:
        """Yield the number of each filament and what it is made of."""
        world = self._world
        for number, body in enumerate(self._all.body):
            filament = world.kinds[world.bodies.shape[body]].filament
            assert filament is not None
            yield number, filament

    @property
    def joints(self) -> None:
        """None, since segments share their nodes."""

    def mean_unbalanced(self) -> float:
        """Return the mean net force on a filament over its weight in the liquid [1], without nodes that are held."""
        own, world = self._all, self._world
        forces = (own.force + own.damping + own.drag)[:, :3] * (own.grip == 0)[:, None]
        net = np.linalg.norm(np.add.reduceat(forces, own.begin[:-1]), axis=1)
        weights = [f.mass * abs(f.weight_share) * world.gravity for _, f in self._kinds_of()]
        return float(net.mean() / np.mean(weights))

    @property
    def energies(self) -> FilamentEnergies:
        """Energies at this instant, and work up to it."""
        found = np.zeros(5)
        bending.measure(self._all, self._world.gravity, found)
        return FilamentEnergies(*(float(value) for value in (*found, *self._all.sums)))
