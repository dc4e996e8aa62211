from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dem.errors import InputError
from postprocess import crossing_pairs, link_crossings
from postprocess.measures.entanglement import entanglement, link_passages

U = np.array([[-1.0, 2, 0], [-1, 0, 0], [1, 0, 0], [1, 2, 0]])


def triangle_sign(start, end, a, b, c):
    """Möller–Trumbore: +1 or -1 if the segment passes the triangle, by the side it comes from."""
    along = end - start
    normal_part = np.cross(along, c - a)
    determinant = (b - a) @ normal_part
    if determinant == 0:
        return 0
    u = (start - a) @ normal_part / determinant
    other = np.cross(start - a, b - a)
    v = along @ other / determinant
    t = (c - a) @ other / determinant
    return int(np.sign(determinant)) if min(u, v, 1 - u - v, t, 1 - t) > 0 else 0


def brute_force_pairs(vertices):
    """Every link against a fan of two signed triangles, whose sum is the outline's winding."""
    found = {}
    for i, quad in enumerate(vertices):
        lengths = np.linalg.norm(np.diff(quad, axis=0), axis=1)
        if np.linalg.norm(quad[3] - quad[0]) > 0.99 * lengths.sum():
            continue
        for j, other in enumerate(vertices):
            passing = sum(
                triangle_sign(p, q, *quad[[0, 1, 2]]) + triangle_sign(p, q, *quad[[0, 2, 3]]) != 0
                for p, q in pairwise(other)
            )
            if i != j and passing:
                found[i, j] = passing
    return found


@pytest.mark.parametrize("angles", [None, (90, 90), (60, 60), (105, 105)])
@pytest.mark.parametrize("seed", [0, 1])
def test_random_scenes_match_brute_force(scene, angles, seed):
    vertices = scene(18, seed, box=1.2, angles=angles)
    expected = brute_force_pairs(vertices)
    assert len(expected) > 20
    pairs = crossing_pairs(vertices)
    found = {(i, j): n for i, j, n in zip(*(p.tolist() for p in pairs), strict=True)}
    assert found == expected
    counts = np.zeros(18, dtype=int)
    for (i, _), number in expected.items():
        counts[i] += number
    np.testing.assert_array_equal(link_crossings(vertices), counts)


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        # Mouths face each other: each middle link passes through the other's plane.
        ([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], [1, 1]),
        # Mouths face the same way: only the closing edge of U passes through the other's plane.
        ([[0, 3, -1], [0, 1, -1], [0, 1, 1], [0, 3, 1]], [1, 0]),
        # Both barbs pass, and count twice.
        ([[-0.5, 1, -1], [-0.5, 1, 1], [0.5, 1, 1], [0.5, 1, -1]], [2, 0]),
    ],
)
def test_hooked(other, expected):
    pile = [U, np.array(other, dtype=float)]
    assert link_crossings(pile).tolist() == expected
    first = crossing_pairs(pile)
    assert (first.i[0], first.j[0], first.links[0]) == (0, 1, expected[0])


def pin(x, y, low=-1.0, high=1.0):
    """A smarticle with a barb along z from `low` to `high` at x, y and the rest far off."""
    return np.array([[x, y, low], [x, y, high], [x, y + 4, high], [x, y + 4, low]])


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (pin(0, 1), 1),
        (pin(0, 1e-6), 1),
        (pin(0, 0), 0),  # meets the middle link
        (pin(1, 1), 0),  # meets a barb
        (pin(-1, 2), 0),  # meets a tip
        (pin(0.3, 2), 0),  # meets the closing edge of the mouth
        (pin(0.3, 1.999), 1),
        (pin(0, -1e-6), 0),
        (pin(0, 1, low=0.0), 0),  # ends in the plane
        (pin(0, 1, low=0.5), 0),  # ends short of it
        (np.array([[0.0, 1, 0], [0.5, 1, 0], [0.5, 1.5, 0], [0, 1.5, 0]]), 0),  # lies in it
        (np.array([[0.0, 1, -1], [0, 1, 0], [0.2, 1, 1], [0.4, 1, 1]]), 1),  # passes with a hinge in the plane
        (np.array([[0.0, 1, -1], [0, 1, 0], [0.2, 1, 0], [0.2, 1, 1]]), 1),  # with its middle link in the plane
        (np.array([[0.0, 1, 1], [0, 1, 0], [0.2, 1, 1], [0.4, 1, 1]]), 0),  # its hinge touches the plane
    ],
)
def test_touching_is_not_passing(other, expected):
    turn = Rotation.from_rotvec([0.3, -0.7, 0.2]).as_matrix()
    assert link_crossings([U, other])[0] == expected
    # Rounding must not decide: the same after a turn, and with A's vertices in reverse order.
    assert link_crossings(np.array([U, other]) @ turn.T)[0] == expected
    assert link_crossings([U[::-1], other])[0] == expected


def test_a_passage_by_a_hinge_is_at_the_hinge():
    passing = np.array([[0.0, 1, -1], [0.1, 1.2, 0], [0.2, 1, 1], [0.4, 1, 1]])
    found = link_passages([U, passing])
    assert (found.i.tolist(), found.j.tolist()) == ([0], [1])
    assert found.point == pytest.approx(passing[1:2])


def test_straight_smarticles_pass_but_are_skipped_in_the_mean(shape):
    needle = np.array([[0.0, 1, -2], [0, 1, -0.5], [0, 1, 0.5], [0, 1, 2]])
    result = entanglement([U, needle, U + np.array([9, 0, 0])])
    np.testing.assert_array_equal(result.crossings, [1, 0, 0])
    np.testing.assert_array_equal(result.has_plane, [True, False, True])
    assert result.mean == 0.5
    assert np.isnan(entanglement([needle, needle + 0.1]).mean)


@settings(max_examples=25, deadline=None)
@given(
    rotation=st.tuples(*[st.floats(-3, 3)] * 3),
    shift=st.tuples(*[st.floats(-10, 10)] * 3),
    scale=st.floats(1e-3, 10),
    seed=st.integers(0, 50),
)
def test_rigid_motion_scale_and_order_change_nothing(scene, rotation, shift, scale, seed):
    vertices = scene(12, seed, box=1.2)
    expected = link_crossings(vertices)
    turn = Rotation.from_rotvec(rotation).as_matrix()
    moved = scale * (vertices @ turn.T + shift)
    np.testing.assert_array_equal(link_crossings(moved), expected)
    np.testing.assert_array_equal(link_crossings(moved[:, ::-1]), expected)
    np.testing.assert_array_equal(link_crossings(moved[::-1]), expected[::-1])


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (np.zeros((4, 3)), r"must be \(N, 4, 3\) \[m\]: got \(4, 3\)"),
        (np.full((1, 4, 3), np.nan), "smarticle 0 is not"),
        (np.zeros((2, 4, 3)), "coincide"),
    ],
)
def test_bad_vertices(bad, message):
    with pytest.raises(InputError, match=message):
        link_crossings(bad)
