"""The study of the landscape: runs with known forces and works, tables with a known order of measures, known costs."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun
from synthetic.hooked import UPPER, weight, write_hooked_run
from synthetic.shapes import W

from dem.record.run import open_run
from postprocess.measures.pull import WINDOW
from postprocess.statistics.points import ASPECT, SEED
from studies import landscape
from studies.framework.findings import Judged
from studies.framework.procedures import ACTIVE, CROSSINGS, EXTERNAL, INTERNAL, PHI, PROCEDURE, SHAPE, STATIC, THETA
from studies.landscape import (
    ABOVE,
    BEYOND,
    ENERGY,
    EVERY,
    FIRST,
    HELD_FAST,
    HIGH,
    LIFTS,
    LOW,
    PART,
    PEAK,
    PLANNED,
    PREDICTOR,
    PREDICTORS,
    RAISED,
    RHO,
    SCOPE,
    STRENGTH,
    STUDY,
    VERDICT,
    WITHIN,
    WORK,
    costs,
    measure,
    predicted,
    trajectories,
)

ACTIVITY = {EXTERNAL: "shake", SHAPE: "shape-change", INTERNAL: "internal-oscillation"}
APEX, BASE = 0.5, 0.4
RATIOS = (0.4, 0.7, 1.0)
TIMES = (0.5, 1.0, 2.0, 4.0)
THETAS = (5.0, 10.0, 20.0)


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(landscape, "RESAMPLES", 60)


def write(
    folder: Path, procedure: str, *, seed: int = 1, top: float = 0.5, time: float = 2.0, ratio: float = 0.7, **more: Any
) -> Path:
    """A run whose force is a triangle of a height over n W_s."""
    active = () if procedure == STATIC else (ACTIVITY[procedure], "relax")
    phases = ("deposit", "relax", *active, "pull-hook")
    keys: dict[str, Any] = {"phases": phases, "packing": (0.01,) * len(phases), "frames_per_phase": 2}
    run = SyntheticRun(**keys, seed=seed, aspect_ratio=ratio, shake_time=time, oscillate_time=time)
    total = run.count * weight(run)
    theta = "10" if procedure == INTERNAL else ""
    seconds = 0.0 if procedure == STATIC else time
    name = f"{procedure}{theta}_{seconds:g}s_lw{ratio:.2f}_seed{seed}"
    spent = None if procedure == STATIC else more.pop("spent", 1e-3 * time)
    return write_hooked_run(
        folder / name, run, lambda t: top * total * np.clip(1 - np.abs(t - APEX) / BASE, 0, None), spent=spent, **more
    )


def row_of(directory: Path) -> dict[str, Any]:
    return dict(measure(open_run(directory)))


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    row = row_of(write(tmp_path, INTERNAL, spent=6e-3))
    made = SyntheticRun(seed=1)
    above = float((made.shares() * made.height(0.01 * (1 - 0.002)) > UPPER).mean())
    assert row[PEAK] == pytest.approx(0.5 * (1 - WINDOW / BASE / 4), rel=1e-3)
    assert 0 < above < 1
    assert (row[ABOVE], row[BEYOND]) == (above, pytest.approx(row[PEAK] - above))
    assert row[RAISED] == pytest.approx(APEX * W, abs=0.005 * W)
    assert row[WORK] == pytest.approx(0.5 * BASE, rel=1e-3)
    assert row[ENERGY] == pytest.approx(6e-3 / made.count, rel=1e-6)
    assert row[LIFTS] == pytest.approx(6e-3 / made.count / weight(made) / W, rel=1e-6)
    assert (row[PLANNED], row[ACTIVE], row[THETA], row[HELD_FAST]) == (2.0, 2.0, 10.0, 0.0)
    assert row[PHI] == pytest.approx(0.01, rel=0.01)


def test_energy_is_that_of_the_activity_alone(tmp_path: Path) -> None:
    # Neither the work of the hook nor what motors did before.
    assert row_of(write(tmp_path, EXTERNAL, spent=3e-3))[ENERGY] == pytest.approx(3e-3 / 12, rel=1e-6)
    directory = write(tmp_path, INTERNAL, spent=6e-3)
    with h5py.File(directory / "series.h5", "r+") as series:
        series["motor_work_J"][:] += np.where(series["phase"][:] >= 1, 5e-4, 0.0)
    assert row_of(directory)[ENERGY] == pytest.approx(6e-3 / 12, rel=1e-6)
    row = row_of(write(tmp_path, STATIC))
    assert (row[PROCEDURE], row[ENERGY], row[LIFTS], row[PLANNED]) == (STATIC, 0.0, 0.0, 0.0)


# Which measure goes with strength


def table(strength: Callable[[pd.DataFrame, np.random.Generator], Any]) -> pd.DataFrame:
    """Runs at random places of every measure, all independent, and a strength that follows from them."""
    random = np.random.default_rng(0)
    rows = [(STATIC, math.nan, 0.0)] + [(INTERNAL, theta, time) for theta in THETAS for time in TIMES]
    runs = pd.DataFrame(
        [
            {PROCEDURE: name, THETA: theta, PLANNED: time, ASPECT: ratio, SEED: number}
            for number in (1, 2)
            for ratio in RATIOS
            for name, theta, time in rows
        ]
    )
    for column in PREDICTORS:
        runs[column] = random.normal(size=len(runs))
    runs[LIFTS] = runs[ENERGY]
    runs[HELD_FAST] = 0.0
    runs[PEAK] = strength(runs, random)
    runs[BEYOND] = runs[PEAK] - runs[ABOVE]
    return runs


def correlations(runs: pd.DataFrame, scope: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    first, second = (
        one[(one[STRENGTH] == PEAK) & (one[SCOPE] == scope) & (one[PART] == EVERY)].reset_index()
        for one in predicted(runs)
    )
    return first, second


def judged(runs: pd.DataFrame) -> dict[str, Judged]:
    ranked, compared = predicted(runs)
    tables = {"runs": runs, "predictors": ranked, "comparisons": compared, "cost": costs(runs)}
    return {one.id: one.judge(runs, tables) for one in STUDY.findings}


def test_the_measure_that_strength_follows_from_is_found() -> None:
    runs = table(lambda t, random: 0.2 * t[CROSSINGS] - 0.02 * t[PHI] + 0.05 * random.normal(size=len(t)))
    ranked, compared = correlations(runs, WITHIN)
    first = ranked.iloc[0]
    assert first[PREDICTOR] == CROSSINGS
    assert first[LOW] < first[RHO] < first[HIGH]
    assert first[RHO] > 0.9
    assert first["slope per SD [-]"] == pytest.approx(0.2, rel=0.15)
    assert first[FIRST] == 1.0
    assert compared[VERDICT].tolist() == ["better"] * (len(PREDICTORS) - 1)
    verdicts = judged(runs)
    names = ("best-strength-over", "best-strength-within", "stronger-crossings")
    assert {verdicts[name].verdict for name in names} == {"found"}


def test_runs_of_one_trajectory_are_one_block() -> None:
    def by_trajectory(t: pd.DataFrame, random: np.random.Generator) -> Any:
        numbers = trajectories(t)
        for column in PREDICTORS:
            t[column] = numbers.map(dict(enumerate(random.normal(size=len(t)))))
        return t[CROSSINGS] + numbers.map(dict(enumerate(random.normal(size=len(t)))))

    runs = table(by_trajectory)
    assert runs.groupby(trajectories(runs))[[ASPECT, SEED]].nunique().max().max() == 1
    # Ten times as many equal runs say no more.
    (once, _), (often, _) = correlations(runs, WITHIN), correlations(pd.concat([runs] * 10, ignore_index=True), WITHIN)
    blocks = 2 * len(RATIOS) * (1 + len(THETAS))
    assert set(once["trajectories [-]"]) == set(often["trajectories [-]"]) == {blocks}
    widths = [one.set_index(PREDICTOR)[HIGH] - one.set_index(PREDICTOR)[LOW] for one in (once, often)]
    assert widths[1].to_numpy() == pytest.approx(widths[0].to_numpy(), rel=0.1)


# What strength costs
