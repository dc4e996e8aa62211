"""Estimate the wall time of a simulated second on the engine links, from measurements.

Contacts are computed in every step, which costs time per step. Neighbours are searched again whenever links have moved
far enough, which costs time per simulated second, and more for more pairs of strands. The cost of a smarticle does not
depend on depth and width of the pile. It is higher in large piles, which do not fit into a processor's cache.

Source: results/accuracy-links/cost.csv: one to three strands, 500 to 4000 N/m, N = 270, on one core of an idle 2-core
AMD EPYC virtual machine; results/scaling: N up to 10 000.
"""

from collections.abc import Mapping
from typing import NamedTuple

from dem.engine.demand import Activity, Demand


class Rates(NamedTuple):
    """Cost of a smarticle with three links of one strand each, on one core."""

    step: float  #: Wall time per step [s]
    second: float  #: Wall time per simulated second [1]


RATES: Mapping[Activity, Rates] = {
    Activity.POUR: Rates(1.35e-7, 1.3e-3),
    Activity.REST: Rates(4.0e-7, 0.0),
    Activity.SHAKE: Rates(1.5e-7, 2.6e-3),
    Activity.ACTUATE: Rates(5.4e-7, 2.0e-3),
}
LOOK = 2.4e-7  # s per control update of a smarticle
BENDS = 1.2  # cost of a filament's segment over that of a smarticle's link, of 480 each with 5.7 neighbours of a body
# Cost of a link of a chain over that of a smarticle's link, of 300 each at rest with 5.3 and 6.8 to 10.5 neighbours of
# a body: 1.6 to 1.9 with free joints or motors, of one to three axes, while other work used both cores.
JOINS = 1.8
RIM = 1.1e-7  # s per edge of a wall of tiers, smarticle and step
# Cost of a sample and of a frame [s]: a constant, and an addition per smarticle.
SAMPLE, FRAME = (1e-4, 1e-6), (1.5e-3, 1.5e-5)

# With MANY smarticles the cost of each is higher by LONGER than with few, since they do not fit into a processor's
# cache; this addition grows with the power GROWTH of their number.
MANY, LONGER, GROWTH = 5000, 0.3, 0.8
# Contacts of two strands are hardly more than those of one, since most links cross; the search finds links before it
# tries their strands.
MORE_CONTACTS, MORE_PAIRS = 0.3, 1.2

# Processor time to compile [s]: all kernels of the first kind of phase in a process, and those of one more kind.
# `doctor --compile` with an empty cache on the machine above while other work used both cores: 11 to 16, and 4 to 9.
COMPILE_FIRST, COMPILE_MORE = 13.0, 7.0


def seconds_per_second(scene: Demand, time_step: float, activity: Activity) -> float:
    """Return the estimated wall time on one core per simulated time [1]."""
    count, recording, mixture = scene.count, scene.recording, scene.mixture
    rates = RATES[activity]
    if mixture is None:
        links, strands = 1.0 if scene.smarticle.boxes.barb_length > 0 else 1 / 3, float(scene.fidelity.rows)
    else:  # bars of a body, over a smarticle's three
        links = mixture.mean([len(kind.bars.points) / 3 for kind in mixture.kinds])
        links *= BENDS if mixture.flexible else JOINS if mixture.jointed else 1.0
        strands = mixture.mean([kind.rows for kind in mixture.kinds])
    per_step = rates.step * (1 + MORE_CONTACTS * (1 - 1 / strands)) + RIM * strands * len(scene.cylinder.upper)
    each = links * (per_step / time_step + rates.second * strands**MORE_PAIRS)
    if activity is Activity.ACTUATE:
        each += LOOK / scene.fidelity.control_interval_s
    found = count * each * (1 + LONGER * (count / MANY) ** GROWTH)
    for (once, more), interval in ((SAMPLE, recording.series_interval_s), (FRAME, recording.frame_interval_s)):
        found += (once + more * count) / interval if interval else 0.0
    return float(found)
