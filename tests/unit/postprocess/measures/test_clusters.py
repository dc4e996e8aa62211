"""Connected parts of piles whose contacts and passages are known."""

import numpy as np
import pytest

from dem.errors import InputError
from postprocess.errors import UndefinedMeasureError
from postprocess.measures.clusters import contact_clusters, entanglement_clusters

D = 1e-3


def row(shape, places):
    """Straight smarticles along x, one at each y [m]."""
    line = shape(0.01, 0.7, (0.0, 0.0))
    return np.array([line + np.array([0, y, 0]) for y in places])


def test_a_chain_is_one_cluster_however_long(shape):
    chain = row(shape, 0.9 * D * np.arange(20))
    clusters = contact_clusters(chain, D)
    assert clusters.largest == 1
    assert clusters.sizes.tolist() == [20]
    # Its ends do not touch each other: no pair of them makes the cluster, the whole chain does.
    assert contact_clusters(chain[[0, -1]], D).sizes.tolist() == [1, 1]


def test_the_largest_cluster_is_a_share_of_all(shape):
    places = [*(0.9 * D * np.arange(3)), *(0.1 + 0.9 * D * np.arange(5)), 0.5, 0.7]
    clusters = contact_clusters(row(shape, places), D)
    assert clusters.sizes.tolist() == [5, 3, 1, 1]
    assert clusters.largest == 0.5
    assert clusters.labels.tolist() == [1, 1, 1, 0, 0, 0, 0, 0, 2, 3]


def test_apart_there_is_no_cluster_to_speak_of(shape):
    assert contact_clusters(row(shape, 2 * D * np.arange(10)), D).largest == 0.1


def test_hooked_smarticles_are_entangled_and_touching_ones_need_not_be(shape):
    u = shape(1.0, 0.7)
    # A second U stands across the plane of the first one: its middle link passes between the barbs.
    across = u @ np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]) + np.array([0, 0.3, 0])
    beside = u + np.array([0, 0, 0.01])
    assert entanglement_clusters([u, across]).largest == 1
    assert entanglement_clusters([u, beside]).largest == 0.5
    assert contact_clusters([u, beside], 0.02).largest == 1
    # Whether the one passed through or the one that passes is asked first does not matter.
    assert entanglement_clusters([across, u, u + np.array([9.0, 0, 0])]).sizes.tolist() == [2, 1]


def test_nothing_has_no_cluster(shape):
    with pytest.raises(UndefinedMeasureError, match="at least 1 smarticle: got 0"):
        contact_clusters(np.empty((0, 4, 3)), D)
    with pytest.raises(InputError, match="distance must be above 0 m"):
        contact_clusters([shape()], 0.0)
