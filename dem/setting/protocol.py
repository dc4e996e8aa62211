"""Protocols: values of those scene keys for which the paper's text and the paper's own code differ.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023: the text states one set of
rules, the sources and run scripts in the public repository `wsavoie/SmarticleSim` (of January 2019) another. A protocol
fills in keys that a scene leaves open; keys that the scene gives have priority.

One difference is in no protocol: the code throws a layer down at 2 m/s every 15 ms (in a deposit, `every_s: 0.015` and
`thrown_at_m_per_s: 2`). Contacts of the named fidelities are too soft for such impacts; 4000 N/m are enough.
"""

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
"""Values by protocol, then by part of the scene or type of phase, then by key."""

PARTS = ("motor", "contact", "container")


def applies(part: str, *, plane: bool, tiers: bool) -> bool:
    """Return whether a protocol sets keys of a part of the scene.

    It sets no keys of the container if the scene has a plane or the container has tiers.
    """
    return part != "container" or not (plane or tiers)


def with_protocol(data: Any) -> Any:
    """Return a scene's unvalidated data, with values of its protocol for keys that are not given."""
    rules = PROTOCOLS.get(str(data.get("protocol"))) if isinstance(data, Mapping) else None
    if rules is None:
        return data
    filled = dict(data)
    plane = data.get("plane") is not None
    for part in PARTS:
        given = data.get(part, {})
        if isinstance(given, Mapping) and applies(part, plane=plane, tiers=bool(given.get("tiers"))):
            filled[part] = {**rules[part], **given}
    if isinstance(data.get("phases"), list | tuple):
        filled["phases"] = [
            {**rules.get(str(phase.get("type")), {}), **phase} if isinstance(phase, Mapping) else phase
            for phase in data["phases"]
        ]
    return filled
