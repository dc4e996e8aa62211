"""What the protocol of a scene says, key by key, and where the scene says otherwise."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dem.scene.scene import Scene
from dem.setting.protocol import PARTS, PROTOCOLS, leaves_alone


def protocol_lines(scene: Scene) -> tuple[str, ...]:
    """A line of what a scene has by its protocol, and one of what it has otherwise; none without a protocol."""
    if scene.protocol is None:
        return ()
    kept, other = [], []
    for key, value, says in _keys(scene, PROTOCOLS[scene.protocol]):
        if value == says:
            kept.append(f"{key} {_told(value)}")
        else:
            other.append(f"{key} is {_told(value)} here, not {_told(says)}")
    lines = [f"protocol {scene.protocol}: {', '.join(kept) or 'nothing of it is left'}"]
    return (*lines, f"  the scene says otherwise: {', '.join(other)}") if other else tuple(lines)


def _keys(scene: Scene, says: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, Any, Any]]:
    """Key, the scene's value, and the protocol's, of all that the protocol speaks of."""
    for part in PARTS:
        if leaves_alone(part, plane=scene.plane is not None, tiers=scene.container.tiers is not None):
            continue
        for key, value in says[part].items():
            yield f"{part}.{key}", getattr(getattr(scene, part), key), value
    for index, phase in enumerate(scene.phases):
        for key, value in says.get(phase.kind, {}).items():
            yield f"phases.{index}.{key}", getattr(phase, key), value


def _told(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else "null" if value is None else str(value)
