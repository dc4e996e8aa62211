"""Hooks and the container's wall: forces, work, and a removal that leaves no contact and adds no energy."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import boundary_cases
import cases
import h5py
import numpy as np
import pytest
from processes import series

from dem.phases.phase import CHECK_INTERVAL

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]


def test_a_hook_reads_the_weight_that_hangs_on_it(simulate: Simulate, scene_data: SceneData) -> None:
    data = scene_data({"hooks": {"upper_height_m": 0.02}})
    hung = simulate(boundary_cases.hang, data, settle=0.3, pull=0.1)
    lower, upper = hung["rest"]
    assert hung["speed"] < 1e-6
    assert upper == pytest.approx([0, 0, -hung["weight"]], abs=5e-3 * hung["weight"])
    assert np.abs(lower).max() == 0
    # Raised at constant speed it reads as much, and what hangs on it comes along.
    assert hung["moving"][1] == pytest.approx([0, 0, -hung["weight"]], abs=5e-3 * hung["weight"])
    assert hung["raised"] == pytest.approx(hung["expected"], rel=1e-9)
    assert hung["carried"] == pytest.approx(hung["expected"], rel=5e-3)


def test_taps_and_cycles_of_a_sweep_end_where_they_began(simulate: Simulate, scene_data: SceneData) -> None:
    shake = {"type": "shake", "frequency_hz": 50, "peak_acceleration_g": 2}
    taps = {**shake, "taps": 2, "rest_s": 0.01}
    swept = {**shake, "duration_s": 0.2, "frequency_end_hz": 100}
    data = scene_data({"phases": [{"type": "deposit"}, taps, swept]})
    tapped = simulate(boundary_cases.tap_and_sweep, data, index=1)
    amplitude, dt = 2 * 9.81 / (2 * np.pi * 50) ** 2, tapped["time_step"]
    assert tapped["heights"].max() == pytest.approx(2 * amplitude, rel=1e-3)
    assert tapped["heights"].min() > -1e-9
    assert np.abs(np.diff(tapped["heights"])).max() / dt == pytest.approx(2 * 9.81 / (2 * np.pi * 50), rel=1e-3)
    assert abs(tapped["heights"][-1]) < 1e-8
    heights = simulate(boundary_cases.tap_and_sweep, data, index=2)["heights"]
    begins = np.flatnonzero((heights[:-1] <= 1e-9) & (heights[1:] > 1e-9)) * dt
    np.testing.assert_allclose(50 * begins + 250 * begins**2 / 2, np.arange(15), atol=0.01)
    assert abs(heights[-1]) < 1e-7


def test_the_pull_does_the_work_of_its_force(simulate: Simulate, scene_data: SceneData, tmp_path: Path) -> None:
    data = scene_data(
        {
            **{"seed": 2, "count": 12, "container.radius_m": 0.016, "recording.energy": True},
            "hooks": {"lower_height_m": 3e-3, "upper_height_m": 6e-3},
            "phases": [
                {"type": "deposit"},
                {"type": "shake", "duration_s": 0.11},
                {"type": "pull-hook", "speed_m_per_s": 0.1, "duration_s": 0.4},
            ],
        }
    )
    answer = simulate(cases.run, data, str(tmp_path / "run"))
    assert answer["error"] is None, answer
    with h5py.File(tmp_path / "run/series.h5") as file:
        units = [file[name].attrs["unit"] for name in ("hook_upper_force_N", "hook_lower_force_N", "hook_upper_z_m")]
    assert units == ["N", "N", "m"]
    pulled = series(tmp_path / "run")
    pull = np.flatnonzero(pulled["phase"] == 2)[1:]
    steps = np.diff(pulled["hook_upper_z_m"])[pull - 1]
    work = -(pulled["hook_upper_force_N"][pull, 2] * steps).sum()
    recorded = pulled["container_work_J"][pull[-1]] - pulled["container_work_J"][pull[0] - 1]
    assert recorded == pytest.approx(work, rel=5e-3)
    assert work > 0


def test_removing_the_wall_leaves_no_contact_and_adds_no_energy(simulate: Simulate, scene_data: SceneData) -> None:
    # A pile that leans on a narrow wall, and collapses beyond where it stood.
    gone = simulate(boundary_cases.remove, scene_data({"container.radius_m": 0.0135}), count=40, settle=0.6, watch=0.2)
    before, after, totals = gone["before"], gone["after"], gone["totals"]
    assert gone["contacts"] > 10
    assert (gone["stale"], gone["later"], gone["bodies"]) == (0, 0, 0)
    # At the moment itself nothing moves; only what the wall's own contacts had stored is lost.
    assert gone["moved"] == 0
    assert after["kinetic"] == before["kinetic"]
    assert after["height"] == before["height"]
    assert 0 < after["elastic"] < before["elastic"]
    # From then on energy is only lost.
    assert np.diff(totals).max() < 1e-4 * totals[0]
    assert totals[-1] < 0.95 * totals[0]
    assert gone["outside"] > 1.2 * 0.0135
    assert gone["lowest"] > 0


def test_a_wall_is_lifted_over_bars_that_stand_on_their_edge(simulate: Simulate, scene_data: SceneData) -> None:
    data = scene_data({"fidelity": "reference", "count": 1, "smarticle.thickness_normal_m": 3e-3})
    lifted = {"type": "remove-container", "duration_s": 0.6, "speed_m_per_s": 0.01}
    data |= {"phases": [{"type": "deposit"}, lifted], "container": {"radius_m": 0.012}}
    gone = simulate(boundary_cases.lift, data, [[0.0, 0.0, 1.5e-3]])
    assert not gone["walled"]
    assert gone["top"] == pytest.approx(3e-3, rel=1e-3)
    # Within the way between two checks; at the axis and a radius, 1.75 mm, links would still lean on the wall.
    assert gone["top"] < gone["bottom"] < gone["top"] + 0.01 * CHECK_INTERVAL * 1.01


def test_the_energy_ledger_closes_while_a_mould_is_lifted(
    simulate: Simulate, scene_data: SceneData, tmp_path: Path
) -> None:
    # The mould pushes and rubs: what the pile gains is the wall's work.
    tiers = [{"radius_m": 0.018, "height_m": 0.006}, {"radius_m": 0.0125, "height_m": 0.15}]
    data = scene_data({"count": 20, "container": {"tiers": tiers}})
    data["recording"] = {"series_interval_s": 0.002, "dissipation_interval_s": 3e-4}
    data["phases"] = [{"type": "deposit"}, {"type": "remove-container", "duration_s": 0.25, "speed_m_per_s": 0.3}]
    answer = simulate(cases.run, data, str(tmp_path / "run"))
    assert answer["error"] is None, answer
    found = series(tmp_path / "run")
    freed = found["phase"] == 1
    start = int(np.flatnonzero(freed)[0]) - 1
    gained = {
        name: found[f"{name}_J"][freed] - found[f"{name}_J"][start]
        for name in ("container_work", "dissipated_energy", "energy_residual")
    }
    work, dissipated = gained["container_work"], gained["dissipated_energy"]
    # Sampled dissipation misses a few thousandths of itself; without the wall's work a third would be missing.
    assert np.abs(gained["energy_residual"]).max() < 0.02 * dissipated[-1]
    # The pile slumps: with the mould still there it would lose nothing.
    assert dissipated[-1] > 0.03 * found["gravitational_energy_J"][start]
    assert work[-1] > 0.1 * dissipated[-1]
