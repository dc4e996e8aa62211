"""Tiny scenes with every shape of body and every phase, run one after the other; prints a digest of what each wrote.

python every_body_and_phase.py [CASE …]
"""

import hashlib
import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dem.record.series import read_series
from dem.run.run import run_scene
from dem.scene.reading import parse_scene

D = {"diameter_m": 0.001}
HINGE = {
    "law": "motor",
    "torque_limit_N_m": 2e-4,
    "stiffness_N_m_per_rad": 1e-3,
    "damping_N_m_s_per_rad": 2e-7,
    "speed_limit_rad_per_s": 30,
}
ELASTIC = {"law": "elastic", "stiffness_N_m_per_rad": 1e-4, "damping_N_m_s_per_rad": 1e-8}
POUR = {"type": "deposit", "per_layer": 6, "settle": {"speed_m_per_s": 0.1, "hold_s": 0.01}}
SHAKE = {"type": "shake", "duration_s": 0.03, "frequency_hz": 60, "peak_acceleration_g": 2}
RELAX = {"type": "relax", "duration_s": 0.02}
LINES = "body,x [mm],y [mm],z [mm]\n"
ARC = [[0.3 + 6 * np.sin(0.2 * k), 6 * np.cos(0.2 * k), 4.0] for k in range(9)]

SHAPES: dict[str, Any] = {
    "rod": {"shape": "rod", "length_m": 0.012, "spread": 0.2, **D},
    "staple": {"shape": "staple", "crown_m": 0.0117, "leg_m": [0.008, 0.007], "angle_deg": [80, 100], "twist_deg": 20},
    "z": {"shape": "z", "middle_m": 0.01, "arm_m": 0.007, "angle_deg": 70},
    "s": {"shape": "s", "radius_m": 0.0035, "angle_deg": 200, **D},
    "hook": {"shape": "hook", "shank_m": 0.01, "radius_m": 0.003, "angle_deg": 200, **D},
    "c": {"shape": "c", "radius_m": 0.005, **D},
    "ring": {"shape": "ring", "radius_m": 0.005, **D},
    "cross": {"shape": "cross", "arm_m": 0.007, "angle_deg": 70},
    "star": {"shape": "star", "arms": 4, "arm_m": 0.007, **D},
    "segments": {
        "shape": "segments",
        "points_m": [[0, 0, 0], [0.01, 0, 0], [0, 0.008, 0], [0.01, 0.006, 0], [0.01, 0, 0.007]],
        "pairs": [[0, 1], [0, 2], [1, 3], [1, 4]],
        **D,
    },
}
WORM = {
    "shape": "filament",
    "length_m": 0.03,
    "diameter_m": 0.0008,
    "segments": 8,
    "young_modulus_Pa": 5e4,
    "stretching_time_s": 1e-4,
    "bending_time_s": 2e-3,
    "curvature_per_m": 30,
    "poured_bend_deg": 200,
}
SNAKE = {
    "shape": "chain",
    "link_m": [0.006, 0.005, 0.005, 0.004],
    "diameter_m": 0.0015,
    "density_kg_per_m3": 2500,
    "joints": [
        HINGE | {"poured_deg": 25},
        HINGE | {"axes": 2, "poured_deg": [20, 10]},
        ELASTIC | {"axes": 3, "yield_N_m": 3e-5, "rest_angle_deg": [10, 5, 0]},
    ],
}
ROBOT = {
    "middle_length_m": 0.0467,
    "aspect_ratio": 1.0,
    "thickness_normal_m": 0.021,
    "thickness_in_plane_m": 0.0095,
    "density_kg_per_m3": 1250,
}
U3 = {"smarticle": {"aspect_ratio": 0.7}, "count": 8}
CASES: dict[str, dict[str, Any]] = {
    "smarticles, every gait": {
        **U3,
        "smarticle": {"aspect_ratio": 0.85, "angles_deg": [80, 95]},
        "recording": {"energy": True, "dissipation_interval_s": 2e-3},
        "phases": [
            POUR,
            {"type": "shape-change", "straight_deg": 10, "opening_s": 0.25, "closing_s": 0.25, "straight_hold_s": 0.01},
            {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 0.05},
            {
                "type": "actuate",
                "duration_s": 0.05,
                "barb_1": {"type": "sine", "centre_deg": 80, "amplitude_deg": 10, "frequency_hz": 5},
                "barb_2": {"type": "triangle", "centre_deg": 80, "amplitude_deg": 10, "speed_rad_per_s": 3},
                "offsets": "random",
            },
        ],
    },
    "smarticles, hooks": {
        **U3,
        "container": {"radius_m": 0.0176},
        "hooks": {"lower_height_m": 0.002, "upper_height_m": 0.004},
        "fidelity": {"base": "draft", "stiffness_N_per_m": 300},
        "phases": [POUR, {"type": "pull-hook", "distance_m": 0.001, "speed_m_per_s": 0.05, "force_limit_N": 0.15}],
    },
    "smarticles, tiers": {
        **U3,
        "container": {"tiers": [{"radius_m": 0.0234, "height_m": 0.008}, {"radius_m": 0.014, "height_m": 0.1}]},
        "phases": [POUR, {"type": "remove-container", "speed_m_per_s": 0.5, "duration_s": 0.06}],
    },
    "smarticles, standard": {
        **U3,
        "count": 4,
        "fidelity": "standard",
        "phases": [POUR, SHAKE, {"type": "relax", "duration_s": 0.1}],
    },
    "robots": {
        "smarticle": ROBOT,
        "count": 3,
        "plane": {"width_m": 0.1},
        "contact": {"restitution": 0.92},
        "motor": {"law": "servo", "torque_limit_N_m": 0.05, "stiffness_N_m_per_rad": 0.1, "strength_spread": 0.1},
        "fidelity": {"diameter_m": 0.0095, "pitch": 0.1, "stiffness_N_per_m": 7000, "control_interval_s": 1e-4},
        "phases": [
            {"type": "arrange", "gap_m": 0.00105},
            {"type": "strain", "speed_m_per_s": 0.4, "distance_m": 0.02, "tied_at": "axis", "string_length_m": 0.062},
        ],
    },
    "rigid bodies": {
        "particle": list(SHAPES.values()),
        "count": 20,
        "container": {"radius_m": 0.02},
        "phases": [
            {**POUR, "every_s": 0.03},
            SHAKE,
            {**SHAKE, "frequency_end_hz": 90, "peak_acceleration_end_g": 3, "ramp": "log"},
            {"type": "shake", "frequency_hz": 60, "peak_acceleration_g": 3, "taps": 2, "rest_s": 0.01},
            {"type": "compress", "strain": 0.05, "speed_m_per_s": 0.5},
            {"type": "tension", "bodies": [[0], [1]], "distance_m": 0.001, "speed_m_per_s": 0.1},
        ],
    },
    "filaments": {
        "particle": WORM,
        "liquid": {},
        "count": 5,
        "container": {"radius_m": 0.012},
        "fidelity": {"base": "draft", "stiffness_N_per_m": 10},
        "phases": [
            POUR,
            {
                "type": "wriggle",
                "duration_s": 0.1,
                "curvature_per_m": 150,
                "frequency_hz": 5,
                "wavelength_m": 0.06,
                "turns_between_reversals": 0.2,
            },
            {"type": "lift", "radius_m": 0.006, "distance_m": 0.001, "speed_m_per_s": 0.03, "duration_s": 0.05},
            {"type": "release"},
        ],
    },
    "chains": {
        "particle": SNAKE,
        "count": 5,
        "container": {"radius_m": 0.014},
        "phases": [
            POUR,
            {
                "type": "undulate",
                "duration_s": 0.1,
                "amplitude_deg": 50,
                "frequency_hz": 4,
                "turns_between_reversals": 0.2,
            },
            {"type": "lift", "radius_m": 0.01, "distance_m": 0.001, "speed_m_per_s": 0.03, "duration_s": 0.05},
            {"type": "release"},
        ],
    },
    "taken over": {**U3, "phases": [{"type": "take-over", "run": "smarticles, standard"}, RELAX], "count": 4},
    "placed filament": {
        "particle": {**WORM, "curvature_per_m": 0, "length_m": 6 * 1.6 * 1e-3 * np.sin(0.1) / 0.1},
        "count": 1,
        "fidelity": {"base": "draft", "stiffness_N_per_m": 10},
        "phases": [{"type": "place", "file": "arc.csv"}, RELAX],
    },
    "placed chain": {
        "particle": {
            "shape": "chain",
            "links": 8,
            "link_m": 12 * 1e-3 * np.sin(0.1),
            "diameter_m": 0.0008,
            "joints": [{"law": "free", "axes": axes} for axes in (1, 1, 2, 3, 3, 2, 1)],
        },
        "count": 1,
        "phases": [{"type": "place", "file": "arc.csv"}, RELAX],
    },
    "placed smarticle": {
        **U3,
        "count": 1,
        "phases": [{"type": "place", "file": "u.csv"}, RELAX],
    },
}
OTHER_ENGINES: dict[str, dict[str, Any]] = {
    "yade, smarticles": {
        **U3,
        "engine": "yade",
        "smarticle": {"aspect_ratio": 0.85, "angles_deg": [80, 95]},
        "phases": [POUR, SHAKE, {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 0.05}],
    },
    "yade, robots": {**CASES["robots"], "engine": "yade"},
    "yade, rigid bodies": {
        **CASES["rigid bodies"],
        "engine": "yade",
        "count": 8,
        "phases": [POUR, SHAKE],
    },
    "lammps, smarticles": {**U3, "engine": "lammps", "phases": [POUR, SHAKE]},
}
U_POINTS = [[-5.85, 8.19, 4], [-5.85, 0, 4], [5.85, 0, 4], [5.85, 8.19, 4]]
FILES = {"arc.csv": ARC, "u.csv": [[0.6 * x - 0.8 * y, 0.8 * x + 0.6 * y, z] for x, y, z in U_POINTS]}


