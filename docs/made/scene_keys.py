"""Tables of the keys of a scene from its JSON schema: type, unit, range, default and meaning."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from made.tables import cell, code, table

Schema = Mapping[str, Any]

_UNIT = re.compile(r"\s*\[([^\[\]]{1,20})\]")
_LIMITS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
TAGS = ("type", "shape", "law")  # keys that say which of several mappings one is
_TYPES = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false", "null": "null"}
_HEAD = ("key", "type", "unit", "range", "default", "meaning")


def scene_keys() -> str:
    """Return Markdown tables of the keys of the scene, and of every phase, motion and other mapping."""
    from dem.scene.reading import json_schema  # noqa: PLC0415

    schema = json_schema()
    definitions = schema["$defs"]
    phases = _kinds(schema["properties"]["phases"]["items"])
    motions = _kinds(next(iter(_options(definitions["Actuate"]["properties"]["barbs"]))))
    shapes = _kinds(next(iter(_options(schema["properties"]["particle"]))))
    others = [name for name in definitions if name not in (*phases, *motions, *shapes)]
    parts = [_table(schema)]
    for title, names in (
        ("Phases", phases),
        ("Motions of the barbs", motions),
        ("Shapes of bodies", shapes),
        ("Mappings", others),
    ):
        parts += [f"## {title}\n", *(_part(name, definitions[name]) for name in names)]
    return "\n".join(parts)


def _kinds(choice: Schema) -> list[str]:
    return [_name(target) for target in choice["discriminator"]["mapping"].values()]


def _name(reference: str) -> str:
    return reference.rpartition("/")[2]


def _part(name: str, definition: Schema) -> str:
    kind = next((tag for key in TAGS if (tag := definition["properties"].get(key, {}).get("const"))), None)
    about = " ".join(definition.get("description", "").split())
    return f"({anchor(name)})=\n### {kind or name}\n\n{about}\n\n{_table(definition)}"


def anchor(name: str) -> str:
    """Return the anchor, on the page of scene keys, of a definition of the schema."""
    return f"scene-{name.lower()}"


def _table(definition: Schema) -> str:
    required = definition.get("required", ())
    rows = []
    for key, entry in definition["properties"].items():
        if key in TAGS and "const" in entry:
            continue
        meaning = entry.get("description", "")
        unit = _UNIT.search(meaning)
        shown = "" if unit is None or unit[1] == "1" else cell(unit[1])
        default = "**needed**" if key in required else _default(entry)
        rows.append((code(key), _type(entry), shown, _range(entry), default, cell(_UNIT.sub("", meaning, count=1))))
    return table(_HEAD, rows) if rows else "It has no keys except `type`.\n"


def _options(entry: Schema) -> Iterator[Schema]:
    """Yield the alternative types of an entry of the schema, those inside alternatives included, without null."""
    if "anyOf" in entry:
        for option in entry["anyOf"]:
            yield from _options(option)
    elif entry.get("type") != "null":
        yield entry


def _type(entry: Schema) -> str:
    options = list(_options(entry))
    listed = ["list of these" if o.get("items") in options else _one_type(o) for o in options]
    if any(option.get("type") == "null" for option in entry.get("anyOf", ())):
        listed.append("null")
    return " or ".join(listed)


def _one_type(entry: Schema) -> str:
    if "$ref" in entry:
        name = _name(entry["$ref"])
        return f"[{name}](#{anchor(name)})"
    if "discriminator" in entry:
        kinds = entry["discriminator"]["mapping"]
        return "one of " + ", ".join(f"[{kind}](#{anchor(_name(target))})" for kind, target in kinds.items())
    if "const" in entry or "enum" in entry:
        return " or ".join(code(str(value)) for value in entry.get("enum", [entry.get("const")]))
    return _list(entry) if entry.get("type") == "array" else _TYPES[entry["type"]]


def _list(entry: Schema) -> str:
    if "prefixItems" in entry:
        return f"list of {len(entry['prefixItems'])} {_one_type(entry['prefixItems'][0])}s"
    item = _type(entry["items"])
    return f"list of {item if item.startswith(('one', '[')) else item + 's'}"


def _range(entry: Schema) -> str:
    for option in _options(entry):
        limits = {sign: option[word] for word, sign in _LIMITS.items() if word in option}
        if limits:
            return ", ".join(cell(f"{sign} {'2⁶³' if n == 2**63 else f'{n:g}'}") for sign, n in limits.items())
    return ""


def _default(entry: Schema) -> str:
    if "default" not in entry:
        return "see meaning" if "default" in entry.get("description", "") else ""
    return code(json.dumps(entry["default"], ensure_ascii=False))
