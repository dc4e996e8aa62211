"""Plate, grips, taps, sweeps and vibration on the double: when they turn, stop and switch, and what is rejected."""

import json
import math
from typing import Any

import numpy as np
import pytest
from double import EngineDouble, GripsDouble
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.errors import InputError, RunError
from dem.phases.phase import Stage
from dem.phases.shake import Shake
from dem.plan.outlook import plan
from dem.plan.steps import time_steps
from dem.scene.reading import dump_scene, scene_hash
from dem.scene.scene import Scene
from dem.setting.vibration import Vibration

DT, DEPOSIT = 1e-4, {"type": "deposit"}
AREA = math.pi * 0.0234**2
COMPRESS = {"type": "compress", "speed_m_per_s": 0.01}
TENSION = {"type": "tension", "grip_m": 0.005, "distance_m": 0.004, "speed_m_per_s": 0.01}
UNGRIPPED = {key: value for key, value in TENSION.items() if key != "grip_m"}
LIFT = {"type": "lift", "distance_m": 0.004, "speed_m_per_s": 0.01}
REMOVE = {"type": "remove-container"}


def with_phase(*phases: dict[str, Any], **more: Any) -> Scene:
    return small({"engine": "links", "phases": [DEPOSIT, *phases], **more})


def standing(scene: Scene) -> EngineDouble:
    """Smarticles one above the other, 10 mm apart."""
    engine = EngineDouble.of(scene, DT)
    engine.gravity = 0.0
    heights = 0.01 * np.arange(1, scene.count + 1)
    places = np.column_stack([np.zeros((scene.count, 2)), heights])
    engine.add(Poses(places, (Rotation.identity(),) * scene.count))
    engine.calls.clear()
    return engine


def carry_out(scene: Scene, engine: EngineDouble, index: int = 1, *, anew: bool = False) -> Stage:
    """Run a phase to its end; with `anew` the stage is made from its memory, as plain data, at every call."""
    phase = scene.phases[index]
    stage = phase.begin(scene, index)
    while wait := stage.proceed(engine):
        engine.advance(max(1, round(wait / DT)))
        if anew:
            stage = Stage(phase, scene, index, json.loads(json.dumps(stage.memory)))
    return stage


def named(engine: EngineDouble, *names: str) -> list[tuple[Any, ...]]:
    return [call for call in engine.calls if call[0] in names]


# -- plate -------------------------------------------------------------------------------------------------------------


def pressed(anew: bool = False, stiffness: float = 1e3, **keys: Any) -> tuple[EngineDouble, list[float], Stage]:
    """An engine whose plate takes `stiffness` N/m from 10 mm below its first height on; heights where it turned."""
    scene = with_phase({**COMPRESS, **keys})
    engine = standing(scene)
    start = float(engine.state().tops.max()) + engine.particle.radius
    engine.boundaries.plate_rest, engine.boundaries.plate_stiffness = start - 0.01, stiffness
    turns: list[float] = []
    move = engine.boundaries.move_plate

    def noted(speed: float) -> None:
        assert engine.boundaries.plate_height is not None
        turns.append(start - engine.boundaries.plate_height)
        move(speed)

    engine.boundaries.move_plate = noted  # type: ignore[method-assign]
    return engine, turns, carry_out(scene, engine, anew=anew)


def test_a_plate_turns_at_the_stress_and_where_it_has_left_the_pile() -> None:
    stress = 1e3 * 0.002 / AREA
    engine, turns, stage = pressed(stress_Pa=stress, strain=0.5, cycles=2)
    # Within a check, a hundredth of a diameter.
    slack = 2.5e-5
    assert turns == pytest.approx([0.0, 0.012, 0.01, 0.012, 0.01, 0.012], abs=slack)
    assert [call[1] for call in named(engine, "move_plate")] == [-0.01, 0.01, -0.01, 0.01, -0.01, 0.0]
    assert engine.calls[-1] == ("remove_plate",)
    assert "warning" not in stage.memory


