"""Splitting a smarticle into hinged links and welding it again: nothing is lost but what must be."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import articulated_cases
import cases
import h5py
import numpy as np
import pytest

pytestmark = pytest.mark.engine

Simulate = Callable[..., dict[str, Any]]
SceneData = Callable[..., dict[str, Any]]
ROUNDING = 1e-13  # relative; sums of a dozen terms, in which double precision leaves 1e-15
VELOCITY, SPIN = (0.1, -0.2, 0.3), (20.0, 35.0, -15.0)
ACTUATED = [{"type": "deposit"}, {"type": "shape-change"}]

SHAPES = [
    (0.4, [90, 90], "draft"),
    (0.7, [90, 90], "standard"),
    (0.7, [20, 100], "draft"),
    (0.7, [90, -15], "reference"),
    (1.0, [0, 0], "draft"),
]


@pytest.fixture
def data(scene_data: SceneData) -> SceneData:
    """Plain data of a scene whose smarticles have hinges."""
    return lambda changes=None: scene_data({"phases": ACTUATED, **(changes or {})})


def apart(first: np.ndarray, second: np.ndarray) -> float:
    """Largest difference over the length of a vector."""
    return float(np.abs(first - second).max() / np.linalg.norm(second))


@pytest.mark.parametrize(("aspect_ratio", "angles", "fidelity"), SHAPES)
def test_splitting_and_welding_in_flight_change_nothing(
    simulate: Simulate, data: SceneData, aspect_ratio: float, angles: list[float], fidelity: str
) -> None:
    changes = {"smarticle.aspect_ratio": aspect_ratio, "smarticle.angles_deg": angles, "fidelity": fidelity}
    case = articulated_cases.split_and_weld
    done = simulate(case, data(changes), velocity=VELOCITY, spin=SPIN, steps=40)
    before = done["before"]
    assert np.degrees(before["angles"]) == pytest.approx(np.array([angles]), abs=1e-9)
    for stage in ("split", "welded", "again"):
        now = done[stage]
        assert apart(now["p"], before["p"]) < ROUNDING
        assert apart(now["l"], before["l"]) < ROUNDING
        # No link moves against another, so welding has nothing to take.
        assert now["e"] == pytest.approx(before["e"], rel=ROUNDING)
        assert now["e_state"] == pytest.approx(now["e"], rel=ROUNDING)
        for places in ("spheres", "vertices"):
            assert now[places] == pytest.approx(before[places], abs=1e-15)
        assert now["angles"] == pytest.approx(before["angles"], abs=1e-12)
        # Contact laws read the spheres' velocities. A spin that YADE stores belongs to half a step ago: ω dt of it.
        late = np.linalg.norm(SPIN) * done["dt"] * np.linalg.norm(SPIN) * done["size"]
        assert now["sphere_velocities"] == pytest.approx(before["sphere_velocities"], abs=late)
    assert abs(done["loss"]) < ROUNDING * before["e"]
    boxes = cases.scene_of(data(changes)).smarticle.boxes
    assert done["moments"] == pytest.approx(np.sort(boxes.inertia), rel=1e-12)


@pytest.mark.parametrize(
    ("aspect_ratio", "angles", "spin"),
    [(0.7, [90, 90], (0, 0, 0)), (1.0, [90, 20], SPIN), (0.4, [0, 40], (10, -5, 30))],
)
def test_welding_takes_the_energy_of_relative_motion_and_nothing_else(
    simulate: Simulate, data: SceneData, aspect_ratio: float, angles: list[float], spin: Any
) -> None:
    changes = {"smarticle.aspect_ratio": aspect_ratio, "smarticle.angles_deg": angles}
    case = articulated_cases.weld_in_motion
    done = simulate(case, data(changes), targets_deg=(40, 70), spin=spin, time=0.16)
    before, after = done["before"], done["after"]
    # The barbs were on the move: else there were nothing to lose.
    assert done["relative"] > 1e-7 * before["e"]
    assert apart(after["p"], before["p"]) < ROUNDING
    assert apart(after["l"], before["l"]) < ROUNDING
    assert after["spheres"] == pytest.approx(before["spheres"], abs=1e-15)
    assert after["angles"] == pytest.approx(before["angles"], abs=1e-12)
    assert before["e"] - after["e"] == pytest.approx(done["relative"], abs=1e-13 * before["e"])
    # What is returned is told by YADE's angular velocities, which lag its angular momenta by half a step of free spin:
    # a relative ω dt, of which the energy of a rotation that hardly turns its axis keeps the square.
    assert done["loss"] == pytest.approx(done["relative"], abs=2e-7 * before["e"])
    # The inertia of the boxes at these angles, but for hinges that are open by the gap.
    assert np.degrees(after["angles"][0]) == pytest.approx([40, 70], abs=0.5)
    lever = cases.scene_of(data(changes)).smarticle.boxes.lengths.min() / 2
    assert done["tensor"] == pytest.approx(done["exact"], rel=4 * done["gap"] / lever + 1e-12)
    assert done["mass"] == pytest.approx(done["exact_mass"], rel=1e-12)
    # Spheres have the velocities of one body, for the contact laws of the next step; they had those of three.
    fastest = np.abs(done["field"]).max()
    assert after["sphere_velocities"] == pytest.approx(done["field"], abs=1e-9 * fastest)
    assert np.abs(before["sphere_velocities"] - done["field"]).max() > 1e-3 * fastest
    # And it stays as it was welded.
    assert done["later"]["angles"] == pytest.approx(after["angles"], abs=1e-12)
    assert apart(done["later"]["l"], before["l"]) < ROUNDING * 200


@pytest.fixture(scope="module")
def piles(worker: Any) -> dict[str, dict[str, Any]]:
    """The same pile left alone, split; split and left alone, split and welded."""
    data = {"schema_version": 1, "seed": 1, "count": 6, "fidelity": "draft", "phases": ACTUATED}
    return {
        change: worker.submit(articulated_cases.resting_pile, data, count=6, settle=0.8, change=change).result(300)
        for change in ("none", "split", "split-rest", "weld")
    }


@pytest.mark.parametrize(("change", "answer", "tolerance"), [("split", "none", 1e-5), ("weld", "split-rest", 5e-3)])
def test_contacts_survive(piles: dict[str, dict[str, Any]], change: str, answer: str, tolerance: float) -> None:
    changed, alone = piles[change], piles[answer]
    assert len(changed["before"]) > 20
    assert changed["kept"].keys() == changed["before"].keys()
    for pair, force in changed["before"].items():
        assert (changed["kept"][pair] == force).all()
    # One step later, against the pile that was left alone. A split pile is at rest, nearly; barbs of the pile that is
    # welded still quiver on their shafts, by parts in a thousand of the weight, until they are welded.
    assert changed["after"].keys() == alone["after"].keys()
    for pair, force in alone["after"].items():
        assert changed["after"][pair] == pytest.approx(force, abs=tolerance * changed["weight"])
    assert max(np.abs(force).max() for force in alone["after"].values()) > 0.2 * changed["weight"]
    assert changed["moved"] < 1e-15


@pytest.mark.parametrize("change", ["split", "weld"])
def test_a_pile_neither_jumps_nor_keeps_anything_stale(piles: dict[str, dict[str, Any]], change: str) -> None:
    pile = piles[change]
    assert pile["energy"][1] < pile["energy"][0] * (1 + 1e-9)
    # Barbs sag on their shafts when motors take them over, and the pile gives way a little: a thousandth of a diameter.
    assert pile["later"].max() < 1e-3 * pile["scale"]
    assert pile["stale"] == 0
    assert pile["own"] == 0
    assert pile["bonds"] == (4 * 6 if change == "split" else 0)


# -- a whole scene -----------------------------------------------------------------------------------------------------

UNITS = {
    "commanded_angle_rad": "rad",
    "angle_rad": "rad",
    "schedule_error_rad": "rad",
    "tracking_error_rad": "rad",
    "motor_torque_N_m": "N m",
    "halted_fraction": "1",
    "motor_work_J": "J",
    "joint_gap_m": "m",
    "gravitational_energy_J": "J",
    "container_work_J": "J",
}


def test_a_scene_with_all_kinds_of_actuation_runs_through(
    simulate: Simulate, scene_data: SceneData, tmp_path: Path
) -> None:
    phases = [
        {"type": "deposit", "per_layer": 6},
        {"type": "relax", "duration_s": 0.05},
        {"type": "internal-oscillation", "theta_deg": 20, "duration_s": 0.1},
        {"type": "relax", "duration_s": 0.05},
        {"type": "shape-change", "opening_s": 0.3, "closing_s": 0.3},
        {"type": "relax", "duration_s": 0.05},
    ]
    data = scene_data({"count": 12, "phases": phases, "recording": {"energy": True}})
    series = []
    for name in ("first", "again"):
        answer = simulate(cases.run, data, str(tmp_path / name))
        assert answer["error"] is None, answer["text"]
        assert (tmp_path / name / "done.json").exists()
        with h5py.File(tmp_path / name / "series.h5") as file:
            series.append({key: dataset[()] for key, dataset in file.items()})
            units = {key: dataset.attrs["unit"] for key, dataset in file.items()}
    rows = series[0]
    assert {key: units[key] for key in UNITS} == UNITS
    for key, column in rows.items():
        assert column.tobytes() == series[1][key].tobytes(), key
    assert set(rows["phase"]) == set(range(6))
    # A sample is taken before the phase that begins at the same time has done anything.
    articulated = np.isin(rows["phase"], (2, 4))
    welded = np.isin(rows["phase"], (1, 3, 5))
    for key in ("kinetic_energy_J", "gravitational_energy_J", "motor_work_J", "joint_gap_m"):
        assert np.isfinite(rows[key]).all(), key
    for key in ("schedule_error_rad", "tracking_error_rad", "motor_torque_N_m", "halted_fraction"):
        assert np.isfinite(rows[key][articulated]).all(), key
        assert np.isnan(rows[key][welded]).mean() > 0.9, key
    halted = rows["halted_fraction"][articulated]
    assert halted.min() >= 0
    assert halted.max() <= 1
    # Draft's softer pin, in a pile: 1 % of a diameter.
    assert 0 < rows["joint_gap_m"].max() < 0.01 * cases.scene_of(data).sphere_diameter
    # All energy that the links ever have is less than what they fell through.
    assert rows["kinetic_energy_J"][rows["phase"] > 0].max() < 0.5 * rows["gravitational_energy_J"].max()
    # Where motors were halted they fell behind; told to hold the pace of the schedule they do not.
    behind = rows["schedule_error_rad"][articulated]
    assert behind[halted > 0].max() > np.radians(1)
    assert behind.min() < np.radians(0.2)
    # The barbs did straighten (most of them, most of the way) and come back, and that cost work.
    straight, last = rows["angle_rad"][rows["phase"] == 4].min(), rows["angle_rad"][-1]
    assert straight < np.radians(40)
    assert last == pytest.approx(np.full(2, np.pi / 2), abs=np.radians(15))
    assert np.diff(rows["motor_work_J"][rows["phase"] == 4][[0, -1]])[0] > 1e-5
