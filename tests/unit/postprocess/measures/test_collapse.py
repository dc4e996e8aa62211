"""The collapse time of columns whose height is made up: known τ and β, none at all, or one that was not seen."""

import math

import numpy as np
import pytest

from postprocess.measures.collapse import collapse_time

START, END = 0.0072, 0.0011  # m


def heights(times, tau, beta, *, end=END, noise=0.0, seed=1, correlated=1):
    """A stretched exponential with noise that `correlated` successive samples share [share of the start]."""
    rng = np.random.default_rng(seed)
    shocks = rng.normal(size=len(times) // correlated + 1)
    curve = end + (START - end) * np.exp(-((times / tau) ** beta))
    return np.clip(curve + noise * START * np.repeat(shocks, correlated)[: len(times)], 0, None)


@pytest.mark.parametrize("tau", [0.1, 1.9])
@pytest.mark.parametrize("beta", [0.5, 1.8])
@pytest.mark.parametrize("known", [{"start": START, "end": END}, {"end": END}, {"start": START}, {}])
def test_a_curve_without_noise_gives_its_own_time(tau, beta, known):
    times = np.arange(1, 301) * 0.02
    found = collapse_time(times, heights(times, tau, beta), **known)
    assert found.outcome == "collapsed"
    assert found.time == pytest.approx(tau, rel=1e-3)
    assert found.exponent == pytest.approx(beta, rel=1e-3)
    assert (found.start, found.end) == pytest.approx((START, END), rel=5e-3)
    assert math.isnan(found.bound)


@pytest.mark.parametrize("correlated", [1, 5])
def test_errors_cover_the_truth(correlated):
    times = np.arange(1, 91) / 30
    pulls = []
    for seed in range(24):
        noisy = heights(times, 0.7, 0.8, end=0.0, noise=0.04, seed=seed, correlated=correlated)
        found = collapse_time(times, noisy, start=START, end=0.0)
        assert found.outcome == "collapsed"
        pulls.append((found.time - 0.7) / found.error)
    # Of 24 pulls of unit width the root mean square is within 1 ± 0.15; correlated residuals are known less well, and
    # errors without their correlation would make it 2.
    assert abs(np.mean(pulls)) < 0.4
    assert 0.7 < np.sqrt(np.mean(np.square(pulls))) < 1.45


def test_a_flat_curve_is_no_collapse():
    times = np.arange(1, 91) / 30
    for seed in range(8):
        rng = np.random.default_rng(seed)
        for level in (START * np.ones(90), START * (1 + 0.05 * rng.normal(size=90)), START * (1 + 0.02 * times)):
            for known in ({}, {"start": START, "end": 0.0}):
                found = collapse_time(times, level, **known)
                assert found.outcome == "standing"
                assert found.bound == pytest.approx(3.0)
                assert math.isnan(found.time)
                assert abs(found.fall) < 0.1


@pytest.mark.parametrize("tau", [4.0, 7.0])
def test_a_collapse_that_is_not_over_gives_a_bound(tau):
    # Watched for 3 s; a third and more of the way has been seen.
    times = np.arange(1, 91) / 30
    for seed in range(10):
        found = collapse_time(times, heights(times, tau, 1.0, end=0.0, noise=0.01, seed=seed), start=START, end=0.0)
        assert found.outcome == "collapsing"
        assert found.bound == pytest.approx(3.0)
        assert found.bound < tau
        assert math.isnan(found.time)
        assert math.isnan(found.error)


def test_a_collapse_faster_than_the_sampling_is_not_taken_for_a_slow_one():
    times = np.arange(1, 91) / 30
    found = collapse_time(times, heights(times, 0.005, 1.0, end=0.0), start=START, end=0.0)
    assert found.outcome == "collapsed"
    assert found.time < found.error == pytest.approx(1 / 30)
