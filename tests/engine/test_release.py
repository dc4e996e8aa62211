"""The container's wall taken away: no contact stays, no energy appears, and lifting it drags by friction."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import boundary_cases
import cases
import numpy as np
import pytest
from run_files import series

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]


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


@pytest.mark.parametrize("speed", [None, 0.3])
def test_the_account_of_energy_closes_while_a_mould_goes(
    simulate: Simulate, scene_data: SceneData, tmp_path: Path, speed: float | None
) -> None:
    # Taken away at once, a mould's steps hold back nothing more and give nothing; lifted, it pushes and rubs: the pile
    # then does not keep its energy, but what it gets is the wall's work.
    tiers = [{"radius_m": 0.018, "height_m": 0.006}, {"radius_m": 0.0125, "height_m": 0.15}]
    data = scene_data({"count": 20, "container": {"tiers": tiers}})
    data["recording"] = {"series_interval_s": 0.002, "dissipation_interval_s": 3e-4}
    data["phases"] = [
        {"type": "deposit"},
        {"type": "remove-container", "duration_s": 0.25, "speed_m_per_s": speed},
    ]
    answer = simulate(cases.run, data, str(tmp_path / "run"))
    assert answer["error"] is None, answer
    found = series(tmp_path / "run")
    freed = found["phase"] == 1
    start = int(np.flatnonzero(freed)[0]) - 1
    gained = {
        name: found[f"{name}_J"][freed] - found[f"{name}_J"][start]
        for name in ("container_work", "dissipated_energy", "energy_residual", "gravitational_energy")
    }
    work, dissipated = gained["container_work"], gained["dissipated_energy"]
    # Sampled dissipation misses a few thousandths of itself; without the wall's work a third would be missing.
    assert np.abs(gained["energy_residual"]).max() < 0.02 * dissipated[-1]
    # The pile slumps: with the mould still there it would lose nothing.
    assert dissipated[-1] > 0.03 * found["gravitational_energy_J"][start]
    if speed is None:
        assert work[-1] == 0
        assert -gained["gravitational_energy"][-1] == pytest.approx(dissipated[-1], rel=0.05)
    else:
        assert work[-1] > 0.1 * dissipated[-1]
