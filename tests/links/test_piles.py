"""Piles: the same bits again, checkpoints, the energy ledger, motors under load, nothing passes through."""

import math
from dataclasses import replace
from pathlib import Path

import builds
import numpy as np
import pytest

from dem.arrays import Array
from dem.engine.interface import Saved
from dem.engine.links.engine import LinksEngine
from dem.engine.links.motion import motoring
from dem.engine.links.stepping import MOST
from dem.errors import InputError
from dem.physics.motor import Motors

HERE = Path()


def bits(made: LinksEngine) -> bytes:
    bodies = made._world.bodies
    return b"".join(a.tobytes() for a in (bodies.position, bodies.turn, bodies.velocity, bodies.momentum, bodies.alpha))


def poured(count: int = 20, **more: object) -> LinksEngine:
    return builds.pile(
        builds.engine(gravity=9.81, radius=0.0234, dt=5e-5, motor_law=builds.motor_law("halt"), **more), count
    )


def swing(made: LinksEngine, looks: int, begin: int = 0) -> None:
    for look in range(begin, begin + looks):
        made.motors.actuate(np.full((1, made.count, 2), math.pi / 2 - 0.5 * math.sin(look / 40)), 2e-4)
        made.advance(4)


def test_the_same_twice_and_however_steps_are_grouped() -> None:
    one, other = (builds.pile(builds.engine(gravity=9.81, radius=0.0234, dt=5e-5), 15, settle=0) for _ in range(2))
    one.advance(600)
    for steps in (1, 99, 250, 250):
        other.advance(steps)
        other.state()
        other.neighbours()
        other.touches()
    assert bits(one) == bits(other)


@pytest.mark.parametrize("law", ["halt", "slip"])
def test_looks_told_one_by_one_or_at_once(law: str) -> None:
    one, other, again = (
        builds.pile(builds.engine(gravity=9.81, radius=0.0234, dt=5e-5, motor_law=builds.motor_law(law)), 8)
        for _ in range(3)
    )
    for made in (one, other):
        made.motors.articulate()
    swing(one, 40)
    targets = np.stack([np.full((8, 2), math.pi / 2 - 0.5 * math.sin(look / 40)) for look in range(40)])
    other.motors.actuate(targets[:30], 2e-4)
    # Saved in the middle of a period in the middle of the block.
    other.advance(50)
    again.load(other.save(HERE), HERE)
    for made in (other, again):
        made.advance(70)
        made.motors.actuate(targets[30:], 2e-4)
        made.advance(40)
        assert bits(made) == bits(one)
        assert made.motors.work == one.motors.work


def test_a_checkpoint_goes_on_with_the_same_bits() -> None:
    made = poured(12)
    made.boundaries.shake(amplitude=5e-4, frequency=30.0)
    made.advance(333)
    saved = made.save(HERE)
    assert isinstance(saved.content, bytes)
    again = builds.engine(gravity=9.81, radius=0.0234, dt=1e-5, motor_law=builds.motor_law("halt"))
    again.load(saved, HERE)
    for each in (made, again):
        each.advance(777)
        each.boundaries.stop()
        each.motors.articulate()
        swing(each, 30)
        each.advance(2)
    assert made.time == again.time
    middle = made.save(HERE)
    third = builds.engine(gravity=9.81, radius=0.0234, dt=1e-5, motor_law=builds.motor_law("halt"))
    third.load(middle, HERE)
    for each in (made, again, third):
        each.advance(2)
        swing(each, 50, begin=30)
        each.motors.weld()
        each.advance(500)
    assert bits(made) == bits(again) == bits(third)
    assert made.motors.work == third.motors.work
    assert made.ledger.container_work == third.ledger.container_work
    assert made.overlaps(1e-4).deepest == third.overlaps(1e-4).deepest


def test_a_foreign_checkpoint_is_refused_in_one_line() -> None:
    made = builds.engine()
    with pytest.raises(InputError, match="another engine"):
        made.load(Saved(content=b"", memory={"format": "yade"}), HERE)
    with pytest.raises(InputError, match="not readable"):
        made.load(Saved(content=b"rubbish", memory=made.save(HERE).memory), HERE)


def test_a_pile_comes_to_rest() -> None:
    made = poured(30)
    made.advance(18000)
    # One or the other still rocks on its round strands for a second; which one is a matter of last bits.
    speeds = np.linalg.norm(made.state().velocities, axis=1)
    assert speeds.max() < 1e-3
    assert np.quantile(speeds, 0.8) < 1e-5
    assert made.unbalanced_force() < 1e-3
    assert made.boundaries.container_force[2] == pytest.approx(-30 * builds.boxes().mass * 9.81, rel=1e-3)


