"""Means over seeds, their differences and slopes, with 95 % confidence intervals by Student's t.

Runs that differ in their seed alone are independent, unlike successive frames of one run, see
`postprocess.statistics.averages`. One seed has a mean and no error.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, stdtrit

CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class SeedMean:
    """A mean over seeds.

    Attributes:
        value: NaN without seeds.
        standard_error: s/√n; NaN for fewer than two seeds.
        half_width: Of the 95 % confidence interval by Student's t with n − 1 degrees of freedom;
            NaN for fewer than two seeds.
        count: n.
    """

    value: float
    standard_error: float
    half_width: float
    count: int


@dataclass(frozen=True, kw_only=True)
class Difference:
    """The difference of two means.

    Attributes:
        value: NaN if either mean is.
        half_width: Of the 95 % confidence interval; NaN if either mean has no error.
    """

    value: float
    half_width: float

    @property
    def clear(self) -> bool:
        """Whether it is beyond its own error."""
        return abs(self.value) > self.half_width


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """Standard deviation from seed to seed that several settings share.

    Attributes:
        value: In the unit of what scatters; NaN where no setting has two seeds.
        freedom: Degrees of freedom that it is known with.
    """

    value: float
    freedom: int


def pooled_scatter(groups: Iterable[Sequence[float]]) -> Scatter:
    """The scatter within groups, taken as the same in all of them.

    A few seeds of each of many settings know it far better than those of one setting alone.

    Args:
        groups: Values of each setting; NaN are left out.

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
    """Mean of independent values with its error.

    Args:
        values: One per seed; NaN are left out.

    Returns:
        The mean, in the values' unit.

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
    error = float(known.std(ddof=1)) / math.sqrt(count)
    return SeedMean(
        value=float(known.mean()),
        standard_error=error,
        half_width=_quantile(count - 1) * error,
        count=count,
    )


def difference(mean: SeedMean, baseline: SeedMean, *, scatter: Scatter | None = None) -> Difference:
    """A mean less another one.

    Args:
        mean: Over its seeds.
        baseline: Over its own; the two are taken as independent.
        scatter: That of a single seed, common to both; None: each has its own, by Welch.

    Returns:
        The difference, in the means' unit.

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
    if math.isnan(sum(squares)):
        return Difference(value=value, half_width=math.nan)
    total = sum(squares)
    if total == 0:
        return Difference(value=value, half_width=0.0)
    freedom = total**2 / (squares[0] ** 2 / (mean.count - 1) + squares[1] ** 2 / (baseline.count - 1))
    return Difference(value=value, half_width=_quantile(freedom) * math.sqrt(total))


def relative_difference(mean: SeedMean, baseline: SeedMean, *, scatter: Scatter | None = None) -> Difference:
    """`difference` in per cent of the baseline's mean, which is itself taken as exact; NaN where that is 0."""
    change = difference(mean, baseline, scatter=scatter)
    scale = 100 / baseline.value if baseline.value else math.nan
    return Difference(value=scale * change.value, half_width=abs(scale) * change.half_width)


@dataclass(frozen=True, kw_only=True)
class Slope:
    """A slope common to several blocks of points.

    Attributes:
        value: NaN where x is the same throughout every block.
        standard_error: NaN without a degree of freedom to spare.
        half_width: Of the 95 % confidence interval; NaN without an error.
        count: Points.
    """

    value: float
    standard_error: float
    half_width: float
    count: int


def slope_within(x: Sequence[float], y: Sequence[float], blocks: Sequence[Hashable]) -> Slope:
    """Least-squares slope of y against x, the same in all blocks, each of which has a level of its own.

    What the points of a block share, such as the pile that they all began with, does not count as scatter.

    Args:
        x: One per point.
        y: One per point; points with NaN are left out.
        blocks: Block of each point; all the same for one straight line.

    Returns:
        The slope, in the unit of y over that of x; n − blocks − 1 degrees of freedom.

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
    count, nan = len(across), math.nan
    if count == 0:
        return Slope(value=nan, standard_error=nan, half_width=nan, count=0)
    members = np.bincount(block)
    across = across - (np.bincount(block, across) / members)[block]
    up = up - (np.bincount(block, up) / members)[block]
    spread = float(across @ across)
    if spread == 0:
        return Slope(value=nan, standard_error=nan, half_width=nan, count=count)
    value = float(across @ up) / spread
    freedom = count - len(numbers) - 1
    if freedom < 1:
        return Slope(value=value, standard_error=nan, half_width=nan, count=count)
    rest = up - value * across
    error = math.sqrt(float(rest @ rest) / freedom / spread)
    return Slope(value=value, standard_error=error, half_width=_quantile(freedom) * error, count=count)


@dataclass(frozen=True, kw_only=True)
class Parabola:
    """A parabola through points.

    Attributes:
        slope: At the place that was asked for; NaN where x has fewer than three values.
        bend: Half the second derivative, the same everywhere; below 0 where the parabola has a maximum.
        top: Where its slope is 0; NaN without a bend.
        fits: Probability of means at equal x that are off it by as much or more, if it were the truth (F test of the
            lack of fit); NaN where x has no more than three values, or no value twice.
    """

    slope: Slope
    bend: Slope
    top: float
    fits: float


def parabola(x: Sequence[float], y: Sequence[float], *, at: float) -> Parabola:
    """Least-squares parabola through points, told by its slope at one place and by its bend.

    On which side of a place a flat top lies is told by the slope there, whose error does not grow without bound as
    that of the top itself does when the bend is small.

    Args:
        x: One per point.
        y: One per point; points with NaN are left out.
        at: Where the slope is wanted, in the unit of x.

    Returns:
        Slope and bend with the scatter of the points about the parabola as their error, n − 3 degrees of freedom,
        and whether it describes them.

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
    _, slope, bend = (
        Slope(
            value=float(value),
            standard_error=float(error),
            half_width=_quantile(freedom) * float(error) if freedom > 0 else math.nan,
            count=count,
        )
        for value, error in zip(coefficients, errors, strict=True)
    )
    top = at - slope.value / (2 * bend.value) if bend.value else math.nan
    return Parabola(slope=slope, bend=bend, top=top, fits=_fits(across, rest))


def _fits(x: NDArray[np.float64], rest: NDArray[np.float64]) -> float:
    _, place, members = np.unique(x, return_inverse=True, return_counts=True)
    means = np.bincount(place, rest) / members
    off, repeats = len(members) - 3, len(rest) - len(members)
    pure = float(np.sum((rest - means[place]) ** 2))
    if off < 1 or repeats < 1 or pure == 0:
        return math.nan
    return float(fdtrc(off, repeats, float(members @ means**2) / off / (pure / repeats)))


def _quantile(freedom: float) -> float:
    """How many standard errors the half-width has."""
    return float(stdtrit(freedom, (1 + CONFIDENCE) / 2))
