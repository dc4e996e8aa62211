"""A scene and the keys of it that vary, written as the sweep file and template that they stand for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from dem.errors import InputError
from dem.scene.reading import SCHEMA_VERSION, apply_override
from dem.scene.scene import Scene
from dem.scene.yaml_text import load_yaml
from dem.setting.fidelity import fidelities
from templates.sweep.sweep_file import SEED

_MARKS = ("{{", "{%", "{#")
"""What a template would take for its own."""


def write_sweep(scene: Scene | Path | str, vary: Mapping[str, Sequence[Any]], folder: Path) -> Path:
    """Writes `sweep.yaml` and `scene.yaml.j2`.

    Args:
        scene: a scene, or the file of one.
        vary: keys of the scene, dots for nesting, and the values of each; all combinations are runs.
        folder: where to.

    Returns:
        The sweep file.

    Raises:
        InputError: the scene cannot be read, has no such place or holds what a template would take for its own, or
            there is nothing to vary.
    """
    if not vary:
        msg = "vary: is empty; give a key of the scene and its values, e.g. {'seed': [1, 2, 3]}"
        raise InputError(msg)
    data = _given(scene) if isinstance(scene, Scene) else _read(Path(scene))
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    for mark in _MARKS:
        if mark in text:
            msg = f"{_named(scene)}: holds {mark!r}, which a template would take for its own; write it without"
            raise InputError(msg)
    names = _names(list(vary))
    for key, name in names.items():
        apply_override(data, f"{key}='{{{{ {name} }}}}'")
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    for name in names.values():
        text = text.replace(f"'{{{{ {name} }}}}'", f"{{{{ {name} }}}}")
    (folder / "scene.yaml.j2").write_text(text, encoding="utf-8")
    grid = {name: list(vary[key]) for key, name in names.items() if name != SEED}
    content: dict[str, Any] = {
        "schema_version": 1,
        "name": str(data.get("name", "sweep")),
        "template": "scene.yaml.j2",
        "run_name": "_".join(f"{name}{{{{ {name} }}}}" for name in names.values()),
        "points": {"grid": grid} if grid else {"list": [{}]},
        **({"repeats": {"seeds": list(vary[SEED])}} if SEED in names.values() else {}),
    }
    file = folder / "sweep.yaml"
    file.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return file


def _names(keys: Sequence[str]) -> dict[str, str]:
    """Variables by key: its last word, or all of its words where another key ends alike."""
    last = [key.rpartition(".")[2] for key in keys]
    return {
        key: word if last.count(word) == 1 and not word.isdigit() else key.replace(".", "_")
        for key, word in zip(keys, last, strict=True)
    }


def _given(scene: Scene) -> dict[str, Any]:
    """What was said of a scene, and not what follows from it, so that it follows anew where something varies."""
    data = scene.model_dump(mode="json", exclude_unset=True)
    if "fidelity" in data:
        named = fidelities(scene.engine)[scene.fidelity.base]
        differing = {key: value for key, value in data["fidelity"].items() if named.get(key) != value}
        data["fidelity"] = {**differing, "base": scene.fidelity.base}
    return {"schema_version": SCHEMA_VERSION, **data}


def _read(path: Path) -> dict[str, Any]:
    try:
        data = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        msg = f"{path}: cannot be read ({' '.join(str(error).split())}); give a scene or the path of a scene file"
        raise InputError(msg) from None
    if not isinstance(data, dict):
        msg = f"{path}: a scene is a mapping of keys to values, got {type(data).__name__}"
        raise InputError(msg)
    for phase in data["phases"] if isinstance(data.get("phases"), list) else ():
        # Seen from its file, which the template is not beside.
        if isinstance(phase, dict) and isinstance(phase.get("run"), str):
            phase["run"] = str((path.parent / phase["run"]).resolve())
    return data


def _named(scene: Scene | Path | str) -> str:
    return "scene" if isinstance(scene, Scene) else str(scene)
