"""What a run is made of: what the watchdog looks at of smooth links and of chains of spheres."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import small
from scipy.spatial.transform import Rotation

from dem.body.state import State
from dem.run.build import watched_points


@pytest.mark.parametrize("fidelity", ["draft", "reference"])
def test_points_of_smooth_links_reach_as_far_as_all_spheres_do(fidelity: str) -> None:
    scene = small({"engine": "links", "fidelity": fidelity})
    rng, particle = np.random.default_rng(1), scene.particle
    turns = Rotation.random(50, random_state=2).as_matrix()
    still = np.zeros((50, 3))
    state = State.rigid(particle.boxes, rng.normal(size=(50, 3)), turns, still, still)
    points, spheres = watched_points(scene)(state), state.spheres(particle)
    assert points.shape[1] == 9 * scene.fidelity.rows
    np.testing.assert_allclose(points.min(axis=1), spheres.min(axis=1), atol=1e-12)
    np.testing.assert_allclose(points.max(axis=1), spheres.max(axis=1), atol=1e-12)
    on_yade = small({"fidelity": fidelity})
    assert watched_points(on_yade)(state).shape == state.spheres(on_yade.particle).shape
