"""Compute means with errors over seeds and over successive frames, differences, slopes and parabolas.

Runs that differ in their seed alone are independent; their 95 % intervals are by Student's t, and a single seed has no
error. Successive frames of one run are correlated, see `mean_with_error`.
"""

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import fdtrc, stdtrit

Floats = NDArray[np.float64]

CONFIDENCE = 0.95  #: Confidence level of all intervals


@dataclass(frozen=True, kw_only=True)
class SeedMean:
    """A mean over n seeds, or another estimate from independent runs or points, with its error."""

    value: float  #: Estimate; NaN without data
    standard_error: float  #: Standard error, for a mean s/√n; NaN without a degree of freedom
    half_width: float  #: Half-width of the 95 % confidence interval by Student's t; NaN without an error
    count: int  #: n, number of runs or points


Slope = SeedMean  #: A slope common to several blocks of points; NaN if x is constant in every block


@dataclass(frozen=True, kw_only=True)
class Difference:
    """The difference of two means."""

    value: float
    half_width: float  #: Half-width of the 95 % interval; NaN if a mean has no error

    @property
    def clear(self) -> bool:
        """Whether the 95 % interval excludes 0."""
        return abs(self.value) > self.half_width


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """Standard deviation from seed to seed, common to several points."""

    value: float  #: Standard deviation, in the unit of the quantity; NaN if no point has two seeds
    freedom: int  #: Number of degrees of freedom


@dataclass(frozen=True, kw_only=True)
class Mean:
    """A mean over successive, correlated samples."""

    value: float  #: Mean; NaN without samples, or if samples are infinite with both signs
    standard_error: float  #: Standard error; NaN for fewer than two samples, or if a sample is infinite
    count: int  #: Number of samples averaged
    effective_count: float  #: Number of independent samples whose mean has this error; NaN if a sample is infinite


def mean_with_error(samples: ArrayLike) -> Mean:
    """Average successive samples (n,) in time order, with an error that allows for their correlation.

    The error is s/√n times the square root of the integrated correlation time, which is summed until a pair of
    successive correlations turns negative. From 20 samples this time has an error of tens of per cent and is rather too
    short. The error of the mean is therefore a lower bound if the samples drift slowly. NaN are left out.

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
        # The unbalanced force, for example, is infinite while no smarticle touches another.
        mean = float(infinite[0]) if (infinite == infinite[0]).all() else math.nan
        return Mean(value=mean, standard_error=math.nan, count=count, effective_count=math.nan)
    mean = float(values.mean())
    if count == 1:
        return Mean(value=mean, standard_error=math.nan, count=1, effective_count=1.0)
    effective = count / min(max(_correlation_time(values - mean), 1.0), count)
    error = float(np.sqrt(values.var(ddof=1) / effective))
    return Mean(value=mean, standard_error=error, count=count, effective_count=effective)


def _correlation_time(deviations: Floats) -> float:
    """Return the integrated correlation time of deviations from the mean, in samples; 1 if independent."""
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
    """Estimate the standard deviation within groups, assumed equal in all groups; NaN are left out."""
    known = [array[~np.isnan(array)] for array in (np.asarray(group, dtype=np.float64) for group in groups)]
    freedom = sum(len(group) - 1 for group in known if len(group))
    if not freedom:
        return Scatter(value=math.nan, freedom=0)
    squares = sum(float(((group - group.mean()) ** 2).sum()) for group in known if len(group))
    return Scatter(value=math.sqrt(squares / freedom), freedom=freedom)


def mean_over_seeds(values: Sequence[float]) -> SeedMean:
    """Average independent values (n,), one per seed; values of NaN are left out."""
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
    """Return the difference of two independent means, `mean` less `baseline`.

    The interval follows from `scatter`, common to both means, or, without it, from the error of each mean by Welch.

    Source: Welch, Biometrika 34 (1947) 28; degrees of freedom after Satterthwaite.
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
    """Return the difference `mean` less `baseline` in per cent of the baseline; NaN if the baseline is 0.

    The baseline's error counts in the difference, but not in the division. `scatter` is common to both means; None: the
    interval follows from the error of each mean.
    """
    change = difference(mean, baseline, scatter=scatter)
    scale = 100 / baseline.value if baseline.value else math.nan
    return Difference(value=scale * change.value, half_width=abs(scale) * change.half_width)


def slope_within(x: Sequence[float], y: Sequence[float], blocks: Sequence[Hashable]) -> Slope:
    """Fit a slope of y (n,) against x (n,) common to all blocks, with an intercept for each block.

    Differences between blocks, such as between initial piles, thus do not count as scatter. Points with NaN are left
    out. The number of degrees of freedom is n less the number of blocks less 1.
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
    residuals = up - value * across
    error = math.sqrt(float(residuals @ residuals) / freedom / spread) if freedom > 0 else math.nan
    return _estimate(value, error, freedom, count)


@dataclass(frozen=True, kw_only=True)
class Parabola:
    """A parabola fitted to points."""

    slope: Slope  #: Slope at x = `at`, see `parabola`; NaN if x has fewer than three distinct values
    bend: Slope  #: Half the second derivative; below 0 if the parabola has a maximum
    top: float  #: x at which the slope is 0; NaN if the bend is 0
    #: p-value of the F test for lack of fit, by the scatter of points at equal x; NaN if x has at most three distinct
    #: values, or no value twice
    fits: float


def parabola(x: Sequence[float], y: Sequence[float], *, at: float) -> Parabola:
    """Fit a parabola of y (n,) against x (n,), described by its bend and its slope at x = `at`.

    The sign of the slope says on which side of `at` the extremum lies, and its error stays finite if the bend is small.
    Errors follow from the residuals, with n − 3 degrees of freedom. Points with NaN are left out.
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
    residuals = up - powers @ coefficients
    variance = float(residuals @ residuals) / freedom if freedom > 0 else math.nan
    errors = np.sqrt(variance * np.sum(inverse**2, axis=1))
    slope, bend = (_estimate(float(coefficients[k]), float(errors[k]), freedom, count) for k in (1, 2))
    top = at - slope.value / (2 * bend.value) if bend.value else math.nan
    return Parabola(slope=slope, bend=bend, top=top, fits=_lack_of_fit(across, residuals))


def _lack_of_fit(x: Floats, residuals: Floats) -> float:
    _, place, members = np.unique(x, return_inverse=True, return_counts=True)
    means = np.bincount(place, residuals) / members
    lack, repeats = len(members) - 3, len(residuals) - len(members)
    pure = float(np.sum((residuals - means[place]) ** 2))
    if lack < 1 or repeats < 1 or pure == 0:
        return math.nan
    return float(fdtrc(lack, repeats, float(members @ means**2) / lack / (pure / repeats)))


def _quantile(freedom: float) -> float:
    """Return the 95 % half-width over the standard error, by Student's t of `freedom` degrees of freedom."""
    return float(stdtrit(freedom, (1 + CONFIDENCE) / 2))
