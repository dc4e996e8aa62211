"""What a protocol fills in, and what stands against it."""

from typing import Any

import pytest
import yaml

from dem.plan.outlook import plan, protocol_lines
from dem.scene.reading import dump_scene, parse_scene, scene_hash
from dem.scene.scene import Scene
from dem.setting.protocol import PROTOCOLS

BARE = {"schema_version": 1, "seed": 1, "count": 9}
PHASES = [{"type": "deposit"}, {"type": "shake"}, {"type": "shape-change"}]


def scene_with(**changes: Any) -> Scene:
    """A scene that says next to nothing, and what a test changes."""
    return parse_scene({**BARE, "phases": PHASES, **changes}, source="scene.yaml")


def test_the_code_differs_where_the_file_of_the_papers_code_says_so() -> None:
    scene = scene_with(protocol="code")
    assert scene.motor.law == "ease"
    assert (scene.contact.friction_smarticle, scene.contact.friction_wall) == (0.2, 0.2)
    assert (scene.container.radius_m, scene.container.measured_radius) == (0.0224, 0.0234)
    assert scene.phases[1].moves == "floor"


def test_the_text_is_the_default_of_a_scene() -> None:
    said, unsaid = scene_with(protocol="text"), scene_with()
    assert said.model_copy(update={"protocol": None}) == unsaid


def test_keys_of_the_scene_have_priority_and_are_reported() -> None:
    scene = scene_with(protocol="code", contact={"friction_wall": 0.3}, motor={"speed_limit_rad_per_s": 3.0})
    assert (scene.contact.friction_smarticle, scene.contact.friction_wall, scene.motor.law) == (0.2, 0.3, "ease")
    first, second = protocol_lines(scene)
    assert first.startswith("protocol code: motor.law ease, contact.friction_smarticle 0.2, ")
    assert "phases.1.moves floor" in first
    assert second == "  the scene says otherwise: contact.friction_wall is 0.3 here, not 0.2"
    assert f"\n{first}\n{second}\n" in plan(scene).to_text()
    assert protocol_lines(scene_with()) == ()


@pytest.mark.parametrize("name", PROTOCOLS)
def test_a_resolved_scene_reads_as_itself(name: str) -> None:
    # A scene that says what is the default against its protocol keeps it when it is read again.
    scene = scene_with(protocol=name, phases=[PHASES[0], {"type": "shake", "moves": "container"}])
    again = parse_scene(yaml.safe_load(dump_scene(scene)), source="scene.yaml")
    assert again == scene
    assert scene_hash(again) == scene_hash(scene)
