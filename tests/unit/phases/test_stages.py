"""Each phase while it runs, against an engine in memory: its calls of the engine, and how long it takes."""

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from double import EngineDouble, GripsDouble
from scenes import chain, small
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.errors import InputError, RunError
from dem.phases.phase import CHECK_INTERVAL, Stage, begin_wait, waits_in_vain
from dem.scene.scene import Scene

DT = 2e-4
DEPOSIT = {"type": "deposit", "per_layer": 5}


def begin(*phases: dict[str, Any], **changes: Any) -> tuple[Scene, EngineDouble]:
    """A scene of a pour and some phases, and its engine with three smarticles that stand on the floor."""
    scene = small({"phases": [DEPOSIT, *phases], "count": 3, **changes})
    engine = EngineDouble.of(scene, DT)
    perform(scene.phases[0].begin(scene, 0), engine)
    engine.calls.clear()
    return scene, engine


def perform(stage: Stage, engine: EngineDouble, fresh: Callable[[], Stage] | None = None) -> dict[str, Any]:
    """Run a stage to its end, with `fresh` anew from its memory at every check; return what it remembers."""
    while wait := stage.proceed(engine):
        engine.advance(max(1, round(wait / engine.time_step)))
        if fresh is not None:
            memory, stage = json.loads(json.dumps(stage.memory)), fresh()
            stage.memory = memory
    return stage.memory


def run_phase(scene: Scene, engine: EngineDouble, index: int = 1) -> float:
    """Run a phase; how long it took [s]."""
    begun = engine.time
    perform(scene.phases[index].begin(scene, index), engine)
    return engine.time - begun


# -- every phase -------------------------------------------------------------------------------------------------------

SWING = {"type": "internal-oscillation", "theta_deg": 4, "duration_s": 0.05}
PHASES: list[dict[str, Any]] = [
    {"type": "relax", "duration_s": 0.05},
    {"type": "shake", "duration_s": 0.05},
    SWING,
    {"type": "shape-change", "opening_s": 0.27, "closing_s": 0.27},
    {"type": "actuate", "barbs": {"type": "ramp", "to_deg": 80, "duration_s": 0.05}},
    {"type": "remove-container", "duration_s": 0.05},
    {"type": "remove-container", "duration_s": 0.05, "speed_m_per_s": 0.3},
    {"type": "pull-hook", "distance_m": 1e-3, "speed_m_per_s": 0.02, "force_limit_N": 1.0},
]


@pytest.mark.parametrize("phase", PHASES, ids=[phase["type"] for phase in PHASES])
def test_a_phase_takes_its_known_duration_and_remembers_all_that_it_needs(phase: dict[str, Any]) -> None:
    ends = []
    for anew in (False, True):
        scene, engine = begin(phase, hooks={})
        begun = engine.time

        def stage(scene: Scene = scene) -> Stage:
            return scene.phases[1].begin(scene, 1)

        perform(stage(), engine, stage if anew else None)
        known = scene.phases[1].known_duration
        assert known is not None
        assert engine.time - begun == pytest.approx(known, abs=DT)
        ends.append((engine.steps, engine.calls))
    assert ends[0] == ends[1]


# -- pour --------------------------------------------------------------------------------------------------------------


def test_a_pour_adds_layers_one_after_the_other_and_waits_until_all_stand() -> None:
    scene = small({"count": 12})
    engine = EngineDouble.of(scene, DT)
    assert scene.phases[0].known_duration is None
    duration = run_phase(scene, engine, 0)
    assert engine.calls == [("add", 5), ("add", 5), ("add", 2)]
    assert engine.touches().all()
    # Three falls of less than 2w, each checked every 10 ms, and 50 ms of rest.
    assert 3 * 0.01 < duration < 3 * 0.12
    assert engine.positions[:, 2] == pytest.approx(engine.stands)


def test_no_body_begins_in_a_bar_that_stands_on_its_edge_lower_than_the_top() -> None:
    # The axis of one body is 0.9 mm below that of the other, but its rows reach 0.35 mm into the room of the layer.
    flat = {"fidelity": "reference", "smarticle.thickness_normal_m": 3e-3, "container.radius_m": 0.015}
    thin = {"phases.0.layer_height_w": 0.01, "phases.0.per_layer": 10}
    for seed in (2, 4, 6, 8):
        scene = small({"seed": seed, "count": 12, **flat, **thin})
        engine = EngineDouble.of(scene, DT)
        places = np.array([[0.0, -0.008, 1.5e-3], [0.0, 0.008, 2.4e-3]])
        engine.add(Poses(places, (Rotation.identity(),) * 2))
        stage = scene.phases[0].begin(scene, 0)
        stage.memory["left"] -= 2
        stage.proceed(engine)
        spheres = engine.state().spheres(scene.body)
        assert len(spheres) == 12
        nearest = cKDTree(spheres[2:].reshape(-1, 3)).query(spheres[:2].reshape(-1, 3))[0].min()
        assert nearest > scene.sphere_diameter


