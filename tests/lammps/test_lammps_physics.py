"""LAMMPS under mpirun against known answers: free flight, rest, the law, and one rank against two."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lammps_builds import Build
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.engine.lammps.engine import LammpsEngine

G = 9.81


def put(
    engine: LammpsEngine, *places: tuple[float, float, float], turns: tuple[Rotation, ...] = (), speed: float = 0
) -> None:
    """Smarticles at places, not turned or turned as told."""
    given = turns or (Rotation.identity(),) * len(places)
    engine.add(Poses(np.array(places), given), speed=speed)


def test_what_flies_falls_as_thrown_and_does_not_turn(build: Build) -> None:
    engine = build(small())
    askew = Rotation.from_rotvec([0.5, 1.0, 0.3])
    put(engine, (0.005, 0, 0.09), (-0.01, 0, 0.05), turns=(askew, askew.inv()), speed=0.2)
    before = engine.state()
    np.testing.assert_allclose(before.velocities, [[0, 0, -0.2]] * 2, atol=1e-15)
    engine.advance(200)
    after, t = engine.state(), 200 * engine.time_step
    assert engine.time == pytest.approx(t, rel=1e-12)
    fallen = before.positions - after.positions
    # The scheme is exact for a constant force.
    np.testing.assert_allclose(fallen[:, 2], 0.2 * t + G * t**2 / 2, rtol=1e-9)
    assert np.abs(fallen[:, :2]).max() < 1e-15
    np.testing.assert_allclose(after.velocities[:, 2], -(0.2 + G * t), rtol=1e-9)
    assert np.abs(after.link_rotations - before.link_rotations).max() < 1e-9
    assert engine.impulse == pytest.approx(-after.momentum[2], rel=1e-9)
    assert engine.unbalanced_force() == pytest.approx(1, rel=1e-9)
    assert engine.touches().tolist() == [0, 0]


def test_at_rest_springs_of_the_floor_bear_the_weight(build: Build) -> None:
    engine = build(small())
    radius, mass = engine.particle.radius, engine.particle.boxes.mass
    put(engine, (0.008, 0.002, radius), (-0.008, 0, radius))
    put(engine, (0.0, 0.013, radius))
    engine.advance(500)
    weight = 3 * mass * G
    springs = 250 * engine.contacts.fixed_depths.sum()
    assert springs == pytest.approx(weight, rel=1e-3)
    assert engine.touches().tolist() == [len(engine.particle.centres)] * 3
    assert engine.neighbours().tolist() == [0, 0, 0]
    assert engine.unbalanced_force() < 1e-3
    assert engine.state().kinetic_energy < 1e-6 * weight * radius


def test_one_rank_and_two_move_the_same_smarticles_alike(build: Build) -> None:
    """Sums of forces differ in their last digits alone, which have not grown yet."""
    rng = np.random.default_rng(2)
    turns = tuple(Rotation.random(4, random_state=rng))
    places = [(0.005 * x, 0.005 * y, 0.016 + 0.003 * (2 * x + y)) for x in (-1, 1) for y in (-1, 1)]
    found = []
    for ranks in (1, 2):
        engine = build(small(), ranks=ranks)
        put(engine, *places, turns=turns, speed=0.5)
        met = 0
        for _ in range(12):
            engine.advance(25)
            met += len(engine.contacts.pairs) > 0
        assert met > 1
        found.append(engine.state())
        engine.child.close()
    assert np.abs(found[0].vertices - found[1].vertices).max() < 1e-9


def test_the_floor_carries_what_lies_on_it(build: Build) -> None:
    engine = build(small())
    put(engine, (0, 0, engine.particle.radius))
    engine.advance(200)
    rested = engine.state().positions[0, 2]
    engine.fixtures.shake(amplitude=1e-4, frequency=30.0)  # 0.36 g: it stays on the floor
    engine.advance(100)
    floor = engine.fixtures.floor
    assert floor == pytest.approx(1e-4 * math.sin(2 * math.pi * 30 * 100 * engine.time_step), rel=1e-9)
    assert engine.state().positions[0, 2] - rested == pytest.approx(floor, abs=3e-6)
    assert engine.state().velocities[0, 2] == pytest.approx(engine.fixtures.velocity, abs=2e-3)
    assert math.isnan(engine.account.given)
    engine.fixtures.stop()
    engine.advance(200)
    assert engine.fixtures.floor == floor
    assert engine.state().positions[0, 2] - rested == pytest.approx(floor, abs=1e-7)
    assert not math.isnan(engine.account.given)


def test_the_wall_holds_until_it_is_taken_away(build: Build) -> None:
    engine = build(small({"container": {"radius_m": 0.0105}}), gravity=0.0)
    put(engine, (0, 0, 0.01), turns=(Rotation.from_rotvec([0.2, 0.1, 0]),), speed=0.1)
    engine.advance(1)
    engine.still()
    assert not engine.state().link_velocities.any()
    assert engine.account.dissipated > 0
    engine.advance(50)
    assert np.abs(engine.state().velocities).max() < 1e-9
    # Beside the wall it overlaps, and is pushed back.
    other = build(small({"container": {"radius_m": 0.0105}}), gravity=0.0)
    put(other, (0.0027, 0, 0.01))
    inside = other.overlaps(1.0).deepest
    assert inside > 0
    other.fixtures.remove_wall()
    assert other.overlaps(1.0).deepest == 0
    other.advance(50)
    assert np.abs(other.state().velocities).max() < 1e-12
    third = build(small({"container": {"radius_m": 0.0105}}), gravity=0.0)
    put(third, (0.0027, 0, 0.01))
    third.advance(50)
    assert third.state().velocities[0, 0] < -1e-3


def test_adding_leaves_contacts_as_they_were(build: Build) -> None:
    """Springs of friction of those that lie on each other stay, whoever is added."""
    engine, rng = build(small({"container": {"radius_m": 0.0105}}), ranks=1), np.random.default_rng(5)
    put(engine, *((0, 0, 0.012 * (k + 1)) for k in range(4)), turns=tuple(Rotation.random(4, random_state=rng)))
    engine.advance(2500)
    assert engine.neighbours().min() > 0
    before = engine._moving.forces
    put(engine, (0, 0, 0.09))
    engine.advance(1)
    changed = np.linalg.norm(engine._moving.forces[:4] - before, axis=1) / (engine.particle.boxes.mass * G)
    assert changed.max() < 0.02
