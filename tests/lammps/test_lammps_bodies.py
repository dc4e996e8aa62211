"""Scenes with the key `particle` on LAMMPS: a mixture settles, and goes on with the same bits."""

from pathlib import Path

import numpy as np
import pytest
from scenes import small
from stopping import assert_equal_frames, run_until

from dem.record.run import Run
from dem.run.run import run_scene

PARTICLE = [
    {"shape": "staple", "crown_m": 0.01, "leg_m": [0.007, 0.005], "angle_deg": [70, 110], "twist_deg": [0, 40]},
    {"shape": "ring", "radius_m": 0.005, "diameter_m": 0.8e-3},
    {"shape": "star", "arm_m": 0.006},
    {"shape": "rod", "length_m": 0.014, "spread": 0.2},
]


def test_a_mixture_settles_and_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    recording = {"series_interval_s": 0.005, "frame_interval_s": 0.05, "checkpoint_interval_s": 0.05}
    phases = [{"type": "deposit", "per_layer": 6}, {"type": "relax", "duration_s": 0.1}]
    scene = small({"engine": "lammps", "count": 12, "particle": PARTICLE, "phases": phases, "recording": recording})
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run_scene(scene, whole, command="")
    run_until(scene, parts, 0.17)
    run_scene(scene, parts, command="", resume=True)
    one, other = Run(whole), Run(parts)
    assert_equal_frames(one, other)
    last, series = one.frames[-1], one.series
    assert last.count == 12
    assert len({(kind.shape) for kind in one.manifest.kinds or () if kind.bodies}) == 4
    assert series["max_speed_m_per_s"][-1] < 0.05
    assert last.segments[..., 2].min() > 0
    assert np.hypot(last.segments[..., 0], last.segments[..., 1]).max() < one.manifest.container_radius_m
    # Weights of unequal bodies stand on the floor.
    assert series["container_force_N"][-5:, 2].mean() == pytest.approx(
        -12 * one.manifest.smarticle_mass_kg * 9.81, rel=0.1
    )
