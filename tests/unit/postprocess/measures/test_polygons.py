"""Crossings of any shape: those of smarticles, and shapes that span a polygon or none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic.curves import rings, torus_curve
from synthetic.shapes import random_scene

from dem.errors import InputError
from postprocess import crossing_pairs, link_crossings, polygon_crossings
from postprocess.measures.entanglement import entanglement

SQUARE = np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
PIN = np.array([[[0.0, 0, -1], [0, 0, 1]]])


def smarticle_segments(pile):
    return np.stack([pile[:, :-1], pile[:, 1:]], axis=2).reshape(-1, 2, 3), np.repeat(np.arange(len(pile)), 3)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([None, (90, 90), (60, 100), (0, 0)]))
def test_smarticles_have_the_crossings_of_links_through_their_planes(seed, angles):
    pile = random_scene(14, seed, box=1.2, angles=angles)
    segments, body = smarticle_segments(pile)
    # Segments of a file need not be in order.
    order = np.random.default_rng(seed).permutation(len(body))
    if angles == (0, 0):
        with pytest.raises(
            InputError, match=r"no body spans a polygon: body 0 is straight: its ends are more than 0.99"
        ):
            polygon_crossings(segments[order], body[order])
        return
    found = polygon_crossings(segments[order], body[order])
    np.testing.assert_array_equal(found.crossings, link_crossings(pile))
    np.testing.assert_array_equal(np.stack([found.i, found.j, found.segments]), np.stack(crossing_pairs(pile)))
    expected = entanglement(pile)
    np.testing.assert_array_equal(found.has_polygon, expected.has_plane)
    assert found.mean == expected.mean


def with_pin(*corners, closed):
    segments, body = rings(*corners, closed=closed)
    return np.concatenate([segments, PIN]), np.append(body, body.max() + 1)


@pytest.mark.parametrize("turn", range(4))
def test_a_pin_crosses_a_ring_a_hook_and_a_c_and_has_no_polygon_itself(turn):
    for corners, closed in ((SQUARE, True), (np.roll(SQUARE, turn, axis=0), False), (torus_curve(1, 0)[:20], False)):
        found = polygon_crossings(*with_pin(corners, closed=closed))
        assert found.crossings.tolist() == [1, 0]
        assert found.flaws[0] == ""
        assert found.flaws[1].startswith("is straight")
        assert (found.i.tolist(), found.j.tolist(), found.segments.tolist()) == ([0], [1], [1])


def test_a_z_spans_two_triangles():
    z = np.array([[-1.0, 1, 0], [1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    inside = [[0.0, 0.5], [0.0, -0.5]]
    outside = [[0.8, 0.0], [-0.8, 0.0]]
    for x, y in inside + outside:
        segments, body = with_pin(z, closed=False)
        segments[-1] += [x, y, 0]
        assert polygon_crossings(segments, body).crossings[0] == ([x, y] in inside)


@pytest.mark.parametrize(
    ("corners", "text"),
    [
        (
            [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
            "body 0 is not flat: a corner is 0.38 of its radius off its pl",
        ),
        ([[0.0, 0, 0], [1, 0, 0], [0.4, 0, 0]], "body 0 is straight: its corners lie on one line"),
    ],
)
def test_a_shape_without_a_polygon_has_no_crossings(corners, text):
    with pytest.raises(InputError, match=text):
        polygon_crossings(*rings(np.array(corners), closed=False))
    cross = np.array([[[-1.0, 0, 0], [0, 0, 0]], [[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]]])
    with pytest.raises(InputError, match=r"branches, .*; the average crossing number is defined for every shape"):
        polygon_crossings(cross, np.zeros(3, dtype=int))
