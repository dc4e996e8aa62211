"""Motion without contacts: what has to be conserved is."""

from __future__ import annotations

import math
from pathlib import Path

import builds
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.engine.links.engine import LinksEngine


def spun(made: LinksEngine, spins: np.ndarray) -> LinksEngine:
    """Give smarticles angular velocities in the laboratory [rad/s]."""
    bodies = made._world.posed()
    for k, spin in enumerate(spins):
        row, axes = bodies.plane[k], bodies.axes[k]
        inertia = np.array([[row[14], row[17], 0], [row[17], row[15], 0], [0, 0, row[16]]])
        bodies.momentum[k] = axes @ inertia @ axes.T @ spin
    return made


def test_poses_are_those_of_the_particle() -> None:
    rng = np.random.default_rng(0)
    for angles in ((math.pi / 2, math.pi / 2), (0.3, 1.2)):
        p = builds.particle(angles=angles)
        made = builds.engine(made_of=p)
        turns = [Rotation.random(random_state=rng) for _ in range(3)]
        places = rng.normal(size=(3, 3)) * 0.1
        made.add(builds.at(places, turns))
        state = made.state()
        wanted = np.array([place + turn.apply(p.boxes.vertices) for place, turn in zip(places, turns, strict=True)])
        assert np.allclose(state.vertices, wanted, atol=1e-16)
        assert np.allclose(state.angles, angles, atol=1e-14)
        frames = np.array([turn.as_matrix() @ p.boxes.link_rotations for turn in turns])
        assert np.allclose(state.link_rotations, frames, atol=1e-14)
        # Strands are where the links are, tips pulled in by the radius.
        start, along = made._world.bodies.segments[0, :3], made._world.bodies.segments[0, 3:]
        assert np.allclose(start, wanted[0, 1])
        assert np.linalg.norm(start + along - wanted[0, 0]) == pytest.approx(p.radius)


def test_free_fall() -> None:
    made = builds.engine(gravity=9.81, dt=1e-4)
    made.add(builds.at([0, 0, 5.0]))
    made.advance(1000)
    # Velocities are those of the middle of the step before.
    assert made.state().positions[0, 2] == pytest.approx(5 - 9.81 * 0.1 * (0.1 + 1e-4) / 2, abs=1e-12)
    assert made.state().velocities[0, 2] == pytest.approx(-9.81 * 0.1, rel=1e-12)
    assert made.unbalanced_force() == pytest.approx(1.0)
    assert made.impulse == pytest.approx(9.81 * 0.1 * made.particle.boxes.mass)


def test_what_is_thrown_falls_from_that_speed_on() -> None:
    made = builds.engine(gravity=9.81, dt=1e-4)
    made.add(builds.at([[0, 0, 5.0], [0.3, 0, 5.0]]), speed=2.0)
    before = made.state()
    assert made.account.added == pytest.approx(before.kinetic_energy + before.potential_energy(9.81, 0.0), rel=1e-14)
    made.advance(200)
    after, time = made.state(), 0.02
    assert after.velocities[:, 2] == pytest.approx(-(2 + 9.81 * time), rel=1e-12)
    # Of first order: velocities belong to the middles of steps.
    assert 5 - after.positions[:, 2] == pytest.approx(2 * time + 9.81 * time * (time + 1e-4) / 2, abs=1e-12)
    assert made.impulse == pytest.approx(-after.momentum[2], rel=1e-12)
    again = builds.engine(gravity=9.81, dt=1e-4)
    again.load(made.save(Path()), Path())
    assert again.impulse == made.impulse


def test_a_spin_keeps_its_energy_over_a_thousand_turns() -> None:
    made = builds.engine(dt=1e-4)
    made.add(builds.at([[0.3 * k, 0, 5.0] for k in range(3)], [Rotation.random(random_state=k) for k in range(3)]))
    spins = np.array([[60.0, 1.0, 0.5], [1.0, 60.0, 0.5], [30.0, 30.0, 43.0]])
    spun(made, spins)
    before = made.state()
    energy, momentum = before.kinetic_energy, before.angular_momentum
    made.advance(round(1000 * 2 * math.pi / 60 / 1e-4))
    after = made.state()
    assert after.kinetic_energy == pytest.approx(energy, rel=1e-4)
    assert np.allclose(after.angular_momentum, momentum, rtol=1e-12)


def test_turns_are_of_second_order() -> None:
    ends = []
    for dt in (4e-4, 2e-4, 1e-4, 2.5e-5):
        made = builds.engine(dt=dt)
        made.add(builds.at([0, 0, 5.0]))
        spun(made, np.array([[20.0, 30.0, 10.0]]))
        made.advance(round(0.4 / dt))
        ends.append(made.state().link_rotations[0, 1])
    errors = [np.abs(end - ends[-1]).max() for end in ends[:3]]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.15)


@pytest.mark.parametrize("law", ["halt", "stall", "slip", "servo"])
def test_a_free_gait_keeps_momentum_and_angular_momentum(law: str) -> None:
    made = builds.engine(motor_law=builds.motor_law(law, damping=1e-6 if law == "servo" else 0.0), dt=1e-4)
    made.add(builds.at([[0.1, 0.2, 5.0], [-0.1, 0.0, 5.1]], [Rotation.random(random_state=k) for k in range(2)]))
    spun(made, np.array([[5.0, -3.0, 8.0], [1.0, 2.0, 3.0]]))
    made._world.bodies.velocity[:] = [[0.1, -0.2, 0.3], [0.0, 0.1, 0.0]]
    before = made.state()
    made.motors.articulate()
    spread = np.abs(np.cross(before.link_positions, before.link_velocities)).sum(axis=1) * before.boxes.mass
    for look in range(1000):
        phase = 2 * math.pi * look / 500
        made.motors.actuate(math.pi / 2 + np.array([[[0.3 * math.sin(phase), 0.4 * math.cos(phase) - 0.4]] * 2]), 2e-4)
        made.advance(2)
    after = made.state()
    assert np.abs(after.angles - math.pi / 2).max() > 0.05
    assert np.allclose(after.momentum, before.momentum, rtol=1e-12)
    own = np.abs(after.boxes.mass * after.velocities).sum()
    assert np.abs(after.momentum - before.momentum).max() < 1e-12 * own
    # The orbital part moves with the centres of mass, whose sum of cross products is rounded at every step.
    assert np.abs(after.angular_momentum - before.angular_momentum).max() < 1e-12 * spread.sum()


@pytest.mark.parametrize("law", ["halt", "slip", "servo"])
def test_motors_work_equals_the_gain_of_energy_of_a_free_pair(law: str) -> None:
    more = {"damping": 2e-6, "torque_limit": 1e-4} if law == "servo" else {"torque_limit": 1e-4}
    made = builds.engine(motor_law=builds.motor_law(law, **more), dt=5e-5)
    made.add(builds.at([[0, 0, 5.0], [0.2, 0, 5.0]], [Rotation.random(random_state=k) for k in range(2)]))
    spun(made, np.array([[40.0, -30.0, 20.0], [0.0, 10.0, 30.0]]))
    made.motors.articulate()
    start, gains, works = made.state().kinetic_energy, [], []
    for look in range(400):
        made.motors.actuate(np.full((1, 2, 2), math.pi / 2 + 0.4 * math.sin(2 * math.pi * look / 90)), 2e-4)
        made.advance(4)
        gains.append(made.state().kinetic_energy - start)
        works.append(made.motors.work)
    gains, works = np.array(gains), np.array(works)
    assert np.ptp(gains) > 0.01 * start
    assert np.abs(gains - works).max() < 1e-3 * np.abs(gains).max()
