"""LAMMPS under mpirun against known answers: free flight, rest, the law, and one rank against two."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.placement import Poses
from dem.engine.demand import contact_law_of
from dem.engine.lammps.engine import LammpsEngine
from dem.plan.steps import time_step
from dem.scene.scene import Scene
from validation.known.theory import dashpot_impact

Build = Callable[..., LammpsEngine]
UPRIGHT = Rotation.from_euler("y", -90, degrees=True)


def put(
    engine: LammpsEngine, *places: tuple[float, float, float], turns: tuple[Rotation, ...] = (), speed: float = 0
) -> None:
    """Add smarticles at places [m]."""
    given = turns or (Rotation.identity(),) * len(places)
    engine.add(Poses(np.array(places), given), speed=speed)


def test_one_rank_and_two_move_smarticles_alike(build: Build) -> None:
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
    engine.boundaries.shake(amplitude=1e-4, frequency=30.0)  # 0.36 g: it stays on the floor
    engine.advance(100)
    floor = engine.boundaries.floor
    assert floor == pytest.approx(1e-4 * math.sin(2 * math.pi * 30 * 100 * engine.time_step), rel=1e-9)
    assert engine.state().positions[0, 2] - rested == pytest.approx(floor, abs=3e-6)
    assert engine.state().velocities[0, 2] == pytest.approx(engine.boundaries.velocity, abs=2e-3)
    assert math.isnan(engine.ledger.given)
    engine.boundaries.stop()
    engine.advance(200)
    assert engine.boundaries.floor == floor
    assert engine.state().positions[0, 2] - rested == pytest.approx(floor, abs=1e-7)
    assert not math.isnan(engine.ledger.given)


def test_a_tap_begins_and_ends_at_rest_and_carries_what_lies_on_the_floor(build: Build) -> None:
    engine = build(small({"container": {"radius_m": 0.0105}}))
    put(engine, (0, 0, engine.particle.radius))
    engine.advance(200)
    rested, steps = engine.state().positions[0, 2], round(1 / 30 / engine.time_step)
    frequency = 1 / (steps * engine.time_step)
    engine.boundaries.shake(amplitude=1e-4, frequency=frequency, from_rest=True)
    assert engine.boundaries.floor == pytest.approx(0.0, abs=1e-15)
    for part in range(1, 5):
        engine.advance(steps * part // 4 - steps * (part - 1) // 4)
        turn = 2 * math.pi * (steps * part // 4) / steps
        assert engine.boundaries.floor == pytest.approx(1e-4 * (1 - math.cos(turn)), abs=1e-12)
        assert engine.state().positions[0, 2] - rested == pytest.approx(engine.boundaries.floor, abs=3e-6)
    engine.boundaries.stop_shaking()
    assert engine.boundaries.floor == pytest.approx(0.0, abs=1e-12)
    engine.advance(100)
    assert engine.state().positions[0, 2] == pytest.approx(rested, abs=1e-7)


def test_the_wall_holds_until_it_is_taken_away(build: Build) -> None:
    engine = build(small({"container": {"radius_m": 0.0105}}), gravity=0.0)
    put(engine, (0, 0, 0.01), turns=(Rotation.from_rotvec([0.2, 0.1, 0]),), speed=0.1)
    engine.advance(1)
    engine.still()
    assert not engine.state().link_velocities.any()
    assert engine.ledger.dissipated > 0
    engine.advance(50)
    assert np.abs(engine.state().velocities).max() < 1e-9
    # Beside the wall it overlaps, and is pushed back.
    other = build(small({"container": {"radius_m": 0.0105}}), gravity=0.0)
    put(other, (0.0027, 0, 0.01))
    inside = other.overlaps(1.0).deepest
    assert inside > 0
    other.boundaries.remove_wall()
    assert other.overlaps(1.0).deepest == 0
    other.advance(50)
    assert np.abs(other.state().velocities).max() < 1e-12
    third = build(small({"container": {"radius_m": 0.0105}}), gravity=0.0)
    put(third, (0.0027, 0, 0.01))
    third.advance(50)
    assert third.state().velocities[0, 0] < -1e-3


def bar(restitution: float) -> tuple[Scene, float]:
    """A scene of straight smarticles, and a time step [s] that resolves a contact in some hundred."""
    scene = small({"smarticle": {"aspect_ratio": 0}, "contact": {"restitution": restitution}})
    return scene, time_step(scene) / 8


def stepped(engine: LammpsEngine, steps: int) -> NDArray[np.float64]:
    """(steps, N, 3) forces of contacts [N] on smarticles after each of some steps; there is no gravity."""
    found = []
    for _ in range(steps):
        engine.advance(1)
        found.append(engine._moving.forces)
    return np.array(found)


def test_the_floor_gives_back_what_its_law_says_and_never_pulls(build: Build) -> None:
    # A dashpot that is allowed to pull would, over much of the way back.
    scene, dt = bar(restitution=0.2)
    engine, law, speed = build(scene, ranks=1, gravity=0.0, time_step=dt), contact_law_of(scene), 0.5
    put(engine, (0, 0, scene.smarticle.middle_length_m / 2 + 1e-5), turns=(UPRIGHT,), speed=speed)
    forces = stepped(engine, 800)[:, 0, 2]
    exact = dashpot_impact(
        stiffness=law.normal_stiffness, damping=law.wall_damping, mass=scene.body.boxes.mass
    ).restitution
    assert forces.max() > 0 == forces[-1]
    assert forces.min() > -1e-9 * forces.max()
    assert engine.state().velocities[0, 2] / speed == pytest.approx(exact, rel=0.02)


def test_two_that_meet_part_as_their_law_says_and_never_pull(build: Build) -> None:
    scene, dt = bar(restitution=0.5)
    engine, law, speed = build(scene, ranks=1, gravity=0.0, time_step=dt), contact_law_of(scene), 0.5
    put(engine, (0, 0, 0.02), turns=(UPRIGHT,))
    put(engine, (0, 0, 0.02 + scene.smarticle.middle_length_m + 1e-5), turns=(UPRIGHT,), speed=speed)
    forces = stepped(engine, 800)[:, :, 2]
    mass = scene.body.boxes.mass
    exact = dashpot_impact(stiffness=law.normal_stiffness, damping=law.normal_damping, mass=mass / 2).restitution
    after = engine.state().velocities[:, 2]
    assert forces[:, 1].max() > 0 == forces[-1, 1]
    assert forces[:, 1].min() > -1e-9 * forces.max()
    assert (after[1] - after[0]) / speed == pytest.approx(exact, rel=0.02)
    assert after.sum() == pytest.approx(-speed, rel=1e-9)
