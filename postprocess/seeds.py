"""Means over seeds and their differences, with 95 % confidence intervals by Student's t.

Runs that differ in their seed alone are independent, unlike successive frames of one run, see
`postprocess.averages`. One seed has a mean and no error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

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


def difference(mean: SeedMean, baseline: SeedMean) -> Difference:
    """A mean less another one, by Welch: their spreads need not be equal.

    Args:
        mean: Over its seeds.
        baseline: Over its own; the two are taken as independent.

    Returns:
        The difference, in the means' unit.

    Source:
        Welch, Biometrika 34 (1947) 28; degrees of freedom after Satterthwaite.
    """
    value = mean.value - baseline.value
    squares = mean.standard_error**2, baseline.standard_error**2
    if math.isnan(sum(squares)):
        return Difference(value=value, half_width=math.nan)
    total = sum(squares)
    if total == 0:
        return Difference(value=value, half_width=0.0)
    freedom = total**2 / (squares[0] ** 2 / (mean.count - 1) + squares[1] ** 2 / (baseline.count - 1))
    return Difference(value=value, half_width=_quantile(freedom) * math.sqrt(total))


def _quantile(freedom: float) -> float:
    """How many standard errors the half-width has."""
    return float(stdtrit(freedom, (1 + CONFIDENCE) / 2))
