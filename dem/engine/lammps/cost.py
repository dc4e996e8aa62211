"""What a simulated second costs on LAMMPS, on one rank, from measurement.

A step costs by spheres, several times as much while they move, since neighbours are looked for anew as they do; large
piles do not fit into a processor's cache. At each sample of the series and at each look of a stage LAMMPS writes all
bodies down, which are read and searched for contacts here.

Source: results/scaling: steps alone, N = 100 to 5000; results/bench, planned.csv: rest, pours and looks.
"""

from __future__ import annotations

from collections.abc import Mapping

from dem.engine.demand import Demand
from dem.engine.doing import Doing

# s per sphere. A pour grows from nothing and would cost half, but for the looks at layers and what adding one takes.
STEP: Mapping[Doing, float] = {Doing.POUR: 1.2e-7, Doing.REST: 0.5e-7, Doing.SHAKE: 1.6e-7}
LOOK = (3e-3, 6e-5)  # s, once and for each smarticle
# Of so many spheres a step takes so much longer each than of a few.
MANY, LONGER = 100_000, 1.3


def seconds_per_second(scene: Demand, time_step: float, doing: Doing) -> float:
    """See `EngineKind.seconds_per_second`."""
    spheres = len(scene.particle.centres) * scene.count
    steps = STEP.get(doing, STEP[Doing.SHAKE]) * spheres * (1 + LONGER * min(1.0, spheres / MANY)) / time_step
    looks = (LOOK[0] + LOOK[1] * scene.count) / scene.recording.series_interval_s
    return steps + looks
