"""calibrate: from the command line over waves that are sweeps to the preset."""

import json
import re
from pathlib import Path

import pytest
import yaml
from command_cases import Smarticles, WriteRun

from dem.scene.reading import load_scene, scene_hash
from studies.calibration import inference
from templates.sweep.folder import Entry, Folder, open_folder

SCENE = """\
schema_version: 1
seed: 1
count: 12
fidelity: draft
engine: links
phases:
  - {type: deposit}
  - {type: relax, duration_s: 0.3}
"""
CALIBRATION = """\
schema_version: 1
name: test
scene: scene.yaml
keys: {mu: contact.friction_smarticle, n: count}
free: {mu: {low: 0.2, high: 1.0}}
data: data.csv
budget: 24
"""
PHI = "phi second-highest-com [-] @ 1"
DATA = f"n,measure,value,error,predict\n10,{PHI},0.12,0.002,0\n12,{PHI},0.12,0.002,1\n"
RUNS = 8  # of a wave and condition


@pytest.fixture
def calibration(tmp_path: Path) -> Path:
    (tmp_path / "scene.yaml").write_text(SCENE)
    (tmp_path / "data.csv").write_text(DATA)
    file = tmp_path / "calibration.yaml"
    file.write_text(CALIBRATION)
    return file


def finish(folder: Folder, entry: Entry, write_run: WriteRun) -> None:
    """Make a run look finished; φ falls with friction, and is 0.12 at 0.6."""
    level = 0.15 - 0.05 * float(entry.values["mu"]) + 0.0005 * (int(entry.values["seed"]) % 3 - 1)
    phases = ("deposit", "relax")
    run = write_run(folder.run(entry), seed=entry.values["seed"], phases=phases, packing=(level, level))
    manifest = json.loads((run / "run.json").read_text(encoding="utf-8"))
    manifest["scene_sha256"] = entry.scene_sha256
    (run / "run.json").write_text(json.dumps(manifest), encoding="utf-8")


def test_a_dry_run_lists_the_waves(calibration: Path, smarticles: Smarticles) -> None:
    before = sorted(calibration.parent.iterdir())
    said = smarticles("calibrate", calibration, "--dry-run")
    assert said.status == 0
    rows = [line.split() for line in said.out.splitlines()]
    assert [row[:5] for row in rows[1:3]] == [["1", "8", "1", "1", "8"], ["2", "8", "2", "1", "16"]]
    assert said.out.splitlines()[-1].startswith("24 runs of a budget of 24, about ")
    assert sorted(calibration.parent.iterdir()) == before
    assert "calibrate: --out DIR is missing" in smarticles("calibrate", calibration).err


def test_a_dry_run_prices_the_parameters_that_will_be_tried(calibration: Path, smarticles: Smarticles) -> None:
    # A restitution of 0.1 asks for a time step a sixth as long as one of 0.8.
    scene = calibration.parent / "scene.yaml"
    scene.write_text(scene.read_text().replace("0.3}", "30}"))
    hours = []
    for low, high in ((0.1, 0.12), (0.8, 0.82)):
        free = f"mu: {{low: 0.2, high: 1.0}}, e: {{low: {low}, high: {high}}}"
        text = CALIBRATION.replace("mu: {low: 0.2, high: 1.0}", free).replace(
            "{mu: c", "{e: contact.restitution, mu: c"
        )
        calibration.write_text(text)
        said = smarticles("calibrate", calibration, "--dry-run")
        hours.append(float(re.findall(r"about (\S+) h of one core", said.out)[0]))
    assert hours[0] > 1.5 * hours[1]  # every run starts at the same cost


