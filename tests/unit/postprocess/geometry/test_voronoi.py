"""Set-Voronoi cells found slab by slab are those found at once."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Voronoi

from postprocess.geometry import voronoi


def hull_volumes(points, count):
    """Of the first cells, each as the hull of its corners: another way to them."""
    diagram = Voronoi(points)
    cells = [diagram.regions[region] for region in diagram.point_region[:count]]
    return np.array([np.inf if -1 in cell else ConvexHull(diagram.vertices[cell]).volume for cell in cells])


def pile(random):
    """Points that lie thick below and thin above, with an empty hole, whose cells differ by a factor of a thousand."""
    points = random.random((1500, 3)) * [4.0, 1.0, 1.0]
    points[:, 2] **= 3
    return points[np.linalg.norm(points - [2.0, 0.5, 0.5], axis=1) > 0.35]


@pytest.fixture(scope="module")
def known():
    points = pile(np.random.default_rng(0))
    return points, hull_volumes(points, len(points) - 200)


@pytest.mark.parametrize("reach", [0.02, 0.1, 3.0])
@pytest.mark.parametrize("together", [150])
def test_slab_by_slab_is_all_at_once(known, reach, together):
    points, expected = known
    found = voronoi._cell_volumes(points, len(expected), reach=reach, together=together)
    assert np.isinf(expected).any()
    assert np.nanmax(expected[np.isfinite(expected)]) > 1000 * expected.min()
    np.testing.assert_allclose(found, expected, rtol=1e-9)
