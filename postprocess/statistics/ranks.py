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
    """A value with its 95 % interval, which need not lie about it evenly.

    Attributes:
        value: That of the data.
        low: Lower end; NaN where blocks are too few to tell.
        high: Upper end, likewise.
    """

    value: float
    low: float
    high: float

    @property
    def clear(self) -> bool:
        """Whether 0 is outside."""
        return self.low > 0 or self.high < 0


def rank_correlations(x: Floats, y: Floats, strata: Whole) -> Floats:
    """Spearman's rank correlations with y, of ranks taken within strata, over all of them together.

    Args:
        x: (n, m), finite: each column is correlated with y.
        y: (n,), finite.
        strata: (n,) which stratum each row belongs to; all the same for Spearman's own.

    Returns:
        (m,) from -1 to 1; NaN where a column or y is the same throughout every stratum.

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
    """(n, m) ranks of columns within each stratum about their mean, over its number of rows plus one; ties share."""
    found = np.empty(values.shape)
    for stratum in np.unique(strata):
        inside = strata == stratum
        found[inside] = rankdata(values[inside], axis=0) / (int(inside.sum()) + 1) - 0.5
    return found


def correlation_within(x: Sequence[float], y: Sequence[float], blocks: Sequence[Hashable]) -> SeedMean:
    """Spearman's rank correlation of y with x within blocks, each of which has its own level: the mean over them.

    A rank does not mind a value of which only a lower bound is known, as long as all others are below, nor one that
    is far above them; a mean or a slope is carried away by either.

    Args:
        x: One per point.
        y: One per point; `inf` for what is known to be above all others; points with NaN are left out.
        blocks: Block of each point, such as the pile that points began with.

    Returns:
        Mean over the blocks in which both x and y vary, and its error by their scatter. Without an error where these
        are fewer than six: by chance alone five coins show the same side more often than one time in twenty.

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
    # Without what rounding leaves of none, which would be told as a number.
    return round(float(rank_correlations(part[:, :1], part[:, 1], one)[0]), 12)


def common_slopes(x: Floats, y: Floats, strata: Whole) -> Floats:
    """Least-squares slopes of y against each column of x, the same in all strata, each of which has its own level.

    Args:
        x: (n, m).
        y: (n,).
        strata: (n,) which stratum each row belongs to.

    Returns:
        (m,) in units of y over those of x; NaN where a column is the same throughout every stratum.
    """
    values = np.column_stack([x, y])
    _, place = np.unique(strata, return_inverse=True)
    means = np.zeros((int(place.max()) + 1, values.shape[1]))
    np.add.at(means, place, values)
    values = values - (means / np.bincount(place)[:, None])[place]
    squares = np.einsum("nm,nm->m", values[:, :-1], values[:, :-1])
    known = squares > _NONE * np.einsum("nm,nm->m", x, x)
    return np.where(known, values[:, :-1].T @ values[:, -1] / np.where(known, squares, 1), np.nan)


def resamples(blocks: Whole, strata: Whole, *, count: int, seed: int) -> Iterator[Whole]:
    """Rows of tables of the same kind: of each stratum as many blocks as it has, drawn with replacement.

    Args:
        blocks: (n,) block of each row; a block lies in one stratum.
        strata: (n,) its stratum.
        count: How many tables.
        seed: Of the draw: the same seed gives the same tables.

    Yields:
        Indices of rows.
    """
    random = np.random.default_rng(seed)
    rows = {block: np.nonzero(blocks == block)[0] for block in np.unique(blocks)}
    inside = [np.unique(blocks[strata == stratum]) for stratum in np.unique(strata)]
    for _ in range(count):
        drawn = np.concatenate([random.choice(own, len(own)) for own in inside])
        yield np.concatenate([rows[block] for block in drawn])


def interval(value: float, drawn: Sequence[float]) -> Interval:
    """The 95 % interval by the percentiles of what resamples gave; NaN where one of ten has no value."""
    known = np.asarray(drawn, dtype=np.float64)
    known = known[np.isfinite(known)]
    if len(known) < 0.9 * len(drawn) or not len(known):
        return Interval(value=value, low=math.nan, high=math.nan)
    low, high = np.quantile(known, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(value=value, low=float(low), high=float(high))


def few_blocks(blocks: Whole, strata: Whole, *, least: int = 3) -> bool:
    """Whether any stratum has too few blocks for resampling to tell an error."""
    return any(len(np.unique(blocks[strata == stratum])) < least for stratum in np.unique(strata))


def resampled(measures: Callable[[Whole], Floats], blocks: Whole, strata: Whole, *, count: int, seed: int) -> Floats:
    """(count, m) values that measures take of resamples.

    Args:
        measures: (m,) values of a table of some rows.
        blocks: See `resamples`.
        strata: See `resamples`.
        count: See `resamples`.
        seed: See `resamples`.
    """
    return np.array([measures(rows) for rows in resamples(blocks, strata, count=count, seed=seed)])