def test_a_plate_turns_at_a_strain_exactly_and_stays_where_it_shall() -> None:
    engine, turns, stage = pressed(strain=0.15, unload_stress_Pa=0, cycles=1, afterwards="stay")
    height = turns[-1] / 0.15
    assert turns == pytest.approx([0.0, 0.15 * height, 0.01, 0.15 * height], abs=2.5e-5)
    assert turns[1] == pytest.approx(0.15 * (0.1 + engine.particle.radius), rel=0.1)
    assert not named(engine, "remove_plate")
    assert "warning" not in stage.memory


def test_what_a_compression_remembers_is_enough_to_resume() -> None:
    stress = 1e3 * 0.002 / AREA
    one, turns, _ = pressed(stress_Pa=stress, strain=0.5, cycles=2)
    other, too, _ = pressed(True, stress_Pa=stress, strain=0.5, cycles=2)
    assert (one.steps, turns) == (other.steps, too)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"strain": 0.05}, "the plate touched nothing"),
        ({"stress_Pa": 1e9, "strain": 0.15}, "before stress_Pa = 1e+09 Pa"),
    ],
)
def test_a_plate_that_misses_its_aim_says_so(keys: dict[str, Any], said: str) -> None:
    _, _, stage = pressed(**keys)
    assert said in stage.memory["warning"]
    assert "strain" in stage.memory["warning"]


def test_a_plate_that_moves_far_in_a_period_of_the_vibration_says_how_large_the_stress_became() -> None:
    stress, shaken = 1e3 * 0.002 / AREA, {"peak_acceleration_g": 0.0, "frequency_hz": 100.0}
    _, _, stage = pressed(stress_Pa=stress, strain=0.5, vibration=shaken)
    assert "warning" not in stage.memory
    _, _, stage = pressed(stress_Pa=stress, strain=0.5, vibration={**shaken, "frequency_hz": 1.0})
    assert f"before the plate stopped at stress_Pa = {stress:g} Pa; lower speed_m_per_s" in stage.memory["warning"]


# -- grips -------------------------------------------------------------------------------------------------------------


def pulled(stiffness: float, *, anew: bool = False, **keys: Any) -> tuple[EngineDouble, GripsDouble]:
    scene = with_phase({**TENSION, **keys})
    engine = standing(scene)
    engine.grips = GripsDouble(calls=engine.calls, stiffness=stiffness)
    carry_out(scene, engine, anew=anew)
    return engine, engine.grips


def test_grips_hold_both_ends_and_the_upper_one_arrives() -> None:
    engine, _ = pulled(10.0, duration_s=0.5)
    assert named(engine, "hold") == [("hold", 0), ("hold", 9)]
    assert named(engine, "move") == [("move", 1, 0.0, 0.0, 0.01), ("move", 1, 0.0, 0.0, 0.0)]
    assert engine.calls[-1] == ("release",)
    assert engine.time == pytest.approx(0.5)


@pytest.mark.parametrize("anew", [False, True])
def test_a_held_grip_stops_at_its_limit(anew: bool) -> None:
    engine, _ = pulled(10.0, force_limit_N=0.02, anew=anew)
    # Reached at 2 mm, 0.2 s, plus a check; then held for 0.1 s.
    assert 0.3 < engine.time < 0.33


def test_grips_that_hold_everything_fail_with_the_length_that_does_not() -> None:
    with pytest.raises(RunError, match=r"phases\.1\.grip_m: .* are within 0\.09 m along z; use less than 0\.045 m"):
        pulled(10.0, grip_m=0.05)
    scene = with_phase({"type": "remove-container"}, {**TENSION, "axis": "x"})
    engine = standing(scene)
    engine.grips = GripsDouble(calls=engine.calls)
    engine.boundaries.remove_wall()
    with pytest.raises(RunError, match=r"phases\.2\.grip_m: .* are within 0 m along x; use bodies instead"):
        carry_out(scene, engine, 2)


