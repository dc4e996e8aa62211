"""The study of long shaking: laws that are known come out again, and nothing is said of noise."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from studies.framework.provenance import SHAKE_TIME
from studies.framework.runs import MeasuredRun
from studies.friction import compaction_figures
from studies.friction.compaction import LAW, MISSED, RESIDUAL, TIMES, answers, at, fitted, over_time
from studies.friction.laws import LAWS, LOGARITHMIC, STRETCHED, Fit, fit, spread_out
from studies.friction.measure import FRICTION

NOISE = 2e-3  # of φ in a pile of 270 that is shaken, from sample to sample
TRUE = {law: Fit(law=law, begin=0.11, end=0.17, tau=4.0, power=0.5, residual=0.0) for law in LAWS}


def shaken(
    law: str, *, seed: int, friction: float = 0.4, seconds: float = 200.0, noise: float = NOISE, **other: float
) -> MeasuredRun:
    """A run whose φ follows a law for so long."""
    times = np.arange(1, round(seconds / 0.02) + 1) * 0.02
    known = Fit(**{**vars(TRUE[law]), **other})
    packing = known.at(times) + np.random.default_rng(seed).normal(0, noise, len(times))
    history = {"time [s]": times, "phi [-]": packing, "shaken [s]": np.array([seconds])}
    manifest: Any = SimpleNamespace(directory=Path("run"))
    return MeasuredRun(manifest=manifest, rows=[{FRICTION: friction, "seed": seed}], history=history)


def piles(law: str, **other: float) -> list[MeasuredRun]:
    return [shaken(law, seed=seed, **other) for seed in range(1, 9)]


@pytest.mark.parametrize("law", LAWS)
def test_a_fit_finds_the_parameters_of_its_own_law(law: str) -> None:
    times = np.geomspace(0.1, 200, 40)
    found = fit(law, times, TRUE[law].at(times))
    known = [TRUE[law].begin, TRUE[law].end, TRUE[law].tau, TRUE[law].power]
    # Without noise: as near as least squares stop, relative 1e-8 of a cost that is flat in the parameters.
    np.testing.assert_allclose([found.begin, found.end, found.tau, found.power], known, rtol=1e-3)
    assert found.residual < 1e-7


@pytest.mark.parametrize(("law", "answer"), [(STRETCHED, "yes"), (LOGARITHMIC, "no")])
def test_the_law_that_made_the_histories_is_the_one_that_leaves_less(law: str, answer: str) -> None:
    runs = piles(law)
    asked = answers(over_time(runs), fitted(runs))
    assert asked[2].answer == answer, asked[2].evidence
    assert asked[3].answer == answer, asked[3].evidence


def test_of_noise_about_a_constant_nothing_is_said() -> None:
    runs = piles(STRETCHED, begin=0.15, end=0.15)
    asked = answers(over_time(runs), fitted(runs))
    # φ after 20 s and 200 s, and between 100 and 200 s: by chance one of twenty is beyond 95 %; seeds are fixed.
    assert [one.answer for one in asked[:2]] == ["undetermined", "undetermined"]


def test_growth_is_that_of_the_law() -> None:
    runs = piles(LOGARITHMIC, noise=0.0)
    times = over_time(runs)
    for time in (SHAKE_TIME, TIMES[-1]):
        inside = np.arange(round(0.8 * time / 0.02) + 1, round(time / 0.02) + 1) * 0.02
        np.testing.assert_allclose(times[at(time)], TRUE[LOGARITHMIC].at(inside).mean(), rtol=1e-9)
    asked = answers(times, fitted(runs))
    assert [one.answer for one in asked[:2]] == ["yes", "yes"]


def test_times_beyond_the_end_of_a_run_are_not_told() -> None:
    times = over_time([shaken(STRETCHED, seed=1, seconds=10.0)])
    assert times[at(10.0)].notna().all()
    assert times[[at(20.0), at(200.0)]].isna().all(axis=None)
    asked = answers(times, fitted([shaken(STRETCHED, seed=1, seconds=10.0)]))
    assert asked[0].answer == "undetermined"


def test_intervals_on_a_logarithmic_axis_hold_every_sample_once() -> None:
    times = np.arange(1, 10_001) * 0.02
    centres, means = spread_out(times, times, first=0.02, count=30)
    assert (np.diff(centres) > 0).all()
    edges = np.geomspace(0.02, times[-1], 31)
    assert ((means >= edges[0]) & (means <= edges[-1] * (1 + 1e-6))).all()
    # A constant stays one, however many samples an interval has.
    np.testing.assert_allclose(spread_out(times, np.full(len(times), 0.3), first=0.02, count=30)[1], 0.3)


def test_tables_have_a_row_per_run_and_law() -> None:
    runs = [*piles(STRETCHED), *(shaken(STRETCHED, seed=s, friction=0.65) for s in (1, 2))]
    laws = fitted(runs)
    assert len(laws) == 20
    assert set(laws[LAW]) == set(LAWS)
    assert np.isfinite(laws[[RESIDUAL, MISSED]]).all(axis=None)
    assert isinstance(laws, pd.DataFrame)


def test_the_figure_has_both_laws_for_each_friction(tmp_path: Path) -> None:
    runs = [*piles(STRETCHED), *(shaken(STRETCHED, seed=s, friction=0.65) for s in (1, 2))]
    drawn = compaction_figures.draw(tmp_path, runs=runs, footer=["Study toy: 2 of 2 runs.", "More: toy.md."])
    assert {path.suffix for path in drawn} >= {".png"}
