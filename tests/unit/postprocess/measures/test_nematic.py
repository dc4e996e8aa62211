"""Nematic order of directions whose order is known."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic.curves import rings, torus_curve

from dem.errors import InputError
from postprocess.measures.nematic import body_axes, nematic_order, opening_directions, polar_order, segment_order


def test_parallel_and_antiparallel_directions_have_order_one():
    axis = np.array([1.0, 2.0, 2.0]) / 3
    order = nematic_order(np.outer([1, -2, 3, -0.1], axis))
    assert order.order == pytest.approx(1, abs=1e-12)
    np.testing.assert_allclose(order.director, axis, atol=1e-12)
    assert math.cos(order.polar_angle) == pytest.approx(2 / 3)
    assert order.upright == pytest.approx((3 * (2 / 3) ** 2 - 1) / 2)


def test_all_level_the_director_is_not_the_vertical():
    angle = np.linspace(0, np.pi, 1000, endpoint=False)
    order = nematic_order(np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1))
    assert order.order == pytest.approx(0.25, abs=1e-9)
    assert order.polar_angle == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("count", [40, 1000])
def test_random_directions_have_only_what_their_number_gives(count):
    """0.8 / N^½ and not 0: the largest of three eigenvalues that scatter about 0."""
    random = np.random.default_rng(3)
    orders = [nematic_order(random.normal(size=(count, 3))).order for _ in range(200)]
    assert np.mean(orders) * count**0.5 == pytest.approx(0.82, abs=0.06)


def test_a_turned_pile_keeps_its_order_and_turns_its_director():
    random = np.random.default_rng(5)
    directions = random.normal(size=(50, 3)) * [1, 1, 3]
    before, after = nematic_order(directions), nematic_order(directions[:, [2, 0, 1]])
    assert after.order == pytest.approx(before.order) == pytest.approx(0.5, abs=0.3)
    assert abs(before.director[[2, 0, 1]] @ after.director) == pytest.approx(1)


TURN = Rotation.random(rng=np.random.default_rng(8)).as_matrix()
U = np.array([[[-1.0, 2, 0], [-1, 0, 0]], [[-1, 0, 0], [1, 0, 0]], [[1, 0, 0], [1, 2, 0]]])


def test_weights_count_as_copies():
    directions = np.random.default_rng(1).normal(size=(6, 3))
    copies = np.repeat(directions, [1, 2, 3, 1, 1, 4], axis=0)
    weighted = nematic_order(directions, [1, 2, 3, 1, 1, 4])
    np.testing.assert_allclose(weighted.tensor, nematic_order(copies).tensor, atol=1e-14)
    with pytest.raises(InputError, match="weights must be 6 numbers above 0, one per direction"):
        nematic_order(directions, [1, 2, 3, 1, 1, 0])


def test_polar_order_sees_the_signs_that_nematic_order_does_not():
    up = np.outer([1, 2, 3, 4], TURN[0])
    assert polar_order(up).order == pytest.approx(1)
    np.testing.assert_allclose(polar_order(up).vector, TURN[0])
    mixed = up * [[1], [-1], [1], [-1]]
    assert polar_order(mixed).order == pytest.approx(0, abs=1e-12)
    assert nematic_order(mixed).order == pytest.approx(1)
    random = np.random.default_rng(3)
    orders = [polar_order(random.normal(size=(400, 3))).order for _ in range(300)]
    # (8 / 3π)^½ / N^½ on average; the error of 300 sets is 2 %.
    assert np.mean(orders) * 20 == pytest.approx(0.921, abs=0.06)


def test_bodies_have_the_axes_and_openings_of_their_shape():
    segments, body = U @ TURN.T + [5.0, 0, 0], [7, 7, 7]
    np.testing.assert_allclose(opening_directions(segments, body), TURN[:, 1][None], atol=1e-12)
    np.testing.assert_allclose(opening_directions(segments[[2, 0, 1], ::-1], body), TURN[:, 1][None], atol=1e-12)
    assert abs(body_axes(segments, body, longest=False)[0] @ TURN[:, 2]) == pytest.approx(1)
    # Second moments about the centre of mass: 14/3 across the mouth, 8/3 along it.
    assert abs(body_axes(segments, body)[0] @ TURN[:, 0]) == pytest.approx(1)
    assert segment_order(segments, body).tensor == pytest.approx(
        TURN @ np.diag([1.5 / 3 - 0.5, 1.5 * 2 / 3 - 0.5, -0.5]) @ TURN.T, abs=1e-12
    )


def test_shapes_without_an_axis_or_an_opening_are_rejected():
    square, ring = rings(torus_curve(1, 0))
    assert abs(body_axes(square, ring, longest=False)[0, 2]) == pytest.approx(1)
    with pytest.raises(InputError, match=r"body 0 has no longest axis: .* use the shortest axis, or `segment_order`"):
        body_axes(square, ring)
    with pytest.raises(InputError, match="body 0 has no opening: it is closed"):
        opening_directions(square, ring)
    rod = np.array([[[0.0, 0, 0], [0, 0, 1]], [[0, 0, 1], [0, 0, 2]]])
    assert abs(body_axes(rod, [0, 0])[0, 2]) == pytest.approx(1)
    with pytest.raises(InputError, match="body 0 has no opening: its ends lie on opposite sides"):
        opening_directions(rod, [0, 0])
