"""Nematic order of directions whose order is known."""

import math

import numpy as np
import pytest

from postprocess.measures.nematic import nematic_order


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
