"""Keys of a scene changed on the command line, `--set KEY=VALUE`."""

from __future__ import annotations

from typing import Any

import yaml

from dem.errors import InputError
from dem.scene.yaml_text import load_yaml


def apply_override(data: Any, override: str) -> None:
    """Change one key of a scene's data.

    Args:
        data: mappings and lists, as read from the file; changed in place.
        override: `KEY=VALUE` with dots for nesting; the value is read as YAML.

    Raises:
        InputError: it is not written so, or there is no such place.
    """
    key, separator, text = override.partition("=")
    if not separator or not key:
        msg = f"--set {override}: write KEY=VALUE, e.g. --set phases.1.duration_s=2"
        raise InputError(msg)
    try:
        value = load_yaml(text)
    except yaml.YAMLError:
        msg = f"--set {override}: the value is not valid YAML"
        raise InputError(msg) from None
    *parents, last = key.split(".")
    here = data
    for part in parents:
        here = _child(here, part, override)
    if isinstance(here, dict):
        here[last] = value
    elif isinstance(here, list) and last.isdigit() and int(last) < len(here):
        here[int(last)] = value
    else:
        msg = f"--set {override}: there is no {last!r} to set; lists are numbered from 0"
        raise InputError(msg)


def _child(here: Any, part: str, override: str) -> Any:
    if isinstance(here, dict):
        if isinstance(here.get(part), str) and part == "fidelity":
            here[part] = {"base": here[part]}
        return here.setdefault(part, {})
    if isinstance(here, list) and part.isdigit() and int(part) < len(here):
        return here[int(part)]
    msg = f"--set {override}: there is no {part!r} in the scene; lists are numbered from 0"
    raise InputError(msg)
