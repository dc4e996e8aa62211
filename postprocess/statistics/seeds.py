"""Means with errors, over seeds and over successive frames; differences, slopes, parabolas.

Runs that differ in their seed alone are independent, and their intervals are those of Student's t; one seed has a mean
and no error. Successive frames of one run are correlated, see `mean_with_error`.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import fdtrc, stdtrit

Floats = NDArray[np.float64]

CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class SeedMean:
    """A mean over seeds, or another estimate from independent runs."""

    value: float  #: NaN without data
    standard_error: float  #: Of a mean s/√n; NaN without a degree of freedom to spare
    half_width: float  #: Of the 95 % confidence interval by Student's t; NaN without an error
    count: int  #: n, runs or points


Slope = SeedMean  #: A slope that several blocks of points share; NaN where x is the same throughout every block


@dataclass(frozen=True, kw_only=True)
class Difference:
    """The difference of two means with the half-width of its 95 % interval; NaN where one has none."""

    value: float
    half_width: float

    @property
    def clear(self) -> bool:
        """Whether it is beyond its own error."""
        return abs(self.value) > self.half_width


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """Standard deviation from seed to seed that several points share."""

    value: float  #: In the unit of what scatters; NaN where no point has two seeds
    freedom: int  #: Its degrees of freedom


@dataclass(frozen=True, kw_only=True)
class Mean:
    """A mean over successive frames."""

    value: float  #: The mean; NaN without samples. Infinite if a sample is, NaN if samples are of either sign.
    standard_error: float  #: NaN with fewer than two samples, or infinite ones
    count: int  #: Number of samples averaged
    effective_count: float  #: Number of independent samples they are worth; NaN with infinite ones


def mean_with_error(samples: ArrayLike) -> Mean:
    """Average successive samples (n,) in time order, with an error that allows for their correlation, without NaN.

    The naive error s/√n is too small. It is widened by the square root of the integrated correlation time, summed up to
    where pairs of correlations turn negative. From some 20 samples that time is itself known only to tens of per cent
    and rather too short: read the error as a lower bound for slow drifts.

    Source:
        Geyer, Statistical Science 7 (1992) 473 (initial positive sequence).
    """
    values = np.asarray(samples, dtype=np.float64)
    values = values[~np.isnan(values)]
    count = len(values)
    if count == 0:
        return Mean(value=math.nan, standard_error=math.nan, count=0, effective_count=0.0)
    infinite = values[np.isinf(values)]
    if len(infinite):
        # E.g. the unbalanced force over no contact force, while everything is still in the air.
        mean = float(infinite[0]) if (infinite == infinite[0]).all() else math.nan
        return Mean(value=mean, standard_error=math.nan, count=count, effective_count=math.nan)
    mean = float(values.mean())
    if count == 1:
        return Mean(value=mean, standard_error=math.nan, count=1, effective_count=1.0)
    effective = count / min(max(_correlation_time(values - mean), 1.0), count)
    error = float(np.sqrt(values.var(ddof=1) / effective))
    return Mean(value=mean, standard_error=error, count=count, effective_count=effective)


def _correlation_time(deviations: Floats) -> float:
    """Integrate the correlation time, in samples; 1 if they are independent."""
    count = len(deviations)
    covariance = np.correlate(deviations, deviations, mode="full")[count - 1 :]
    if covariance[0] <= 0:
        return 1.0
    correlation = covariance / covariance[0]
    pairs = correlation[: count // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.nonzero(pairs <= 0)[0]
    last = int(negative[0]) if len(negative) else len(pairs)
    return float(2 * pairs[:last].sum() - 1)


def pooled_scatter(groups: Iterable[Sequence[float]]) -> Scatter:
    """Pool the scatter within groups, taken as equal in all of them; NaN are left out.

    A few seeds of each of many points know it far better than those of one point alone.

    Example:
        >>> pooled_scatter([[1.0, 3.0], [10.0, 12.0], [5.0]])
        Scatter(value=1.4142135623730951, freedom=2)
    """
    known = [array[~np.isnan(array)] for array in (np.asarray(group, dtype=np.float64) for group in groups)]
    freedom = sum(len(group) - 1 for group in known if len(group))
    if not freedom:
        return Scatter(value=math.nan, freedom=0)
    squares = sum(float(((group - group.mean()) ** 2).sum()) for group in known if len(group))
    return Scatter(value=math.sqrt(squares / freedom), freedom=freedom)


def mean_over_seeds(values: Sequence[float]) -> SeedMean:
    """Average independent values, one per seed; NaN are left out.

    Example:
        >>> mean = mean_over_seeds([1.0, 2.0, 3.0])
        >>> mean.value, round(mean.half_width, 3)
        (2.0, 2.484)
    """
    known = np.asarray(values, dtype=np.float64)
    known = known[~np.isnan(known)]
    count = len(known)
    if count < 2:
        value = float(known[0]) if count else math.nan
        return SeedMean(value=value, standard_error=math.nan, half_width=math.nan, count=count)
    return _estimate(float(known.mean()), float(known.std(ddof=1)) / math.sqrt(count), count - 1, count)


def _estimate(value: float, error: float, freedom: int, count: int) -> SeedMean:
    half_width = _quantile(freedom) * error if freedom > 0 else math.nan
    return SeedMean(value=value, standard_error=error, half_width=half_width, count=count)


def difference(mean: SeedMean, baseline: SeedMean, *, scatter: Scatter | None = None) -> Difference:
    """Subtract an independent mean from another one.

    The scatter of a single seed may be common to both; without it each has its own, by Welch.

    Source:
        Welch, Biometrika 34 (1947) 28; degrees of freedom after Satterthwaite.
    """
    value = mean.value - baseline.value
    if scatter is not None:
        if not (mean.count and baseline.count and scatter.freedom):
            return Difference(value=value, half_width=math.nan)
        error = scatter.value * math.sqrt(1 / mean.count + 1 / baseline.count)
        return Difference(value=value, half_width=_quantile(scatter.freedom) * error)
    squares = mean.standard_error**2, baseline.standard_error**2
    total = sum(squares)
    if math.isnan(total) or total == 0:
        return Difference(value=value, half_width=total)
    freedom = total**2 / (squares[0] ** 2 / (mean.count - 1) + squares[1] ** 2 / (baseline.count - 1))
    return Difference(value=value, half_width=_quantile(freedom) * math.sqrt(total))


def relative_difference(mean: SeedMean, baseline: SeedMean, *, scatter: Scatter | None = None) -> Difference:
    """Return `difference` in per cent of the baseline's mean, taken as exact; NaN where that is 0."""
    change = difference(mean, baseline, scatter=scatter)
    scale = 100 / baseline.value if baseline.value else math.nan
    return Difference(value=scale * change.value, half_width=abs(scale) * change.half_width)


