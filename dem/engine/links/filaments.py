"""Grips, active bending and energies of filaments on the engine links."""

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
    """`dem.engine.interface.Filaments` on links."""

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def _all(self) -> Filaments:
        assert self._world.filaments is not None
        return self._world.filaments

    def points(self, filament: int) -> Array:
        """Return the positions (nodes, 3) of a filament's nodes [m], as a view of the engine's array."""
        return self._all.position[self._nodes(filament)]

    def _nodes(self, filament: int) -> slice:
        begin = self._all.begin
        return slice(int(begin[filament]), int(begin[filament + 1]))

    def grip(self, nodes: Mapping[int, Sequence[int]], *, directions: str = "xyz") -> int:
        """Hold nodes by a new grip, which is at rest.

        Args:
            nodes: numbers of the held nodes, by the number of their filament; -1 is a filament's last node. If two
                neighbouring nodes are held in all directions, the segment between them does not roll either.
            directions: letters of the directions in which nodes are held; in other directions nodes are free.

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
        """Move a grip with a velocity (x, y, z) [m/s] from now on."""
        self._all.grip_speed[grip] = velocity

    def release(self, grip: int | None = None) -> None:
        """Release all nodes that a grip holds; None: the nodes of all grips."""
        own = self._all.grip
        own[(own != 0) & ((grip is None) | (own // bending.GRIP == grip))] = 0

    @property
    def held(self) -> int:
        """Number of filaments of which at least one node is held by a grip."""
        own = self._all
        return len(np.unique(np.searchsorted(own.begin, np.flatnonzero(own.grip), side="right")))

    def force(self, grip: int | None = None) -> Array:
        """Return the force (3,) of a grip on its nodes in the last step [N]; None: the sum over all grips."""
        forces = self._all.grip_force
        force: Array = forces.sum(axis=0) if grip is None else forces[grip].copy()
        return force

    def act(self, activity: Activity | Undulation | None, *, ramp: float = 0.0) -> None:
        """Set the preferred curvature of all filaments from now on; the present angle ψ of each wave is kept.

        Args:
            activity: wave of preferred curvature; None: the filaments' own preferred curvature.
            ramp: time in which the new preferred curvature grows from 0 [s].
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
        """Yield the number and the kind of each filament."""
        world = self._world
        for number, body in enumerate(self._all.body):
            filament = world.kinds[world.bodies.shape[body]].filament
            assert filament is not None
            yield number, filament

    @property
    def joints(self) -> None:
        """None, since segments share their nodes."""

    def mean_unbalanced(self) -> float:
        """Return the mean net force on a filament over its weight less buoyancy [1], held nodes left out."""
        own, world = self._all, self._world
        forces = (own.force + own.damping + own.drag)[:, :3] * (own.grip == 0)[:, None]
        net = np.linalg.norm(np.add.reduceat(forces, own.begin[:-1]), axis=1)
        weights = [f.mass * abs(f.weight_share) * world.gravity for _, f in self._kinds_of()]
        return float(net.mean() / np.mean(weights))

    @property
    def energies(self) -> FilamentEnergies:
        """Present energies, and energies exchanged up to now."""
        found = np.zeros(5)
        bending.measure(self._all, self._world.gravity, found)
        return FilamentEnergies(*(float(value) for value in (*found, *self._all.sums)))
