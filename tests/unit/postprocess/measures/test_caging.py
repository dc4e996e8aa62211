"""Cages that are known, and the number of random contacts that cage a shape."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from dem.errors import InputError
from postprocess import cages, caging_number
from postprocess.measures.caging import contact_normals, positively_spans

U = np.array([[[-1.0, 2, 0], [-1, 0, 0]], [[-1, 0, 0], [1, 0, 0]], [[1, 0, 0], [1, 2, 0]]])
ROD = np.array([[[-10.0, 0, 0], [10, 0, 0]]])


def rods_around(places):
    """Rods along z that touch a rod along x of diameter 1, by (x, y) of their axes."""
    return np.concatenate([ROD, *([[[x, y, -2], [x, y, 2]]] for x, y in places)])


def turned(segments, seed=0):
    return segments @ Rotation.random(rng=np.random.default_rng(seed)).as_matrix().T + [1.0, 2, 3]


@pytest.mark.parametrize(("normals", "free"), [(1, 1 / 2), (2, 1 / 4), (3, 1 / 8)])
def test_each_right_angled_contact_halves_the_directions_that_are_free(normals, free):
    """Short rods below, behind and beside a short rod."""
    middle = np.array([[[0.0, 0, -0.01], [0, 0, 0.01]]])
    others = [np.roll([[-1.0, 0, 0.1], [-1, 0, -0.1]], k, axis=1) for k in range(2)] + [[[0, 0, -1.0], [0, 0.01, -1.0]]]
    segments = np.concatenate([middle, np.array(others)[:normals]])
    found = cages(segments, np.arange(normals + 1), diameter=1.0)
    assert found.free[0] == pytest.approx(free, abs=0.02)
    assert found.contacts[0] == normals
    assert not found.translation.any()


def test_a_rod_between_four_others_is_held_only_with_contacts_across():
    """Across its axis it needs contacts from three sides or more; along and about its axis nothing can hold it."""
    sides = rods_around([(-5, 1), (5, 1), (-5, -1), (5, -1)])
    found = cages(turned(sides), np.arange(5), diameter=1.0 + 1e-9)
    assert found.contacts.tolist() == [4, 1, 1, 1, 1]
    assert not found.translation[0]  # it can move along z
    across = np.array([[[x, -2, z], [x, 2, z]] for x, z in ((-6, 1), (6, 1), (-6, -1), (6, -1))])
    held = cages(turned(np.concatenate([sides, across])), np.arange(9), diameter=1.0 + 1e-9)
    assert held.translation.tolist() == [True] + [False] * 8
    assert held.motion.tolist() == [True] + [False] * 8
    # Contacts in the middle alone hold it in place but let it turn.
    middle = np.concatenate(
        [rods_around([(0, 1), (0, -1)]), [[[0.5, -2, 1], [0.5, 2, 1]], [[0.5, -2, -1], [0.5, 2, -1]]]]
    )
    found = cages(middle, np.arange(5), diameter=1.0)
    assert found.translation[0]
    assert not found.motion[0]
    np.testing.assert_array_equal(found.motion, cages(turned(middle), np.arange(5), diameter=1.0 + 1e-9).motion)


def test_normals_point_into_their_bodies():
    body, point, normal = contact_normals(rods_around([(3, 1)]), np.arange(2), diameter=1.0)
    assert body.tolist() == [0, 1]
    np.testing.assert_allclose(point, [[3, 0.5, 0]] * 2)
    np.testing.assert_allclose(normal, [[0, -1, 0], [0, 1, 0]])
    thick = contact_normals(rods_around([(3, 1)]), np.arange(2), diameter=[0.5, 1.5])
    np.testing.assert_allclose(thick.point, [[3, 0.25, 0]] * 2)
    assert len(contact_normals(rods_around([(3, 1)]), np.arange(2), diameter=[0.5, 1.4]).body) == 0


def test_contacts_of_one_body_with_itself_do_not_count():
    assert cages(U, np.zeros(3, dtype=int), diameter=2.5).contacts.tolist() == [0]


def test_random_normals_cage_with_the_probability_of_wendel():
    """N points on a sphere lie in one half of it with probability 2^(1 - N) Σ binomial(N - 1, k), k < 3."""
    random = np.random.default_rng(2)
    for count in (4, 7, 12):
        expected = 1 - sum(math.comb(count - 1, k) for k in range(3)) / 2 ** (count - 1)
        found = np.mean([positively_spans(random.normal(size=(count, 3))) for _ in range(1000)])
        assert found == pytest.approx(expected, abs=4 * math.sqrt(expected * (1 - expected) / 1000))


def test_vectors_span_or_leave_a_motion_that_linear_programming_finds():
    random = np.random.default_rng(6)
    spanning = 0
    for _ in range(200):
        vectors = random.normal(size=(13, 6))
        # The largest common component along a motion of bounded size is 0 only if there is no free motion.
        best = linprog(-vectors.sum(axis=0), A_ub=-vectors, b_ub=np.zeros(13), bounds=[(-1, 1)] * 6)
        spanning += positively_spans(vectors)
        assert positively_spans(vectors) == (best.fun > -1e-9)
    assert 60 < spanning < 140


def test_a_thin_rod_has_the_caging_number_nine():
    found = caging_number(turned(ROD), trials=1500)
    assert found.value == pytest.approx(9, abs=4 * found.standard_error)
    assert found.standard_error < 0.1


def test_the_caging_number_of_a_bent_body_is_above_that_of_independent_contacts():
    """Six motions need 13 contacts if any six are independent, which those on one link are not."""
    number, moved = caging_number(U), caging_number(1e-3 * turned(U), seed=1)
    assert 13.5 < number.value < 15.5
    assert moved.value == pytest.approx(number.value, abs=4 * math.hypot(number.standard_error, moved.standard_error))
    with pytest.raises(InputError, match="a segment is far shorter than others"):
        caging_number(U * [1, 1e-5, 1], trials=2)


@pytest.mark.parametrize(("diameter", "gap"), [(0, 0), ([1, 1], 0), (float("nan"), 0), (1, -1)])
def test_bad_sizes_are_rejected(diameter, gap):
    with pytest.raises(InputError, match="a contact needs one diameter above 0 m, or one per segment, and a gap of"):
        cages(U, [0, 1, 2], diameter=diameter, gap=gap)
