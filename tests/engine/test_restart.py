"""Runs that are killed or stopped, and resumed: the bits of the run that was never stopped."""

import json
import re
import shutil
import signal
from pathlib import Path

import pytest
from processes import complete, differing, finish, gate, results, start

from validation.hard.kills import SAME, kills

HEAD = """\
schema_version: 1
name: restart
seed: 3
fidelity: draft
count: 12
container: {radius_m: 0.0145}
recording: {checkpoint_interval_s: 0.04, frame_interval_s: 0.02, sphere_interval_s: 0.028, energy: true}
"""
SHAKEN = """\
phases:
  - {type: deposit, per_layer: 4}
  - {type: shake, duration_s: 0.2}
"""
SCENES = {
    "pulled and lifted": """\
hooks: {lower_height_m: 0.003, upper_height_m: 0.006}
phases:
  - {type: deposit, per_layer: 4}
  - {type: shake, duration_s: 0.1}
  - {type: pull-hook, speed_m_per_s: 0.08, distance_m: 0.02, duration_s: 0.25, force_limit_N: 10}
  - {type: remove-container, speed_m_per_s: 0.05, duration_s: 0.2}
  - {type: relax, duration_s: 0.06}
""",
    "actuated, and shaken without a wall": """\
motor: {speed_limit_rad_per_s: 20}
phases:
  - {type: deposit, per_layer: 4}
  - {type: internal-oscillation, theta_deg: 10, duration_s: 0.1}
  - {type: relax, duration_s: 0.06}
  - {type: shape-change, opening_s: 0.1, closing_s: 0.1}
  - {type: remove-container, duration_s: 0.1}
  - {type: shake, duration_s: 0.1, peak_acceleration_g: 3}
""",
}


def test_a_kill_at_a_random_moment_changes_no_bit_on_links(tmp_path: Path) -> None:
    (row,) = kills("links", 1, tmp_path, seed=1)
    assert row[SAME] == "yes"
    assert row["files [1]"] > 20


@pytest.mark.parametrize("name", SCENES)
def test_a_run_killed_in_each_phase_gives_the_same_bits(tmp_path: Path, name: str) -> None:
    scene, whole, out = (tmp_path / part for part in ("scene.yaml", "whole", "killed"))
    scene.write_text(HEAD + SCENES[name])
    complete(scene, whole)
    phases = json.loads((whole / "done.json").read_text())["phases"]
    active = [entry for entry in phases if entry["type"] not in ("deposit", "relax")]
    for entry in active:
        # When a second checkpoint is written in the phase.
        moment = gate("/checkpoint.zip", 2, "SIGKILL", after=f"phase {entry['index']} ")
        status, said = finish(start(scene, out, moment))
        assert status == -signal.SIGKILL, said
    complete(scene, out)
    log = (out / "log.txt").read_text()
    resumed = [float(t) for t in re.findall(r"resumed from the checkpoint of t = ([\d.]+) s", log)]
    # Each kill was inside its phase, or this would prove nothing.
    for at, entry in zip(resumed, active, strict=True):
        assert entry["start_s"] < at <= entry["end_s"]
    assert len(results(whole)) > 20
    assert len(list((whole / "spheres").iterdir())) > 10
    assert differing(results(whole), results(out)) == []


@pytest.fixture(scope="module")
def halfway(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """A scene, its whole run, and a run killed when it had two checkpoints."""
    folder = tmp_path_factory.mktemp("halfway")
    scene = folder / "scene.yaml"
    scene.write_text(HEAD + SHAKEN)
    complete(scene, folder / "whole")
    # At its sixth checkpoint, when the fifth was moved to make room.
    status, said = finish(start(scene, folder / "killed", gate("checkpoint.previous.zip", 5, "SIGKILL")))
    assert status == -signal.SIGKILL, said
    return scene, folder / "whole", folder / "killed"


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_a_damaged_checkpoint_falls_back_to_the_one_before(halfway: tuple[Path, Path, Path], tmp_path: Path) -> None:
    scene, whole, killed = halfway
    out = shutil.copytree(killed, tmp_path / "out")
    damage(out / "checkpoint.zip")
    assert "going on from checkpoint.previous.zip" in complete(scene, out)
    assert differing(results(whole), results(out)) == []


def test_without_a_whole_checkpoint_a_run_reports_it_and_changes_nothing(
    halfway: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    scene, _, killed = halfway
    out = shutil.copytree(killed, tmp_path / "out")
    for name in ("checkpoint.zip", "checkpoint.previous.zip"):
        damage(out / name)
    before = results(out)
    status, said = finish(start(scene, out))
    assert status == 2
    assert "cannot be resumed, damaged: checkpoint.zip (" in said
    assert "start the run anew in another --out" in said
    assert results(out) == before


def test_a_run_stops_with_status_75_when_asked_and_one_of_two_resumes_goes_on(
    halfway: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    scene, whole, killed = halfway
    out = shutil.copytree(killed, tmp_path / "out")
    status, said = finish(start(scene, out, gate("frames.pvd", 3, "SIGUSR1")))
    assert status == 75
    assert "stopped as requested at the checkpoint of t = " in said
    assert not (out / "done.json").exists()
    ends = [finish(process) for process in [start(scene, out), start(scene, out)]]
    assert sorted(status for status, _ in ends) == [0, 2]
    assert any("is running it; wait for it or stop it" in said for status, said in ends if status == 2)
    assert differing(results(whole), results(out)) == []
