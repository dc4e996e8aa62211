"""Scenes with the key `particle` on LAMMPS: a mixture settles, and goes on with the same bits."""

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import small

from dem.record.run import Run
from dem.run.build import Builders, build_engine
from dem.run.run import run_scene
from dem.run.simulation import StopRequestedError

PARTICLE = [
    {"shape": "staple", "crown_m": 0.01, "leg_m": [0.007, 0.005], "angle_deg": [70, 110], "twist_deg": [0, 40]},
    {"shape": "ring", "radius_m": 0.005, "diameter_m": 0.8e-3},
    {"shape": "star", "arm_m": 0.006},
    {"shape": "rod", "length_m": 0.014, "spread": 0.2},
]


class Interrupted:
    """An engine that asks the run to stop once a time has passed."""

    def __init__(self, engine: Any, when: float) -> None:
        self._engine, self._when = engine, when

    def __getattr__(self, name: str) -> Any:
        return getattr(self._engine, name)

    def advance(self, steps: int) -> None:
        self._engine.advance(steps)
        if self._engine.time > self._when:
            os.kill(os.getpid(), signal.SIGUSR1)


def test_a_mixture_settles_and_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    recording = {"series_interval_s": 0.005, "frame_interval_s": 0.05, "checkpoint_interval_s": 0.05}
    phases = [{"type": "deposit", "per_layer": 6}, {"type": "relax", "duration_s": 0.1}]
    scene = small({"engine": "lammps", "count": 12, "particle": PARTICLE, "phases": phases, "recording": recording})
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run_scene(scene, whole, command="", progress=False)
    builders = Builders(engine=lambda scene, dt: Interrupted(build_engine(scene, dt), 0.17))  # type: ignore[arg-type, return-value]
    with pytest.raises(StopRequestedError):
        run_scene(scene, parts, command="", progress=False, builders=builders)
    run_scene(scene, parts, command="", progress=False, resume=True)
    one, other = Run(whole), Run(parts)
    assert len(one.frames) == len(other.frames) > 4
    for there, here in zip(one.frames, other.frames, strict=True):
        np.testing.assert_array_equal(there.segments, here.segments)
        np.testing.assert_array_equal(there.link_velocity, here.link_velocity)
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
