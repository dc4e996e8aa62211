"""Change keys in the data of a scene before they are validated."""

from typing import Any

from dem.errors import InputError


def put(data: dict[str, Any], key: str, value: Any) -> None:
    """Set one key of a scene's data in place, with dots for nesting, as in `phases.1.duration_s`.

    Mappings that are missing are added. InputError if a part of the key is in no mapping and no list.
    """
    node: Any = data
    parts = key.split(".")
    for number, part in enumerate(parts, 1):
        last = number == len(parts)
        if parts[:number] == ["particle", part] and isinstance(node, list) and len(node) == 1 and not part.isdigit():
            node = node[0]  # a scene that was read has a list of particles, its file may have one without a list
        step: Any = int(part) if isinstance(node, list) and part.isdigit() else part
        if not isinstance(node, dict) and not (isinstance(node, list) and isinstance(step, int) and step < len(node)):
            numbered = isinstance(node, list) and not part.isdigit()
            example = f", as in {'.'.join([*parts[: number - 1], '0', *parts[number - 1 :]])}" if numbered else ""
            raise InputError(f"{key}: there is no {part!r} in the scene; lists are numbered from 0{example}")
        if last:
            node[step] = value
        elif isinstance(node, dict):
            if part == "fidelity" and isinstance(node.get(part), str):
                node[part] = {"base": node[part]}
            node = node.setdefault(part, {})
        else:
            node = node[step]
