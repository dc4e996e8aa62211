"""Drives that are fast against the stable step: what moves, moves as asked, and works as much as it should."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import small
from scipy.spatial.transform import Rotation
from stopping import assert_goes_on

from dem.body.placement import Poses
from dem.body.state import FilamentState
from dem.engine.demand import contact_law_of
from dem.engine.interface import Engine
from dem.phases.shake import Shake
from dem.plan.steps import time_steps
from dem.record.run import Run
from dem.run.build import build_engine
from dem.run.run import run_scene
from dem.scene.scene import Scene
from dem.setting.span import STEPS

G = 9.81
RADIUS = 0.005  # of a rod so heavy that its stable step is 0.5 ms
ENDS = 2  # contacts of a rod that lies on the floor


def heavy(phase: dict[str, Any]) -> Scene:
    """A rod that drops onto the floor of a container, then the phase."""
    rod = {"shape": "rod", "length_m": 0.06, "diameter_m": 2 * RADIUS, "density_kg_per_m3": 7850}
    everything: dict[str, Any] = {
        "engine": "links",
        "count": 1,
        "particle": rod,
        "container.radius_m": 0.06,
        "fidelity": {"stiffness_N_per_m": 9000.0},
        "recording": {"series_interval_s": 1e-3, "dissipation_interval_s": 2e-4, "checkpoint_interval_s": None},
        "phases": [{"type": "deposit"}, phase],
    }
    return small(everything)


def at_rest(scene: Scene) -> Engine:
    """Return an engine in which the rod has come to rest on the floor, with the step of phase 1."""
    before, driven = time_steps(scene)
    assert before == 5e-4
    engine = build_engine(scene, before)
    engine.add(Poses(np.array([[0.0, 0.0, RADIUS - 2e-4]]), (Rotation.identity(),), np.array([0])))
    engine.advance(round(0.5 / before))
    engine.set_time_step(driven)
    return engine


def motion(scene: Scene, engine: Engine) -> np.ndarray:
    """Return time since the phase began [s], height [m] and velocity [m/s] of the floor at each step of phase 1."""
    stage, begun, floor = scene.phases[1].begin(scene, 1), engine.time, engine.boundaries.floor
    rows = []
    while wait := stage.proceed(engine):
        for _ in range(round(wait / engine.time_step)):
            engine.advance(1)
            rows.append((engine.time - begun, engine.boundaries.floor - floor, engine.boundaries.velocity))
    return np.array(rows)


def test_a_floor_shaken_at_2000_hz_moves_as_asked_and_works_against_dashpots_alone() -> None:
    frequency, peak = 2000.0, 20.0  # so that no dashpot would pull
    shake = {"type": "shake", "duration_s": 0.1, "frequency_hz": frequency, "peak_acceleration_g": peak}
    scene = heavy(shake)
    engine = at_rest(scene)
    before = engine.ledger.container_work
    times, heights, velocities = motion(scene, engine).T
    omega = 2 * math.pi * frequency
    amplitude = peak * G / omega**2
    np.testing.assert_allclose(heights, amplitude * np.sin(omega * times), rtol=0, atol=1e-6 * amplitude)
    assert np.ptp(heights) > 2 * 0.98 * amplitude
    # The velocity is that of the motion: its sum over steps is the way, with the error of the trapezium rule.
    way = np.cumsum((velocities[1:] + velocities[:-1]) / 2 * engine.time_step)
    assert np.abs(way - (heights[1:] - heights[0])).max() < 2 * (math.pi / STEPS) ** 2 / 3 * amplitude
    # The rod, 25 times too slow to follow, stays: the floor moves against the dashpots of both ends with Aω sin.
    spent = ENDS * contact_law_of(scene).wall_damping * (amplitude * omega) ** 2 / 2 * times[-1]
    assert engine.ledger.container_work - before == pytest.approx(spent, rel=0.05)


@pytest.mark.parametrize("frequency", [30.0, 333.0, 700.0])
def test_taps_have_the_frequency_and_the_height_that_are_asked_for(frequency: float) -> None:
    taps, rest, peak = 3, 0.02, 15.0
    scene = heavy(
        {"type": "shake", "taps": taps, "rest_s": rest, "frequency_hz": frequency, "peak_acceleration_g": peak}
    )
    phase = scene.phases[1]
    assert isinstance(phase, Shake)
    engine = at_rest(scene)
    times, heights, _ = motion(scene, engine).T
    highest = 2 * phase.amplitude(G)
    assert heights.min() > -1e-9 * highest
    # Of a cycle of n steps the highest is within half a step of the top.
    assert heights.max() == pytest.approx(highest, rel=(math.pi / (frequency**-1 / engine.time_step)) ** 2)
    assert heights[-1] == pytest.approx(0.0, abs=1e-9 * highest)
    begins = [t for t, (low, high) in zip(times, pairwise(heights), strict=False) if low < 1e-9 * highest < high]
    assert len(begins) == taps - 1  # the first begins before the first of these rows
    assert begins[1] - begins[0] == pytest.approx(1 / frequency + rest, abs=engine.time_step)
    moving = np.count_nonzero(heights > 1e-9 * highest) + taps  # with the step that ends each
    assert moving * engine.time_step / taps == pytest.approx(1 / frequency, rel=1e-9)


def curvature_after(frequency: float) -> float:
    """Return the mean curvature [1/m] to which a filament without weight bends in a wave of 100 1/m of a frequency."""
    worm = {
        **{"shape": "filament", "length_m": 0.02, "diameter_m": 1e-3, "segments": 5, "young_modulus_Pa": 2e4},
        **{"stretching_time_s": 1e-4, "bending_time_s": 0.02},
    }
    wriggle = {
        **{"type": "wriggle", "duration_s": 0.1, "curvature_per_m": 100, "frequency_hz": frequency},
        **{"ramp_s": 0.05},
    }
    scene = small(
        {
            **{"engine": "links", "count": 1, "particle": worm, "container.radius_m": 0.02, "liquid": {}},
            **{"fidelity": {"stiffness_N_per_m": 5}, "recording": {"series_interval_s": 1e-3}},
            **{"phases": [{"type": "deposit"}, wriggle], "recording.checkpoint_interval_s": None},
        }
    )
    before, driven = time_steps(scene)
    engine = build_engine(scene, before)
    engine.add(Poses(np.array([[0.0, 0.0, 0.05]]), (Rotation.identity(),), np.array([0])))
    engine.set_time_step(driven)
    assert scene.phases[1].begin(scene, 1).proceed(engine)
    engine.advance(round(0.1 / driven))
    state = engine.state()
    assert isinstance(state, FilamentState)
    ways = np.diff(state.nodes, axis=0)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    turns = np.arccos(np.clip((ways[1:] * ways[:-1]).sum(axis=1), -1, 1))
    return float(turns.mean() / (0.02 / 5))


def test_a_filament_is_too_slow_for_a_fast_wave_and_stays_straight() -> None:
    assert curvature_after(0.0) == pytest.approx(100, rel=0.15)
    # A step of 1/6 ms, which is stable, would take the wave of 6000 Hz for one of 0 Hz.
    assert curvature_after(6000.0) < 5


def test_a_run_that_was_stopped_in_a_phase_with_a_step_of_its_own_goes_on_with_equal_bits(tmp_path: Path) -> None:
    shake = {"type": "shake", "peak_acceleration_g": 20}
    phases = [
        {"type": "deposit"},
        {**shake, "frequency_hz": 1900, "duration_s": 0.02},
        {**shake, "frequency_hz": 700, "taps": 2, "rest_s": 0.02},
        {"type": "relax", "duration_s": 0.03},
    ]
    recording = {"series_interval_s": 1e-3, "frame_interval_s": 0.01, "checkpoint_interval_s": 0.005}
    scene = small({"engine": "links", "count": 3, "phases": phases, "recording": recording})
    run_scene(scene, tmp_path / "whole", command="")
    run = Run(tmp_path / "whole")
    ends = [(phase.start_s, phase.end_s) for phase in run.phases]
    assert [end - start for start, end in ends[1:]] == pytest.approx([0.02, 2 * (1 / 700 + 0.02), 0.03], abs=1e-4)
    for number in (1, 2):
        assert_goes_on(scene, run, tmp_path / str(number), sum(ends[number]) / 2)
