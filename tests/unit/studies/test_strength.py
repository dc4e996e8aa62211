"""The study of strength: runs with known forces and piles that come off in part; its findings and shipped points."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, write_frame
from synthetic.hooked import HELD, UPPER, weight, write_hooked_run
from synthetic.shapes import W

from dem.record.manifest import read_run
from postprocess.measures.pull import WINDOW
from postprocess.statistics.columns import ASPECT, SEED
from studies.base.procedures import AMPLITUDE, CROSSINGS, EXTERNAL, INTERNAL, PROCEDURE, SHAPE, STATIC, THETA
from studies.registry import study_file
from studies.strength import measure
from studies.strength.findings import findings
from studies.strength.measure import ABOVE, BREAK, CARRIED, HELD_FAST, PEAK, PEAK_RAISED, THROUGH, WORK, strength_row
from studies.strength.study import Strength
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study strength --out strength"}
ACTIVITY = {EXTERNAL: "shake", SHAPE: "shape-change", INTERNAL: "internal-oscillation"}
APEX, BASE, DEPTH = 0.5, 0.4, 0.01
RISEN = 3


def write(directory: Path, procedure: str, *, seed: int = 1, top: float = 0.5, **stops: float) -> Path:
    """A run whose force is a triangle of a height over n W_s, and whose last frame has three smarticles risen by 2w."""
    active = () if procedure == STATIC else (ACTIVITY[procedure], "relax")
    phases = ("deposit", "relax", *active, "remove-container", "pull-hook")
    keys: dict[str, Any] = {"phases": phases, "packing": (DEPTH,) * len(phases), "frames_per_phase": 2}
    run = SyntheticRun(**keys, seed=seed, shake_time=2.0)
    total = run.count * weight(run)
    write_hooked_run(
        directory, run, lambda time: top * total * np.clip(1 - np.abs(time - APEX) / BASE, 0, None), **stops
    )
    vertices = run.vertices(DEPTH * (1 - 0.002))
    vertices[:RISEN, :, 2] += 2 * W
    last = sorted((directory / "frames").glob("*.vtu"))[-1]
    end = sum(run.durations[kind] for kind in phases)
    write_frame(last, vertices, time=end, phase=len(phases) - 1, contacts=np.zeros(run.count, int))
    return directory


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    run = read_run(write(tmp_path / "one", STATIC))
    row: dict[str, Any] = strength_row(run)
    blunt = 1 - WINDOW / BASE / 4
    assert row[PEAK] == pytest.approx(0.5 * blunt, rel=1e-3)
    assert row[PEAK_RAISED] == pytest.approx(APEX * W, abs=0.005 * W)
    assert row[WORK] == pytest.approx(0.5 * BASE, rel=1e-3)
    # Before the pull one smarticle rests on the hook, and nothing goes through.
    assert row[measure.BEFORE] == pytest.approx(1 / run.count, rel=1e-5)
    assert row[THROUGH] == pytest.approx(HELD * 0.5 * blunt, rel=1e-3)
    assert row[CARRIED] == RISEN / run.count
    made = SyntheticRun(seed=1)
    before = made.vertices(DEPTH * (1 - 0.002))
    assert row[BREAK] == pytest.approx(before[:RISEN, :, 2].min(axis=1).mean())
    assert row[ABOVE] == pytest.approx((made.shares() * made.height(DEPTH * (1 - 0.002)) > UPPER).mean())
    assert (row[HELD_FAST], row[measure.LIMIT], row[measure.KEPT]) == (0, math.inf, pytest.approx(1))


def test_a_pile_that_is_held_fast_is_told(tmp_path: Path, undrawn: None) -> None:
    free = write(tmp_path / "free", SHAPE)
    held = write(tmp_path / "held", SHAPE, seed=2, limit=0.01, stops=0.6)
    report = Strength().analyse([free, held], tmp_path / "out", **ORIGIN)
    runs = pd.read_csv(report.files["runs.csv"], comment="#").set_index(SEED)
    assert runs[HELD_FAST].tolist() == [0, 1]
    # What came off is not known.
    assert runs[CARRIED].isna().tolist() == [False, True]
    assert any("Held fast: 1 of 2 runs" in line for line in report.footer)
    assert not any("No pile held fast" in line for line in report.footer)


def test_the_study_writes_its_tables_and_figures(tmp_path: Path) -> None:
    levels = {STATIC: 0.3, EXTERNAL: 0.6, INTERNAL: 0.5, SHAPE: 0.9}
    runs = [
        write(tmp_path / f"{name}{seed}", name, seed=seed, top=level * (1 + 0.02 * seed))
        for name, level in levels.items()
        for seed in (1, 2, 3)
    ]
    report = Strength().analyse([*runs, tmp_path / "never"], tmp_path / "out", **ORIGIN)
    verdicts = [one.verdict for one in report.judged]
    assert verdicts[:2] == ["found", "found"]
    assert verdicts[4] == "found"
    assert {"force_raised.png", "strength.png", "peak_crossings.png"} <= set(report.files)
    assert len(report.rows) == 4
    assert len(report.missing) == 1


def test_runs_with_a_wall_are_none_of_this_study(tmp_path: Path, undrawn: None) -> None:
    phases = ("deposit", "relax", "pull-hook")
    keys: dict[str, Any] = {"phases": phases, "packing": (DEPTH,) * 3}
    run = SyntheticRun(**keys)
    other = write_hooked_run(tmp_path / "walled", run, np.zeros_like)
    report = Strength().analyse([write(tmp_path / "one", STATIC), other], tmp_path / "out", **ORIGIN)
    assert "its phases are deposit, relax, pull-hook, not" in report.missing[0].cause


# -- findings on tables -----------------------------------------------------------------------------------------------


SEEDS = range(1, 9)


def as_in_the_paper() -> pd.DataFrame:
    random = np.random.default_rng(0)
    rows = [
        {
            PROCEDURE: name,
            ASPECT: 0.7,
            THETA: AMPLITUDE if name == INTERNAL else math.nan,
            SEED: seed,
            measure.UPPER: upper,
            PEAK: peak * (1 + 0.02 * random.normal()),
            PEAK_RAISED: raised * (1 + 0.02 * random.normal()),
            WORK: peak * (1 + 0.02 * random.normal()),
            CROSSINGS: crossings * (1 + 0.02 * random.normal()),
            HELD_FAST: 0.0,
            **dict.fromkeys((THROUGH, CARRIED, ABOVE), 0.1),
        }
        for name, peak, raised, crossings in (
            (STATIC, 0.3, 4e-3, 3.0),
            (EXTERNAL, 0.6, 4e-3, 4.0),
            (INTERNAL, 0.5, 4e-3, 4.4),
            (SHAPE, 1.2, 1e-3, 6.0),
        )
        for seed in SEEDS
        for upper in (0.013, 0.016)
    ]
    return pd.DataFrame(rows)


def verdicts(table: pd.DataFrame) -> list[str]:
    return [one.verdict for one in findings(table)]


def test_findings_of_the_paper_are_found_and_their_opposite_is_not() -> None:
    table = as_in_the_paper()
    assert verdicts(table) == ["found"] * 6 + ["no data"]
    # Two heights of one seed are one sample, not two.
    assert "n = 8" in findings(table)[0].ours
    table[PEAK], table[WORK], table[PEAK_RAISED] = 2 - table[PEAK], 2 - table[WORK], 1e-2 - table[PEAK_RAISED]
    assert verdicts(table) == ["not found", "not found", "found", "not found", "not found", "not found", "no data"]


def test_what_a_held_pile_leaves_unknown_is_not_judged() -> None:
    table = as_in_the_paper()
    held = table.copy()
    held.loc[held.index[held[PROCEDURE] == SHAPE][0], HELD_FAST] = 1.0
    # A lower bound that is above is above; where its peak is, is not known.
    assert verdicts(held)[:2] == ["found", "found"]
    assert verdicts(held)[3] == "not resolved"
    held = table.copy()
    held.loc[held.index[held[PROCEDURE] == EXTERNAL][0], HELD_FAST] = 1.0
    assert verdicts(held)[0] == "not resolved"


def test_a_seed_counts_where_it_has_all_heights() -> None:
    table = as_in_the_paper()
    part = table[~((table[SEED] == 3) & (table[measure.UPPER] == 0.016))]
    assert "n = 7" in findings(part)[0].ours


def over_theta(rise: float) -> pd.DataFrame:
    """As in the paper, and the lower hook in piles of other θ whose ⟨N⟩ grows with θ and whose peak does as told."""
    table, random = as_in_the_paper(), np.random.default_rng(1)
    lower = table[(table[PROCEDURE] == INTERNAL) & (table[measure.UPPER] == 0.013)]
    others = [
        lower.assign(
            **{
                THETA: theta,
                CROSSINGS: lower[CROSSINGS] + 0.05 * (theta - AMPLITUDE),
                PEAK: lower[PEAK] + rise * (theta - AMPLITUDE) + 0.02 * random.standard_normal(len(lower)),
            }
        )
        for theta in (5.0, 20.0, 30.0)
    ]
    return pd.concat([table, *others], ignore_index=True)


def test_other_amplitudes_are_compared_among_themselves_alone() -> None:
    for rise, verdict in ((0.01, "found"), (0.0, "not resolved"), (-0.01, "not found")):
        table = over_theta(rise)
        before, after = findings(as_in_the_paper()), findings(table)
        assert [one.ours for one in before[:-1]] == [one.ours for one in after[:-1]]
        assert after[-1].verdict == verdict
        # Four θ of eight seeds; the upper hook has one θ alone.
        assert "(n = 8)" in after[-1].ours
        assert "(n = 32)" in after[-1].ours
        assert "θ = 5 10 20 30°" in after[-1].ours


def test_a_pile_that_one_smarticle_braces_does_not_decide() -> None:
    """Its peak, many times that of its like, turns the slope; of ranks it is one among many, held fast or not."""
    table = over_theta(-0.01)
    most = table[THETA].idxmax()
    table.loc[most, PEAK] = 50.0
    assert findings(table)[-1].verdict == "not found"
    assert "not judged, +" in findings(table)[-1].ours
    table.loc[most, HELD_FAST], table.loc[most, PEAK] = 1.0, 2.0
    assert findings(table)[-1].verdict == "not found"
    assert "1 of the peaks lower bounds" in findings(table)[-1].ours


def test_other_amplitudes_have_points_of_their_own(tmp_path: Path) -> None:
    runs = [write(tmp_path / f"{name}{seed}", name, seed=seed) for name in (STATIC, INTERNAL) for seed in (1, 2, 3)]
    for run in runs[4:]:
        (run / "scene.yaml").write_text((run / "scene.yaml").read_text().replace("theta_deg: 10.0", "theta_deg: 30.0"))
    report = Strength().analyse(runs, tmp_path / "out", **ORIGIN)
    assert [row[:2] for row in report.rows] == [["static", "–"], ["internal", "10"], ["internal", "30"]]


# -- what is shipped --------------------------------------------------------------------------------------------------


def test_no_smarticle_holds_both_grips_and_the_grid_is_over_the_whole_floor() -> None:
    for name in ("strength", "strength-code"):
        for quick in (False, True):
            for point in expand(load_sweep(study_file(name, quick=quick))):
                scene = point.scene
                hooks = scene.hooks
                assert hooks is not None
                across = hooks.upper_height_m - hooks.lower_height_m + hooks.side_m
                assert across > scene.smarticle.middle_length_m - scene.sphere_diameter
                assert hooks.lower_bars == 3
                assert hooks.lower_length_m > 1.8 * scene.container.radius_m
                # A link goes below the grid.
                assert hooks.lower_height_m - hooks.side_m / 2 > scene.sphere_diameter
                assert [phase.type for phase in scene.phases][-2:] == ["remove-container", "pull-hook"]
                limit = scene.phases[-1].force_limit_N  # type: ignore[union-attr]
                # A fifth more than the limit on one contact, and the watchdog does not stop the run.
                assert limit is not None
                assert 1.2 * limit / scene.fidelity.stiffness_N_per_m < 0.5 * scene.sphere_diameter
