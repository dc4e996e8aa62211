"""What a scene without the key `engine` means: by the version of the file's format, and in Python."""

import pytest
import yaml
from scenes import SMALL, changed

from dem.errors import InputError
from dem.scene.reading import dump_scene, parse_scene, scene_hash
from dem.scene.scene import Scene

KEYS = {key: value for key, value in SMALL.items() if key != "schema_version"}


def of_version(number: float, **keys: str) -> Scene:
    return parse_scene({"schema_version": number, **KEYS, **keys}, source="test")


def test_the_engine_of_a_scene_that_names_none() -> None:
    assert of_version(1).engine == "yade"
    assert of_version(1.0).engine == "yade"
    assert of_version(2).engine == "links"
    assert Scene(**KEYS).engine == "links"
    assert Scene(schema_version=1, **KEYS).engine == "yade"


@pytest.mark.parametrize("engine", ["yade", "links", "lammps"])
def test_versions_differ_in_nothing_else(engine: str) -> None:
    one, two, made = of_version(1, engine=engine), of_version(2, engine=engine), Scene(engine=engine, **KEYS)
    assert one == two == made
    assert scene_hash(one) == scene_hash(two) == scene_hash(made)
    assert parse_scene(yaml.safe_load(dump_scene(made)), source="dump") == made


@pytest.mark.parametrize("version", [0, 3, True, 1.5, "2"])
def test_other_versions_are_rejected(version: object) -> None:
    with pytest.raises(InputError, match=r"schema_version: (.*; use 1 or 2|got the (boolean|text))"):
        parse_scene(changed(SMALL, {"schema_version": version}), source="test")


def test_a_file_without_a_version_says_what_to_write() -> None:
    with pytest.raises(InputError, match="schema_version: missing; write `schema_version: 2`"):
        parse_scene(KEYS, source="test")
