"""Actuated phases: presets and what they are short for, who moves, where it begins, target angles over time."""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from scenes import small

from dem.phases.actuate import Actuate
from dem.phases.gaits.drive import Drive, actuated, drive
from dem.phases.internal_oscillation import InternalOscillation
from dem.phases.shape_change import ShapeChange
from dem.scene.reading import dump_scene, json_schema, load_scene, parse_scene, scene_hash
from dem.scene.scene import Scene
from dem.setting.fidelity import FIDELITIES
from dem.setting.motion import Triangle
from dem.setting.motor import Motor

SceneData = Callable[..., dict[str, Any]]
Active = Callable[..., Scene]

SHAPE_CHANGE = {"type": "shape-change"}
OSCILLATION = {"type": "internal-oscillation", "theta_deg": 10}


@pytest.fixture
def active() -> Active:
    """A scene of a pour and the given phases."""

    def make(*phases: dict[str, Any], **changes: Any) -> Scene:
        dotted = {key.replace("__", "."): value for key, value in changes.items()}
        return small({"phases": [{"type": "deposit"}, *phases], **dotted})

    return make


def targets(driven: Drive, *times: float) -> NDArray[np.float64]:
    """(T, N, 2) [deg]."""
    return np.degrees([driven.targets(time) for time in times])


def same(one: Drive, other: Drive) -> bool:
    times = np.linspace(0, one.duration, 301)
    return (
        one.duration == other.duration
        and bool(np.array_equal(one.active, other.active))
        and all(np.array_equal(one.targets(time), other.targets(time)) for time in times)
    )


# -- motor and fidelity --------------------------------------------------------------------------------------------


def test_motor_defaults_are_the_papers() -> None:
    scene = small()
    assert scene.motor == Motor()
    assert (scene.motor.speed_limit_rad_per_s, scene.motor.law, scene.motor.stiffness_N_m_per_rad) == (6, "halt", 3e-3)
    assert scene.motor.torque_limit_N_m is None
    assert scene.torque_limit == pytest.approx(1.607e-5, rel=1e-3)


@pytest.mark.parametrize("ratio", [0.4, 1.4])
def test_default_torque_is_the_weight_of_the_papers_smarticle_at_the_lever_w(ratio: float) -> None:
    scene = small({"smarticle.aspect_ratio": ratio, "smarticle.density_kg_per_m3": 1000, "gravity_m_per_s2": 1.62})
    assert scene.torque_limit == pytest.approx(1000 * 1.27e-3 * 0.5e-3 * 0.0117 * 2.4 * 1.62 * 0.0117)


def test_torque_by_hand() -> None:
    scene = small({"motor": {"torque_limit_N_m": 2e-5, "law": "slip"}})
    assert scene.torque_limit == 2e-5
    assert scene.motor.law == "slip"


def test_fidelity_knobs_of_actuation() -> None:
    for name in FIDELITIES:
        fidelity = small({"fidelity": name}).fidelity
        assert fidelity.control_interval_s == 2e-4
        assert fidelity.hinge_stiffness_N_per_m == (5000 if name == "draft" else 14500)


# -- presets -------------------------------------------------------------------------------------------------------


def test_shape_change_by_hand(active: Active) -> None:
    scene = active(SHAPE_CHANGE)
    driven = drive(scene, 1)
    assert scene.phases[1].duration_s == driven.duration == 3
    assert driven.active.all()
    angles = targets(driven, 0, 0.75, 1.5, 2.25, 3)
    assert angles.shape == (5, 10, 2)
    assert angles[:, 3, 1] == pytest.approx([90, 45, 0, 45, 90])
    assert np.ptp(angles, axis=(1, 2)) == pytest.approx(0)


def test_shape_change_is_short_for_a_sequence(active: Active) -> None:
    steps = [
        {"type": "ramp", "to_deg": 10, "duration_s": 1.25},
        {"type": "hold", "duration_s": 0.5},
        {"type": "ramp", "to_deg": 90, "duration_s": 2.0},
    ]
    preset = {"type": "shape-change", "straight_deg": 10, "opening_s": 1.25, "straight_hold_s": 0.5, "closing_s": 2}
    spelled = {"type": "actuate", "barbs": {"type": "sequence", "steps": steps}}
    assert active(preset).phases[1].duration_s == active(spelled).phases[1].duration_s == 3.75
    assert same(drive(active(preset), 1), drive(active(spelled), 1))
    without_hold = {"type": "actuate", "barbs": {"type": "sequence", "steps": steps[::2]}}
    assert same(drive(active({**preset, "straight_hold_s": 0}), 1), drive(active(without_hold), 1))


