"""The study of collapse: columns whose collapse time is known, laws that hold and that do not, and bounds."""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np
import pandas as pd
import pytest
from synthetic.columns import H0, WITH_WALL, Column, F, write_column

from dem.record.run import Run, open_run
from postprocess.measures.collapse import COM, CORE, HEIGHTS, REMAINING, column_history, period_means, vibration
from postprocess.statistics.points import ASPECT, SEED
from studies.collapse import (
    ACTIVATION,
    AT_LEAST,
    CENSORED,
    DEFINITION,
    DELTA,
    GAMMA,
    LOG,
    TIME,
    USED,
    activations,
    measure,
    times,
)


def tau(delta: float, gamma: float) -> float:
    return math.exp(delta / gamma) / F


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return open_run(write_column(tmp_path_factory.mktemp("one") / "run", Column(tau=0.8, beta=0.8)))


def test_each_height_is_one_before_and_falls_as_it_was_made_to(one: Run) -> None:
    shaken = vibration(one)
    assert (shaken.acceleration, shaken.frequency, shaken.phase.index) == (2.5, F, 4)
    before = {REMAINING: 1.0, COM: H0, CORE: H0}
    for definition in HEIGHTS:
        history = column_history(one, definition, shaken)
        assert history.before == pytest.approx(before[definition])
        assert history.heights[history.times < 0] == pytest.approx(1)
        end = np.exp(-((3 / 0.8) ** 0.8)) if definition == REMAINING else 0.4
        assert history.heights[-1] == pytest.approx(end, abs=0.02)


def test_each_definition_gives_its_own_time(one: Run) -> None:
    rows = pd.DataFrame(measure(one)).set_index(DEFINITION)
    # Whole smarticles leave, of 50, and frames are 0.1 s apart.
    assert rows[TIME].tolist() == pytest.approx([0.8, 0.4, 0.4], rel=0.02)
    first = rows.loc[REMAINING]
    assert first[LOG] == pytest.approx(math.log(F * first[TIME]))
    assert first[DELTA] == pytest.approx(2.5 * first[LOG])
    assert first["com height before vibration [m]"] == pytest.approx(H0)
    assert first["com height with the wall [m]"] == pytest.approx(WITH_WALL * H0)
    assert first["within the radius before vibration [-]"] == 1


def test_a_mean_over_a_period_does_not_see_the_bouncing_within() -> None:
    at = np.arange(-40, 400) * 0.005
    middles, means = period_means(at, np.where(at > 0, 1 + np.sin(2 * np.pi * F * at), 7.0), F)
    assert len(middles) == math.ceil(399 * 0.005 * F)
    assert np.abs(means - 1).max() < 0.2  # 6 or 7 samples of a period
    assert abs(means.mean() - 1) < 0.01


def rows_of(
    seeds_of: Mapping[tuple[float, float], Sequence[float]], *, bounds: Collection[tuple[float, float, int]] = ()
) -> pd.DataFrame:
    """Rows of {(aspect, gamma): times of seeds}; keys in `bounds` did not collapse."""
    rows = []
    for (aspect, gamma), seeds in seeds_of.items():
        for seed, time in enumerate(seeds, 1):
            log = math.log(F * time)
            what = {ASPECT: aspect, GAMMA: gamma, SEED: seed, LOG: log, DELTA: gamma * log}
            what[TIME] = math.nan if (aspect, gamma, seed) in bounds else time
            rows += [{DEFINITION: name, **what} for name in HEIGHTS]
    return pd.DataFrame(rows)


def test_a_run_that_did_not_collapse_is_a_bound_and_never_dropped() -> None:
    seeds = {(0.4, gamma): [tau(factor * 9, gamma) for factor in (0.9, 1.0, 1.1)] for gamma in (2.0, 4.0)}
    seeds[0.4, 2.0] = [min(time, tau(9, 2.0)) for time in seeds[0.4, 2.0]]
    found = rows_of(seeds, bounds={(0.4, 2.0, 2), (0.4, 2.0, 3)})
    level = times(found).set_index([DEFINITION, GAMMA]).loc[(REMAINING, 2.0)]
    assert level[CENSORED] == 2
    assert level[DELTA] == pytest.approx(9 * (0.9 + 1 + 1) / 3)
    assert math.isnan(level["ln(f tau) SE [-]"])
    row = activations(found).iloc[0]
    # The one seed that collapsed at Γ = 2 is not taken for all: Δ is that of Γ = 4, beside the bound.
    assert (row[ACTIVATION], row[AT_LEAST]) == pytest.approx((9, 8.7))
    assert (row[CENSORED], row[USED]) == (2, "4")
