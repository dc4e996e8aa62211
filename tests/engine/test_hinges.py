"""Hinges: what a smarticle of three links and two hinges keeps and survives; loads: see `test_verification.py`."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import articulated_cases
import hinge_cases
import numpy as np
import pytest

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]
VELOCITY, SPIN = (0.1, -0.2, 0.3), (20.0, 35.0, -15.0)
STRONG = 1.0  # N m; a limit that no torque here comes near


@pytest.fixture
def data(scene_data: SceneData) -> SceneData:
    """Plain data of a scene whose smarticles have hinges."""
    phases = [{"type": "deposit"}, {"type": "shape-change"}]
    return lambda changes=None: scene_data({"phases": phases, **(changes or {})})


def shape(aspect_ratio: float, fidelity: str = "draft", angles: Any = (90, 90), **motor: Any) -> dict[str, Any]:
    changes = {
        "smarticle.aspect_ratio": aspect_ratio,
        "smarticle.angles_deg": list(angles),
        "fidelity": fidelity,
    }
    return {**changes, **{f"motor.{key}": value for key, value in motor.items()}}


# -- a free smarticle --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "spin", "straight_in"),
    [
        (shape(1.0), (0, 0, 0), 0.6),  # faster, the vibration on the shafts halts the motors
        (shape(0.7, "standard", angles=(90, 20)), SPIN, 0.4),
    ],
)
def test_free_gait_keeps_momentum_and_its_hinges_together(
    simulate: Simulate, data: SceneData, changes: dict[str, Any], spin: Any, straight_in: float
) -> None:
    velocity = VELOCITY if any(spin) else (0, 0, 0)
    gait = simulate(hinge_cases.gait, data(changes), straight_in=straight_in, velocity=velocity, spin=spin)
    # Internal forces come in pairs at one point: nothing is left but rounding.
    assert gait["momentum"].max() < 1e-9 * gait["links_momentum"].max()
    assert gait["angular"].max() < 1e-9 * gait["links_angular"].max()
    assert gait["gap"].max() < 0.01
    assert gait["error"].max() < 0.01
    # It did move: a barb at π/2 / straight_in has at least this speed of its centre against the rest.
    assert np.ptp(gait["energy"]) > 1e-9
    assert np.abs(gait["angles"]).max() < 0.01


@pytest.mark.parametrize(("fidelity", "aspect_ratio"), [("draft", 1.0), ("standard", 0.4), ("reference", 0.7)])
def test_links_of_one_smarticle_never_touch(
    simulate: Simulate, data: SceneData, fidelity: str, aspect_ratio: float
) -> None:
    corners = [(105, 105), (-15, 105), (-15, -15), (105, -15), (90, 90)]
    changes = shape(aspect_ratio, fidelity, torque_limit_N_m=STRONG, speed_limit_rad_per_s=20.0)
    sweep = simulate(hinge_cases.sweep, data(changes), corners=corners, speed=20.0)
    assert sweep["touching"] == 0
    # The whole range was gone through, and a little more: barbs overshoot on their shafts.
    assert sweep["angles"].max(axis=0) == pytest.approx([106.5, 106.5], abs=1.6)
    assert sweep["angles"].min(axis=0) == pytest.approx([-16.5, -16.5], abs=1.6)
    assert sweep["gap"] < 0.01


# -- the stable time step ----------------------------------------------------------------------------------------------

STACKS = [(1.0, "draft"), (0.4, "standard")]


@pytest.mark.parametrize(("aspect_ratio", "fidelity"), STACKS)
def test_stack_is_quiet_below_the_stable_step(
    simulate: Simulate, data: SceneData, aspect_ratio: float, fidelity: str
) -> None:
    case = hinge_cases.stack
    stack = simulate(case, data(shape(aspect_ratio, fidelity)), layers=6, times_stable=0.9, settle=0.35, watch=0.02)
    expected = (np.arange(6) + 0.5) * stack["thick"]
    assert stack["z"] == pytest.approx(expected, abs=0.2 * stack["thick"])  # still stacked: this is what is tested
    # As for welded smarticles (test_contact.py): they chatter at some mm/s where the step is too large.
    assert stack["fastest"] < 1e-4
    assert stack["gap"] < 0.01


# -- checkpoints -------------------------------------------------------------------------------------------------------


def test_motors_know_their_barbs_after_a_reload(simulate: Simulate, data: SceneData, tmp_path: Path) -> None:
    # YADE does not save the twist of a bond: read from it, every barb would be where it was at first, 30° away.
    angle = math.radians(60)
    found = simulate(articulated_cases.reloaded, data(shape(0.7)), angle=angle, spin=SPIN, folder=str(tmp_path))
    for before, after in zip(found["saved"], found["loaded"], strict=True):
        assert np.array_equal(before, after)
    assert found["loaded"][0] == pytest.approx(np.full((1, 2), angle), abs=0.01)
    assert found["state"] == pytest.approx(found["loaded"][0], abs=1e-3)
    # The look that follows twists the shafts for where the barbs are: 3e-3 N m/rad, a hundredth of a radian at most.
    assert np.abs(found["looked"]).max() < 3e-5
