from itertools import pairwise

import numpy as np
import pytest

from postprocess import centres_of_mass, material_height
from postprocess.measures.heights import heights


def test_centre_of_mass_weighs_links_by_length(shape):
    # Barbs of 0.7 at half their length, middle link of 1 at 0.
    assert centres_of_mass([shape(1.0, 0.7)])[0] == pytest.approx([0, 2 * 0.7 * 0.35 / 2.4, 0])
    # Not the mean of the vertices, and not that of the links' centres.
    lopsided = np.array([[[0.0, 0, 1], [0, 0, 0], [3, 0, 0], [3, 0, 0]]])
    assert centres_of_mass(lopsided)[0] == pytest.approx([4.5 / 4, 0, 0.5 / 4])


def test_heights_above_a_moved_floor(shape):
    flat = shape(1.0)
    levels = heights([flat + np.array([0, 0, z]) for z in (1.0, 4.0, 2.0)], floor_z=0.5)
    assert levels.mean_com == pytest.approx(7 / 3 - 0.5)

    assert levels.second_highest_com == pytest.approx(1.5)
    assert levels.top == pytest.approx(3.5)


@pytest.mark.parametrize("percentile", [1, 30, 50, 95, 100])
def test_material_of_an_upright_bar_is_spread_evenly(percentile):
    bar = np.array([[[0.0, 0, 0], [0, 0, 1], [0, 0, 3], [0, 0, 4]]])
    assert material_height(bar, percentile=percentile) == pytest.approx(0.04 * percentile)


def test_material_height_matches_sampled_points(scene):
    vertices = scene(20, 4)
    share = (np.arange(2000) + 0.5) / 2000
    samples, weights = [], []
    for smarticle in vertices:
        for start, end in pairwise(smarticle):
            samples.append(start[2] + share * (end[2] - start[2]))
            weights.append(np.full(2000, np.linalg.norm(end - start)))
    samples, weights = np.concatenate(samples), np.concatenate(weights)
    order = np.argsort(samples)
    total = np.cumsum(weights[order]) / weights.sum()
    expected = samples[order][np.searchsorted(total, 0.95)]
    assert material_height(vertices, percentile=95) == pytest.approx(expected, abs=1e-3)
