"""accuracy, and plan with limits: from the command line to the advice."""

import json
from pathlib import Path

import pytest
from command_cases import Smarticles, WriteRun

from templates.sweep.folder import open_folder

SCENE = """\
schema_version: 1
seed: 1
count: 12
fidelity: draft
phases:
  - {type: deposit}
  - {type: relax, duration_s: 0.3}
  - {type: shake, duration_s: 1}
"""
# φ_f of each setting; seeds lie 1 % to either side.
LEVELS = {"base": 0.132, "standard": 0.1215, "reference": 0.120}


@pytest.fixture
def base(tmp_path: Path) -> Path:
    file = tmp_path / "base.yaml"
    file.write_text(SCENE, encoding="utf-8")
    return file


def finish(directory: Path, write_run: WriteRun) -> None:
    """Make every run of a ladder of fidelities look finished."""
    folder = open_folder(directory)
    for entry in folder.entries:
        setting, seed = str(entry.values["setting"]), int(entry.values["seed"])
        level = LEVELS[setting] * (1 + 0.01 * (seed - 2))
        run = write_run(
            folder.run(entry),
            seed=seed,
            fidelity="draft" if setting == "base" else setting,
            phases=("deposit", "relax", "shake"),
            packing=(0.1, 0.1 * (1 + 0.01 * (seed - 2)), level),
            frames_per_phase=2,
            wall_s={"base": 1.0, "standard": 3.0, "reference": 30.0}[setting],
        )
        manifest = json.loads((run / "run.json").read_text(encoding="utf-8"))
        manifest["scene_sha256"] = entry.scene_sha256
        (run / "run.json").write_text(json.dumps(manifest), encoding="utf-8")


def written(base: Path, out: Path, smarticles: Smarticles, *words: str) -> None:
    """Write a ladder without starting a run: there is nothing to analyse yet."""
    assert smarticles("accuracy", base, "--out", out, "--knobs", "fidelity", "--analyse", *words).status == 2


def test_a_dry_run_shows_ladder_and_hours_and_writes_nothing(base: Path, smarticles: Smarticles) -> None:
    before = sorted(base.parent.iterdir())
    said = smarticles("accuracy", base, "--dry-run", "--jobs", "2")
    assert said.status == 0
    lines = said.out.splitlines()
    assert lines[0].split()[:3] == ["parameter", "value", "setting"]
    assert lines[1].split()[:3] == ["time-step", "0.9", "base"]
    assert lines[3].split()[:4] == ["time-step", "0.225", "time-step-0.225", "reference"]
    assert sum("reference" in line.split()[2:] for line in lines) >= 5
    assert lines[-1].startswith("13 settings × 3 seeds = 39 runs, about ")
    assert lines[-1].endswith(" with 2 at once")
    assert said.err == ""
    assert sorted(base.parent.iterdir()) == before


def test_a_ladder_is_an_ordinary_sweep(base: Path, tmp_path: Path, smarticles: Smarticles) -> None:
    out = tmp_path / "ladder"
    written(base, out, smarticles)
    manifest = json.loads((out / "sweep.json").read_text(encoding="utf-8"))
    assert manifest["name"] == "accuracy"
    assert set(manifest["files"]) == {"accuracy.yaml", "accuracy.yaml.j2"}
    assert "restitution: {{ restitution }}" in manifest["files"]["accuracy.yaml.j2"]
    said = smarticles("status", out)
    assert said.out.splitlines()[-1] == "accuracy: 9 runs, 9 missing"
    assert len(list((out / "scenes").iterdir())) == 9


