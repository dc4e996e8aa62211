"""Means of correlated samples and their errors."""

import numpy as np
import pytest

from postprocess import mean_with_error


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
