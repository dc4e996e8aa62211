"""The study of friction, from run directories with known packing fractions."""

import math
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
import yaml
from PIL import Image
from synthetic import SyntheticRun, write_run

from dem.errors import InputError
from studies.base.shipped import differences
from studies.framework.provenance import read_reference
from studies.framework.runs import DEFINITION
from studies.friction.findings import answers
from studies.friction.measure import FRICTION, column
from studies.friction.scatter import scatters
from studies.friction.study import Friction
from studies.friction.tables import (
    GROWTHS,
    crossings,
    curves,
    growth,
    nearest_frictions,
    points,
    verdict,
    verdicts,
)
from studies.registry import study_file
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep

ROOT = Path(__file__).parents[3]
ASPECT = "aspect ratio [-]"
ORIGIN = {"note": "quick: 3 of 6 coefficients", "command": "smarticles study friction --quick --out 'my study'"}
FRICTIONS = (0.2, 0.4, 0.5, 0.65, 0.8)
# Gravish's φ_0 and φ_f; there is no φ_0 at l/w = 1.
GRAVISH = {0.4: (0.1425, 0.163), 0.7: (0.105, 0.130), 1.0: (None, 0.105)}
SPREAD = {1: 0.998, 2: 1.0, 3: 1.002}


def runs_table(*, at=0.5, slope=0.6, relaxed=1.08, spread=SPREAD, frictions=FRICTIONS, before=None):
    """φ is Gravish's at the friction `at`, φ_0 at `before` if elsewhere, and falls by `slope` of it per 1."""
    rows = []
    for ratio, (initial, final) in GRAVISH.items():
        for friction in frictions:
            fall_0, fall_f = (1 - slope * (friction - place) for place in (at if before is None else before, at))
            for seed, factor in spread.items():
                rows.append(
                    {
                        ASPECT: ratio,
                        FRICTION: friction,
                        "seed": seed,
                        column("phi_0"): (initial or 0.09) * fall_0 * factor,
                        column("phi 5 s"): 0.9 * final * fall_f * factor,
                        column("phi 10 s"): 0.95 * final * fall_f * factor,
                        column("phi 20 s"): final * fall_f * factor,
                        column("phi_f"): final * fall_f * factor,
                        column("phi_f relaxed"): relaxed * final * fall_f * factor,
                    }
                )
    return pd.DataFrame(rows)


def tables(runs):
    scatter = scatters(runs)
    means = points(runs, read_reference(), scatter)
    found = curves(means, scatter)
    return {
        "points": means,
        "crossings": crossings(found),
        "verdicts": verdicts(found),
        "nearest": nearest_frictions(found),
        "growth": growth(runs),
    }


def answered(runs):
    found = tables(runs)
    return {
        one.question.split(",")[0]: one
        for one in answers(*(found[name] for name in ("crossings", "verdicts", "nearest", "growth")))
    }


def one_friction(what):
    return f"Does one friction bring {what} within 5 % of Gravish's at every l/w measured?"


# Scatter and means


def test_scatter_is_relative_and_pooled_over_points():
    scatter = scatters(runs_table())["phi_f"]
    assert (scatter.value, scatter.freedom) == (pytest.approx(0.002, rel=1e-3), 2 * 15)


def test_points_have_the_error_of_their_seeds_and_deviations_also_gravishs():
    row = tables(runs_table())["points"].set_index(["stage", ASPECT, FRICTION]).loc[("phi_f", 0.7, 0.5)]
    half_width = 2.042272 * 0.002 * 0.130 / math.sqrt(3)  # t(0.975; 30)
    assert row["phi [-]"] == pytest.approx(0.130)
    assert row["phi 95 % [-]"] == pytest.approx(half_width, rel=1e-3)
    assert row["deviation [%]"] == pytest.approx(0.0, abs=1e-9)
    assert row["deviation 95 % [%]"] == pytest.approx(100 * math.hypot(half_width, 0.003) / 0.130, rel=1e-3)


def test_a_stage_without_a_point_of_gravishs_has_no_crossing():
    found = tables(runs_table())["crossings"]
    assert len(found[found["stage"] == "phi_0"]) == 2
    assert len(found[found["stage"] == "phi_f"]) == 3
    assert found.set_index(["stage", ASPECT]).loc[("phi_f", 1.0), FRICTION] == pytest.approx(0.5)


# Answers. Each question is asked of data that deserve each answer.


