"""Read scenes from files, change their keys by `--set`, and write, hash and compare scenes."""

import copy
import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml
from pydantic import ValidationError

from dem.errors import InputError, shown
from dem.record.names import SCENE
from dem.scene.keys import put
from dem.scene.scene import ENGINE_OF_VERSION_1, SCHEMA_VERSION, Scene
from dem.setting.contact import PRESET
from dem.setting.fidelity import FIDELITIES
from dem.strict import explained
from dem.yaml_text import load_yaml, parse_yaml, read_text

VERSIONS = (1, SCHEMA_VERSION)  # that are read; scenes are written in version 1, as earlier programs read them
MOST_DIFFERENCES = 3  # keys that are shown where two scenes differ
ADDED_KEYS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {"shake": {"moves": "container"}, "deposit": {"every_s": None, "thrown_at_m_per_s": 0.0}}
)
"""Keys of phases that were added to version 1 of the format, by type of phase, with their defaults."""
NEWER_KEYS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "shake": {
            "frequency_end_hz": None,
            "peak_acceleration_end_g": None,
            "ramp": "linear",
            "taps": None,
            "rest_s": 0.5,
        },
        "pull-hook": {"vibration": None},
        "lift": {"bodies": None, "nodes": None},
        "tension": {"bodies": None},
    }
)
"""Keys of phases that were added later, by type of phase, with their defaults; no protocol fills them in."""


def parse_scene(data: Any, *, source: str, folder: Path | None = None) -> Scene:
    """Return the scene that plain data describe, or raise InputError in one line with file, key and value.

    `source` names the data's origin in messages. Paths of other runs are relative to `folder`; None: the working
    directory.
    """
    if problem := _not_a_scene(data):
        raise InputError(f"{source}: {problem}")
    try:
        return Scene.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        raise InputError(f"{source}: {explained(error, data, described='`smarticles keys`')}") from None


def _not_a_scene(data: Any) -> str | None:
    if data is None:
        return "is empty; a scene is a mapping of keys to values, see `smarticles keys`"
    if not isinstance(data, Mapping):
        return f"a scene is a mapping of keys to values, got {shown(data)}"
    if "template" in data and "points" in data:
        return "is a sweep file, which makes many scenes; give it to `smarticles sweep`"
    if "schema_version" not in data:
        # Only scenes made in Python may leave the version out.
        return f"schema_version: missing; write `schema_version: {SCHEMA_VERSION}`"
    version = data["schema_version"]
    if isinstance(version, int) and version not in VERSIONS:
        return f"schema_version: {shown(version)} is not known here; use {' or '.join(map(str, VERSIONS))}"
    return None


def load_scene(
    path: Path | str, overrides: Sequence[str] = (), *, check: Callable[[Scene], object] = lambda _: None
) -> Scene:
    """Return the scene of a file.

    Args:
        overrides: changes of keys as `KEY=VALUE`, e.g. `phases.1.duration_s=2`.
        check: function that raises InputError for scenes to reject, besides those that are not valid.

    Raises:
        InputError: the file cannot be read or is not YAML, an override is wrong, or the scene is not valid.
    """
    path = Path(path)
    problem, way_out = "", "give the path of a scene file"
    try:
        if path.is_dir():
            problem = "is a directory"
            way_out = f"give {path / SCENE}" if (path / SCENE).is_file() else way_out
        elif path.suffix == ".j2" and path.is_file():
            problem, way_out = "is a template of scenes", "give the sweep file that names it to `smarticles sweep`"
        else:
            text = read_text(path)
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
    except UnicodeDecodeError:
        problem = "is not a text file"
    if problem:
        raise InputError(f"{path}: {problem}; {way_out}")
    data = parse_yaml(text, str(path))

    def checked(some: Any) -> Scene:
        scene = parse_scene(some, source=str(path), folder=path.parent)
        try:
            check(scene)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        return scene

    changed = copy.deepcopy(data)
    for override in overrides if isinstance(data, Mapping) else ():
        apply_override(changed, override)
    try:
        return checked(changed)
    except InputError as error:
        culprit = _culprit(data, overrides, checked) if isinstance(data, Mapping) else None
        if culprit is None:
            raise
        raise InputError(f"--set {culprit}: {str(error).removeprefix(f'{path}: ')}") from None


def _culprit(data: Any, overrides: Sequence[str], checked: Callable[[Any], Scene]) -> str | None:
    """Return the last override with which a valid scene became invalid; None if there is none.

    `checked` raises InputError for data of an invalid scene. `data` is changed in place.
    """

    def is_valid() -> bool:
        with suppress(InputError):
            checked(data)
            return True
        return False

    culprit, valid = None, bool(overrides) and is_valid()
    for override in overrides:
        apply_override(data, override)
        before, valid = valid, is_valid()
        culprit = override if before and not valid else culprit
    return culprit


def apply_override(data: Any, override: str) -> None:
    """Change one key of a scene's data in place, by `KEY=VALUE` with dots for nesting and a YAML value.

    InputError if the override has another form, or the scene has no such key.
    """
    key, separator, text = override.partition("=")
    if not separator or not key:
        raise InputError(f"--set {override}: write KEY=VALUE, e.g. --set phases.1.duration_s=2")
    try:
        value = load_yaml(text)
    except yaml.YAMLError:
        raise InputError(f"--set {override}: the value is not valid YAML") from None
    try:
        put(data, key, value)
    except InputError as error:
        raise InputError(f"--set {override}: {str(error).removeprefix(f'{key}: ')}") from None


