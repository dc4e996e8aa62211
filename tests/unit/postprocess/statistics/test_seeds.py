"""Means with their errors, against printed tables, SciPy and repeated trials."""

import math

import numpy as np
import pytest
from scipy.stats import linregress, ttest_ind

from postprocess import mean_with_error
from postprocess.statistics.seeds import difference, mean_over_seeds, parabola, slope_within


def test_half_width_is_student_t():
    # t(0.975; 2) = 4.302653 and t(0.975; 1) = 12.706205, from printed tables.
    mean = mean_over_seeds([1.0, 2.0, 4.0])
    error = math.sqrt(((4 / 3) ** 2 + (1 / 3) ** 2 + (5 / 3) ** 2) / 2 / 3)
    assert (mean.value, mean.count) == (pytest.approx(7 / 3), 3)
    assert mean.standard_error == pytest.approx(error)
    assert mean.half_width == pytest.approx(4.302653 * error)
    assert mean_over_seeds([1.0, 3.0]).half_width == pytest.approx(12.706205)


def test_difference_is_welchs():
    first, second = [4.0, 5.0, 6.0], [1.0, 2.0, 3.0, 5.0]
    found = difference(mean_over_seeds(first), mean_over_seeds(second))
    interval = ttest_ind(first, second, equal_var=False).confidence_interval(0.95)
    assert found.value - found.half_width == pytest.approx(interval.low)
    assert found.value + found.half_width == pytest.approx(interval.high)
    assert found.value == pytest.approx(2.25)
    assert not found.clear


def test_slope_is_that_of_a_straight_line():
    x, y = [0.4, 0.5, 0.7, 0.9, 1.0], [1.0, 1.3, 1.2, 2.0, 1.9]
    found, expected = slope_within(x, y, ["all"] * 5), linregress(x, y)
    assert found.value == pytest.approx(expected.slope)
    assert found.standard_error == pytest.approx(expected.stderr)
    assert found.half_width == pytest.approx(3.182446 * expected.stderr)  # t(0.975; 3), from printed tables
    assert found.count == 5


def test_parabola_is_that_of_numpy():
    random = np.random.default_rng(2)
    x = np.repeat([0.4, 0.6, 0.7, 0.9, 1.1], 3)
    y = 3 * x - 2 * x**2 + 0.1 * random.standard_normal(15)
    found = parabola([*x, math.nan], [*y, 5.0], at=0.85)
    (bend, slope, _), spread = np.polyfit(x - 0.85, y, 2, cov=True)
    assert (found.slope.value, found.bend.value) == (pytest.approx(slope), pytest.approx(bend))
    assert found.slope.standard_error == pytest.approx(math.sqrt(spread[1, 1]))
    assert found.bend.standard_error == pytest.approx(math.sqrt(spread[0, 0]))
    assert found.slope.half_width == pytest.approx(2.178813 * found.slope.standard_error)  # t(0.975; 12), printed
    assert found.slope.count == 15
    assert found.top == pytest.approx(np.polynomial.Polynomial.fit(x, y, 2).deriv().roots()[0])


def test_mean_of_independent_samples():
    samples = np.random.default_rng(1).normal(3.0, 2.0, 4000)
    mean = mean_with_error(samples)
    assert mean.value == samples.mean()
    assert mean.standard_error == pytest.approx(2 / 4000**0.5, rel=0.15)
    assert mean.count == 4000


def test_error_allows_for_correlation():
    # AR(1) with a = 0.8: correlation time (1 + a) / (1 - a) = 9 samples.
    noise = np.random.default_rng(2).standard_normal(20000)
    samples = np.zeros(20000)
    for k in range(1, 20000):
        samples[k] = 0.8 * samples[k - 1] + noise[k]
    mean = mean_with_error(samples)
    assert mean.effective_count == pytest.approx(20000 / 9, rel=0.2)
    naive = samples.std(ddof=1) / 20000**0.5
    assert mean.standard_error == pytest.approx(3 * naive, rel=0.1)


@pytest.mark.parametrize(
    ("samples", "value"),
    [([1.0, np.inf, 2.0], np.inf), ([np.inf], np.inf), ([-np.inf, 1.0, np.nan], -np.inf), ([np.inf, -np.inf], np.nan)],
)
def test_infinite_samples_have_an_infinite_mean_without_an_error(samples, value):
    """Warnings are errors here: none may come of it."""
    mean = mean_with_error(samples)
    assert mean.value == pytest.approx(value, nan_ok=True)
    assert np.isnan(mean.standard_error)
    assert np.isnan(mean.effective_count)
    assert mean.count == np.count_nonzero(~np.isnan(samples))
