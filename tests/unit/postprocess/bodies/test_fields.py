"""What bodies carry: names, units and values."""

import numpy as np
import pytest
from synthetic import RADIUS, SyntheticRun, mesh_of, u_shape, write_manifest, write_run
from synthetic.shapes import W

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.frames import FrameWriter, read_frames
from dem.record.run import open_run
from postprocess.bodies.colours import ColourScale, colour_field, linear
from postprocess.bodies.fields import BY_NAME, fields_of, link_values
from postprocess.geometry.segments import segments_of
from postprocess.measures.clusters import entanglement_clusters
from postprocess.measures.crossing_number import average_crossing_numbers
from postprocess.measures.entanglement import link_crossings


@pytest.fixture
def pile(tmp_path):
    return write_run(tmp_path, SyntheticRun(count=60, frames_per_phase=1, floor_z=-0.003))


def values(directory, name):
    frame: Frame = read_frames(directory)[-1]
    return frame, link_values(BY_NAME[name], frame, open_run(directory))


def test_values_are_those_of_the_measures(pile):
    frame, crossings = values(pile, "crossings")
    assert crossings.tolist() == np.repeat(link_crossings(frame.vertices)[:, None], 3, axis=1).tolist()
    assert crossings.max() > 0
    _, cluster = values(pile, "entanglement_cluster")
    assert cluster[:, 0].tolist() == entanglement_clusters(frame.vertices).labels.tolist()
    _, height = values(pile, "height_m")
    assert np.sort(height[:, 0])[-1] == pytest.approx(SyntheticRun(count=60).height(0.132), rel=0.01)
    assert values(pile, "contacts")[1][:, 0].tolist() == frame.contacts.tolist()


def test_a_body_without_a_plane_has_no_number_of_crossings(tmp_path):
    write_manifest(tmp_path, SyntheticRun(count=2, phases=("deposit",)))
    bent, straight = u_shape(0.7 * W), np.linspace([-0.01, 0.001, 0], [0.01, 0.001, 0], 4)
    # The straight one lies through the mouth of the bent one.
    through = straight[:, [2, 1, 0]]
    FrameWriter(tmp_path).write(mesh_of(np.array([bent, through])), 0.0)
    _, crossings = values(tmp_path, "crossings")
    assert crossings[0].tolist() == [1, 1, 1]
    assert np.isnan(crossings[1]).all()


def test_average_crossing_numbers_of_bodies_have_the_mean_of_the_measure(pile):
    frame, found = values(pile, "average_crossing_number")
    pairs = average_crossing_numbers(*segments_of(frame))
    assert found[:, 0].mean() == pytest.approx(pairs.mean)
    assert found[:, 1] == pytest.approx(pairs.matrix.sum(axis=0))


def test_cells_of_local_packing_fill_the_container(pile):
    frame, local = values(pile, "local_packing_fraction")
    assert np.isfinite(local).all()
    solid = open_run(pile).manifest.solid_volume_m3
    top = frame.vertices[..., 2].max() - frame.floor_z
    # The wall is a polygon around the circle, and the lid half a spacing above the highest point.
    assert (solid / local[:, 0]).sum() == pytest.approx(np.pi * RADIUS**2 * top, rel=0.15)
    assert (solid / local[:, 0]).sum() > np.pi * RADIUS**2 * top


def test_local_packing_has_no_value_without_a_wall(tmp_path):
    kinds = ("deposit", "relax", "shake", "remove-container")
    pile = write_run(tmp_path, SyntheticRun(frames_per_phase=1, phases=kinds))
    assert np.isnan(values(pile, "local_packing_fraction")[1]).all()


def test_a_lone_smarticle_has_no_local_packing(tmp_path):
    """The first frame of a pour: its points and their images lie in one plane."""
    write_run(tmp_path, SyntheticRun(count=1, frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    upright = u_shape(0.008)[None][..., [0, 2, 1]] + [0.0, 0.0, 0.003]
    FrameWriter(tmp_path).write(mesh_of(upright, time=0.5), 0.5)
    assert np.isnan(values(tmp_path, "local_packing_fraction")[1]).all()


def test_actuated_frames_have_angles_per_link(tmp_path):
    run = SyntheticRun(count=2, frames_per_phase=1, phases=("relax",), packing=(0.1,))
    write_run(tmp_path, run)
    angle = np.array([0.1, np.nan, 0.2, 0.3, np.nan, 0.4])
    mesh = mesh_of(run.vertices(0.1), time=0.5, extra={"angle_rad": angle})
    FrameWriter(tmp_path).write(mesh, 0.5)
    assert values(tmp_path, "angle_rad")[1] == pytest.approx(angle.reshape(2, 3), nan_ok=True)
    assert values(tmp_path, "motor_work_J")[1] is None


def test_runs_in_a_plane_have_fewer_fields(pile):
    assert "crossings" in {field.name for field in fields_of(open_run(pile))}
    write_manifest(pile, SyntheticRun(), planar=True)
    run = open_run(pile)
    assert "crossings" not in {field.name for field in fields_of(run)}
    assert colour_field(None, run).name == "smarticle_id"
    with pytest.raises(InputError, match="this run has no crossings"):
        colour_field("crossings", run)


def test_colours_have_grey_for_no_value_and_for_no_crossing():
    colours = ColourScale.of(BY_NAME["crossings"], (0.0, 5.0)).painted(np.array([0.0, 1.0, 5.0, np.nan]))
    assert colours[0].tolist() == colours[3].tolist() == [201, 201, 201]
    assert len({tuple(colour) for colour in colours.tolist()}) == 3


def test_linear_colours_are_darker_in_the_middle_alone():
    """Half the light is 188 of 255 in sRGB."""
    assert linear(np.array([[0, 188, 255]], dtype=np.uint8)).tolist() == [[0, 128, 255]]
