"""Protocols: in what the paper's text and its own code differ, as keys of a scene.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023: the text states one set of
rules, the sources and run scripts in the public repository `wsavoie/SmarticleSim` (of January 2019) another. A protocol
fills in what a scene leaves open; keys of the scene itself have priority.

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
    """Return whether a protocol leaves a part alone: a plane has no container, a mould of tiers has several radii."""
    return part == "container" and (plane or tiers)


def with_protocol(data: Any) -> Any:
    """Fill a scene's data, not yet validated, with the keys of its protocol that it leaves open."""
    says = PROTOCOLS.get(str(data.get("protocol"))) if isinstance(data, Mapping) else None
    if says is None:
        return data
    filled = dict(data)
    for part in PARTS:
        given = data.get(part, {})
        if isinstance(given, Mapping) and not leaves_alone(
            part, plane=data.get("plane") is not None, tiers=bool(given.get("tiers"))
        ):
            filled[part] = {**says[part], **given}
    if isinstance(data.get("phases"), list | tuple):
        filled["phases"] = [
            {**says.get(str(phase.get("type")), {}), **phase} if isinstance(phase, Mapping) else phase
            for phase in data["phases"]
        ]
    return filled