def test_a_resumed_pour_draws_the_same_poses() -> None:
    poses = []
    for anew in (False, True):
        scene = small({"count": 12})
        engine = EngineDouble.of(scene, DT)
        perform(
            scene.phases[0].begin(scene, 0),
            engine,
            (lambda scene=scene: scene.phases[0].begin(scene, 0)) if anew else None,
        )
        poses.append(engine.state().link_positions)
    assert np.array_equal(*poses)


def test_a_layer_has_ten_times_as_long_as_a_fall_takes_at_low_gravity() -> None:
    # √(2w/g) is 2.8 s; some smarticles of each of the two layers fall that far.
    scene = small({"gravity_m_per_s2": 0.003})
    engine = EngineDouble.of(scene, 5 * DT)
    duration = run_phase(scene, engine, 0)
    assert engine.touches().all()
    assert duration > 2 * 2.0


@pytest.mark.parametrize(
    ("gravity", "speed", "said"),
    [
        (9.81, 0.0, r"2 s .*: 5 of them touch nothing at 9\.81 m/s² of gravity.*; lower contact\.restitution or "),
        (9.81, 0.3, r"2 s .*: the fastest falls at 0\.3 m/s, limit 0\.2 m/s; raise phases\.0\.landed_speed_m_per_s"),
        (0.01, 0.0, r"\d\d\S* s .*: 5 of them touch nothing at 0\.01 m/s² of gravity"),
    ],
)
def test_a_layer_that_does_not_land_is_reported_with_what_keeps_it(
    monkeypatch: pytest.MonkeyPatch, gravity: float, speed: float, said: str
) -> None:
    def hover(engine: EngineDouble) -> None:
        engine.velocities[:, 2] = -speed
        engine.steps += 1

    monkeypatch.setattr(EngineDouble, "_step", hover)
    scene = small({"gravity_m_per_s2": gravity})
    engine = EngineDouble.of(scene, CHECK_INTERVAL)
    with pytest.raises(RunError, match=rf"^a layer of 5 had not come down {said}") as caught:
        run_phase(scene, engine, 0)
    if gravity < 1:
        waited = float(str(caught.value).split(" s after")[0].split()[-1])
        assert waited == pytest.approx(10 * math.sqrt(2 * scene.cylinder.height / gravity), rel=0.01)


@pytest.mark.parametrize(
    ("drift", "unbalanced", "said"),
    [(0.1, 0.0, "speed 0.1 m/s (limit 0.02 m/s) of smarticle 0"), (0.0, 0.3, "unbalanced force 0.3 (limit 0.05)")],
)
def test_a_pile_that_does_not_settle_is_reported_with_its_residuals(
    monkeypatch: pytest.MonkeyPatch, drift: float, unbalanced: float, said: str
) -> None:
    # Each of the two by itself keeps a pile from counting as settled.
    monkeypatch.setattr(EngineDouble, "unbalanced_force", lambda _: unbalanced)
    scene = small({"phases.0.settle.timeout_s": 0.1})
    engine = EngineDouble.of(scene, DT)
    engine.drift = drift
    with pytest.raises(RunError, match=r"not settled after 0\.1 s: .*; raise phases\.0\.settle\.timeout_s") as caught:
        run_phase(scene, engine, 0)
    assert said in str(caught.value)


def test_a_pile_at_rest_whose_forces_fluctuate_counts_as_settled_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(EngineDouble, "unbalanced_force", lambda _: 0.3)
    scene = small({"phases.0.settle.timeout_s": 1})
    engine = EngineDouble.of(scene, DT)
    memory = perform(scene.phases[0].begin(scene, 0), engine)
    assert engine.time > 1
    assert memory["warning"].startswith("contact forces still fluctuate, unbalanced force 0.3 (limit 0.05), but for 1")
    # Mean net forces of 2 m (0.02 m/s) over half a second are 0.8 % of the weight.
    scene = small({"phases.0.settle": {"timeout_s": 1, "unbalanced_force": 3e-3}})
    with pytest.raises(RunError, match=r"unbalanced force 0\.3 \(limit 0\.003\)"):
        run_phase(scene, EngineDouble.of(scene, DT), 0)


@pytest.mark.parametrize(("halved_every", "waited"), [(0.05, 0.25), (0.5, 0.1)])
def test_a_wait_goes_on_while_the_pile_loses_energy(halved_every: float, waited: float) -> None:
    memory: dict[str, Any] = {}
    begin_wait(memory)
    while not waits_in_vain(memory, max(0.5 ** (memory["waited"] / halved_every), 0.1), 0.1):
        memory["waited"] += CHECK_INTERVAL
    # One pile loses half its energy in half of the longest wait, until 0.17 s; the other loses 7 %.
    assert memory["judged"] == pytest.approx(waited)


# -- container ---------------------------------------------------------------------------------------------------------


