"""Linking numbers and writhe of curves for which they are known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic.curves import rings, torus_curve, whitehead

from dem.errors import InputError
from postprocess import closed_linking, link_crossings, writhe, writhes

MIRROR = np.array([1.0, 1.0, -1.0])
CIRCLE = torus_curve(1, 0)
LINKS = {
    "Hopf": ((torus_curve(1, 1), torus_curve(1, 1, shift=np.pi)), -1),
    "(2,4) torus link": ((torus_curve(1, 2), torus_curve(1, 2, shift=np.pi)), -2),
    "mirrored (2,4)": ((torus_curve(1, 2) * MIRROR, torus_curve(1, 2, shift=np.pi) * MIRROR), 2),
    "one reversed": ((torus_curve(1, 2)[::-1], torus_curve(1, 2, shift=np.pi)), 2),
    "Whitehead": (whitehead(), 0),
    "rings side by side": ((CIRCLE, CIRCLE + np.array([0.0, 0, 0.5])), 0),
    "rings far apart": ((CIRCLE, CIRCLE + np.array([50.0, 0, 0])), 0),
}


@pytest.mark.parametrize("name", LINKS)
def test_links_have_their_whole_numbers(name):
    curves, expected = LINKS[name]
    found = closed_linking(*rings(*curves))
    assert found.number.tolist() == [expected] * (expected != 0)
    assert found.closed.tolist() == [True, True]
    assert found.mean == abs(expected)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_motions_and_the_order_of_segments_keep_the_number_of_links(seed):
    random = np.random.default_rng(seed)
    segments, body = rings(torus_curve(1, 2), torus_curve(1, 2, shift=np.pi), CIRCLE + np.array([9.0, 0, 0]))
    turned = segments @ Rotation.random(rng=random).as_matrix().T + random.normal(size=3)
    order = random.permutation(len(segments))
    found = closed_linking(turned[order], 10 - body[order])
    # The first segment of a ring gives its direction, and thus the sign.
    assert np.abs(found.number).tolist() == [2]
    assert (found.bodies[found.i[0]], found.bodies[found.j[0]]) == (9, 10)


def test_smarticles_closed_straight_are_linked_as_their_crossings_say(scene):
    """A pair hooks if and only if an odd number of edges of one outline passes through the other one's plane."""
    pile = scene(30, 1, box=1.5, angles=(90, 90))
    links = np.stack([pile[:, :-1], pile[:, 1:]], axis=2).reshape(-1, 2, 3)
    found = closed_linking(links, np.repeat(np.arange(30), 3))
    outlines = np.stack([pile, np.roll(pile, -1, axis=1)], axis=2)
    assert not found.closed.any()
    assert len(found.number) > 30
    each = [np.abs(found.number[(found.i == k) | (found.j == k)]).sum() for k in range(30)]
    np.testing.assert_array_equal(found.per_body, each)
    assert np.abs(found.number).max() <= 2
    hooked = set(zip(found.i[found.number % 2 == 1].tolist(), found.j[found.number % 2 == 1].tolist(), strict=True))
    for i, j in ((0, 1), (3, 7), *list(hooked)[:10]):
        # Links of length 0 close the outline as two smarticles of one edge each.
        edges = [np.stack([a, a, b, b]) + 0.0 for a, b in outlines[j]]
        passing = sum(int(link_crossings([pile[i], edge])[0]) for edge in edges)
        assert passing % 2 == ((i, j) in hooked)


def test_rods_are_linked_with_nothing_and_a_star_has_no_number():
    ring = rings(CIRCLE)
    rod = np.array([[[2.0, 0, -1], [2, 0, 1]]])
    assert len(closed_linking(np.concatenate([ring[0], rod]), np.append(ring[1], 1)).number) == 0
    star = np.array([[[0.0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, 1]]])
    with pytest.raises(InputError, match="body 5 has no linking number: it branches, or meets itself"):
        closed_linking(star, np.full(3, 5))
    with pytest.raises(InputError, match="body 0 has no writhe: it has several pieces that do not touch"):
        writhes(star + np.arange(3)[:, None, None], np.zeros(3, dtype=int))


def test_curves_that_touch_in_a_point_have_no_number():
    square = np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    through = square[:, [0, 2, 1]] + [2.0, 0, 0]
    found = closed_linking(*rings(square, through))
    assert len(found.number) == 1
    assert np.isnan(found.number[0])
    assert np.isnan(found.mean)


def quadrature(ends):
    """The double integral of the writhe, by Gauss-Legendre quadrature with 40 × 40 points per pair of segments."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    nodes, weights = (nodes + 1) / 2, weights / 2
    along = ends[:, 1] - ends[:, 0]
    total = 0.0
    for i in range(len(ends)):
        for j in range(i + 2, len(ends)):
            if (i, j) == (0, len(ends) - 1):
                continue
            apart = ends[i, 0] - ends[j, 0]
            r = apart + nodes[:, None, None] * along[i] - nodes[None, :, None] * along[j]
            density = (apart @ np.cross(along[i], along[j])) / np.linalg.norm(r, axis=2) ** 3
            total += weights @ density @ weights
    return 2 * total / (4 * math.pi)


def test_the_writhe_of_a_trefoil_polygon_agrees_with_quadrature():
    corners = torus_curve(2, 3, corners=15)
    expected = quadrature(np.stack([corners, np.roll(corners, -1, axis=0)], axis=1))
    assert writhe(corners, closed=True) == pytest.approx(expected, abs=1e-6)
    assert writhe(corners * MIRROR, closed=True) == pytest.approx(-expected, abs=1e-6)
    assert writhe(corners[::-1], closed=True) == pytest.approx(expected, abs=1e-6)
    # Ideal trefoils have 3.4; this one, on a torus of radii 2 and 1, is not far from ideal.
    assert 3.2 < abs(expected) < 3.6
    assert writhes(*rings(corners, corners * MIRROR)) == pytest.approx([expected, -expected], abs=1e-6)


def test_the_writhe_of_a_helix_grows_by_its_turns():
    """1 - sin(pitch angle) per turn (Fuller 1971), which the ends of an open helix do not change."""
    slope = 0.3

    def helix(turns):
        t = 2 * np.pi * np.arange(60 * turns + 1) / 60
        return writhe(np.stack([np.cos(t), np.sin(t), slope * t], axis=1), closed=False)

    # 60 corners per turn: the polygon is off by some (2π / 60)² / 12 of a turn.
    assert (helix(30) - helix(20)) / 10 == pytest.approx(1 - slope / math.hypot(1, slope), abs=2e-3)


def test_plane_curves_have_no_writhe():
    random = np.random.default_rng(2)
    turn = Rotation.random(rng=random).as_matrix()
    t = 2 * np.pi * np.arange(20) / 20
    star = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1) * (1 + 0.5 * np.cos(5 * t))[:, None]
    assert writhe(star @ turn.T, closed=True) == pytest.approx(0, abs=1e-9)
    assert writhe((star @ turn.T)[:12], closed=False) == pytest.approx(0, abs=1e-9)
    with pytest.raises(InputError, match="corners that follow each other must not coincide"):
        writhe([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]], closed=True)
