"""Mass and packing fraction over the height."""

import math

import numpy as np
import pytest
from synthetic import SyntheticRun, mesh_of, write_manifest
from synthetic.shapes import RADIUS, W, random_scene

from dem.errors import InputError
from dem.record.frames import FrameWriter
from dem.record.run import Run
from postprocess import height_profile

UPRIGHT = np.array([[0.7 * W, 0, 0], [0, 0, 0], [0, 0, W], [0.7 * W, 0, W]])


def one_frame(directory, vertices, **content):
    write_manifest(directory, SyntheticRun(phases=("deposit", "remove-container")))
    FrameWriter(directory).write(mesh_of(vertices, **content), 0.0)
    run = Run(directory)
    return run.frames[0], run


def test_the_layers_of_a_u_on_its_back_hold_what_is_in_them(tmp_path):
    frame, run = one_frame(tmp_path, UPRIGHT[None] - [0, 0, 0.01], floor_z=-0.01)
    found = height_profile(frame, run, layer=W / 4)
    mass = run.manifest.smarticle_mass_kg
    # Barbs lie at the bottom and at the top; the middle link, 1 of 2.4 lengths, is spread over four layers.
    assert found.mass_kg == pytest.approx(np.array([0.7 + 0.25, 0.25, 0.25, 0.25 + 0.7]) / 2.4 * mass)
    assert found.edges_m == pytest.approx(np.arange(5) * W / 4)
    assert found.volume_m3.sum() == pytest.approx(run.manifest.solid_volume_m3)
    assert found.packing == pytest.approx(found.volume_m3 / (math.pi * RADIUS**2 * W / 4))


def test_nothing_is_lost_in_a_pile(tmp_path):
    frame, run = one_frame(tmp_path, random_scene(20, 1, width=W, angles=(90, 90)), floor_z=0.001)
    found = height_profile(frame, run)
    assert len(found.mass_kg) == 20
    assert found.mass_kg.sum() == pytest.approx(20 * run.manifest.smarticle_mass_kg)
    middle = (found.heights_m * found.mass_kg).sum() / found.mass_kg.sum()
    com = frame.bodies.position_m[:, 2].mean() - frame.floor_z
    assert middle == pytest.approx(com, abs=found.edges_m[1] / 4)


def test_there_is_no_packing_fraction_without_a_wall(tmp_path):
    frame, run = one_frame(tmp_path, UPRIGHT[None], phase=1)
    assert np.isnan(height_profile(frame, run).packing).all()


@pytest.mark.parametrize("layer", [0.0, -1.0, math.nan, 1e-12])
def test_wrong_layers_are_rejected(tmp_path, layer):
    frame, run = one_frame(tmp_path, UPRIGHT[None])
    with pytest.raises(InputError, match="layer: "):
        height_profile(frame, run, layer=layer)
