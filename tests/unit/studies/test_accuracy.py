"""The ladder of accuracy: verdicts from made-up numbers, and a whole analysis from made-up run directories."""

import json
import math
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from synthetic import SyntheticRun, write_run
from synthetic.hooked import weight, write_hooked_run

from dem.errors import InputError
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.points import marked
from studies.accuracy.advice import advise, told_closing
from studies.accuracy.measure import (
    ACTIVITY,
    COMPARED,
    COST,
    COUNT,
    EXPECTED,
    GAP,
    RESIDUAL,
    SPHERES,
    TIME_STEP,
    WALL,
    work_precision,
)
from studies.accuracy.rung import Rung
from studies.accuracy.study import TABLE, Accuracy
from studies.base.variants import VARIANT
from studies.framework.runs import DEFINITION, ENGINE

PHI_F = f"phi_f {DEFINITION} [-]"
STEPS = [
    Rung(knob="time-step", value="0.9", unit="", setting="base"),
    Rung(knob="time-step", value="0.45", unit="", setting="half"),
    Rung(knob="time-step", value="0.225", unit="", setting="quarter"),
]
RESTITUTIONS = [
    Rung(knob="restitution", value="0.2", unit="", setting="bouncy"),
    Rung(knob="restitution", value="0.7", unit="", setting="base"),
]
COSTS = {"base": 1.0, "half": 2.0, "quarter": 4.0, "bouncy": 3.0}


def table_of(phi_f, rungs=STEPS, *, phi_0=None, apart=0.0):
    """The table of work and precision of runs whose φ_f is given by setting, one value per seed.

    Costs of a setting rise by a share, `apart`, from seed to seed.
    """
    rows = [
        {
            **{VARIANT: setting, SEED: seed, ASPECT: 0.7, COUNT: 60, ACTIVITY: "shake", TIME_STEP: 1e-5, SPHERES: 18},
            ENGINE: "yade",
            **{COST: COSTS[setting] * (1 + apart * seed), WALL: 10.0, EXPECTED: 1.0, RESIDUAL: math.nan, GAP: math.nan},
            **{COMPARED["phi_0"]: (phi_0 or {}).get(setting, 0.1) + 1e-3 * seed, COMPARED["phi_f"]: value},
            COMPARED["height"]: 3e-3 + 1e-4 * seed,
            COMPARED["crossings"]: 3.0 + 0.1 * seed,
            COMPARED["hook_force"]: math.nan,
        }
        for setting, values in phi_f.items()
        for seed, value in enumerate(values, start=1)
    ]
    return work_precision(pd.DataFrame(rows), rungs)


def verdicts(table):
    return dict(zip(table[VARIANT], table["verdict"], strict=True))


def test_errors_and_bands_are_those_put_in():
    table = table_of({"base": [0.132, 0.133, 0.134], "quarter": [0.120, 0.121, 0.122]}).set_index(VARIANT)
    assert table.loc["base", "phi_f error [%]"] == pytest.approx(100 * (0.133 / 0.121 - 1))
    # Two means of standard error 0.001/√3 each; t(0.975; 4).
    assert table.loc["base", "phi_f error 95 % [%]"] == pytest.approx(
        100 / 0.121 * 2.776445 * 0.001 * math.sqrt(2 / 3), rel=1e-6
    )
    assert table.loc["quarter", "phi_f error [%]"] == 0
    assert table.loc["quarter", "phi_f error 95 % [%]"] == pytest.approx(100 / 0.121 * 2.776445 * 0.001 / math.sqrt(3))
    assert table.loc["base", marked(PHI_F, "SE")] == pytest.approx(0.001 / math.sqrt(3))
    assert table.loc["half", "seeds [-]"] == 0
    assert math.isnan(table.loc["half", "phi_f error [%]"])


def test_error_bars_of_costs_are_of_the_kind_of_all_others():
    """Not one standard error across beside 95 % upright."""
    table = table_of({"base": [0.132, 0.133], "quarter": [0.120, 0.121]}, apart=0.01).set_index(VARIANT)
    # Two seeds 1 % apart; t(0.975; 1).
    assert table.loc["base", marked(COST, "SE")] == pytest.approx(0.005)
    assert table.loc["base", marked(COST, "95 %")] == pytest.approx(0.005 * 12.706205)


