"""The study of Gravish's packing: each finding from tables that deserve each verdict, and runs of known packing."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, write_run

from dem.record.run import open_run
from postprocess.statistics.points import ASPECT, SEED
from studies.framework.shaken import AT_REST, SHAKEN, STAGES, phi, read_gravish
from studies.gravish import CONTACT, PAPER, STUDY, deviations, measure, steps
from studies.registry import shipped

SPREAD = {1: -0.002, 2: 0.0, 3: 0.002}


def runs_of(levels: Mapping[float, tuple[float, float]], spread: Mapping[int, float] = SPREAD) -> pd.DataFrame:
    """Make a table of runs: φ_0 and φ_f of each aspect ratio, shifted by a spread over seeds."""
    rows = [
        {ASPECT: aspect, SEED: seed, phi("phi_0"): before + shift, phi("phi_f"): after + shift / 10}
        for aspect, (before, after) in levels.items()
        for seed, shift in spread.items()
    ]
    return pd.DataFrame(rows)


def verdict(name: str, levels: Mapping[float, tuple[float, float]], spread: Mapping[int, float] = SPREAD) -> str:
    return str(next(one for one in STUDY.findings if one.id == name).judge(runs_of(levels, spread)).verdict)


def test_gravish_is_never_interpolated() -> None:
    reference = read_gravish().set_index("l_over_w")
    assert reference.loc[0.7].tolist() == [0.105, 0.130]
    found = deviations(runs_of({0.5: (0.125, 0.15), 0.65: (0.11, 0.13), 0.7: (0.1155, 0.117)}))
    assert found[["stage", ASPECT]].to_numpy().tolist() == [["phi_0", 0.7], ["phi_f", 0.5], ["phi_f", 0.7]]
    assert found["deviation [%]"].tolist() == pytest.approx([10.0, 100 * (0.15 / 0.148 - 1), -10.0])


def test_a_fall_is_monotone_if_each_step_clearly_falls() -> None:
    clear = {0.4: (0.14, 0.16), 0.5: (0.12, 0.14), 0.6: (0.10, 0.12)}
    assert verdict("phi-0-falls", clear) == "found"
    assert steps(runs_of(clear)).query("stage == 'phi_0'")["phi"].tolist() == ["falls", "falls"]
    assert verdict("phi-0-falls", {**clear, 0.6: (0.122, 0.12)}) == "not resolved"  # rises within the error bars
    assert verdict("phi-0-falls", {**clear, 0.6: (0.118, 0.12)}) == "not resolved"  # falls within them
    assert verdict("phi-0-falls", {**clear, 0.5: (0.10, 0.14), 0.6: (0.12, 0.12)}) == "not found"
    assert verdict("phi-0-falls", {0.4: (0.14, 0.16), 0.5: (0.139, 0.14)}) == "not resolved"  # flat
    assert verdict("phi-0-falls", clear, {1: 0.0}) == "not resolved"  # one seed


@pytest.mark.parametrize(("excess", "spread", "expected"), [
    (0.05, 0.001, "found"),
    (0.05, 0.02, "not resolved"),
    (0.15, 0.02, "not resolved"),
    (0.15, 0.001, "not found"),
])  # fmt: skip
def test_a_deviation_is_judged_with_its_error_bar(excess: float, spread: float, expected: str) -> None:
    levels = {0.7: (0.105 * (1 + excess), 0.13)}
    assert verdict("phi-0-near", levels, {1: -spread, 2: 0.0, 3: spread}) == expected
    assert verdict("phi-0-near", levels, {1: 0.0}) == "not resolved"  # one seed has no error bar


def test_phi_f_is_compared_at_rest_where_runs_have_it() -> None:
    shaken = runs_of({0.5: (0.125, 0.148), 0.7: (0.1155, 0.130)})
    rested = shaken.assign(**{phi(AT_REST): 1.2 * shaken[phi("phi_f")]})
    for runs, stage, near in ((shaken, "phi_f", "found"), (rested, AT_REST, "not found")):
        judged = next(one for one in STUDY.findings if one.id == "phi-f-near").judge(runs)
        assert judged.verdict == near
        assert judged.ours.startswith(STAGES[stage])
    found = deviations(rested).set_index(["stage", ASPECT])["deviation [%]"]
    assert found["phi_f", 0.7] == pytest.approx(0, abs=1e-6)
    assert found[AT_REST, 0.7] == pytest.approx(20)


def test_at_rest_is_the_last_frame_and_not_the_fall(tmp_path: Path) -> None:
    run = open_run(write_run(tmp_path / "run", SyntheticRun(packing=(0.1, 0.105, 0.13, 0.15), friction=0.4)))
    row = measure(run)
    assert row[CONTACT] == PAPER
    assert row[phi(AT_REST)] == pytest.approx(0.15 * 0.998)  # frames alternate by ±0.2 % about the packing
    assert row[phi("phi_f relaxed")] == pytest.approx(0.15)


OTHER = "friction 0.5, 1 at the container, restitution 0.7"


def with_contacts(runs: pd.DataFrame) -> pd.DataFrame:
    """Each run twice: with the contact of Savoie et al., and with one that packs 10 % less."""
    less = runs.assign(**{name: 0.9 * runs[name] for name in runs if str(name).startswith("phi")})
    return pd.concat([runs.assign(**{CONTACT: PAPER}), less.assign(**{CONTACT: OTHER})], ignore_index=True)


def test_the_figure_shows_fully_shaken_piles_at_rest_for_each_contact() -> None:
    runs = runs_of({0.4: (0.14, 0.16), 0.7: (0.1155, 0.130)})
    runs = runs.assign(**{phi(AT_REST): 1.1 * runs[phi("phi_f")], SHAKEN: np.where(runs[ASPECT] > 0.5, 20.0, 1.5)})
    runs = with_contacts(runs)
    for name in STUDY.quantities:
        runs[name.column] = runs.get(name.column, np.nan)
    figure = next(one for one in STUDY.figures if one.name == "phi")
    drawn = figure.split(figure.rows(STUDY.points(runs)))  # type: ignore[attr-defined]
    assert [one.label for one in drawn] == [PAPER, "friction 0.5, 1 at the container"]
    values = {
        one.rows[CONTACT].iloc[0]: one.rows.set_index(ASPECT)[[phi("phi_0"), phi("phi_f")]].round(4) for one in drawn
    }
    assert values[PAPER].loc[0.7].tolist() == [0.1155, 0.143]
    assert values[OTHER].loc[0.7].tolist() == pytest.approx([0.1040, 0.1287], abs=1e-4)
    assert values[PAPER].loc[0.4].isna().tolist() == [False, True]  # shaken for 1.5 s beside 20 s
    found = STUDY.extra(runs)["deviations"].set_index([CONTACT, ASPECT])["stage"]
    assert (found.loc[[(PAPER, 0.4)]].tolist(), set(found.loc[(OTHER, 0.7)])) == (
        ["phi_0"],
        {"phi_0", "phi_f", AT_REST},
    )


def test_each_contact_has_verdicts_of_its_own() -> None:
    runs = with_contacts(runs_of({0.5: (0.14, 0.165), 0.7: (0.117, 0.145)}))
    judged = {one.id: one.judge(runs) for one in STUDY.findings}
    assert judged["phi-f-near"].verdict == "not found"  # 11.5 %
    assert judged["phi-f-near-calibrated"].verdict == "found"  # 0.4 %
    alone = runs[runs[CONTACT] == PAPER]
    assert (
        judged["phi-0-falls"].ours == next(one for one in STUDY.findings if one.id == "phi-0-falls").judge(alone).ours
    )
    assert (
        next(one for one in STUDY.findings if one.id == "phi-f-near-calibrated").judge(alone).verdict == "not resolved"
    )


def test_figures_of_a_quick_study_say_what_the_full_study_found(tmp_path: Path) -> None:
    runs = [
        write_run(
            tmp_path / f"{aspect}_{seed}",
            SyntheticRun(aspect_ratio=aspect, seed=seed, frames_per_phase=1, friction=0.4),
        )
        for aspect in (0.4, 0.7)
        for seed in (1, 2)
    ]
    note, full = "not the full study: 18 runs instead of 73; fidelity: draft", shipped("gravish").found
    report = STUDY.analyse(runs, tmp_path / "results", note=note, full=full, command="smarticles study gravish --quick")
    for name in ("phi", "crossings", "phi_time"):
        texts = re.findall(r"<text[^>]*>([^<]*)</text>", report.files[f"{name}.svg"].read_text(encoding="utf-8"))
        assert f"Not the full study, which found: {full}" in " ".join(texts)
        assert {"phi": "experiment", "crossings": "0.40", "phi_time": "l/w = 0.7"}[name] in texts
