"""The law in the size of piles: a law that made the values comes out again, and another one is rejected."""

import math

import numpy as np
import pandas as pd
import pytest

from postprocess.statistics.size_law import Floats, alike, profiles, scatter_of, size_law

SEEDS = {100: 9, 300: 9, 1000: 6, 3000: 3, 10_000: 3}
COUNTS = np.repeat(list(SEEDS), list(SEEDS.values())).astype(float)


def piles(bulk: float, slope: float, *, power: float = 1 / 3, seed: int = 1) -> Floats:
    """A quantity of every run, whose scatter falls as √N."""
    noise: Floats = 0.03 * np.random.default_rng(seed).normal(size=len(COUNTS)) * COUNTS**-0.5
    return bulk + slope * COUNTS**-power + noise


def test_the_law_that_made_the_runs_comes_out_again() -> None:
    law = size_law(COUNTS, piles(0.15, -0.12, seed=3))
    assert law.bulk == pytest.approx(0.15, abs=law.error(1, 0))
    assert law.slope == pytest.approx(-0.12, abs=law.error(0, 1))
    # Errors far below what is to be resolved.
    assert law.error(1, 0) < 0.002
    assert law.error(0, 1) < 0.02
    assert law.p_value > 0.05
    best, low, high = law.powers
    assert low < 1 / 3 < high
    assert low < best < high
    assert law.scatter.fall == pytest.approx(1.0, abs=0.3)
    bias = law.bias(270)
    assert bias.value == pytest.approx(-0.12 * 270 ** (-1 / 3), abs=bias.half_width)


def test_intervals_hold_what_they_are_to_hold() -> None:
    """95 % of them: in 150 trials within three standard deviations of that."""
    laws = [size_law(COUNTS, piles(0.15, -0.12, seed=seed)) for seed in range(150)]
    assert 0.897 < np.mean([abs(law.bulk - 0.15) <= law.error(1, 0) for law in laws])
    # As many laws are rejected as chance has it, no more.
    assert 0 < np.mean([law.p_value < 0.05 for law in laws]) < 0.103


@pytest.mark.parametrize("power", [0.1, 1.0])
def test_another_law_is_rejected(power: float) -> None:
    values = piles(0.15, -0.12 * 5 ** (3 * power - 1), power=power)
    law = size_law(COUNTS, values)
    assert law.p_value < 0.05
    assert law.excess > 3
    assert not law.powers[1] < 1 / 3 < law.powers[2]
    assert law.powers[1] <= power <= law.powers[2]
    # A law that is rejected has larger errors than the same scatter about the law itself.
    means = pd.Series(values).groupby(COUNTS).transform("mean").to_numpy()
    along = size_law(COUNTS, values - means + 0.15 - 0.12 * COUNTS ** (-1 / 3))
    assert law.scatter.variance == pytest.approx(along.scatter.variance)
    assert law.error(1, 0) == pytest.approx(math.sqrt(law.excess) * along.error(1, 0))


def test_scatter_is_independent_of_the_law() -> None:
    level, steep = scatter_of(COUNTS, piles(0.15, 0.0)), scatter_of(COUNTS, piles(0.15, -5.0))
    assert level.variance == pytest.approx(steep.variance)
    assert level.freedom == 25


def test_one_seed_of_each_size_has_no_error() -> None:
    counts = np.array([100.0, 300, 1000])
    law = size_law(counts, 0.15 - 0.12 * counts ** (-1 / 3))
    assert law.bulk == pytest.approx(0.15)
    assert math.isnan(law.error(1, 0))
    assert math.isnan(law.p_value)


RATIOS = (0.09, 0.10, 0.11, 0.12, 0.13)


def test_intervals_of_places_hold_them() -> None:
    """95 % or so, of so few runs: at least nine in ten, and none so wide as to hold everything."""
    random, held, wide = np.random.default_rng(2), [], []
    x = np.repeat(RATIOS, 6)
    for _ in range(60):
        spanned = (random.random(len(x)) < 1 / (1 + np.exp(-(x - 0.113) / 0.004))).astype(float)
        low, high = profiles(x, spanned, np.full(len(x), 1000))[1000].interval
        held.append(low <= 0.113 <= high)
        wide.append(high - low)
    assert np.mean(held) >= 0.9
    assert np.median(wide) < 0.02


def test_a_gap_is_the_interval_where_nothing_lies_within() -> None:
    x = np.repeat([0.10, 0.11, 0.12], 9)
    one = profiles(x, (x > 0.105).astype(float), np.full(len(x), 300))[300]
    assert one.best == pytest.approx(0.105, abs=1e-3)
    low, high = one.interval
    assert 0.098 < low <= 0.1005
    assert 0.1095 <= high < 0.112


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_where_all_runs_are_alike_no_place_is_known(level: float) -> None:
    x = np.repeat(RATIOS, 3)
    one = profiles(x, np.full(len(x), level), np.full(len(x), 300))[300]
    assert not one.known
    assert math.isnan(one.best)
    assert math.isinf(one.interval[1] if level == 0 else one.interval[0])
    assert math.isnan(alike([one, one]))


def test_chance_moves_places_no_more_often_than_it_says() -> None:
    """p below 0.05 in one of twenty, by a law of large numbers that so few runs do not quite reach."""
    random, x = np.random.default_rng(4), np.tile(np.repeat(RATIOS, 6), 3)
    sizes = np.repeat([300, 1000, 3000], len(x) // 3)
    chances = []
    for _ in range(40):
        spanned = (random.random(len(x)) < 1 / (1 + np.exp(-(x - 0.11) / 0.005))).astype(float)
        chances.append(alike(profiles(x, spanned, sizes).values()))
    assert np.mean(np.array(chances) < 0.05) < 0.13
    moved = (random.random(len(x)) < 1 / (1 + np.exp(-(x - 0.1 - 1e-5 * sizes) / 0.002))).astype(float)
    assert alike(profiles(x, moved, sizes).values()) < 1e-3
