"""Scenes of chains of links: pour, undulate, lift, release; stop and resume; energy, frames, measures."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import small
from stopping import assert_goes_on

from dem.body.bars import segment_distances
from dem.record.run import Run
from dem.record.series import read_series
from dem.run.run import run_scene
from dem.scene.scene import Scene
from postprocess.measures.registry import frame_measures

D = 1.5e-3
HINGE: dict[str, Any] = {
    "law": "motor",
    "torque_limit_N_m": 2e-4,
    "stiffness_N_m_per_rad": 1e-3,
    "damping_N_m_s_per_rad": 2e-7,
    "speed_limit_rad_per_s": 30,
}
SPRING = {"law": "elastic", "stiffness_N_m_per_rad": 1e-4, "damping_N_m_s_per_rad": 1e-8}
CHAIN: dict[str, Any] = {
    "shape": "chain",
    "link_m": [0.006, 0.005, 0.005, 0.004],
    "diameter_m": D,
    "density_kg_per_m3": 2500,
    "joints": [HINGE, {**HINGE, "axes": 2}, {**SPRING, "axes": 3, "yield_N_m": 3e-5}],
}
WAVE = {"type": "undulate", "duration_s": 0.2, "amplitude_deg": 50, "frequency_hz": 4, "turns_between_reversals": 0.2}
PHASES = [
    {"type": "deposit", "per_layer": 4},
    WAVE,
    {"type": "lift", "radius_m": 0.01, "distance_m": 0.002, "speed_m_per_s": 0.03, "duration_s": 0.1},
    {"type": "release"},
    {"type": "relax", "duration_s": 0.1},
]


def crowd(**changes: Any) -> Scene:
    everything: dict[str, Any] = {
        "engine": "links",
        "count": 8,
        "particle": CHAIN,
        "container.radius_m": 0.014,
        "fidelity": {"base": "draft"},
        "phases": PHASES,
        "recording": {
            "series_interval_s": 5e-3,
            "frame_interval_s": 0.05,
            "checkpoint_interval_s": 0.05,
            "dissipation_interval_s": 5e-3,
        },
    }
    return small(everything | changes)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    out = tmp_path_factory.mktemp("chains") / "whole"
    run_scene(crowd(), out, command="")
    return Run(out)


def test_a_run_that_was_stopped_while_it_undulates_or_lifts_goes_on_with_equal_bits(run: Run, tmp_path: Path) -> None:
    series = read_series(run.path)
    for phase in (1, 2):
        begun = series.time[series["phase"] == phase]
        assert_goes_on(crowd(), run, tmp_path / str(phase), float(begun.mean()))


def test_energy_is_accounted_for(run: Run) -> None:
    series = read_series(run.path)
    put_in = series["added_energy_J"][-1] + series["joint_motor_work_J"].max() + series["container_work_J"][-1]
    assert np.abs(series["energy_residual_J"]).max() < 0.01 * put_in
    for name in ("joint_motor_work_J", "held_work_J", "joint_energy_J", "pin_energy_J"):
        assert np.abs(series[name]).max() > 1e-3 * put_in, name


def test_motors_keep_their_limit_and_joints_hold(run: Run) -> None:
    series = read_series(run.path)
    assert series["joint_motor_torque_N_m"].max() <= 2e-4 * (1 + 1e-12)
    assert 0 < series["pin_gap_m"].max() < 0.2 * D
    assert series["broken_joints"].max() == 0
    phase, held = series["phase"], series["held_count"]
    assert set(held[phase < 2]) == {0} != set(held[phase == 2])
    assert held[-1] == 0


def test_the_pile_settles_and_chains_do_not_pass_through_each_other(run: Run) -> None:
    series = read_series(run.path)
    assert series["max_speed_m_per_s"][series["phase"] == 0][-1] < 0.02
    for frame in run.frames:
        lengths = np.linalg.norm(frame.segments[:, 1] - frame.segments[:, 0], axis=1)
        np.testing.assert_allclose(lengths, np.tile(CHAIN["link_m"], frame.count), rtol=1e-9)
        one, other = np.triu_indices(len(frame.segments), 1)
        apart = frame.body[one] != frame.body[other]
        distances = segment_distances(frame.segments[one[apart]], frame.segments[other[apart]])
        # Frames end segments where joints are and at the tips, axes half a diameter before the tips.
        assert distances.min() > 0.3 * D


def test_measures_of_any_shape_work_and_planes_have_no_meaning(run: Run) -> None:
    frame = run.frames[-1]
    measures = {each.name: each for each in frame_measures(("second-highest-com",), ("crossing-number", "caging"))}
    assert not measures["entanglement"].available_for(run)
    for name in ("crossing-number", "caging"):
        assert measures[name].available_for(run)
        assert np.isfinite(list(measures[name].columns(frame, run).values())).all()


def test_free_chains_that_fold_come_to_rest_without_violence(tmp_path: Path) -> None:
    joints = {"law": "free", "axes": 1, "poured_deg": 60}
    chain = {"shape": "chain", "links": 5, "link_m": 0.0094, "joints": joints}
    phases = [{"type": "deposit", "per_layer": 12}]
    scene = crowd(particle=chain, count=12, phases=phases, recording={}, **{"container.radius_m": 0.02})
    run_scene(scene, tmp_path / "run", command="")
    series = read_series(tmp_path / "run")
    assert series["max_speed_m_per_s"].max() < 1.0
    assert series["max_speed_m_per_s"][-1] < 0.02
    assert series["unbalanced_force"][-1] < 0.05
