"""Verdicts on effects, and how many runs those would take that are not resolved."""

import math

import numpy as np
import pytest

from postprocess.statistics.seeds import SeedMean, mean_over_seeds
from studies.framework.findings import Finding, Judged, Outcome, Verdict, judge, more_runs


def effect(value: float, scatter: float, count: int) -> SeedMean:
    """Runs of exactly this mean and standard deviation."""
    shape = np.resize([-1.0, 1.0], count)
    shape -= shape.mean()
    return mean_over_seeds(value + scatter * shape / shape.std(ddof=1))


@pytest.mark.parametrize(("value", "verdict"), [(3.0, "found"), (-3.0, "not found"), (0.5, "not resolved")])
def test_verdict_by_the_interval(value: float, verdict: str) -> None:
    assert judge(effect(value, 1.0, 8)) == verdict


def test_the_runs_that_are_needed_do_resolve_the_effect_and_one_fewer_does_not() -> None:
    needed = round(8 * more_runs(effect(0.5, 1.0, 8)))
    # Known answer: t(17) 2.110 / sqrt(18) = 0.497 < 0.5 < t(16) 2.120 / sqrt(17) = 0.514.
    assert needed == 18
    assert judge(effect(0.5, 1.0, needed)) == "found"
    assert judge(effect(0.5, 1.0, needed - 1)) == "not resolved"


def test_the_size_is_counted_from_the_threshold() -> None:
    above, shifted = more_runs(effect(0.5, 1.0, 8)), more_runs(effect(1.5, 1.0, 8), threshold=1.0)
    assert above == shifted == more_runs(effect(0.5, 1.0, 8), threshold=1.0)


def test_no_effect_takes_runs_without_end_and_one_run_gives_no_number() -> None:
    nothing, alone = more_runs(effect(0.0, 1.0, 8)), more_runs(mean_over_seeds([0.5]))
    assert math.isinf(nothing)
    assert math.isnan(alone)
    finding = Finding(id="a", says="a", outcome=lambda _: Outcome())
    texts = [
        Judged(finding=finding, ours="", verdict=Verdict.NOT_RESOLVED, more=more).needed for more in (nothing, alone)
    ]
    assert texts == ["an effect of this size would take more than 100 times as many runs", ""]
