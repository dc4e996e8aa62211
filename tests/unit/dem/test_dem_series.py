"""Time series: units on every dataset, and a force on the container that is exact, from a made-up engine."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest

from dem.body.particle import Boxes
from dem.body.state import State
from dem.record.series import SeriesWriter, packing_fraction

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


def make_writer(folder: Path) -> SeriesWriter:
    return SeriesWriter(folder, RADIUS, {"scene_sha256": "abc", "seed": 7})


def read(folder: Path) -> dict[str, np.ndarray]:
    with h5py.File(folder / "series.h5") as file:
        return {name: dataset[()] for name, dataset in file.items()}


def test_every_dataset_has_unit_and_description_and_the_same_length(tmp_path: Path) -> None:
    writer, engine = make_writer(tmp_path), Double(2)
    for step in range(4):
        engine.time = 0.004 * step
        writer.sample(engine, make_state([0.01, 0.02]), 1)
    writer.write()
    units = {
        "time_s": "s",
        "phase": "1",
        "count": "1",
        "container_z_m": "m",
        "container_velocity_m_per_s": "m/s",
        "container_force_N": "N",
        "com_height_m": "m",
        "kinetic_energy_J": "J",
        "max_speed_m_per_s": "m/s",
        "unbalanced_force": "1",
        "packing_fraction": "1",
    }
    with h5py.File(tmp_path / "series.h5") as file:
        assert {name: dataset.attrs["unit"] for name, dataset in file.items()} == units
        assert all(len(dataset.attrs["description"]) > 5 for dataset in file.values())
        assert {name: dataset.shape for name, dataset in file.items()} == {
            name: (4, 3) if name == "container_force_N" else (4,) for name in units
        }
        assert dict(file.attrs) == {"format": 1, "scene_sha256": "abc", "seed": 7}


def test_columns_hold_what_the_engine_says(tmp_path: Path) -> None:
    writer, engine = make_writer(tmp_path), Double(3, time=0.5, floor=-0.002, container_velocity=0.1)
    phi = writer.sample(engine, make_state([0.01, 0.03, 0.02], [[3, 0, 4], [0, 1, 0], [0, 0, 0]]), 2)
    writer.write()
    rows = read(tmp_path)
    assert rows["time_s"][0] == 0.5
    assert (rows["phase"][0], rows["count"][0]) == (2, 3)
    assert rows["container_z_m"][0] == -0.002
    assert rows["container_velocity_m_per_s"][0] == 0.1
    assert rows["com_height_m"][0] == pytest.approx(0.022)  # above the floor, which is at -2 mm
    assert rows["max_speed_m_per_s"][0] == pytest.approx(5)
    assert rows["kinetic_energy_J"][0] == pytest.approx(0.5 * BOXES.mass * 26)
    assert rows["unbalanced_force"][0] == 0.25
    assert rows["packing_fraction"][0] == phi
    assert phi == pytest.approx(3 * BOXES.volume / (math.pi * RADIUS**2 * 0.022))  # second-highest: 0.02 + 0.002


def test_packing_fraction_of_the_second_highest() -> None:
    heights = np.array([0.01, 0.04, 0.02, 0.03])
    assert packing_fraction(heights, solid_volume=1e-8, radius=0.02) == pytest.approx(4e-8 / (math.pi * 4e-4 * 0.03))
    assert math.isnan(packing_fraction(heights[:1], solid_volume=1e-8, radius=0.02))
    assert math.isnan(packing_fraction(np.zeros(0), solid_volume=1e-8, radius=0.02))
    assert math.isnan(packing_fraction(np.array([-1.0, -2.0]), solid_volume=1e-8, radius=0.02))


def force(writer: SeriesWriter) -> np.ndarray:
    return np.array(writer._rows["container_force_N"][-1])


def test_first_force_is_no_number(tmp_path: Path) -> None:
    writer = make_writer(tmp_path)
    writer.sample(Double(2), make_state([0.01, 0.02]), 0)
    assert np.isnan(force(writer)).all()


def test_force_at_rest_is_the_weight_downwards(tmp_path: Path) -> None:
    writer, engine = make_writer(tmp_path), Double(2)
    for engine.time in (0.0, 0.004):
        writer.sample(engine, make_state([0.01, 0.02]), 0)
    assert force(writer) == pytest.approx([0, 0, -2 * BOXES.mass * G], rel=1e-12)


def test_force_in_free_fall_is_zero(tmp_path: Path) -> None:
    writer, engine = make_writer(tmp_path), Double(2)
    for engine.time in (0.1, 0.104):
        falling = [[0.2, 0, -G * engine.time]] * 2
        writer.sample(engine, make_state([0.01, 0.02], falling), 0)
    assert np.abs(force(writer)).max() < 1e-12 * BOXES.mass * G * 100


def test_force_of_an_impact_is_its_momentum(tmp_path: Path) -> None:
    # A known push F on one smarticle for a known time: the container feels -F, beside the weight that the push carries.
    writer, engine, push = make_writer(tmp_path), Double(1), np.array([0.3, -0.2, 0.5])
    velocity = np.array([0.1, 0.2, -0.4])
    for engine.time in (0.0, 0.004):
        gained = (push / BOXES.mass + [0, 0, -G]) * engine.time
        writer.sample(engine, make_state([0.01], [list(velocity + gained)]), 0)
    assert force(writer) == pytest.approx(-push, rel=1e-9)


def test_writing_twice_replaces_the_file(tmp_path: Path) -> None:
    writer, engine = make_writer(tmp_path), Double(2)
    for step in range(3):
        engine.time = step * 0.004
        writer.sample(engine, make_state([0.01, 0.02]), 0)
        writer.write()
    assert read(tmp_path)["time_s"] == pytest.approx([0, 0.004, 0.008])
    assert [path.name for path in tmp_path.iterdir()] == ["series.h5"]
