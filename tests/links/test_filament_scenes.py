"""Scenes of filaments on links: pour, wriggle, lift, release; stop and resume; energy, momentum, measures."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import small
from stopping import assert_goes_on

from dem.body.bars import segment_distances
from dem.body.state import FilamentState
from dem.engine.links.engine import LinksEngine
from dem.engine.links.motion.bending import PSI, SEED
from dem.record.run import Run
from dem.record.series import read_series
from dem.run.build import build_engine
from dem.run.run import run_scene
from dem.scene.scene import Scene
from postprocess.measures.crossing_number import average_crossing_numbers
from postprocess.measures.registry import frame_measures

D = 0.8e-3
WORM: dict[str, Any] = {
    "shape": "filament",
    "length_m": 0.03,
    "diameter_m": D,
    "segments": 10,
    "young_modulus_Pa": 5e4,
    "stretching_time_s": 1e-4,
    "bending_time_s": 2e-3,
    "poured_bend_deg": 200,
}
PHASES = [
    {"type": "deposit", "per_layer": 4},
    {"type": "wriggle", "duration_s": 0.3, "curvature_per_m": 150, "frequency_hz": 2, "turns_between_reversals": 0.2},
    {"type": "lift", "radius_m": 0.006, "distance_m": 0.003, "speed_m_per_s": 0.03, "duration_s": 0.15},
    {"type": "release"},
    {"type": "relax", "duration_s": 0.1},
]


def worms(count: int = 8, **changes: Any) -> Scene:
    recording = {"series_interval_s": 5e-3, "frame_interval_s": 0.05, "checkpoint_interval_s": 0.05}
    everything: dict[str, Any] = {
        "engine": "links",
        "count": count,
        "particle": WORM,
        "liquid": {},
        "container.radius_m": 0.012,
        "contact": {"friction_smarticle": 0.3, "friction_wall": 0.3, "restitution": 0.4},
        "fidelity": {"base": "standard", "stiffness_N_per_m": 10},
        "phases": PHASES,
        "recording": recording | {"dissipation_interval_s": 5e-3},
    }
    return small(everything | changes)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    out = tmp_path_factory.mktemp("worms") / "whole"
    run_scene(worms(), out, command="")
    return Run(out)


def test_a_run_that_was_stopped_while_it_wriggles_or_lifts_goes_on_with_equal_bits(run: Run, tmp_path: Path) -> None:
    series = read_series(run.path)
    for phase in (1, 2):
        begun = series.time[series["phase"] == phase]
        assert_goes_on(worms(), run, tmp_path / str(phase), float(begun.mean()))


def test_energy_is_accounted_for(run: Run) -> None:
    series = read_series(run.path)
    put_in = series["added_energy_J"][-1] + series["active_work_J"][-1] + series["container_work_J"][-1]
    assert np.abs(series["energy_residual_J"]).max() < 0.01 * put_in
    for name in ("active_work_J", "grip_work_J", "drag_loss_J", "bending_energy_J"):
        assert np.abs(series[name]).max() > 0.01 * put_in, name


def test_grips_raise_what_they_hold_and_let_go(run: Run) -> None:
    series, phase = read_series(run.path), read_series(run.path)["phase"]
    held = series["gripped_count"]
    assert set(held[phase < 2]) == {0} != set(held[phase == 2])
    assert held[-1] == 0
    height = series["com_height_m"]
    assert height[phase == 2][-1] > height[phase == 2][0] + 3e-4
    assert series["grip_work_J"][-1] == series["grip_work_J"][phase == 2][-1] > 0


def test_filaments_keep_their_length_and_do_not_pass_through_each_other(run: Run) -> None:
    for frame in run.frames:
        lengths = np.linalg.norm(frame.segments[:, 1] - frame.segments[:, 0], axis=1)
        np.testing.assert_allclose(lengths, 0.003, rtol=0.05)
        one, other = np.triu_indices(len(frame.segments), 1)
        apart = frame.body[one] != frame.body[other]
        distances = segment_distances(frame.segments[one[apart]], frame.segments[other[apart]])
        assert distances.min() > 0.6 * D  # axes are a diameter apart where surfaces just touch


def test_measures_of_any_shape_work_and_planes_have_no_meaning(run: Run) -> None:
    frame = run.frames[-1]
    found = average_crossing_numbers(frame.segments, frame.body)
    assert found.mean > 0
    measures = {each.name: each for each in frame_measures(("second-highest-com",), ("crossing-number", "caging"))}
    assert not measures["entanglement"].available_for(run)
    for name in ("crossing-number", "caging"):
        assert measures[name].available_for(run)
        assert np.isfinite(list(measures[name].columns(frame, run).values())).all()


def test_states_agree_with_the_engine() -> None:
    scene = worms(count=3, **{"recording.dissipation_interval_s": None})
    engine = build_engine(scene, 2e-5)
    phase = scene.phases[0]
    stage = phase.begin(scene, 0)
    stage.proceed(engine)
    engine.advance(200)
    state, filaments = engine.state(), engine.filaments
    assert isinstance(state, FilamentState)
    assert filaments is not None
    assert state.kinetic_energy == pytest.approx(filaments.energies.kinetic, rel=1e-12)
    assert state.potential_energy(engine.gravity, 0.0) == pytest.approx(filaments.energies.potential, rel=1e-12)
    assert state.spheres().shape[0] == 3
    np.testing.assert_allclose(np.stack([filaments.points(k) for k in range(3)]).reshape(-1, 3), state.nodes)
    fraction = scene.bodies[0].stations
    assert fraction.min() == 0
    assert fraction.max() == 1
    # What gravity, less buoyancy, gave is what they have, but for drag.
    weight = 3 * scene.model.mass * (1 - 1000 / 1060) * engine.gravity
    assert engine.impulse == pytest.approx(weight * engine.time, rel=1e-9)
    assert 0.5 * engine.impulse < -state.momentum[2] < engine.impulse


def test_without_liquid_and_contacts_momentum_is_that_of_gravity() -> None:
    scene = worms(count=2, **{"liquid": None, "recording.dissipation_interval_s": None, "container.radius_m": 0.1})
    engine = build_engine(scene, 2e-5)
    scene.phases[0].begin(scene, 0).proceed(engine)
    assert engine.filaments is not None
    wriggle = scene.phases[1]
    wriggle.begin(scene, 1).proceed(engine)  # bending by itself pushes nothing
    engine.advance(100)
    momentum = engine.state().momentum
    np.testing.assert_allclose(momentum, [0, 0, -engine.impulse], rtol=0, atol=1e-12 * engine.impulse)


def test_waves_begin_where_the_seed_of_the_scene_puts_them() -> None:
    begun = []
    for seed in (1, 1, 2):
        scene = worms(count=4, seed=seed)
        engine = build_engine(scene, 2e-5)
        scene.phases[0].begin(scene, 0).proceed(engine)
        assert isinstance(engine, LinksEngine)
        assert engine._world.filaments is not None
        begun.append(engine._world.filaments.gait[:, [PSI, SEED]])
    first, again, other = begun
    np.testing.assert_array_equal(first, again)
    assert len(set(first[:, 0])) == 4
    assert not np.isin(first, other).any()


def test_tails_are_the_last_nodes() -> None:
    phases = [PHASES[0], {"type": "lift", "grips": "tails", "distance_m": 0.001, "speed_m_per_s": 0.02}]
    scene = worms(count=3, phases=phases)
    engine = build_engine(scene, 2e-5)
    scene.phases[0].begin(scene, 0).proceed(engine)
    stage = scene.phases[1].begin(scene, 1)
    assert engine.filaments is not None
    before = [engine.filaments.points(k)[-1].copy() for k in range(3)]
    assert stage.proceed(engine) == pytest.approx(0.05)
    engine.advance(2500)
    assert engine.filaments.held == 3
    for k, place in enumerate(before):
        np.testing.assert_allclose(engine.filaments.points(k)[-1], np.add(place, (0, 0, 1e-3)), atol=1e-9)


def test_a_lift_that_grips_nothing_says_so(tmp_path: Path) -> None:
    phases = [PHASES[0], {"type": "lift", "above_m": 0.5, "distance_m": 0.001, "speed_m_per_s": 0.02}]
    run_scene(worms(count=2, phases=phases), tmp_path / "run", command="")
    assert "nothing was gripped" in (tmp_path / "run" / "log.txt").read_text()


def test_quiet_filaments_return_to_the_curvature_that_they_prefer() -> None:
    bent = WORM | {"curvature_per_m": 100.0, "poured_bend_deg": 0}
    scene = worms(count=1, particle=bent, **{"container.radius_m": 0.1, "recording.dissipation_interval_s": None})
    engine = build_engine(scene, 2e-5)
    scene.phases[0].begin(scene, 0).proceed(engine)
    engine.advance(25_000)
    points = engine.filaments.points(0) if engine.filaments is not None else np.zeros((2, 3))
    chord = 2 * 0.01 * np.sin(0.03 * 100 / 2)
    assert np.linalg.norm(points[-1] - points[0]) == pytest.approx(chord, rel=0.05)