@pytest.mark.parametrize("law", ["halt", "stall", "slip", "servo"])
def test_the_energy_ledger_closes_in_an_actuated_pile(law: str) -> None:
    more = {"damping": 1e-6} if law == "servo" else {}
    made = builds.engine(
        gravity=9.81, radius=0.0234, dt=5e-5, motor_law=builds.motor_law(law, **more), keep_ledger=True
    )
    builds.pile(made, 30, settle=0.1)
    made.motors.articulate()
    swing(made, 1500)
    made.motors.weld()
    made.advance(1000)
    state = made.state()
    stored = state.kinetic_energy + state.potential_energy(9.81, 0.0) + sum(made.ledger.elastic())
    given = made.ledger.given + made.motors.work
    assert made.motors.work > 0.1 * made.ledger.added
    assert abs(given - stored - made.ledger.dissipated) < 0.004 * given


def test_the_energy_ledger_closes_in_a_shaken_pile() -> None:
    made = builds.engine(gravity=9.81, radius=0.0234, dt=5e-5, keep_ledger=True)
    builds.pile(made, 20, settle=0.1)
    made.boundaries.shake(amplitude=2 * 9.81 / (2 * math.pi * 30) ** 2, frequency=30.0)
    made.advance(20000)
    state = made.state()
    stored = state.kinetic_energy + state.potential_energy(9.81, 0.0) + sum(made.ledger.elastic())
    given = made.ledger.given
    assert made.ledger.container_work > 0.1 * made.ledger.added
    assert abs(given - stored - made.ledger.dissipated) < 0.004 * given


def strained(law: str, load: float) -> LinksEngine:
    """A smarticle in free space whose motors have found a mean torque `load` [N m] since their last update."""
    made = builds.engine(motor_law=builds.motor_law(law), dt=5e-5)
    made.add(builds.at([0, 0, 5.0]))
    made.motors.articulate()
    made.motors.actuate(made._world.bodies.alpha[None], 2e-4)
    made.advance(4)
    assert made._world.motors is not None
    made._world.motors.impulse[:] = load * 2e-4
    return made


def commanded(made: LinksEngine, by: float) -> Array:
    """Changes of the commands at a control update whose targets differ by `by` [rad], (1, 2) [rad]."""
    assert made._world.motors is not None
    before = made._world.motors.command.copy()
    made.motors.actuate(before[None] + by, 2e-4)
    made.advance(1)
    return made._world.motors.command - before


@pytest.mark.parametrize("law", ["halt", "stall"])
def test_a_motor_at_its_limit_holds_against_the_load_and_may_give_way_with_it(law: str) -> None:
    against, along = strained(law, 2e-5), strained(law, 2e-5)
    np.testing.assert_array_equal(commanded(against, 1e-3), 0.0)
    assert against.motors.readings is not None
    assert against.motors.readings.halted.all()
    np.testing.assert_allclose(commanded(along, -1e-3), -1e-3 if law == "halt" else 0.0)
    free = strained(law, 1.5e-5)
    np.testing.assert_allclose(commanded(free, 1e-3), 1e-3)


@pytest.mark.parametrize("law", ["halt", "stall"])
@pytest.mark.parametrize("stiffness", [500.0, 16000.0])
def test_the_torque_at_a_stop_is_that_of_the_shaft_however_stiff_contacts_are(law: str, stiffness: float) -> None:
    # Both tips are opened at 1 rad/s against a narrow wall: τ_max and k ω T, the gain of a shaft in a control period.
    contact = replace(builds.LAW, normal_stiffness=stiffness, tangential_stiffness=0.8 * stiffness)
    motor = builds.motor_law(law, speed_limit=1.0)
    made = builds.engine(law=contact, motor_law=motor, dt=1e-5, radius=9.5e-3)
    made.add(builds.at([0, 0, 5.0]))
    made.motors.articulate()
    torques = []
    for update in range(5000):
        made.motors.actuate(np.full((1, 1, 2), max(0.0, math.pi / 2 - 2e-4 * update)), 2e-4)
        made.advance(20)
        assert made.motors.readings is not None
        torques.append(made.motors.readings.torques.copy())
    assert (np.abs(torques[-1]) > 0.9 * builds.TORQUE).all()
    assert np.abs(torques).max() <= builds.TORQUE + 2 * motor.stiffness * motor.speed_limit * 2e-4


@pytest.mark.parametrize("law", ["slip", "servo"])
def test_a_slipping_motor_never_exceeds_its_torque(law: str) -> None:
    made = builds.engine(motor_law=builds.motor_law(law, damping=1e-6 if law == "servo" else 0.0), dt=5e-5)
    made.add(builds.at([0, 0, 5.0]))
    made.motors.articulate()
    torques = []
    for look in range(300):
        made.motors.actuate(np.full((1, 1, 2), math.pi / 2 + 0.5 * math.sin(look / 20)), 2e-4)
        made.advance(4)
        torques.append(made.motors.readings.torques.copy())
    assert np.abs(torques).max() <= builds.TORQUE * (1 + 1e-12)
    assert np.abs(torques).max() > 0.1 * builds.TORQUE
    assert np.abs(made.state().angles - made.motors.readings.commands).max() < 0.1


