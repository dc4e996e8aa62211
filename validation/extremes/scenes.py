"""Draw random scenes from the schema's ranges: extreme, but such that some physics is meant by them."""

from __future__ import annotations

from typing import Any

import numpy as np

SECONDS = 0.3  # of each phase after the pour


def draw_scene(number: int, engine: str = "links") -> dict[str, Any]:
    """Draw scene `number`; equal numbers give equal scenes.

    Args:
        number: also the scene's seed.
        engine: that computes it.

    Returns:
        Plain data of a scene file.
    """
    rng = np.random.default_rng([28, number])

    def span(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), 4)

    def decades(low: float, high: float) -> float:
        return float(f"{10 ** rng.uniform(np.log10(low), np.log10(high)):.4g}")

    w = decades(4e-3, 0.04)
    aspect = float(rng.choice([0.0, 2.0, span(0.05, 0.4), span(0.4, 1.0), span(1.0, 2.0)]))
    thickness = float(f"{w * span(0.03, 0.12):.4g}")
    reach = w * (0.5 + aspect)
    stiffness = {"base": "draft", "stiffness_N_per_m": decades(100, 2e4)}
    kind = int(rng.integers(4))
    scene: dict[str, Any] = {
        "schema_version": 1,
        "engine": engine,
        "name": f"extreme {number}",
        "seed": number,
        "count": int(rng.integers(2, 41)),
        "smarticle": {
            "middle_length_m": w,
            "aspect_ratio": aspect,
            "thickness_normal_m": thickness * (2 if kind == 3 else 1),
            "thickness_in_plane_m": thickness,
            "density_kg_per_m3": decades(1000, 20000),
        },
        "container": {
            "radius_m": float(f"{reach * span(1.2, 3.0):.4g}"),
            "height_m": float(f"{min(60 * reach, 0.9):.4g}"),
        },
        "contact": {
            "friction_smarticle": float(rng.choice([0.0, 10.0, span(0, 1)])),
            "friction_wall": float(rng.choice([0.0, 10.0, span(0, 1)])),
            "restitution": float(rng.choice([0.01, 1.0, span(0.05, 0.95)])),
        },
        "gravity_m_per_s2": float(rng.choice([9.81, decades(0.5, 200)])),
        "motor": {"law": str(rng.choice(["halt", "stall", "ease", "slip", "servo"])), "speed_limit_rad_per_s": 60.0},
        "fidelity": [stiffness, "draft", "standard", {"base": "standard", "rows": 2}][kind],
        "recording": {
            "frame_interval_s": 1e-3,
            "series_interval_s": 1e-3,
            "energy": True,
            "dissipation_interval_s": 2e-4,
            "checkpoint_interval_s": None,
        },
    }
    phases: list[dict[str, Any]] = [
        {
            "type": "deposit",
            "per_layer": int(rng.integers(1, 21)),
            "layer_height_w": span(0.5, 4),
            "thrown_at_m_per_s": float(rng.choice([0.0, span(0, 10)])),
        }
    ]
    shake = {
        "type": "shake",
        "duration_s": SECONDS,
        "frequency_hz": decades(5, 200),
        "peak_acceleration_g": span(0, 10),
    }
    change = {"type": "shape-change", "opening_s": span(0.02, 0.15), "closing_s": span(0.02, 0.15)}
    swing = {"type": "internal-oscillation", "theta_deg": span(1, 60), "duration_s": SECONDS}
    sine = {
        "type": "actuate",
        "barbs": {"type": "sine", "centre_deg": 90, "amplitude_deg": span(1, 60), "frequency_hz": decades(1, 40)},
        "duration_s": SECONDS,
    }
    pull = {"type": "pull-hook", "distance_m": float(f"{SECONDS * w * 4:.4g}"), "speed_m_per_s": float(f"{4 * w:.4g}")}
    chosen = int(rng.choice([0, 1, 1, 5] if aspect == 0 else 6))
    if chosen == 5:
        scene["hooks"] = {} if rng.random() < 0.5 else {"length_m": float(f"{w * span(0.5, 3):.4g}")}
        phases += [{"type": "relax", "duration_s": 0.05}, pull]
    else:
        phases.append([{"type": "relax", "duration_s": SECONDS}, shake, change, swing, sine][chosen])
    return {**scene, "phases": phases}
