"""g(r) and correlations of orientations: random points, lattices and bodies with known angles."""

import math

import numpy as np
import pytest

from dem.errors import InputError
from postprocess import orientation_correlation, radial_distribution


def random_points(count, random, *, radius=1.0, height=2.0):
    across, angle = radius * np.sqrt(random.uniform(size=count)), random.uniform(0, 2 * math.pi, count)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), random.uniform(0, height, count)])


@pytest.mark.parametrize("sizes", [{"radius": 1.0, "bottom": 0.0, "top": 2.0}, {}])
def test_random_points_in_a_cylinder_give_1_at_all_distances(sizes):
    random = np.random.default_rng(1)
    found = [radial_distribution(random_points(800, random), longest=2.2, bins=11, **sizes) for _ in range(8)]
    pairs = sum(one.pairs for one in found)
    g = np.mean([one.g for one in found], axis=0)
    # Numbers of pairs are about Poisson's; the largest distance, twice the radius and more, is where few are possible.
    assert np.abs(g - 1).max() < 4 / math.sqrt(pairs.min()) + 0.02, g
    assert found[0].ideal.sum() < 800 * 799 / 2
    assert found[0].radius_m == pytest.approx(1.0, abs=0.01)


def test_the_cylinder_is_that_of_the_points_also_if_they_are_few():
    random = np.random.default_rng(4)
    found = [radial_distribution(random_points(10, random), longest=1.0, bins=1) for _ in range(600)]
    # The outermost of 10 points has 10/11 of the area, and their heights span 9/11 of the height on average.
    assert np.mean([one.radius_m**2 for one in found]) == pytest.approx(1.0, abs=0.02)
    assert np.mean([one.top_m - one.bottom_m for one in found]) == pytest.approx(2.0, abs=0.05)
    assert np.mean([one.bottom_m for one in found]) == pytest.approx(0.0, abs=0.03)


def test_all_pairs_are_within_the_size_of_the_cylinder():
    found = radial_distribution(random_points(50, np.random.default_rng(0)), longest=math.hypot(2, 2), bins=40)
    assert found.pairs.sum() == 50 * 49 / 2
    sizes = {"radius": 1.0, "bottom": 0.0, "top": 2.0}
    assert radial_distribution(np.eye(3) * 0.5, longest=math.hypot(2, 2), **sizes).ideal.sum() == pytest.approx(3)


def test_a_cubic_lattice_has_its_neighbours_at_their_distances():
    axis = np.arange(-8, 9) * 0.1
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    points = points[np.hypot(points[:, 0], points[:, 1]) <= 0.8 + 1e-9]
    found = radial_distribution(points, longest=0.18, bins=12)
    occupied = found.radii_m[found.pairs > 0]
    np.testing.assert_allclose(occupied, [0.0975, 0.1425, 0.1725], atol=1e-9)  # 1, √2 and √3 spacings
    # Neighbours of an inner point: ρ g 4π r² Δr, with the density ρ of the lattice.
    number = found.g * 1e3 * 4 / 3 * math.pi * np.diff(found.edges_m**3)
    assert number[found.pairs > 0] == pytest.approx([6, 12, 8], rel=0.1)


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"radius": 0.5}, ["point", "outside", "give a radius"]),
        ({"top": -1.0}, ["outside"]),
        ({"top": np.inf}, ["no finite volume", "give a radius"]),
        ({"longest": 0.0}, ["longest distance", "0.0 m"]),
        ({"bins": 0}, ["0 bins"]),
        ({"bins": 2.5}, ["a whole number of bins", "2.5 bins"]),
        ({"bins": [0.1, 0.2]}, ["[0.1, 0.2] bins"]),
        ({"longest": "20 mm"}, ["longest distance", "'20 mm' m"]),
    ],
)
def test_wrong_regions_and_shells_are_rejected(keywords, words):
    points = random_points(30, np.random.default_rng(0))
    with pytest.raises(InputError) as error:
        radial_distribution(points, **({"longest": 1.0} | keywords))
    assert all(word in str(error.value) for word in words), error.value
    with pytest.raises(InputError, match=r"^centres: .* is no array of numbers; give those of one frame"):
        radial_distribution(object(), longest=1.0)
    with pytest.raises(InputError, match="body 3 is not"):
        radial_distribution(np.where(np.arange(30)[:, None] == 3, np.nan, points), longest=1.0)


def test_orientations_of_near_bodies_that_are_parallel_and_of_far_ones_that_are_not():
    random = np.random.default_rng(2)
    # Pairs of bodies 0.1 apart at an angle of 60°, 10 from each other in random directions.
    places = np.repeat(10.0 * np.arange(400), 2)[:, None] * [1.0, 0, 0] + np.tile([[0.0, 0, 0], [0.1, 0, 0]], (400, 1))
    first = random.normal(size=(400, 3))
    aside = np.cross(first, random.normal(size=(400, 3)))
    first, aside = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (first, aside))
    axes = np.stack([first, 0.5 * first + math.sqrt(0.75) * aside], axis=1).reshape(-1, 3)
    found = orientation_correlation(places, 3 * axes, longest=16.0, bins=4)
    assert found.polar[0] == pytest.approx(0.5)
    assert found.nematic[0] == pytest.approx(1.5 * 0.25 - 0.5)
    assert np.isnan(found.nematic[1])
    assert found.pairs.tolist()[0] == 400
    assert abs(found.nematic[2]) < 0.05 and abs(found.polar[2]) < 0.05  # noqa: PT018
    with pytest.raises(InputError, match="body 5"):
        orientation_correlation(places, np.where(np.arange(800)[:, None] == 5, 0.0, axes), longest=1.0)
