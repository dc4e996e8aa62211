"""Segments joined to curves, and nearest points of segments against distances found in another way."""

import numpy as np
import pytest
from synthetic.curves import random_rods, rings

from dem.errors import InputError
from postprocess.geometry.segments import curves, nearest_points, segments_of
from postprocess.measures.contacts import segment_distances

SQUARE = np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])


def test_segments_are_joined_to_curves_in_the_order_of_the_file():
    square, bent = (rings(SQUARE, closed=closed)[0] for closed in (True, False))
    ring, hook = curves(np.concatenate([square[[2, 0, 3, 1]], bent[[1, 2, 0], ::-1]]), [3] * 4 + [1] * 3)[::-1]
    assert (ring.body, ring.closed, hook.body, hook.closed) == (3, True, 1, False)
    np.testing.assert_array_equal(ring.corners, SQUARE[[2, 3, 0, 1]])
    np.testing.assert_array_equal(hook.corners, SQUARE[::-1])
    assert curves(np.empty((0, 2, 3)), []) == ()
    there_and_back = np.array([[[0.0, 0, 0], [1, 0, 0]], [[1, 0, 0], [0, 0, 0]]])
    assert curves(there_and_back, [0, 0])[0].flaw == "goes to and fro along one line"


def test_bodies_that_touch_stay_apart():
    chain = rings(SQUARE, closed=False)[0]
    first, second = curves(chain, [0, 1, 1])
    assert (first.flaw, second.flaw) == ("", "")
    np.testing.assert_array_equal(first.corners, SQUARE[:2])
    np.testing.assert_array_equal(second.corners, SQUARE[1:])


def test_nearest_points_lie_on_the_segments_at_the_least_distance():
    random = np.random.default_rng(0)
    first, second = random_rods(500, 1.5, random), random_rods(500, 1.0, random)
    # Parallel ones, and ones that are nearly parallel.
    second[:50] = first[:50] + random.normal(size=(50, 1, 3))
    second[50:100, 1] = second[50:100, 0] + (first[50:100, 1] - first[50:100, 0]) * (1 + 1e-9)
    on_first, on_second = nearest_points(first, second)
    expected = segment_distances(first[:, 0], first[:, 1], second[:, 0], second[:, 1])
    np.testing.assert_allclose(np.linalg.norm(on_first - on_second, axis=1), expected, rtol=1e-9)
    for points, ends in ((on_first, first), (on_second, second)):
        parts = np.linalg.norm(points[:, None] - ends, axis=2).sum(axis=1)
        assert parts == pytest.approx(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))


def test_polylines_become_segments_in_one_call():
    bent, rod = [[0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 2, 0]], np.array([[0.0, 0, 3], [0, 0, 4]])
    segments, body = segments_of([bent, rod])
    assert body.tolist() == [0, 0, 1]
    np.testing.assert_array_equal(segments, [[[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [1, 2, 0]], rod])
    ring, body = segments_of([SQUARE], closed=True)
    assert [one.closed for one in curves(ring, body)] == [True]
    assert segments_of([]).segments.shape == (0, 2, 3)


@pytest.mark.parametrize(
    ("polylines", "words"),
    [
        ([SQUARE, SQUARE[:1]], ["polyline 1", "different points"]),
        ([SQUARE, SQUARE[:, :2]], ["polyline 1", "(4, 2)"]),
        ([np.where(SQUARE < 0, np.nan, SQUARE)], ["polyline 0", "point 1", "finite"]),
        (SQUARE, ["polyline 0", "(3,)", "list of polylines"]),
        ([[[0, 0, 0], [1, 0]]], ["polyline 0", "array of numbers"]),
    ],
)
def test_bad_polylines_are_rejected(polylines, words):
    with pytest.raises(InputError) as error:
        segments_of(polylines)
    assert all(word in str(error.value) for word in words), error.value
