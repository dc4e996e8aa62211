"""Grips, active bending and energies of filaments on the engine links."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.body.filament import Activity, Filament, PreferredCurvature
from dem.body.linkage import Undulation
from dem.engine.links.arrays import Filaments
from dem.engine.links.flexible import FlexibleBodies
from dem.engine.links.motion import bending
from dem.engine.links.rods import wave_of

Array = NDArray[np.float64]


class LinksFilaments(FlexibleBodies):
    """`dem.engine.interface.Filaments` on links, for filaments."""

    PER_GRIP = bending.GRIP

    @property
    def _all(self) -> Filaments:
        assert self._world.filaments is not None
        return self._world.filaments

    def _replace(self, fields: dict[str, Any]) -> None:
        self._world.filaments = self._all._replace(**fields)

    def points(self, filament: int) -> Array:
        """Return the positions (nodes, 3) of a filament's nodes [m], as a view of the engine's array."""
        return self._all.position[self._members(filament)]

    def grip(self, nodes: Mapping[int, Sequence[int]], *, directions: str = "xyz") -> int:
        """Hold nodes by a new grip, which is at rest; return its number.

        -1 is a filament's last node. If two neighbouring nodes are held in all directions, the segment between them
        does not roll either. In other directions than those of the letters in `directions` nodes are free.
        """
        return self._hold(nodes, sum(1 << "xyz".index(each) for each in directions))

    def act(self, activity: Activity | Undulation | None, *, ramp: float = 0.0) -> None:
        """Set the preferred curvature of all filaments from now on; the present angle ψ of each wave is kept.

        Without an activity it is the filaments' own preferred curvature. The new one grows from 0 in the time `ramp`
        [s].
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
            self._all.wave[self._members(number)] = wave_of(filament, own)
            gait[number, bending.RATE], gait[number, bending.REVERSALS] = own.rate, own.reversal_rate
        self._begin_ramp(ramp)

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

    def _measure(self, found: Array) -> None:
        bending.measure(self._all, self._world.gravity, found)
