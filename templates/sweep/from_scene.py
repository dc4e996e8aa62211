"""Make the template of a sweep from a scene."""

from collections.abc import Mapping
from typing import Any

import yaml

from dem.errors import InputError
from dem.scene.reading import apply_override


def as_template(data: Any, names: Mapping[str, str], source: str) -> str:
    """Return the text of a template for a sweep: a scene in YAML with variables in place of some values.

    InputError if the scene, `data`, which is changed in place, has text that a template would execute. `names` are
    those of variables by the key whose value they replace; dots separate nested keys, as in `motor.law`.
    """
    text = _dumped(data)
    for mark in ("{{", "{%", "{#"):
        if mark in text:
            raise InputError(f"{source}: contains {mark!r}, which is template syntax; remove it")
    for key, name in names.items():
        apply_override(data, f"{key}='{{{{ {name} }}}}'")
    text = _dumped(data)
    for name in names.values():
        text = text.replace(f"'{{{{ {name} }}}}'", f"{{{{ {name} }}}}")
    return text


def _dumped(data: Any) -> str:
    return str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True))
