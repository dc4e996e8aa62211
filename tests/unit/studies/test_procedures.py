"""The study of procedures, from run directories with known packing fractions, heights and energies."""

import json
import math
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from PIL import Image
from synthetic import SyntheticRun, write_run

from dem.errors import InputError
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.points import marked
from studies.base.activity import ENERGY, HALF, HEIGHT, QUANTITIES, STRAIGHT, half_compaction
from studies.base.procedures import CROSSINGS, PHI, PROCEDURE, THETA
from studies.procedures.study import Procedures

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study procedures --out 'my study'"}
ACTIVITY = {"external": "shake", "shape-change": "shape-change", "internal": "internal-oscillation"}
# φ at rest after each procedure, and its work; all begin with 0.1 at l/w = 0.7, less at 1.0.
LEVELS = {"external": (0.11, 1e-5), "shape-change": (0.09, 1e-3), "internal": (0.125, 4e-5)}
AFTER = {5.0: 0.13, 10.0: 0.125, 30.0: 0.105}
SPREAD = {1: 0.99, 2: 1.01}
FIGURES = (
    "height_time",
    "phi_aspect",
    "crossings_aspect",
    "energy_aspect",
    "phi_theta",
    "crossings_theta",
    "energy_theta",
)


def run(procedure, *, aspect=0.7, seed=1, theta=10.0, **changes):
    after, work = LEVELS[procedure]
    after = AFTER[theta] if procedure == "internal" else after
    factor = SPREAD.get(seed, 1.0) * (1.0 if aspect == 0.7 else 0.9)
    keys = {
        "aspect_ratio": aspect,
        "seed": seed,
        "phases": ("deposit", "relax", ACTIVITY[procedure], "relax"),
        "packing": (0.1 * factor, 0.1 * factor, after * factor, after * factor),
        "frames_per_phase": 2,
        "shake_time": 5.0,
        "theta": theta,
        "work": work * (theta / 10 if procedure == "internal" else 1),
        "straight": 1.25,
    }
    return SyntheticRun(**{**keys, **changes})


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Two aspect ratios with two seeds; one run failed and one was not started."""
    root = tmp_path_factory.mktemp("study")
    directories = []
    for seed in SPREAD:
        for aspect in (0.7, 1.0):
            for procedure in LEVELS:
                for theta in AFTER if procedure == "internal" and aspect == 0.7 else (10.0,):
                    failed = (procedure, aspect, seed) == ("external", 1.0, 2)
                    made = run(procedure, aspect=aspect, seed=seed, theta=theta, status="failed" if failed else "done")
                    directories.append(write_run(root / f"{procedure}{theta:g}_lw{aspect}_seed{seed}", made))
    directories.append(root / "internal10_lw0.40_seed1")
    return root, directories, Procedures().analyse(directories, root / "out", **ORIGIN)


def point(report, procedure, aspect=0.7, theta=None):
    table = report.tables["points"]
    rows = table[(table[PROCEDURE] == procedure) & (table[ASPECT] == aspect)]
    rows = rows if theta is None else rows[rows[THETA] == theta]
    assert len(rows) == 1
    return rows.iloc[0]


def test_packing_at_rest_is_that_put_in(study):
    report = study[2]
    # Frames scatter by 0.2 % about φ, symmetrically; seeds lie 1 % to either side.
    for procedure, (after, _) in LEVELS.items():
        row = point(report, procedure, theta=10.0 if procedure == "internal" else None)
        assert row[PHI] == pytest.approx(after, rel=1e-4)
        assert row[SEEDS] == 2
        assert row[marked(PHI, "SE")] == pytest.approx(0.01 * after, rel=1e-3)
        assert row[marked(PHI, "95 %")] == pytest.approx(0.01 * after * 12.706205, rel=1e-3)
    assert point(report, "internal", theta=30.0)[PHI] == pytest.approx(0.105, rel=1e-4)


def test_static_is_every_runs_state_before_its_activity(study):
    row = point(study[2], "static")
    assert row[PHI] == pytest.approx(0.1, rel=1e-4)
    # Five runs of each seed began with the same pile: two samples, not ten.
    assert row[SEEDS] == 2
    assert row[marked(PHI, "SE")] == pytest.approx(0.001, rel=1e-3)
    assert math.isnan(row[ENERGY])
    assert "agree there within" in study[2].footer[1]


def test_static_runs_that_differ_are_told(study, tmp_path, undrawn):
    other = run("external", seed=1, packing=(0.09, 0.12, 0.12, 0.12))
    runs = [write_run(tmp_path / "a", run("internal", seed=1)), write_run(tmp_path / "b", other)]
    report = Procedures().analyse(runs, tmp_path / "out", **ORIGIN)
    assert point(report, "static")[PHI] == pytest.approx((0.099 + 0.12) / 2, rel=1e-4)
    assert "(runs of one l/w and seed agree there within 0.021 in φ)" in report.footer[1]


def test_energy_is_the_work_per_smarticle(study):
    report = study[2]
    assert point(report, "external")[ENERGY] == pytest.approx(1e-5 / 12)
    assert point(report, "shape-change")[ENERGY] == pytest.approx(1e-3 / 12)
    assert point(report, "internal", theta=30.0)[ENERGY] == pytest.approx(1.2e-4 / 12)
    costs = [f for f in report.judged if f.paper.startswith("Shape change costs")]
    assert costs[0].ours.startswith("ratio 25 ")


def test_heights_are_those_of_the_centre_of_mass(study):
    row = point(study[2], "shape-change")
    # φ falls from 0.10 to 0.09, so the height grows by the inverse.
    assert row[HEIGHT] == pytest.approx(0.1 / 0.09, rel=1e-3)
    # At half time φ has gone 1 − exp(−2.5) of its way; the straight state stands 1.25 times as high.
    there = 0.1 - 0.01 * (1 - math.exp(-2.5))
    assert row[STRAIGHT] == pytest.approx(1.25 * 0.1 / there, rel=0.02)
    assert math.isnan(row[HALF])
    assert math.isnan(point(study[2], "external")[STRAIGHT])


def test_half_of_the_compaction_is_where_it_was_put(study):
    # 1/φ is half way where φ = 2 · 0.1 · 0.125 / 0.225.
    level = (2 * 0.1 * 0.125 / 0.225 - 0.1) / 0.025
    expected = -math.log(1 - level) / 5
    assert point(study[2], "internal", theta=10.0)[HALF] == pytest.approx(expected, abs=0.015)


@pytest.mark.parametrize("share", [0.02, 0.12, 0.5, 0.9])
def test_half_compaction_of_a_broken_line(share):
    """Straight down to the final height within twice the share, or until after the end."""
    time = np.arange(-0.5, 5.5, 0.004)
    height = 1 - 0.2 * np.clip(time / (2 * share * 5), 0, 1)
    height[time > 5] = 0.8
    assert half_compaction(time, height, 5.0) == pytest.approx(share, abs=0.003)
    noise = np.random.default_rng(3).normal(0, 0.004, len(time))
    assert half_compaction(time, height + noise, 5.0) == pytest.approx(share, abs=0.03)


def test_no_compaction_has_no_half():
    time = np.arange(-0.5, 5.5, 0.004)
    assert math.isnan(half_compaction(time, np.ones_like(time), 5.0))
    assert math.isnan(half_compaction(time, 1 + 0.1 * np.clip(time / 5, 0, 1), 5.0))
    # Down only in the rest: half is reached at the end of the activity at best.
    assert half_compaction(time, np.where(time > 5, 0.8, 1.0), 5.0) == 1.0


def test_a_point_without_a_run_is_a_mean_over_the_others(study):
    row = point(study[2], "external", 1.0)
    assert row[SEEDS] == 1
    assert math.isnan(row[marked(PHI, "SE")])


def test_findings_that_lack_runs_have_no_data(study):
    found = {finding.paper: finding.verdict for finding in study[2].judged}
    assert found["Internal oscillation: ⟨N⟩ falls with θ at l/w = 0.4 to 0.5"] == "no data"
    assert found["Shape change: the centre of mass rises when the smarticles straighten"] == "found"
    assert found["Internal oscillation: lower θ packs tighter"] == "found"


def test_points_are_told_in_text_and_at_the_terminal(study):
    report = study[2]
    assert all("[" in name for name in (*QUANTITIES, THETA))
    text = report.files["findings.md"].read_text()
    assert text.count("| **found** |") == [finding.verdict for finding in report.judged].count("found")
    assert report.header == ["procedure", "θ", "l/w", "seeds", "φ_f", "φ at rest again", "⟨N⟩", "energy [J]", "h/h0"]
    assert ["static", "", "0.7", "2", "0.1000 ± 0.0010"] in [row[:5] for row in report.rows]
    assert ["internal", "30°", "0.7", "2"] in [row[:4] for row in report.rows]
    assert all(" | ".join(row) in text for row in report.rows)


def test_footers_tell_of_activities_and_of_the_paper(study):
    report = study[2]
    words = ["Study procedures, fidelity draft: 15 of 17 runs, 2 missing", "seeds 1 2 (1 to 2 per point)"]
    words += ["Savoie et al.", "second-highest-com", "θ = 10°", "Student's t"]
    words += ["active for: external 5 s, internal 5 s, shape-change 3 s"]
    text = " ".join(report.footer)
    assert not [word for word in words if word not in text]
    assert "Gravish" not in text
    for name in FIGURES:
        text = " ".join(" ".join(ElementTree.parse(report.files[f"{name}.svg"]).getroot().itertext()).split())
        assert not [word for word in [*words[:2], "second-highest-com", "More: findings.md"] if word not in text]
        assert "Gravish" not in text
    origin = json.loads(report.files["provenance.json"].read_text())
    assert origin["reference"]["doi"] == "10.1039/d2sm01573k"
    assert origin["definition"] == "second-highest-com"


def test_figures_are_drawn(study):
    report = study[2]
    for name in FIGURES:
        with Image.open(report.files[f"{name}.png"]) as image:
            pixels = np.asarray(image.convert("RGB")).astype(int)
        assert pixels.shape[1] == 1050  # 3.5 inch at 300 dots per inch
        assert (np.ptp(pixels, axis=2) > 60).mean() > 0.001, name
    svg = report.files["height_time.svg"].read_text()
    assert all(label in svg for label in ("shape change", "external oscillation", "internal oscillation"))
    assert "l/w = 0.7. Line: mean over seeds" in svg
    assert "no runs for this yet" not in report.files["phi_theta.svg"].read_text()


def test_study_of_one_run_says_what_it_can(tmp_path):
    report = Procedures().analyse([write_run(tmp_path / "a", run("external"))], tmp_path / "out", **ORIGIN)
    assert report.tables["points"][PROCEDURE].tolist() == ["static", "external"]
    # The run and its static state are a pair, without an error.
    assert {finding.verdict for finding in report.judged} <= {"no data", "not resolved"}
    assert "One seed per point: no error bars" in " ".join(report.footer)
    assert "no runs for this yet" in report.files["energy_theta.svg"].read_text()


@pytest.mark.usefixtures("undrawn")
def test_run_without_energy_or_series_is_still_measured(tmp_path):
    runs = [
        write_run(tmp_path / "a", run("shape-change", work=None)),
        write_run(tmp_path / "b", run("internal", series=False)),
    ]
    report = Procedures().analyse(runs, tmp_path / "out", **ORIGIN)
    table = report.tables["runs"].set_index(PROCEDURE)
    assert table[ENERGY].isna().all()
    assert table.loc["internal", [HALF, STRAIGHT]].isna().all()
    assert table.loc["shape-change", STRAIGHT] > 1.2
    assert table[[PHI, CROSSINGS, HEIGHT]].notna().all(axis=None)


@pytest.mark.usefixtures("undrawn")
def test_work_done_before_the_activity_does_not_count(tmp_path):
    directory = write_run(tmp_path / "a", run("internal", work=1.2e-4))
    with h5py.File(directory / "series.h5", "a") as file:
        file["motor_work_J"][...] = file["motor_work_J"][...] + 5.0
        file["motor_work_J"][-1] = math.nan
    report = Procedures().analyse([directory], tmp_path / "out", **ORIGIN)
    assert report.tables["runs"][ENERGY].tolist() == [pytest.approx(1e-5, rel=1e-6)]


def test_run_without_series_is_named_in_the_heights(tmp_path):
    runs = [write_run(tmp_path / "bare", run("internal", series=False)), write_run(tmp_path / "b", run("external"))]
    report = Procedures().analyse(runs, tmp_path / "out", **ORIGIN)
    assert "No time series of the height: bare." in report.files["height_time.svg"].read_text()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("made", "cause"),
    [
        ({"phases": ("deposit", "relax")}, "not one activity .* its phases are deposit, relax"),
        ({"phases": ("deposit", "relax", "shake")}, "not one activity .* deposit, relax, shake"),
        ({"phases": ("deposit", "relax", "shake", "shape-change", "relax")}, "not one activity"),
        ({"phases": ("deposit", "relax", "internal-oscillation", "relax"), "theta": math.inf}, "theta_deg must be"),
    ],
)
def test_run_of_another_kind_is_listed_as_unusable(tmp_path, made, cause):
    phases = made["phases"]
    other = write_run(tmp_path / "other", run("external", packing=(0.1,) * len(phases), **made))
    report = Procedures().analyse([write_run(tmp_path / "a", run("external")), other], tmp_path / "out", **ORIGIN)
    (missing,) = report.missing
    assert missing.status == "unusable"
    with pytest.raises(InputError, match=cause):
        raise InputError(missing.cause)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("text", "cause"),
    [
        (None, "cannot read scene .*: No such file"),
        ("phases: [", "cannot read scene .*: ParserError"),
        ("phases: 3", "'phases' must be a list of phases with a type"),
        ("phases: [{type: deposit}, {type: relax}, {type: shake}, {type: relax}]", "is internal-oscillation in run"),
    ],
)
def test_scene_that_does_not_fit_its_run(tmp_path, text, cause):
    good, bad = write_run(tmp_path / "a", run("external")), write_run(tmp_path / "bad", run("internal"))
    (bad / "scene.yaml").unlink()
    if text is not None:
        (bad / "scene.yaml").write_text(text)
    report = Procedures().analyse([good, bad], tmp_path / "out", **ORIGIN)
    with pytest.raises(InputError, match=cause):
        raise InputError(report.missing[0].cause)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        ({"count": 9}, "different count must not be averaged"),
        ({"shake_time": 20.0}, "different duration must not be averaged: .* external for 5 s, .* external for 20 s"),
        ({"seed": 1}, "point = external l/w 0.7 with seed 1 is given twice"),
    ],
)
def test_runs_that_cannot_be_compared_are_refused(study, tmp_path, made, message):
    other = write_run(tmp_path / "other", run("external", **{"seed": 5, **made}))
    with pytest.raises(InputError, match=message):
        Procedures().analyse([study[1][0], other], tmp_path / "out", **ORIGIN)


@pytest.mark.usefixtures("undrawn")
def test_amplitudes_are_different_points(study, tmp_path):
    twice = write_run(tmp_path / "again", run("internal", theta=30.0))
    with pytest.raises(InputError, match=r"point = internal θ 30° l/w 0\.7 with seed 1 is given twice"):
        Procedures().analyse([*study[1], twice], tmp_path / "out", **ORIGIN)
    assert study[2].tables["runs"].groupby([PROCEDURE, ASPECT, SEED]).size().max() == 3
