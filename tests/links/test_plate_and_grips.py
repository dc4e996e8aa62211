"""Plate, grips and shaking on links: forces and work against known answers, and the same bits after a checkpoint."""

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import builds
import numpy as np
import pytest
from scenes import small
from scipy.spatial.transform import Rotation
from stopping import assert_goes_on

from dem.engine.links.engine import LinksEngine
from dem.phases.shake import Shake
from dem.record.run import Run
from dem.record.series import Series, read_series
from dem.run.build import build_engine
from dem.run.run import run_scene
from dem.scene.scene import Scene
from postprocess.measures.registry import phase_measures
from postprocess.measures.table import summarise_run
from studies.calibration.measures import columns_of_scene

G, DT = 9.81, 2e-5
RADIUS, MASS = builds.DIAMETER / 2, builds.boxes(0.0).mass
ROD, STIFFNESS = builds.particle(aspect=0.0), builds.ELASTIC.normal_stiffness


def rods(positions: list[list[float]], turns: list[Rotation] | None = None, **more: Any) -> LinksEngine:
    """Elastic straight rods along x unless turned, without gravity unless given."""
    made = builds.engine(made_of=ROD, dt=DT, **{"law": builds.ELASTIC} | more)
    made.add(builds.at(positions, turns))
    return made


# -- plate -------------------------------------------------------------------------------------------------------------


def test_the_force_of_a_plate_on_elastic_contacts_is_stiffness_times_overlap() -> None:
    # A rod on the floor has two contacts with the floor and two with the plate, in series: kn in all.
    made = rods([[0, 0, RADIUS]])
    made.boundaries.place_plate(2 * RADIUS)
    assert made.boundaries.plate_height == 2 * RADIUS
    made.boundaries.move_plate(-1e-3)
    made.advance(round(0.01 / DT))
    before, work = made.boundaries.plate_sum, made.ledger.container_work
    made.advance(1)
    pressed = 2 * RADIUS - made.boundaries.plate_height
    assert pressed == pytest.approx(1e-5, rel=0.01)
    force = made.boundaries.plate_sum - before
    assert force[2] == pytest.approx(STIFFNESS * pressed, rel=0.03)
    assert np.abs(force[:2]).max() < 1e-9
    # All work is in the springs, kn/2 of the whole overlap squared, but for the oscillation of the rod.
    assert work == pytest.approx(made.ledger.elastic()[0] + made.state().kinetic_energy, rel=0.01)
    assert work == pytest.approx(STIFFNESS * pressed**2 / 2, rel=0.03)


def test_the_work_of_a_plate_that_often_turns_is_in_the_springs() -> None:
    made = rods([[0, 0, RADIUS]])
    made.boundaries.place_plate(2 * RADIUS)
    made.boundaries.move_plate(-1e-3)
    made.advance(round(0.01 / DT))
    for _ in range(40):
        for speed in (1e-3, -1e-3):
            made.boundaries.move_plate(speed)
            made.advance(round(0.012 / DT))  # until it has left the rod, where a turn does no work
    stored = made.ledger.elastic()[0] + made.state().kinetic_energy
    # Of a force for half a step at each turn, the error would be 16 %.
    assert made.ledger.container_work == pytest.approx(stored, rel=0.01)


def test_a_removed_plate_leaves_nothing_behind() -> None:
    made = rods([[0, 0, RADIUS - 1e-7]])
    made.boundaries.place_plate(2 * RADIUS - 1e-6)
    made.advance(1)
    assert made._world.kept.used.sum() == 4
    made.boundaries.remove_plate()
    assert made.boundaries.plate_height is None
    assert made._world.kept.used.sum() == 2
    sums = made.boundaries.plate_sum
    assert sums[2] > 0
    made.advance(100)
    assert (made.boundaries.plate_sum == sums).all()


def test_the_wall_can_go_while_the_plate_stays() -> None:
    made = rods([[0, 0, RADIUS - 1e-7]])
    made.boundaries.place_plate(2 * RADIUS - 1e-6)
    made.advance(1)
    made.boundaries.remove_wall()
    assert made._world.kept.used.sum() == 4


# -- grips -------------------------------------------------------------------------------------------------------------


