"""Fit how a quantity depends on the number of smarticles N, q = q_∞ + a N^(-1/3), and find thresholds.

N^(-1/3) is proportional to the surface of a pile over its volume. The variance from seed to seed is fitted as a power
of N, by the differences of seeds at equal N. If the means deviate from the law by more than this variance explains,
errors are multiplied by the square root of the ratio (Birge, Phys. Rev. 40, 207, 1932). The law is rejected at 95 %.

A threshold is the x_c at which half of all runs have a property. The fraction of runs with the property rises with x as
a logistic function 1/(1 + exp(-(x - x_c)/s)). The 95 % interval of x_c is by profile likelihood over all widths s; it
is valid even if no run below some x has the property and all runs above have it.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri, fdtrc, fdtri, stdtrit

from postprocess.statistics.seeds import CONFIDENCE, Floats, Slope

POWER = 1 / 3
POWERS = np.arange(0.02, 1.501, 0.01)  #: Powers of N in the fit of `SizeLaw.powers`

_FALLS = np.arange(0.0, 2.01, 0.02)


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """Variance from seed to seed, σ² = c N^(-fall)."""

    variance: float  #: c, in the square of the quantity's unit
    fall: float  #: Exponent [-]
    freedom: int  #: Number of degrees of freedom


@dataclass(frozen=True, kw_only=True)
class SizeLaw:
    """The law q = q_∞ + a N^(-1/3), fitted to runs."""

    bulk: float  #: q_∞
    slope: float  #: a
    covariance: Floats  #: (2, 2) covariance of q_∞ and a, times `excess` if above 1; NaN without scatter
    scatter: Scatter  #: Variance from seed to seed
    excess: float  #: Variance of the means about the law over that expected from the scatter [-]; NaN below three sizes
    p_value: float  #: Probability of an excess as large or larger, if the law holds [-]; NaN below three sizes
    powers: tuple[float, float, float]  #: Best power of N and its 95 % interval [-]; NaN below three sizes
    sizes: int  #: Number of distinct N
    runs: int  #: Number of runs

    def error(self, bulk: float, slope: float) -> float:
        """Return the half-width of the 95 % interval of bulk · q_∞ + slope · a; NaN without scatter."""
        weights = np.array([bulk, slope])
        return self._quantile * math.sqrt(float(weights @ self.covariance @ weights))

    def at(self, count: float) -> float:
        """Return q for N = `count`."""
        return self.bulk + self.slope * math.pow(count, -POWER)

    def bias(self, count: float) -> Slope:
        """Return the finite-size effect, q for N = `count` less q_∞, with its error."""
        power = math.pow(count, -POWER)
        half = self.error(0, power)
        return Slope(value=self.slope * power, standard_error=half / self._quantile, half_width=half, count=self.runs)

    @property
    def _quantile(self) -> float:
        return float(stdtrit(max(self.scatter.freedom, 1), (1 + CONFIDENCE) / 2))


def scatter_of(counts: Floats, values: Floats) -> Scatter:
    """Fit the variance from seed to seed by maximum likelihood.

    Counts (n,) are the numbers of smarticles of each run, values (n,) its finite values of the quantity.
    """
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
    """Fit q = q_∞ + a N^(-1/3) to runs with at least two distinct N.

    Counts (n,) are the numbers of smarticles of each run, values (n,) its finite values of the quantity.
    """
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
    """Fit q = q_∞ + a N^-power to the means at each N, with weights.

    Returns q_∞, a and the weighted sum of squared residuals. `counts` (n,) are the numbers of smarticles of each run,
    `values` (n,) its values of q. The weight of a mean is the number of its runs times N^fall, see `Scatter`.
    """
    sizes, place = np.unique(counts, return_inverse=True)
    members = np.bincount(place)
    means = np.bincount(place, values) / members
    weights = members * sizes**scatter.fall
    matrix = np.stack([np.ones(len(sizes)), sizes**-power], axis=1)
    root = np.sqrt(weights)
    found, *_ = np.linalg.lstsq(matrix * root[:, None], means * root, rcond=None)
    return float(found[0]), float(found[1]), float(weights @ (means - matrix @ found) ** 2)


def _powers(counts: Floats, values: Floats, scatter: Scatter) -> tuple[float, float, float]:
    """Return the power of N that fits best, and the lower and upper end of its 95 % interval.

    `counts` (n,) are the numbers of smarticles of each run, `values` (n,) its values of the quantity. If the means
    deviate from the best fit by more than the scatter explains, the interval is wider.
    """
    left = np.array([_fit(counts, values, scatter, float(power))[2] for power in POWERS]) / scatter.variance
    free = len(np.unique(counts)) - 3
    larger = max(left.min() / free, 1.0) if free > 0 else 1.0
    kept = POWERS[(left - left.min()) / larger <= fdtri(1, scatter.freedom, CONFIDENCE)]
    return float(POWERS[left.argmin()]), float(kept[0]), float(kept[-1])


_PLACES, _WIDTHS = 401, 30


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """Profile likelihood of the threshold x_c, for the runs of one group."""

    places: Floats  #: (n,) tried values of x_c, common to all groups
    likelihood: Floats  #: (n,) log-likelihood at each x_c, with the best width s
    widths: Floats  #: (n,) best width s at each x_c
    runs: int  #: Number of runs
    having: int  #: Number of runs with the property

    @property
    def known(self) -> bool:
        """Whether some runs have the property and some do not, so that x_c can be estimated."""
        return 0 < self.having < self.runs

    @property
    def best(self) -> float:
        """Estimate of x_c, the mean of the values with the greatest likelihood; NaN if x_c is not known."""
        if not self.known:
            return math.nan
        return float(self.places[self.likelihood >= self.likelihood.max() - 1e-3].mean())

    @property
    def width(self) -> float:
        """Width s of the logistic function 1/(1 + exp(-(x - x_c)/s)) at the best x_c; NaN if unknown."""
        return float(self.widths[self.likelihood.argmax()]) if self.known else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of x_c; an end is infinite if the interval reaches the first or last tried value."""
        kept = self.likelihood >= self.likelihood.max() - chdtri(1, 1 - CONFIDENCE) / 2
        low, high = self.places[kept][[0, -1]]
        return (-math.inf if kept[0] else float(low), math.inf if kept[-1] else float(high))


def profiles(x: Floats, having: Floats, groups: NDArray[np.int64]) -> dict[int, Profile]:
    """Compute the profile likelihood of the threshold x_c for each group of runs, by the group's number.

    Values of x (n,) are finite; `having` (n,) is 1 for a run that has the property, else 0; `groups` (n,) are numbers
    of groups, for example sizes of piles. All profiles have the same tried values of x_c.
    """
    span = float(np.ptp(x)) or 1.0
    places = np.linspace(x.min() - span / 2, x.max() + span / 2, _PLACES)
    widths = span * np.geomspace(2e-3, 1, _WIDTHS)
    found = {}
    for group in np.unique(groups):
        own = groups == group
        # (places, widths, runs); logaddexp avoids an overflow.
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
    """Return the p-value of the hypothesis that all groups have one threshold x_c [-].

    The test is the likelihood-ratio test. The p-value is NaN if x_c is known for fewer than two groups.
    """
    known = [one.likelihood for one in found if one.known]
    if len(known) < 2:
        return math.nan
    apart = sum(float(one.max()) for one in known)
    return float(chdtrc(len(known) - 1, 2 * max(apart - float(np.sum(known, axis=0).max()), 0.0)))
