"""What a simulated second costs on the links engine, from measurement.

A step looks at contacts; what moves has to be looked for anew, by the second and not by the step, among as many pairs
as there are strands against strands. A smarticle in the middle of a pile has more neighbours than one at its rim.

Source: results/accuracy-links/README.md: N = 10 … 1000, one to three strands, 125 … 4000 N/m, one core of a 2-core
AMD EPYC virtual machine with other work on it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from dem.engine.demand import Demand
from dem.engine.doing import Doing


class Rates(NamedTuple):
    """What a smarticle of three links of one strand costs deep in a pile of usual width, per step and per second."""

    step: float
    second: float


RATES: Mapping[Doing, Rates] = {
    Doing.POUR: Rates(4.0e-7, 2.3e-3),
    Doing.REST: Rates(7.6e-7, 0.0),
    Doing.SHAKE: Rates(3.3e-7, 6.0e-3),
    Doing.ACTUATE: Rates(1.06e-6, 6.8e-3),
}
LOOK = 6.2e-5  # s, of all motors once
SAMPLE, FRAME = 5e-4, 9e-3  # s, of what is recorded

# Smarticles in a container of the usual radius, twice w, of which each has half the neighbours that it may have.
HALF_WAY = 81.0
USUAL_RADIUS = 2.0
AT_WALL = 0.7  # lengths w from the wall that have none on one side
# Contacts of two strands are fewer than twice those of one; pairs to look at are nearly four times as many.
MORE_CONTACTS, MORE_PAIRS = 0.25, 1.75


def seconds_per_second(scene: Demand, time_step: float, doing: Doing) -> float:
    """See `EngineKind.seconds_per_second`."""
    smarticle, strands, recording = scene.smarticle, scene.fidelity.rows, scene.recording
    rates = RATES[doing]
    radius = scene.cylinder.radius / smarticle.middle_length_m
    depth = scene.count * (USUAL_RADIUS / radius) ** 2
    wide = max(0.0, 1 - AT_WALL / radius) / (1 - AT_WALL / USUAL_RADIUS)
    inside = scene.count * wide * depth / (depth + HALF_WAY)
    links = 1.0 if smarticle.boxes.barb_length > 0 else 1 / 3
    per_step = rates.step * (1 + MORE_CONTACTS * (strands - 1))
    found = links * inside * (per_step / time_step + rates.second * strands**MORE_PAIRS)
    if doing is Doing.ACTUATE:
        found += LOOK / scene.fidelity.control_interval_s
    for cost, interval in ((SAMPLE, recording.series_interval_s), (FRAME, recording.frame_interval_s)):
        found += cost / interval if interval else 0.0
    return float(found)
