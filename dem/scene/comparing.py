"""In what two scenes differ, for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dem.scene.scene import Scene

_MOST = 3  # keys that are told; who changed more knows what


def difference(there: Scene, here: Scene) -> str:
    """`seed 1 there, 2 here; count 100 there, 50 here`: the first keys in which two scenes differ.

    Args:
        there: the one that is called "there".
        here: the other.
    """
    one, other = (dict(_leaves(scene.model_dump(mode="json"))) for scene in (there, here))
    keys = [key for key in {**one, **other} if one.get(key, _ABSENT) != other.get(key, _ABSENT)]
    told = [f"{key} {one.get(key, _ABSENT)} there, {other.get(key, _ABSENT)} here" for key in keys[:_MOST]]
    return "; ".join(told) + (f"; {len(keys) - _MOST} more" if len(keys) > _MOST else "")


_ABSENT = "absent"


def _leaves(data: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Every value with its key, `phases.1.duration_s`."""
    items = data.items() if isinstance(data, Mapping) else enumerate(data) if isinstance(data, list) else None
    if items is None:
        yield place, data
        return
    for key, value in items:
        yield from _leaves(value, f"{place}.{key}" if place else str(key))