def test_pure_scatter_is_not_resolved():
    # Null case: every setting has the same distribution. Of many draws at most a few per cent may be resolved in φ_f.
    draw = np.random.default_rng(0)
    resolved = 0
    for _ in range(200):
        values = {name: 0.12 + 0.004 * draw.standard_normal(3) for name in ("base", "half", "quarter")}
        resolved += int(table_of(values)["phi_f resolved"].sum())
    assert 1 <= resolved <= 0.08 * 400
    table = table_of({name: [0.118, 0.120, 0.122] for name in ("base", "half", "quarter")})
    assert verdicts(table) == {"base": "not resolved", "half": "not resolved", "quarter": "reference"}
    advice = advise(table)
    assert advice.use == "0.9"
    assert advice.cheaper
    assert "0.9 will do at 1 s/s, 4 times as fast as 0.225" in advice.sentence
    assert "not resolved with 3 seeds" in advice.sentence
    assert "3.3 % in φ_f, " in advice.sentence  # t(0.975; 6) · 0.002 · √(2/3) / 0.120
    assert told_closing([advice], table).startswith("Use time-step 0.9 (3.3 %): each is the cheapest whose errors")
    assert "Not resolved is not equal" in told_closing([advice], table)


def test_a_clear_trend_is_resolved():
    spread = np.array([-0.0005, 0, 0.0005])
    table = table_of({"base": 0.132 + spread, "half": 0.126 + spread, "quarter": 0.120 + spread})
    assert verdicts(table) == {"base": "resolved", "half": "resolved", "quarter": "reference"}
    advice = advise(table)
    assert advice.use == "0.225"
    assert not advice.cheaper
    # +5 % less the band, t(0.975; 6) · 0.0005 · √(2/3) / 0.120 = 0.83 %: all three settings tell the scatter.
    assert "0.45, the nearest, is off by +5.0 ± 0.8 % in φ_f, 4.2 % beyond its band." in advice.sentence
    assert told_closing([advice], table) == "Nothing cheaper than the reference will do for time-step (0.225)."


def test_the_cheapest_unresolved_rung_is_named_and_a_finer_resolved_one_with_it():
    spread = np.array([-0.0005, 0, 0.0005])
    table = table_of({"base": 0.126 + spread, "half": 0.120 + spread, "quarter": 0.120 + spread})
    assert advise(table).use == "0.45"
    odd = table_of({"base": 0.120 + spread, "half": 0.126 + spread, "quarter": 0.120 + spread})
    assert advise(odd).use == "0.9"
    assert advise(odd).sentence.endswith("But errors of a finer rung are resolved: 0.45.")


def test_another_measure_can_resolve_what_phi_f_does_not():
    same = [0.118, 0.120, 0.122]
    table = table_of({"base": same, "quarter": same}, phi_0={"base": 0.11})
    assert verdicts(table)["base"] == "resolved"
    assert table.loc[0, ["phi_0 resolved", "phi_f resolved", "crossings resolved"]].tolist() == [True, False, False]
    assert "0.9, the nearest, is off by +9.8 ± 2.2 % in φ_0, 7.6 % beyond its band." in advise(table).sentence


def test_one_seed_resolves_nothing_however_large_the_error():
    table = table_of({"base": [0.2], "half": [0.15], "quarter": [0.1]})
    assert verdicts(table) == {"base": "unknown", "half": "unknown", "quarter": "reference"}
    assert not table[[f"{name} resolved" for name in COMPARED]].any(axis=None)
    advice = advise(table)
    assert advice.use is None
    assert "nothing can be resolved against 0.225: an error needs two seeds of both" in advice.sentence
    assert told_closing([advice], table).startswith("Nothing can be recommended yet")


def test_the_finest_rung_with_runs_stands_in_for_one_without():
    spread = np.array([-0.0005, 0, 0.0005])
    table = table_of({"base": 0.126 + spread, "half": 0.120 + spread, "quarter": [0.1]})
    assert set(table["reference"]) == {"half"}
    assert verdicts(table) == {"base": "resolved", "half": "reference", "quarter": "resolved"}
    assert advise(table).sentence.endswith("Its finest rung, 0.225, lacks finished runs.")


def test_with_a_single_rung_there_is_nothing_to_compare():
    table = table_of({"half": [0.12, 0.121]})
    assert verdicts(table) == {"base": "unknown", "half": "reference", "quarter": "unknown"}
    assert advise(table).sentence == "time-step: only 0.45 has finished runs; there is nothing to compare it with."


