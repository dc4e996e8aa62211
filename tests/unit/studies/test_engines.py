"""The study of engines, from run directories whose packing is made up: equal, 8 % apart, or scattered."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, write_manifest, write_run

from dem.errors import InputError
from dem.record.manifest import read_run
from postprocess.statistics.columns import SEED
from studies.engines.findings import QUANTITIES, judged, pitch_of, verdict_of
from studies.engines.measure import CASE, COLUMNS, FORCE, PHI_0, VARIANT
from studies.engines.study import Engines
from studies.framework.engines import compared_engines, engines_of, judging
from studies.framework.runs import ENGINE
from studies.gravish.study import Gravish

ORIGIN = {"note": "a test", "command": "smarticles study engines --quick --out 'my engines'"}
SEEDS = (1, 2, 3, 4)


def write(folder: Path, variant: str, seed: int, factor: float, case: str = "external") -> Path:
    """A shaken run whose φ is that of its seed times a factor."""
    level = factor * (1 + 0.004 * (-1) ** seed)
    kind = {"external": "shake", "internal": "internal-oscillation"}[case]
    made = SyntheticRun(
        name=f"{case}/{variant}",
        seed=seed,
        packing=(0.10 * level, 0.10 * level, 0.13 * level, 0.14 * level),
        phases=("deposit", "relax", kind, "relax"),
        frames_per_phase=2,
        work=1e-4,
        shake_time=5.0,
    )
    directory = write_run(folder / f"{case}_{variant}_seed{seed}", made)
    write_manifest(directory, made, engine="links" if variant == "links" else "yade")
    return directory


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Shaken alike but for 8 % in φ, oscillated alike; a finer pitch in between."""
    root = tmp_path_factory.mktemp("engines")
    runs = [
        write(root, variant, seed, factor, case)
        for seed in SEEDS
        for case, variant, factor in (
            ("external", "links", 1.08),
            ("external", "yade", 1.0),
            ("external", "pitch-0.5", 1.04),
            ("internal", "links", 1.001),
            ("internal", "yade", 1.0),
        )
    ]
    return Engines().analyse([*runs, root / "chain_links_seed1"], root / "out", **ORIGIN)


def verdicts(report) -> dict[str, str]:
    return {one.quantity.told: one.verdict for one in report.judged}


def test_what_agrees_is_equivalent_and_what_does_not_is_different(study) -> None:
    found = verdicts(study)
    assert found["φ_f at rest, external"] == "different"
    assert found["φ_f at rest, internal"] == "equivalent"
    one = next(one for one in study.judged if one.quantity.told == "φ_f at rest, external")
    assert one.pairs == len(SEEDS)
    assert one.percent == pytest.approx(8.0, abs=0.1)
    # Pairs share their seed's scatter, which is wider between them.
    assert one.half_width < 0.2 < one.unpaired


def test_quantities_without_a_run_are_not_judged(study) -> None:
    assert not {"hook force", "collapse time", "chain force"} & set(verdicts(study))
    assert study.missing[0].status == "not started"


def test_a_seed_counts_once_however_many_of_its_runs_begin_alike(study) -> None:
    poured = next(one for one in study.judged if one.quantity.told == "φ_0")
    assert poured.pairs == len(SEEDS)
    assert poured.percent == pytest.approx(4.05, abs=0.1)  # the mean of 8 and 0.1


def test_chains_are_followed_to_links(study) -> None:
    table = study.tables["pitch"]
    rows = table[table["quantity"] == "φ_f at rest, external"].set_index("pitch [-]")
    assert rows.index.tolist() == [0.0, 0.5, 1.0]
    assert rows["less links [%]"].tolist()[1:] == pytest.approx([-3.7, -7.4], abs=0.1)
    assert math.isnan(rows["less links [%]"].iloc[0])


def test_everything_is_written_and_names_both_engines(study) -> None:
    assert {"runs.csv", "equivalence.csv", "pitch.csv", "equivalence.md", "differences.png", "pitch.png"} <= set(
        study.files
    )
    text = study.files["equivalence.md"].read_text(encoding="utf-8")
    assert "Margins, chosen before the first run" in text
    assert "engine links and yade" in study.footer[0]
    assert set(pd.read_csv(study.files["runs.csv"], comment="#")[ENGINE]) == {"links", "yade"}


@pytest.mark.parametrize(
    ("percent", "half_width", "verdict"),
    [
        (0.0, 4.9, "equivalent"),
        (4.0, 0.9, "equivalent"),
        (4.0, 1.1, "not resolved"),
        (0.0, 5.1, "not resolved"),  # not significant, and no proof of anything
        (-6.0, 1.1, "not resolved"),
        (-6.0, 0.9, "different"),
        (1.0, math.nan, "not resolved"),
        (math.nan, math.nan, "no data"),
    ],
)
def test_verdicts(percent: float, half_width: float, verdict: str) -> None:
    assert verdict_of(percent, half_width, 5.0) == verdict


