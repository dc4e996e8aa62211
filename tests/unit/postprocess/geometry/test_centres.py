"""Centres of mass of any bodies, of one frame and of all frames of a run."""

import numpy as np
import pytest
from synthetic import SyntheticRun, mesh_of, write_manifest
from synthetic.shapes import RADIUS, T2, W, random_scene

from dem.errors import InputError
from dem.record.document import Kind
from dem.record.frame import segment_mesh
from dem.record.frames import FrameWriter
from dem.record.run import Run
from postprocess import centres_of_mass


class Bars:
    """Two bodies of bars: an L with arms of 1 and 3, and a rod, whose first frame lacks the rod."""

    def __init__(self, count: int) -> None:
        ends = np.array([[[0.0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 3, 0]], [[0, 0, 2], [0, 0, 4]]])
        self.segments = ends[: 2 if count == 1 else 3]
        self.body = np.array([0, 0, 1])[: len(self.segments)]
        self.bar, self.kind = np.array([0, 1, 0])[: len(self.body)], np.arange(count)
        self.bar_velocities = self.bar_spins = self.normals = np.zeros((len(self.body), 3))


@pytest.fixture
def run(tmp_path):
    kinds = [
        Kind(shape="segments", bodies=1, bars=bars, mass_kg=1.0, volume_m3=1.0, length_m=length, thickness_normal_m=0.1,
             thickness_in_plane_m=0.1, round=True, sphere_diameter_m=0.1)
        for bars, length in ((2, 4.0), (1, 2.0))
    ]  # fmt: skip
    write_manifest(tmp_path, SyntheticRun(phases=("deposit",)), kinds=tuple(kinds))
    writer = FrameWriter(tmp_path)
    for count in (1, 2):
        contacts = np.zeros(count, np.int64)
        writer.write(segment_mesh(Bars(count), contacts=contacts, time=count, floor=0.0, phase=0), count)
    return Run(tmp_path)


def test_centres_of_any_bodies_of_a_frame_and_of_a_run(run):
    both = [[0.5 / 4, 4.5 / 4, 0], [0, 0, 3]]
    assert centres_of_mass(run.frames[-1]) == pytest.approx(np.array(both))
    found = centres_of_mass(run)
    assert found.shape == (2, 2, 3)
    assert found[1] == pytest.approx(np.array(both))
    assert found[0, 0] == pytest.approx(both[0])
    assert np.isnan(found[0, 1]).all()
    assert centres_of_mass(run.frames[1:]).shape == (1, 2, 3)


def test_a_thick_middle_link_draws_the_centre_of_mass_to_it(tmp_path):
    thick = 4 * T2
    write_manifest(tmp_path, SyntheticRun(phases=("deposit",)), middle_thickness_in_plane_m=thick)
    vertices = random_scene(1, 0, width=W, angles=(90, 90))
    FrameWriter(tmp_path).write(mesh_of(vertices), 0.0)
    middles = (vertices[0, :-1] + vertices[0, 1:]) / 2
    wanted = np.average(middles, axis=0, weights=[0.7, 4, 0.7])
    assert centres_of_mass(Run(tmp_path).frames[0])[0] == pytest.approx(wanted)
    assert np.linalg.norm(centres_of_mass(vertices)[0] - wanted) > 0.01 * RADIUS


def test_vertices_of_other_bodies_are_rejected_with_the_way_out(run):
    with pytest.raises(InputError, match=r"frame\.bodies"):
        centres_of_mass(run.frames[-1].vertices)