def slope_within(x: Sequence[float], y: Sequence[float], blocks: Sequence[Hashable]) -> Slope:
    """Fit one slope of y against x to all blocks, each of which has a level of its own.

    What the points of a block share, such as the pile that they all began with, does not count as scatter. Points with
    NaN are left out; n − blocks − 1 degrees of freedom.

    Example:
        >>> slope_within([0, 1, 0, 1], [5, 7, 1, 3], ["a", "a", "b", "b"]).value
        2.0
    """
    across, up = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    known = np.isfinite(across) & np.isfinite(up)
    across, up = across[known], up[known]
    numbers: dict[Hashable, int] = {}
    own = [block for block, kept in zip(blocks, known, strict=True) if kept]
    block = np.array([numbers.setdefault(name, len(numbers)) for name in own], dtype=np.int64)
    members = np.bincount(block)
    across = across - (np.bincount(block, across) / members)[block]
    up = up - (np.bincount(block, up) / members)[block]
    count, spread = len(across), float(across @ across)
    if spread == 0:
        return Slope(value=math.nan, standard_error=math.nan, half_width=math.nan, count=count)
    value, freedom = float(across @ up) / spread, count - len(numbers) - 1
    rest = up - value * across
    error = math.sqrt(float(rest @ rest) / freedom / spread) if freedom > 0 else math.nan
    return _estimate(value, error, freedom, count)


@dataclass(frozen=True, kw_only=True)
class Parabola:
    """A parabola through points."""

    slope: Slope  #: At the place that was asked for; NaN where x has fewer than three values
    bend: Slope  #: Half the second derivative, everywhere; below 0 where the parabola has a maximum
    top: float  #: Where its slope is 0; NaN without a bend
    #: Probability of means at equal x that are off it by as much or more, if it were the truth (F test of the lack of
    #: fit); NaN where x has no more than three values, or no value twice
    fits: float


def parabola(x: Sequence[float], y: Sequence[float], *, at: float) -> Parabola:
    """Fit a parabola, described by its bend and by its slope at x = `at`; points with NaN are left out.

    The slope there says on which side a flat top lies; its error does not grow without bound as that of the top itself
    does when the bend is small. Errors are by the scatter about the parabola, n − 3 degrees of freedom.

    Example:
        >>> round(parabola([0, 1, 2, 3], [0, 3, 4, 3], at=1.0).slope.value, 9)
        2.0
    """
    across, up = np.asarray(x, dtype=np.float64) - at, np.asarray(y, dtype=np.float64)
    known = np.isfinite(across) & np.isfinite(up)
    across, up = across[known], up[known]
    count, freedom = len(up), len(up) - 3
    if len(set(across.tolist())) < 3:
        none = Slope(value=math.nan, standard_error=math.nan, half_width=math.nan, count=count)
        return Parabola(slope=none, bend=none, top=math.nan, fits=math.nan)
    powers = np.stack([np.ones(count), across, across**2], axis=1)
    inverse = np.linalg.pinv(powers)
    coefficients = inverse @ up
    rest = up - powers @ coefficients
    variance = float(rest @ rest) / freedom if freedom > 0 else math.nan
    errors = np.sqrt(variance * np.sum(inverse**2, axis=1))
    slope, bend = (_estimate(float(coefficients[k]), float(errors[k]), freedom, count) for k in (1, 2))
    top = at - slope.value / (2 * bend.value) if bend.value else math.nan
    return Parabola(slope=slope, bend=bend, top=top, fits=_fits(across, rest))


def _fits(x: Floats, rest: Floats) -> float:
    _, place, members = np.unique(x, return_inverse=True, return_counts=True)
    means = np.bincount(place, rest) / members
    off, repeats = len(members) - 3, len(rest) - len(members)
    pure = float(np.sum((rest - means[place]) ** 2))
    if off < 1 or repeats < 1 or pure == 0:
        return math.nan
    return float(fdtrc(off, repeats, float(members @ means**2) / off / (pure / repeats)))


def _quantile(freedom: float) -> float:
    """Return how many standard errors the half-width has."""
    return float(stdtrit(freedom, (1 + CONFIDENCE) / 2))