def test_a_lift_holds_rigid_bodies_until_they_are_released() -> None:
    scene = with_phase({**LIFT, "above_m": 0.085}, {"type": "relax", "duration_s": 0.1}, {"type": "release"})
    engine = standing(scene)
    engine.grips = GripsDouble(calls=engine.calls)
    carry_out(scene, engine)
    assert engine.calls == [("hold", 8, 9), ("move", 0, 0.0, 0.0, 0.01), ("move", 0, 0.0, 0.0, 0.0)]
    carry_out(scene, engine, 3)
    assert engine.calls[-1] == ("release",)


# -- shaking -----------------------------------------------------------------------------------------------------------


def test_taps_and_rests_take_turns() -> None:
    scene = with_phase({"type": "shake", "taps": 3, "rest_s": 0.1, "frequency_hz": 50})
    assert scene.phases[1].known_duration == pytest.approx(3 * 0.12)
    engine = standing(scene)
    carry_out(scene, engine, anew=True)
    assert [call[0] for call in engine.calls] == ["shake", "stop"] * 3
    assert engine.time == pytest.approx(0.36)
    longer = with_phase({"type": "shake", "taps": 1, "rest_s": 0.0, "frequency_hz": 50, "duration_s": 0.2})
    engine = standing(longer)
    carry_out(longer, engine)
    assert engine.time == pytest.approx(0.2)


def test_a_sweep_ends_with_its_phase_and_cycles_have_whole_steps() -> None:
    scene = with_phase({"type": "shake", "duration_s": 0.5, "frequency_hz": 20, "frequency_end_hz": 47})
    engine = standing(scene)
    carry_out(scene, engine, anew=True)
    assert engine.time == pytest.approx(0.5)
    steps = [1 / call[2] / DT for call in named(engine, "shake")[:-1]]
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    phase = scene.phases[1]
    assert isinstance(phase, Shake)
    assert len(steps) == math.floor((20 + 47) / 2 * 0.5)


def test_a_sweep_down_to_a_low_frequency_never_completes_its_last_cycle() -> None:
    phase = Shake(type="shake", duration_s=1.0, frequency_hz=10, frequency_end_hz=0.01)
    assert phase.cycle_start(6) == math.inf
    assert phase.cycle_start(4) < 1.0


# -- vibration ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("anew", [False, True])
def test_vibration_switches_on_and_off_in_its_windows(anew: bool) -> None:
    vibration = {"peak_acceleration_g": 2, "frequency_hz": 50, "windows_s": [[0.05, 0.1], [0.2, 9]]}
    scene = with_phase({**TENSION, "vibration": vibration})
    engine = standing(scene)
    engine.grips = GripsDouble(calls=engine.calls)
    times = []
    shake, stop = engine.boundaries.shake, engine.boundaries.stop_shaking

    def shaken(**keys: Any) -> None:
        times.append(engine.time)
        shake(**keys)

    def stopped() -> None:
        times.append(engine.time)
        stop()

    engine.boundaries.shake, engine.boundaries.stop_shaking = shaken, stopped  # type: ignore[method-assign]
    carry_out(scene, engine, anew=anew)
    assert times == pytest.approx([0.05, 0.1, 0.2, 0.4], abs=1.1 * DT)
    assert [call[0] for call in engine.calls[-2:]] == ["release", "stop shaking"]


def test_vibration_is_planned_for() -> None:
    vibration = {"peak_acceleration_g": 2, "frequency_hz": 50}
    scene = with_phase({**COMPRESS, "vibration": vibration})
    effects = {effect.name: effect for effect in plan(scene).effects}
    assert "Γ = 2, f = 50 Hz" in effects["container motion"].why
    assert effects["plate"].on
    assert "10 mm/s to a strain of 0.3" in effects["plate"].why
    assert plan(scene).phases[1].estimate_s == pytest.approx(0.3 * scene.loose_height / 0.01)
    assert scene.phases[1].peak_acceleration == 2
    with pytest.raises(InputError, match=r"phases\.1\.vibration\.peak_acceleration_g: 100 .*; use at most"):
        time_steps(with_phase({**COMPRESS, "vibration": {"peak_acceleration_g": 100, "frequency_hz": 0.9}}))


