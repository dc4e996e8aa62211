"""Crossings of any shape: those of smarticles, and shapes that span a polygon or none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic.curves import rings, torus_curve
from synthetic.shapes import random_scene

from dem.errors import InputError
from postprocess import closed_linking, crossing_pairs, link_crossings, polygon_crossings
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


def polygon(corners: int, radius: float, turn: Rotation) -> np.ndarray:
    """A regular polygon whose first corner is at the origin."""
    t = 2 * np.pi * np.arange(corners) / corners
    return turn.apply(radius * np.stack([np.cos(t) - 1, np.sin(t), 0 * t], axis=1))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(4, 40), st.integers(4, 40), st.booleans())
def test_a_ring_with_a_corner_in_a_plane_passes_once_if_it_is_linked(seed, one, other, exact):
    random = np.random.default_rng(seed)
    # The second ring has a corner in the polygon of the first one; its polygon is cut wherever that happens.
    first = polygon(one, 1.0, Rotation.identity())
    first[:, 0] += 1
    second = polygon(other, random.uniform(0.4, 2), Rotation.random(random_state=random))
    second[:, :2] += random.uniform(-0.4, 0.4, size=2)
    # Corners of files are rounded, so that the two ends of a corner need not be equal.
    noise = 0 if exact else 1e-9
    found = []
    for _ in range(3):
        turn, shift = Rotation.random(random_state=random), random.uniform(-5, 5, size=3)
        starts = random.integers(one), random.integers(other)
        moved = [turn.apply(np.roll(ring, k, axis=0)) + shift for ring, k in zip((first, second), starts, strict=True)]
        segments, body = rings(*moved)
        segments += random.uniform(-noise, noise, size=segments.shape)
        crossings = polygon_crossings(segments, body).crossings.tolist()
        linked = np.abs(closed_linking(*rings(*moved)).number).tolist()
        found.append((crossings, linked))
        # Flat convex rings meet the plane of each other twice: once inside if linked, else not at all or twice.
        assert crossings == [1, 1] if linked else sum(crossings) in (0, 2)
    # With noise a corner that only touches the plane may pass it and come back.
    assert found.count(found[0]) == 3 or not (exact or found[0][1])


@pytest.mark.parametrize("corners", [4, 7, 60, 61])
@pytest.mark.parametrize("shift", [0, 0.3, 0.5])
def test_two_linked_rings_cross_each_other_wherever_their_corners_are(corners, shift):
    t = 2 * np.pi * (np.arange(corners) + shift) / corners
    ring = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    found = polygon_crossings(*rings(ring, ring[:, [0, 2, 1]] + [1.0, 0, 0]))
    assert found.crossings.tolist() == [1, 1]
    assert (found.i.tolist(), found.j.tolist(), found.segments.tolist()) == ([0, 1], [1, 0], [1, 1])


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ([[0.0, 0, -1], [0, 0, 0], [0.2, 0, 1]], 1),  # a corner in the plane, between both sides
        ([[0.0, 0, 1], [0, 0, 0], [0.2, 0, 1]], 0),  # from above and back
        ([[0.0, 0, -1], [0, 0, 0], [0.2, 0, -1]], 0),  # from below and back
        ([[0.0, 0, -1], [0, 0, 0], [0.2, 0, 0], [0.4, 0.1, 0], [0.4, 0, 1]], 1),  # a row of corners in the plane
        ([[0.0, 0, -1], [0, 0, 0], [0.2, 0, 0], [0.4, 0, -1]], 0),
        ([[0.0, 0, -1], [0, 0, 0], [5.0, 0, 0], [5.0, 0, 1]], 0),  # leaves the polygon through an edge
        ([[0.0, 0, -1], [0, 0, 0], [0.2, 0, 0]], 0),  # ends in the plane
        ([[0.0, 0, 0], [0.2, 0, 0], [0.4, 0.1, 0]], 0),  # lies in it
        ([[1.0, 0, -1], [1, 0, 0], [0.9, 0, 1]], 0),  # its corner meets an edge
        ([[3.0, 0, -1], [3, 0, 0], [3, 0, 1]], 0),  # its corner is outside
    ],
)
def test_a_corner_in_the_plane_counts_once_if_the_curve_passes(corners, expected):
    segments, body = rings(SQUARE, np.array(corners), closed=False)
    for sign in (1, -1):
        for order in (slice(None), slice(None, None, -1)):
            turned = sign * segments[order]
            assert polygon_crossings(turned, body[order]).crossings.tolist()[0] == expected
            assert polygon_crossings(turned[:, ::-1], body[order]).crossings.tolist()[0] == expected


@pytest.mark.parametrize(("arms", "expected"), [([1, -1, -1], 1), ([1, 1, -1, -1], 2), ([1, 1, 1], 0)])
def test_a_star_with_its_centre_in_the_plane_passes_with_the_arms_on_the_side_with_fewer(arms, expected):
    star = np.array([[[0.1, 0, 0], [0.1 * k, 0.2, arm]] for k, arm in enumerate(arms)], dtype=float)
    segments, body = rings(SQUARE)
    found = polygon_crossings(np.concatenate([segments, star]), np.append(body, [1] * len(arms)))
    assert found.crossings.tolist() == [expected, 0]
