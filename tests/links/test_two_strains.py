"""A chain that is strained twice: each phase has its own forces, from its first sample on, and its own row."""

from pathlib import Path

import numpy as np
import pytest

from dem.record.run import Run
from dem.run.run import run_scene
from dem.scene.reading import parse_scene
from postprocess import summarise_run
from postprocess.measures.strain import AT_PEAK, PEAK

SCENE = {
    "schema_version": 2,
    "engine": "links",
    "seed": 1,
    "count": 2,
    "smarticle": {
        "middle_length_m": 0.0467,
        "aspect_ratio": 1.0,
        "thickness_normal_m": 0.021,
        "thickness_in_plane_m": 0.0095,
        "density_kg_per_m3": 1250,
    },
    "plane": {"width_m": 0.083},
    "motor": {"law": "servo", "torque_limit_N_m": 0.05, "stiffness_N_m_per_rad": 0.1, "damping_N_m_s_per_rad": 1e-3},
    "fidelity": {"base": "standard", "diameter_m": 0.0095, "stiffness_N_per_m": 7000, "control_interval_s": 1e-4},
    "phases": [
        {"type": "arrange", "gap_m": 0.00105},
        {"type": "strain", "speed_m_per_s": 0.04, "distance_m": 0.006, "tied_at": "axis"},
        {"type": "strain", "speed_m_per_s": 0.04, "distance_m": 0.006, "tied_at": "tip"},
    ],
    "recording": {"frame_interval_s": 0.05, "series_interval_s": 0.001, "checkpoint_interval_s": None},
}


def test_each_strain_of_a_chain_is_measured_by_itself(tmp_path: Path) -> None:
    run_scene(parse_scene(SCENE, source="test"), tmp_path / "run", command="test")
    run = Run(tmp_path / "run")
    series, table = run.series, summarise_run(run).set_index("phase")
    force, length = series["string_pulled_force_N"][:, 0], series["chain_length_m"]
    for phase in (1, 2):
        there = series["phase"] == phase
        first = force[there][0]
        assert 0 <= first < 1  # the strings tear at nothing when they are tied, and the walls touch nothing
        assert abs(series["container_force_N"][there, 0][0]) < 1e-9
        assert table[PEAK][phase] == pytest.approx(force[there].max())
        peak = np.argmax(force[there])
        assert table[AT_PEAK][phase] == pytest.approx(length[there][peak] / length[there][0] - 1)
    assert table[PEAK][1] != table[PEAK][2]
