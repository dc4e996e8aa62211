"""What a strain test of a chain tells: force against strain, peak, yield, fracture, widening.

Strain is that of the distance along x between the two points where strings are tied; force is that of the pulled
string. A chain holds as long as it carries a fifth of its peak force; what comes after is its fracture.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.manifest import RunManifest
from dem.record.series import Series, read_series

Array = NDArray[np.float64]

STRAIN = "strain"
"""Type of the phase."""

PEAK, AT_PEAK, FRACTURE = "peak force [N]", "strain at the peak [-]", "strain at fracture [-]"
STIFFNESS, BEND = "stiffness at the start [N]", "second over first slope [-]"
YIELD, DROP, WIDENING = "strain at the yield drop [-]", "force lost at the yield drop [-]", "widening [-]"
SLIP_WIDENING = "widening at the first maximum [-]"
WALL, IMBALANCE = "greatest force on a wall [N]", "imbalance of the strings [N]"
QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        PEAK: "largest force of the pulled string, means over 1 ms",
        AT_PEAK: "strain where it is reached",
        FRACTURE: "largest strain while the force is a fifth of the peak or more",
        STIFFNESS: "slope of force against strain, from 20 % to 80 % of the force at the first maximum",
        BEND: "the same for the upper half of these forces over that for the lower half: 1 for a straight line",
        YIELD: "strain at the first maximum that is followed by a loss of a tenth of the force or more, and by more "
        "strain of 0.05 at least before the fracture; empty without any",
        DROP: "share of the force that is lost there",
        WIDENING: "largest width of the chain before the fracture over the width at the start, less 1",
        SLIP_WIDENING: "the same at the first maximum of the force",
        WALL: "largest force on either wall across the channel before the fracture, means over 0.1 s",
        IMBALANCE: "root mean square difference of the two strings' forces along x before the fracture",
    }
)
"""What is measured of a strain test: names of columns with their units, and what they are."""

LEAST_SAMPLES = 3  # of a strain test
CARRIES = 0.2  # of the peak force, below which a chain no longer holds
LOSS = 0.1  # of the force; a smaller one is no yield drop
GOES_ON = 0.05  # strain between a yield drop and the fracture at least
_WINDOW = 0.1  # s, over which the force on walls is averaged
_QUIET = 0.05  # s, over which forces are averaged where maxima and slopes are looked for
_TAUT = 0.3  # of the peak force: what is lost below is the jolt of the start


@dataclass(frozen=True, kw_only=True, eq=False)
class Pull:
    """One strain test.

    Attributes:
        times: (n,) [s], while the strings are tied.
        strains: (n,) [-].
        forces: (n,) of the pulled string along x [N].
        held: (n,) of the other string, in the opposite direction [N].
        widths: (n,) of the chain [m].
        walls: (n,) the greater of the forces on the two walls, outwards [N].
    """

    times: Array
    strains: Array
    forces: Array
    held: Array
    widths: Array
    walls: Array

    @property
    def fracture(self) -> int:
        """Index of the last sample at which the chain holds."""
        return int(np.flatnonzero(self.forces >= CARRIES * self.forces.max())[-1])


def has_strain(series: Series) -> bool:
    """Whether there is enough of a strain test in a series to measure: a string that pulled."""
    if "string_pulled_force_N" not in series.data:
        return False
    force = series["string_pulled_force_N"][:, 0]
    tied = np.isfinite(series["chain_length_m"]) & np.isfinite(force)
    return int(tied.sum()) >= LEAST_SAMPLES and bool((force[tied] > 0).any())


def strain_columns(run: RunManifest) -> dict[str, float]:
    """Measures of a strain test for a table; what its end tells is NaN while the run is not done.

    Raises:
        InputError: As `read_pull`.
    """
    found = measured(read_pull(run))
    return found if run.status == "done" else found | dict.fromkeys((FRACTURE, YIELD, DROP), math.nan)


def read_pull(run: RunManifest) -> Pull:
    """The strain test of a run.

    Raises:
        InputError: There is none, or its series cannot be read.
    """
    series = read_series(run.directory)
    if not has_strain(series):
        msg = f"{run.directory}: no chain was pulled in this run; give runs of the study chain"
        raise InputError(msg)
    length, force = series["chain_length_m"], series["string_pulled_force_N"][:, 0]
    shown = np.isfinite(length)
    first = length[shown][0]
    shown &= np.isfinite(force)
    outwards = np.stack([-series["channel_lower_force_N"][:, 1], series["channel_upper_force_N"][:, 1]])
    return Pull(
        times=series.time[shown],
        strains=length[shown] / first - 1,
        forces=force[shown],
        held=-series["string_fixed_force_N"][shown, 0],
        widths=series["chain_width_m"][shown],
        walls=outwards.max(axis=0)[shown],
    )


def measured(pull: Pull) -> dict[str, float]:
    """The quantities of one strain test; see `QUANTITIES`."""
    end = pull.fracture + 1
    strains, forces = pull.strains[:end], pull.forces[:end]
    peak = int(np.argmax(forces))
    interval = float(np.median(np.diff(pull.times)))
    quiet = _mean_over(forces, _QUIET / interval)
    top, loss = first_drop(quiet)
    yielded = strains.max() - strains[top] > GOES_ON and loss >= LOSS
    stiffness, bend = _slopes(strains[: top + 1], quiet[: top + 1])
    walls = _mean_over(pull.walls[:end], _WINDOW / interval)
    return {
        PEAK: float(forces[peak]),
        AT_PEAK: float(strains[peak]),
        FRACTURE: float(strains.max()),
        STIFFNESS: stiffness,
        BEND: bend,
        YIELD: float(strains[top]) if yielded else math.nan,
        DROP: loss if yielded else math.nan,
        WIDENING: float(pull.widths[:end].max() / pull.widths[0] - 1),
        SLIP_WIDENING: float(pull.widths[top] / pull.widths[0] - 1),
        WALL: float(walls.max()),
        IMBALANCE: float(np.sqrt(np.mean((forces - pull.held[:end]) ** 2))),
    }


def _mean_over(values: Array, samples: float) -> Array:
    """Moving mean over a number of samples, over fewer at the ends."""
    window = np.ones(max(1, round(samples)))
    means: Array = np.convolve(values, window, "same") / np.convolve(np.ones_like(values), window, "same")
    return means


def first_drop(forces: Array) -> tuple[int, float]:
    """The first maximum after which a tenth of the force is lost, or the greatest one.

    Args:
        forces: (n,) [N]; what is lost below three tenths of the peak does not count.

    Returns:
        Its index, and the share of the force that is lost before the maximum is passed again [-].
    """
    highest = np.maximum.accumulate(forces)
    lost = np.flatnonzero((forces < (1 - LOSS) * highest) & (highest > _TAUT * forces.max()))
    if not len(lost):
        return int(np.argmax(forces)), 0.0
    top = int(np.argmax(forces[: lost[0]]))
    above = np.flatnonzero(forces[lost[0] :] > forces[top])
    until = lost[0] + above[0] if len(above) else len(forces)
    return top, float(1 - forces[top:until].min() / forces[top])


def _slopes(strains: Array, forces: Array) -> tuple[float, float]:
    """Slope of force against strain [N], and that of the upper half of the forces over that of the lower [-]."""
    top = forces[-1]
    ranges = ((0.2, 0.8), (0.2, 0.5), (0.5, 0.8))
    slopes = []
    for low, high in ranges:
        inside = (forces > low * top) & (forces < high * top)
        if inside.sum() < 3:
            return math.nan, math.nan
        slopes.append(float(np.polyfit(strains[inside], forces[inside], 1)[0]))
    return slopes[0], slopes[2] / slopes[1]