def test_a_sensitivity_is_compared_with_the_scene_itself_and_recommends_nothing():
    spread = np.array([-0.0005, 0, 0.0005])
    table = table_of({"base": 0.120 + spread, "bouncy": 0.132 + spread}, RESTITUTIONS)
    assert verdicts(table) == {"bouncy": "resolved", "base": "reference"}
    advice = advise(table)
    assert advice.use is None
    assert "a matter of what is modelled, not of accuracy; against 0.7, resolved: 0.2 (" in advice.sentence
    # No finer rung stands in for the scene itself.
    missing = table_of({"bouncy": 0.132 + spread}, RESTITUTIONS)
    assert set(missing["verdict"]) == {"unknown"}
    assert "the reference is missing: no run of the scene itself is finished, only of 0.2." in advise(missing).sentence


# -- whole analyses ------------------------------------------------------------------------------------------------

ORIGIN = {"note": "knobs time-step of scene.yaml", "command": "smarticles accuracy scene.yaml --out 'my ladder'"}
LEVELS = {"base": 0.130, "half": 0.120, "quarter": 0.120, "bouncy": 0.121}


def run(**changes):
    keys = {"phases": ("deposit", "relax", "shake", "relax"), "shake_time": 2.0, "frames_per_phase": 2}
    return SyntheticRun(**{**keys, **changes})


@pytest.fixture(scope="module")
def ladder(tmp_path_factory):
    """Four settings with three seeds each, of which one failed and one was not started."""
    root = tmp_path_factory.mktemp("ladder")
    directories = []
    for setting, level in LEVELS.items():
        for seed, factor in {1: 0.999, 2: 1.0, 3: 1.001}.items():
            directories.append(root / f"{setting}_seed{seed}")
            if (setting, seed) == ("half", 3):
                continue
            made = run(
                seed=seed,
                packing=(0.1, 0.1 * factor, level * factor, 0.2),
                wall_s=COSTS[setting] * 2.0,
                fidelity="standard" if setting == "quarter" else "draft",
                status="failed" if (setting, seed) == ("bouncy", 1) else "done",
                more=(
                    ("energy_residual_J", -2e-6),
                    ("dissipated_energy_J", 1e-3),
                    ("joint_gap_m", 3e-6),
                ),
            )
            write_run(directories[-1], made)
    expected = {path.name: 4.0 for path in directories}
    report = Accuracy(rungs=STEPS + RESTITUTIONS, expected_s=expected).analyse(directories, root / "out", **ORIGIN)
    return root, directories, report


def test_runs_are_measured(ladder):
    runs = ladder[2].tables["runs"].set_index("run")
    row = runs.loc["base_seed2"]
    assert row[COST] == pytest.approx(1.0)  # 2 s for 2 s of shaking
    assert row[WALL] == pytest.approx(8.0)  # four phases
    assert row[EXPECTED] == pytest.approx(2.0)
    assert row[PHI_F] == pytest.approx(0.130, rel=1e-4)  # at the end of shaking, not of the relaxation after it
    assert row[COMPARED["phi_0"]] == pytest.approx(0.1, rel=1e-4)
    assert row[RESIDUAL] == pytest.approx(2e-3)
    assert row[GAP] == pytest.approx(3e-6)
    assert len(runs) == 10


def test_the_report_advises(ladder):
    report = ladder[2]
    table = report.tables[TABLE].set_index(["knob", VARIANT])
    assert table.loc[("time-step", "base"), "phi_f error [%]"] == pytest.approx(100 * (0.13 / 0.12 - 1), rel=1e-3)
    assert table.loc[("time-step", "base"), "verdict"] == "resolved"
    assert table.loc[("time-step", "half"), "seeds [-]"] == 2
    assert report.judged[0].use == "0.45"
    assert report.told[-1].startswith("Use time-step 0.45 (")