def test_grips_feel_a_contact_and_move_what_they_hold_exactly() -> None:
    # Crossed rods: the upper one is lowered onto the lower one.
    made = rods(
        [[0, 0, 0.5], [0, 0, 0.5 + 2 * RADIUS]],
        [Rotation.identity(), Rotation.from_euler("z", 90, degrees=True)],
        gripped=True,
    )
    assert made.grips is not None
    low, high = made.grips.hold([0]), made.grips.hold([1])
    made.grips.move(high, (0.0, 0.0, -1e-3))
    made.advance(round(0.01 / DT))
    before = made.grips.sums
    made.advance(1)
    force, pressed = made.grips.sums - before, 0.001 * made.time
    assert made.grips.moved[high] == pytest.approx([0, 0, -pressed])
    assert made.grips.counts.tolist() == [1, 1]
    assert force[high, 2] == pytest.approx(STIFFNESS * (pressed - 1e-3 * DT), rel=1e-3)
    assert force[low] == pytest.approx(-force[high])
    assert made.grips.pushed == pytest.approx(made.grips.sums + np.array([[0, 0, 0], [0, 0, -MASS * 1e-3 / DT]]))
    state = made.state()
    np.testing.assert_allclose(state.positions[:, 2], [0.5, 0.5 + 2 * RADIUS - pressed], rtol=1e-12)
    assert made.ledger.container_work == pytest.approx(made.ledger.elastic()[0] + state.kinetic_energy, rel=1e-2)


def test_a_grip_carries_weight_and_its_work_is_the_gain_of_energy() -> None:
    made = rods([[0, 0, 0.5], [0.1, 0, 0.5]], gravity=G, gripped=True, keep_ledger=True)
    assert made.grips is not None
    grip = made.grips.hold([1])
    made.grips.move(grip, (0.1, 0.0, 0.2))
    made.advance(1000)
    held, free = made.state().positions[1], made.state().positions[0]
    assert held == pytest.approx([0.1 + 0.1 * 0.02, 0, 0.5 + 0.2 * 0.02], rel=1e-9)
    assert free[2] == pytest.approx(0.5 - G * 0.02**2 / 2, rel=1e-4)
    assert made.grips.weights == pytest.approx([MASS * G])
    # Weight, and the impulse of the start, which is spread over all steps.
    assert made.grips.sums[0] / 1000 == pytest.approx([-MASS * 0.1 / 0.02, 0, -MASS * (G + 0.2 / 0.02)], rel=1e-9)
    assert not made.grips.pushed.any()  # nothing touches what it holds
    state = made.state()
    stored = state.kinetic_energy + state.potential_energy(G, 0.0)
    assert made.ledger.given == pytest.approx(stored, rel=1e-4)
    assert made.ledger.container_work == pytest.approx(MASS * (G * 0.004 + (0.1**2 + 0.2**2) / 2), rel=1e-3)
    made.grips.release()
    assert made.grips.counts.tolist() == []
    made.advance(10)
    assert made.state().velocities[1, 2] == pytest.approx(0.2 - 10 * G * DT)


def test_a_held_body_that_spins_stops_and_its_energy_goes_to_the_grip() -> None:
    made = rods([[0, 0, 0.5]], gripped=True)
    made._world.bodies.momentum[0] = [0.0, 0.0, 1e-7]
    energy = made.state().kinetic_energy
    assert made.grips is not None
    made.grips.hold([0])
    made.advance(1)
    assert made.state().kinetic_energy == 0.0
    assert made.ledger.container_work == pytest.approx(-energy, rel=1e-9)


# -- shaking -----------------------------------------------------------------------------------------------------------


