"""Scenes with hooks, a wall that is removed, or a mould of tiers: what they say by default, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import small

from dem.errors import InputError
from dem.phases.pull_hook import PullHook
from dem.phases.remove_container import RemoveContainer
from dem.plan.outlook import plan
from dem.scene.reading import dump_scene, json_schema, load_scene, parse_scene, scene_hash
from dem.setting.hooks import Cross

SceneData = Callable[..., dict[str, Any]]
W, T2 = 0.0117, 0.5e-3
DEPOSIT = {"type": "deposit"}
PULL = {"type": "pull-hook"}
REMOVE = {"type": "remove-container"}
RELAX = {"type": "relax", "duration_s": 0.1}
SHAKE = {"type": "shake", "duration_s": 0.1}
TIERS = [{"radius_m": 0.0234, "height_m": 0.012}, {"radius_m": 0.018, "height_m": 0.012}]


def test_hooks_follow_from_the_smarticle_by_default() -> None:
    scene = small({"hooks": {}, "phases": [DEPOSIT, PULL]})
    assert scene.hooks is not None
    lower, upper = scene.hooks.crosses
    assert lower == Cross(height=10 * T2, side=T2, length=W)
    assert upper == replace(lower, height=20 * T2)
    pull = scene.phases[1]
    assert isinstance(pull, PullHook)
    assert (pull.which, pull.distance_m, pull.speed_m_per_s, pull.duration_s) == ("upper", 2 * W, W, 2.0)
    other = small({"smarticle.middle_length_m": 0.02, "hooks": {"side_m": 1e-3}, "phases": [DEPOSIT, PULL]})
    assert other.hooks is not None
    assert (other.hooks.side_m, other.hooks.length_m, other.hooks.upper_height_m) == (1e-3, 0.02, 20 * T2)
    assert other.phases[1].model_dump()["distance_m"] == 0.04


def test_duration_follows_from_distance_and_speed() -> None:
    pull = {**PULL, "distance_m": 0.01, "speed_m_per_s": 0.02}
    scene = small({"hooks": {}, "phases": [DEPOSIT, pull, {**pull, "duration_s": 3}]})
    assert [phase.model_dump().get("duration_s") for phase in scene.phases] == [None, 0.5, 3.0]


def test_a_plain_scene_has_none_of_it() -> None:
    scene = small()
    assert scene.hooks is None
    assert scene.container.tiers is None
    assert scene.cylinder.upper == ()
    effects = {effect.name: effect for effect in plan(scene).effects}
    assert (effects["hooks"].on, effects["hooks"].why) == (False, "no key hooks")
    assert (effects["wall removal"].on, effects["wall removal"].why) == (False, "no phase of type remove-container")


def test_plan_says_why_hooks_and_removal_are_on() -> None:
    scene = small({"hooks": {}, "phases": [DEPOSIT, PULL, {**REMOVE, "speed_m_per_s": 0.05}]})
    planned = plan(scene)
    effects = {effect.name: effect for effect in planned.effects}
    assert effects["hooks"].on
    assert effects["hooks"].why == (
        "crosses at 5 and 10 mm, bars of 0.5 mm; phase 1 raises the upper one by 23.4 mm at 11.7 mm/s"
    )
    assert effects["wall removal"].on
    assert effects["wall removal"].why == "phase 2: lifted at 50 mm/s"
    assert "2 remove-container" in planned.to_text()
    assert [phase.duration_s for phase in planned.phases] == [None, 2.0, 1.0]


def test_plan_tells_a_shaken_floor_from_a_shaken_container() -> None:
    effects = {e.name: e for e in plan(small({"phases": [DEPOSIT, SHAKE, REMOVE, SHAKE]})).effects}
    assert effects["container motion"].why == (
        "phase 1: Γ = 2, f = 30 Hz, A = 0.552 mm, phase 3: Γ = 2, f = 30 Hz, A = 0.552 mm, the floor alone"
    )


def test_resolved_scene_reads_back_the_same(tmp_path: Any) -> None:
    phases = [DEPOSIT, PULL, REMOVE]
    for changes in ({"hooks": {}, "phases": phases}, {"container": {"tiers": TIERS}}):
        scene = small(changes)
        path = tmp_path / "scene.yaml"
        path.write_text(dump_scene(scene))
        again = load_scene(path)
        assert again == scene
        assert scene_hash(again) == scene_hash(scene)


def test_tiers_give_the_widest_radius_and_the_whole_height() -> None:
    scene = small({"container": {"tiers": [*TIERS, {"radius_m": 0.018, "height_m": 0.1}]}})
    assert (scene.container.radius_m, scene.container.height_m) == (0.0234, pytest.approx(0.124))
    # Two tiers of one radius are one wall: no ceiling of no width between them.
    assert scene.cylinder.upper == ((0.012, 0.018),)
    assert scene.cylinder.radii(np.array([0.0, 0.012, 0.0121, 1.0])).tolist() == [0.0234, 0.0234, 0.018, 0.018]


def test_schema_asks_for_nothing_that_has_a_default() -> None:
    schema = json.loads(json.dumps(json_schema()))
    phases = schema["properties"]["phases"]["items"]["discriminator"]["mapping"]
    assert {"remove-container", "pull-hook"} <= set(phases)
    assert "required" not in schema["$defs"]["Hooks"]
    assert schema["$defs"]["PullHook"]["required"] == ["type"]
    assert schema["$defs"]["RemoveContainer"]["required"] == ["type"]
    for part in ("Hooks", "PullHook", "RemoveContainer", "Tier"):
        for name, described in schema["$defs"][part]["properties"].items():
            assert name == "type" or described["description"]


def test_an_error_in_the_smarticle_is_one_error(scene_data: SceneData) -> None:
    data = scene_data({"smarticle.middle_length_m": -1, "hooks": {}, "phases": [DEPOSIT, PULL]})
    with pytest.raises(InputError) as caught:
        parse_scene(data, source="bad.yaml")
    assert str(caught.value) == "bad.yaml: smarticle.middle_length_m: -1 m is out of range; use at least 1e-06 m"


def test_a_hook_may_be_pulled_out_over_the_wall() -> None:
    small({"hooks": {}, "container.height_m": 0.03, "phases": [DEPOSIT, {**PULL, "distance_m": 0.5}]})


def test_the_wall_is_high_enough_for_the_hooks() -> None:
    assert small({"hooks": {"upper_height_m": 0.3}}).cylinder.height > 0.3 + W
    # A pile that stands higher than the hooks needs no more than without them.
    many = {"count": 300}
    assert small({"hooks": {}, **many}).cylinder.height == small(many).cylinder.height


def test_removal_has_defaults() -> None:
    removal = small({"phases": [DEPOSIT, REMOVE]}).phases[1]
    assert isinstance(removal, RemoveContainer)
    assert (removal.parts, removal.speed_m_per_s, removal.duration_s) == ("wall", None, 1.0)


def test_a_layer_that_fits_by_either_way_out_is_let_pass() -> None:
    small({"container.height_m": 0.02193})
    small({"container.height_m": 0.02, "phases.0.layer_height_w": 0.8})


def test_a_high_hook_that_nobody_pulls_is_let_pass() -> None:
    small({"hooks": {"upper_height_m": 0.3}})
    small({"hooks": {"upper_height_m": 0.1}, "phases": [DEPOSIT, RELAX, PULL]})