def test_a_finished_ladder_is_analysed_and_feeds_the_planner(
    base: Path, tmp_path: Path, smarticles: Smarticles, write_run: WriteRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("smarticles.commands.study._draw", lambda *_: None)
    out = tmp_path / "ladder"
    written(base, out, smarticles)
    finish(out, write_run)
    # Nothing is missing, so nothing is started.
    said = smarticles("accuracy", base, "--out", out, "--knobs", "fidelity")
    assert said.status == 0
    assert "base_seed1 finished before" in said.err
    assert "use standard, " in said.out
    assert "and 3.3 % in φ cannot be excluded" in said.out
    table = out / "results" / "work_precision.csv"
    assert table.is_file()
    assert (out / "results" / "accuracy.png").is_file()

    limited = smarticles("plan", base, "--max-error", "0.05", "--table", table)
    assert limited.status == 0
    assert limited.out.startswith("engine yade, fidelity standard: the cheapest within --max-error 0.05\n")
    assert "smarticles of 25 spheres" in limited.out
    answer = json.loads(smarticles("plan", base, "--max-hours", "1000", "--table", table, "--json").out)
    assert answer["choice"]["fidelity"] == "reference"
    assert answer["spheres_per_smarticle"] > 100
    rejected = smarticles("plan", base, "--max-error", "0.001", "--max-hours", "0.01", "--table", table)
    assert rejected.status == 2
    assert "contradict each other: reference on yade, the cheapest within the error" in rejected.err
    assert "the hours give way" in rejected.err


def test_more_seeds_and_knobs_are_added_in_the_directory(
    base: Path, tmp_path: Path, smarticles: Smarticles, write_run: WriteRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("smarticles.commands.study._draw", lambda *_: None)
    monkeypatch.setattr("studies.framework.study.Study.draw", lambda *_: [])
    out = tmp_path / "ladder"
    written(base, out, smarticles, "--seeds", "1,2")
    finish(out, write_run)
    said = smarticles("accuracy", base, "--out", out, "--knobs", "fidelity", "--seeds", "1,2,3", "--analyse")
    assert said.status == 0
    assert smarticles("status", out).out.splitlines()[-1] == "accuracy: 9 runs, 6 done, 3 missing"
    assert len(list((out / "scenes").iterdir())) == 9
    # Fewer than there are is another sweep.
    fewer = smarticles("accuracy", base, "--out", out, "--knobs", "fidelity", "--seeds", "1", "--analyse")
    assert fewer.status == 2
    assert "only in the directory: " in fewer.err
    # So is another scene.
    base.write_text(SCENE.replace("count: 12", "count: 13"), encoding="utf-8")
    other = smarticles("accuracy", base, "--out", out, "--knobs", "fidelity", "--seeds", "1,2,3,4", "--analyse")
    assert other.status == 2
    assert "of another scene: " in other.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("accuracy --knobs timestep", "--parameters: 'timestep' does not exist; did you mean 'time-step'?"),
        ("accuracy --seeds ,", "--seeds ',': must be whole numbers from 0, such as 1,2,3"),
        ("accuracy", "accuracy: --out DIR is missing; give a directory, or --dry-run to only show the ladder"),
        ("plan --max-error 0.03 --table {base}", "has no column 'knob', so it is no table of work and precision"),
        ("plan --max-error 0.03 --table absent.csv", "absent.csv: cannot be read (No such file or directory)"),
    ],
)
def test_bad_input_is_one_line_and_status_2(words: str, message: str, base: Path, smarticles: Smarticles) -> None:
    command, *options = words.format(base=base).split()
    said = smarticles(command, base, *options)
    assert said.status == 2
    (line,) = said.err.splitlines()
    assert line.startswith("smarticles: error: ")
    assert message in line


def test_without_a_directory_no_ladder_is_built(
    base: Path, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studies.accuracy.build_ladder", None)
    said = smarticles("accuracy", base)
    assert "--out DIR is missing" in said.err


def test_without_a_table_the_planner_says_how_to_make_one(
    base: Path, tmp_path: Path, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dem.plan.choice.SHIPPED", tmp_path / "none.csv")
    said = smarticles("plan", base, "--max-hours", "4")
    assert said.status == 2
    assert "make one: smarticles accuracy SCENE.yaml --out DIR, then --table DIR/results/work_precision.csv" in said.err
