"""Scenes with hooks, a wall that is removed, or a mould of tiers: what they say by default, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dem.body.particle import Boxes, Particle, SphereChain
from dem.body.placement import place_layer
from dem.body.state import State
from dem.errors import InputError, RunError
from dem.phases.pull_hook import PullHook
from dem.phases.remove_container import RemoveContainer
from dem.plan.outlook import plan
from dem.run.watchdog import Watchdog
from dem.scene.reading import dump_scene, json_schema, load_scene, parse_scene, scene_hash
from dem.scene.scene import Scene
from dem.setting.container import Cylinder
from dem.setting.hooks import Cross

MakeScene = Callable[..., Scene]
SceneData = Callable[..., dict[str, Any]]
W, T2 = 0.0117, 0.5e-3
DEPOSIT = {"type": "deposit"}
PULL = {"type": "pull-hook"}
REMOVE = {"type": "remove-container"}
RELAX = {"type": "relax", "duration_s": 0.1}
SHAKE = {"type": "shake", "duration_s": 0.1}
TIERS = [{"radius_m": 0.0234, "height_m": 0.012}, {"radius_m": 0.018, "height_m": 0.012}]


def test_hooks_follow_from_the_smarticle_by_default(make_scene: MakeScene) -> None:
    scene = make_scene({"hooks": {}, "phases": [DEPOSIT, PULL]})
    assert scene.hooks is not None
    lower, upper = scene.hooks.crosses
    assert lower == Cross(height=10 * T2, side=T2, length=W)
    assert upper == replace(lower, height=20 * T2)
    pull = scene.phases[1]
    assert isinstance(pull, PullHook)
    assert (pull.which, pull.distance_m, pull.speed_m_per_s, pull.duration_s) == ("upper", 2 * W, W, 2.0)
    other = make_scene({"smarticle.middle_length_m": 0.02, "hooks": {"side_m": 1e-3}, "phases": [DEPOSIT, PULL]})
    assert other.hooks is not None
    assert (other.hooks.side_m, other.hooks.length_m, other.hooks.upper_height_m) == (1e-3, 0.02, 20 * T2)
    assert other.phases[1].model_dump()["distance_m"] == 0.04


def test_duration_follows_from_distance_and_speed(make_scene: MakeScene) -> None:
    pull = {**PULL, "distance_m": 0.01, "speed_m_per_s": 0.02}
    scene = make_scene({"hooks": {}, "phases": [DEPOSIT, pull, {**pull, "duration_s": 3}]})
    assert [phase.model_dump().get("duration_s") for phase in scene.phases] == [None, 0.5, 3.0]


def test_a_plain_scene_has_none_of_it(make_scene: MakeScene) -> None:
    scene = make_scene()
    assert scene.hooks is None
    assert scene.container.tiers is None
    assert scene.cylinder.upper == ()
    effects = {effect.name: effect for effect in plan(scene).effects}
    assert (effects["hooks"].on, effects["hooks"].why) == (False, "no key hooks")
    assert (effects["wall removal"].on, effects["wall removal"].why) == (False, "no phase of type remove-container")


def test_plan_says_why_hooks_and_removal_are_on(make_scene: MakeScene) -> None:
    scene = make_scene({"hooks": {}, "phases": [DEPOSIT, PULL, {**REMOVE, "speed_m_per_s": 0.05}]})
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


def test_plan_tells_a_shaken_floor_from_a_shaken_container(make_scene: MakeScene) -> None:
    effects = {e.name: e for e in plan(make_scene({"phases": [DEPOSIT, SHAKE, REMOVE, SHAKE]})).effects}
    assert effects["container motion"].why == (
        "phase 1: Γ = 2, f = 30 Hz, A = 0.552 mm, phase 3: Γ = 2, f = 30 Hz, A = 0.552 mm, the floor alone"
    )


def test_resolved_scene_reads_back_the_same(make_scene: MakeScene, tmp_path: Any) -> None:
    phases = [DEPOSIT, PULL, REMOVE]
    for changes in ({"hooks": {}, "phases": phases}, {"container": {"tiers": TIERS}}):
        scene = make_scene(changes)
        path = tmp_path / "scene.yaml"
        path.write_text(dump_scene(scene))
        again = load_scene(path)
        assert again == scene
        assert scene_hash(again) == scene_hash(scene)


def test_tiers_give_the_widest_radius_and_the_whole_height(make_scene: MakeScene) -> None:
    scene = make_scene({"container": {"tiers": [*TIERS, {"radius_m": 0.018, "height_m": 0.1}]}})
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


BAD: list[tuple[dict[str, Any], str]] = [
    ({"phases": [DEPOSIT, PULL]}, "phases.1: pull-hook, but the scene has no hooks; add the key hooks (`hooks: {}` "),
    (
        {"hooks": {}, "phases": [DEPOSIT, {**PULL, "speed_m_per_s": 0}]},
        "phases.1.speed_m_per_s: 0 m/s is out of range; use more than 0 m/s",
    ),
    (
        {"hooks": {}, "phases": [DEPOSIT, {**PULL, "speed_m_per_s": -1}]},
        "phases.1.speed_m_per_s: -1 m/s is out of range",
    ),
    (
        {"hooks": {}, "phases": [DEPOSIT, {**PULL, "distance_m": 0}]},
        "phases.1.distance_m: 0 m is out of range; use more than 0 m",
    ),
    ({"hooks": {}, "phases": [DEPOSIT, {**PULL, "distance_m": 23.4}]}, "phases.1.distance_m: 23.4 means 23.4 m"),
    (
        {"hooks": {}, "phases": [DEPOSIT, {**PULL, "duration_s": 1}]},
        "phases.1.duration_s: 1 s is too short to raise the hook by distance_m = 0.0234 m at speed_m_per_s = "
        "0.0117 m/s; use at least 2 s",
    ),
    (
        {"hooks": {}, "phases": [DEPOSIT, {**PULL, "which": "lower"}]},
        "phases.1.which: 'lower' is not known; use 'upper'",
    ),
    (
        {"phases": [DEPOSIT, {**REMOVE, "speed_m_per_s": 0}]},
        "phases.1.speed_m_per_s: 0 m/s is out of range; use more than",
    ),
    ({"phases": [DEPOSIT, {**REMOVE, "speed_m_per_s": -0.1}]}, "phases.1.speed_m_per_s: -0.1 m/s is out of range; "),
    ({"phases": [DEPOSIT, {**REMOVE, "parts": "floor"}]}, "phases.1.parts: 'floor' is not known; use 'wall'"),
    (
        {"phases": [DEPOSIT, REMOVE, SHAKE, REMOVE]},
        "phases.3: remove-container, but phases.1 did so already; leave one of them out",
    ),
    (
        {"phases": [DEPOSIT, REMOVE, REMOVE]},
        "phases.2: remove-container, but phases.1 did so already; leave one of them out",
    ),
    ({"phases": [REMOVE, DEPOSIT]}, "phases: got remove-container, deposit; a run starts with one 'deposit'"),
    (
        {"hooks": {"length_m": 0.048}},
        "hooks.length_m: 0.048 m is inside the wall, whose flats are 0.02339 m from the axis; use less than 0.04678 m",
    ),
    (
        {"hooks": {"lower_height_m": 2e-4}},
        "hooks.lower_height_m: 0.0002 m puts bars of side_m = 0.0005 m into the floor; use at least 0.00025 m",
    ),
    (
        {"hooks": {"upper_height_m": 0.0054}},
        "hooks.upper_height_m: 0.0054 m is not above the lower hook, whose top is at 0.00525 m; use at least 0.0055 m",
    ),
    (
        {"hooks": {"upper_height_m": 0.2}, "container.height_m": 0.1},
        "hooks.upper_height_m: 0.2 m is outside the container, whose wall ends at 0.1 m; use at most 0.09975 m",
    ),
    (
        {"hooks": {"upper_height_m": 0.3}, "phases": [DEPOSIT, RELAX, PULL]},
        "hooks.upper_height_m: 0.3 m is above all that 10 smarticles can reach while they are poured, 0.108 m, so that "
        "phases.2 (pull-hook) would feel nothing; lower it",
    ),
    (
        {"container": {"tiers": [{**tier, "height_m": 0.01} for tier in TIERS]}},
        "container.tiers: 0.02 m of wall is too low for one layer of the pour, spread over phases.0.layer_height_w = 1 "
        "w, which reaches 0.02192 m; raise height_m of the top tier by at least 0.00192 m or lower layer_height_w",
    ),
    (
        {"container.height_m": 0.02},
        "container.height_m: 0.02 m of wall is too low for one layer of the pour, spread over phases.0.layer_height_w "
        "= 1 w, which reaches 0.02192 m; raise it by at least 0.00192 m or lower layer_height_w",
    ),
    ({"hooks": {"side_m": 0.02}}, "hooks.side_m: 0.02 m is more than length_m = 0.0117 m; bars are long and thin"),
    ({"hooks": {"length_m": 11.7}}, "hooks.length_m: 11.7 means 11.7 m, which no smarticle scene needs; "),
    ({"hooks": {"sides_m": 1}}, "hooks: unknown key 'sides_m'; did you mean 'side_m'?"),
    ({"hooks": True}, "hooks: got the boolean true, expected keys and values"),
    ({"hooks": [1]}, "hooks: [1] is not keys and values; write them as {key: value}"),
    (
        {"container": {"tiers": [TIERS[1], TIERS[0]]}},
        "container.tiers.1.radius_m: 0.0234 m is wider than the tier below, 0.018 m; a mould is filled from the top "
        "and lifted off: order tiers from wide to narrow",
    ),
    ({"container": {"tiers": []}}, "container.tiers: an empty list; give at least 1 item"),
    (
        {"container": {"tiers": TIERS, "radius_m": 0.02}},
        "container.radius_m: 0.02 m, but tiers make it 0.0234 m; leave radius_m out",
    ),
    (
        {"container": {"tiers": [*TIERS, {"radius_m": 0.005, "height_m": 0.01}]}},
        "container.tiers.2.radius_m: 0.005 m is narrower than a smarticle, whose farthest point is ",
    ),
    (
        {"container": {"tiers": TIERS}, "count": 5000},
        "count: 5000 smarticles cannot fit into 0.024 m of container.height_m (half full is 921); lower the count or "
        "make the top tier higher",
    ),
    (
        {
            "container": {"tiers": [*TIERS, {"radius_m": 0.0125, "height_m": 0.1}]},
            "hooks": {"length_m": 0.03},
            "phases": [DEPOSIT, PULL],
        },
        "hooks.length_m: 0.03 m is inside the wall, whose flats are 0.01249 m from the axis; use less than ",
    ),
]


@pytest.mark.parametrize(("changes", "expected"), BAD, ids=[str(number) for number in range(len(BAD))])
def test_bad_value_is_refused_with_its_key(scene_data: SceneData, changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_scene(scene_data(changes), source="bad.yaml")
    assert str(caught.value).startswith(f"bad.yaml: {expected}"), caught.value
    assert "\n" not in str(caught.value)


def test_an_error_in_the_smarticle_is_one_error(scene_data: SceneData) -> None:
    data = scene_data({"smarticle.middle_length_m": -1, "hooks": {}, "phases": [DEPOSIT, PULL]})
    with pytest.raises(InputError) as caught:
        parse_scene(data, source="bad.yaml")
    assert str(caught.value) == "bad.yaml: smarticle.middle_length_m: -1 m is out of range; use more than 0 m"


def test_a_hook_may_be_pulled_out_over_the_wall(make_scene: MakeScene) -> None:
    make_scene({"hooks": {}, "container.height_m": 0.03, "phases": [DEPOSIT, {**PULL, "distance_m": 0.5}]})


def test_the_wall_is_high_enough_for_the_hooks(make_scene: MakeScene) -> None:
    assert make_scene({"hooks": {"upper_height_m": 0.3}}).cylinder.height > 0.3 + W
    # A pile that stands higher than the hooks needs no more than without them.
    many = {"count": 300}
    assert make_scene({"hooks": {}, **many}).cylinder.height == make_scene(many).cylinder.height


def test_removal_has_defaults(make_scene: MakeScene) -> None:
    removal = make_scene({"phases": [DEPOSIT, REMOVE]}).phases[1]
    assert isinstance(removal, RemoveContainer)
    assert (removal.parts, removal.speed_m_per_s, removal.duration_s) == ("wall", None, 1.0)


@given(
    side=st.floats(2e-4, 5e-3),
    length=st.floats(5e-3, 3e-2),
    diameter=st.floats(4e-4, 2e-3),
    place=st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)),
    bar=st.sampled_from([0, 1]),
)
def test_obstacles_keep_spheres_off_the_bars(
    side: float, length: float, diameter: float, place: tuple[float, float, float], bar: int
) -> None:
    cross = Cross(height=0.01, side=side, length=max(length, side))
    point = np.array(place) * cross.half_extents[bar] + [0, 0, 0.01]
    nearest = np.linalg.norm(cross.obstacles(diameter) - point, axis=1).min()
    # A sphere a diameter away from every obstacle is farther than its radius from any point of a bar.
    assert nearest < diameter / 2


def particle() -> Particle:
    boxes = Boxes(middle_length=W, barb_length=0.8 * W, thickness_normal=1.27e-3, thickness_in_plane=T2, density=7850)
    return Particle(boxes, SphereChain(rows=1, diameter=1.2e-3, pitch=1.2e-3))


def test_layers_keep_off_the_steps_of_a_mould() -> None:
    one, cylinder = particle(), Cylinder(radius=0.0234, height=0.1, facets=64, upper=((0.012, 0.016),))
    for seed in range(10):
        poses = place_layer(
            one,
            count=8,
            radius=cylinder.inner_radius,
            bottom=0.001,
            height=0.015,
            obstacles=np.empty((0, 3)),
            rng=np.random.default_rng(seed),
            narrower=cylinder.inner_radii,
        )
        for position, rotation in zip(poses.positions, poses.rotations, strict=True):
            spheres = rotation.apply(one.centres) + position
            off_axis = np.hypot(spheres[:, 0], spheres[:, 1])
            tops = spheres[:, 2] + one.radius
            assert (off_axis + one.radius < cylinder.inner_radii(tops)).all()


BOXES = Boxes(middle_length=W, barb_length=0.7 * W, thickness_normal=1.27e-3, thickness_in_plane=T2, density=7850)
DOG = Watchdog(cylinder=Cylinder(radius=0.0234, height=0.1, facets=64, upper=((0.05, 0.012),)), speed=5.0)


def at(*position: float) -> State:
    still = np.zeros((1, 3))
    return State.rigid(BOXES, np.array([position], dtype=float), np.eye(3)[None], still, still)


def test_watchdog_knows_a_wall_that_is_gone_and_a_hook_that_is_raised() -> None:
    far, high = at(0.2, 0.0, 0.01), at(0.0, 0.0, 0.11)
    for state in (far, high):
        with pytest.raises(RunError):
            DOG.check(state, floor=0.0, time=1.0)
        DOG.check(state, floor=0.0, time=1.0, raised=None)
    DOG.check(high, floor=0.0, time=1.0, raised=0.02)
    with pytest.raises(RunError, match="left through the wall"):
        DOG.check(far, floor=0.0, time=1.0, raised=0.02)
    with pytest.raises(RunError, match="left through the wall or the floor"):
        DOG.check(at(0.2, 0.0, -0.01), floor=0.0, time=1.0, raised=None)  # the floor stays


def test_watchdog_knows_the_tiers() -> None:
    DOG.check(at(0.02, 0.0, 0.04), floor=0.0, time=1.0)
    with pytest.raises(RunError, match="left through the wall"):
        DOG.check(at(0.02, 0.0, 0.06), floor=0.0, time=1.0)


def test_a_layer_that_fits_by_either_way_out_is_let_pass(make_scene: MakeScene) -> None:
    make_scene({"container.height_m": 0.02193})
    make_scene({"container.height_m": 0.02, "phases.0.layer_height_w": 0.8})


def test_a_high_hook_that_nobody_pulls_is_let_pass(make_scene: MakeScene) -> None:
    make_scene({"hooks": {"upper_height_m": 0.3}})
    make_scene({"hooks": {"upper_height_m": 0.1}, "phases": [DEPOSIT, RELAX, PULL]})
