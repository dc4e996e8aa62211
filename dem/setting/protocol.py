"""Protocols: what the paper's text and its own code differ in, as keys of a scene.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023: the text states one set of
rules, the sources and run scripts in the public repository `wsavoie/SmarticleSim` (of January 2019) another. A protocol
fills in what a scene leaves open; what a scene says itself stands.

One difference is left to the scene: the code throws a layer down at 2 m/s every 15 ms (in a deposit, `every_s: 0.015`
and `thrown_at_m_per_s: 2`). Soft contacts of the named fidelities do not bear that, those of 4000 N/m do.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal

Protocol = Literal["text", "code"]

PROTOCOLS: Mapping[str, Mapping[str, Mapping[str, Any]]] = MappingProxyType(
    {
        "text": {
            "motor": {"law": "halt"},
            "contact": {"friction_smarticle": 0.4, "friction_wall": 0.4},
            "container": {"radius_m": 0.0234},
            "shake": {"moves": "container"},
        },
        "code": {
            "motor": {"law": "ease"},
            "contact": {"friction_smarticle": 0.2, "friction_wall": 0.2},
            "container": {"radius_m": 0.0224, "packing_radius_m": 0.0234},
            "shake": {"moves": "floor"},
        },
    }
)
"""What each protocol says, by part of the scene and by type of phase."""

PARTS = ("motor", "contact", "container")


def leaves_alone(part: str, *, plane: bool, tiers: bool) -> bool:
    """Whether a protocol says nothing of a part: a plane has no container, and a mould of tiers no one radius."""
    return part == "container" and (plane or tiers)


def with_protocol(data: Any) -> Any:
    """A scene's data with what its protocol says where it is silent itself.

    Args:
        data: As in a scene file, not yet validated; what is not as it should be is left for validation to refuse.
    """
    if not isinstance(data, Mapping) or not isinstance(data.get("protocol"), str):
        return data
    says = PROTOCOLS.get(data["protocol"])
    if says is None:
        return data
    filled = dict(data)
    for part in PARTS:
        given = data.get(part, {})
        if not isinstance(given, Mapping):
            continue
        if not leaves_alone(part, plane=data.get("plane") is not None, tiers=bool(given.get("tiers"))):
            filled[part] = {**says[part], **given}
    if isinstance(data.get("phases"), list | tuple):
        filled["phases"] = [_filled(phase, says) for phase in data["phases"]]
    return filled


def _filled(phase: Any, says: Mapping[str, Mapping[str, Any]]) -> Any:
    if not isinstance(phase, Mapping) or not isinstance(phase.get("type"), str):
        return phase
    return {**says.get(phase["type"], {}), **phase}
