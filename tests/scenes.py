"""What tests are about: small scenes, valid until a test breaks them, and the paper's smarticle."""

import copy
import math
from collections.abc import Mapping
from typing import Any

from dem.body.particle import Boxes, Particle, SphereChain
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

W, T1, T2, RHO = 0.0117, 1.27e-3, 0.5e-3, 7850.0  # the paper's smarticle
U = (90.0, 90.0)

SMALL: dict[str, Any] = {
    "schema_version": 1,
    "name": "small",
    "seed": 1,
    "count": 10,
    "fidelity": "draft",
    "phases": [
        {"type": "deposit", "per_layer": 5},
        {"type": "relax", "duration_s": 0.1},
        {"type": "shake", "duration_s": 0.2, "frequency_hz": 30, "peak_acceleration_g": 2},
    ],
}
"""Pour, rest, shake."""

CHAIN: dict[str, Any] = {
    "schema_version": 1,
    "seed": 3,
    "count": 6,
    "smarticle": {
        "middle_length_m": 0.0467,
        "aspect_ratio": 1.0,
        "thickness_normal_m": 0.021,
        "thickness_in_plane_m": 0.0095,
        "density_kg_per_m3": 1250,
    },
    "plane": {"width_m": 0.1},
    "contact": {"restitution": 0.92},
    "motor": {"law": "servo", "torque_limit_N_m": 0.05, "stiffness_N_m_per_rad": 0.1},
    "fidelity": {"diameter_m": 0.0095, "pitch": 0.1, "stiffness_N_per_m": 7000, "control_interval_s": 1e-4},
    "phases": [{"type": "arrange", "gap_m": 0.00105}, {"type": "strain", "distance_m": 0.1}],
    "recording": {"series_interval_s": 1e-3, "frame_interval_s": 0.1, "checkpoint_interval_s": None},
}
"""A chain in a plane, strained."""


def changed(data: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """A copy with `{"phases.1.duration_s": 2}` and the like put in."""
    copied = copy.deepcopy(dict(data))
    for key, value in copy.deepcopy(dict(changes)).items():
        here: Any = copied
        *parents, last = key.split(".")
        for part in parents:
            here = here[int(part)] if isinstance(here, list) else here.setdefault(part, {})
        if isinstance(here, list):
            here[int(last)] = value
        else:
            here[last] = value
    return copied


def small(changes: Mapping[str, Any] | None = None) -> Scene:
    """A small scene."""
    return parse_scene(changed(SMALL, changes or {}), source="scene.yaml")


def chain(changes: Mapping[str, Any] | None = None) -> Scene:
    """A chain."""
    return parse_scene(changed(CHAIN, changes or {}), source="chain.yaml")


def make_boxes(ratio: float = 0.7, angles: tuple[float, float] = U) -> Boxes:
    """The paper's smarticle with barbs of l/w and angles [deg]."""
    return Boxes(
        middle_length=W,
        barb_length=ratio * W,
        thickness_normal=T1,
        thickness_in_plane=T2,
        density=RHO,
        angles=(math.radians(angles[0]), math.radians(angles[1])),
    )


def make_particle(
    ratio: float = 0.7, angles: tuple[float, float] = U, *, rows: int = 1, diameter: float = 1.2e-3, pitch: float = 1.0
) -> Particle:
    """The same with its spheres, a pitch in diameters."""
    return Particle(make_boxes(ratio, angles), SphereChain(rows=rows, diameter=diameter, pitch=pitch * diameter))
