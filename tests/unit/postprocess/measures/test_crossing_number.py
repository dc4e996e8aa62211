"""Average crossing numbers against counts of crossings in projections, analytic means and invariances."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic.curves import random_rods, rings, torus_curve

from dem.errors import InputError
from postprocess import average_crossing_numbers, crossing_field, gauss_integral, grid_points, region_spans


def crossings_seen(first, second, directions):
    """Number of crossings of two sets of segments in the projection along each direction."""
    found = np.zeros(len(directions))
    for p, q in first:
        for r, s in second:
            # In the projection two segments cross if the ends of each lie on both sides of the other one.
            side = [
                np.einsum("nc,nc->n", directions, np.cross(b - a, np.broadcast_to(c - a, directions.shape)))
                for a, b, c in ((p, q, r), (p, q, s), (r, s, p), (r, s, q))
            ]
            found += (side[0] * side[1] < 0) & (side[2] * side[3] < 0)
    return found


@pytest.mark.parametrize("seed", [0, 1])
def test_half_of_the_crossings_that_are_seen_from_random_directions(scene, seed):
    pile = scene(2, seed, box=0.8)
    links = np.stack([pile[:, :-1], pile[:, 1:]], axis=2)
    number = average_crossing_numbers(links.reshape(6, 2, 3), np.repeat([4, 9], 3))
    seen = crossings_seen(*links, np.random.default_rng(seed).normal(size=(40_000, 3)))
    # Four standard errors, some 3 % of the number.
    assert number.matrix[0, 1] == pytest.approx(seen.mean() / 2, abs=4 * seen.std() / 2 / math.sqrt(len(seen)))
    assert number.matrix[0, 1] > 0.1
    assert number.bodies.tolist() == [4, 9]


def test_crossed_segments_have_the_solid_angle_of_their_square_over_4_pi():
    """A square of side 2 at height h subtends 4 asin(1 / (1 + h²)), and half of space for long segments."""
    for height in (0.01, 1.0, 3.0):
        cross = [[[-1, 0, 0], [1, 0, 0]], [[0, -1, height], [0, 1, height]]]
        expected = 4 * math.asin(1 / (1 + height**2)) / (4 * math.pi)
        assert average_crossing_numbers(cross, [0, 1]).mean == pytest.approx(expected, rel=1e-12)
    long = [[[-1e5, 0, 0], [1e5, 0, 0]], [[0, -1e5, 1], [0, 1e5, 1]]]
    assert average_crossing_numbers(long, [0, 1]).mean == pytest.approx(0.5, abs=1e-4)


def test_random_rods_have_the_analytic_mean():
    """L² / (64 σ²): half the mean projected area π L² / 8 of two rods times the density 1 / (4π σ²) of middles at 0.

    The finite length lowers it by about L² / (36 σ²) = 0.1 %; the standard error of 200 000 pairs is 1.2 %.
    """
    random, length = np.random.default_rng(1), 0.2
    values = np.abs(gauss_integral(random_rods(200_000, length, random), random_rods(200_000, length, random)))
    expected = length**2 / 64
    assert values.mean() == pytest.approx(expected, abs=4 * values.std() / math.sqrt(len(values)))
    assert values.std() / math.sqrt(len(values)) < 0.02 * expected


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.floats(1e-4, 1e3))
def test_motions_mirrors_reversal_order_and_division_change_nothing(seed, scale):
    random = np.random.default_rng(seed)
    rods, body = random_rods(9, 1.5, random), np.array([0, 0, 0, 1, 1, 2, 3, 3, 3])
    matrix = average_crossing_numbers(rods, body).matrix
    turn = Rotation.random(rng=random).as_matrix()
    moved = scale * (rods @ turn.T + random.normal(size=3)) * [1, 1, -1]
    np.testing.assert_allclose(average_crossing_numbers(moved, body).matrix, matrix, rtol=1e-7, atol=1e-12)
    order = random.permutation(9)
    shuffled = rods[order][:, ::-1]
    np.testing.assert_allclose(average_crossing_numbers(shuffled, body[order]).matrix, matrix, rtol=1e-9, atol=1e-13)
    cut = rods[:, 0] + random.uniform(0.1, 0.9, size=(9, 1)) * (rods[:, 1] - rods[:, 0])
    halves = np.concatenate([np.stack([rods[:, 0], cut], axis=1), np.stack([cut, rods[:, 1]], axis=1)])
    np.testing.assert_allclose(average_crossing_numbers(halves, np.tile(body, 2)).matrix, matrix, rtol=1e-9, atol=1e-13)


def test_it_is_never_below_the_linking_number():
    segments, body = rings(torus_curve(1, 2), torus_curve(1, 2, shift=np.pi))
    number = average_crossing_numbers(segments, body)
    assert 2 < number.matrix[0, 1] < 4
    assert number.per_body == pytest.approx([number.mean] * 2)


def test_the_field_of_a_large_ball_is_the_whole_and_of_a_small_one_its_part():
    random = np.random.default_rng(3)
    rods, body = random_rods(30, 1.0, random), np.arange(30) // 2
    total = average_crossing_numbers(rods, body).matrix.sum() / 2
    points = np.zeros((2, 2, 3))
    assert crossing_field(rods, body, points, radius=50.0) == pytest.approx(np.full((2, 2), total), rel=1e-9)
    assert 0 < crossing_field(rods, body, np.zeros(3), radius=1.0) < 0.8 * total
    assert crossing_field(rods, body, [100.0, 0, 0], radius=1.0) == 0
    # Two crossed rods, cut by a ball of radius r around the middle, have the value of rods of that length.
    cross = np.array([[[-9.0, 0, 0], [9, 0, 0]], [[0, -9, 0.6], [0, 9, 0.6]]])
    inner = np.array([[[-1.0, 0, 0], [1, 0, 0]], [[0, -0.8, 0.6], [0, 0.8, 0.6]]])
    expected = average_crossing_numbers(inner, [0, 1]).mean
    assert crossing_field(cross, [0, 1], np.zeros(3), radius=1.0) == pytest.approx(expected, rel=1e-12)


def test_the_grid_covers_all_segments_and_a_region_spans_it_or_not():
    rods = random_rods(20, 1.0, np.random.default_rng(0))
    points = grid_points(rods, 0.3)
    assert np.all(points[0, 0, 0] <= rods.min(axis=(0, 1)))
    assert np.all(points[-1, -1, -1] >= rods.max(axis=(0, 1)))
    assert points[1, 1, 1] - points[0, 0, 0] == pytest.approx([0.3] * 3)
    inside = np.zeros((4, 3, 3), dtype=bool)
    inside[:2, 0, 0] = inside[1, :2, 0] = inside[1:, 1, 0] = True
    assert region_spans(inside, 0)
    assert not region_spans(inside, 1)
    inside[2, 1, 0] = False
    assert not region_spans(inside, 0)


@pytest.mark.parametrize(
    ("segments", "body", "text"),
    [
        (np.zeros((3, 3)), [0], r"segments must be \(M, 2, 3\) \[m\], the two ends of each segment: got \(3, 3\)"),
        (np.ones((2, 2, 3)), [0, 1], "segment 0 has a length of 0 m; leave it out"),
        ([[[0, 0, 0], [1, 0, np.nan]]], [0], "segment 0 is not; leave it out"),
        ([[[0, 0, 0], [1, 0, 0]]], [0.5], "body must be 1 whole numbers, one per segment"),
    ],
)
def test_bad_arrays_are_rejected(segments, body, text):
    with pytest.raises(InputError, match=text):
        average_crossing_numbers(segments, body)
