"""A motion that a smarticle cannot do is rejected with one line: what, where, the value with its unit, the way out."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from dem.errors import InputError
from dem.phases.actuated import actuation_warnings, overshoot
from dem.plan.outlook import plan
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

SceneData = Callable[..., dict[str, Any]]

RAMP = {"type": "ramp", "to_deg": 0, "duration_s": 1}
SINE = {"type": "sine", "centre_deg": 90, "amplitude_deg": 5, "frequency_hz": 1}
SHAPE_CHANGE = {"type": "shape-change"}
OSCILLATION = {"type": "internal-oscillation", "theta_deg": 10}


def actuate(barbs: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    return {"type": "actuate", **({"barbs": barbs} if barbs else {}), **more}


def sequence(*steps: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"type": "sequence", "steps": list(steps), **more}


def checked(data: SceneData, *phases: dict[str, Any], **changes: Any) -> Scene:
    dotted = {key.replace("__", "."): value for key, value in changes.items()}
    return parse_scene(data({"phases": [{"type": "deposit"}, *phases], **dotted}), source="bad.yaml")


def rejected(data: SceneData, *phases: dict[str, Any], **changes: Any) -> str:
    with pytest.raises(InputError) as caught:
        checked(data, *phases, **changes)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message.removeprefix("bad.yaml: ")


def test_the_ways_out_lead_out(scene_data: SceneData) -> None:
    checked(scene_data, {**SHAPE_CHANGE, "opening_s": 0.262})
    checked(scene_data, {**OSCILLATION, "theta_deg": 30})
    checked(scene_data, actuate({**SINE, "frequency_hz": 10.9}, duration_s=1))
    checked(scene_data, actuate({**SINE, "amplitude_deg": 15}, duration_s=2))
    checked(scene_data, actuate(RAMP, active_fraction=0.1))
    checked(scene_data, SHAPE_CHANGE, fidelity={"diameter_m": 1.2e-3}, smarticle__aspect_ratio=0.155)
    checked(scene_data, SHAPE_CHANGE, fidelity={"control_interval_s": 0.00025})


def test_speed_depends_on_where_the_phase_before_ended(scene_data: SceneData) -> None:
    there = actuate({**RAMP, "duration_s": 0.5})
    back = actuate({"type": "ramp", "to_deg": 90, "duration_s": 0.2})
    checked(scene_data, back)  # stays at 90°
    assert rejected(scene_data, there, {"type": "relax"}, back).startswith(
        "phases.3.barbs.duration_s: 0.2 s makes 7.854 rad/s, faster than motor.speed_limit_rad_per_s = 6 rad/s"
    )
    # One smarticle that moved before is enough.
    some = {**there, "active_fraction": 0.1}
    assert rejected(scene_data, some, back).startswith("phases.2.barbs.duration_s: 0.2 s makes 7.854 rad/s")


def test_crossing_barbs(scene_data: SceneData) -> None:
    inward = actuate({"type": "ramp", "to_deg": 105, "duration_s": 1})
    message = (
        "phases.1: at 105° and 105° the barbs of l/w = 2 cross; use angles nearer to 90° or a smaller aspect_ratio"
    )
    assert rejected(scene_data, inward, smarticle__aspect_ratio=2, container__radius_m=0.05) == message
    checked(scene_data, inward, smarticle__aspect_ratio=1.8, container__radius_m=0.05)
    # One barb at a time is no way around: a motor that halts may be late.
    once = [{"type": "ramp", "to_deg": 105, "duration_s": 1}, {"type": "return", "duration_s": 1}]
    rest = {"type": "hold", "duration_s": 2}
    turns = actuate(barb_1=sequence(*once, rest), barb_2=sequence(rest, *once))
    assert rejected(scene_data, turns, smarticle__aspect_ratio=2, container__radius_m=0.05) == message


@pytest.mark.parametrize(
    ("barbs", "key", "unresolved"),
    [
        ({**SINE, "amplitude_deg": 1e-3, "frequency_hz": 500}, "frequency_hz", "a sine of 0.002 s has 10"),
        (
            {"type": "triangle", "centre_deg": 90, "amplitude_deg": 0.1, "speed_rad_per_s": 5.8},
            "speed_rad_per_s",
            "a triangle of 0.0012 s has 6.02",
        ),
        (sequence({"type": "ramp", "to_deg": 89.9, "duration_s": 1e-3}, {"type": "hold"}), "steps.0.duration_s",
         "a ramp of 0.001 s has 5"),
    ],
)  # fmt: skip
def test_motions_that_control_updates_do_not_resolve(
    scene_data: SceneData, barbs: dict[str, Any], key: str, unresolved: str
) -> None:
    phase = actuate(barbs, duration_s=0.1)
    error = rejected(scene_data, phase)
    assert error.startswith(f"phases.1.barbs.{key}: {unresolved} control updates, 20 resolve it; use a slower one, or")
    offered = error.removesuffix(" s").rpartition(" ")[2]
    checked(scene_data, phase, fidelity={"control_interval_s": float(offered)})


def test_a_swing_of_a_tiny_angle_is_too_fast_for_control_updates(scene_data: SceneData) -> None:
    assert rejected(scene_data, {**OSCILLATION, "theta_deg": 0.1}).startswith("phases.1.theta_deg: a triangle of")


NARROW = {"rows": 1, "diameter_m": 1.17e-3}  # ten diameters along the middle link


def inward_to(angle: float) -> dict[str, Any]:
    return actuate({"type": "ramp", "to_deg": angle, "duration_s": 1})


def test_first_sphere_of_a_barb_against_the_middle_link(scene_data: SceneData) -> None:
    # At 105° the sphere at 1.01 d is 0.985 d from one 0.4 d along the middle link.
    assert math.sqrt(1.01**2 + 0.4**2 - 2 * 1.01 * 0.4 * math.sin(math.radians(15))) == pytest.approx(0.9854, abs=1e-4)
    fidelity = {**NARROW, "pitch": 0.4}
    # (1.01² + 0.4² - 1) / (2 · 1.01 · 0.4) = 0.22290 = -cos 102.88°
    assert rejected(scene_data, inward_to(105), fidelity=fidelity) == (
        "fidelity.pitch: with 0.4 the middle link's spheres are 0.4 diameters apart, and the first sphere of a barb "
        "touches them at the 105° of phases.1; stay below 102° or use a pitch of at least 0.51"
    )
    checked(scene_data, inward_to(102.87), fidelity=fidelity)
    rejected(scene_data, inward_to(102.89), fidelity=fidelity)
    checked(scene_data, inward_to(105), fidelity={**NARROW, "pitch": 0.51})
    checked(scene_data, SHAPE_CHANGE, fidelity=fidelity)  # never above 90°
    # With spheres 0.05 d apart it is the third, not the first, that is in the way:
    # (1.01² + 0.15² - 1) / (2 · 1.01 · 0.15) = 0.14059 = -cos 98.08°
    finest = {**NARROW, "pitch": 0.05}
    assert "stay below 98°" in rejected(scene_data, inward_to(99), fidelity=finest)
    checked(scene_data, inward_to(98), fidelity=finest)


# -- what is accepted with a warning ---------------------------------------------------------------------------------


def test_motors_that_exceed_their_limit_in_one_control_update_are_warned_of(scene_data: SceneData) -> None:
    quick = {"motor__speed_limit_rad_per_s": 60}
    scene = checked(scene_data, SHAPE_CHANGE, **quick)
    # k ω Δt = 3e-3 · 60 · 2e-4 N m over the paper's 1.607e-5 N m.
    assert overshoot(scene) == pytest.approx(3e-3 * 60 * 2e-4 / 1.607e-5, rel=1e-3)
    (warning,) = actuation_warnings(scene)
    assert warning.startswith("motor.torque_limit_N_m: τ_max = 1.61e-05 N m, but within one control update of ")
    assert warning.endswith("use control_interval_s: 4e-05 or stiffness_N_m_per_rad: 0.000669, or law: slip")
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
