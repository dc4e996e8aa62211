"""Rank correlations and slopes within strata, and their errors by resampling whole blocks of runs.

Runs that share a history, such as those that stopped at different times on one trajectory, are no independent ones.
They make a block, and blocks are drawn, never single runs. What a study has set by itself, such as the aspect ratio, is
a stratum: each keeps as many blocks as it has.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from postprocess.statistics.seeds import CONFIDENCE, SeedMean, mean_over_seeds

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]

_NONE = 1e-12  # of a spread: what rounding leaves of none
_COINS = 6  # that show the same side in less than 5 % of all throws


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A value with its 95 % interval, perhaps uneven; NaN ends where blocks are too few."""

    value: float
    low: float
    high: float

    @property
    def clear(self) -> bool:
        """Whether 0 is outside."""
        return self.low > 0 or self.high < 0


def rank_correlations(x: Floats, y: Floats, strata: Whole) -> Floats:
    """Compute Spearman's correlations of the columns of x (n, m) with y (n,), ranked in strata (n,).

    Returns:
        (m,) from -1 to 1; NaN where a column or y is constant in every stratum.

    Example:
        >>> x, y = np.array([[1.0], [2], [3], [10], [20], [30]]), np.array([7.0, 8, 9, 1, 2, 3])
        >>> rank_correlations(x, y, np.array([0, 0, 0, 1, 1, 1]))
        array([1.])
    """
    ranks = ranks_within(np.column_stack([x, y]), strata)
    squares = np.einsum("nm,nm->m", ranks, ranks)
    spread = np.sqrt(squares[:-1] * squares[-1])
    known = spread > _NONE * len(ranks)
    return np.where(known, np.clip(ranks[:, :-1].T @ ranks[:, -1] / np.where(known, spread, 1), -1, 1), np.nan)


def ranks_within(values: Floats, strata: Whole) -> Floats:
    """Rank columns (n, m) within strata, about the mean, over their rows plus one; ties share."""
    found = np.empty(values.shape)
    for stratum in np.unique(strata):
        inside = strata == stratum
        found[inside] = rankdata(values[inside], axis=0) / (int(inside.sum()) + 1) - 0.5
    return found


def correlation_within(x: Sequence[float], y: Sequence[float], blocks: Sequence[Hashable]) -> SeedMean:
    """Average Spearman's rank correlation of y with x over blocks in which both vary, such as piles.

    A rank does not mind a value of which only a lower bound is known, as long as all others are below: such a y is
    `inf`. Points with NaN are left out. The error is by the scatter over blocks; there is none where these are fewer
    than six: by chance alone five coins show the same side more often than one time in twenty.

    Example:
        >>> f'{correlation_within([1, 2, 1, 2], [5, 7, 1, math.inf], ["a", "a", "b", "b"]).value:.3f}'
        '1.000'
    """
    parts: dict[Hashable, list[tuple[float, float]]] = {}
    for across, up, block in zip(x, y, blocks, strict=True):
        if not (math.isnan(across) or math.isnan(up)):
            parts.setdefault(block, []).append((across, up))
    each = [_correlation(np.array(part, dtype=np.float64)) for part in parts.values()]
    mean = mean_over_seeds([one for one in each if math.isfinite(one)])
    return mean if mean.count >= _COINS else replace(mean, standard_error=math.nan, half_width=math.nan)


def _correlation(part: Floats) -> float:
    one = np.zeros(len(part), dtype=np.int64)
    # Without what rounding leaves of none, which would be printed as a number.
    return round(float(rank_correlations(part[:, :1], part[:, 1], one)[0]), 12)


def common_slopes(x: Floats, y: Floats, strata: Whole) -> Floats:
    """Fit slopes (m,) of y (n,) against columns of x (n, m), common to strata with own levels.

    NaN where a column is constant in every stratum.
    """
    values = np.column_stack([x, y])
    for stratum in np.unique(strata):
        values[strata == stratum] -= values[strata == stratum].mean(axis=0)
    squares = np.einsum("nm,nm->m", values[:, :-1], values[:, :-1])
    known = squares > _NONE * np.einsum("nm,nm->m", x, x)
    return np.where(known, values[:, :-1].T @ values[:, -1] / np.where(known, squares, 1), np.nan)


def resamples(blocks: Whole, strata: Whole, *, count: int, seed: int) -> Iterator[Whole]:
    """Draw rows of tables: of each stratum as many blocks as it has, with replacement.

    Blocks and strata (n,) are those of each row; a block lies in one stratum.
    """
    random = np.random.default_rng(seed)
    rows = {block: np.nonzero(blocks == block)[0] for block in np.unique(blocks)}
    inside = [np.unique(blocks[strata == stratum]) for stratum in np.unique(strata)]
    for _ in range(count):
        drawn = np.concatenate([random.choice(own, len(own)) for own in inside])
        yield np.concatenate([rows[block] for block in drawn])


def interval(value: float, drawn: Sequence[float]) -> Interval:
    """Take the 95 % interval from percentiles of resamples; NaN where one of ten has no value."""
    known = np.asarray(drawn, dtype=np.float64)
    known = known[np.isfinite(known)]
    if len(known) < 0.9 * len(drawn) or not len(known):
        return Interval(value=value, low=math.nan, high=math.nan)
    low, high = np.quantile(known, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(value=value, low=float(low), high=float(high))


def few_blocks(blocks: Whole, strata: Whole) -> bool:
    """Whether any stratum has too few blocks for resampling to give an error."""
    return any(len(np.unique(blocks[strata == stratum])) < 3 for stratum in np.unique(strata))


def resampled(measures: Callable[[Whole], Floats], blocks: Whole, strata: Whole, *, count: int, seed: int) -> Floats:
    """Compute the values (count, m) that `measures` takes of each table of `resamples`."""
    return np.array([measures(rows) for rows in resamples(blocks, strata, count=count, seed=seed)])