def runs_of(rng: np.random.Generator, apart: float, scatter: float, seeds: int) -> pd.DataFrame:
    rows = []
    for variant, factor in (("links", 1 + apart), ("yade", 1.0)):
        for seed in range(seeds):
            row = dict.fromkeys(COLUMNS, math.nan) | {CASE: "chain", VARIANT: variant, SEED: seed}
            rows.append(row | {FORCE: factor * (1 + scatter * rng.standard_normal())})
    return pd.DataFrame(rows)


def test_verdicts_err_as_seldom_as_they_say() -> None:
    """At the very margin engines are called equivalent in one study of forty, and as often different."""
    rng = np.random.default_rng(5)
    found = [judged(runs_of(rng, 0.10, 0.02, 8))[0].verdict for _ in range(400)]
    assert found.count("equivalent") < 0.05 * 400
    assert found.count("different") < 0.05 * 400
    alike = [judged(runs_of(rng, 0.0, 0.02, 8))[0].verdict for _ in range(100)]
    assert alike.count("equivalent") > 90
    noisy = {judged(runs_of(rng, 0.0, 0.5, 3))[0].verdict for _ in range(50)}
    assert noisy <= {"not resolved", "different"}


def test_margins_are_those_that_were_asked_for() -> None:
    margins = {one.told: one.margin for one in QUANTITIES}
    assert margins["φ_0"] == margins["φ_f at rest, external"] == margins["h/h0, internal"] == 5
    assert margins["⟨N⟩ as poured"] == margins["⟨N⟩, shape-change"] == 10
    assert all(one.why for one in QUANTITIES)


def test_variants_stand_for_pitches() -> None:
    assert [pitch_of(name) for name in ("links", "pitch-0.25", "yade")] == [0, 0.25, 1]
    assert math.isnan(pitch_of("other"))


def test_a_run_of_another_study_is_listed_as_unusable(tmp_path: Path) -> None:
    other = write_run(tmp_path / "lw0.70_seed1", SyntheticRun())
    with pytest.raises(InputError, match=r"name is 'synthetic', not CASE/VARIANT; give runs of the study engines"):
        Engines().analyse([other], tmp_path / "out", **ORIGIN)


# Studies of both engines


def test_manifests_name_the_engine_and_old_ones_are_yades(tmp_path: Path) -> None:
    run = write(tmp_path, "links", 1, 1.0)
    assert read_run(run).engine == "links"
    file = run / "run.json"
    text = file.read_text(encoding="utf-8").replace('"engine": "links",', "")
    file.write_text(text, encoding="utf-8")
    assert read_run(run).engine == "yade"
    file.write_text(text.replace('"yade": "2023.02a"', '"links": "1"'), encoding="utf-8")
    assert read_run(run).engine == "links"


@pytest.mark.usefixtures("undrawn")
def test_the_comparison_with_gravish_is_judged_by_links_beside_yade(tmp_path: Path) -> None:
    runs = []
    for engine, factor, time in (("links", 1.02, 20.0), ("yade", 1.0, 1.5)):
        for seed in (1, 2, 3) if engine == "links" else (1, 2):
            level = factor * (1 + 0.003 * seed)
            packing = (0.1 * level, 0.105 * level, 0.130 * level, 0.132 * level)
            made = SyntheticRun(seed=seed, packing=packing, frames_per_phase=2, shake_time=time)
            directory = write_run(tmp_path / f"{engine}_seed{seed}", made)
            write_manifest(directory, made, engine=engine)
            runs.append(directory)
    report = Gravish(("second-highest-com",)).analyse(runs, tmp_path / "out", **ORIGIN)
    assert engines_of(report.tables["runs"]) == ("links", "yade")
    assert report.tables["summary"]["seeds [-]"].tolist() == [3, 2]
    assert ENGINE not in judging(report.tables["deviations"]).columns
    table = report.tables["engines"]
    # Shaken for other times, piles are compared as poured alone.
    assert set(table["quantity"]) == {"phi_0 second-highest-com [-]", "crossings before [-]"}
    assert table["difference [%]"].iloc[0] == pytest.approx(2.0, abs=0.1)
    assert table["pairs [-]"].iloc[0] == 2
    assert any("YADE was shaken for 1.5 s" in line for line in report.footer)
    assert "## Engines" in report.files["deviations.md"].read_text(encoding="utf-8")


@pytest.mark.usefixtures("undrawn")
def test_a_study_of_one_engine_refuses_runs_of_both(tmp_path: Path) -> None:
    from studies.sensitivity.study import Sensitivity  # noqa: PLC0415

    runs = []
    for engine in ("links", "yade"):
        made = SyntheticRun(frames_per_phase=2, phases=("deposit", "relax", "shake"))
        runs.append(write_run(tmp_path / engine / "draft_seed1", made))
        write_manifest(runs[-1], made, engine=engine)
    with pytest.raises(InputError, match=r"different engine must not be averaged: .*is links, .*is yade"):
        Sensitivity("sensitivity").analyse(runs, tmp_path / "out", **ORIGIN)


def test_without_pairs_the_comparison_has_its_columns_all_the_same() -> None:
    table = compared_engines(pd.DataFrame({"x": [1.0], SEED: [1], PHI_0: [0.1]}), ["x"], [PHI_0])
    assert table.empty
    assert {"x", "difference [%]", "pairs [-]"} <= set(table.columns)
