"""A motion that a smarticle cannot do is refused with one line: what, where, the value with its unit, the way out."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import dem.scene.scene
from dem.errors import InputError
from dem.phases.actuation_checks import actuation_warnings, overshoot
from dem.plan.outlook import plan
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

SceneData = Callable[..., dict[str, Any]]

HOLD = {"type": "hold"}
RAMP = {"type": "ramp", "to_deg": 0, "duration_s": 1}
SINE = {"type": "sine", "centre_deg": 90, "amplitude_deg": 5, "frequency_hz": 1}
TRIANGLE = {"type": "triangle", "centre_deg": 90, "amplitude_deg": 5, "speed_rad_per_s": 6}
SHAPE_CHANGE = {"type": "shape-change"}
OSCILLATION = {"type": "internal-oscillation", "theta_deg": 10}


def actuate(barbs: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    return {"type": "actuate", **({"barbs": barbs} if barbs else {}), **more}


def sequence(*steps: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"type": "sequence", "steps": list(steps), **more}


def checked(data: SceneData, *phases: dict[str, Any], **changes: Any) -> Scene:
    dotted = {key.replace("__", "."): value for key, value in changes.items()}
    return parse_scene(data({"phases": [{"type": "deposit"}, *phases], **dotted}), source="bad.yaml")


def refused(data: SceneData, *phases: dict[str, Any], **changes: Any) -> str:
    with pytest.raises(InputError) as caught:
        checked(data, *phases, **changes)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message.removeprefix("bad.yaml: ")


RANGE = "outside -15° … 105°, the range of the hinges"
FORMS: list[tuple[dict[str, Any], str]] = [
    # -- which motions a phase has
    (actuate(), "phases.1.barbs: missing; give barbs, or both barb_1 and barb_2 ({type: hold} for one that stays)"),
    (
        actuate(barb_2=RAMP),
        "phases.1.barb_1: missing; give barbs, or both barb_1 and barb_2 ({type: hold} for one that stays)",
    ),
    (
        actuate(barb_1=RAMP),
        "phases.1.barb_2: missing; give barbs, or both barb_1 and barb_2 ({type: hold} for one that stays)",
    ),
    (
        actuate(RAMP, barb_1=RAMP),
        "phases.1.barbs: one motion for both barbs, but barb_1 or barb_2 is given as well; leave one or the other out",
    ),
    # -- how long they last
    (
        actuate(SINE),
        "phases.1.duration_s: missing, and the motion has no end of its own; give the phase or the motion one",
    ),
    (
        actuate(barb_1=HOLD, barb_2=RAMP),
        "phases.1.duration_s: missing, and the motion has no end of its own; give the phase or the motion one",
    ),
    (
        actuate(RAMP, duration_s=2),
        "phases.1.barbs: the motion ends after 1 s, before duration_s = 2 s; "
        "shorten the phase or end the motion with a step that holds",
    ),
    (
        actuate(barb_1=RAMP, barb_2={**HOLD, "duration_s": 3}),
        "phases.1.barb_1: the motion ends after 1 s, before duration_s = 3 s; "
        "shorten the phase or end the motion with a step that holds",
    ),
    (
        actuate(SINE, duration_s=0.001),
        "phases.1.duration_s: 0.001 s is shorter than recording.series_interval_s = 0.004 s; "
        "lengthen the phase or sample more often",
    ),
    (
        {**SHAPE_CHANGE, "opening_s": 0.001, "closing_s": 0.002},
        "phases.1: 0.003 s is shorter than recording.series_interval_s = 0.004 s; "
        "lengthen the phase or sample more often",
    ),
    # -- offsets and shares
    (
        actuate(RAMP, offsets="random"),
        "phases.1.offsets: random, but barbs (ramp) has no period; use 'none', a sine, a triangle or a sequence "
        "with repeat",
    ),
    (
        actuate(barb_1=SINE, barb_2=sequence(RAMP, HOLD), duration_s=2, offsets="random"),
        "phases.1.offsets: random, but barb_2 (sequence) has no period; use 'none', a sine, a triangle or a sequence "
        "with repeat",
    ),
    (actuate(HOLD, duration_s=2, offsets="random"), "phases.1.offsets: random, but both barbs hold; use 'none'"),
    (
        actuate(RAMP, offsets="some"),
        "phases.1.offsets: 'some' is not known; use 'none' or 'random'",
    ),
    (
        actuate(RAMP, active_fraction=0.04),
        "phases.1.active_fraction: 0.04 of 10 smarticles is none; use e.g. 0.1",
    ),
    (
        {**OSCILLATION, "active_fraction": 0.04},
        "phases.1.active_fraction: 0.04 of 10 smarticles is none; use e.g. 0.1",
    ),
    (actuate(RAMP, active_fraction=0), "phases.1.active_fraction: 0 is out of range; use more than 0"),
    (
        actuate(RAMP, active_fraction=1.1),
        "phases.1.active_fraction: 1.1 is out of range; use at most 1",
    ),
    # -- range of the hinges
    (actuate({**RAMP, "to_deg": 110}), f"phases.1.barbs.to_deg: 110° is {RANGE}"),
    ({**SHAPE_CHANGE, "straight_deg": -16}, f"phases.1.straight_deg: -16° is {RANGE}"),
    (
        actuate({**SINE, "amplitude_deg": 20}, duration_s=2),
        f"phases.1.barbs.amplitude_deg: 20° makes the barbs reach 110°, {RANGE}; use at most 15° or another centre",
    ),
    (
        actuate(barb_1=HOLD, barb_2=sequence(RAMP, {**TRIANGLE, "centre_deg": 0, "amplitude_deg": 19}), duration_s=2),
        f"phases.1.barb_2.steps.1.amplitude_deg: 19° makes the barbs reach -19°, {RANGE}; "
        "use at most 15° or another centre",
    ),
    (
        actuate({**SINE, "centre_deg": 105}, duration_s=2),
        f"phases.1.barbs.amplitude_deg: 5° makes the barbs reach 110°, {RANGE}; move its centre",
    ),
    (
        {**OSCILLATION, "theta_deg": 40},
        f"phases.1.theta_deg: 40° makes the barbs reach 110°, {RANGE}; use at most 30° or another centre",
    ),
    # -- speed
    (
        actuate({**RAMP, "duration_s": 0.25}),
        "phases.1.barbs.duration_s: 0.25 s makes 6.283 rad/s, faster than motor.speed_limit_rad_per_s = 6 rad/s; "
        "use at least 0.262 s",
    ),
    (
        actuate(sequence(RAMP, sequence(HOLD | {"duration_s": 1}, {"type": "return", "duration_s": 0.1}))),
        "phases.1.barbs.steps.1.steps.1.duration_s: 0.1 s makes 15.71 rad/s, faster than "
        "motor.speed_limit_rad_per_s = 6 rad/s; use at least 0.262 s",
    ),
    (
        actuate({**SINE, "frequency_hz": 15}, duration_s=1),
        "phases.1.barbs.frequency_hz: 15 Hz makes 8.225 rad/s, faster than motor.speed_limit_rad_per_s = 6 rad/s; "
        "use at most 10.9 Hz",
    ),
    (
        actuate({**TRIANGLE, "speed_rad_per_s": 6.1}, duration_s=1),
        "phases.1.barbs.speed_rad_per_s: 6.1 rad/s makes 6.1 rad/s, faster than motor.speed_limit_rad_per_s = 6 rad/s; "
        "use at most 6 rad/s",
    ),
    (
        {**SHAPE_CHANGE, "opening_s": 0.2},
        "phases.1.opening_s: 0.2 s makes 7.854 rad/s, faster than motor.speed_limit_rad_per_s = 6 rad/s; "
        "use at least 0.262 s",
    ),
    (
        {**SHAPE_CHANGE, "closing_s": 0.2, "straight_hold_s": 1},
        "phases.1.closing_s: 0.2 s makes 7.854 rad/s, faster than motor.speed_limit_rad_per_s = 6 rad/s; "
        "use at least 0.262 s",
    ),
    # -- keys and kinds; the key of a value is that of the file, without pydantic's tags
    (
        {**SHAPE_CHANGE, "duration_s": 3},
        "phases.1: unknown key 'duration_s'; known keys: type, straight_deg, opening_s, straight_hold_s, closing_s",
    ),
    (actuate(RAMP, barb1=RAMP), "phases.1: unknown key 'barb1'; did you mean 'barb_1'?"),
    (actuate({**SINE, "amplitude": 3}), "phases.1.barbs: unknown key 'amplitude'; did you mean 'amplitude_deg'?"),
    (
        actuate(sequence(RAMP, {"type": "ramp", "to_deg": 3})),
        "phases.1.barbs.steps.1.duration_s: missing; it has no default",
    ),
    (
        actuate(barb_1=HOLD, barb_2={**RAMP, "to_deg": None}),
        "phases.1.barb_2.to_deg: null is not a number; give one in deg",
    ),
    (
        actuate({"type": "jump"}),
        "phases.1.barbs.type: 'jump' is not known; known: 'hold', 'ramp', 'return', 'sine', 'triangle', 'sequence'",
    ),
    (
        actuate(sequence(HOLD, RAMP)),
        "phases.1.barbs.steps.0: hold has no end; give it a duration_s, as each step but the last needs one",
    ),
    ({"type": "internal-oscillation"}, "phases.1.theta_deg: missing; it has no default"),
    ({**OSCILLATION, "theta_deg": 0}, "phases.1.theta_deg: 0 deg is out of range; use more than 0 deg"),
]


@pytest.mark.parametrize(("phase", "expected"), FORMS, ids=[message[:60] for _, message in FORMS])
def test_bad_phase(scene_data: SceneData, phase: dict[str, Any], expected: str) -> None:
    message = refused(scene_data, phase)
    assert message.startswith(expected) if expected.endswith(", ") else message == expected


MOTORS: list[tuple[dict[str, Any], str]] = [
    ({"motor__torque_limit_N_m": 0}, "motor.torque_limit_N_m: 0 N m is out of range; use more than 0 N m"),
    ({"motor__torque_limit_N_m": -1e-5}, "motor.torque_limit_N_m: -1e-05 N m is out of range; use more than 0 N m"),
    (
        {"motor__speed_limit_rad_per_s": 0},
        "motor.speed_limit_rad_per_s: 0 rad/s is out of range; use more than 0 rad/s",
    ),
    (
        {"motor__stiffness_N_m_per_rad": -1},
        "motor.stiffness_N_m_per_rad: -1 N m/rad is out of range; use more than 0 N m/rad",
    ),
    ({"motor__law": "brake"}, "motor.law: 'brake' is not known; use 'halt', 'stall', 'slip' or 'servo'"),
    ({"motor__torque_limit": 1}, "motor: unknown key 'torque_limit'; did you mean 'torque_limit_N_m'?"),
    (
        {"motor__torque_limit_N_m": "1e-5"},
        "motor.torque_limit_N_m: got the text '1e-5', expected a number; leave out the quotes and the unit",
    ),
    (
        {"fidelity": {"hinge_stiffness_N_per_m": 0}},
        "fidelity.hinge_stiffness_N_per_m: 0 N/m is out of range; use more than 0 N/m",
    ),
    ({"fidelity": {"control_interval_s": 0}}, "fidelity.control_interval_s: 0 s is out of range; use more than 0 s"),
    (
        {"fidelity": {"control_interval_s": 0.005}},
        "fidelity.control_interval_s: 0.005 s is longer than recording.series_interval_s = 0.004 s; use e.g. 0.004 s",
    ),
    (
        {"fidelity": {"control_interval_s": 3e-4}},
        "fidelity.control_interval_s: 0.0003 s is not a whole fraction of recording.series_interval_s = 0.004 s; "
        "use e.g. 0.00025 s",
    ),
    (
        {"smarticle__aspect_ratio": 0},
        "smarticle.aspect_ratio: 0 means no barbs, which phases.1 (shape-change) is to move; "
        "use a larger aspect_ratio or leave the phase out",
    ),
    (
        {"smarticle__aspect_ratio": 0.05, "fidelity": {"diameter_m": 1.2e-3}},
        "smarticle.aspect_ratio: 0.05 means barbs of 0.000585 m, too short for a sphere of their own of 0.0012 m "
        "beside the hinge's, which phases.1 (shape-change) needs; use at least 0.155 or a smaller fidelity.diameter_m",
    ),
    (
        # It has a sphere, but one that lies inside the hinge's.
        {"smarticle__aspect_ratio": 0.15, "fidelity": {"diameter_m": 1.2e-3}},
        "smarticle.aspect_ratio: 0.15 means barbs of 0.001755 m, too short for a sphere of their own of 0.0012 m "
        "beside the hinge's, which phases.1 (shape-change) needs; use at least 0.155 or a smaller fidelity.diameter_m",
    ),
]


@pytest.mark.parametrize(("changes", "expected"), MOTORS, ids=[message[:60] for _, message in MOTORS])
def test_bad_motor_fidelity_or_smarticle(scene_data: SceneData, changes: dict[str, Any], expected: str) -> None:
    assert refused(scene_data, SHAPE_CHANGE, **changes) == expected


def test_the_ways_out_lead_out(scene_data: SceneData) -> None:
    checked(scene_data, {**SHAPE_CHANGE, "opening_s": 0.262})
    checked(scene_data, {**OSCILLATION, "theta_deg": 30})
    checked(scene_data, actuate({**SINE, "frequency_hz": 10.9}, duration_s=1))
    checked(scene_data, actuate({**SINE, "amplitude_deg": 15}, duration_s=2))
    checked(scene_data, actuate(RAMP, active_fraction=0.1))
    checked(scene_data, SHAPE_CHANGE, fidelity={"diameter_m": 1.2e-3}, smarticle__aspect_ratio=0.155)
    checked(scene_data, SHAPE_CHANGE, fidelity={"control_interval_s": 0.00025})


def test_scaled_swing_names_what_is_possible_for_its_barbs(scene_data: SceneData) -> None:
    # θ = 20° at l/w = 0.4 is a swing of 17.5° to either side; 15° to either side is θ = 120/7°.
    phase = {**OSCILLATION, "theta_deg": 20}
    assert refused(scene_data, phase, smarticle__aspect_ratio=0.4) == (
        f"phases.1.theta_deg: 20° makes the barbs reach 107.5°, {RANGE}; use at most 17.1° or another centre"
    )
    checked(scene_data, {**phase, "theta_deg": 17.1}, smarticle__aspect_ratio=0.4)
    checked(scene_data, {**phase, "scaled": False}, smarticle__aspect_ratio=0.4)


def test_speed_depends_on_where_the_phase_before_ended(scene_data: SceneData) -> None:
    there = actuate({**RAMP, "duration_s": 0.5})
    back = actuate({"type": "ramp", "to_deg": 90, "duration_s": 0.2})
    checked(scene_data, back)  # stays at 90°
    assert refused(scene_data, there, {"type": "relax"}, back).startswith(
        "phases.3.barbs.duration_s: 0.2 s makes 7.854 rad/s, faster than motor.speed_limit_rad_per_s = 6 rad/s"
    )
    # One smarticle that moved before is enough.
    some = {**there, "active_fraction": 0.1}
    assert refused(scene_data, some, back).startswith("phases.2.barbs.duration_s: 0.2 s makes 7.854 rad/s")


def test_a_swing_that_is_cut_before_it_leaves_the_range(scene_data: SceneData) -> None:
    # Down first: a half cycle of 0.5 s would have to pass before the swing goes above its centre.
    phase = actuate({**SINE, "amplitude_deg": 20, "cycles_offset": 0.5}, duration_s=0.5)
    checked(scene_data, phase)
    assert "makes the barbs reach 110°" in refused(scene_data, {**phase, "duration_s": 0.8})
    # With random offsets any part of the period may come first.
    assert "makes the barbs reach 110°" in refused(scene_data, {**phase, "offsets": "random"})


def test_crossing_barbs(scene_data: SceneData) -> None:
    inward = actuate({"type": "ramp", "to_deg": 105, "duration_s": 1})
    message = (
        "phases.1: at 105° and 105° the barbs of l/w = 2 cross; use angles nearer to 90° or a smaller aspect_ratio"
    )
    assert refused(scene_data, inward, smarticle__aspect_ratio=2, container__radius_m=0.05) == message
    checked(scene_data, inward, smarticle__aspect_ratio=1.8, container__radius_m=0.05)
    # One barb at a time is no way around: a motor that halts may be late.
    once = [{"type": "ramp", "to_deg": 105, "duration_s": 1}, {"type": "return", "duration_s": 1}]
    rest = {"type": "hold", "duration_s": 2}
    turns = actuate(barb_1=sequence(*once, rest), barb_2=sequence(rest, *once))
    assert refused(scene_data, turns, smarticle__aspect_ratio=2, container__radius_m=0.05) == message


NARROW = {"rows": 1, "diameter_m": 1.17e-3}  # ten diameters along the middle link


def inward_to(angle: float) -> dict[str, Any]:
    return actuate({"type": "ramp", "to_deg": angle, "duration_s": 1})


def test_first_sphere_of_a_barb_against_the_middle_link(scene_data: SceneData) -> None:
    # At 105° the sphere at 1.01 d is 0.985 d from one 0.4 d along the middle link.
    assert math.sqrt(1.01**2 + 0.4**2 - 2 * 1.01 * 0.4 * math.sin(math.radians(15))) == pytest.approx(0.9854, abs=1e-4)
    fidelity = {**NARROW, "pitch": 0.4}
    # (1.01² + 0.4² - 1) / (2 · 1.01 · 0.4) = 0.22290 = -cos 102.88°
    assert refused(scene_data, inward_to(105), fidelity=fidelity) == (
        "fidelity.pitch: with 0.4 the middle link's spheres are 0.4 diameters apart, and the first sphere of a barb "
        "touches them at the 105° of phases.1; stay below 102° or use a pitch of at least 0.51"
    )
    checked(scene_data, inward_to(102.87), fidelity=fidelity)
    refused(scene_data, inward_to(102.89), fidelity=fidelity)
    checked(scene_data, inward_to(105), fidelity={**NARROW, "pitch": 0.51})
    checked(scene_data, SHAPE_CHANGE, fidelity=fidelity)  # never above 90°
    # With spheres 0.05 d apart it is the third, not the first, that is in the way:
    # (1.01² + 0.15² - 1) / (2 · 1.01 · 0.15) = 0.14059 = -cos 98.08°
    finest = {**NARROW, "pitch": 0.05}
    assert "stay below 98°" in refused(scene_data, inward_to(99), fidelity=finest)
    checked(scene_data, inward_to(98), fidelity=finest)


@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.parametrize("pitch", [0.1, 0.25, 0.4])
@pytest.mark.parametrize("width", [0.0117, 0.0083, 0.0061])
def test_pitch_that_is_named_is_wide_enough(scene_data: SceneData, width: float, pitch: float, rows: int) -> None:
    changes = {"smarticle__middle_length_m": width, "smarticle__aspect_ratio": 1}
    message = refused(scene_data, inward_to(105), fidelity={"rows": rows, "pitch": pitch}, **changes)
    named = float(message.rpartition("at least ")[2])
    checked(scene_data, inward_to(105), fidelity={"rows": rows, "pitch": named}, **changes)


def test_first_sphere_where_the_barbs_begin(scene_data: SceneData) -> None:
    # The motion itself never asks for 105°, but smarticles start there, and some stay there.
    phase = actuate({**SINE, "centre_deg": 60}, duration_s=1, active_fraction=0.5)
    message = refused(scene_data, phase, fidelity={**NARROW, "pitch": 0.4}, smarticle__angles_deg=[105, 90])
    assert "touches them at the 105° of phases.1" in message


def test_scene_without_actuated_phases_is_not_asked(scene_data: SceneData, monkeypatch: pytest.MonkeyPatch) -> None:
    relax = {"type": "relax", "duration_s": 1}
    bare = {"fidelity": {"control_interval_s": 3e-4, "pitch": 0.4}, "smarticle__aspect_ratio": 0}
    checked(scene_data, relax, **bare)
    refused(scene_data, SHAPE_CHANGE, **bare)
    # Not even a particle is made for it.
    monkeypatch.setattr(dem.scene.scene.Scene, "particle", property(lambda self: 1 / 0))
    monkeypatch.setattr(dem.scene.scene.Scene, "_check_container", lambda self: None)
    checked(scene_data, relax)
    with pytest.raises(ZeroDivisionError):
        checked(scene_data, SHAPE_CHANGE)


# -- what is not refused, but said ---------------------------------------------------------------------------------


def test_motors_that_one_look_takes_far_beyond_their_limit_are_warned_of(scene_data: SceneData) -> None:
    quick = {"motor__speed_limit_rad_per_s": 60}
    scene = checked(scene_data, SHAPE_CHANGE, **quick)
    # k ω Δt = 3e-3 · 60 · 2e-4 N m over the paper's 1.607e-5 N m.
    assert overshoot(scene) == pytest.approx(3e-3 * 60 * 2e-4 / 1.607e-5, rel=1e-3)
    (warning,) = actuation_warnings(scene)
    assert warning == (
        "motor.torque_limit_N_m: τ_max = 1.61e-05 N m, but within one look of fidelity.control_interval_s = 0.0002 s "
        "at motor.speed_limit_rad_per_s = 60 rad/s a motor can go beyond it by 2.24 τ_max; use control_interval_s: "
        "4e-05 or stiffness_N_m_per_rad: 0.000669, or law: slip"
    )
    planned = plan(scene)
    assert planned.warnings == (warning,)
    assert f"warning: {warning}" in planned.to_text()
    # Each way out leads out, and not much farther than it must.
    for way_out in (
        {"fidelity": {"control_interval_s": 4e-05}},
        {"motor__stiffness_N_m_per_rad": 0.000669},
        {"motor__law": "slip"},
    ):
        assert actuation_warnings(checked(scene_data, SHAPE_CHANGE, **quick, **way_out)) == ()
    for not_enough in ({"fidelity": {"control_interval_s": 0.004 / 89}}, {"motor__stiffness_N_m_per_rad": 0.00068}):
        assert actuation_warnings(checked(scene_data, SHAPE_CHANGE, **quick, **not_enough))


def test_default_motors_and_scenes_without_motors_are_not_warned_of(scene_data: SceneData) -> None:
    scene = checked(scene_data, SHAPE_CHANGE)
    assert overshoot(scene) == pytest.approx(0.224, rel=1e-2)
    assert actuation_warnings(scene) == ()
    assert actuation_warnings(checked(scene_data, {"type": "relax"}, motor__speed_limit_rad_per_s=60)) == ()
