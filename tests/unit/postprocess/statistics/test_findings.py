"""Verdicts on effects, and how many runs those would take that are not resolved."""

import math

import numpy as np
import pytest

from postprocess.statistics.findings import Unresolved, judge, more_runs_text
from postprocess.statistics.seeds import SeedMean, mean_over_seeds


def effect(value: float, scatter: float, count: int) -> SeedMean:
    """Runs of exactly this mean and standard deviation."""
    shape = np.resize([-1.0, 1.0], count)
    shape -= shape.mean()
    return mean_over_seeds(value + scatter * shape / shape.std(ddof=1))


@pytest.mark.parametrize(("value", "verdict"), [(3.0, "found"), (-3.0, "not found"), (0.5, "not resolved")])
def test_verdict_by_the_interval(value: float, verdict: str) -> None:
    assert judge(effect(value, 1.0, 8)) == verdict


def test_the_runs_that_are_needed_do_resolve_the_effect_and_one_fewer_does_not() -> None:
    verdict = judge(effect(0.5, 1.0, 8))
    assert isinstance(verdict, Unresolved)
    needed = round(8 * verdict.more)
    # Known answer: t(17) 2.110 / sqrt(18) = 0.497 < 0.5 < t(16) 2.120 / sqrt(17) = 0.514.
    assert needed == 18
    assert judge(effect(0.5, 1.0, needed)) == "found"
    assert judge(effect(0.5, 1.0, needed - 1)) == "not resolved"


def test_the_size_is_counted_from_the_threshold() -> None:
    above, shifted = judge(effect(0.5, 1.0, 8)), judge(effect(1.5, 1.0, 8), threshold=1.0)
    below = judge(effect(0.5, 1.0, 8), threshold=1.0)
    assert isinstance(above, Unresolved)
    assert isinstance(shifted, Unresolved)
    assert isinstance(below, Unresolved)
    assert above.more == shifted.more == below.more


def test_no_effect_takes_runs_without_end_and_one_run_gives_no_number() -> None:
    nothing, alone = judge(effect(0.0, 1.0, 8)), judge(mean_over_seeds([0.5]))
    assert isinstance(nothing, Unresolved)
    assert isinstance(alone, Unresolved)
    assert math.isinf(nothing.more)
    assert more_runs_text(nothing) == "an effect of this size would take more than 100 times as many runs"
    assert math.isnan(alone.more)
    assert more_runs_text(alone) == more_runs_text("found") == more_runs_text("not resolved") == ""