def test_shape_change_leads_each_barb_back_to_where_it_began(active: Active) -> None:
    driven = drive(active(SHAPE_CHANGE, smarticle__angles_deg=[80, 40]), 1)
    assert targets(driven, 0, 0.75, 1.5, 3)[:, 0] == pytest.approx(
        np.array([[80, 40], [40, 20], [0, 0], [80, 40]]), abs=1e-9
    )


def test_oscillation_is_short_for_a_triangle_about_the_smarticles_own_angles(active: Active) -> None:
    waves = [
        {"type": "triangle", "centre_deg": angle, "amplitude_deg": 5, "speed_rad_per_s": 6} for angle in (80.0, 40.0)
    ]
    spelled = {"type": "actuate", "barb_1": waves[0], "barb_2": waves[1], "duration_s": 5}
    for more in ({}, {"active_fraction": 0.5, "offsets": "random"}):
        scenes = [
            active({**phase, **more}, smarticle__angles_deg=[80, 40], smarticle__aspect_ratio=0.7)
            for phase in (OSCILLATION, spelled)
        ]
        assert same(drive(scenes[0], 1), drive(scenes[1], 1))


def test_oscillation_by_hand(active: Active) -> None:
    driven = drive(active({**OSCILLATION, "theta_deg": 20}), 1)
    quarter = math.radians(10) / 6
    assert driven.duration == 5
    assert targets(driven, 0, quarter / 2, quarter, 2 * quarter, 3 * quarter, 4 * quarter)[:, 7, 0] == pytest.approx(
        [90, 95, 100, 90, 80, 90], abs=1e-6
    )


@pytest.mark.parametrize(("ratio", "amplitude"), [(0.4, 8.75), (0.7, 5), (1.4, 2.5)])
def test_amplitude_rule_keeps_the_arc_of_the_tip(active: Active, ratio: float, amplitude: float) -> None:
    def wave(**changes: Any) -> Triangle:
        scene = active({**OSCILLATION, **changes}, smarticle__aspect_ratio=ratio, motor__speed_limit_rad_per_s=4)
        phase = scene.phases[1]
        assert actuated(phase)
        motion = phase.gait(scene.smarticle, scene.motor).motions[1]
        assert isinstance(motion, Triangle)
        return motion

    assert wave().amplitude_deg == pytest.approx(amplitude)
    assert wave(scaled=False).amplitude_deg == 5
    assert wave().speed_rad_per_s == 4
    assert wave().amplitude_deg * ratio == pytest.approx(5 * 0.7)  # times w in radians: the arc


def test_what_counts_as_actuated(active: Active) -> None:
    spelled = {"type": "actuate", "barbs": {"type": "hold"}, "duration_s": 1}
    scene = active({"type": "relax"}, SHAPE_CHANGE, OSCILLATION, {"type": "shake"}, spelled)
    assert [actuated(phase) for phase in scene.phases] == [False, False, True, True, False, True]
    kinds = [type(scene.phases[index]) for index in (2, 3, 5)]
    assert kinds == [ShapeChange, InternalOscillation, Actuate]


# -- who moves, from where, when -----------------------------------------------------------------------------------


def test_each_barb_may_have_a_motion_of_its_own(active: Active) -> None:
    phase = {
        "type": "actuate",
        "barb_1": {"type": "hold", "duration_s": 2},
        "barb_2": {"type": "ramp", "to_deg": 30, "duration_s": 2},
    }
    scene = active(phase)
    assert scene.phases[1].duration_s == 2
    assert targets(drive(scene, 1), 0, 1, 2)[:, 4] == pytest.approx(np.array([[90, 90], [90, 60], [90, 30]]))


def test_a_phase_may_cut_its_motion(active: Active) -> None:
    ramp = {"type": "ramp", "to_deg": 0, "duration_s": 2}
    scene = active({"type": "actuate", "barbs": ramp, "duration_s": 1}, {"type": "relax"}, SHAPE_CHANGE)
    driven = drive(scene, 1)
    assert driven.duration == 1
    assert targets(driven, -1, 1, 1.5)[:, 0, 0] == pytest.approx([90, 45, 45])  # times beyond the phase: its ends
    # The next actuated phase begins there, and leads back there.
    assert targets(drive(scene, 3), 0, 1.5, 3)[:, 0, 0] == pytest.approx([45, 0, 45])


