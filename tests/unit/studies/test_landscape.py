"""The study of the landscape: runs with known forces and works, tables with a known order of measures, known costs."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
from sweeps import of_one_seed
from synthetic import SyntheticRun
from synthetic.hooked import UPPER, weight, write_hooked_run
from synthetic.shapes import W

import studies
from dem.phases.internal_oscillation import InternalOscillation
from dem.phases.pull_hook import PullHook
from dem.record.manifest import read_run
from postprocess.measures.pull import WINDOW
from postprocess.statistics.columns import ASPECT, SEED
from studies.framework.procedures import ACTIVE, CROSSINGS, EXTERNAL, INTERNAL, PHI, PROCEDURE, SHAPE, STATIC, THETA
from studies.landscape import cost, measure, predictors
from studies.landscape.cost import COMMON, FRONTIER, GAIN, YIELD, costs
from studies.landscape.findings import answers
from studies.landscape.measure import (
    BEYOND,
    ENERGY,
    HELD_FAST,
    LIFTS,
    LINKING,
    PEAK,
    PLANNED,
    PREDICTORS,
    landscape_row,
)
from studies.landscape.predictors import ALL, EVERY, FREE, LEAD, OTHER, PART, PREDICTOR, RHO, SCOPE, STRENGTH, WITHIN
from studies.landscape.study import Landscape
from studies.registry import study_file
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import load_sweep

ORIGIN: dict[str, Any] = {"note": "the full study as shipped", "command": "smarticles study landscape --out landscape"}
ACTIVITY = {EXTERNAL: "shake", SHAPE: "shape-change", INTERNAL: "internal-oscillation"}
APEX, BASE = 0.5, 0.4
RATIOS = (0.4, 0.7, 1.0)
TIMES = (0.5, 1.0, 2.0, 4.0)
THETAS = (5.0, 10.0, 20.0)
FEW = 100  # resamples


# -- one run ----------------------------------------------------------------------------------------------------------


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


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    directory = write(tmp_path, INTERNAL, spent=6e-3)
    run = read_run(directory)
    row: dict[str, Any] = landscape_row(run)
    made = SyntheticRun(seed=1)
    above = float((made.shares() * made.height(0.01 * (1 - 0.002)) > UPPER).mean())
    assert row[PEAK] == pytest.approx(0.5 * (1 - WINDOW / BASE / 4), rel=1e-3)
    assert 0 < above < 1
    assert row[BEYOND] == pytest.approx(row[PEAK] - above)
    assert row[measure.RAISED] == pytest.approx(APEX * W, abs=0.005 * W)
    assert row[measure.WORK] == pytest.approx(0.5 * BASE, rel=1e-3)
    assert row[ENERGY] == pytest.approx(6e-3 / run.count, rel=1e-6)
    assert row[LIFTS] == pytest.approx(6e-3 / run.count / weight(made) / W, rel=1e-6)
    assert (row[PLANNED], row[ACTIVE], row[THETA], row[HELD_FAST]) == (2.0, 2.0, 10.0, 0.0)
    assert row[PHI] == pytest.approx(0.01, rel=0.01)


def test_energy_of_shaking_is_without_the_work_of_the_hook(tmp_path: Path) -> None:
    row = landscape_row(read_run(write(tmp_path, EXTERNAL, spent=3e-3)))
    assert row[ENERGY] == pytest.approx(3e-3 / 12, rel=1e-6)


def test_what_motors_did_before_the_activity_is_not_spent_on_it(tmp_path: Path) -> None:
    directory = write(tmp_path, INTERNAL, spent=6e-3)
    with h5py.File(directory / "series.h5", "r+") as series:
        series["motor_work_J"][:] += np.where(series["phase"][:] >= 1, 5e-4, 0.0)
    assert landscape_row(read_run(directory))[ENERGY] == pytest.approx(6e-3 / 12, rel=1e-6)


def test_a_poured_pile_has_spent_nothing(tmp_path: Path) -> None:
    row = landscape_row(read_run(write(tmp_path, STATIC)))
    assert (row[PROCEDURE], row[ENERGY], row[LIFTS], row[PLANNED]) == (STATIC, 0.0, 0.0, 0.0)


def test_a_hook_that_was_stopped_is_told(tmp_path: Path, undrawn: None) -> None:
    runs = [write(tmp_path, STATIC), write(tmp_path, SHAPE, limit=0.01, stops=0.6)]
    report = Landscape(resamples=20).analyse(runs, tmp_path / "out", **ORIGIN)
    assert report.tables["runs"].set_index(PROCEDURE)[HELD_FAST].to_dict() == {STATIC: 0.0, SHAPE: 1.0}
    assert any("Held fast: 1 of 2 runs" in line for line in report.footer)


def test_runs_of_other_studies_are_none_of_this_one(tmp_path: Path, undrawn: None) -> None:
    good, other = write(tmp_path, STATIC), write(tmp_path / "x", SHAPE)
    renamed = other.rename(other.with_name("shape"))
    report = Landscape(resamples=20).analyse([good, renamed], tmp_path / "out", **ORIGIN)
    assert "not named like a run of this study" in report.missing[0].cause


def test_the_study_writes_its_tables_and_figures(tmp_path: Path) -> None:
    levels = {STATIC: 0.3, EXTERNAL: 0.35, INTERNAL: 0.5, SHAPE: 0.9}
    runs = [
        write(tmp_path, name, seed=seed, ratio=ratio, top=level * (0.9 + 0.03 * seed + ratio / 5), time=time)
        for name, level in levels.items()
        for seed in (1, 2, 3)
        for ratio in (0.7, 1.0)
        for time in ((0.5, 2.0, 4.0) if name == INTERNAL else (2.0,))
    ]
    report = Landscape(resamples=60).analyse([*runs, tmp_path / "never"], tmp_path / "out", **ORIGIN)
    drawn = {"maps.png", "strength_energy.png", "strength_measures.png", "correlations.png", "cost.png"}
    assert {*drawn, "predictors.csv", "comparisons.csv", "cost.csv", "points.csv", "answers.csv"} <= set(report.files)
    assert len(report.rows) == 6
    assert len(report.missing) == 1
    assert {one.question: one.answer for one in report.judged}[
        "Does any internal oscillation make a pile as strong as a shape change does?"
    ] == "no"


# -- which measure ----------------------------------------------------------------------------------------------------


def table(strength: Callable[[pd.DataFrame, np.random.Generator], Any], *, seed: int = 0) -> pd.DataFrame:
    """Runs at random places of every measure, all independent, and a strength that follows from them."""
    random = np.random.default_rng(seed)
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
    runs[BEYOND] = runs[PEAK] - runs[measure.ABOVE]
    return runs


def told(runs: pd.DataFrame, scope: str, *, part: str = EVERY) -> tuple[pd.DataFrame, pd.DataFrame]:
    both = predictors.predicted(runs, count=FEW)
    first, second = (
        one[(one[STRENGTH] == PEAK) & (one[SCOPE] == scope) & (one[PART] == part)].reset_index() for one in both
    )
    return first, second


def answered(runs: pd.DataFrame) -> dict[str, str]:
    ranked, compared = predictors.predicted(runs, count=FEW)
    return {one.question: one.answer for one in answers(runs, ranked, compared, costs(runs, count=FEW))}


BEST_ALL = "Is one measure surely the best to tell strength, over runs of all l/w?"
BEST_WITHIN = "Is one measure surely the best to tell strength, within runs of one l/w?"


def test_the_measure_that_strength_follows_from_is_found() -> None:
    runs = table(lambda t, random: 0.2 * t[CROSSINGS] - 0.02 * t[PHI] + 0.05 * random.normal(size=len(t)))
    ranked, compared = told(runs, WITHIN)
    first = ranked.iloc[0]
    assert first[PREDICTOR] == CROSSINGS
    assert first[RHO] > 0.9
    assert first["from [-]"] < first[RHO] < first["to [-]"]
    assert first[predictors.SLOPE] == pytest.approx(0.2, rel=0.15)
    assert first[predictors.FIRST] == 1.0
    assert set(compared[predictors.VERDICT]) == {"better"}
    assert len(compared) == len(PREDICTORS) - 1
    assert (answered(runs)[BEST_WITHIN], answered(runs)[BEST_ALL]) == ("yes", "yes")
    assert answered(runs)["Within runs of one l/w, is a pile stronger the larger ⟨N⟩ is?"] == "yes"


def test_where_nothing_tells_strength_nothing_is_said() -> None:
    runs = table(lambda t, random: random.normal(size=len(t)))
    given = answered(runs)
    assert given[BEST_ALL] == given[BEST_WITHIN] == "undetermined"
    _, compared = told(runs, ALL)
    assert "not resolved" in set(compared[predictors.VERDICT])
    ranked, _ = told(runs, ALL)
    clear = (ranked["from [-]"] > 0) | (ranked["to [-]"] < 0)
    assert clear.sum() <= 2


def test_two_measures_that_tell_it_alike_are_not_resolved() -> None:
    def both(t: pd.DataFrame, random: np.random.Generator) -> Any:
        t[LINKING] = t[CROSSINGS] + 0.05 * random.normal(size=len(t))
        return -t[CROSSINGS] - t[LINKING] + 0.3 * random.normal(size=len(t))

    runs = table(both)
    ranked, compared = told(runs, WITHIN)
    assert set(ranked[PREDICTOR].iloc[:2]) == {CROSSINGS, LINKING}
    # Sizes are compared: it falls with both.
    assert (ranked[RHO].iloc[:2] < -0.9).all()
    verdicts = compared.set_index(OTHER)[predictors.VERDICT]
    assert verdicts.iloc[0] == "not resolved"
    assert (verdicts.iloc[1:] == "better").all()
    assert compared[LEAD].iloc[0] < 0.05
    assert answered(runs)[BEST_WITHIN] == "undetermined"
    assert answered(runs)["Within runs of one l/w, is a pile stronger the larger ⟨N⟩ is?"] == "no"


def test_what_goes_with_the_aspect_ratio_alone_tells_nothing_within() -> None:
    def by_ratio(t: pd.DataFrame, random: np.random.Generator) -> Any:
        t[PHI] = -t[ASPECT] + 0.02 * random.normal(size=len(t))
        return t[ASPECT] + 0.02 * random.normal(size=len(t))

    runs = table(by_ratio)
    over, _ = told(runs, ALL)
    within, _ = told(runs, WITHIN)
    assert over[PREDICTOR].iloc[0] == PHI
    assert over[RHO].iloc[0] < -0.85
    assert abs(within.set_index(PREDICTOR)[RHO][PHI]) < 0.3


def test_lower_bounds_are_left_out_of_their_part() -> None:
    runs = table(lambda t, _: t[CROSSINGS])
    stopped = runs.index[:20]
    runs.loc[stopped, PEAK] = -runs.loc[stopped, CROSSINGS]
    runs.loc[stopped, HELD_FAST] = 1.0
    ranked, _ = told(runs, WITHIN, part=FREE)
    assert ranked[predictors.COUNT].iloc[0] == len(runs) - 20
    assert (ranked[PREDICTOR].iloc[0], ranked[RHO].iloc[0]) == (CROSSINGS, pytest.approx(1.0))
    every, _ = told(runs, WITHIN)
    assert every.set_index(PREDICTOR)[RHO][CROSSINGS] < 0.9


def test_runs_of_one_trajectory_are_one_block() -> None:
    runs = table(lambda t, _: t[CROSSINGS])
    numbers = measure.trajectories(runs)
    assert numbers.nunique() == 2 * len(RATIOS) * (1 + len(THETAS))
    assert runs.groupby(numbers)[[ASPECT, SEED]].nunique().max().max() == 1


def test_a_trajectory_told_ten_times_tells_no_more() -> None:
    def by_trajectory(t: pd.DataFrame, random: np.random.Generator) -> Any:
        numbers = measure.trajectories(t)
        for column in PREDICTORS:
            t[column] = numbers.map(dict(enumerate(random.normal(size=len(t)))))
        return t[CROSSINGS] + numbers.map(dict(enumerate(random.normal(size=len(t)))))

    runs = table(by_trajectory)
    once, _ = told(runs, WITHIN)
    often, _ = told(pd.concat([runs] * 10, ignore_index=True), WITHIN)
    blocks = 2 * len(RATIOS) * (1 + len(THETAS))
    assert set(once[predictors.BLOCKS]) == set(often[predictors.BLOCKS]) == {blocks}
    widths = [one.set_index(PREDICTOR)["to [-]"] - one.set_index(PREDICTOR)["from [-]"] for one in (once, often)]
    assert widths[1].to_numpy() == pytest.approx(widths[0].to_numpy(), rel=0.1)


# -- what it costs ----------------------------------------------------------------------------------------------------

SPENT = {SHAPE: 50.0, EXTERNAL: 40.0}
GAINS = {SHAPE: 0.5, EXTERNAL: -0.02}


def bought(scatter: float = 0.01) -> pd.DataFrame:
    """Oscillation gains 0.1 for each doubling of energy; shape change much, at a price; shaking nothing."""
    random = np.random.default_rng(3)
    rows = []
    for seed in (1, 2, 3, 4):
        for ratio in RATIOS:
            level = random.uniform(0.3, 0.5)
            points = [(STATIC, math.nan, 0.0, 0.0, 0.0)]
            points += [(INTERNAL, 10.0, time, 0.1 * k + 0.1, 5.0 * time) for k, time in enumerate(TIMES)]
            points += [(name, math.nan, 3.0, GAINS[name], SPENT[name]) for name in (SHAPE, EXTERNAL)]
            for name, theta, time, gain, energy in points:
                rows.append(
                    {PROCEDURE: name, THETA: theta, PLANNED: time, ASPECT: ratio, SEED: seed}
                    | {PEAK: level + gain + scatter * random.normal(), LIFTS: energy, ENERGY: 1e-5 * energy}
                )
    return pd.DataFrame(rows)


def test_gains_are_those_over_the_pile_poured_alike() -> None:
    found = costs(bought(), count=FEW)
    found = found[found[SCOPE] == COMMON].set_index([PROCEDURE, PLANNED])
    assert found.loc[SHAPE, 3.0][GAIN] == pytest.approx(0.5, abs=0.01)
    # The level of the pour, which scatters by 0.06, is in both.
    assert found.loc[SHAPE, 3.0]["strength gained over n W_s 95 % [-]"] < 0.02
    half = found.loc[INTERNAL, 0.5]
    assert half[YIELD] == pytest.approx(0.1 / 2.5, rel=0.1)
    assert half[cost.LOW] < half[YIELD] < half[cost.HIGH]
    assert half[cost.HIGH] - half[cost.LOW] < 0.3 * half[YIELD]
    assert found[cost.PAIRS].tolist() == [12] * 6
    assert found[FRONTIER].to_dict() == {
        (EXTERNAL, 3.0): 0.0,
        (SHAPE, 3.0): 1.0,
        **{(INTERNAL, time): 1.0 for time in TIMES},
    }


def test_the_cheapest_procedure_is_told_where_it_surely_is() -> None:
    question = "Is one procedure surely the cheapest per unit of strength, each at its best?"

    def asked(runs: pd.DataFrame) -> Any:
        empty = pd.DataFrame()
        found = answers(runs, empty, empty, costs(runs, count=FEW))
        return next(one for one in found if one.question == question)

    sure = asked(bought())
    assert sure.answer == "yes"
    assert sure.evidence.index("internal θ = 10° for 0.5 s") < sure.evidence.index("shape-change for 3 s")
    assert "no sure gain: external" in sure.evidence
    assert asked(bought(scatter=0.6)).answer == "undetermined"


def test_gain_per_energy_is_that_of_the_means() -> None:
    # The mean of the ratios would be 0.6: a pair that spent little would count as much as one that spent much.
    pairs = pd.DataFrame({cost.GAIN: [1.0, 1.0, 1.0], LIFTS: [1.0, 2.5, 2.5]})
    assert cost.gain_per_energy(pairs, count=FEW).value == pytest.approx(0.5)


def test_of_a_procedure_the_point_that_surely_gains_is_its_best() -> None:
    row = {SCOPE: COMMON, PROCEDURE: INTERNAL, cost.HIGH: 1.0}
    found = pd.DataFrame(
        [{**row, PLANNED: 1.0, YIELD: 0.2, cost.LOW: 0.1}, {**row, PLANNED: 2.0, YIELD: 0.5, cost.LOW: -0.1}]
    )
    assert cost.best_points(found)[PLANNED].tolist() == [1.0]


def test_only_aspect_ratios_that_have_everything_are_averaged_over() -> None:
    runs = bought()
    runs = runs[~((runs[ASPECT] == 0.4) & (runs[PLANNED] == 4.0))]
    assert cost.common_aspects(runs) == [0.7, 1.0]
    found = costs(runs, count=20)
    assert set(found[found[SCOPE] == COMMON][cost.PAIRS]) == {8}


# -- what is shipped --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shipped() -> list[Point]:
    sweep = load_sweep(study_file("landscape"))
    repeats = sweep.content.repeats
    assert repeats is not None
    assert list(repeats.seeds) == [1, 2, 3]
    return expand(of_one_seed(sweep))


def test_over_two_hundred_points_of_the_papers_counts(shipped: list[Point]) -> None:
    folder = Path(studies.__file__).parent
    with (folder / "savoie_counts.csv").open(encoding="utf-8") as file:
        counts = {float(row["l_over_w"]): (int(row["n"]), int(row["per_layer"])) for row in csv.DictReader(file)}
    assert len(shipped) == len({point.name for point in shipped}) == 204
    for point in shipped:
        deposit: Any = point.scene.phases[0]
        assert (point.scene.count, deposit.per_layer) == counts[point.scene.smarticle.aspect_ratio]
        assert (point.scene.engine, point.scene.protocol, point.scene.fidelity.base) == ("links", "code", "standard")
    thetas = {(p.values["l_over_w"], p.values["theta_deg"]) for p in shipped if p.values["procedure"] == INTERNAL}
    every = [(ratio, theta) for ratio in counts for theta in (5, 10, 15, 20, 30)]
    assert thetas == {(ratio, theta) for ratio, theta in every if theta * 0.7 / ratio <= 30 * (1 + 1e-9)}
    # Any first part covers all l/w.
    assert [point.values["l_over_w"] for point in shipped[:8]] == list(counts)


def test_oscillations_are_of_whole_swings_near_the_time_planned(shipped: list[Point]) -> None:
    for point in shipped:
        for phase in point.scene.phases:
            if isinstance(phase, InternalOscillation):
                ratio = point.scene.smarticle.aspect_ratio
                speed = point.scene.motor.speed_limit_rad_per_s
                swing = 2 * math.radians(phase.theta_deg) * 0.7 / ratio / speed
                assert phase.duration_s / swing == pytest.approx(round(phase.duration_s / swing), abs=1e-4)
                assert abs(phase.duration_s - float(str(point.values["active_s"]))) <= swing / 2 * (1 + 1e-4)


def test_no_smarticle_gets_hold_of_the_lower_hook(shipped: list[Point]) -> None:
    for point in shipped:
        hooks, pull = point.scene.hooks, point.scene.phases[-1]
        assert hooks is not None
        assert hooks.lower_height_m == pytest.approx(hooks.side_m / 2)
        assert hooks.upper_height_m == pytest.approx(20 * 0.5e-3)
        assert isinstance(pull, PullHook)
        assert pull.distance_m == pytest.approx(1.5 * W)
        assert pull.force_limit_N == pytest.approx(
            1.5 * point.scene.count * point.scene.smarticle.boxes.mass * 9.81, 1e-3
        )
