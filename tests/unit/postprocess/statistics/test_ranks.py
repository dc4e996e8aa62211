"""Rank correlations and slopes within strata, and intervals by drawing blocks: known answers."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import spearmanr

from postprocess.statistics.ranks import common_slopes, correlation_within, interval, rank_correlations, resampled
from postprocess.statistics.seeds import slope_within

Floats = NDArray[np.float64]


def one_stratum(count: int) -> NDArray[np.int64]:
    return np.zeros(count, dtype=np.int64)


def test_of_one_stratum_it_is_spearmans() -> None:
    random = np.random.default_rng(1)
    # With ties.
    x, y = random.integers(0, 6, (40, 3)).astype(float), random.normal(size=40)
    found = rank_correlations(x, y, one_stratum(40))
    assert found == pytest.approx([spearmanr(x[:, k], y).statistic for k in range(3)])


def test_what_lies_between_strata_does_not_count_within() -> None:
    """Rising within each stratum, falling from one to the next."""
    strata = np.repeat([0, 1, 2], 10)
    within = np.tile(np.arange(10.0), 3)
    x, y = within + 100.0 * strata, within**3 - 1e6 * strata
    assert rank_correlations(x[:, None], y, strata) == pytest.approx([1.0])
    assert rank_correlations(x[:, None], y, one_stratum(30))[0] < -0.7
    assert common_slopes(x[:, None], y, strata)[0] > 0 > common_slopes(x[:, None], y, one_stratum(30))[0]


def test_slopes_are_those_of_blocks_with_levels_of_their_own() -> None:
    random = np.random.default_rng(2)
    x, y, strata = random.normal(size=(30, 2)), random.normal(size=30), np.repeat([0, 1, 2], 10)
    wanted = [slope_within(x[:, k].tolist(), y.tolist(), strata.tolist()).value for k in range(2)]
    assert common_slopes(x, y, strata) == pytest.approx(wanted)


def widths(x: Floats, y: Floats, blocks: NDArray[np.int64]) -> tuple[float, float]:
    strata = one_stratum(len(y))
    drawn = resampled(lambda rows: rank_correlations(x[rows], y[rows], strata[rows]), blocks, strata, count=400, seed=5)
    found = interval(0.0, drawn[:, 0].tolist())
    return found.low, found.high


def test_the_interval_holds_the_true_correlation_as_often_as_it_says() -> None:
    random = np.random.default_rng(6)
    true = 6 / math.pi * math.asin(0.6 / 2)  # Spearman's of normal variables that correlate by 0.6
    held = 0
    for _ in range(40):
        x = random.normal(size=(60, 1))
        y = 0.6 * x[:, 0] + 0.8 * random.normal(size=60)
        low, high = widths(x, y, np.arange(60))
        held += low < true < high
    assert 34 <= held < 40


def test_copies_of_a_run_do_not_make_it_surer() -> None:
    random = np.random.default_rng(7)
    x = random.normal(size=(40, 1))
    y = 0.5 * x[:, 0] + random.normal(size=40)
    blocks = np.arange(40)
    low, high = widths(x, y, blocks)
    four = np.repeat(x, 4, axis=0), np.repeat(y, 4), np.repeat(blocks, 4)
    assert widths(*four) == pytest.approx((low, high), abs=0.03)
    naive = widths(four[0], four[1], np.arange(160))
    assert naive[1] - naive[0] < 0.65 * (high - low)


def test_within_blocks_it_is_the_mean_of_spearmans() -> None:
    random = np.random.default_rng(3)
    x, y = random.normal(size=(2, 8, 5))
    levels = 100 * random.normal(size=(8, 1))
    blocks = np.repeat(np.arange(8), 5).tolist()
    found = correlation_within(x.ravel().tolist(), (y + levels).ravel().tolist(), blocks)
    each = [spearmanr(*pair).statistic for pair in zip(x, y, strict=True)]
    assert found.value == pytest.approx(np.mean(each))
    assert found.standard_error == pytest.approx(np.std(each, ddof=1) / math.sqrt(8))
    # How far above the others one is does not matter, nor what is not known at all.
    y[:, 0] = 10
    before = correlation_within(x.ravel().tolist(), y.ravel().tolist(), blocks)
    y[:, 0] = math.inf
    assert correlation_within(x.ravel().tolist(), y.ravel().tolist(), blocks) == before
    more = correlation_within([*x.ravel(), 5.0], [*y.ravel(), math.nan], [*blocks, 0])
    assert more == before


@pytest.mark.parametrize(("count", "size"), [(8, 4), (18, 2), (6, 2)])
def test_of_nothing_it_is_clear_one_time_in_twenty(count: int, size: int) -> None:
    random = np.random.default_rng(5)
    blocks = np.repeat(np.arange(count), size).tolist()
    clear = 0
    for _ in range(400):
        x, y = random.normal(size=(2, count * size))
        found = correlation_within(x.tolist(), y.tolist(), blocks)
        clear += abs(found.value) > found.half_width
    # Mean of 20 and its standard deviation of 4.4; a rule without the half-width's t would have twice as many.
    assert clear < 20 + 3 * 4.4
