"""run, plan, schema: one scene, as far as it goes without YADE."""

import json
import os
import shutil
from pathlib import Path

import pytest
from command_cases import Smarticles

from dem.run.run import manifest
from dem.scene.reading import load_scene


def test_plan_in_json_and_with_other_values(scene_file: Path, smarticles: Smarticles) -> None:
    said = smarticles("plan", scene_file, "--json", "--set", "count=7", "--set", "phases.1.duration_s=3")
    assert said.status == 0
    answer = json.loads(said.out)
    assert answer["count"] == 7
    assert answer["phases"][1]["duration_s"] == 3


@pytest.mark.parametrize("command", ["run", "plan"])
@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("count=-3", "count"),
        ("cuont=3", "'cuont'; did you mean 'count'?"),
        ("count", "--set count: write KEY=VALUE"),
        ("fidelity.time_step_s=1", "--set fidelity.time_step_s=1: fidelity.time_step_s: 1 s is above the stable step"),
    ],
)
def test_bad_scenes_are_status_2_before_anything_is_made(
    command: str, setting: str, message: str, scene_file: Path, smarticles: Smarticles
) -> None:
    out = scene_file.parent / "out"
    place = ["--out", out] if command == "run" else []
    said = smarticles(command, scene_file, *place, "--set", setting)
    assert said.status == 2
    (line,) = said.err.splitlines()
    assert line.startswith("smarticles: error: ")
    assert message in line
    assert not out.exists()


@pytest.mark.parametrize("command", ["run", "plan"])
def test_files_and_folders_that_are_no_scene(
    command: str, tmp_path: Path, scene_file: Path, sweep_file: Path, smarticles: Smarticles
) -> None:
    out = ["--out", tmp_path / "out"] if command == "run" else []
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "scene.yaml").write_text(scene_file.read_text())
    (tmp_path / "empty").mkdir()
    for name, stated in (
        (sweep_file.name, "is a sweep file, which makes many scenes; give it to `smarticles sweep`"),
        ("scene.yaml.j2", "is a template of scenes; give the sweep file that names it to `smarticles sweep`"),
        ("run", f"is a directory; give {tmp_path / 'run' / 'scene.yaml'}"),
        ("empty", "is a directory; give the path of a scene file"),
    ):
        said = smarticles(command, tmp_path / name, *out)
        assert (said.status, said.err) == (2, f"smarticles: error: {tmp_path / name}: {stated}\n")
    said = smarticles("sweep", scene_file, "--dry-run")
    stated = "is one scene, not a sweep file; give it to `smarticles run` or `smarticles plan`"
    assert (said.status, said.err) == (2, f"smarticles: error: {scene_file}: {stated}\n")


@pytest.mark.parametrize(("threads", "stated"), [("2", False), ("3", True), ("64", True)])
def test_more_threads_than_cores_are_warned_of(
    threads: str, stated: bool, scene_file: Path, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 5})
    monkeypatch.setattr("dem.run.run.run_scene", lambda *_, **__: None)
    said = smarticles("run", scene_file, "--out", scene_file.parent / "out", "--threads", threads)
    assert said.status == 0
    warning = f"smarticles: warning: --threads {threads}: this process may use 2 cores, and threads that find no free "
    assert [line.startswith(warning) for line in said.err.splitlines()] == [True] * stated
    assert said.err.endswith("use at most 2\n") == stated


@pytest.mark.parametrize(("options", "threads"), [([], "3"), (["--threads", "1"], "1")])
def test_a_resumed_run_has_the_threads_that_it_began_with_unless_asked(
    scene_file: Path, smarticles: Smarticles, monkeypatch: pytest.MonkeyPatch, options: list[str], threads: str
) -> None:
    out = scene_file.parent / "out"
    seen: list[str] = []

    def run_scene(*_: object, **__: object) -> None:
        seen.append(os.environ["OMP_NUM_THREADS"])

    monkeypatch.setenv("OMP_NUM_THREADS", "64")
    monkeypatch.setattr("dem.run.run.run_scene", run_scene)
    scene = load_scene(scene_file)
    steps = [1e-4] * len(scene.phases)
    out.mkdir()
    made = manifest(scene, out, steps=steps, command="", made_by=("links", "1"), threads=3)
    made.write(out / "run.json", make_folder=True)
    assert smarticles("run", scene_file, "--out", out, "--resume", *options).status == 0
    shutil.copy(scene_file, out / "scene.yaml")
    assert smarticles("resume", out, *options).status == 0
    assert seen == [threads, threads]


def test_keys_are_printed_with_range_and_meaning(smarticles: Smarticles) -> None:
    lines = smarticles("keys", "contact").out.splitlines()
    place = next(k for k, line in enumerate(lines) if line.strip().startswith("friction_wall"))
    assert "default 0.4, ≥ 0" in lines[place]
    assert "smarticle-container" in lines[place + 1]
    assert any(line.startswith("  duration_s    ") for line in smarticles("keys", "shake").out.splitlines())
    whole = smarticles("keys").out
    names = whole.partition("more, by `smarticles keys NAME`: ")[2].replace("\n", " ").strip().split(", ")
    assert {"motor", "shake", "container", "recording", "fidelity", "phases", "barbs"} <= set(names)
    assert "one of: actuate, arrange, compress, deposit" in smarticles("keys", "phases").out.replace("\n", " ")
    assert all(smarticles("keys", name).status == 0 for name in names)
    motor = smarticles("keys", "motor").out  # a key of scenes, and a law of joints
    assert motor.startswith("The motor of each hinge")
    assert "  law: motor\n" in motor.partition("\n\n")[2]
    assert smarticles("keys", "settle").out.count("timeout_s") == 1
    wrong = smarticles("keys", "moter")
    assert (wrong.status, wrong.err) == (
        2,
        "smarticles: error: keys moter: is no part of a scene; did you mean 'motor'?\n",
    )
    assert "keys count: has no keys of its own; `smarticles keys` describes it" in smarticles("keys", "count").err
    of_part = smarticles("keys", "friction_wall")
    assert (of_part.status, "is a key of contact; see `smarticles keys contact`" in of_part.err) == (2, True)
