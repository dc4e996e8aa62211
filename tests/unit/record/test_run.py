"""`Run`: what a run directory holds, read when asked for."""

import fcntl
import json
from pathlib import Path

import pytest
from synthetic import SyntheticRun, write_run

from dem.errors import InputError
from dem.record.run import Run, open_run


def test_a_run_has_what_its_directory_holds(tmp_path: Path) -> None:
    run = open_run(write_run(tmp_path / "run", SyntheticRun()))
    assert (run.manifest.count, len(run.frames), len(run.series)) == (run.frames[0].count, 16, len(run.series.data))
    assert [phase.type for phase in run.phases] == ["deposit", "relax", "shake", "relax"]
    assert run.frames is run.frames
    assert run == Run(Path(str(run)))


def test_a_scene_names_the_key_that_it_lacks(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("count: 5\nphases: [{type: relax, settle: {hold_s: 0.1}}]\n")
    scene = Run(tmp_path).scene
    assert (scene["count"], scene["phases"][0]["settle"]["hold_s"], scene.get("hooks")) == (5, 0.1, None)
    with pytest.raises(InputError, match=r"scene\.yaml: phases\.0\.settle\.timeout_s is missing; "):
        scene["phases"][0]["settle"]["timeout_s"]


@pytest.mark.parametrize("text", ["", "[]", "{", "a: b: c"])
def test_a_scene_that_is_none_is_rejected(text: str, tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(text)
    with pytest.raises(InputError, match=r"cannot read scene .*scene\.yaml: "):
        _ = Run(tmp_path).scene


FAILED = {"status": "failed", "cause": "flew apart", "time_s": 0.5, "checkpoint_s": 0.4}
PROGRESS = {"phase": "shake", "time_s": 0.7, "wall_s": 9.0, "checkpoint_s": 0.6}


@pytest.mark.parametrize(
    ("files", "wanted"),
    [
        ({}, ("missing", None, None, None)),
        ({"run.json": {}}, ("stopped", None, None, None)),
        ({"progress.json": PROGRESS}, ("stopped", None, 0.7, 0.6)),
        ({"progress.json": PROGRESS, "failed.json": FAILED}, ("failed", "flew apart", 0.5, 0.4)),
        ({"failed.json": {**FAILED, "status": "interrupted"}}, ("interrupted", "flew apart", 0.5, 0.4)),
        (
            {"failed.json": FAILED, "done.json": {"time_s": 2, "steps": 9, "wall_s": 3, "phases": []}},
            ("done", None, 2, None),
        ),
    ],
)
def test_status(files: dict[str, dict[str, object]], wanted: tuple[object, ...], tmp_path: Path) -> None:
    for name, data in files.items():
        (tmp_path / name).write_text(json.dumps(data))
    status = Run(tmp_path).status
    assert (status.state, status.cause, status.time_s, status.checkpoint_s) == wanted


def test_a_run_is_running_while_a_process_holds_its_lock(tmp_path: Path) -> None:
    with (tmp_path / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert Run(tmp_path).status.state == "running"
    assert Run(tmp_path).status.state == "stopped"


@pytest.mark.parametrize("name", ["checkpoint.zip", "checkpoint.previous.zip"])  # a stop between two renames leaves one
def test_a_run_can_be_resumed_from_a_checkpoint_unless_it_failed(name: str, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text("{}")
    assert not Run(tmp_path).can_resume
    (tmp_path / name).write_text("")
    assert Run(tmp_path).can_resume
    (tmp_path / "failed.json").write_text(json.dumps(FAILED))
    assert not Run(tmp_path).can_resume