def test_one_friction_for_all_is_found():
    found = answered(runs_table())
    assert found[one_friction("phi_0 and phi_f")].answer == "yes"
    assert "nearest at 0.50 (between measured points): 0.0 % on average over 5 points" in (
        found[one_friction("phi_0 and phi_f")].evidence
    )
    # At rest again piles are 8 % denser: another friction would do, but not together with φ_0.
    assert found[one_friction("phi_f relaxed")].answer == "yes"
    assert found[one_friction("phi_0 and phi_f relaxed")].answer != "yes"
    assert found["Is there a friction that neither phi_0 nor phi_f excludes at 95 % at any l/w?"].answer == "yes"


def test_curves_that_want_different_friction_are_refused():
    found = answered(runs_table(before=0.2, at=0.8))
    assert found[one_friction("phi_0")].answer == "yes"
    assert found[one_friction("phi_f")].answer == "yes"
    both = found[one_friction("phi_0 and phi_f")]
    assert both.answer == "no"
    assert "at most -18" in both.evidence or "at most +18" in both.evidence
    assert found["Is there a friction that neither phi_0 nor phi_f excludes at 95 % at any l/w?"].answer == "no"


def test_wide_errors_prove_nothing():
    wide = {seed: 1 + 60 * (factor - 1) for seed, factor in SPREAD.items()}
    found = answered(runs_table(spread=wide))
    assert found[one_friction("phi_0 and phi_f")].answer == "undetermined"


def test_one_seed_without_known_scatter_proves_nothing():
    found = answered(runs_table(spread={1: 1.0}))
    assert found[one_friction("phi_f")].answer == "undetermined"
    assert (
        found["Is there a friction that neither phi_0 nor phi_f excludes at 95 % at any l/w?"].evidence == "no errors"
    )
    table = tables(runs_table(spread={1: 1.0}))["crossings"]
    assert table[FRICTION].notna().all()


@pytest.mark.parametrize(("at", "answer"), [(0.4, "yes"), (0.7, "no"), (0.485, "undetermined")])
def test_the_papers_friction_is_judged_by_itself(at, answer):
    assert answered(runs_table(at=at))["Does the paper's friction"].answer == answer


@pytest.mark.parametrize(
    ("at", "as_it_comes", "clean"),
    [
        (0.5, "yes", "no"),
        (0.58, "undetermined", "no"),
        (0.75, "no", "undetermined"),
        (0.95, "no", "no"),  # clearly above all that was measured
    ],
)
def test_steel_is_answered_by_what_is_published(at, as_it_comes, clean):
    found = answered(runs_table(at=at))
    # Questions are told apart here by what stands before their first comma.
    question = "Is the friction that phi_f asks for that of"
    comes, cleaned = found[f"{question} dry steel as it comes (static"], found[f"{question} clean"]
    assert (comes.answer, cleaned.answer) == (as_it_comes, clean)
    assert "0.12 to 0.6" in comes.question
    assert "0.74 to 0.78" in cleaned.question


def test_a_few_points_refuse_a_friction_and_never_accept_one():
    def near(confidence, least):
        return {"confidence [%]": confidence, "confidence of the worst point [%]": least, "points compared [-]": 4}

    assert verdict(near(95.0, 98.0), whole=True) == "yes"
    assert verdict(near(95.0, 98.0), whole=False) == "undetermined"
    assert verdict(near(0.1, 1.2), whole=False) == "no"
    assert verdict(near(0.1, 1.3), whole=True) == "undetermined"  # errors are large, and no point is surely far off
    assert verdict(near(math.nan, math.nan), whole=True) == "undetermined"
    runs = runs_table()
    part = runs[~((runs[ASPECT] == 0.4) & (runs[FRICTION] == 0.5))]
    table = tables(part)["verdicts"].set_index(["what", FRICTION])
    assert table.loc[("phi_f", 0.5), "within 5 %"] == "undetermined"
    assert table.loc[("phi_f", 0.5), "points compared [-]"] == 2
    assert table.loc[("phi_f", 0.2), "within 5 %"] == "no"


def test_the_verdict_has_the_mean_and_the_largest_deviation():
    table = tables(runs_table(before=0.4))["verdicts"].set_index(["what", FRICTION])
    row = table.loc[("phi_0 and phi_f", 0.65)]
    # φ_0 -15 % twice, φ_f -9 % three times.
    assert row["mean absolute deviation [%]"] == pytest.approx((2 * 15 + 3 * 9) / 5)
    assert row["mean [%]"] == pytest.approx(-(2 * 15 + 3 * 9) / 5)
    assert row["largest deviation [%]"] == pytest.approx(-15.0)
    assert row["largest at"].startswith("phi_0 at l/w = ")


