"""Runs that are killed at random moments and resumed: the same bits as the run that was never stopped."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path

import pytest
from processes import complete, differing, finish, gate, results, start

from validation.hard.kills import SAME, kills

SCENE = """\
schema_version: 1
seed: 4
fidelity: draft
count: 12
recording: {checkpoint_interval_s: 0.04, frame_interval_s: 0.02}
phases:
  - {type: deposit, per_layer: 4}
  - {type: relax, duration_s: 0.1}
  - {type: shake, duration_s: 0.2}
"""


@pytest.mark.parametrize("engine", ["yade", "links"])
def test_kills_at_random_moments_change_no_bit(tmp_path: Path, engine: str) -> None:
    rows = kills(engine, 2, tmp_path, seed=1)
    assert [row[SAME] for row in rows] == ["yes", "yes"]
    assert all(row["files [1]"] > 20 for row in rows)


@pytest.fixture(scope="module")
def halfway(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """A scene, its whole run, and a run killed when it had two checkpoints."""
    folder = tmp_path_factory.mktemp("halfway")
    scene = folder / "scene.yaml"
    scene.write_text(SCENE)
    complete(scene, folder / "whole")
    # At its sixth checkpoint, when the fifth has made room already.
    status, said = finish(start(scene, folder / "killed", gate("checkpoint.previous.zip", 5, "SIGKILL")))
    assert status == -signal.SIGKILL, said
    return scene, folder / "whole", folder / "killed"


def copy_of(run: Path, out: Path) -> Path:
    out.mkdir()
    subprocess.run(["cp", "-r", f"{run}/.", str(out)], check=True)
    return out


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_a_damaged_checkpoint_falls_back_to_the_one_before(halfway: tuple[Path, Path, Path], tmp_path: Path) -> None:
    scene, whole, killed = halfway
    out = copy_of(killed, tmp_path / "out")
    damage(out / "checkpoint.zip")
    said = complete(scene, out)
    assert "going on from checkpoint.previous.zip" in said
    assert differing(results(whole), results(out)) == []


def test_without_a_whole_checkpoint_a_run_says_so_and_touches_nothing(
    halfway: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    scene, _, killed = halfway
    out = copy_of(killed, tmp_path / "out")
    for name in ("checkpoint.zip", "checkpoint.previous.zip"):
        damage(out / name)
    before = results(out)
    status, said = finish(start(scene, out))
    assert status == 2
    assert "cannot be resumed, damaged: checkpoint.zip (" in said
    assert "start the run anew in another --out" in said
    assert results(out) == before


def test_of_two_resumes_at_once_one_refuses(halfway: tuple[Path, Path, Path], tmp_path: Path) -> None:
    scene, whole, killed = halfway
    out = copy_of(killed, tmp_path / "out")
    ends = [finish(process) for process in [start(scene, out), start(scene, out)]]
    assert sorted(status for status, _ in ends) == [0, 2]
    assert any("is running it; wait for it or stop it" in said for status, said in ends if status == 2)
    assert differing(results(whole), results(out)) == []


def test_a_run_asked_to_stop_ends_with_status_75_at_its_next_checkpoint(
    halfway: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    scene, whole, killed = halfway
    out = copy_of(killed, tmp_path / "out")
    status, said = finish(start(scene, out, gate("frames.pvd", 3, "SIGUSR1")))
    assert status == 75
    assert "stopped as requested at the checkpoint of t = " in said
    assert not (out / "done.json").exists()
    complete(scene, out)
    assert differing(results(whole), results(out)) == []