def test_the_speed_of_a_command_is_limited() -> None:
    made = builds.engine(motor_law=builds.motor_law("halt", torque_limit=1.0), dt=5e-5)
    made.add(builds.at([0, 0, 5.0]))
    made.motors.articulate()
    commands = []
    for look in range(400):
        made.motors.actuate(np.full((1, 1, 2), 0.5 if look < 200 else 1.2), 2e-4)
        made.advance(4)
        assert made.motors.readings is not None
        commands.append(float(made.motors.readings.commands[0, 0]))
    assert np.abs(np.diff(commands)).max() == pytest.approx(6.0 * 2e-4)


def opening(stiffness: float, damping: float = 0.0) -> Array:
    """Rates of a barb that opens at 3 rad/s from rest in free space, after each step of 0.02 s [rad/s]."""
    motor = builds.motor_law("halt", torque_limit=1.0, speed_limit=3.0, stiffness=stiffness, damping=damping)
    made = builds.engine(motor_law=motor, dt=5e-6)
    made.add(builds.at([0, 0, 5.0]))
    made.motors.articulate()
    rates = []
    for update in range(1, 101):
        made.motors.actuate(np.full((1, 1, 2), math.pi / 2 - 6e-4 * update), 2e-4)
        for _ in range(40):
            made.advance(1)
            rates.append(-made._world.bodies.rate[0, 0])
    return np.array(rates)


@pytest.mark.parametrize("stiffness", [3e-3, 0.03, 0.3])
def test_a_shaft_vibrates_as_if_its_motor_started_once(stiffness: float) -> None:
    # The rate is ω (1 - cos Ωt). Commands that jumped at each control update would drive it to -7 rad/s at 0.3 N m/rad.
    rates = opening(stiffness)
    assert rates.min() > -0.05 * 3.0
    assert rates.max() == pytest.approx(6.0, rel=0.05)


def test_a_damped_stiff_shaft_prescribes_the_speed() -> None:
    # Damped as much as an inertia of 2e-9 kg m² can be without overshooting; 3 rad/s after two control periods.
    rates = opening(3.0, damping=2 * math.sqrt(3.0 * 2e-9))
    np.testing.assert_allclose(rates[80:], 3.0, rtol=0.02)


def test_a_fast_spin_is_taken_in_short_steps() -> None:
    made = builds.engine(dt=1e-4)
    made.add(builds.at([0, 0, 1.0]))
    made._world.bodies.momentum[0, 2] = made.particle.boxes.inertia[2] * 60
    made.advance(10)
    # 60 rad/s moves a tip by less than a tenth of a diameter in a step.
    assert made._world.totals[MOST] == 1.0
    made._world.bodies.momentum[0, 2] = made.particle.boxes.inertia[2] * 6000
    made.advance(10)
    assert made._world.totals[MOST] > 10.0


def test_an_easing_motor_is_that_of_the_other_engine() -> None:
    # Both barbs or one of them at the limit, in turns: the same commands as of the law in plain arithmetic.
    law = builds.motor_law("ease")
    made = builds.engine(motor_law=law, dt=5e-5)
    made.add(builds.at([0, 0, 5.0]))
    made.motors.articulate()
    motors = made._world.motors
    assert motors is not None
    plain = Motors(replace(law, stiffness=1.0), made._world.bodies.alpha)
    update, rng = builds.callable_from_python(motoring.update), np.random.default_rng(1)
    loads = [np.repeat(rng.random((1, 2)) < 0.8, 15, axis=0) for _ in range(40)]
    speeds = set()
    for over in np.concatenate(loads):
        torque = np.where(over, 1.5, 0.5) * law.torque_limit
        before = plain.commands.copy()
        plain.update(before - torque, before + 1.0, 2e-4, 5e-5)
        motors.command[0], motors.impulse[0], motors.elapsed[0] = before[0], torque * 2e-4, 2e-4
        made.motors.actuate(before[None] + 1.0, 2e-4)
        update(made._world.shapes, made._world.bodies, made._world.motors)
        np.testing.assert_allclose(made._world.motors.command, plain.commands, atol=1e-15)
        np.testing.assert_array_equal(motors.halted, plain.halted)
        speeds |= set(np.round((plain.commands - before)[0] / 2e-4, 9))
    assert speeds == {0.0, law.speed_limit / 2, law.speed_limit}


@pytest.mark.parametrize("walls", [True, False])
def test_the_floor_is_shaken_with_its_wall_or_alone(walls: bool) -> None:
    made = poured(6)
    amplitude, frequency = 5e-4, 30.0
    made.boundaries.shake(amplitude=amplitude, frequency=frequency, walls=walls)
    begun, floors, wall = made.time, [], []
    for _ in range(400):
        made.advance(4)
        floors.append(made.boundaries.floor)
        wall.append(made.boundaries.wall_bottom)
    times = begun + 2e-4 * np.arange(1, 401)
    np.testing.assert_allclose(floors, amplitude * np.sin(2 * math.pi * frequency * (times - begun)), atol=1e-12)
    assert np.ptp(wall) == pytest.approx(np.ptp(floors) if walls else 0.0, abs=1e-15)
    # What the floor alone gives is all that the ledger has.
    assert made.ledger.container_work > 0.0
