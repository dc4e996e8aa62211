"""Fit how a quantity changes with the size of piles: q = q_∞ + a N^(-1/3), surface over volume.

The scatter from seed to seed falls with the size of a pile, and a few seeds of one size hardly know it. It is taken as
a power of N that all sizes share, fitted to what seeds differ by within sizes alone, so that it knows nothing of the
law. Where the law leaves more than that scatter explains, errors are larger by the square root of the ratio (Birge,
Phys. Rev. 40, 207, 1932), and the law is rejected beyond 95 %.

A threshold is the place x_c at which half of all runs have a property, with its 95 % interval by profile likelihood.

The share of runs that have it rises with x as a logistic function 1/(1 + exp(-(x - x_c)/s)), the width s of whatever
the data allow. So it is sound also where no run below some x has it and all above do, and nothing else is known of s.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri, fdtrc, fdtri, stdtrit

from postprocess.statistics.seeds import CONFIDENCE, Floats, Slope

POWER = 1 / 3
POWERS = np.arange(0.02, 1.501, 0.01)  #: Powers that are tried; an interval that ends there may be longer

_FALLS = np.arange(0.0, 2.01, 0.02)


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """Scatter of one run, σ² = c N^(-fall)."""

    variance: float  #: c, in the square of the quantity's unit
    fall: float  #: Power of N that σ² falls with [1]
    freedom: int  #: Its degrees of freedom

    def error(self, count: float, runs: int) -> float:
        """Half-width of the 95 % interval of a mean over runs of one size; NaN where no scatter is known."""
        if not self.freedom:
            return math.nan
        return float(stdtrit(self.freedom, (1 + CONFIDENCE) / 2)) * math.sqrt(self.variance * count**-self.fall / runs)


@dataclass(frozen=True, kw_only=True)
class SizeLaw:
    """q = bulk + slope N^(-1/3), fitted to runs."""

    bulk: float  #: q of a pile without end
    slope: float  #: a
    covariance: Floats  #: (2, 2) of the two, enlarged where the law leaves more than scatter; NaN without scatter
    scatter: Scatter  #: Of one run
    #: Variance that the law leaves of the means of sizes, over what scatter explains; NaN below three sizes
    excess: float
    p_value: float  #: Probability of so much, were the law true [1]; likewise
    powers: tuple[float, float, float]  #: Best power of N and its 95 % interval [1]; likewise
    sizes: int  #: How many sizes
    runs: int  #: How many runs

    def error(self, bulk: float, slope: float) -> float:
        """Half-width of the 95 % interval of bulk · q_∞ + slope · a; NaN without scatter."""
        share = np.array([bulk, slope])
        return self._quantile * math.sqrt(float(share @ self.covariance @ share))

    def at(self, count: float) -> float:
        """The quantity of so many smarticles."""
        return self.bulk + self.slope * math.pow(count, -POWER)

    def bias(self, count: float) -> Slope:
        """The quantity of so many smarticles less that of a pile without end."""
        share = math.pow(count, -POWER)
        half = self.error(0, share)
        return Slope(value=self.slope * share, standard_error=half / self._quantile, half_width=half, count=self.runs)

    @property
    def _quantile(self) -> float:
        return float(stdtrit(max(self.scatter.freedom, 1), (1 + CONFIDENCE) / 2))


def scatter_of(counts: Floats, values: Floats) -> Scatter:
    """Fit the scatter within sizes, by maximum likelihood; arguments as those of `size_law`."""
    sizes, place = np.unique(counts, return_inverse=True)
    members = np.bincount(place)
    squares = np.bincount(place, (values - (np.bincount(place, values) / members)[place]) ** 2)
    free = members - 1
    freedom = int(free.sum())
    if not freedom:
        return Scatter(variance=math.nan, fall=0.0, freedom=0)
    variances = np.array([(squares * sizes**fall).sum() for fall in _FALLS]) / freedom
    if not variances[0]:
        return Scatter(variance=0.0, fall=0.0, freedom=freedom)
    unlikely = freedom * np.log(variances) - _FALLS * float(free @ np.log(sizes))
    best = int(np.argmin(unlikely))
    return Scatter(variance=float(variances[best]), fall=float(_FALLS[best]), freedom=freedom)


def size_law(counts: Floats, values: Floats) -> SizeLaw:
    """Fit the law to runs of two sizes at least, by their counts of smarticles (n,) and finite values (n,)."""
    scatter = scatter_of(counts, values)
    bulk, slope, left = _fit(counts, values, scatter, POWER)
    sizes = len(np.unique(counts))
    excess = p_value = math.nan
    powers = (math.nan, math.nan, math.nan)
    if sizes > 2 and scatter.freedom and scatter.variance:
        excess = left / scatter.variance / (sizes - 2)
        p_value = float(fdtrc(sizes - 2, scatter.freedom, excess))
        powers = _powers(counts, values, scatter)
    larger = max(excess, 1.0) if math.isfinite(excess) else 1.0
    matrix = np.stack([np.ones(len(counts)), counts**-POWER], axis=1)
    inverse: Floats = np.linalg.inv(matrix.T @ (matrix * (counts**scatter.fall)[:, None])).astype(np.float64)
    return SizeLaw(
        bulk=bulk,
        slope=slope,
        covariance=inverse * scatter.variance * larger,
        scatter=scatter,
        excess=excess,
        p_value=p_value,
        powers=powers,
        sizes=sizes,
        runs=len(values),
    )


def _fit(counts: Floats, values: Floats, scatter: Scatter, power: float) -> tuple[float, float, float]:
    """Bulk and slope, and the weighted squares that they leave of the means of sizes."""
    sizes, place = np.unique(counts, return_inverse=True)
    members = np.bincount(place)
    means = np.bincount(place, values) / members
    weights = members * sizes**scatter.fall
    matrix = np.stack([np.ones(len(sizes)), sizes**-power], axis=1)
    root = np.sqrt(weights)
    found, *_ = np.linalg.lstsq(matrix * root[:, None], means * root, rcond=None)
    return float(found[0]), float(found[1]), float(weights @ (means - matrix @ found) ** 2)


def _powers(counts: Floats, values: Floats, scatter: Scatter) -> tuple[float, float, float]:
    """Return the best power and the interval that the data admit at 95 %, errors enlarged as the law's."""
    left = np.array([_fit(counts, values, scatter, float(power))[2] for power in POWERS]) / scatter.variance
    free = len(np.unique(counts)) - 3
    larger = max(left.min() / free, 1.0) if free > 0 else 1.0
    kept = POWERS[(left - left.min()) / larger <= fdtri(1, scatter.freedom, CONFIDENCE)]
    return float(POWERS[left.argmin()]), float(kept[0]), float(kept[-1])


