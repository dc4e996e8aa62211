"""Measure a strain test of a chain: force against strain, peak, yield, fracture, widening.

The strain is the relative increase of the distance along x between the two points where strings are tied; the force is
the force of the pulled string. A chain has fractured after the last sample at which it carries a fifth of its peak
force.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from dem.arrays import Flags
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
    ): "strain at the peak force",
    Quantity(
        "strain at fracture", "-", Shown(heading="at fracture", place=53, form=".3f")
    ): "largest strain while the force is a fifth of the peak or more",
    Quantity(
        "stiffness at the start", "N"
    ): "slope of force against strain, from 20 % to 80 % of the force at the first maximum",
    Quantity(
        "second over first slope", "-"
    ): "slope from 50 % to 80 % of the force at the first maximum over slope from 20 % to 50 %: 1 for a straight line",
    Quantity(
        "strain at the yield drop", "-", Shown(heading="at yield", place=52, form=".3f")
    ): "strain at the first maximum that is followed by a loss of a tenth of the "
    "force or more, and by more strain of 0.05 at least before the fracture; empty without any",
    Quantity("force lost at the yield drop", "-"): "fraction of the force that is lost at the yield drop",
    Quantity(
        "widening", "-", Shown(heading="widening", place=54, form=".3f")
    ): "largest width of the chain before the fracture over the width at the start, less 1",
    Quantity(
        "widening at the first maximum", "-"
    ): "width of the chain at the first maximum of the force over the width at the start, less 1",
    Quantity(
        "greatest force on a wall", "N"
    ): "largest force on either wall across the channel before the fracture, means over 0.1 s",
    Quantity(
        "imbalance of the strings", "N"
    ): "root mean square difference of the two strings' forces along x before the fracture",
}
QUANTITIES: Mapping[str, str] = MappingProxyType({quantity.header: text for quantity, text in _MEANINGS.items()})
"""Quantities of a strain test: names of columns with their units, and their meanings."""
PEAK, AT_PEAK, FRACTURE, STIFFNESS, BEND, YIELD, DROP, WIDENING, SLIP_WIDENING, WALL, IMBALANCE = QUANTITIES

LEAST_SAMPLES = 3  #: Least number of samples of a strain test
CARRIES = 0.2  #: Fraction of the peak force that a chain carries until its fracture [-]
LOSS = 0.1  #: Least fraction of the force that is lost at a yield drop [-]
GOES_ON = 0.05  #: Least strain between a yield drop and the fracture [-]
_WINDOW = 0.1  # time over which the force on walls is averaged [s]
_QUIET = 0.05  # time over which forces are averaged to find maxima and slopes [s]
_TAUT = 0.3  # fraction of the peak force below which a loss of force is only the jolt at the start


@dataclass(frozen=True, kw_only=True, eq=False)
class StrainTest:
    """Forces, strains and widths of a strain test at its n samples, while the strings are tied."""

    times: Floats  #: (n,) times since the start of the run [s]
    strains: Floats  #: (n,) strains of the chain [-]
    forces: Floats  #: (n,) forces of the pulled string along +x [N]
    held: Floats  #: (n,) forces of the fixed string along -x [N]
    widths: Floats  #: (n,) widths of the chain [m]
    walls: Floats  #: (n,) outward force on the more loaded wall of the channel [N]

    @property
    def fracture(self) -> int:
        """Index of the last sample before the fracture, see `CARRIES`."""
        return int(np.flatnonzero(self.forces >= CARRIES * self.forces.max())[-1])


def has_strain(series: Series, phase: int | None = None) -> bool:
    """Return whether a phase has `LEAST_SAMPLES` samples with tied strings, and a force above 0 in one; None: any."""
    if "string_pulled_force_N" not in series.data:
        return False
    force = series["string_pulled_force_N"][:, 0]
    tied = _during(series, phase) & np.isfinite(series["chain_length_m"]) & np.isfinite(force)
    return int(tied.sum()) >= LEAST_SAMPLES and bool((force[tied] > 0).any())


def _during(series: Series, phase: int | None) -> Flags:
    return np.full(len(series.time), True) if phase is None else np.asarray(series["phase"] == phase)


def _strain_of(run: Run, _: Series, phase: int) -> tuple[float, ...]:
    values = measured(read_strain_test(run, phase))
    if run.status.state != "done":
        # The chain may yet carry more, so that fracture and yield are unknown.
        values |= dict.fromkeys((FRACTURE, YIELD, DROP), math.nan)
    return tuple(values[name] for name in QUANTITIES)


def read_strain_test(run: Run, phase: int | None = None) -> StrainTest:
    """Read a strain test from the series of a run; InputError if there is none.

    `phase` is the index of its phase, None that of the only one in the run.
    """
    series = run.series
    if not has_strain(series, phase):
        raise InputError(f"{run.path}: no chain was pulled in this run; give runs of the study chain")
    length, force = series["chain_length_m"], series["string_pulled_force_N"][:, 0]
    shown = _during(series, phase) & np.isfinite(length)
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
    """Compute the quantities of a strain test; return their values by the names of their columns.

    The names are the keys of `QUANTITIES`, which also states their meanings. Yield quantities are NaN without a yield
    drop.
    """
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
    """Return the moving mean (n,) of values (n,) over `samples` samples, and over fewer at the ends."""
    window = np.ones(max(1, round(samples)))
    means: Floats = np.convolve(values, window, "same") / np.convolve(np.ones_like(values), window, "same")
    return means


def first_drop(forces: Floats) -> tuple[int, float]:
    """Find the first maximum of forces (n,) [N] that is followed by a loss of more than a tenth.

    Losses that begin at less than three tenths of the largest force do not count. Returns the index of the maximum, and
    the fraction of its force that is lost before the force exceeds it again [-]. Without such a loss it returns the
    index of the largest force, and 0.
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
    """Return the slope of force (n,) [N] against strain (n,) [-] at the start of a pull, and its change.

    The slope [N] is fitted where the force is 20 % to 80 % of the last force. The change [-] is the slope at 50 % to
    80 % over the slope at 20 % to 50 %. Both are NaN if a range has fewer than three samples.
    """
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
        available_for=has_strain,
    ),
)
