"""The motors' arithmetic: laws on paper, work against exact integrals, memory bit for bit."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dem.physics.motor import MotorLaw, Motors

HALT = MotorLaw(torque_limit=1.6e-5, speed_limit=6.0, stiffness=3e-3, law="halt")
SLIP = replace(HALT, law="slip")
EASE = replace(HALT, law="ease")
PERIOD, STEP = 2e-4, 4e-5  # s
ADVANCE = 3e-3 * 6.0 * PERIOD  # k ω Δt [N m]


def held(law: MotorLaw, angle: float, target: float, updates: int, motors: Motors | None = None) -> Motors:
    """A barb that is held at an angle, and a motor that goes elsewhere."""
    angles = np.full((1, 2), angle)
    motors = motors or Motors(law, angles)
    for _ in range(updates):
        motors.update(angles, np.full((1, 2), target), PERIOD, STEP)
    return motors


# -- the halting law ---------------------------------------------------------------------------------------------------


def test_stalled_motor_moves_in_neither_direction_until_its_torque_falls() -> None:
    stall = replace(HALT, law="stall")
    motors = held(stall, 0.5, 1.0, 40)
    stopped = motors.commands.copy()
    assert motors.halted.all()
    # A command to go back, which a halting motor follows: it stays, as the load stays.
    held(stall, 0.5, 0.0, 40, motors)
    assert (motors.commands == stopped).all()
    assert motors.halted.all()
    # The barb yields a little: now it goes.
    held(stall, 0.501, 0.0, 1, motors)
    assert (motors.commands == stopped - 6 * PERIOD).all()
    assert not motors.halted.any()


# -- the slipping law --------------------------------------------------------------------------------------------------


def test_an_easing_motor_goes_on_at_half_the_speed_whatever_it_takes() -> None:
    # One barb alone is at its limit: the other one, which follows freely, resets the count at each control update.
    motors = Motors(EASE, np.zeros((1, 2)))
    angles = np.zeros((1, 2))
    for _ in range(200):
        angles[0, 1] = motors.commands[0, 1]
        motors.update(angles, np.array([[1.0, 1.0]]), PERIOD, STEP)
    slow = math.ceil(EASE.torque_limit / ADVANCE)  # updates until the shaft is wound up to the limit
    assert motors.commands[0, 0] == pytest.approx((slow + (200 - slow) / 2) * 6 * PERIOD, rel=1e-12)
    assert motors.torques[0, 0] > 10 * EASE.torque_limit
    assert motors.commands[0, 1] == pytest.approx(200 * 6 * PERIOD, rel=1e-12)
    assert not motors.halted.any()


@given(st.lists(st.floats(-0.05, 0.05), min_size=2, max_size=40))
def test_slipping_motor_never_exceeds_its_limit(angles: list[float]) -> None:
    motors, free = Motors(SLIP, np.zeros((1, 2))), Motors(replace(HALT, torque_limit=1.0), np.zeros((1, 2)))
    for angle in angles:
        at = np.full((1, 2), angle)
        torques = motors.update(at, np.full((1, 2), 0.02), PERIOD, STEP)
        unlimited = free.update(at, np.full((1, 2), 0.02), PERIOD, STEP)
        assert (np.abs(torques) <= SLIP.torque_limit).all()
        # Below the limit it is the spring that the other law has as well; the command follows the schedule anyway.
        assert torques == pytest.approx(np.clip(unlimited, -1.6e-5, 1.6e-5), abs=1e-20)
        assert (motors.commands == free.commands).all()


# -- work --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", [replace(HALT, torque_limit=1.0), SLIP])
def test_work_is_the_energy_that_a_barb_gains(law: MotorLaw) -> None:
    # A barb of its own, integrated as YADE does: velocities half a step after angles, the torque at every step, an
    # update every five. The motor's work must be the kinetic energy at the half step after the update.
    inertia, steps = 9e-10, 5
    motors, angle, speed, energies, works = Motors(law, np.zeros((1, 2))), 0.0, 0.0, [], []
    for look in range(1000):
        motors.update(np.full((1, 2), angle), np.full((1, 2), 3.0 * PERIOD * (look + 1)), PERIOD, STEP)
        works.append(motors.work[0, 0])
        energies.append(inertia * speed**2 / 2)
        for _ in range(steps):
            angle += speed * STEP
            torque = law.stiffness * (motors.commands[0, 0] - angle)
            limit = law.torque_limit if law.law == "slip" else math.inf
            speed += float(np.clip(torque, -limit, limit)) / inertia * STEP
    # Energy goes back and forth, twice the mean of a swing about ω. A hundredth of that: trapezia over five steps of a
    # vibration of ninety. Counting a torque from the update on, half a step early, would add k ω² dt/2 all the time.
    assert np.ptp(energies) == pytest.approx(2 * inertia * 3.0**2, rel=0.1)
    early = law.stiffness * 3.0**2 * STEP / 2 * 1000 * PERIOD
    assert early > 4 * np.ptp(energies)
    assert np.array(works) == pytest.approx(np.array(energies), abs=0.1 * np.ptp(energies))


# -- memory ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", [HALT, EASE, SLIP])
def test_memory_through_json_keeps_every_bit(law: MotorLaw) -> None:
    rng = np.random.default_rng(3)
    way = np.cumsum(rng.normal(size=(60, 4, 2)), axis=0) * 2e-3
    motors = Motors(law, way[0])
    for angles in way[:30]:
        motors.update(angles, angles + rng.normal(size=(4, 2)) * 0.01, PERIOD, STEP)
    remembered = motors.halted if law is not EASE else np.array(motors.memory["over"]) > 1
    assert remembered.any()
    assert not remembered.all()
    again = Motors(law, np.zeros((4, 2)))
    again.restore(json.loads(json.dumps(motors.memory)))
    assert again.halted.tolist() == motors.halted.tolist()
    assert again.memory == motors.memory
    for angles in way[30:]:
        for one in (motors, again):
            one.update(angles, way[-1], PERIOD, STEP)
        for name in ("commands", "angles", "torques", "work", "halted"):
            first, second = getattr(motors, name), getattr(again, name)
            assert first.dtype == second.dtype, name
            assert first.tobytes() == second.tobytes(), name


# -- servos ------------------------------------------------------------------------------------------------------------


def test_a_servo_is_a_damped_spring_capped_as_a_whole_each_with_its_own_strength() -> None:
    law = MotorLaw(torque_limit=0.05, speed_limit=6.0, stiffness=0.1, law="servo", damping=1e-3)
    home, strengths = np.full((1, 2), 1.5), np.array([[1.0, 0.8]])
    motors = Motors(law, home, strengths)
    torques = motors.update(home - 0.2, home, 1e-4, 1e-4, np.full((1, 2), -2.0))
    assert torques == pytest.approx(np.array([[0.1 * 0.2 + 2e-3, 0.08 * 0.2 + 2e-3]]))
    assert not motors.halted.any()
    torques = motors.update(home - 0.49, home, 1e-4, 1e-4, np.full((1, 2), -2.0))
    assert torques == pytest.approx(np.array([[0.05, 0.04]]))
    # Its command stays, however far it was turned.
    assert (motors.commands == home).all()
    kept = Motors(law, home, strengths)
    kept.restore(motors.memory)
    after = [m.update(home - 0.1, home, 1e-4, 1e-4, np.zeros((1, 2))) for m in (motors, kept)]
    assert (after[0] == after[1]).all()
    assert (motors.work == kept.work).all()