def test_waves_are_sweeps_that_the_repeated_command_continues(
    calibration: Path, smarticles: Smarticles, write_run: WriteRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inference, "MOST_STEPS", 500)
    out = calibration.parent / "out"
    words = ["calibrate", calibration, "--out", out, "--submit", "none"]
    said = smarticles(*words)
    assert said.status == 0, said.err
    assert f"{out}/wave1: 8 runs to do; start them: smarticles resume {out}/wave1" in said.out
    assert "continue with: smarticles calibrate" in said.out
    first = open_folder(out / "wave1")
    *rest, last = first.entries
    for entry in rest:
        finish(first, entry, write_run)
    # A run that failed is left out and not started again.
    first.run(last).mkdir(parents=True)
    failed = {"format": 1, "status": "failed", "cause": "a smarticle escaped", "phase": 0, "time_s": 0.1, "wall_s": 1.0}
    finish(first, last, write_run)
    (first.run(last) / "done.json").unlink()
    (first.run(last) / "failed.json").write_text(json.dumps(failed))
    said = smarticles(*words)
    assert said.status == 0, said.err
    assert "a smarticle escaped" in said.err
    assert "wave 1: 8 points, 8 runs, 1 of them failed and left out; " in said.out
    second = open_folder(out / "wave2")
    assert sorted(str(entry.values["n"]) for entry in second.entries) == ["10"] * RUNS + ["12"] * RUNS
    seeds = {entry.values["seed"] for entry in (*first.entries, *second.entries)}
    assert len(seeds) == 3 * RUNS
    for entry in second.entries:
        finish(second, entry, write_run)
    said = smarticles(*words)
    assert said.status == 0, said.err
    assert "Data fitted: 1 of 1 in their 95 % bands" in said.out
    assert "Data predicted only: 1 of 1 in their 95 % bands" in said.out
    preset = yaml.safe_load((out / "results" / "contact.yaml").read_text())
    assert preset["friction_smarticle"] == pytest.approx(0.6, abs=0.1)
    assert preset["friction_wall"] == 0.4

    # A scene that names the preset is, by its hash, the scene with its values.
    scene = calibration.parent / "named.yaml"
    scene.write_text(SCENE + "contact: {preset: out/results/contact.yaml, restitution: 0.5}\n")
    plain = calibration.parent / "plain.yaml"
    plain.write_text(SCENE + f"contact: {json.dumps({**preset, 'restitution': 0.5})}\n")
    assert scene_hash(load_scene(scene)) == scene_hash(load_scene(plain))

    (calibration.parent / "scene.yaml").write_text(SCENE.replace("0.3}", "0.4}"))
    assert "holds another sweep" in smarticles(*words).err
    calibration.write_text(CALIBRATION.replace("mu", "other"))
    assert "wave1: its runs have no variable 'other'; give" in smarticles(*words).err


def test_a_cluster_gets_one_wave_at_a_time(calibration: Path, smarticles: Smarticles) -> None:
    out = calibration.parent / "out"
    said = smarticles("calibrate", calibration, "--out", out, "--submit", "none", "--cluster", "example-large")
    assert said.status == 0, said.err
    assert "8 of 8 runs" in said.out
    assert (out / "wave1" / "jobs").is_dir()
    assert not (out / "wave2").exists()


@pytest.mark.parametrize(
    ("old", "new", "stated"),
    [
        ("n: count", "m: count", "keys: 'n' is missing; give the key of"),
        ("n: count", "n: count, m: count", "keys.m: is no variable; there are mu, n"),
        (
            "scene: scene.yaml\nkeys: {mu: contact.friction_smarticle, n: count}\n",
            "",
            "template: missing; give a scene",
        ),
        (
            "high: 1.0",
            "high: 11.0",
            "rendered for run p1_c0_r0: contact.friction_smarticle: 11.0 is out of range; use at most 10",
        ),
        ("high: 1.0", "high: 0.1", "free.mu.high: 0.1 is not above low, 0.2; exchange them"),
    ],
)
def test_wrong_files_are_rejected(calibration: Path, smarticles: Smarticles, old: str, new: str, stated: str) -> None:
    calibration.write_text(CALIBRATION.replace(old, new))
    said = smarticles("calibrate", calibration, "--dry-run")
    assert said.status == 2
    assert stated in said.err