def test_footers_tell_of_seeds_and_of_every_reference(ladder):
    report = ladder[2]
    words = ["Study accuracy, fidelity draft, standard: 10 of 12 runs, 2 missing", "2 to 3 per setting"]
    words += ["activity: shake", DEFINITION, "pooled over all settings", "time-step 0.225, restitution 0.7"]
    assert not [word for word in words if word not in " ".join(report.footer)]
    svg = ElementTree.parse(report.files["accuracy.svg"]).getroot()
    shown = " ".join(" ".join(svg.itertext()).split())
    assert not [word for word in [*words[:4], "scatter pooled over all points"] if word not in shown]
    origin = json.loads(report.files["provenance.json"].read_text())
    assert origin["reference"] == {"time-step": "quarter", "restitution": "base"}


def test_the_text_tells_the_closing_and_marks_what_is_resolved(ladder):
    lines = ladder[2].files["accuracy.md"].read_text().splitlines()
    assert f"**{ladder[2].told[-1]}**" in lines
    row = next(line for line in lines if line.startswith("| time-step | 0.9 |"))
    assert "| +8.3 ± " in row
    assert " * | " in row


def test_the_figure_has_a_marker_per_knob_and_a_band(ladder):
    report = ladder[2]
    svg = report.files["accuracy.svg"].read_text()
    for word in (
        "time-step",
        "restitution (sensitivity)",
        "seed-to-seed band, 95 %",
        "processor time per simulated time [s/s]",
    ):
        assert word in svg
    with Image.open(report.files["accuracy.png"]) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert pixels.shape[1] == 2100  # 7 inch at 300 dots per inch
    for panel in np.array_split(pixels, 3, axis=1):
        assert (np.ptp(panel, axis=2) > 100).mean() > 0.001


def test_a_ladder_with_one_seed_is_drawn_without_a_band(ladder, tmp_path):
    first = [path for path in ladder[1] if path.name.endswith("seed2")]
    report = Accuracy(rungs=STEPS).analyse(first, tmp_path / "out", **ORIGIN)
    assert "seed-to-seed band, 95 %" not in report.files["accuracy.svg"].read_text()
    assert report.told[-1].startswith("Nothing can be recommended yet")
    assert report.tables[TABLE][EXPECTED].isna().all()


def test_scenes_with_a_hook_are_compared_by_its_peak_force_too(tmp_path):
    # In units of the weight of one smarticle: constant forces, so that the peak is known.
    phases = ("deposit", "relax", "shake", "pull-hook")
    directories = []
    for setting, load in {"base": 3.0, "quarter": 2.0}.items():
        for seed in (1, 2):
            made = run(phases=phases, seed=seed, packing=(0.1,) * 4)
            force = weight(made) * (load + 0.1 * seed)
            directories.append(
                write_hooked_run(
                    tmp_path / f"{setting}_seed{seed}", made, lambda time, force=force: np.full_like(time, force)
                )
            )
    report = Accuracy(rungs=STEPS).analyse(directories, tmp_path / "out", **ORIGIN)
    table = report.tables[TABLE].set_index(VARIANT)
    assert table.loc["base", COMPARED["hook_force"]] == pytest.approx(3.15 / run().count)
    assert table.loc["base", "hook_force error [%]"] == pytest.approx(100 * (3.15 / 2.15 - 1))
    assert table.loc["base", "hook_force resolved"]
    assert "F_peak" in (tmp_path / "out" / "accuracy.md").read_text()
    assert "nan" not in report.told[-1]


@pytest.mark.parametrize(
    ("name", "made", "message"),
    [
        ("x_seed1", {"aspect_ratio": 0.5}, "different l/w must not be averaged"),
        ("x_seed1", {"count": 9}, "different count must not be averaged"),
        ("x_seed1", {"phases": ("deposit", "shake")}, "different phases must not be averaged"),
        ("a/base_seed1", {}, "setting = base with seed 1 is given twice"),
    ],
)
def test_runs_that_cannot_be_compared_are_refused(ladder, tmp_path, name, made, message):
    other = write_run(tmp_path / name, run(**made))
    with pytest.raises(InputError, match=message):
        Accuracy(rungs=STEPS).analyse([ladder[1][0], other], tmp_path / "out", **ORIGIN)


@pytest.mark.usefixtures("undrawn")
def test_a_run_without_activity_is_unusable(ladder, tmp_path):
    other = write_run(tmp_path / "half_seed1", run(phases=("deposit", "relax")))
    report = Accuracy(rungs=STEPS).analyse([ladder[1][0], other], tmp_path / "out", **ORIGIN)
    assert "no activity after another phase: its phases are deposit, relax" in report.missing[0].cause