def write_files(folder: Path) -> None:
    """Write the files that cases read."""
    for name, points in FILES.items():
        (folder / name).write_text(
            LINES + "".join(f"0,{x!r},{y!r},{z!r}\n" for x, y, z in (map(float, p) for p in points))
        )


def run_case(name: str, folder: Path) -> str:
    """Run a case into a folder of its name; a digest of its series and frames."""
    base = {"schema_version": 1, "name": "tiny", "seed": 11, "engine": "links", "fidelity": "draft"}
    recording = {"frame_interval_s": 0.02, "series_interval_s": 2e-3, "checkpoint_interval_s": None}
    case = base | (CASES | OTHER_ENGINES)[name]
    case["recording"] = recording | case.get("recording", {})
    digest = hashlib.sha256()
    run_scene(parse_scene(case, source=name, folder=folder), folder / name, command="")
    series = read_series(folder / name)
    for column in sorted(series.data):
        digest.update(column.encode() + np.ascontiguousarray(series[column]).tobytes())
    for frame in sorted((folder / name / "frames").glob("*.vtu")):
        digest.update(frame.read_bytes())
    return digest.hexdigest()


def main(names: Sequence[str]) -> Mapping[str, str]:
    """Run cases, all without names; their digests."""
    with tempfile.TemporaryDirectory() as folder:
        write_files(Path(folder))
        return {name: run_case(name, Path(folder)) for name in names or CASES}


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1:]), indent=1))
