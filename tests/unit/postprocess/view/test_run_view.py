"""What the page shows, without a page."""

import os

import numpy as np
import pytest
from synthetic import T1, SyntheticRun, W, mesh_of, u_shape, write_frame, write_run

from dem.errors import InputError
from dem.record.frames import FrameWriter, read_frames
from postprocess.view import PICKED, RunView


@pytest.fixture
def pile(tmp_path):
    return write_run(tmp_path / "pile", SyntheticRun(frames_per_phase=2, floor_z=-0.003))


@pytest.fixture
def two(tmp_path):
    """Two flat smarticles one above the other, 20 mm apart, over a floor at -3 mm."""
    directory = tmp_path / "two"
    write_run(directory, SyntheticRun(count=2, frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    vertices = u_shape(0.7 * W) + np.array([[[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.02]]])
    write_frame(directory / "frames/frame_000000.vtu", vertices, time=0.5, phase=0, floor_z=-0.003)
    return directory


def colours(view):
    view.draw()
    return view._meshes["smarticles"].point_data["colour"]


def test_a_ray_picks_the_smarticle_that_it_meets_first(two):
    view = RunView(two)
    view.draw()
    y = 1e3 * u_shape(0.7 * W)[1, 1]  # of the middle links, in mm; heights in the page are above the floor
    view.pick_along(np.array([[0.0, y, 100.0], [0.0, y, -100.0]]))
    assert (view.pick.smarticle_id, view.pick.link) == (1, 1)
    view.pick_along(np.array([[0.0, y, 10.0], [0.0, y, -100.0]]))
    assert (view.pick.smarticle_id, view.pick.link) == (0, 1)
    barb = 1e3 * u_shape(0.7 * W)[0]
    view.pick_along(np.array([[barb[0], barb[1] - 1.0, 100.0], [barb[0], barb[1] - 1.0, -100.0]]))
    assert (view.pick.smarticle_id, view.pick.link) == (1, 0)
    view.pick_along(np.array([[50.0, 50.0, 100.0], [50.0, 50.0, -100.0]]))
    assert view.pick is None


def test_what_is_picked_is_told_and_coloured(two):
    view = RunView(two)
    assert view.describe() == []
    view.draw()
    y = 1e3 * u_shape(0.7 * W)[1, 1]
    view.pick_along(np.array([[0.0, y, 100.0], [0.0, y, -100.0]]))
    told = {row["name"]: row["value"] for row in view.describe()}
    assert told["smarticle_id"] == "1"
    assert float(told["height_m"]) == pytest.approx(0.023, rel=1e-3)
    assert told["crossings"] == "0"
    assert told["velocity_m_per_s"] == "(0, 0, 0)"
    picked = (colours(view) == PICKED).all(axis=1)
    assert picked.tolist() == [False] * 24 + [True] * 24


def test_bodies_stand_on_the_floor_in_millimetres(two):
    view = RunView(two)
    view.draw()
    bounds = view._meshes["smarticles"].bounds
    assert bounds[4:] == pytest.approx((3.0 - 1e3 * T1 / 2, 23.0 + 1e3 * T1 / 2), abs=1e-3)
    assert view._meshes["floor"].bounds[4] == pytest.approx(0.0, abs=1e-6)


def test_colours_follow_the_field(pile):
    view = RunView(pile)
    before = colours(view).copy()
    view.colour_by("height")
    assert (colours(view) != before).any()
    legend = view.legend()
    assert len(legend) == 5
    shown = [float(row["label"]) for row in legend]
    assert shown == sorted(shown, reverse=True)
    view.colour_by("smarticle_id")
    assert view.legend() == []
    with pytest.raises(InputError, match="is no field"):
        view.colour_by("colour")


def test_new_frames_are_found(pile):
    view = RunView(pile)
    assert not view.grow()
    writer = FrameWriter(pile, times=read_frames(pile).times.tolist())
    writer.write(mesh_of(SyntheticRun().vertices(0.1), time=23.0, phase=3), 23.0)
    assert view.grow()
    view.go_to(len(view.frames) - 1)
    assert view.frame.time == 23.0


def test_a_damaged_frame_leaves_what_is_shown(pile):
    view = RunView(pile)
    os.truncate(pile / "frames/frame_000002.vtu", 300)
    with pytest.raises(InputError, match=r"frame_000002\.vtu: truncated"):
        view.go_to(2)
    assert view.index == 7
    view.colour_by("speed")
    view.draw()
