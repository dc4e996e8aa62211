"""sweep, status, resume, study: from the command line to the directory."""

import json
import re
from pathlib import Path

import pytest
from command_cases import Smarticles, WriteRun
from synthetic import write_ended

from dem.errors import RunError
from dem.plan.steps import time_steps
from dem.scene.scene import Scene
from smarticles.sweeps import raise_failures
from studies.registry import STUDIES, shipped
from templates.local import Outcome
from templates.sweep.folder import open_folder


def finish(directory: Path) -> None:
    """Make every run of a sweep look finished."""
    folder = open_folder(directory)
    for entry in folder.entries:
        write_ended(folder.run(entry), entry.scene_sha256)


def test_a_dry_run_lists_and_writes_nothing(sweep_file: Path, smarticles: Smarticles) -> None:
    before = sorted(sweep_file.parent.iterdir())
    said = smarticles("sweep", sweep_file, "--dry-run")
    assert said.status == 0
    lines = said.out.splitlines()
    assert lines[0].split() == ["run", "count", "expected", "wall", "s"]
    assert [line.split()[:2] for line in lines[1:3]] == [["n5", "5"], ["n6", "6"]]
    assert lines[3].startswith("2 runs, about ")
    assert sorted(sweep_file.parent.iterdir()) == before


@pytest.mark.parametrize(
    "options", ["--to snakemake --dry-run", "--to row --out out", "--cluster local-slurm --out out"]
)
def test_each_run_is_planned_once(
    options: str, sweep_file: Path, tmp_path: Path, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Plans take far longer than all else: 0.2 s for a scene with motors."""
    monkeypatch.chdir(tmp_path)
    planned: list[Scene] = []

    def noted(scene: Scene) -> tuple[float, ...]:
        planned.append(scene)
        return time_steps(scene)

    monkeypatch.setattr("dem.plan.outlook.time_steps", noted)
    said = smarticles("sweep", sweep_file, *options.split())
    assert said.status == 0, said.err
    assert len(planned) == 2


def test_a_sweep_is_written_and_started_later(sweep_file: Path, tmp_path: Path, smarticles: Smarticles) -> None:
    out = tmp_path / "out"
    said = smarticles("sweep", sweep_file, "--out", out)
    assert said.status == 0
    assert said.out == f"{out}: 2 runs written; start them: smarticles resume {out}\n"
    assert sorted(path.name for path in (out / "scenes").iterdir()) == ["n5.yaml", "n6.yaml"]
    manifest = json.loads((out / "sweep.json").read_text(encoding="utf-8"))
    assert manifest["command"] == f"smarticles sweep {sweep_file} --out {out}"
    assert manifest["versions"]["smarticles"]
    assert not (out / "runs").exists()


def test_status_of_a_killed_run_shows_from_where_it_would_go_on(
    tmp_path: Path, write_run: WriteRun, smarticles: Smarticles
) -> None:
    run = write_run(tmp_path / "alone", status="unfinished")
    progress = {"phase": "shake", "time_s": 3.51, "wall_s": 20.0, "checkpoint_s": 3.2}
    (run / "progress.json").write_text(json.dumps(progress))
    header, row = smarticles("status", run).out.splitlines()[:2]
    assert [word.strip() for word in header.split("  ") if word] == [
        *("run", "state", "phase", "simulated s", "checkpoint s", "wall s")
    ]  # no column `cause`, in which no run has a value
    assert row.split() == ["alone", "stopped", "shake", "3.51", "3.2", "20"]
    assert json.loads(smarticles("status", run, "--json").out)["runs"][0]["checkpoint_s"] == 3.2
    assert "checkpoint s" not in smarticles("status", write_run(tmp_path / "done")).out


def test_threads_are_of_one_run_and_not_of_a_sweep(sweep_file: Path, tmp_path: Path, smarticles: Smarticles) -> None:
    out = tmp_path / "out"
    smarticles("sweep", sweep_file, "--out", out)
    said = smarticles("resume", out, "--threads", "2")
    assert said.status == 2
    assert said.err == (
        f"smarticles: error: --threads 2: is for a single run; {out} is a sweep, whose runs have one thread; omit it\n"
    )


def test_a_failing_run_is_status_1_with_its_cause(sweep_file: Path, tmp_path: Path, smarticles: Smarticles) -> None:
    """The real command of a run, given a scene that it rejects before YADE is needed."""
    out = tmp_path / "out"
    smarticles("sweep", sweep_file, "--out", out)
    finish(out)
    scene = out / "scenes" / "n5.yaml"
    scene.write_text(scene.read_text(encoding="utf-8").replace("count: 5", "count: -5"))
    (out / "runs" / "n5" / "done.json").unlink()
    said = smarticles("resume", out)
    assert said.status == 1
    assert said.out == ""
    lines = said.err.splitlines()
    assert lines[:2] == ["n6 finished before", "n5 started"]
    assert re.match(r"n5 failed after \d+:\d\d", lines[2])
    assert lines[3].startswith(f"smarticles: error: {out}: 1 of 2 runs are missing: n5: scenes/n5.yaml: count: ")
    assert "-5" in lines[3]
    assert lines[3].endswith(f"start them again: smarticles resume {out}")
    assert (out / "runs" / "n5.stopped-1" / "run.json").exists()
    assert (out / "logs" / "n5.txt").read_text(encoding="utf-8").startswith("smarticles: error: ")


def test_of_many_failed_runs_the_first_are_named(sweep_file: Path, tmp_path: Path, smarticles: Smarticles) -> None:
    out = tmp_path / "out"
    smarticles("sweep", sweep_file, "--out", out)
    outcomes = [Outcome(name=f"n{k}", status="failed" if k % 2 else "done", cause=f"cause {k}") for k in range(40)]
    with pytest.raises(RunError) as raised:
        raise_failures(open_folder(out), outcomes)
    message = str(raised.value)
    assert "20 of 40 runs are missing: n1: cause 1; n3: cause 3" in message
    assert f"n9: cause 9; 15 more, see smarticles status {out}; logs are in" in message
    assert "n11" not in message


def test_studies_are_listed(tmp_path: Path, smarticles: Smarticles) -> None:
    said = smarticles("study", "list")
    assert said.status == 0
    rows = {line.split()[0]: line for line in said.out.splitlines()[1:]}
    assert rows.keys() == STUDIES.keys()
    assert rows["gravish"].split()[1] == "yes"
    assert rows["sensitivity"].split()[1] == "no"
    assert rows["casting"].endswith("narrower from tier to tier.")
    for words, message in (
        (["gravish"], "study gravish: --out DIR is missing"),
        (["list", "--out", tmp_path / "out"], "study list: takes no --out"),
        (["list", "--quick"], "study list: takes no --quick"),
    ):
        said = smarticles("study", *words)
        assert (said.status, message in said.err) == (2, True)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("sensitivity --quick", "study sensitivity has no quick variant; leave --quick out"),
        (
            "sensitivity --fidelity reference",
            "--fidelity reference: study sensitivity sets the fidelity of its runs itself; leave --fidelity out",
        ),
        ("engines --engine links", "--engine links: study engines does not allow it ("),
    ],
)
def test_what_a_study_does_not_have_is_rejected(
    words: str, message: str, tmp_path: Path, smarticles: Smarticles
) -> None:
    said = smarticles("study", *words.split(), "--out", tmp_path / "out")
    assert said.status == 2
    assert said.err.startswith(f"smarticles: error: {message}")
    assert len(said.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "note"),
    [
        ("friction --quick", "fidelity: draft instead of standard; relax_s: 0.25 instead of 0.5"),
        ("casting --fidelity draft", "not the full study: fidelity: draft instead of standard"),
        ("casting --fidelity standard", "the full study as shipped"),
    ],
)
def test_a_fidelity_with_other_knobs_is_named_by_its_base(
    words: str, note: str, tmp_path: Path, smarticles: Smarticles
) -> None:
    said = smarticles("study", *words.split(), "--out", tmp_path / "out", "--analyse")
    assert "no run of " in said.err
    assert note in said.out.splitlines()[0]


def test_a_sweep_runs_on_the_engine_that_is_asked_for(sweep_file: Path, tmp_path: Path, smarticles: Smarticles) -> None:
    said = smarticles("sweep", sweep_file, "--engine", "links", "--out", tmp_path / "out")
    assert said.status == 2
    assert "constants: there is no 'engine' that could be links; add `engine: yade` there, and" in said.err
    said = smarticles("sweep", shipped("gravish").sweep_file(), "--engine", "links", "--dry-run")
    assert said.out.splitlines()[-1].startswith("128 runs, ")
    said = smarticles("sweep", shipped("gravish").sweep_file(), "--engine", "yode", "--dry-run")
    assert "--engine: 'yode' is not known; did you mean 'yade'?" in said.err