def _plain(scene: Scene) -> dict[str, Any]:
    """Return the resolved scene as plain data of version 1, without default values of keys that were added later.

    Without such keys, among them `ADDED_KEYS` and `NEWER_KEYS`, the hashes of older scenes do not change. A scene with
    a protocol keeps `packing_radius_m` and `ADDED_KEYS`, since the protocol may have filled them in. A scene of other
    bodies than smarticles has no key `smarticle`.
    """
    data = {**scene.model_dump(mode="json"), "schema_version": VERSIONS[0]}
    smarticle = data["smarticle"]
    optional: list[tuple[dict[str, Any], Mapping[str, Any]]] = [
        (data, {"engine": ENGINE_OF_VERSION_1, "particle": None, "liquid": None}),
        (data["recording"], {"contact_forces": False, "frames": "vtu"}),
        (smarticle, {"middle_thickness_in_plane_m": None}),
    ]
    if scene.particle is not None:
        del data["smarticle"]
        optional = [entry for entry in optional if entry[0] is not smarticle]
        filaments = [shape for shape in data["particle"] if shape["shape"] == "filament"]
        optional += [(shape, {"roll_drag_N_s": 0.0}) for shape in filaments]
    if scene.hooks is not None:
        optional.append((data["hooks"], {"lower_length_m": scene.hooks.length_m, "lower_bars": 1}))
    if scene.protocol is None:
        optional += [(data, {"protocol": None}), (data["container"], {"packing_radius_m": None})]
        optional += [(phase, ADDED_KEYS.get(phase["type"], {})) for phase in data["phases"]]
    optional += [(phase, NEWER_KEYS.get(phase["type"], {})) for phase in data["phases"]]
    for part, defaults in optional:
        for key, default in defaults.items():
            if part[key] == default:
                del part[key]
    return data


def dump_scene(scene: Scene, folder: Path | None = None, *, attached: bool = False) -> str:
    """Return the resolved scene as YAML, without the keys that `_plain` leaves out.

    With `folder`, paths of runs and files are made relative to it; with `attached`, files are copies in this folder,
    see `Phase.attached`.
    """
    data = _plain(scene)
    if folder is not None:
        for dumped, phase in zip(data["phases"], scene.phases, strict=True):
            for key in phase.sources & {"run", "file"}:
                dumped[key] = os.path.relpath(dumped[key], folder.resolve())
            if attached and phase.attached is not None:
                dumped["file"] = phase.attached[0]
    return str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True))


def scene_hash(scene: Scene) -> str:
    """Return the SHA-256 hash of a resolved scene, from its canonical JSON.

    Keys in `Phase.sources`, such as paths, are left out; hashes of the content found there are included.
    """
    data = _plain(scene)
    for dumped, phase in zip(data["phases"], scene.phases, strict=True):
        for key in phase.sources:
            del dumped[key]
    text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def difference(there: Scene, here: Scene) -> str:
    """Return the first keys in which two scenes differ, as `seed 1 there, 2 here; count 9 there, 8 here`."""
    one, other = (flattened(scene.model_dump(mode="json")) for scene in (there, here))
    pairs = [(key, one.get(key, "absent"), other.get(key, "absent")) for key in {**one, **other}]
    texts = [f"{key} {a} there, {b} here" for key, a, b in pairs if a != b]
    more = len(texts) - MOST_DIFFERENCES
    return "; ".join(texts[:MOST_DIFFERENCES]) + (f"; {more} more" if more > 0 else "")


def flattened(value: Any, place: str = "") -> dict[str, Any]:
    """Return the plain values of nested data by their dotted keys, such as `phases.0.type`.

    A list of plain values counts as a plain value. `place` is put before all keys.
    """
    if isinstance(value, list) and any(isinstance(item, Mapping | list) for item in value):
        value = {str(index): item for index, item in enumerate(value)}
    if not isinstance(value, Mapping):
        return {place: value}
    return {
        key: found
        for name, item in value.items()
        for key, found in flattened(item, f"{place}.{name}" if place else name).items()
    }


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of the scene file, for editors."""
    schema = Scene.model_json_schema()
    schema["required"].insert(0, "schema_version")
    del schema["properties"]["schema_version"]["default"]
    # A file may name a fidelity, or give its base and some parameters; pydantic describes the model, which has all.
    fidelity = schema["properties"]["fidelity"]
    mapping = {"$ref": fidelity.pop("$ref")}
    fidelity["anyOf"] = [{"type": "string", "enum": list(FIDELITIES)}, mapping]
    schema["$defs"]["Fidelity"].pop("required")
    schema["$defs"]["Contact"]["properties"][PRESET] = {
        "type": "string",
        "description": "file of contact parameters, relative to the scene file, such as `smarticles calibrate` writes; "
        "keys beside it have priority; a resolved scene has the values instead",
    }
    # A file may give one shape without a list, or the default by its name.
    particle = schema["properties"]["particle"]
    shapes = particle["anyOf"][0]
    particle["anyOf"] = [shapes["items"], shapes, {"type": "string", "enum": ["smarticle"]}, {"type": "null"}]
    # Their defaults follow from the smarticle.
    schema["$defs"]["Hooks"].pop("required")
    schema["$defs"]["PullHook"]["required"] = ["type"]
    return schema