def test_windows_of_vibration() -> None:
    vibration = Vibration(peak_acceleration_g=1, windows_s=((0.1, 0.2), (0.3, 0.4)))
    assert [vibration.next_switch(t) for t in (0, 0.1, 0.25, 0.35, 0.5)] == [
        (False, 0.1),
        (True, 0.2),
        (False, 0.3),
        (True, 0.4),
        (False, math.inf),
    ]


# -- scenes ------------------------------------------------------------------------------------------------------------


def test_new_keys_at_their_defaults_change_no_hash() -> None:
    plain = small({"phases.2": {"type": "shake"}})
    text = dump_scene(plain)
    assert not any(key in text for key in ("frequency_end_hz", "ramp", "taps", "rest_s", "vibration"))
    assert scene_hash(plain) == scene_hash(small({"phases.2": {"type": "shake", "rest_s": 0.5, "ramp": "linear"}}))
    assert scene_hash(plain) != scene_hash(small({"phases.2": {"type": "shake", "frequency_end_hz": 40}}))


@pytest.mark.parametrize(
    ("phases", "more", "key", "way_out"),
    [
        ([{**COMPRESS, "stress_Pa": 5, "unload_stress_Pa": 7}], {}, "phases.1.unload_stress_Pa: 7 Pa", "use less"),
        ([COMPRESS], {"hooks": {}}, "phases.1", "leave hooks or the phase out"),
        ([COMPRESS], {"engine": "yade"}, "phases.1 (compress): a plate", "engine: links"),
        ([COMPRESS], {"engine": "lammps"}, "phases.1 (compress): a plate", "engine: links"),
        ([{**COMPRESS, "strain": 1.5}], {}, "phases.1.strain", "0.95"),
        (
            [COMPRESS],
            {"container": {"tiers": [{"radius_m": 0.02, "height_m": 0.03}, {"radius_m": 0.018, "height_m": 0.1}]}},
            "phases.1",
            "give container.radius_m instead",
        ),
        ([TENSION], {"engine": "yade"}, "phases.1 (tension): grips of rigid bodies", "engine: links"),
        ([{**TENSION, "axis": "x"}], {}, "phases.1.axis", "remove-container"),
        ([{**TENSION, "bodies": [[0], [1]]}], {}, "phases.1.grip_m: give it, or bodies, but not both", "what is held"),
        ([{**UNGRIPPED, "bodies": [[0], [0, 1]]}], {}, "phases.1.bodies: 0 is in both grips", "to one of them"),
        ([{**UNGRIPPED, "bodies": [[0], [10]]}], {}, "phases.1.bodies: there is no body 10", "use 0 to 9"),
        ([TENSION], {"count": 1}, "count: 1", "at least 2"),
        ([{**TENSION, "duration_s": 0.1}], {}, "phases.1.duration_s: 0.1 s", "use at least 0.4 s"),
        ([{**LIFT, "grips": "tails"}], {}, "phases.1.grips", "use near"),
        ([{**LIFT, "nodes": [0]}], {}, "phases.1.nodes: rigid bodies are gripped as a whole", "choose bodies"),
        ([{**LIFT, "bodies": [10]}], {}, "phases.1.bodies: there is no body 10", "use 0 to 9"),
        ([{**LIFT, "bodies": []}], {}, "phases.1.bodies", "at least 1"),
        ([LIFT, {"type": "shape-change"}], {}, "phases.2: shape-change", "add release before"),
        ([LIFT, COMPRESS], {}, "phases.2: the plate of compress would run into", "add release before"),
        ([{**COMPRESS, "afterwards": "stay"}, LIFT], {}, "phases.2: lift would raise", "use afterwards: remove"),
        ([{**COMPRESS, "afterwards": "stay"}, TENSION], {}, "phases.2: tension would raise", "afterwards: remove"),
        (
            [{"type": "shake", "frequency_end_hz": 0.01}],
            {},
            "phases.1.frequency_end_hz: 0.01 Hz",
            "use at least 0.06",
        ),
        ([{"type": "release"}], {}, "phases.1: release", "add lift before"),
        ([{"type": "shake", "taps": 4, "duration_s": 1}], {}, "phases.1.duration_s: 1 s", "leave it out"),
        ([{"type": "shake", "ramp": "log", "frequency_end_hz": 60, "peak_acceleration_g": 0}], {}, "phases.1.ramp: log",
         "use linear"),
        ([{"type": "shake", "ramp": "log"}], {}, "phases.1.ramp: log", "give frequency_end_hz"),
        ([{"type": "shake", "rest_s": 0.1}], {}, "phases.1.rest_s: 0.1 s", "give taps"),
        ([{"type": "shake", "taps": 0}], {}, "phases.1.taps", "1"),
        (
            [{**COMPRESS, "vibration": {"peak_acceleration_g": 1, "windows_s": [[0.2, 0.1]]}}],
            {},
            "phases.1.vibration.windows_s.0",
            "on before off",
        ),
        (
            [{**COMPRESS, "vibration": {"peak_acceleration_g": 20, "moves": "floor"}}],
            {},
            "phases.1.vibration.moves",
            "or moves: container",
        ),
        (
            [{**TENSION, "vibration": {"peak_acceleration_g": 1, "windows_s": [[0.1, 0.2], [0.4, 0.5]]}}],
            {},
            "phases.1.vibration.windows_s.1: [0.4, 0.5] s begins after the end of the phase, which takes 0.4 s",
            "lengthen",
        ),
        (
            [{"type": "pull-hook", "vibration": {"peak_acceleration_g": 2}}],
            {"hooks": {}, "engine": "yade"},
            "phases.1 (pull-hook): vibration",
            "engine: links",
        ),
        ([], {"plane": {}, "phases": [{"type": "arrange", "gap_m": 0.001}, COMPRESS]}, "phases.1: compress", "plane"),
    ],
)  # fmt: skip
def test_bad_blocks_are_rejected(phases: list[dict[str, Any]], more: dict[str, Any], key: str, way_out: str) -> None:
    with pytest.raises(InputError) as caught:
        with_phase(*phases, **more)
    message = str(caught.value)
    assert message.startswith(f"scene.yaml: {key}")
    assert way_out in message
    assert "\n" not in message


