"""Scenes with the key `particle` on YADE: clumps with exact mass and inertia, piles, and bits after a resume."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import body_cases
import numpy as np
import pytest
import yaml
from scenes import small
from stopping import assert_equal_frames

from dem.record.run import Run

SHAPES: dict[str, dict[str, Any]] = {
    "rod": {"length_m": 0.014},
    "staple": {"crown_m": 0.01, "leg_m": [0.007, 0.005], "angle_deg": [70, 110], "twist_deg": [0, 40]},
    "s": {"radius_m": 0.003, "diameter_m": 0.8e-3},
    "ring": {"radius_m": 0.005},
    "star": {"arm_m": 0.006},
}


def data(*names: str, count: int) -> dict[str, Any]:
    return {
        "schema_version": 1,
        "seed": 2,
        "count": count,
        "particle": [{"shape": name, **SHAPES[name]} for name in names],
        "fidelity": "draft",
        "phases": [{"type": "deposit", "per_layer": 5}, {"type": "relax", "duration_s": 0.1}],
        "recording": {"series_interval_s": 0.005, "frame_interval_s": 0.05, "checkpoint_interval_s": 0.05},
    }


def test_clumps_have_exact_mass_and_inertia(simulate: Any) -> None:
    names = list(SHAPES)
    found = simulate(body_cases.clumps, data(*names, count=5))
    scene = small({key: value for key, value in data(*names, count=5).items() if key != "schema_version"})
    assert scene.mixture is not None
    for number, mass, moments, rotated in zip(
        found["kinds"], found["masses"], found["moments"], found["rotations"], strict=True
    ):
        kind = scene.mixture.kinds[number]
        assert mass == pytest.approx(kind.mass, rel=1e-12)
        np.testing.assert_allclose(np.sort(moments), np.sort(kind.inertia), rtol=1e-12)
        # The state turns YADE's axes back into those of the kind.
        np.testing.assert_allclose(rotated, np.eye(3), atol=1e-12)


def run(scene: Path, out: Path, *more: str) -> None:
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    code = "import sys; import body_cases; body_cases.run(*sys.argv[1:])"
    here = Path(__file__).resolve().parent
    folders = os.pathsep.join(map(str, (here, here.parent, here.parents[1])))
    environment["PYTHONPATH"] = os.pathsep.join([folders, environment.get("PYTHONPATH", "")])
    subprocess.run([sys.executable, "-c", code, str(scene), str(out), *more], env=environment, check=True, timeout=300)


def test_a_mixture_settles_and_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    scene, whole, parts = tmp_path / "scene.yaml", tmp_path / "whole", tmp_path / "parts"
    scene.write_text(yaml.safe_dump(data(*SHAPES, count=15)))
    run(scene, whole)
    run(scene, parts, "0.17")
    assert Run(parts).status.state == "interrupted"
    run(scene, parts, "resume")
    one, other = Run(whole), Run(parts)
    assert_equal_frames(one, other)
    last, series = one.frames[-1], one.series
    assert last.count == 15
    assert sorted(np.bincount(last.kind)) == [3] * 5
    assert series["max_speed_m_per_s"][-1] < 0.05
    assert last.segments[..., 2].min() > 0
    assert np.hypot(last.segments[..., 0], last.segments[..., 1]).max() < one.manifest.container_radius_m
    assert last.contacts.sum() > 0
