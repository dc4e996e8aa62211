"""Rows of the series: what the engine says, and forces that are means over all steps, from an engine in memory."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from double import EngineDouble, GripsDouble
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.engine.effect import EffectName
from dem.run.sampler import Sampler
from dem.scene.scene import Scene

RADIUS, DT = 0.0234, 1e-4


def engine_with(
    heights: list[float], *, time: float = 0.0, floor: float = 0.0, scene: Scene | None = None
) -> EngineDouble:
    """An engine with smarticles on the axis, all flat, that are still in the air."""
    engine = EngineDouble.of(scene or small(), DT)
    engine.time, engine.boundaries.floor = time, floor
    positions = np.array([[0.0, 0.0, height] for height in heights]).reshape(-1, 3)
    engine.add(Poses(positions, (Rotation.identity(),) * len(heights)))
    return engine


def sample(sampler: Sampler, engine: EngineDouble) -> dict[str, np.ndarray]:
    """A row, and the sampler as a run that goes on from here has it."""
    row = sampler.sample(engine, engine.state(), 2)
    assert list(row) == list(sampler.described)
    sampler.memory = json.loads(json.dumps(sampler.memory))
    return row


def test_columns_hold_what_the_engine_reports() -> None:
    engine = engine_with([0.01, 0.03, 0.02], time=0.5, floor=-0.002)
    engine.boundaries.velocity = 0.1
    engine.velocities[:] = [[3, 0, 4], [0, 1, 0], [0, 0, 0]]
    boxes = engine.particle.boxes
    row = sample(Sampler(RADIUS), engine)
    assert row["time_s"] == 0.5
    assert (row["phase"], row["count"]) == (2, 3)
    assert row["container_z_m"] == -0.002
    assert row["container_velocity_m_per_s"] == 0.1
    assert row["com_height_m"] == pytest.approx(0.022)  # above the floor, which is at -2 mm
    assert row["max_speed_m_per_s"] == pytest.approx(5)
    assert row["kinetic_energy_J"] == pytest.approx(0.5 * boxes.mass * 26)
    assert row["unbalanced_force"] == 1  # all fall
    # The second-highest: 0.02 + 0.002.
    assert row["packing_fraction"] == pytest.approx(3 * boxes.volume / (math.pi * RADIUS**2 * 0.022))


def force(engine: EngineDouble, steps: int = 40) -> np.ndarray:
    """Mean force on the container over some steps."""
    sampler = Sampler(RADIUS)
    assert np.isnan(sample(sampler, engine)["container_force_N"]).all()  # of no time there is no mean
    engine.advance(steps)
    return sample(sampler, engine)["container_force_N"]


def test_force_at_rest_is_the_weight_downwards() -> None:
    engine = engine_with([0.01, 0.02])
    engine.advance(1000)
    assert engine.touches().all()
    assert force(engine) == pytest.approx([0, 0, -2 * engine.particle.boxes.mass * 9.81], rel=1e-12)


def test_force_of_an_impact_is_its_momentum_whenever_it_came() -> None:
    engine = engine_with([0.03])
    push, mass = np.array([0.3, -0.2, -0.5]), engine.particle.boxes.mass
    engine.velocities[0] = push
    fallen = force(engine, 600)
    assert engine.touches().all()
    assert fallen == pytest.approx(mass * (push / (600 * DT) - [0, 0, 9.81]), rel=1e-9)


def test_forces_on_hooks_are_means_and_no_part_of_the_containers() -> None:
    engine = engine_with([0.0], scene=small({"hooks": {}}))
    sampler = Sampler(RADIUS, {EffectName.HOOKS})
    assert np.isnan(sample(sampler, engine)["hook_upper_force_N"]).all()
    engine.advance(10)
    # A row is of the ten steps, and of them alone; the double's own hooks feel nothing by themselves.
    engine.boundaries.hook_sums = np.array([[0.0, 0.0, -1.0], [2.0, 0.0, -3.0]])
    row = sample(sampler, engine)
    assert row["hook_lower_force_N"] == pytest.approx([0, 0, -0.1])
    assert row["hook_upper_force_N"] == pytest.approx([0.2, 0, -0.3])
    weight = engine.particle.boxes.mass * 9.81
    assert row["container_force_N"] == pytest.approx([-0.2, 0, 0.4 - weight])
    assert row["hook_upper_z_m"] == engine.boundaries.upper_height == 0.01
    engine.advance(5)
    assert sample(sampler, engine)["hook_upper_force_N"] == pytest.approx([0, 0, 0])


def test_the_force_on_a_plate_is_a_mean_and_no_part_of_the_containers() -> None:
    engine, sampler = engine_with([0.0]), Sampler(RADIUS, {EffectName.PLATE})
    assert math.isnan(sample(sampler, engine)["plate_z_m"])
    engine.advance(10)
    engine.boundaries.place_plate(0.03)
    engine.boundaries.plate_sum = np.array([0.0, 1.0, 4.0])
    row = sample(sampler, engine)
    assert row["plate_force_N"] == pytest.approx([0, 0.1, 0.4])
    assert row["plate_z_m"] == 0.03
    assert row["container_force_N"] == pytest.approx([0, -0.1, -0.4 - engine.particle.boxes.mass * 9.81])


def test_forces_on_grips_are_means_since_these_grips_hold() -> None:
    engine, sampler = engine_with([0.0]), Sampler(RADIUS, {EffectName.GRIPS})
    assert sample(sampler, engine)["grip_moved_count"] == 0
    grips = engine.grips = GripsDouble(calls=engine.calls)
    grips.hold([0])
    grips.hold([1, 2])
    row = sample(sampler, engine)  # as of no time
    assert np.isnan(row["grip_moved_force_N"]).all()
    assert (row["grip_fixed_count"], row["grip_moved_count"], row["elongation_m"]) == (1, 2, 0)
    engine.advance(10)
    grips.pushed, grips.moved = np.array([[0, 0, 5.0], [1.0, 0, -7.0]]), np.array([[0, 0, 0], [0, 3e-3, 4e-3]])
    grips.sums = grips.pushed + np.array(
        [0, 0, 3.0]
    )  # with the inertia of what is held, which the container does not bear
    row = sample(sampler, engine)
    assert row["grip_fixed_force_N"] == pytest.approx([0, 0, 0.5])
    assert row["grip_moved_force_N"] == pytest.approx([0.1, 0, -0.7])
    assert row["grip_moved_weight_N"] == pytest.approx(grips.weights[1])
    assert row["elongation_m"] == row["grip_distance_m"] == pytest.approx(5e-3)
    assert row["container_force_N"] == pytest.approx([-0.1, 0, -0.4 - engine.particle.boxes.mass * 9.81])
    # Others that hold within one interval are others, however many.
    grips.release()
    grips.hold([4])
    engine.advance(10)
    grips.sums = grips.pushed = np.array([[0, 0, 2.0]])
    row = sample(sampler, engine)
    assert row["grip_moved_force_N"] == pytest.approx([0, 0, 0.2])
    assert row["container_force_N"] == pytest.approx([0, 0, -0.2 - engine.particle.boxes.mass * 9.81])
    assert math.isnan(row["grip_distance_m"])
    grips.release()
    row = sample(sampler, engine)
    assert math.isnan(row["elongation_m"])


def test_forces_on_all_grips_are_no_part_of_the_containers() -> None:
    engine, sampler = engine_with([0.0]), Sampler(RADIUS, {EffectName.GRIPS})
    grips = engine.grips = GripsDouble(calls=engine.calls)
    for body in range(3):
        grips.hold([body])
    sample(sampler, engine)
    engine.advance(10)
    grips.sums = np.array([[2.0, 0, 0], [0, 3.0, 0], [0, 0, 4.0]])
    weight = engine.particle.boxes.mass * 9.81
    assert sample(sampler, engine)["container_force_N"] == pytest.approx([-0.2, -0.3, -0.4 - weight])


def test_a_pile_without_a_wall_has_no_packing_fraction_and_counts_those_outside() -> None:
    sampler, engine = Sampler(RADIUS, {EffectName.WALL_REMOVAL}), engine_with([0.01, 0.02, 0.03])
    engine.positions[0, 0] = 1.01 * RADIUS
    row = sample(sampler, engine)
    assert row["outside_count"] == 1
    assert row["packing_fraction"] > 0
    engine.boundaries.remove_wall()
    assert math.isnan(sample(sampler, engine)["packing_fraction"])


def test_motors_report_while_articulated_and_not_while_welded() -> None:
    scene = small({"phases": [{"type": "deposit"}, {"type": "shape-change"}]})
    sampler, engine = Sampler(RADIUS, {EffectName.MOTORS}), engine_with([0.01, 0.02], scene=scene)
    row = sample(sampler, engine)
    own = pytest.approx([math.pi / 2] * 2)
    assert (row["angle_rad"], row["commanded_angle_rad"]) == (own, own)
    assert math.isnan(row["tracking_error_rad"])
    engine.motors.articulate()
    engine.motors.actuate(np.array([[[1.0, 1.5], [1.2, 1.5]]]), 2e-4)
    found = engine.motors.readings
    assert found is not None
    halted = np.array([[True, False], [False, False]])
    torques, work = np.full((2, 2), 3e-5), np.full((2, 2), 1e-6)
    engine.motors.readings = replace(found, schedule=found.commands - 0.3, torques=torques, work=work, halted=halted)
    row = sample(sampler, engine)
    assert row["commanded_angle_rad"] == pytest.approx([1.1, 1.5])
    assert row["schedule_error_rad"] == pytest.approx(0.3)
    assert row["tracking_error_rad"] == pytest.approx(math.pi / 2 - 1.0)
    assert row["motor_torque_N_m"] == pytest.approx(3e-5)
    assert row["halted_fraction"] == 0.25
    assert row["motor_work_J"] == pytest.approx(4e-6)
    engine.motors.weld()
    assert math.isnan(sample(sampler, engine)["motor_torque_N_m"])


def test_the_energy_ledger_closes_over_fall_impact_and_shaking() -> None:
    effects = {EffectName.ENERGIES, EffectName.ENERGY_ACCOUNT}
    sampler, engine = Sampler(RADIUS, effects), engine_with([0.05, 0.08])
    scale = sample(sampler, engine)["added_energy_J"]
    assert scale == pytest.approx(engine.particle.boxes.mass * 9.81 * 0.13)
    moved = []
    for steps, shaken in ((300, False), (2000, False), (500, True)):
        if shaken:
            engine.boundaries.shake(amplitude=1e-3, frequency=30)
        engine.advance(steps)
        row = sample(sampler, engine)
        moved.append((row["dissipated_energy_J"], row["container_work_J"]))
        assert abs(row["energy_residual_J"]) < 1e-9 * scale
    (falling, _), (landed, still), (_, worked) = moved
    assert falling == still == 0 < landed
    assert abs(worked) > 1e-3 * scale
