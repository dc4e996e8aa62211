"""Tests of the checker in `validation.extremes` and of its random scenes."""

import numpy as np
import pytest

from dem.errors import InputError
from dem.scene.reading import parse_scene
from validation.extremes import accepted_depth, crossings, draw_scene, segments, surface

ALONG_X = segments(np.array([[[-3.0, 0, 0], [-1, 0, 0], [1, 0, 0], [3, 0, 0]]]))
ALONG_Y = ALONG_X[..., [1, 0, 2]]


@pytest.mark.parametrize(
    ("start", "end", "pairs"),
    [
        ((0, 0, 1), (0, 0, -1), [(1, 4)]),  # middle through middle
        ((2, 0, 1), (2, 0, -1), [(2, 4)]),  # middle through a barb
        ((0, 0, 1), (0, 0, 0.1), []),  # comes near
        ((4, 0, 1), (4, 0, -1), []),  # passes beside the end
    ],
)
def test_axes_that_pass_through_each_other_are_found(
    start: tuple[float, ...], end: tuple[float, ...], pairs: list[tuple[int, int]]
) -> None:
    before, after = (np.concatenate([ALONG_X, ALONG_Y + np.array(way)]) for way in (start, end))
    assert crossings(before, after) == pairs


def test_a_link_without_length_crosses_nothing() -> None:
    above = np.tile([0.0, 0.0, 1.0], (3, 2, 1))
    assert crossings(np.concatenate([ALONG_X, above]), np.concatenate([ALONG_X, -above])) == []


def test_links_of_one_body_may_cross() -> None:
    before, after = (np.concatenate([ALONG_X, ALONG_Y + np.array([0, 0, z])]) for z in (1, -1))
    assert crossings(before, after, np.zeros(6, np.int64)) == []


def test_scenes_are_drawn_alike_and_some_are_valid() -> None:
    assert draw_scene(3) == draw_scene(3) != draw_scene(4)
    accepted = 0
    for number in range(20):
        try:
            parse_scene(draw_scene(number), source="extremes")
        except InputError:
            continue
        accepted += 1
    assert accepted > 10


def test_a_link_that_stands_or_lies_on_the_floor_is_not_below_it() -> None:
    thickness = 0.5
    standing, lying = ALONG_X[..., [2, 1, 0]] + np.array([0, 0, 3]), ALONG_X + np.array([0, 0, thickness / 2])
    for ends, depth in ((standing, 0.0), (lying, 0.0), (lying - [0, 0, 0.2], 0.2)):
        points, inset = surface(ends, thickness)
        assert (inset - points[:, 2]).max() == pytest.approx(depth)


@pytest.mark.parametrize(
    ("fidelity", "depth"),
    [("draft", 0.24), ({"base": "standard", "rows": 2}, 0.17), ({"base": "draft", "stiffness_N_per_m": 100.0}, 0.5)],
)
def test_the_accepted_depth_is_a_part_of_the_mean_width_of_the_section(fidelity: object, depth: float) -> None:
    section = {"thickness_normal_m": 2e-3, "thickness_in_plane_m": 1e-3}
    assert accepted_depth({"fidelity": fidelity, "smarticle": section}) == pytest.approx(depth * 6e-3 / np.pi)
