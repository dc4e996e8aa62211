"""Where entangled clusters begin to reach through piles, at each size, and whether that place moves with the size.

The share of piles that are spanned rises with x, l/w or ⟨N⟩, as a logistic function 1/(1 + exp(-(x - x_c)/s)) of its
own at each size. x_c with its 95 % interval is by profile likelihood, the width s of whatever the data allow: it is
sound also where all piles below some x are open and all above are spanned, and nothing else is known of s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

from postprocess.statistics.columns import ASPECT
from postprocess.statistics.findings import judge, negative
from postprocess.statistics.seeds import CONFIDENCE, Slope, slope_within
from studies.finite_size.measure import COUNT, STAGES, crossings, share, spans

Floats = NDArray[np.float64]

STAGE, AXIS, PLACE, LOW, HIGH = "stage", "against", "half of piles span at [-]", "from [-]", "to [-]"
WIDTH, RUNS, SPANNED = "width [-]", "runs [-]", "spanned [-]"
POWER, POWER_BAR, VERDICT = "power of N [-]", "power of N 95 % [-]", "falls as piles grow"

AT_THRESHOLD = -0.155
"""Power of N with which the largest cluster's share falls just at the threshold of percolation in three dimensions,
β/(νd) with β = 0.41 and ν = 0.88: Stauffer & Aharony, Introduction to Percolation Theory (1994), table 2."""

LARGEST = 0.2
"""l/w up to which piles are taken as near the threshold."""

_PLACES, _WIDTHS = 401, 30


def axes(stage: str) -> Mapping[str, str]:
    """What spanning is set against: names and columns."""
    return {"l/w": ASPECT, "⟨N⟩": crossings(stage)}


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """What the runs of one size say of x_c.

    Attributes:
        places: (n,) where x_c may be, those of all sizes alike.
        likelihood: (n,) log of it, of the best width at each place.
        widths: (n,) these widths.
        runs: How many runs.
        spanned: How many of them are spanned.
    """

    places: Floats
    likelihood: Floats
    widths: Floats
    runs: int
    spanned: int

    @property
    def known(self) -> bool:
        """Whether some runs are spanned and some are not."""
        return 0 < self.spanned < self.runs

    @property
    def best(self) -> float:
        """x_c; where a whole range is as good, its middle. NaN where it is not known."""
        if not self.known:
            return math.nan
        return float(self.places[self.likelihood >= self.likelihood.max() - 1e-3].mean())

    @property
    def width(self) -> float:
        """The logistic function's at the best place; at least the narrowest that is tried."""
        return float(self.widths[self.likelihood.argmax()]) if self.known else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of x_c; infinite where it reaches the end of what is tried."""
        kept = self.likelihood >= self.likelihood.max() - chdtri(1, 1 - CONFIDENCE) / 2
        low, high = self.places[kept][[0, -1]]
        return (-math.inf if kept[0] else float(low), math.inf if kept[-1] else float(high))


def profiles(x: Floats, spanned: Floats, sizes: NDArray[np.int64]) -> dict[int, Profile]:
    """Profile likelihoods of x_c at each size, on common places.

    Args:
        x: (n,) finite, of each run.
        spanned: (n,) 0 or 1.
        sizes: (n,) smarticles.
    """
    span = float(np.ptp(x)) or 1.0
    places = np.linspace(x.min() - span / 2, x.max() + span / 2, _PLACES)
    widths = span * np.geomspace(2e-3, 1, _WIDTHS)
    found = {}
    for size in np.unique(sizes):
        own = sizes == size
        # (places, widths, runs); log of the probability of what was seen, without an overflow.
        steps = (places[:, None, None] - x[own]) / widths[:, None] * (2 * spanned[own] - 1)
        likelihood = -np.logaddexp(0, steps).sum(axis=2)
        found[int(size)] = Profile(
            places=places,
            likelihood=likelihood.max(axis=1),
            widths=widths[likelihood.argmax(axis=1)],
            runs=int(own.sum()),
            spanned=int(spanned[own].sum()),
        )
    return found


def shifted(found: Mapping[int, Profile]) -> float:
    """Probability of places so unlike each other, were they all one, by the ratio of likelihoods [1].

    NaN where fewer than two sizes know theirs.
    """
    known = [one.likelihood for one in found.values() if one.known]
    if len(known) < 2:
        return math.nan
    apart = sum(float(one.max()) for one in known)
    return float(chdtrc(len(known) - 1, 2 * max(apart - float(np.sum(known, axis=0).max()), 0.0)))


def near(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs near the threshold."""
    return runs[runs[ASPECT] <= LARGEST]


def profiles_of(runs: pd.DataFrame, stage: str, axis: str) -> dict[int, Profile]:
    """`profiles` of the runs near the threshold, at one stage and against `axes`."""
    column = axes(stage)[axis]
    part = near(runs)
    part = part[np.isfinite(part[column])]
    if part.empty:
        return {}
    x, spanned = (part[name].to_numpy(dtype=np.float64) for name in (column, spans(stage)))
    return profiles(x, spanned, part[COUNT].to_numpy(dtype=np.int64))


def thresholds(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per stage, axis and size: where half of the piles are spanned."""
    rows = []
    for stage in STAGES:
        for axis in axes(stage):
            for size, one in profiles_of(runs, stage, axis).items():
                low, high = one.interval
                rows.append(
                    {
                        STAGE: stage,
                        AXIS: axis,
                        COUNT: size,
                        RUNS: one.runs,
                        SPANNED: one.spanned,
                        PLACE: one.best,
                        LOW: low,
                        HIGH: high,
                        WIDTH: one.width,
                    }
                )
    return pd.DataFrame(rows)


def growth(runs: pd.DataFrame, stage: str, aspect: float) -> Slope:
    """Power of N with which the largest cluster's share falls or rises at one l/w."""
    part = runs[runs[ASPECT] == aspect]
    size, cluster = (np.log(part[name].to_numpy(dtype=np.float64)).tolist() for name in (COUNT, share(stage)))
    return slope_within(size, cluster, [0] * len(part))


def growths(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per stage and l/w: how the largest cluster's share goes with N."""
    rows = []
    for stage in STAGES:
        for aspect in sorted(runs[ASPECT].unique()):
            slope = growth(runs, stage, aspect)
            rows.append(
                {
                    STAGE: stage,
                    ASPECT: aspect,
                    RUNS: slope.count,
                    POWER: slope.value,
                    POWER_BAR: slope.half_width,
                    VERDICT: str(judge(negative(slope))),
                }
            )
    return pd.DataFrame(rows)