def test_tension_between_grips_is_not_for_filaments() -> None:
    worm = {"shape": "filament", "length_m": 0.03, "diameter_m": 8e-4, "young_modulus_Pa": 5e4}
    with pytest.raises(InputError, match=r"phases\.1: tension holds rigid bodies, .*; use lift"):
        with_phase(TENSION, particle=worm)


def test_allowed_blocks_after_the_wall_has_gone() -> None:
    stays = {**COMPRESS, "afterwards": "stay"}
    with_phase(REMOVE, stays, {**TENSION, "axis": "x"}, COMPRESS, LIFT, {"type": "release"}, COMPRESS)
    with_phase(REMOVE, {**TENSION, "axis": "x"}, COMPRESS, LIFT, {"type": "release"}, {"type": "shape-change"})


def test_what_a_lift_holds_is_free_after_a_tension() -> None:
    with_phase(LIFT, TENSION, COMPRESS, {"type": "shape-change"})


@pytest.mark.parametrize("phase", ["lift", "pull-hook", "tension", "shake"])
def test_the_least_duration_that_a_message_names_is_accepted(phase: str) -> None:
    rng = np.random.default_rng(3)
    for distance, speed in rng.uniform(0.005, 0.1, (30, 2)).round(4).tolist():
        keys = {"distance_m": distance, "speed_m_per_s": speed}
        if phase == "shake":
            keys = {"taps": 3, "frequency_hz": 1000 * speed, "rest_s": distance}
        elif phase == "tension":
            keys["grip_m"] = 0.001
        with pytest.raises(InputError) as caught:
            with_phase({"type": phase, **keys, "duration_s": 0.01}, hooks={})
        least = str(caught.value).partition("use at least ")[2].partition(" s")[0]
        with_phase({"type": phase, **keys, "duration_s": float(least)}, hooks={})
