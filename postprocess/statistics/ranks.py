"""Compute rank correlations and slopes within strata, with errors from resampling of blocks.

Runs with a common history, such as several stops on one trajectory, are not independent. They form a block, and
resampling (the bootstrap) draws whole blocks. Runs that agree in a factor set by the study, such as the aspect ratio,
form a stratum; a resample has as many blocks of each stratum as the data.
"""

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from postprocess.statistics.seeds import CONFIDENCE, SeedMean, mean_over_seeds

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]

_NONE = 1e-12  # relative spread below which values are equal within rounding
_COINS = 6  # least number of fair coins that all show one side in less than 5 % of all throws


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A value with its 95 % interval, which may be asymmetric."""

    value: float
    low: float  #: Lower end of the interval; NaN if there are too few blocks
    high: float  #: Upper end of the interval; NaN if there are too few blocks


def rank_correlations(x: Floats, y: Floats, strata: Whole) -> Floats:
    """Compute Spearman's rank correlation of each column of x (n, m) with y (n,), within strata (n,).

    Returns (m,) values. A correlation is NaN if its column, or y, is constant in every stratum.
    """
    ranks = ranks_within(np.column_stack([x, y]), strata)
    squares = np.einsum("nm,nm->m", ranks, ranks)
    spread = np.sqrt(squares[:-1] * squares[-1])
    known = spread > _NONE * len(ranks)
    return np.where(known, np.clip(ranks[:, :-1].T @ ranks[:, -1] / np.where(known, spread, 1), -1, 1), np.nan)


def ranks_within(values: Floats, strata: Whole) -> Floats:
    """Return the ranks of each column of `values` (n, m) within strata (n,), between -1/2 and 1/2: (n, m).

    It is the rank over (number of rows of the stratum + 1), less 1/2. Equal values get the mean of their ranks.
    """
    found = np.empty(values.shape)
    for stratum in np.unique(strata):
        inside = strata == stratum
        found[inside] = rankdata(values[inside], axis=0) / (int(inside.sum()) + 1) - 0.5
    return found


def correlation_within(x: Sequence[float], y: Sequence[float], blocks: Sequence[Hashable]) -> SeedMean:
    """Average Spearman's rank correlation of y (n,) with x (n,) over blocks (n,) in which both vary.

    A y that is only known to exceed a bound must be given as `inf`, which has the highest rank. Points with NaN are
    left out. The standard error follows from the scatter over blocks. It is NaN for fewer than six blocks, because five
    correlations all have the same sign by chance in more than 5 % of all cases.
    """
    parts: dict[Hashable, list[tuple[float, float]]] = {}
    for across, up, block in zip(x, y, blocks, strict=True):
        if not (math.isnan(across) or math.isnan(up)):
            parts.setdefault(block, []).append((across, up))
    arrays = (np.array(part, dtype=np.float64) for part in parts.values())
    each = (rank_correlations(part[:, :1], part[:, 1], np.zeros(len(part), dtype=np.int64)) for part in arrays)
    # Rounded, so that a correlation of 0 is not printed as 1e-17.
    mean = mean_over_seeds([round(float(one[0]), 12) for one in each])
    return mean if mean.count >= _COINS else replace(mean, standard_error=math.nan, half_width=math.nan)


def common_slopes(x: Floats, y: Floats, strata: Whole) -> Floats:
    """Fit the slope of y (n,) against each column of x (n, m), with one intercept per stratum (n,): (m,).

    A slope is NaN if its column is constant in every stratum.
    """
    values = np.column_stack([x, y])
    for stratum in np.unique(strata):
        values[strata == stratum] -= values[strata == stratum].mean(axis=0)
    squares = np.einsum("nm,nm->m", values[:, :-1], values[:, :-1])
    known = squares > _NONE * np.einsum("nm,nm->m", x, x)
    return np.where(known, values[:, :-1].T @ values[:, -1] / np.where(known, squares, 1), np.nan)


def interval(value: float, drawn: Sequence[float]) -> Interval:
    """Return a value with its 95 % interval, by percentiles of the resampled values `drawn`.

    If more than a tenth of the resampled values are not finite, the interval is NaN.
    """
    known = np.asarray(drawn, dtype=np.float64)
    known = known[np.isfinite(known)]
    if len(known) < 0.9 * len(drawn) or not len(known):
        return Interval(value=value, low=math.nan, high=math.nan)
    low, high = np.quantile(known, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(value=value, low=float(low), high=float(high))


def few_blocks(blocks: Whole, strata: Whole) -> bool:
    """Return whether a stratum (n,) has fewer than three blocks (n,), too few for an error by resampling."""
    return any(len(np.unique(blocks[strata == stratum])) < 3 for stratum in np.unique(strata))


def resampled(measures: Callable[[Whole], Floats], blocks: Whole, strata: Whole, *, count: int, seed: int) -> Floats:
    """Return the m values of `measures` for each of `count` bootstrap resamples of a table, (count, m).

    A resample has as many blocks of each stratum as the table, drawn with replacement. `measures` takes the indices of
    the rows of a resample and returns values (m,). `blocks` (n,) and `strata` (n,) are those of each row; a block lies
    in one stratum. `seed` is that of the random numbers.
    """
    random = np.random.default_rng(seed)
    rows = {block: np.nonzero(blocks == block)[0] for block in np.unique(blocks)}
    inside = [np.unique(blocks[strata == stratum]) for stratum in np.unique(strata)]
    found = []
    for _ in range(count):
        drawn = np.concatenate([random.choice(own, len(own)) for own in inside])
        found.append(measures(np.concatenate([rows[block] for block in drawn])))
    return np.array(found)