def test_inactive_smarticles_keep_their_last_target(active: Active) -> None:
    ramp = {"type": "ramp", "to_deg": 30, "duration_s": 1}
    half = {"type": "actuate", "barbs": ramp, "active_fraction": 0.5}
    scene = active(half, half, SHAPE_CHANGE, count=20)
    first, second, last = (drive(scene, index) for index in (1, 2, 3))
    assert first.active.sum() == second.active.sum() == 10
    assert not np.array_equal(first.active, second.active)  # each phase draws anew
    expected = np.where(first.active, 60.0, 90.0)
    assert targets(first, 0.5)[0] == pytest.approx(np.stack([expected, expected], axis=1))
    # Those that have moved before start at 30°, the others at 90°.
    begun = np.where(first.active, 30.0, 90.0)
    middle = np.where(second.active, (begun + 30) / 2, begun)
    assert targets(second, 0, 0.5)[:, :, 1] == pytest.approx(np.array([begun, middle]))
    end = np.where(first.active | second.active, 30.0, 90.0)
    assert targets(last, 0, 0.75, 3)[:, :, 0] == pytest.approx(np.array([end, end / 2, end]))


@pytest.mark.parametrize(("fraction", "expected"), [(1.0, 20), (0.5, 10), (0.26, 5), (0.24, 5), (0.05, 1)])
def test_share_of_active_smarticles(active: Active, fraction: float, expected: int) -> None:
    driven = drive(active({**OSCILLATION, "active_fraction": fraction}, count=20), 1)
    assert driven.active.sum() == expected


def test_draws_follow_from_the_seed_alone(active: Active) -> None:
    phase = {**OSCILLATION, "active_fraction": 0.5, "offsets": "random"}

    def drawn(**changes: Any) -> Drive:
        return drive(active({**phase, **changes.pop("phase", {})}, count=200, **changes), 1)

    one = drawn(seed=3)
    assert same(one, drawn(seed=3))
    assert same(one, drawn(seed=3, fidelity="reference", name="other"))
    other = drawn(seed=4)
    assert not np.array_equal(one.active, other.active)
    assert one.active.sum() == other.active.sum() == 100
    both = one.active & other.active
    assert abs(one.targets(0) - other.targets(0))[both].max() > 0.01  # offsets are drawn anew as well
    again = drive(active(phase, phase, count=200, seed=3), 2)
    assert abs(one.targets(0) - again.targets(0))[one.active & again.active].max() > 0.01
    # A smaller share is part of a larger one, and each smarticle keeps its offset.
    fewer = drawn(seed=3, phase={"active_fraction": 0.1})
    assert fewer.active.sum() == 20
    assert not (fewer.active & ~one.active).any()
    assert fewer.targets(0.3)[fewer.active] == pytest.approx(one.targets(0.3)[fewer.active], abs=1e-12)


def test_random_offsets_are_spread_evenly_over_a_period(active: Active) -> None:
    phase = {**OSCILLATION, "theta_deg": 20, "offsets": "random"}
    scene = active(phase, count=2000)
    driven = drive(scene, 1)
    period = 4 * math.radians(10) / 6
    early, late = targets(driven, 0.0, period)
    assert early == pytest.approx(late, abs=1e-6)
    assert np.array_equal(early[:, 0], early[:, 1])  # the barbs of one smarticle keep their relation
    # A triangle at a uniformly drawn point: uniform between its extremes, half of them rising.
    counts, _ = np.histogram(early[:, 0], bins=10, range=(80, 100))
    assert counts.sum() == 2000
    assert abs(counts - 200).max() < 5 * math.sqrt(200 * 0.9)  # five standard deviations
    rising = (targets(driven, 1e-4)[0, :, 0] > early[:, 0]).mean()
    assert abs(rising - 0.5) < 5 * 0.5 / math.sqrt(2000)
    # The next phase begins where each of them ended.
    after = active(phase, SHAPE_CHANGE, count=2000)
    assert np.array_equal(drive(after, 2).targets(0), driven.targets(5))
    assert drive(after, 2).targets(3) == pytest.approx(driven.targets(5))


def test_random_offsets_shift_both_barbs_by_the_same_time(active: Active) -> None:
    def sine(frequency: float) -> dict[str, Any]:
        return {"type": "sine", "centre_deg": 60, "amplitude_deg": 5, "frequency_hz": frequency}

    phase = {"type": "actuate", "barb_1": sine(1), "barb_2": sine(2), "duration_s": 2, "offsets": "random"}
    angles = targets(drive(active(phase, count=100), 1), 0)[0]
    # sin 2x = 2 sin x cos x, whatever the offset x.
    first, second = ((angles - 60) / 5).T
    assert second**2 == pytest.approx(4 * first**2 * (1 - first**2), abs=1e-9)
    assert np.ptp(first) > 1.9


def test_offsets_and_a_barb_that_holds(active: Active) -> None:
    wave = {"type": "triangle", "centre_deg": 90, "amplitude_deg": 5, "speed_rad_per_s": 6}
    phase = {"type": "actuate", "barb_1": wave, "barb_2": {"type": "hold"}, "duration_s": 1, "offsets": "random"}
    angles = targets(drive(active(phase), 1), 0.3)[0]
    assert angles[:, 1] == pytest.approx(90)
    assert np.ptp(angles[:, 0]) > 1


