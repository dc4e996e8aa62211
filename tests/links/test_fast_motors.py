"""Speeds that motors give to light barbs are no error; faster ones are."""

from pathlib import Path

import numpy as np
import pytest
from scenes import small

from dem.errors import RunError
from dem.record.run import open_run
from dem.run import build
from dem.run.run import run_scene
from dem.scene.scene import Scene

SWING = {"type": "sine", "centre_deg": 60, "amplitude_deg": 44, "frequency_hz": 25}


def light(**motor: float) -> Scene:
    """A light smarticle in weak gravity, which swings its barbs fast after the pour."""
    changes = {
        "engine": "links",
        "count": 1,
        "smarticle.density_kg_per_m3": 500,
        "gravity_m_per_s2": 0.05,
        "container.height_m": 0.06,
        "motor": {"speed_limit_rad_per_s": 150, "torque_limit_N_m": 1e-4, "stiffness_N_m_per_rad": 3e-3, **motor},
        "phases": [{"type": "deposit", "per_layer": 1}, {"type": "actuate", "barbs": SWING, "duration_s": 0.04}],
    }
    return small(changes)


def test_a_light_smarticle_that_swings_fast_ends_and_one_too_fast_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = light()
    run_scene(scene, tmp_path / "run", command="")
    # Without motors 0.387 m/s, five times the speed of a fall, would be the limit.
    fastest = np.max(open_run(tmp_path / "run").series["max_speed_m_per_s"])
    assert 0.387 < fastest < build.speed_by_motors(scene)
    monkeypatch.setattr(build, "speed_by_motors", lambda _: 0.0)
    with pytest.raises(RunError, match=r"a speed above 0\.387 m/s .*which nothing in this scene explains"):
        run_scene(scene, tmp_path / "stopped", command="")


def test_the_speed_of_a_shaft_that_springs_back_is_that_of_all_its_energy_in_one_barb() -> None:
    scene = light(stiffness_N_m_per_rad=3.0)
    turned = 150 * scene.fidelity.control_interval_s + 1e-4 / 3.0
    barb = scene.smarticle.boxes.link_masses[0]
    energy = 3.0 * turned**2 / 2
    expected = 150 * scene.smarticle.boxes.barb_length + (2 * energy / barb) ** 0.5
    assert build.speed_by_motors(scene) == pytest.approx(expected)
    assert build.build_watchdog(scene).speed == pytest.approx(build.SPEED_MARGIN * expected)
    assert build.build_watchdog(scene).way_out.startswith("damp the shafts")
    assert build.build_watchdog(light()).way_out.startswith("damp the shafts")
    assert build.build_watchdog(small()).way_out.startswith("lower fidelity")
    assert build.speed_by_motors(small()) == 0.0
