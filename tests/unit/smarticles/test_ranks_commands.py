"""--ranks: processes of engine: lammps, on this machine and on a cluster; rejected where it has no meaning."""

import os
from pathlib import Path

import pytest
from command_cases import Smarticles

from dem.engine.cores import RANKS
from dem.run.run import manifest
from dem.scene.reading import dump_scene, load_scene


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """Ranks and threads that a run would have; nothing runs."""
    found: list[tuple[str, str]] = []

    def run_scene(*_: object, **__: object) -> None:
        found.append((os.environ[RANKS], os.environ["OMP_NUM_THREADS"]))

    monkeypatch.setenv(RANKS, "7")
    monkeypatch.setenv("OMP_NUM_THREADS", "64")
    monkeypatch.delenv("SLURM_NTASKS", raising=False)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1, 2})
    monkeypatch.setattr("dem.run.run.run_scene", run_scene)
    return found


def test_ranks_are_those_asked_for_and_one_by_default(
    scene_file: Path, smarticles: Smarticles, seen: list[tuple[str, str]]
) -> None:
    words = ("run", scene_file, "--out", scene_file.parent / "out", "--engine", "lammps")
    assert smarticles(*words).status == 0
    assert smarticles(*words, "--ranks", "3").status == 0
    assert seen == [("1", "1"), ("3", "1")]


def test_a_resumed_run_has_the_ranks_that_it_began_with_unless_asked(
    scene_file: Path, smarticles: Smarticles, seen: list[tuple[str, str]]
) -> None:
    scene, out = load_scene(scene_file, ["engine=lammps"]), scene_file.parent / "out"
    out.mkdir()
    steps = [1e-4] * len(scene.phases)
    made = manifest(scene, out, steps=steps, command="", made_by=("lammps", "1"), threads=2)
    made.write(out / "run.json", make_folder=True)
    (out / "scene.yaml").write_text(dump_scene(scene))
    assert smarticles("resume", out).status == 0
    assert smarticles("resume", out, "--ranks", "3").status == 0
    assert seen == [("2", "1"), ("3", "1")]


@pytest.mark.parametrize(
    ("options", "stated"),
    [
        (["--engine", "lammps", "--ranks", "4"], "--ranks 4: there are 3 cores for this process, and each rank waits"),
        (
            ["--engine", "lammps", "--threads", "2"],
            "--threads 2: engine: lammps has processes of one thread; use --ran",
        ),
        (["--engine", "links", "--ranks", "2"], "--ranks 2: engine: links is one process; use --threads, or engine: l"),
        (["--engine", "lammps", "--ranks", "0"], "--ranks: must be a whole number from 1: got '0'"),
    ],
)
def test_what_has_no_meaning_is_rejected_before_anything_starts(
    scene_file: Path, smarticles: Smarticles, seen: list[tuple[str, str]], options: list[str], stated: str
) -> None:
    said = smarticles("run", scene_file, "--out", scene_file.parent / "out", *options)
    assert said.status == 2
    assert stated in said.err
    assert seen == []
    assert not (scene_file.parent / "out").exists()