def test_offset_of_a_short_swing_covers_its_whole_period(active: Active) -> None:
    # The phase lasts a tenth of the period, and so does the motion: offsets lead beyond its end.
    wave = {"type": "sine", "centre_deg": 60, "amplitude_deg": 10, "frequency_hz": 1, "duration_s": 0.1}
    angles = targets(drive(active({"type": "actuate", "barbs": wave, "offsets": "random"}, count=500), 1), 0)
    assert angles.min() == pytest.approx(50, abs=0.1)
    assert angles.max() == pytest.approx(70, abs=0.1)


def test_single_active_smarticle_has_its_offset(active: Active) -> None:
    phase = {**OSCILLATION, "active_fraction": 0.1, "offsets": "random"}
    driven = drive(active(phase), 1)
    assert driven.active.sum() == 1
    assert abs(targets(driven, 0)[0][driven.active] - 90).min() > 0.01


# -- scene files ---------------------------------------------------------------------------------------------------

GAIT = """
schema_version: 1
seed: 5
count: 30
phases:
  - type: deposit
  - type: actuate            # crawl: lift, swing, lower, swing back, for ten seconds
    duration_s: 10
    active_fraction: 0.5
    offsets: random
    barb_1:
      type: sequence
      repeat: null
      steps:
        - {type: ramp, to_deg: 45, duration_s: 0.5}
        - {type: hold, duration_s: 0.25}
        - {type: return, duration_s: 0.5}
    barb_2: {type: sine, centre_deg: 80, amplitude_deg: 10, frequency_hz: 0.8, cycles_offset: 0.25}
  - {type: relax, duration_s: 0.5}
"""


def test_a_users_own_gait(tmp_path: Path) -> None:
    path = tmp_path / "gait.yaml"
    path.write_text(textwrap.dedent(GAIT), encoding="utf-8")
    scene = load_scene(path, ["phases.1.barb_1.steps.0.to_deg=30", "phases.1.offsets=none"])
    driven = drive(scene, 1)
    first = int(np.flatnonzero(driven.active)[0])
    assert targets(driven, 0, 0.25, 0.5, 0.6, 1.0, 1.25, 1.5, 8.75 + 0.5)[:, first, 0] == pytest.approx(
        [90, 60, 30, 30, 60, 90, 60, 30], abs=1e-9
    )
    assert targets(driven, 0, 0.625)[:, first, 1] == pytest.approx([90, 70])
    assert load_scene(path) == parse_scene(yaml.safe_load(dump_scene(load_scene(path))), source="dump")


@pytest.mark.parametrize(
    "phase",
    [
        SHAPE_CHANGE,
        OSCILLATION,
        {"type": "actuate", "barbs": {"type": "ramp", "to_deg": 0, "duration_s": 1}},
        {"type": "actuate", "barb_1": {"type": "hold"}, "barb_2": {"type": "hold"}, "duration_s": 1},
    ],
)
def test_dump_comes_back_to_the_same_scene(active: Active, phase: dict[str, Any]) -> None:
    scene = active(phase)
    again = parse_scene(yaml.safe_load(dump_scene(scene)), source="dump")
    assert again == scene
    assert scene_hash(again) == scene_hash(scene)


def test_a_length_that_follows_from_the_motion_is_the_same_as_one_written_out(active: Active) -> None:
    phase = {"type": "actuate", "barbs": {"type": "ramp", "to_deg": 0, "duration_s": 1.5}}
    assert scene_hash(active(phase)) == scene_hash(active({**phase, "duration_s": 1.5}))
    assert scene_hash(active(phase)) != scene_hash(active({**phase, "duration_s": 1.4}))


def test_schema_describes_motions_and_phases() -> None:
    schema = json.loads(json.dumps(json_schema()))
    phases = schema["properties"]["phases"]["items"]["discriminator"]["mapping"]
    assert set(phases) >= {"deposit", "relax", "shake", "actuate", "shape-change", "internal-oscillation"}
    steps = schema["$defs"]["Sequence"]["properties"]["steps"]["items"]["discriminator"]["mapping"]
    assert set(steps) == {"hold", "ramp", "return", "sine", "triangle", "sequence"}
    assert schema["$defs"]["Actuate"]["required"] == ["type"]
    assert schema["$defs"]["InternalOscillation"]["required"] == ["type", "theta_deg"]
    assert "[rad/s]" in schema["$defs"]["Motor"]["properties"]["speed_limit_rad_per_s"]["description"]
