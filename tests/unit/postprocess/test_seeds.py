"""Means over seeds and their differences, against printed tables and repeated trials."""

import math

import numpy as np
import pytest
from scipy.stats import ttest_ind

from postprocess.seeds import Difference, difference, mean_over_seeds


def test_half_width_is_student_t():
    # t(0.975; 2) = 4.302653 and t(0.975; 1) = 12.706205, from printed tables.
    mean = mean_over_seeds([1.0, 2.0, 4.0])
    error = math.sqrt(((4 / 3) ** 2 + (1 / 3) ** 2 + (5 / 3) ** 2) / 2 / 3)
    assert (mean.value, mean.count) == (pytest.approx(7 / 3), 3)
    assert mean.standard_error == pytest.approx(error)
    assert mean.half_width == pytest.approx(4.302653 * error)
    assert mean_over_seeds([1.0, 3.0]).half_width == pytest.approx(12.706205)


def test_half_width_covers_the_truth_as_often_as_it_says():
    random = np.random.default_rng(5)
    means = [mean_over_seeds(random.normal(1.0, 0.1, 3)) for _ in range(2000)]
    covered = np.mean([abs(mean.value - 1.0) < mean.half_width for mean in means])
    # Standard error of the share: 0.005. The normal distribution's 1.96 would cover 0.81.
    assert covered == pytest.approx(0.95, abs=0.015)


def test_one_seed_has_no_error_and_none_has_no_mean():
    alone = mean_over_seeds([0.1, math.nan])
    assert (alone.value, alone.count) == (0.1, 1)
    assert math.isnan(alone.standard_error)
    assert math.isnan(alone.half_width)
    assert math.isnan(mean_over_seeds([]).value)


def test_difference_is_welchs():
    first, second = [4.0, 5.0, 6.0], [1.0, 2.0, 3.0, 5.0]
    found = difference(mean_over_seeds(first), mean_over_seeds(second))
    interval = ttest_ind(first, second, equal_var=False).confidence_interval(0.95)
    assert found.value - found.half_width == pytest.approx(interval.low)
    assert found.value + found.half_width == pytest.approx(interval.high)
    assert found.value == pytest.approx(2.25)
    assert not found.clear


def test_difference_covers_the_truth_as_often_as_it_says():
    """With spreads that differ by a factor of ten, where the pooled test of Student fails."""
    random = np.random.default_rng(8)
    inside = 0
    for _ in range(2000):
        narrow, wide = random.normal(1.0, 0.01, 6), random.normal(0.7, 0.1, 3)
        found = difference(mean_over_seeds(wide), mean_over_seeds(narrow))
        inside += abs(found.value - -0.3) < found.half_width
    assert inside / 2000 == pytest.approx(0.95, abs=0.02)


def test_difference_without_errors_is_never_clear():
    alone, pair = mean_over_seeds([2.0]), mean_over_seeds([1.0, 1.1])
    found = difference(alone, pair)
    assert found.value == pytest.approx(0.95)
    assert math.isnan(found.half_width)
    assert not found.clear
    assert math.isnan(difference(mean_over_seeds([]), pair).value)


def test_equal_values_differ_by_nothing():
    same = mean_over_seeds([2.0, 2.0, 2.0])
    assert difference(same, same) == Difference(value=0.0, half_width=0.0)
    assert not difference(same, same).clear
    assert difference(mean_over_seeds([3.0, 3.0]), same).clear
