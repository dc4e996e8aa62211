"""Gauss's integral of polygons whose linking is known, and of open ones against quadrature."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.spatial.transform import Rotation

from postprocess.measures.linking import gauss_integral, linking

SQUARE = np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]])
THROUGH = SQUARE[:, [0, 2, 1]] + [1.0, 0, 0]
MIRROR = np.array([1.0, 1.0, -1.0])


def quadrature(first, second):
    """The double integral as it is defined, segment by segment."""
    total = 0.0
    for p, u in zip(first, np.diff(first, axis=0), strict=False):
        for q, v in zip(second, np.diff(second, axis=0), strict=False):
            normal = np.cross(u, v)

            def density(s, t, *, apart=p - q, u=u, v=v, normal=normal):
                return apart @ normal / np.linalg.norm(apart + s * u - t * v) ** 3

            total += dblquad(density, 0, 1, 0, 1, epsabs=1e-10)[0]
    return total / (4 * math.pi)


def test_two_linked_squares_are_linked_once():
    assert gauss_integral(SQUARE, THROUGH) == pytest.approx(-1, abs=1e-14)
    assert gauss_integral(SQUARE[::-1], THROUGH) == pytest.approx(1, abs=1e-14)
    assert gauss_integral(SQUARE[::-1], THROUGH[::-1]) == pytest.approx(-1, abs=1e-14)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_open_chains_agree_with_quadrature(scene, seed):
    first, second = scene(2, seed, box=0.8)
    expected = quadrature(first, second)
    assert abs(expected) > 1e-3
    assert gauss_integral(first, second) == pytest.approx(expected, abs=1e-8)


def test_a_mirror_turns_the_sign_and_a_motion_nothing(scene):
    first, second = scene(2, 5, box=0.8)
    number = gauss_integral(first, second)
    assert gauss_integral(first * MIRROR, second * MIRROR) == pytest.approx(-number, rel=1e-12)
    assert gauss_integral(second, first) == pytest.approx(number, rel=1e-12)
    turn = Rotation.random(rng=np.random.default_rng(1)).as_matrix()
    moved = [1e-3 * (curve @ turn.T + [3.0, 1, 2]) for curve in (first, second)]
    assert gauss_integral(*moved) == pytest.approx(number, rel=1e-10)


def test_closed_across_their_mouths_smarticles_have_whole_numbers(scene):
    vertices = scene(40, 0, box=1.2, angles=(90, 90))
    i, j = np.triu_indices(40, k=1)
    closed = np.concatenate([vertices, vertices[:, :1]], axis=1)
    number = gauss_integral(closed[i], closed[j])
    np.testing.assert_allclose(number, number.round(), atol=1e-12)
    assert (number.round() != 0).sum() > 50


def test_near_pairs_of_a_pile_and_the_mean_of_their_sizes(scene):
    vertices = scene(60, 3, box=2.0, angles=(90, 90))
    near = linking(vertices)
    assert 0 < len(near.number) < 60 * 59 / 2
    assert near.number == pytest.approx(gauss_integral(vertices[near.i], vertices[near.j]))
    assert near.mean == pytest.approx(2 * np.abs(near.number).sum() / 60)
    assert near.per_smarticle[7] == pytest.approx(np.abs(near.number[(near.i == 7) | (near.j == 7)]).sum())
    assert math.isnan(linking(np.empty((0, 4, 3))).mean)
    assert linking(vertices[:1]).mean == 0
