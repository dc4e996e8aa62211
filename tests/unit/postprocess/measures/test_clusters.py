"""Connected parts of piles whose contacts and passages are known."""

import numpy as np
import pytest

from postprocess.geometry.links import Chain
from postprocess.measures.clusters import (
    contact_clusters,
    entanglement_clusters,
    spans_height,
    spans_width,
)

D = 1e-3
CHAIN = Chain(diameter=D, rows=1, width=D, pitch=0.0)


def row(shape, places):
    """Straight smarticles along x, one at each y [m]."""
    line = shape(0.01, 0.7, (0.0, 0.0))
    return np.array([line + np.array([0, y, 0]) for y in places])


def test_a_chain_is_one_cluster_however_long(shape):
    chain = row(shape, 0.9 * D * np.arange(20))
    clusters = contact_clusters(chain, CHAIN, D)
    assert clusters.largest == 1
    assert clusters.sizes.tolist() == [20]
    # Its ends do not touch each other: no pair of them makes the cluster, the whole chain does.
    assert contact_clusters(chain[[0, -1]], CHAIN, D).sizes.tolist() == [1, 1]


def test_the_largest_cluster_is_a_share_of_all(shape):
    places = [*(0.9 * D * np.arange(3)), *(0.1 + 0.9 * D * np.arange(5)), 0.5, 0.7]
    clusters = contact_clusters(row(shape, places), CHAIN, D)
    assert clusters.sizes.tolist() == [5, 3, 1, 1]
    assert clusters.largest == 0.5
    assert clusters.labels.tolist() == [1, 1, 1, 0, 0, 0, 0, 0, 2, 3]


def test_hooked_smarticles_are_entangled_and_touching_ones_need_not_be(shape):
    u = shape(1.0, 0.7)
    # A second U stands across the plane of the first one: its middle link passes between the barbs.
    across = u @ np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]) + np.array([0, 0.3, 0])
    beside = u + np.array([0, 0, 0.01])
    assert entanglement_clusters([u, across]).largest == 1
    assert entanglement_clusters([u, beside]).largest == 0.5
    assert contact_clusters([u, beside], CHAIN, 0.02).largest == 1
    # Whether the one passed through or the one that passes is asked first does not matter.
    assert entanglement_clusters([across, u, u + np.array([9.0, 0, 0])]).sizes.tolist() == [2, 1]


# -- what they span --------------------------------------------------------------------------------------------------


def upright(at, low=0.0, long=0.02):
    """Straight smarticles that stand at (n, 2) places [m], from a height on [m]."""
    at = np.asarray(at, dtype=float)
    heights = low + long * np.array([0, 0.3, 0.7, 1.0])
    return np.concatenate(
        [np.broadcast_to(at[:, None], (len(at), 4, 2)), np.broadcast_to(heights[:, None], (len(at), 4, 1))], axis=2
    )


def touching(vertices):
    return contact_clusters(vertices, CHAIN, D * (1 + 1e-9))  # the factor is for rounding


def test_a_stack_spans_the_height_until_one_is_missing():
    ladder = np.concatenate([upright([[k * D / 2, 0]], low=0.015 * k) for k in range(5)])
    clusters = touching(ladder)
    assert clusters.sizes.tolist() == [5]
    assert spans_height(clusters, ladder, chain=CHAIN, floor_z=0.0)
    broken = ladder[[0, 1, 3, 4]]
    clusters = touching(broken)
    assert clusters.sizes.tolist() == [2, 2]
    assert not spans_height(clusters, broken, chain=CHAIN, floor_z=0.0)
    # Hanging in the air it spans nothing.
    assert not spans_height(touching(ladder), ladder, chain=CHAIN, floor_z=-0.01)


def spokes(angles, start=0.0, end=0.03):
    """Straight smarticles from a distance from the axis to another, at angles [degree]."""
    along = np.radians(angles)[:, None, None] + np.array([0, np.pi / 2, 0])
    outwards = np.cos(np.stack([along[..., 0], along[..., 0] - np.pi / 2, np.full_like(along[..., 0], np.pi / 2)], -1))
    return outwards * (start + (end - start) * np.array([0, 0.3, 0.7, 1.0]))[:, None]


@pytest.mark.parametrize(
    ("angles", "start", "spans"),
    [
        ([0, 120, 240], 0.0, True),
        ([0, 110, 220, 230], 0.0, True),
        # All on one half of the wall, or on its two ends.
        ([0, 60, 120], 0.0, False),
        ([0, 90, 180], 0.0, False),
        # Around the wall, but of three clusters.
        ([0, 120, 240], 0.003, False),
    ],
)
def test_a_cluster_spans_the_width_where_no_half_of_the_wall_has_all_its_ends(angles, start, spans):
    star = spokes(angles, start)
    clusters = touching(star)
    assert len(clusters.sizes) == (1 if start == 0 else 3)
    assert spans_width(clusters, star, chain=CHAIN, wall_radius=0.03) is spans
    # The same star without the wall.
    assert not spans_width(clusters, star, chain=CHAIN, wall_radius=0.032)
