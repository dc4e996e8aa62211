"""Measure a strain test of a chain: force against strain, peak, yield, fracture, widening.

Strain is that of the distance along x between the two points where strings are tied; force is that of the pulled
string. A chain holds as long as it carries a fifth of its peak force; what comes after is its fracture.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from dem.errors import InputError
from dem.record.run import Run
from dem.record.series import Series
from postprocess.geometry.links import Floats
from postprocess.measures.registry import PhaseMeasure, Quantity, Shown

STRAIN = "strain"  #: Type of the phase

_MEANINGS = {
    Quantity(
        "peak force", "N", Shown(heading="peak F [N]", place=50, form=".3f")
    ): "largest force of the pulled string, means over 1 ms",
    Quantity(
        "strain at the peak", "-", Shown(heading="strain at it", place=51, form=".3f")
    ): "strain where it is reached",
    Quantity(
        "strain at fracture", "-", Shown(heading="at fracture", place=53, form=".3f")
    ): "largest strain while the force is a fifth of the peak or more",
    Quantity(
        "stiffness at the start", "N"
    ): "slope of force against strain, from 20 % to 80 % of the force at the first maximum",
    Quantity(
        "second over first slope", "-"
    ): "the same for the upper half of these forces over that for the lower half: 1 for a straight line",
    Quantity(
        "strain at the yield drop", "-", Shown(heading="at yield", place=52, form=".3f")
    ): "strain at the first maximum that is followed by a loss of a tenth of the "
    "force or more, and by more strain of 0.05 at least before the fracture; empty without any",
    Quantity("force lost at the yield drop", "-"): "share of the force that is lost there",
    Quantity(
        "widening", "-", Shown(heading="widening", place=54, form=".3f")
    ): "largest width of the chain before the fracture over the width at the start, less 1",
    Quantity("widening at the first maximum", "-"): "the same at the first maximum of the force",
    Quantity(
        "greatest force on a wall", "N"
    ): "largest force on either wall across the channel before the fracture, means over 0.1 s",
    Quantity(
        "imbalance of the strings", "N"
    ): "root mean square difference of the two strings' forces along x before the fracture",
}
QUANTITIES: Mapping[str, str] = MappingProxyType({quantity.header: text for quantity, text in _MEANINGS.items()})
"""What is measured of a strain test: names of columns with their units, and what they are."""
PEAK, AT_PEAK, FRACTURE, STIFFNESS, BEND, YIELD, DROP, WIDENING, SLIP_WIDENING, WALL, IMBALANCE = QUANTITIES

LEAST_SAMPLES = 3  # of a strain test
CARRIES = 0.2  # of the peak force, below which a chain no longer holds
LOSS = 0.1  # of the force; a smaller one is no yield drop
GOES_ON = 0.05  # strain between a yield drop and the fracture at least
_WINDOW = 0.1  # s, over which the force on walls is averaged
_QUIET = 0.05  # s, over which forces are averaged where maxima and slopes are looked for
_TAUT = 0.3  # of the peak force: what is lost below is the jolt of the start


@dataclass(frozen=True, kw_only=True, eq=False)
class StrainTest:
    """One strain test."""

    times: Floats  #: (n,) [s], while the strings are tied
    strains: Floats  #: (n,) [-]
    forces: Floats  #: (n,) of the pulled string along x [N]
    held: Floats  #: (n,) of the other string, in the opposite direction [N]
    widths: Floats  #: (n,) of the chain [m]
    walls: Floats  #: (n,) the greater of the forces on the two walls, outwards [N]

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


def _strain_of(run: Run, _: Series, __: int) -> tuple[float, ...]:
    """Measure a strain test for a table; what depends on its end is NaN while the run is not done."""
    found = measured(read_strain_test(run))
    if run.status.state != "done":
        found |= dict.fromkeys((FRACTURE, YIELD, DROP), math.nan)
    return tuple(found[name] for name in QUANTITIES)


def read_strain_test(run: Run) -> StrainTest:
    """Read the strain test of a run.

    Raises:
        InputError: There is none, or its series cannot be read.
    """
    series = run.series
    if not has_strain(series):
        raise InputError(f"{run.path}: no chain was pulled in this run; give runs of the study chain")
    length, force = series["chain_length_m"], series["string_pulled_force_N"][:, 0]
    shown = np.isfinite(length)
    first = length[shown][0]
    shown &= np.isfinite(force)
    outwards = np.stack([-series["channel_lower_force_N"][:, 1], series["channel_upper_force_N"][:, 1]])
    return StrainTest(
        times=series.time[shown],
        strains=length[shown] / first - 1,
        forces=force[shown],
        held=-series["string_fixed_force_N"][shown, 0],
        widths=series["chain_width_m"][shown],
        walls=outwards.max(axis=0)[shown],
    )


def measured(pull: StrainTest) -> dict[str, float]:
    """Return the quantities of one strain test, see `QUANTITIES`."""
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


def _mean_over(values: Floats, samples: float) -> Floats:
    """Return the moving mean over a number of samples, over fewer at the ends."""
    window = np.ones(max(1, round(samples)))
    means: Floats = np.convolve(values, window, "same") / np.convolve(np.ones_like(values), window, "same")
    return means


def first_drop(forces: Floats) -> tuple[int, float]:
    """Find the first maximum after which a tenth of the force (n,) [N] is lost, or the greatest one.

    What is lost below three tenths of the peak does not count.

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


def _slopes(strains: Floats, forces: Floats) -> tuple[float, float]:
    """Return the slope of force against strain [N], and that of the upper half over that of the lower [-]."""
    top = forces[-1]
    ranges = ((0.2, 0.8), (0.2, 0.5), (0.5, 0.8))
    slopes = []
    for low, high in ranges:
        inside = (forces > low * top) & (forces < high * top)
        if inside.sum() < 3:
            return math.nan, math.nan
        slopes.append(float(np.polyfit(strains[inside], forces[inside], 1)[0]))
    return slopes[0], slopes[2] / slopes[1]


MEASURES = (
    PhaseMeasure(
        name="strain of a chain",
        phases=(STRAIN,),
        quantities=tuple(_MEANINGS),
        take=_strain_of,
        available_for=lambda series, _: has_strain(series),
    ),
)
