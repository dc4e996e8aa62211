"""`contact: {preset: FILE}`: values of the file, and messages if it is missing or wrong."""

from pathlib import Path

import pytest

from dem.errors import InputError
from dem.scene.reading import dump_scene, json_schema, load_scene, scene_hash

SCENE = "schema_version: 1\nseed: 1\ncount: 10\nphases: [{type: deposit}]\n"


def hashed(folder: Path, *lines: str) -> str:
    file = folder / "scene.yaml"
    file.write_text(SCENE + "\n".join(lines))
    return scene_hash(load_scene(file))


def test_the_hash_is_that_of_the_values(tmp_path: Path) -> None:
    (tmp_path / "preset.yaml").write_text("# calibrated\nfriction_wall: 0.96\nfriction_smarticle: 0.48\n")
    plain = hashed(tmp_path, "contact: {friction_smarticle: 0.48, friction_wall: 0.96}")
    assert hashed(tmp_path, "contact: {preset: preset.yaml}") == plain
    assert "preset" not in dump_scene(load_scene(tmp_path / "scene.yaml"))
    # Keys of the scene have priority over the preset, and the preset over the protocol.
    assert hashed(tmp_path, "contact: {preset: preset.yaml, friction_wall: 0.3}") != plain
    coded = hashed(tmp_path, "protocol: code", "contact: {friction_smarticle: 0.48, friction_wall: 0.96}")
    assert hashed(tmp_path, "protocol: code", "contact: {preset: preset.yaml}") == coded
    scene = load_scene(tmp_path / "scene.yaml", ["contact.friction_wall=0.1"])
    assert (scene.contact.friction_wall, scene.contact.friction_smarticle) == (0.1, 0.48)
    assert json_schema()["$defs"]["Contact"]["properties"]["preset"]["type"] == "string"


def test_a_preset_is_read_as_a_scene_is(tmp_path: Path) -> None:
    (tmp_path / "preset.yaml").write_text("friction_wall: 5e-1\n")
    assert hashed(tmp_path, "contact: {preset: preset.yaml}") == hashed(tmp_path, "contact: {friction_wall: 5e-1}")


@pytest.mark.parametrize(
    ("text", "stated"),
    [
        (None, "preset.yaml cannot be read (No such file or directory); give the path of a preset"),
        ("", "holds null, not keys of `contact` with their values"),
        ("[1", "is not YAML; give a file that `smarticles calibrate` wrote"),
        ("friction_wall: 1\nfriction_wall: 2", "key 'friction_wall' is given twice; keep one of the two"),
        ("friction_wall: 1 #" + 200_000 * "x", "more than 200000 characters"),
        ("friction_wal: 1", "unknown key 'friction_wal'; did you mean 'friction_wall'?"),
        ("friction_wall: 20", "friction_wall: 20 is out of range; use at most 10"),
        ("preset: other.yaml", "unknown key 'preset'"),
    ],
)
def test_a_wrong_preset_is_reported_with_its_file(tmp_path: Path, text: str | None, stated: str) -> None:
    if text is not None:
        (tmp_path / "preset.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        hashed(tmp_path, "contact: {preset: preset.yaml}")
    assert f"scene.yaml: contact.preset: {tmp_path / 'preset.yaml'}" in str(caught.value)
    assert stated in str(caught.value)