def test_growth_is_taken_run_by_run():
    table = growth(runs_table())
    assert table[GROWTHS[0]].tolist() == pytest.approx([100 * (0.95 / 0.9 - 1)] * 15)
    assert table[GROWTHS[1]].tolist() == pytest.approx([100 * (1 / 0.95 - 1)] * 15)
    assert table["growth from 10 to 20 s 95 % [%]"].tolist() == pytest.approx([0.0] * 15, abs=1e-9)
    still = "Does phi still grow between 10 and 20 s of shaking?"
    stronger = "Does phi grow more between 10 and 20 s where friction is stronger?"
    runs = runs_table()
    runs[column("phi 20 s")] *= 1 + 0.02 * runs[FRICTION]
    assert (answered(runs)[still].answer, answered(runs)[stronger].answer) == ("yes", "yes")
    runs[column("phi 20 s")] = runs[column("phi 10 s")] * (0.99 - 0.02 * runs[FRICTION])
    assert (answered(runs)[still].answer, answered(runs)[stronger].answer) == ("no", "no")
    assert answered(runs.drop(columns=column("phi 20 s")))[still].answer == "undetermined"


# The whole analysis, from run directories


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Two aspect ratios, three coefficients, two seeds; one failed and one not started."""
    root = tmp_path_factory.mktemp("study")
    directories = []
    for ratio in (0.7, 1.0):
        for friction in (0.2, 0.5, 0.8):
            for seed in (1, 2):
                factor = (1 + 0.01 * (-1) ** seed) * (1 - 0.6 * (friction - 0.5))
                packing = tuple(factor * share for share in (0.09, 0.105, 0.13, 0.14))
                status = "failed" if (ratio, friction, seed) == (1.0, 0.8, 1) else "done"
                run = SyntheticRun(aspect_ratio=ratio, seed=seed, packing=packing, friction=friction, status=status)
                directories.append(write_run(root / f"lw{ratio:.2f}_mu{friction:.2f}_seed{seed}", run))
    directories.append(root / "lw0.40_mu0.20_seed1")
    return root, directories, Friction().analyse(directories, root / "out", **ORIGIN)


def test_what_was_put_in_is_found(study):
    report = study[2]
    row = report.tables["runs"].set_index("run").loc["lw0.70_mu0.20_seed2"]
    factor = 1.01 * 1.18
    assert row[FRICTION] == 0.2
    assert row[f"phi_0 {DEFINITION} [-]"] == pytest.approx(0.105 * factor, rel=1e-4)
    assert row[f"phi_f {DEFINITION} [-]"] == pytest.approx(0.130 * factor, rel=1e-4)
    assert row[f"phi_f relaxed {DEFINITION} [-]"] == pytest.approx(0.140 * factor, rel=1e-4)
    for time in (5, 10, 20):
        # The series rises as 1 - exp(-5 t / 20 s); the mean over the last second lies a little below.
        value = factor * (0.105 + 0.025 * (1 - math.exp(-(time - 0.45) / 4)))
        assert row[f"phi {time} s {DEFINITION} [-]"] == pytest.approx(value, rel=2e-3)
    table = report.tables["crossings"].set_index(["stage", ASPECT])
    assert table.loc[("phi_f", 0.7), FRICTION] == pytest.approx(0.5, abs=1e-3)
    assert table.loc[("phi_f", 1.0), "lies"] == "above the range"
    assert report.tables["points"].set_index(["stage", ASPECT, FRICTION]).loc[("phi_f", 1.0, 0.8), "seeds [-]"] == 1


def test_footer_text_and_terminal_tell_the_same(study):
    report = study[2]
    assert [one.status for one in report.missing] == ["failed", "not started"]
    words = ["l/w 0.7 1, μ 0.2 0.5 0.8, seeds 1 2 (1 to 2 per point)", "shaken for 20 s", "pooled", ORIGIN["note"]]
    assert not [word for word in words if word not in " ".join(report.footer)]
    text = report.files["friction.md"].read_text()
    assert "| phi_f | 1 | 0.1050 | above 0.8 (" in text
    assert "Lust, Engineering Guide CDA3000, table 7.21" in text
    assert all(one.question in text for one in report.judged)
    assert any(line.startswith("Does one friction bring phi_f within 5 %") for line in report.told)
    assert ["phi_0", "0.7", "0.1050"] in [list(row)[:3] for row in report.rows]


def test_figures_have_colours_in_every_panel(study):
    report = study[2]
    for name, panels in (("phi_friction", 2), ("deviation_friction", 3), ("phi_time", 2)):
        with Image.open(report.files[f"{name}.png"]) as image:
            pixels = np.asarray(image.convert("RGB")).astype(int)
        width = pixels.shape[1] // panels
        for panel in range(panels):
            part = pixels[: int(0.8 * pixels.shape[0]), panel * width : (panel + 1) * width]
            assert (np.ptp(part, axis=2) > 60).mean() > 0.002, (name, panel)
    assert "Gravish, " in report.files["phi_friction.svg"].read_text()


def test_figures_tell_which_points_gravish_has_not(study):
    for name, told in {
        "phi_friction": "no φ_0 at l/w = 1.",
        "deviation_friction": "no φ_0 at l/w = 1.",
        "phi_time": "at every l/w shown.",
    }.items():
        svg = ElementTree.parse(study[2].files[f"{name}.svg"]).getroot()
        assert told in " ".join(" ".join(svg.itertext()).split()), name


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("contact", "cause"),
    [
        (None, "scene.yaml tells no contact; give runs of the study friction"),
        ({"friction_smarticle": 0.4, "friction_wall": 0.3}, "friction is 0.4 between smarticles and 0.3 at walls"),
        ({"friction_smarticle": 0.4}, "contact.friction_wall must be a finite number: got None"),
    ],
)
def test_a_run_of_no_one_friction_is_listed_as_unusable(study, tmp_path, contact, cause):
    other = shutil.copytree(study[1][0], tmp_path / "other")
    scene = yaml.safe_load((other / "scene.yaml").read_text()) | {"contact": contact}
    (other / "scene.yaml").write_text(yaml.safe_dump(scene))
    report = Friction().analyse([study[1][2], other], tmp_path / "out", **ORIGIN)
    (missing,) = report.missing
    assert missing.status == "unusable"
    assert cause in missing.cause


@pytest.mark.usefixtures("undrawn")
def test_a_run_that_was_not_shaken_is_listed_as_unusable(study, tmp_path):
    calm = SyntheticRun(phases=("deposit", "relax"), packing=(0.1, 0.1), friction=0.4)
    report = Friction().analyse([study[1][0], write_run(tmp_path / "calm", calm)], tmp_path / "out", **ORIGIN)
    assert "no packing fraction was recorded while shaking" in report.missing[0].cause


@pytest.mark.usefixtures("undrawn")
def test_short_shaking_has_no_phi_of_later_times(tmp_path):
    run = write_run(tmp_path / "short", SyntheticRun(shake_time=6.0, friction=0.4))
    report = Friction().analyse([run], tmp_path / "out", **ORIGIN)
    assert f"phi 10 s {DEFINITION} [-]" not in report.tables["runs"].columns
    assert "no run was shaken for 20 s" in " ".join(report.told)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"count": 9}, "different count must not be averaged: .* is 12 smarticles at l/w 0.7, .* is 9"),
        ({}, r"point = l/w 0.7 friction 0.2 with seed 1 is given twice"),
        ({"fidelity": "standard"}, "different fidelity must not be averaged"),
    ],
)
def test_runs_that_cannot_be_averaged_are_refused(study, tmp_path, changes, message):
    other = write_run(tmp_path / "other", SyntheticRun(**{"friction": 0.2, **changes}))
    with pytest.raises(InputError, match=message):
        Friction().analyse([study[1][0], other], tmp_path / "out", **ORIGIN)


# The sweep


def test_the_study_varies_friction_alone_and_at_the_papers_it_is_that_of_gravish():
    found = expand(load_sweep(study_file("friction")))
    assert len(found) == 3 * 6 * 8
    assert [point.scene.seed for point in found] == [seed for seed in range(1, 9) for _ in range(18)]
    twins = {
        (point.scene.smarticle.aspect_ratio, point.scene.seed): point.scene
        for point in expand(load_sweep(study_file("gravish")))
        if not point.again
    }
    for point in found:
        contact = point.scene.contact
        assert contact.friction_smarticle == contact.friction_wall == point.values["friction"]
        twin = twins[point.scene.smarticle.aspect_ratio, point.scene.seed]
        assert point.scene.model_copy(update={"name": twin.name, "contact": twin.contact}) == twin
        if contact.friction_smarticle == 0.4:
            assert contact == twin.contact


def test_the_quick_variant_says_how_it_differs():
    quick, full = (expand(load_sweep(study_file("friction", quick=quick))) for quick in (True, False))
    lines = differences(quick, full)
    assert lines[0] == "27 runs instead of 144"
    assert "fidelity: draft instead of standard" in lines
    assert "friction: only 0.2, 0.5, 0.8 of 0.2, 0.3, 0.4, 0.5, 0.65, 0.8" in lines
    assert not any(line.startswith("shake_s") for line in lines)
