"""Scenes of few smarticles: pour, and what is given."""

from __future__ import annotations

from typing import Any

from validation.engines import EngineAccess

RELAX = {"type": "relax", "duration_s": 0.05}
REST = {"type": "relax", "duration_s": 0.3}  # for what was moved just before to stand or fall


def scene(
    access: EngineAccess, *phases: dict[str, Any], count: int = 6, per_layer: int = 6, seed: int = 1, **keys: Any
) -> dict[str, Any]:
    """Plain data of a scene, draft unless said otherwise."""
    return {
        "schema_version": 1,
        "engine": access.name,
        "name": "hard",
        "seed": seed,
        "count": count,
        "fidelity": "draft",
        "phases": [{"type": "deposit", "per_layer": per_layer}, *phases],
        **keys,
    }


def shape_change(seconds: float, hold: float = 0.0) -> dict[str, Any]:
    """Straighten within `seconds` [s], stay so, and bend back within as many."""
    return {"type": "shape-change", "opening_s": seconds, "straight_hold_s": hold, "closing_s": seconds}


def turn(degrees: float, seconds: float) -> dict[str, Any]:
    """Turn both barbs to an angle [deg] within a time [s]."""
    return {"type": "actuate", "barbs": {"type": "ramp", "to_deg": degrees, "duration_s": seconds}}


def swing(seconds: float) -> dict[str, Any]:
    """Swing both barbs by 10° to either side of 80°."""
    barbs = {"type": "triangle", "centre_deg": 80, "amplitude_deg": 10, "speed_rad_per_s": 5}
    return {"type": "actuate", "barbs": barbs, "duration_s": seconds}
