"""The studies of sensitivity, from run directories with known packing fractions."""

import math
import shutil
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from synthetic import SyntheticRun, write_run

from dem.errors import InputError
from studies.framework.runs import DEFINITION
from studies.sensitivity.study import Sensitivity

PHI_0, PHI_F = f"phi_0 {DEFINITION} [-]", f"phi_f {DEFINITION} [-]"
ORIGIN = {"note": "the full study as shipped", "command": "smarticles study sensitivity --out 'my study'"}
# φ_0 and φ_f of each variant; seeds lie 1 % to either side.
LEVELS = {"draft": (0.100, 0.120), "pitch-0.5": (0.100, 0.120), "two-rows": (0.110, 0.108)}
SPREAD = {1: 0.99, 2: 1.0, 3: 1.01}


def run(**changes):
    keys = {
        "phases": ("deposit", "relax", "shake"),
        "shake_time": 1.5,
        "frames_per_phase": 2,
        "packing": (0.1, 0.1, 0.12),
    }
    return SyntheticRun(**{**keys, **changes})


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Three variants with three seeds each, of which one failed, and a fourth that was not started."""
    root = tmp_path_factory.mktemp("study")
    directories = []
    for variant, (before, after) in LEVELS.items():
        for seed, factor in SPREAD.items():
            status = "failed" if (variant, seed) == ("two-rows", 3) else "done"
            made = run(seed=seed, packing=(0.1, before * factor, after * factor), status=status)
            directories.append(write_run(root / f"{variant}_seed{seed}", made))
    directories.append(root / "diameter-1.27mm_seed1")
    return root, directories, Sensitivity("sensitivity").analyse(directories, root / "out", **ORIGIN)


def test_means_and_changes_are_those_put_in(study):
    report = study[2]
    table = report.tables["summary"].set_index("variant")
    assert report.told == ("Changes are against draft; * beyond the error at 95 %.",)
    assert list(table.index) == [*LEVELS, "diameter-1.27mm"]
    assert table["seeds [-]"].tolist() == [3, 3, 2, 0]
    assert table.loc["draft", PHI_0] == pytest.approx(0.100, rel=1e-4)
    assert table.loc["draft", PHI_F] == pytest.approx(0.120, rel=1e-4)
    # s/√n = 1 %/√3, times t(0.975; 2).
    assert table.loc["draft", f"phi_f {DEFINITION} 95 % [-]"] == pytest.approx(
        0.0012 / math.sqrt(3) * 4.302653, rel=1e-3
    )
    # Two seeds of 0.99 and 1.00.
    assert table.loc["two-rows", "phi_0 change [%]"] == pytest.approx(100 * (1.1 * 0.995 - 1), abs=0.02)
    assert table.loc["two-rows", "phi_f change [%]"] == pytest.approx(100 * (0.9 * 0.995 - 1), abs=0.02)


def test_a_change_is_clear_only_beyond_its_error(study):
    table = study[2].tables["summary"].set_index("variant")
    # Nothing was changed, seed by seed: no change may be found, and its error is no zero.
    assert table.loc["pitch-0.5", "phi_f change [%]"] == pytest.approx(0, abs=1e-6)
    error = 1.0 / math.sqrt(3) * math.sqrt(2) * 2.776445  # t(0.975; 4): equal spreads of 1 %
    assert table.loc["pitch-0.5", "phi_f change 95 % [%]"] == pytest.approx(error, rel=1e-3)
    assert not table.loc["pitch-0.5", ["phi_0 clear", "phi_f clear"]].any()
    assert table.loc["two-rows", ["phi_0 clear", "phi_f clear"]].all()
    assert not table.loc["draft", ["phi_0 clear", "phi_f clear", "crossings after clear"]].any()


def test_variant_without_a_finished_run_stays_empty(study):
    row = study[2].tables["summary"].set_index("variant").loc["diameter-1.27mm"]
    assert row[[PHI_0, PHI_F, "phi_0 change [%]", "phi_f change 95 % [%]"]].isna().all()
    assert not row["phi_f clear"]


def test_changes_beyond_their_error_are_bold(study):
    rows = [line for line in study[2].files["summary.md"].read_text().splitlines() if line.startswith("| ")]
    assert rows[2].startswith("| draft | 3 | 0.1000 ± 0.0025 | - | 0.1200 ± 0.0030 | - |")
    assert "| **+9.5 ± " in rows[4]
    assert "**" not in rows[3]
    assert rows[5] == "| diameter-1.27mm | 0 | - | - | - | - | - | - |"


def test_footers_tell_of_seeds_and_of_the_baseline(study):
    report = study[2]
    words = ["Study sensitivity, fidelity draft: 8 of 10 runs, 2 missing", "seeds 1 2 3 (2 to 3 per variant)"]
    words += [DEFINITION, "baseline draft", "Welch"]
    svg = ElementTree.parse(report.files["sensitivity.svg"]).getroot()
    assert not [word for word in words if word not in " ".join(report.footer)]
    shown = " ".join(" ".join(svg.itertext()).split())
    assert not [word for word in words[:4] if word not in shown]


def test_figure_has_a_row_per_variant_and_gravish(study):
    report = study[2]
    svg = report.files["sensitivity.svg"].read_text()
    assert all(variant in svg for variant in report.tables["summary"]["variant"])
    assert "Gravish et al. 2012" in svg
    assert "baseline, 95 %" in svg
    with Image.open(report.files["sensitivity.png"]) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert pixels.shape[1] == 1575  # 5.25 inch at 300 dots per inch
    half = pixels.shape[1] // 2
    for panel in (pixels[:, :half], pixels[:, half:]):
        assert (np.ptp(panel, axis=2) > 100).mean() > 0.002  # lines and markers in each


def test_without_a_point_of_gravish_there_is_no_line(tmp_path):
    directory = write_run(tmp_path / "draft_seed1", run(aspect_ratio=0.65))
    report = Sensitivity("sensitivity").analyse([directory], tmp_path / "out", **ORIGIN)
    assert "Gravish et al. 2012" not in report.files["sensitivity.svg"].read_text().split("Small dots")[0]
    assert "no φ_0 at l/w = 0.65; no φ_f at l/w = 0.65." in report.files["sensitivity.svg"].read_text()
    assert "Gravish has no point at this l/w" in report.files["summary.md"].read_text()
    assert "One seed per variant: no error bars" in report.footer[1]


@pytest.mark.usefixtures("undrawn")
def test_baseline_without_a_finished_run_leaves_no_changes(study, tmp_path):
    report = Sensitivity("sensitivity").analyse([tmp_path / "standard_seed1", *study[1]], tmp_path / "out", **ORIGIN)
    assert "against standard;" in report.told[0]
    assert report.tables["summary"][["phi_0 change [%]", "phi_f change [%]"]].isna().all(axis=None)
    assert report.tables["summary"][PHI_0].notna().sum() == 3


@pytest.mark.parametrize(
    ("name", "made", "message"),
    [
        ("x_seed1", {"aspect_ratio": 0.5}, "different l/w must not be averaged: .* is 0.7, .*x_seed1 is 0.5"),
        ("x_seed1", {"count": 9}, "different count must not be averaged: .* is 12 smarticles, .* is 9 smarticles"),
        ("a/draft_seed1", {}, r"variant = draft with seed 1 is given twice, .*draft_seed1 and .*a/draft_seed1"),
    ],
)
def test_runs_that_cannot_be_compared_are_refused(study, tmp_path, name, made, message):
    other = write_run(tmp_path / name, run(**made))
    with pytest.raises(InputError, match=message):
        Sensitivity("sensitivity").analyse([study[1][0], other], tmp_path / "out", **ORIGIN)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("draft", "not a run of this study: its runs are named VARIANT_seedN, such as draft_seed1"),
        ("two-rows_seed9", "its name says seed 9, run.json says 1; do not rename runs"),
    ],
)
def test_run_of_another_name_is_listed_as_unusable(study, tmp_path, name, cause):
    other = shutil.copytree(study[1][0], tmp_path / name)
    report = Sensitivity("sensitivity").analyse([study[1][0], other], tmp_path / "out", **ORIGIN)
    (missing,) = report.missing
    assert missing.status == "unusable"
    assert cause in missing.cause
