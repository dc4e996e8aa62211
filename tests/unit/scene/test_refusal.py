"""Messages of our own for what pydantic refuses: key, value with its unit, way out, in one line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from dem.errors import InputError
from dem.scene.reading import parse_scene
from dem.scene.refusal import unit_of

SceneData = Callable[..., dict[str, Any]]

DEPOSIT = {"type": "deposit"}
TIER = {"radius_m": 0.02, "height_m": 0.05}
BOUNCING = {"type": "actuate", "barbs": {"type": "sequence", "steps": 3}, "duration_s": 1}

BAD: list[tuple[dict[str, Any], str]] = [
    ({"container": {"tiers": []}}, "container.tiers: an empty list; give at least 1 item"),
    ({"container": {"tiers": "two"}}, "container.tiers: 'two' is not a list; write its items in brackets, [ … ]"),
    ({"container": {"tiers": [1]}}, "container.tiers.0: 1 is not keys and values; write them as {key: value}"),
    # Not the radius that would follow from it.
    (
        {"container": {"tiers": [{**TIER, "radius_m": "x"}]}},
        "container.tiers.0.radius_m: got the text 'x', expected a number; leave out the quotes and the unit",
    ),
    (
        {"container": {"tiers": [TIER, {**TIER, "height_m": -1}]}},
        "container.tiers.1.height_m: -1 m is out of range; use more than 0 m",
    ),
    ({"phases": []}, "phases: an empty list; give at least 1 item"),
    ({"phases": None}, "phases: null is not a list; write its items in brackets, [ … ]"),
    ({"phases.1": 3}, "phases.1: 3 is not keys and values; write them as {type: …}"),
    (
        {"phases.1": {"type": "relax", "duration_s": "1 s"}},
        "phases.1.duration_s: got the text '1 s', expected a number; leave out the quotes and the unit",
    ),
    ({"phases.2.frequency_hz": 3000}, "phases.2.frequency_hz: 3000 Hz is out of range; use at most 2000 Hz"),
    ({"phases.0.layer_height_w": 11}, "phases.0.layer_height_w: 11 w is out of range; use at most 10 w"),
    ({"phases.0.settle": 3}, "phases.0.settle: 3 is not keys and values; write them as {key: value}"),
    ({"phases.0.per_layer": 2.5}, "phases.0.per_layer: 2.5 is not a whole number; use e.g. 2"),
    ({"phases.1": BOUNCING}, "phases.1.barbs.steps: 3 is not a list; write its items in brackets, [ … ]"),
    (
        {"smarticle.angles_deg": [90, 90, 90]},
        "smarticle.angles_deg: [90, 90, 90] has 3 items; give at most 2 items",
    ),
    ({"smarticle.aspect_ratio": [0.7]}, "smarticle.aspect_ratio: [0.7] is not a number; give one"),
    ({"container.radius_m": [0.02]}, "container.radius_m: [0.02] is not a number; give one in m"),
    ({"name": 5}, "name: 5 is not text; write it in quotes"),
    ({"name": ""}, "name: '' is too short; use 1 or more characters"),
    ({"count": 1e300}, "count: 1e+300 is out of range; use a smaller one"),
    ({"recording": {"energy": "yes"}}, "recording.energy: 'yes' is neither true nor false; use one of them"),
    ({"recording": [1]}, "recording: [1] is not keys and values; write them as {key: value}"),
    ({"schema_version": True}, "schema_version: got the boolean true, expected 1"),
    ({"hooks": {"side_m": None}}, "hooks.side_m: null is not a number; give one in m"),
    (
        {"motor": {"law": "servo", "damping_N_m_s_per_rad": -1}},
        "motor.damping_N_m_s_per_rad: -1 N m s/rad is out of range; use at least 0 N m s/rad",
    ),
    (
        {"hooks": {}, "phases": [DEPOSIT, {"type": "pull-hook", "speed_m_per_s": None}]},
        "phases.1.speed_m_per_s: null is not a number; give one in m/s",
    ),
    (
        {"phases": [DEPOSIT, {"type": "remove-container", "parts": None}]},
        "phases.1.parts: null is not known; use 'wall'",
    ),
    (
        {"phases": [{"type": "arrange", "gap_m": -1}]},
        "phases.0.gap_m: -1 m is out of range; use more than 0 m",
    ),
    (
        {"phases.1": {"type": "internal-oscillation", "theta_deg": -3, "duration_s": 1}},
        "phases.1.theta_deg: -3 deg is out of range; use more than 0 deg",
    ),
]


@pytest.mark.parametrize(("changes", "expected"), BAD, ids=[expected[:60] for _, expected in BAD])
def test_one_line_with_key_value_unit_and_way_out(
    scene_data: SceneData, changes: dict[str, Any], expected: str
) -> None:
    with pytest.raises(InputError) as caught:
        parse_scene(scene_data(changes), source="bad.yaml")
    assert str(caught.value) == f"bad.yaml: {expected}"


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("phases.2.speed_m_per_s", "m/s"),
        ("gravity_m_per_s2", "m/s²"),
        ("smarticle.density_kg_per_m3", "kg/m³"),
        ("motor.stiffness_N_m_per_rad", "N m/rad"),
        ("phases.0.per_layer", ""),
        ("seed", ""),
        ("s", ""),
    ],
)
def test_unit_that_a_key_spells(key: str, unit: str) -> None:
    assert unit_of(key) == unit
