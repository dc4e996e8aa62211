"""Runs killed inside a gait, a shake, a pull, a lift and a removal, and resumed: the same bits as one never stopped."""

from __future__ import annotations

import json
import re
import signal
from pathlib import Path

import pytest
from processes import complete, differing, finish, gate, results, start

HEAD = """\
schema_version: 1
name: restart
seed: 3
fidelity: draft
count: 12
container: {radius_m: 0.0145}
recording: {checkpoint_interval_s: 0.04, frame_interval_s: 0.02, sphere_interval_s: 0.028, energy: true}
"""
SCENES = {
    "pulled and lifted": """\
hooks: {lower_height_m: 0.003, upper_height_m: 0.006}
phases:
  - {type: deposit, per_layer: 4}
  - {type: shake, duration_s: 0.1}
  - {type: pull-hook, speed_m_per_s: 0.06, duration_s: 0.45, force_limit_N: 10}
  - {type: remove-container, speed_m_per_s: 0.05, duration_s: 0.4}
  - {type: relax, duration_s: 0.1}
""",
    "actuated": """\
motor: {speed_limit_rad_per_s: 20}
phases:
  - {type: deposit, per_layer: 4}
  - {type: internal-oscillation, theta_deg: 10, duration_s: 0.12}
  - {type: relax, duration_s: 0.06}
  - {type: shape-change, opening_s: 0.1, closing_s: 0.1}
  - {type: relax, duration_s: 0.06}
""",
    "shaken with and without the wall": """\
phases:
  - {type: deposit, per_layer: 4}
  - {type: shake, duration_s: 0.12}
  - {type: remove-container, duration_s: 0.12}
  - {type: shake, duration_s: 0.2, peak_acceleration_g: 3}
  - {type: relax, duration_s: 0.06}
""",
}
PASSIVE = ("deposit", "relax")


def kill_in(scene: Path, out: Path, phase: int) -> None:
    """Run on, and kill when a second checkpoint is taken in a phase."""
    status, said = finish(start(scene, out, gate("/checkpoint.zip", 2, "SIGKILL", after=f"phase {phase} ")))
    assert status == -signal.SIGKILL, said


@pytest.mark.parametrize("name", SCENES)
def test_a_run_killed_in_each_phase_gives_the_same_bits(tmp_path: Path, name: str) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(HEAD + SCENES[name])
    whole, out = tmp_path / "whole", tmp_path / "killed"
    complete(scene, whole)
    phases = json.loads((whole / "done.json").read_text())["phases"]
    active = [entry for entry in phases if entry["type"] not in PASSIVE]
    for entry in active:
        kill_in(scene, out, entry["index"])
    complete(scene, out)
    resumed = [
        float(t) for t in re.findall(r"resumed from the checkpoint of t = ([\d.]+) s", (out / "log.txt").read_text())
    ]
    # Each kill was inside its phase, or this would prove nothing.
    for at, entry in zip(resumed, active, strict=True):
        assert entry["start_s"] < at <= entry["end_s"]
    assert len(results(whole)) > 20
    assert len(list((whole / "spheres").iterdir())) > 10
    assert differing(results(whole), results(out)) == []
