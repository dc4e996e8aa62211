"""What a simulated second costs on the links engine, from measurement.

A step looks at contacts; what moves has to be looked for anew, by the second and not by the step, among as many pairs
as there are strands against strands. Neither how deep nor how wide a pile is shows in what a smarticle costs; in large
ones memory does.

Source: results/bench/cost.md: the phases of the paper's studies at N = 168 … 494, l/w 0.4 … 1.1, time steps from 50 to
125 us, and, for the level, N = 270 on an idle 2-core AMD EPYC virtual machine; results/scaling: N up to 10 000;
results/accuracy-links: strands and stiffness.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from dem.engine.demand import Activity, Demand


class Rates(NamedTuple):
    """What a smarticle of three links of one strand costs, per step and per second."""

    step: float
    second: float


RATES: Mapping[Activity, Rates] = {
    Activity.POUR: Rates(1.7e-7, 0.1e-3),
    Activity.REST: Rates(3.6e-7, 0.0),
    Activity.SHAKE: Rates(2.4e-7, 0.7e-3),
    Activity.ACTUATE: Rates(3.8e-7, 0.8e-3),
}
LOOK = 2.4e-7  # s, of the motors of a smarticle once
RIM = 1.1e-7  # s, of one edge of a wall of tiers, per smarticle and step
# What is recorded: s, once and for each smarticle.
SAMPLE, FRAME = (1e-4, 1e-6), (1.5e-3, 1.5e-5)

# Of so many smarticles a step takes so much longer each than of a few, as they do not fit into a processor's cache.
MANY, LONGER, GROWTH = 5000, 0.3, 0.8
# Contacts of two strands are fewer than twice those of one; pairs to look at are nearly four times as many.
MORE_CONTACTS, MORE_PAIRS = 1.4, 1.75

# Processor time to compile [s]: all kernels with the first kind of phase, and those of one more kind in one process.
COMPILE_FIRST, COMPILE_MORE = 16.0, 9.0


def seconds_per_second(scene: Demand, time_step: float, activity: Activity) -> float:
    """See `EngineKind.seconds_per_second`."""
    count, strands, recording = scene.count, scene.fidelity.rows, scene.recording
    rates, links = RATES[activity], 1.0 if scene.smarticle.boxes.barb_length > 0 else 1 / 3
    per_step = rates.step * (1 + MORE_CONTACTS * (1 - 1 / strands)) + RIM * strands * len(scene.cylinder.upper)
    each = links * (per_step / time_step + rates.second * strands**MORE_PAIRS)
    if activity is Activity.ACTUATE:
        each += LOOK / scene.fidelity.control_interval_s
    found = count * each * (1 + LONGER * (count / MANY) ** GROWTH)
    for (once, more), interval in ((SAMPLE, recording.series_interval_s), (FRAME, recording.frame_interval_s)):
        found += (once + more * count) / interval if interval else 0.0
    return float(found)
