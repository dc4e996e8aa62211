"""The floor shaken after its wall was taken away: it follows the sine, and what it gives and feels adds up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import base_cases
import cases
import h5py
import numpy as np
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]
F, G = 30.0, 9.81


def shaken(gamma: float) -> dict[str, Any]:
    return {"phases.2.peak_acceleration_g": gamma}


def test_the_floor_alone_follows_the_sine_to_second_order(simulate: Simulate, scene_data: SceneData) -> None:
    errors = []
    for refine in (1, 2):
        floor = simulate(base_cases.floor_motion, scene_data(), periods=5.3, refine=refine, rest=50)
        assert (floor["moved"], floor["bodies"], floor["crept"]) == (1, 0, 0)
        # It had been stopped in the middle of a stroke, and goes on from there.
        assert floor["start"] > 0.5 * floor["amplitude"]
        expected = floor["amplitude"] * np.sin(2 * np.pi * F * floor["time"])
        errors.append(np.abs(floor["z"] - expected).max() / floor["amplitude"])
        assert errors[-1] < (2 * np.pi * F * floor["dt"]) ** 2 / 10
    # A quarter of it at half the step; a position that were of first order would halve.
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


def test_what_is_carried_presses_with_its_weight_and_its_acceleration(
    simulate: Simulate, scene_data: SceneData
) -> None:
    # Γ = 0.5: it never leaves the floor, so F(t) = -m (g + z̈) = -m g (1 - Γ sin ωt), and the mean over periods is m g.
    carried = simulate(base_cases.carried, scene_data(shaken(0.5)), periods=4)
    weight, omega = carried["weight"], 2 * np.pi * F
    phase = omega * carried["time"]
    later = phase > 2 * np.pi  # the jerk of the start has died out
    expected = -weight * (1 - 0.5 * np.sin(phase))
    assert carried["force"][later] == pytest.approx(expected[later], abs=0.02 * weight)
    assert carried["force"][later].mean() == pytest.approx(-weight, rel=5e-3)
    # All that it gains is the floor's work: m g z and m v²/2 of what moves with the floor. Nothing rubs, nothing falls.
    # The account takes the velocity half a step late, which makes π Γ ω dt/2 of the swing per period: 1.4 % each.
    swing = weight * carried["amplitude"]
    assert np.ptp(carried["gained"]) > 1.9 * swing
    work, gained = (carried[name][later] - carried[name][later][0] for name in ("work", "gained"))
    assert work == pytest.approx(gained, abs=0.05 * swing)


def test_a_column_collapses_and_the_account_of_energies_closes(
    simulate: Simulate, scene_data: SceneData, tmp_path: Path
) -> None:
    data = scene_data({"count": 10, "container.radius_m": 0.0115})
    data["recording"] = {"dissipation_interval_s": 2e-4, "checkpoint_interval_s": 0.1}
    data["phases"] = [
        {"type": "deposit", "per_layer": 5},
        {"type": "remove-container", "duration_s": 0.05},
        {"type": "shake", "duration_s": 0.3, "peak_acceleration_g": 3},
        {"type": "relax", "duration_s": 0.2},
    ]
    answer = simulate(cases.run, data, str(tmp_path / "run"))
    assert answer["error"] is None, answer
    with h5py.File(tmp_path / "run" / "series.h5") as file:
        series = {name: dataset[()] for name, dataset in file.items()}
    before, after = (np.flatnonzero(series["phase"] == k)[-1] for k in (1, 2))
    work = series["container_work_J"][after] - series["container_work_J"][before]
    lost = series["dissipated_energy_J"][after] - series["dissipated_energy_J"][before]
    assert work > 0
    assert lost > 0.5 * work
    residual = series["energy_residual_J"]
    # 0.3 % of the work here: dissipation is sampled, every second step.
    assert abs(residual[after] - residual[before]) < 0.02 * work
    # What has rolled away is counted, not refused; heights are above the floor that is left.
    assert series["outside_count"][after] > 0
    assert series["com_height_m"][after] < 0.8 * series["com_height_m"][before]
    weight = 10 * 7850 * 1.27e-3 * 0.5e-3 * 0.0117 * 2.4 * G
    force = series["container_force_N"][series["phase"] == 3][-20:, 2]
    # Some may still roll or rock.
    assert force.mean() == pytest.approx(-weight, rel=0.05)
