"""The directory of a sweep: manifest, scenes, states, rejections."""

import errno
import fcntl
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import pytest
from sweep_cases import SWEEP, MakeFolder

from dem.errors import InputError
from dem.scene.reading import load_scene, scene_hash
from templates.sweep.folder import Folder, open_folder


def test_runs_start_seed_by_seed_where_the_sweep_says_so(make_folder: MakeFolder) -> None:
    folder = make_folder(SWEEP.replace("{seeds: [1, 2]}", "{seeds: [2, 1], seed_by_seed: true}"))
    assert folder.manifest.seed_by_seed
    assert open_folder(folder.path) == folder
    started = [entry.name for entry in folder.in_order_of_start(folder.entries)]
    assert started == ["n20_seed2", "n10_seed2", "n20_seed1", "n10_seed1"]
    # Of what is left, the first seed still comes first.
    left = [entry for entry in folder.entries if entry.name != "n20_seed2"]
    assert folder.in_order_of_start(left)[0].name == "n10_seed2"


def test_a_manifest_without_an_order_is_read(make_folder: MakeFolder) -> None:
    folder = make_folder()
    file = folder.path / "sweep.json"
    content = json.loads(file.read_text(encoding="utf-8"))
    del content["seed_by_seed"]
    file.write_text(json.dumps(content), encoding="utf-8")
    assert open_folder(folder.path) == folder


def test_scene_files_are_the_scenes_of_the_manifest(make_folder: MakeFolder) -> None:
    folder = make_folder()
    assert len(folder.entries) == 4
    for entry in folder.entries:
        assert scene_hash(load_scene(folder.scene(entry))) == entry.scene_sha256


def test_an_equal_sweep_continues_in_its_directory(make_folder: MakeFolder) -> None:
    first = make_folder()
    before = (first.path / "sweep.json").read_text(encoding="utf-8")
    first.scene(first.entries[0]).unlink()
    second = make_folder()
    assert second == first
    assert (first.path / "sweep.json").read_text(encoding="utf-8") == before
    assert first.scene(first.entries[0]).exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[1, 2]",
            "[1, 3]",
            "runs only in the file: n10_seed3, n20_seed3; only in the directory: n10_seed2, n20_seed2; give",
        )
    ],
)
def test_another_sweep_is_rejected(make_folder: MakeFolder, old: str, new: str, message: str) -> None:
    folder = make_folder()
    before = (folder.path / "sweep.json").read_text(encoding="utf-8")
    with pytest.raises(InputError, match=rf"holds another sweep \('test'\): {message}"):
        make_folder(SWEEP.replace(old, new))
    assert (folder.path / "sweep.json").read_text(encoding="utf-8") == before


def test_known_names_with_other_scenes_are_rejected(make_folder: MakeFolder) -> None:
    make_folder()
    other = SWEEP.replace("points:", "constants: {k: 1}\npoints:").replace("[10, 20]", "[30, 20]")
    with pytest.raises(InputError, match="runs of another scene: n10_seed1, n10_seed2; give"):
        make_folder(other.replace("n{{ count }}", "n{{ 10 if count == 30 else count }}"))


def test_foreign_directories_and_files_are_rejected(make_folder: MakeFolder, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="out: holds other files; give a directory"):
        make_folder()
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["thesis.tex"]
    with pytest.raises(InputError, match=r"thesis.tex: is a file; give a directory"):
        make_folder(out="out/thesis.tex")


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": 2}', '{"format": 1, "points": [{}]}'])
def test_a_damaged_manifest_is_an_input_error(tmp_path: Path, text: str) -> None:
    (tmp_path / "sweep.json").write_text(text)
    with pytest.raises(InputError, match=r"cannot read manifest .*sweep\.json: .*; write the sweep to a new directory"):
        open_folder(tmp_path)


def test_states_of_its_runs(make_folder: MakeFolder) -> None:
    folder = make_folder()
    for entry, (name, content) in zip(folder.entries, FILES, strict=False):
        folder.run(entry).mkdir(parents=True)
        (folder.run(entry) / name).write_text(json.dumps(content))
    found = folder.status()
    assert [(run.state, run.cause, run.time_s) for run in found] == [
        ("done", None, 6.0),
        ("failed", "why", 2.0),
        ("stopped", None, 1.5),
        ("missing", None, None),
    ]
    assert json.loads(json.dumps(found[2].to_dict()))["checkpoint_s"] == 1.2


FILES = [
    ("done.json", {"status": "done", "time_s": 6.0, "steps": 9, "wall_s": 99.0, "phases": []}),
    ("failed.json", {"status": "failed", "cause": "why", "time_s": 2.0, "checkpoint_s": 1.6}),
    ("progress.json", {"phase": "shake", "time_s": 1.5, "wall_s": 20.0, "checkpoint_s": 1.2}),
]


def test_runs_left_behind_by_a_killed_runner_still_hold_the_sweep(make_folder: MakeFolder) -> None:
    folder: Folder = make_folder()
    with folder.lock() as lock:
        left = subprocess.Popen([sys.executable, "-I", "-S", "-c", "input()"], stdin=subprocess.PIPE, pass_fds=(lock,))
    try:
        with pytest.raises(InputError, match="computed already"), folder.lock():
            pass
    finally:
        left.communicate(b"\n")
    with folder.lock():
        pass


def test_a_sweep_that_cannot_be_written_ends_in_one_line(make_folder: MakeFolder) -> None:
    folder = make_folder()
    (folder.path / ".lock").mkdir()
    with pytest.raises(InputError, match=r"cannot be written \(Is a directory\); allow it, or copy"), folder.lock():
        pass


def test_a_sweep_on_a_file_system_without_locks_ends_in_one_line(
    make_folder: MakeFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flock(*_: object) -> NoReturn:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    folder = make_folder()
    monkeypatch.setattr(fcntl, "flock", flock)
    with pytest.raises(InputError, match=r"its file system cannot lock files \(No locks available\)"), folder.lock():
        pass