def test_the_floor_alone_is_shaken_within_its_wall() -> None:
    floor = {"type": "shake", "duration_s": 0.1, "moves": "floor"}
    scene, engine = begin(floor)
    run_phase(scene, engine)
    assert [call[0] for call in engine.calls] == ["shake the floor", "stop"]
    with pytest.raises(InputError, match=r"phases\.1\.moves: the floor alone would go 0\.00276 m down, and the wall"):
        begin(floor | {"peak_acceleration_g": 10})
    begin(floor | {"peak_acceleration_g": 10, "moves": "container"})


def test_a_wall_is_removed_at_once() -> None:
    scene, engine = begin({"type": "remove-container", "duration_s": 0.5})
    run_phase(scene, engine)
    assert engine.calls == [("remove_wall",)]


@pytest.mark.parametrize(("thickness", "seed"), [(1.27e-3, 11), (3e-3, 2)])
def test_a_lifted_wall_is_removed_when_it_is_clear_of_all_rows_of_links(thickness: float, seed: int) -> None:
    speed = 0.01
    lifted = {"type": "remove-container", "duration_s": 2.0, "speed_m_per_s": speed}
    scene, engine = begin(lifted, fidelity="reference", seed=seed, **{"smarticle.thickness_normal_m": thickness})
    top = engine.state().spheres(scene.body)[..., 2].max() + scene.body.radius
    stage, bottoms = scene.phases[1].begin(scene, 1), []
    while wait := stage.proceed(engine):
        if engine.boundaries.walled:
            bottoms.append(engine.boundaries.wall_bottom)
        engine.advance(round(wait / DT))
    assert engine.calls == [("lift_wall", speed), ("remove_wall",)]
    assert bottoms[-1] < top < bottoms[-1] + speed * CHECK_INTERVAL * 1.01


@pytest.mark.parametrize(
    "later",
    [
        {"type": "shake"},
        {"type": "tension", "axis": "x", "grip_m": 0.001, "distance_m": 0.01, "speed_m_per_s": 0.01},
    ],
)
def test_a_wall_that_is_not_clear_stays_and_a_later_shake_or_pull_fails(later: dict[str, Any]) -> None:
    phases = {"type": "remove-container", "duration_s": 0.1, "speed_m_per_s": 0.01}, later
    scene, engine = begin(*phases, engine="links")
    engine.grips = GripsDouble(calls=engine.calls)
    run_phase(scene, engine)
    assert engine.calls == [("lift_wall", 0.01), ("stop",)]
    assert engine.boundaries.walled
    with pytest.raises(
        RunError, match=r"the wall is still around the pile, its lower edge .* m below .*; raise duration_s"
    ):
        run_phase(scene, engine, 2)


# -- motors and strings ------------------------------------------------------------------------------------------------


def test_motors_update_once_in_each_control_period_and_once_more_at_the_end() -> None:
    ramp = {"type": "ramp", "to_deg": 88, "duration_s": 0.01}
    scene, engine = begin({"type": "actuate", "barbs": ramp})
    assert run_phase(scene, engine) == pytest.approx(0.01, abs=DT)
    interval = scene.fidelity.control_interval_s
    assert engine.calls == [("articulate",), *[("actuate", interval)] * (round(0.01 / interval) + 1)]
    assert engine.motors.readings is not None
    assert np.degrees(engine.motors.readings.commands) == pytest.approx(88)


def strained(**changes: Any) -> tuple[EngineDouble, float]:
    scene = chain({"phases.1.distance_m": 0.05, "phases.1.speed_m_per_s": 0.5, **changes})
    engine = EngineDouble.of(scene, scene.fidelity.control_interval_s)
    run_phase(scene, engine, 0)
    assert engine.calls == [("add", 6)]
    engine.calls.clear()
    return engine, run_phase(scene, engine, 1)


def test_a_chain_is_laid_out_at_once_tied_and_let_go_at_the_end_of_the_way() -> None:
    # It would part at 21 mm.
    engine, duration = strained(**{"phases.1.distance_m": 0.01})
    assert [call for call in engine.calls if call[0] != "actuate"] == [
        ("articulate",),
        ("tie", 0.1, 0.0, 0.5),
        ("untie",),
    ]
    assert duration == pytest.approx(0.01 / 0.5, abs=1e-4)


@pytest.mark.parametrize("at_once", [2, 7, 64])
def test_several_control_updates_in_one_call(at_once: int) -> None:
    ramp = {"type": "ramp", "to_deg": 88, "duration_s": 0.01}
    ends = []
    for updates in (1, at_once):
        scene, engine = begin({"type": "actuate", "barbs": ramp})
        engine.motors.updates_at_once = updates
        run_phase(scene, engine)
        ends.append((np.array(engine.motors.targets), engine.time))
    assert len(ends[0][0]) == round(0.01 / scene.fidelity.control_interval_s) + 1
    np.testing.assert_array_equal(ends[0][0], ends[1][0])
    assert ends[0][1] == pytest.approx(ends[1][1], abs=1e-9)
