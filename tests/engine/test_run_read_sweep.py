"""`smarticles.run`, `read` and `sweep` with the engine."""

from __future__ import annotations

from pathlib import Path

import pytest

import smarticles
from dem.scene.reading import parse_scene, scene_hash

pytestmark = [pytest.mark.engine, pytest.mark.usefixtures("worker")]

SCENE = """\
schema_version: 1
seed: 1
count: {{ count }}
fidelity: draft
phases: [{type: deposit, settle: {timeout_s: 5}}, {type: relax, duration_s: 0.02}]
"""
SWEEP = """\
schema_version: 1
name: counts
template: scene.yaml.j2
run_name: "n{{ count }}"
points: {grid: {count: [1, 2]}}
"""


def test_a_scene_in_python_becomes_frames_and_measures(tmp_path: Path) -> None:
    phases = [{"type": "deposit", "settle": {"timeout_s": 5}}, {"type": "relax", "duration_s": 0.02}]
    scene = parse_scene({"schema_version": 1, "seed": 1, "count": 2, "fidelity": "draft", "phases": phases}, source="x")
    done = smarticles.run(scene, tmp_path / "a")
    assert done.manifest.scene_sha256 == scene_hash(scene)
    assert done.frames[-1].count == 2
    assert smarticles.measures.link_crossings(done.frames[-1].vertices).shape == (2,)


def test_a_sweep_is_computed_and_taken_up(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml.j2").write_text(SCENE)
    (tmp_path / "sweep.yaml").write_text(SWEEP)
    for _ in range(2):
        runs = smarticles.sweep(tmp_path / "sweep.yaml", tmp_path / "out", jobs=1)
        assert [run.manifest.count for run in runs] == [1, 2]