def floor_of(phase: Shake) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Times [s] and heights of the floor [m] in every step of a phase, without bodies."""
    scene = small({"engine": "links", "phases.2": phase.model_dump()})
    made = build_engine(scene, DT)
    stage, heights = phase.begin(scene, 2), [0.0]
    while wait := stage.proceed(made):
        for _ in range(max(1, round(wait / DT))):
            made.advance(1)
            heights.append(made.boundaries.floor)
    return DT * np.arange(len(heights)), np.array(heights)


def test_taps_begin_and_end_at_rest_with_the_peaks_of_acceleration_and_speed() -> None:
    phase = Shake(type="shake", taps=3, rest_s=0.02, frequency_hz=50, peak_acceleration_g=2, peak_acceleration_end_g=4)
    times, heights = floor_of(phase)
    assert times[-1] == pytest.approx(3 * (0.02 + 0.02)) == phase.duration_s
    speed = np.gradient(heights, DT)
    for tap, acceleration in enumerate((2, 3, 4)):
        inside = (times >= 0.04 * tap) & (times < 0.04 * tap + 0.02)
        assert speed[inside].max() == pytest.approx(acceleration * G / (2 * math.pi * 50), rel=1e-3)
        assert heights[inside].max() == pytest.approx(2 * acceleration * G / (2 * math.pi * 50) ** 2, rel=1e-3)
        peak = np.abs(np.gradient(speed, DT)[inside][3:-3]).max()
        assert peak == pytest.approx(acceleration * G, rel=2e-3)
        resting = (times > 0.04 * tap + 0.0201) & (times < 0.04 * tap + 0.0399)
        assert np.abs(heights[resting]).max() < 1e-9
        assert abs(speed[inside][0]) < 1.1 * acceleration * G * DT


@pytest.mark.parametrize(("end", "ramp"), [(60.0, "linear"), (10.0, "linear"), (60.0, "log"), (10.0, "log")])
def test_the_instantaneous_frequency_of_a_sweep(end: float, ramp: Any) -> None:
    phase = Shake(
        type="shake", duration_s=1.0, frequency_hz=20, frequency_end_hz=end, peak_acceleration_g=1,
        peak_acceleration_end_g=2, ramp=ramp,
    )  # fmt: skip
    times, heights = floor_of(phase)
    crossing = np.flatnonzero((heights[:-1] <= 1e-12) & (heights[1:] > 1e-12))
    begins = times[crossing]
    assert len(begins) > 10
    # Each cycle begins where the integral of f is a whole number.
    rate = math.log(end / 20)
    cycles = 20 * begins + (end - 20) * begins**2 / 2 if ramp == "linear" else 20 * (np.exp(rate * begins) - 1) / rate
    np.testing.assert_allclose(cycles, np.arange(len(begins)), atol=2 * DT * max(end, 20))
    middles = (begins[1:] + begins[:-1]) / 2
    f, g = np.array([phase.at(middle) for middle in middles]).T
    np.testing.assert_allclose(1 / np.diff(begins), f, rtol=0.01)
    highest = [heights[a:b].max() for a, b in pairwise(crossing)]
    np.testing.assert_allclose(highest, g * G / (2 * math.pi * f) ** 2, rtol=0.02)
    assert abs(heights).max() < 1.05 * phase.amplitude(G)


def test_a_plate_and_grips_ride_on_the_container_and_not_on_the_floor_alone() -> None:
    for walls in (True, False):
        made = rods([[0, 0, 0.5]], gripped=True)
        assert made.grips is not None
        made.grips.move(made.grips.hold([0]), (0.0, 0.0, 0.01))
        made.boundaries.place_plate(1.0)
        made.boundaries.move_plate(-0.02)
        made.boundaries.shake(amplitude=1e-3, frequency=25.0, walls=walls)
        made.advance(round(0.01 / DT))  # a quarter of a period: the crest
        plate = made.boundaries.plate_height
        assert plate is not None
        ridden = 1e-3 if walls else 0.0
        assert made.boundaries.floor == pytest.approx(1e-3)
        assert plate == pytest.approx(1.0 - 0.02 * 0.01 + ridden, abs=1e-9)
        assert made.state().positions[0, 2] == pytest.approx(0.5 + 0.01 * 0.01 + ridden, abs=5e-6)
        made.boundaries.stop_shaking()
        made.advance(100)
        assert made.boundaries.plate_height == pytest.approx(plate - 0.02 * 100 * DT)
        assert made.boundaries.velocity == 0.0


# -- whole phases ------------------------------------------------------------------------------------------------------

VIBRATION = {"peak_acceleration_g": 1.5, "frequency_hz": 50, "windows_s": [[0.02, 0.06]]}
DEPOSIT = {"type": "deposit", "per_layer": 10}
GRIP = {"grip_m": 0.003, "distance_m": 0.006, "speed_m_per_s": 0.06, "duration_s": 0.12}
PHASES: list[dict[str, Any]] = [
    {"type": "shake", "taps": 3, "rest_s": 0.03},
    {"type": "shake", "duration_s": 0.12, "frequency_hz": 25, "frequency_end_hz": 60, "ramp": "log"},
    {"type": "compress", "stress_Pa": 60, "speed_m_per_s": 0.05, "cycles": 2, "afterwards": "stay",
     "vibration": VIBRATION},
    {"type": "relax", "duration_s": 0.3},
    {"type": "remove-container", "duration_s": 0.1},
    {"type": "compress", "strain": 0.4, "speed_m_per_s": 0.05, "vibration": VIBRATION},
    {"type": "lift", "radius_m": 0.004, "distance_m": 0.006, "speed_m_per_s": 0.06, "duration_s": 0.15},
    {"type": "release"},
    {"type": "relax", "duration_s": 0.2},
    {"type": "tension", **GRIP, "force_limit_N": 0.3, "vibration": VIBRATION},
]  # fmt: skip
STAPLE = {"shape": "staple", "crown_m": 0.011, "leg_m": 0.007, "thickness_normal_m": 8e-4, "thickness_in_plane_m": 8e-4}


def blocks() -> Scene:
    recording = {"series_interval_s": 2e-3, "frame_interval_s": 0.04, "checkpoint_interval_s": 0.02}
    everything: dict[str, Any] = {
        "engine": "links",
        "seed": 2,
        "count": 40,
        "particle": STAPLE,
        "container.radius_m": 0.011,
        "phases": [DEPOSIT, *PHASES],
        "recording": recording | {"energy": True, "dissipation_interval_s": 2e-4},
    }
    return small(everything)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    out = tmp_path_factory.mktemp("blocks") / "whole"
    run_scene(blocks(), out, command="")
    return Run(out)


@pytest.fixture(scope="module")
def series(run: Run) -> Series:
    return read_series(run.path)


def test_the_columns_of_a_scene_are_those_of_its_run(run: Run) -> None:
    table = summarise_run(run).set_index("phase")
    others = {quantity.header for measure in phase_measures() for quantity in measure.quantities}
    for phase, row in table.iterrows():
        numbers = {name for name, value in row.items() if not isinstance(value, str) and name != "seed"}
        # Rows of a table have the columns of measures of all phases.
        wanted = {name for name in numbers if name not in others or math.isfinite(row[name])}
        found = set(columns_of_scene(blocks(), int(str(phase))))
        assert wanted <= found
        assert found <= numbers


def test_a_run_that_was_stopped_in_any_of_the_phases_goes_on_with_equal_bits(
    run: Run, series: Series, tmp_path: Path
) -> None:
    for phase in (1, 2, 3, 6, 7, 10):
        begun = series.time[series["phase"] == phase]
        assert_goes_on(blocks(), run, tmp_path / str(phase), float(begun[len(begun) // 3]))


def test_the_work_of_plate_grips_and_shaking_is_accounted_for(series: Series) -> None:
    residual, dissipated = series["energy_residual_J"], series["dissipated_energy_J"]
    assert np.abs(residual).max() < 0.01 * dissipated[-1]
    for phase in (1, 2, 3, 6, 7, 10):
        inside = np.flatnonzero(series["phase"] == phase)
        work = np.ptp(series["container_work_J"][inside])
        assert work > 3 * np.ptp(residual[inside]) > 0, phase


def test_the_works_of_plate_and_grips_are_their_forces_times_ways(series: Series) -> None:
    for phase, force, way, sign in (
        (3, "plate_force_N", "plate_z_m", -1),
        (10, "grip_moved_force_N", "elongation_m", -1),
    ):
        inside = np.flatnonzero(series["phase"] == phase)
        since = series.time[inside] - series.time[inside[0]]
        quiet = inside[(since > 0.064) & (since < 0.096)]  # after the vibration, and before the grip arrives
        steps = np.diff(series[way][quiet])
        forces = series[force][quiet[1:], 2]
        weight = series["grip_moved_count"][quiet[1:]] * WEIGHT if phase == 10 else 0.0
        # In the step of a turn, half of the force's work is of the way before.
        steady = np.append(False, np.isclose(steps[1:], steps[:-1], rtol=1e-6))
        assert steady.sum() > 4
        work = float((sign * (forces - weight) * steps)[steady].sum())
        assert work == pytest.approx(np.diff(series["container_work_J"][quiet])[steady].sum(), rel=0.02), phase


WEIGHT = small({"engine": "links", "particle": STAPLE}).model.mass * G


def test_at_rest_floor_and_wall_carry_the_pile_and_the_plate(series: Series) -> None:
    resting = np.flatnonzero(series["phase"] == 4)[-50:]
    plate, container = (series[name][resting, 2].mean() for name in ("plate_force_N", "container_force_N"))
    assert plate > 0.2 * 40 * WEIGHT
    assert container + plate == pytest.approx(-40 * WEIGHT, rel=0.01)


def test_the_plate_turns_at_the_stress_and_at_none(series: Series) -> None:
    inside = np.flatnonzero(series["phase"] == 3)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(series["plate_z_m"][inside] - series["container_z_m"][inside]))))
    assert len(turns) >= 4
    assert np.isnan(series["plate_z_m"][series["phase"] < 3]).all()
    assert np.isnan(series["plate_z_m"][series["phase"] == 7]).all()  # the second compression removed it
    strained = (series["plate_z_m"] - series["container_z_m"])[series["phase"] == 6]
    assert strained[-1] / strained[0] == pytest.approx(0.6, abs=0.01)


def test_what_is_lifted_comes_along(series: Series) -> None:
    inside = np.flatnonzero(series["phase"] == 7)
    held = series["grip_moved_count"][inside]
    assert set(held) == {held[0]}
    assert 0 < held[0] < 40
    assert series["elongation_m"][inside[-1]] == pytest.approx(0.006)
    assert (series["grip_moved_count"][series["phase"] == 9] == 0).all()


def test_memory_of_the_stages_is_plain(run: Run) -> None:
    scene = blocks()
    for index, phase in enumerate(scene.phases):
        memory = phase.begin(scene, index).memory
        assert json.loads(json.dumps(memory)) == memory
    assert all(entry.end_s is not None for entry in run.phases)
