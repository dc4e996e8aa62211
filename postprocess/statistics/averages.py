"""Means of time series with errors that know about correlation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, kw_only=True)
class Mean:
    """A mean over successive frames.

    Attributes:
        value: The mean; NaN without samples. Infinite if a sample is, NaN if samples are of either sign.
        standard_error: Standard error of the mean; NaN with fewer than two samples, or infinite ones.
        count: Number of samples averaged.
        effective_count: Number of independent samples they are worth; NaN with infinite ones.
    """

    value: float
    standard_error: float
    count: int
    effective_count: float


def mean_with_error(samples: ArrayLike) -> Mean:
    """Mean of successive samples, with an error that allows for their correlation.

    Successive frames of a pile are not independent, so the naive error s/√n is too small. It is
    widened by the square root of the integrated correlation time, summed up to where pairs of
    correlations turn negative. From some 20 samples that time is itself known only to tens of per
    cent and rather too short: read the error as a lower bound for slow drifts.

    Args:
        samples: (n,), in time order; NaN are left out.

    Source:
        Geyer, Statistical Science 7 (1992) 473 (initial positive sequence).
    """
    values = np.asarray(samples, dtype=np.float64)
    values = values[~np.isnan(values)]
    count = len(values)
    if count == 0:
        nan = float("nan")
        return Mean(value=nan, standard_error=nan, count=0, effective_count=0.0)
    infinite = values[np.isinf(values)]
    if len(infinite):
        # E.g. the unbalanced force over no contact force, while everything is still in the air.
        one_sign = bool((infinite == infinite[0]).all())
        mean = float(infinite[0]) if one_sign else float("nan")
        return Mean(value=mean, standard_error=float("nan"), count=count, effective_count=float("nan"))
    mean = float(values.mean())
    if count == 1:
        return Mean(value=mean, standard_error=float("nan"), count=1, effective_count=1.0)
    effective = count / min(max(_correlation_time(values - mean), 1.0), count)
    error = float(np.sqrt(values.var(ddof=1) / effective))
    return Mean(value=mean, standard_error=error, count=count, effective_count=effective)


def _correlation_time(deviations: NDArray[np.float64]) -> float:
    """Integrated correlation time in samples; 1 if they are independent."""
    count = len(deviations)
    covariance = np.correlate(deviations, deviations, mode="full")[count - 1 :]
    if covariance[0] <= 0:
        return 1.0
    correlation = covariance / covariance[0]
    pairs = correlation[: count // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.nonzero(pairs <= 0)[0]
    last = int(negative[0]) if len(negative) else len(pairs)
    return float(2 * pairs[:last].sum() - 1)
