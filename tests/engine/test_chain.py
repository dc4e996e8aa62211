"""Chains in a plane: servos hold at their limit, strings and walls account for all momentum, checkpoints keep both."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cases
import chain_cases
import numpy as np
import pytest
from processes import series
from scenes import CHAIN, changed

Simulate = Callable[..., dict[str, Any]]
STIFFNESS, LIMIT = 0.1, 0.05  # N m/rad, N m


def chain(**changes: Any) -> dict[str, Any]:
    """Plain data of a chain of robots; keys are those of the scene, `motor` and others are merged."""
    data = changed(
        CHAIN,
        {
            "count": 2,
            "plane.width_m": 0.0895,
            "contact.friction_smarticle": 0.3,
            "contact.friction_wall": 0.3,
            "motor": {
                "law": "servo",
                "torque_limit_N_m": LIMIT,
                "stiffness_N_m_per_rad": STIFFNESS,
                "damping_N_m_s_per_rad": 1e-3,
            },
            "fidelity.pitch": 0.2,
            "phases.1": {"type": "strain", "speed_m_per_s": 0.05, "distance_m": 0.02, "tied_at": "axis"},
        },
    )
    for key, value in changes.items():
        data[key] = {**data[key], **value} if isinstance(value, dict) else value
    return data


def run(simulate: Simulate, data: dict[str, Any], out: Path) -> dict[str, np.ndarray]:
    """A whole run; its series."""
    assert simulate(cases.run, data, str(out))["error"] is None
    return series(out)


def test_a_servo_yields_like_a_damped_spring_and_then_holds_at_its_limit(simulate: Simulate) -> None:
    low, high, beyond = simulate(
        chain_cases.pulled_apart, chain(plane={"width_m": None}), speed=0.05, moments=[0.2, 0.3, 0.62]
    )
    for found in (low, high):
        expected = STIFFNESS * found["opened"] + 1e-3 * found["rate"]
        # The inertia of barbs that speed up is the rest. Nothing would be zero, and no damping 4 % to 8 % less.
        assert found["torque"] == pytest.approx(expected, rel=0.01)
    assert 0.05 < low["opened"] < high["opened"] < LIMIT / STIFFNESS
    assert beyond["opened"] > 1.2 * LIMIT / STIFFNESS
    assert beyond["torque"] == pytest.approx(LIMIT, rel=0.01)
    assert max(found["asymmetry"] for found in (low, high, beyond)) < 1e-6


def test_strings_and_walls_account_for_all_momentum(simulate: Simulate, tmp_path: Path) -> None:
    # Walls that the chain soon leans on, since it turns and widens a little.
    data = chain(plane={"width_m": 0.0624})
    data["phases"][1]["tied_at"] = "tip"
    found = run(simulate, data, tmp_path / "run")
    walls = found["channel_lower_force_N"] + found["channel_upper_force_N"]
    known = np.isfinite(walls[:, 0])
    balance = found["container_force_N"][known, :2] - walls[known, :2]
    assert np.abs(balance).max() < 1e-9
    # The walls push inwards and rub, or this would prove nothing.
    assert found["channel_lower_force_N"][known, 1].min() < -0.05
    assert found["channel_upper_force_N"][known, 1].max() > 0.05
    assert np.abs(walls[known, 0]).max() > 0.01
    # At rest but for the pull, the strings' forces differ by the friction of the walls; means over 20 ms.
    last = slice(-20, None)
    pulls = (found["string_fixed_force_N"] + found["string_pulled_force_N"])[last, 0].mean()
    assert pulls == pytest.approx(walls[last, 0].mean(), abs=0.01)
    # The table carries the weight.
    weight = 2 * 1250 * 0.021 * 0.0095 * 3 * 0.0467 * 9.81
    assert found["container_force_N"][known, 2] == pytest.approx(-weight)


def test_strings_and_servos_go_on_from_a_checkpoint(simulate: Simulate, tmp_path: Path) -> None:
    data = chain()
    data["phases"][1]["distance_m"] = 0.01
    whole = run(simulate, data, tmp_path / "whole")
    data["recording"]["checkpoint_interval_s"] = 0.05
    loaded = run(simulate, data, tmp_path / "loaded")
    forces = [found["string_pulled_force_N"][5:, 0] for found in (whole, loaded)]
    # Contacts are added up in another order after a checkpoint, and no more than that.
    assert forces[0].max() > 0.1
    assert forces[1] == pytest.approx(forces[0], abs=1e-6)
