"""Motion without contacts: what has to be conserved is."""

import math

import builds
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


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
        start, along = made._world.segments.line[0, :3], made._world.segments.line[0, 3:6]
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
