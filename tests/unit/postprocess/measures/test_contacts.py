import numpy as np
import pytest
from scipy.optimize import lsq_linear

from dem.errors import InputError
from postprocess import contact_pairs, neighbours_in_contact
from postprocess.measures.contacts import segment_distances


def oracle_distance(p0, p1, q0, q1):
    """Bounded least squares over the two positions along the segments."""
    matrix = np.column_stack([p1 - p0, q0 - q1])
    result = lsq_linear(matrix, q0 - p0, bounds=(0, 1), method="bvls", tol=1e-14)
    return np.linalg.norm(matrix @ result.x - (q0 - p0))


def test_segment_distances_match_least_squares():
    ends = np.random.default_rng(0).uniform(-1, 1, (4, 60, 3))
    expected = [oracle_distance(*segment) for segment in ends.swapaxes(0, 1)]
    np.testing.assert_allclose(segment_distances(*ends), expected, atol=1e-9)


@pytest.mark.parametrize(
    ("q0", "q1", "expected"),
    [
        ((0.5, 1, -1), (0.5, 1, 1), 1.0),  # across, inside both
        ((0, 2, 0), (1, 2, 0), 2.0),  # parallel
        ((3, 0, 0), (4, 0, 0), 2.0),  # in line
        ((0.5, 0, 0), (2, 0, 0), 0.0),  # overlapping
        ((2, 1, 0), (2, 1, 0), 2**0.5),  # a point
        ((2, 1, 0), (3, 5, 0), 2**0.5),  # end to end
    ],
)
def test_segment_distance_by_hand(q0, q1, expected):
    segments = [np.array([point], dtype=float) for point in ((0, 0, 0), (1, 0, 0), q0, q1)]
    assert segment_distances(*segments)[0] == pytest.approx(expected)
    assert segment_distances(*segments[2:], *segments[:2])[0] == pytest.approx(expected)


@pytest.mark.parametrize("aspect_ratio", [0.0, 0.7])
def test_pairs_match_brute_force(scene, aspect_ratio):
    vertices = scene(15, 1, box=1.2, aspect_ratio=aspect_ratio)
    limit, expected = 0.2, {}
    for i in range(15):
        for j in range(i + 1, 15):
            gap = min(
                segment_distances(p0[None], p1[None], q0[None], q1[None])[0]
                for p0, p1 in zip(vertices[i, :-1], vertices[i, 1:], strict=True)
                for q0, q1 in zip(vertices[j, :-1], vertices[j, 1:], strict=True)
            )
            if gap <= limit:
                expected[i, j] = gap
    assert 10 < len(expected) < 100
    pairs = contact_pairs(vertices, limit)
    found = dict(zip(zip(pairs.i, pairs.j, strict=True), pairs.distance, strict=True))
    assert found == pytest.approx(expected)
    counts = np.bincount(np.array(list(expected)).ravel(), minlength=15)
    np.testing.assert_array_equal(neighbours_in_contact(vertices, limit), counts)


def test_touching_chain(shape):
    row = [shape(1.0) + np.array([0, 0, 0.1 * k]) for k in range(4)]
    np.testing.assert_array_equal(neighbours_in_contact(row, 0.11), [1, 2, 2, 1])
    np.testing.assert_array_equal(neighbours_in_contact(row, 0.09), [0, 0, 0, 0])
    np.testing.assert_array_equal(neighbours_in_contact(row, 0.21), [2, 3, 3, 2])


def test_few_smarticles(shape):
    assert neighbours_in_contact(np.empty((0, 4, 3)), 0.1).shape == (0,)
    assert neighbours_in_contact([shape()], 0.1).tolist() == [0]


@pytest.mark.parametrize("distance", [0, -1, np.nan, np.inf])
def test_bad_distance(shape, distance):
    with pytest.raises(InputError, match="distance must be above 0 m"):
        contact_pairs([shape()], distance)
