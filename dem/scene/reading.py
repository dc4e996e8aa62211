"""Scenes read, written and told apart."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml
from pydantic import ValidationError

from dem.errors import InputError, shown
from dem.record.names import SCENE
from dem.refusal import refusals
from dem.scene.overrides import apply_override
from dem.scene.scene import Scene
from dem.scene.yaml_text import parse_yaml
from dem.setting.fidelity import FIDELITIES

SCHEMA_VERSION = 1
DEFAULT_ENGINE = "yade"
YOUNGER: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {"shake": {"moves": "container"}, "deposit": {"every_s": None, "thrown_at_m_per_s": 0.0}}
)
"""Keys of phases that are younger than the format, by type of phase, with their defaults."""


def parse_scene(data: Any, *, source: str, folder: Path | None = None) -> Scene:
    """Validate plain data.

    Args:
        data: the content of a scene file.
        source: file name for messages.
        folder: where directories of other runs are seen from; by default the working directory.

    Raises:
        InputError: one line with file, key, value and the way out.
    """
    if data is None:
        msg = f"{source}: is empty; a scene is a mapping of keys to values, see `smarticles schema`"
        raise InputError(msg)
    if not isinstance(data, Mapping):
        msg = f"{source}: a scene is a mapping of keys to values, got {shown(data)}"
        raise InputError(msg)
    if "template" in data and "points" in data:
        msg = f"{source}: is a sweep file, which makes many scenes; give it to `smarticles sweep`"
        raise InputError(msg)
    if "schema_version" not in data:
        # A scene made in Python is of this version; a file says of which it is.
        msg = f"{source}: schema_version: missing; it has no default"
        raise InputError(msg)
    version = data.get("schema_version")
    if isinstance(version, int) and version != SCHEMA_VERSION:
        msg = f"{source}: schema_version: {shown(version)} is not known here; this version reads {SCHEMA_VERSION}"
        raise InputError(msg)
    try:
        return Scene.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        msg = f"{source}: {refusals(error, data, described='`smarticles schema`')}"
        raise InputError(msg) from None


def load_scene(path: Path | str, overrides: Sequence[str] = ()) -> Scene:
    """Read a scene file.

    Args:
        path: YAML file.
        overrides: `KEY=VALUE` with dots for nesting, e.g. `phases.1.duration_s=2`; the value is read as YAML.

    Raises:
        InputError: unreadable file, bad YAML, bad override or invalid scene.
    """
    path = Path(path)
    if path.is_dir():
        inside = path / SCENE
        msg = f"{path}: is a directory; give " + (str(inside) if inside.is_file() else "the path of a scene file")
        raise InputError(msg)
    if path.suffix == ".j2" and path.is_file():
        msg = f"{path}: is a template of scenes; give the sweep file that names it to `smarticles sweep`"
        raise InputError(msg)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); give the path of a scene file"
        raise InputError(msg) from None
    except UnicodeDecodeError:
        msg = f"{path}: is not a text file; give the path of a scene file"
        raise InputError(msg) from None
    data = parse_yaml(text, str(path))
    for override in overrides if isinstance(data, Mapping) else ():
        apply_override(data, override)
    return parse_scene(data, source=str(path), folder=path.parent)


def _plain(scene: Scene) -> dict[str, Any]:
    """The resolved scene as plain data; keys younger than the format are not told where they have their defaults.

    A protocol would fill them in again, so that with one they are all told.
    """
    data = scene.model_dump(mode="json")
    if scene.engine == DEFAULT_ENGINE:
        del data["engine"]
    _leave_out(data["recording"], {"contact_forces": False})
    _leave_out(data["smarticle"], {"middle_thickness_in_plane_m": None})
    if scene.hooks is not None:
        _leave_out(data["hooks"], {"lower_length_m": scene.hooks.length_m, "lower_bars": 1})
    if scene.protocol is None:
        _leave_out(data, {"protocol": None})
        _leave_out(data["container"], {"packing_radius_m": None})
        for phase in data["phases"]:
            _leave_out(phase, YOUNGER.get(phase["type"], {}))
    return data


def _leave_out(data: dict[str, Any], defaults: Mapping[str, Any]) -> None:
    for key, default in defaults.items():
        if data[key] == default:
            del data[key]


def dump_scene(scene: Scene, folder: Path | None = None) -> str:
    """The resolved scene as YAML, every default written out.

    Args:
        scene: the scene.
        folder: of the file that it is written to, where directories of other runs are seen from; None: nobody knows,
            and they are written in full.
    """
    data = _plain(scene)
    if folder is not None:
        for phase in data["phases"]:
            if "run" in phase:
                phase["run"] = os.path.relpath(phase["run"], folder.resolve())
    return str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True))


def scene_hash(scene: Scene) -> str:
    """SHA-256 of the canonical JSON of the resolved scene, without what says where pinned content comes from."""
    data = _plain(scene)
    for told, phase in zip(data["phases"], scene.phases, strict=True):
        for key in phase.sources:
            del told[key]
    text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def json_schema() -> dict[str, Any]:
    """JSON schema of the scene file, for editors."""
    schema = Scene.model_json_schema()
    schema["required"].insert(0, "schema_version")
    del schema["properties"]["schema_version"]["default"]
    # The file may name a fidelity, or give its base and some knobs; the model that pydantic describes has them all.
    fidelity = schema["properties"]["fidelity"]
    mapping = {"$ref": fidelity.pop("$ref")}
    fidelity["anyOf"] = [{"type": "string", "enum": list(FIDELITIES)}, mapping]
    schema["$defs"]["Fidelity"].pop("required")
    # These follow from the smarticle where they are not given.
    schema["$defs"]["Hooks"].pop("required")
    schema["$defs"]["PullHook"]["required"] = ["type"]
    return schema
