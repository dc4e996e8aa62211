"""What a scene file says is what the scene is: defaults, overrides, round trips, the hash, the schema."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from scenes import small

from dem.scene.reading import dump_scene, load_scene, parse_scene, scene_hash
from dem.scene.scene import Scene

SceneData = Callable[..., dict[str, Any]]

# Of the small scene, as it was before scenes named an engine. It changes with every default of a scene: changing
# one means that earlier runs cannot be resumed.
PLAIN_HASH = "bd49c1b6ca1f53883664edf95600a298153c39a4d21bf0870066fcafa60feb56"
MINIMAL = "schema_version: 1\nseed: 3\ncount: 12\nphases:\n  - {type: deposit}\n  - {type: shake}\n"


def write(folder: Path, text: str = MINIMAL) -> Path:
    path = folder / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_overrides_reach_every_depth(tmp_path: Path) -> None:
    scene = load_scene(
        write(tmp_path),
        [
            "seed=9",
            "phases.1.duration_s=2",
            "phases.0.settle.timeout_s=7.5",
            "smarticle.aspect_ratio=1e-1",
            "fidelity=draft",
            "fidelity.rows=2",
            "smarticle.angles_deg=[80, 85]",
        ],
    )
    assert scene.seed == 9
    assert scene.phases[1].duration_s == 2
    assert scene.phases[0].settle.timeout_s == 7.5
    assert scene.smarticle.aspect_ratio == 0.1
    assert (scene.fidelity.base, scene.fidelity.rows) == ("draft", 2)
    assert (
        scene.fidelity.stiffness_N_per_m == load_scene(write(tmp_path), ["fidelity=draft"]).fidelity.stiffness_N_per_m
    )
    assert scene.smarticle.angles_deg == (80, 85)


@pytest.mark.parametrize(("text", "value"), [("1e-3", 1e-3), ("1.e1", 10.0), ("2E0", 2.0), ("5", 5.0), (".5", 0.5)])
def test_numbers_in_yaml_are_read_as_people_write_them(tmp_path: Path, text: str, value: float) -> None:
    assert load_scene(write(tmp_path, MINIMAL + f"gravity_m_per_s2: {text}\n")).gravity_m_per_s2 == value


@pytest.mark.parametrize("fidelity", ["draft", {"base": "reference", "time_step_s": 1e-6}])
def test_dump_and_parse_come_back_to_the_same_scene(fidelity: Any) -> None:
    scene = small({"fidelity": fidelity, "name": "μ = 0.4: «a, b» #1", "smarticle.aspect_ratio": 1 / 3})
    text = dump_scene(scene)
    again = parse_scene(yaml.safe_load(text), source="dump")
    assert again == scene
    assert dump_scene(again) == text
    assert scene_hash(again) == scene_hash(scene)
    # Every default is written out: no key of any model is missing, but those younger than the format, see below.
    assert set(yaml.safe_load(text)) == set(Scene.known_keys()) - {"engine", "protocol", "particle", "liquid"}
    assert yaml.safe_load(text)["smarticle"]["aspect_ratio"] == 1 / 3


def test_the_default_engine_is_neither_written_nor_hashed_and_another_is_both() -> None:
    # Scenes and runs from before there was a choice have no such key: they keep their text and their hash.
    assert small().engine == "yade"
    plain, named, other = small(), small({"engine": "yade"}), small({"engine": "links"})
    assert named == plain
    assert dump_scene(named) == dump_scene(plain)
    assert scene_hash(named) == scene_hash(plain) == PLAIN_HASH
    assert yaml.safe_load(dump_scene(other))["engine"] == "links"
    assert scene_hash(other) != scene_hash(plain)
    assert parse_scene(yaml.safe_load(dump_scene(other)), source="dump") == other


def test_hash_is_stable_over_notation_and_sensitive_to_everything(scene_data: SceneData) -> None:
    scene = small()
    assert re.fullmatch(r"[0-9a-f]{64}", scene_hash(scene))
    same = parse_scene(dict(reversed(scene_data().items())), source="x")
    assert scene_hash(same) == scene_hash(scene)
    assert scene_hash(small({"smarticle.density_kg_per_m3": 7850})) == scene_hash(scene)
    changes: list[dict[str, Any]] = [
        {"seed": 2},
        {"count": 11},
        {"smarticle.aspect_ratio": 0.7000001},
        {"contact.restitution": 0.4},
        {"fidelity": "standard"},
        {"phases.2.duration_s": 0.3},
        {"recording.frame_interval_s": 0.08},
        {"gravity_m_per_s2": 9.8},
        {"container.radius_m": 0.03},
        {"motor.speed_limit_rad_per_s": 5.0},
    ]
    hashes = {scene_hash(small(change)) for change in changes}
    assert len(hashes | {scene_hash(scene)}) == len(changes) + 1


def test_seeds_for_purposes_come_from_the_seed_alone() -> None:
    scenes = [small().model_copy(update={"seed": seed}) for seed in range(500)]
    drawn = {scene.seed_for(purpose) for scene in scenes for purpose in ("deposit", "shake")}
    assert len(drawn) == 1000
    assert max(drawn) > 2**63  # all 64 bits are used: seeds of a sweep do not collide


@pytest.mark.parametrize(
    ("changes", "stiffness", "speed"),
    [
        ({}, 3e-3, 0.02),
        ({"smarticle.aspect_ratio": 1.8}, 3e-3, 0.02),
        ({"gravity_m_per_s2": 4 * 9.81}, 12e-3, 0.04),
        # Twice as large in every direction: 8 times the mass and 16 times the torque.
        (
            {
                "smarticle.middle_length_m": 0.0234,
                "smarticle.thickness_normal_m": 2.54e-3,
                "smarticle.thickness_in_plane_m": 1e-3,
                "container.radius_m": 0.05,
            },
            48e-3,
            0.0283,
        ),
        (
            {"motor.stiffness_N_m_per_rad": 3e-3, "phases.0.settle.speed_m_per_s": 0.02, "gravity_m_per_s2": 1},
            3e-3,
            0.02,
        ),
        (
            {"particle": {"shape": "rod", "length_m": 0.0468, "diameter_m": 1e-3}, "container.radius_m": 0.05},
            3e-3,
            0.04,
        ),
    ],
)
def test_shafts_and_the_speed_of_a_settled_pile_follow_the_size_of_the_body(
    changes: dict[str, Any], stiffness: float, speed: float
) -> None:
    scene = small(changes)
    assert scene.motor.stiffness_N_m_per_rad == stiffness
    assert scene.phases[0].settle.speed_m_per_s == speed
    again = parse_scene(yaml.safe_load(dump_scene(scene)), source="dump")
    assert (again.motor, again.phases) == (scene.motor, scene.phases)
    assert scene_hash(again) == scene_hash(scene)


@pytest.mark.parametrize(
    ("changes", "hold"),
    [
        ({}, 0.05),
        ({"gravity_m_per_s2": 9.81 / 4}, 0.0815),
        ({"gravity_m_per_s2": 4 * 9.81}, 0.05),  # shorter times are between two checks
        ({"particle": {"shape": "rod", "length_m": 0.0468, "diameter_m": 1e-3}, "container.radius_m": 0.05}, 0.0815),
        ({"particle": {"shape": "rod", "length_m": 0.016, "diameter_m": 5e-4}}, 0.05),  # the longest of results/rods
        ({"particle": {"shape": "rod", "length_m": 0.002, "diameter_m": 1e-4}}, 0.05),
        ({"gravity_m_per_s2": 1, "phases.0.settle.hold_s": 0.02}, 0.02),
    ],
)
def test_a_pile_of_large_bodies_must_be_still_for_longer(changes: dict[str, Any], hold: float) -> None:
    scene = small(changes)
    assert scene.phases[0].settle.hold_s == hold
    again = parse_scene(yaml.safe_load(dump_scene(scene)), source="dump")
    assert again.phases == scene.phases
    assert scene_hash(again) == scene_hash(scene)


def test_scaled_defaults_do_not_count_as_given_so_that_a_changed_scene_scales_anew() -> None:
    scene = small({"motor.law": "stall", "gravity_m_per_s2": 1})
    kept = scene.model_dump(exclude_unset=True)
    assert kept["motor"] == {"law": "stall"}
    assert "settle" not in kept["phases"][0]