_PLACES, _WIDTHS = 401, 30


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """What the runs of one group say of x_c."""

    places: Floats  #: (n,) where x_c may be, common to all groups
    likelihood: Floats  #: (n,) log of it, of the best width at each place
    widths: Floats  #: (n,) these widths
    runs: int  #: Number of runs
    having: int  #: Number of runs with the property

    @property
    def known(self) -> bool:
        """Whether some runs have the property and some do not."""
        return 0 < self.having < self.runs

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


def profiles(x: Floats, having: Floats, groups: NDArray[np.int64]) -> dict[int, Profile]:
    """Compute the profile likelihoods of x_c of each group, such as a size, on common places.

    Runs have a finite x (n,), the property or not, 0 or 1 (n,), and a group (n,).
    """
    span = float(np.ptp(x)) or 1.0
    places = np.linspace(x.min() - span / 2, x.max() + span / 2, _PLACES)
    widths = span * np.geomspace(2e-3, 1, _WIDTHS)
    found = {}
    for group in np.unique(groups):
        own = groups == group
        # (places, widths, runs); log of the probability of what was seen, without an overflow.
        steps = (places[:, None, None] - x[own]) / widths[:, None] * (2 * having[own] - 1)
        likelihood = -np.logaddexp(0, steps).sum(axis=2)
        found[int(group)] = Profile(
            places=places,
            likelihood=likelihood.max(axis=1),
            widths=widths[likelihood.argmax(axis=1)],
            runs=int(own.sum()),
            having=int(having[own].sum()),
        )
    return found


def alike(found: Collection[Profile]) -> float:
    """Return the probability of places so unlike, were they all one, by the ratio of likelihoods [1].

    NaN where fewer than two groups know theirs.
    """
    known = [one.likelihood for one in found if one.known]
    if len(known) < 2:
        return math.nan
    apart = sum(float(one.max()) for one in known)
    return float(chdtrc(len(known) - 1, 2 * max(apart - float(np.sum(known, axis=0).max()), 0.0)))