@pytest.mark.parametrize(
    ("measure", "stated"),
    [
        ("phi second-highest [-] @ 1", "no column 'phi second-highest [-]' in phase 1, relax; did you mean"),
        ("phi second-highest-com [-] @ 2", "no phase '2'; there are 0 deposit, 1 relax"),
        ("phi second-highest-com [-] @ -3", "no phase '-3'; there are 0 deposit, 1 relax"),
        ("phi second-highest-com [-] @ last", "no phase 'last'; there are"),
        ("scene_sha256", "no column 'scene_sha256'"),
        ("peak stress [Pa]", "no column 'peak stress [Pa]' in phase 1, relax; "),  # of a phase `compress`
        ("container force [N]", "no column 'container force [N]' in phase 1, relax; did you mean 'container force "),
        ("motor work [J]", "no column 'motor work [J]'"),
        ("crossing number mean [-]", "no column 'crossing number mean [-]'"),  # on request only
    ],
)
def test_a_measure_that_runs_will_not_have_is_rejected_before_any_run(
    calibration: Path, smarticles: Smarticles, measure: str, stated: str
) -> None:
    (calibration.parent / "data.csv").write_text(f"n,measure,value,error\n10,{PHI},0.12,0.002\n12,{measure},1,0.1\n")
    out = calibration.parent / "out"
    for words in (["--dry-run"], ["--out", out, "--submit", "none"]):
        said = smarticles("calibrate", calibration, *words)
        assert said.status == 2
        assert f"data.csv: measure '{measure}': " in said.err
        assert stated in said.err
        assert len(said.err.splitlines()) == 1
    assert not out.exists()


@pytest.mark.parametrize("measure", ["crossings mean [-]", "container force x [N] @ 0", "phi voxel [-]", "time [s]"])
def test_measures_of_frames_and_series_are_accepted(calibration: Path, smarticles: Smarticles, measure: str) -> None:
    (calibration.parent / "data.csv").write_text(f"n,measure,value,error\n10,{measure},1,0.1\n")
    assert smarticles("calibrate", calibration, "--dry-run").status == 0


def test_a_condition_of_the_last_wave_alone_is_checked_at_the_start(calibration: Path, smarticles: Smarticles) -> None:
    (calibration.parent / "data.csv").write_text(DATA.replace("\n12,", "\n-12,"))
    out = calibration.parent / "out"
    said = smarticles("calibrate", calibration, "--out", out, "--submit", "none")
    assert said.status == 2
    assert "count: -12 is out of range" in said.err
    assert not out.exists()


def test_a_variable_without_effect_is_rejected(calibration: Path, smarticles: Smarticles) -> None:
    folder = calibration.parent
    text = SCENE.replace("seed: 1", "seed: {{ seed }}").replace("count: 12", "count: {{ n }}")
    (folder / "scene.yaml.j2").write_text(text + "contact: {friction_smarticle: {{ mu }}}\n")
    lines = CALIBRATION.replace("keys: {mu: contact.friction_smarticle, n: count}\n", "")
    calibration.write_text(lines.replace("scene: scene.yaml", "template: scene.yaml.j2"))
    assert smarticles("calibrate", calibration, "--dry-run").status == 0
    calibration.write_text(calibration.read_text().replace("{mu: {", "{wall: {low: 0.1, high: 0.2}, mu: {"))
    said = smarticles("calibrate", calibration, "--dry-run")
    assert said.status == 2
    assert f"free: 'wall' is no variable of {folder}/scene.yaml.j2; " in said.err
    (folder / "data.csv").write_text(
        DATA.replace("n,", "n,note,").replace("\n10,", "\n10,a,").replace("\n12,", "\n12,b,")
    )
    assert "'note' is no variable" in smarticles("calibrate", calibration, "--dry-run").err


def test_a_dry_run_checks_a_table_of_runs(calibration: Path, smarticles: Smarticles) -> None:
    table = calibration.parent / "runs.csv"
    calibration.write_text(CALIBRATION + "waves: 1\n")
    rows = [f"0.{mu},{n},0.1" for mu in range(2, 8) for n in ("10", "12.000000000001")]
    table.write_text("\n".join([f"mu,n,{PHI}", *rows, "0.7,14,0.1\n"]))
    words = ["calibrate", calibration, "--dry-run", "--table", table]
    said = smarticles(*words)
    assert (said.status, said.out) == (0, f"{table}: 12 of 13 runs are at conditions of the data\n")
    assert "1 of 13 runs are left out: no data are at n 14" in said.err
    table.write_text("mu,n\n0.5,10\n")
    assert f"column '{PHI}' is missing; columns are mu, n" in smarticles(*words).err
