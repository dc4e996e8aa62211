"""Rows of the series: what the engine says, and a force on the container that is exact, from a made-up engine."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dem.body.particle import Boxes
from dem.body.state import State
from dem.run.sampler import Sampler

RADIUS, G = 0.0234, 9.81
BOXES = Boxes(
    middle_length=0.0117, barb_length=0.00819, thickness_normal=1.27e-3, thickness_in_plane=0.5e-3, density=7850
)


@dataclass
class Double:
    """An engine that is told what to say."""

    count: int
    time: float = 0.0
    floor: float = 0.0
    container_velocity: float = 0.0
    unbalanced: float = 0.25
    particle: Any = field(default_factory=lambda: SimpleNamespace(boxes=BOXES))
    smarticle_seconds: float | None = None

    @property
    def gravity_impulse(self) -> float:
        seconds = self.count * self.time if self.smarticle_seconds is None else self.smarticle_seconds
        return BOXES.mass * G * seconds

    def unbalanced_force(self) -> float:
        return self.unbalanced


def make_state(heights: list[float], velocities: list[list[float]] | None = None) -> State:
    n = len(heights)
    positions = np.zeros((n, 3))
    positions[:, 2] = heights
    speeds = np.zeros((n, 3)) if velocities is None else np.array(velocities, dtype=float)
    return State.rigid(BOXES, positions, np.tile(np.eye(3), (n, 1, 1)), speeds, np.zeros((n, 3)))


def test_columns_hold_what_the_engine_says() -> None:
    engine = Double(3, time=0.5, floor=-0.002, container_velocity=0.1)
    row = Sampler(RADIUS).sample(engine, make_state([0.01, 0.03, 0.02], [[3, 0, 4], [0, 1, 0], [0, 0, 0]]), 2)
    assert list(row) == list(Sampler(RADIUS).described)
    assert row["time_s"] == 0.5
    assert (row["phase"], row["count"]) == (2, 3)
    assert row["container_z_m"] == -0.002
    assert row["container_velocity_m_per_s"] == 0.1
    assert row["com_height_m"] == pytest.approx(0.022)  # above the floor, which is at -2 mm
    assert row["max_speed_m_per_s"] == pytest.approx(5)
    assert row["kinetic_energy_J"] == pytest.approx(0.5 * BOXES.mass * 26)
    assert row["unbalanced_force"] == 0.25
    # The second-highest: 0.02 + 0.002.
    assert row["packing_fraction"] == pytest.approx(3 * BOXES.volume / (math.pi * RADIUS**2 * 0.022))


def forces(engine: Double, times: tuple[float, ...], state: Callable[[float], State]) -> list[np.ndarray]:
    sampler, found = Sampler(RADIUS), []
    for engine.time in times:
        found.append(sampler.sample(engine, state(engine.time), 0)["container_force_N"])
        sampler.restore(json.loads(json.dumps(sampler.memory)))  # as a run that goes on from here
    return found


def test_force_at_rest_is_the_weight_downwards_and_no_number_at_first() -> None:
    first, force = forces(Double(2), (0.0, 0.004), lambda _: make_state([0.01, 0.02]))
    assert np.isnan(first).all()
    assert force == pytest.approx([0, 0, -2 * BOXES.mass * G], rel=1e-12)


def test_force_in_free_fall_is_zero() -> None:
    def falling(time: float) -> State:
        return make_state([0.01, 0.02], [[0.2, 0, -G * time]] * 2)

    assert np.abs(forces(Double(2), (0.1, 0.104), falling)[1]).max() < 1e-12 * BOXES.mass * G * 100


def test_force_of_an_impact_is_its_momentum() -> None:
    # A known push F on one smarticle for a known time: the container feels -F, beside the weight that the push carries.
    push, velocity = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.2, -0.4])

    def pushed(time: float) -> State:
        return make_state([0.01], [list(velocity + (push / BOXES.mass + [0, 0, -G]) * time)])

    assert forces(Double(1), (0.0, 0.004), pushed)[1] == pytest.approx(-push, rel=1e-9)
