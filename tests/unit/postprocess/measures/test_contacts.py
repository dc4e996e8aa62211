import numpy as np
import pytest
from scipy.optimize import lsq_linear

from dem.errors import InputError
from postprocess import contact_pairs, measure_run, neighbours_in_contact
from postprocess.geometry.links import swept_axes
from postprocess.measures.contacts import segment_distances, without_support


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


# -- touching nothing ------------------------------------------------------------------------------------------------


def test_a_rattler_touches_neither_others_nor_floor_nor_wall(shape):
    line, d = shape(0.01, 0.7, (0.0, 0.0)), 1e-3
    places = np.array([[0, 0, 0.5 * d], [0, 0, 0.6 * d], [0.0075, 0, 0.01], [0.0077, 0, 0.01], [0, 0, 0.01]])
    pile = line + places[:, None]
    told = {"diameter": d, "floor_z": 0.0}
    # A tip is 12 mm from the middle: it touches a wall of 20 mm where the middle is 8 mm, less what facets take, out.
    assert without_support(pile, [0] * 5, wall_radius=0.02, **told).tolist() == [False, True, True, True, True]
    assert without_support(pile, [0] * 5, wall_radius=0.0195, **told).tolist() == [False, True, False, False, True]
    assert without_support(pile, [0] * 5, wall_radius=None, **told).tolist() == [False, True, True, True, True]
    # Lower than the floor it touches it as well; one neighbour is enough.
    assert not without_support(pile - np.array([0, 0, 0.1]), [0] * 5, wall_radius=None, **told).any()
    assert without_support(pile, [0, 1, 0, 2, 0], wall_radius=None, **told).tolist() == [
        False,
        False,
        True,
        False,
        True,
    ]


def test_tables_have_the_spread_of_the_contacts_and_the_rattlers(make_run):
    """The frames of the fixture tell 0 to 5 contacts of six smarticles."""
    run = make_run()
    row = measure_run(run, costly="never").iloc[2]
    assert row["contacts SD [-]"] == pytest.approx(np.std(np.arange(6)))
    assert row["contacts most [-]"] == 5
    assert row["without contact [-]"] == pytest.approx(1 / 6)
    # The one without a contact hangs in the air.
    assert row["rattlers [-]"] == pytest.approx(1 / 6)


def test_swept_axes_end_a_radius_before_the_tips(shape):
    u = shape(0.01, 0.7)
    axes = swept_axes(u[None], 1e-3)[0]
    assert np.linalg.norm(axes[[0, 3]] - u[[0, 3]], axis=1) == pytest.approx(0.5e-3)
    assert np.linalg.norm(np.diff(axes, axis=0), axis=1) == pytest.approx([6.5e-3, 10e-3, 6.5e-3])
    # A barb shorter than the radius is inside the sphere at its hinge; a bar without barbs ends before its ends.
    short = shape(0.01, 0.04)
    assert np.array_equal(swept_axes(short[None], 1e-3)[0], short[[1, 1, 2, 2]])
    bar = swept_axes(shape(0.01, 0.0)[None], 1e-3)[0]
    assert np.ptp(bar[:, 0]) == pytest.approx(9e-3)
    assert np.ptp(swept_axes(shape(0.01, 0.7, (0.0, 0.0))[None], 1e-3)[0][:, 0]) == pytest.approx(23e-3)
