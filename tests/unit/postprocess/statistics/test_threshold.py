"""Places of thresholds: those put in come out again, and of runs that are all alike nothing is said."""

from __future__ import annotations

import math

import numpy as np
import pytest

from postprocess.statistics.threshold import alike, profiles

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
