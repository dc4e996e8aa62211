"""φ(r, z) of boxes whose volume and place are known."""

import math

import numpy as np
import pytest
from synthetic.shapes import RADIUS, T1, T2, W

from dem.record.run import Run
from postprocess.measures.profile import packing_profile, profile_table

SECTION = {"thickness_normal": T1, "thickness_in_plane": T2}


def test_rings_and_layers_sum_to_the_solid_volume(scene):
    pile = scene(30, 4, box=2.0, width=W, angles=(90, 90)) - [W, W, 0]
    profile = packing_profile(pile, radius=2 * RADIUS, floor_z=-0.02, **SECTION)
    each = [packing_profile(one[None], radius=RADIUS, **SECTION).solid_volume for one in pile]
    # A U's two hinges are counted once; smarticles that pass through each other count once as well.
    assert np.mean(each) == pytest.approx(T1 * T2 * (W * 2.4 - T2 / 2), rel=0.002)
    assert 0.9 * sum(each) < profile.solid_volume <= sum(each) * 1.001
    assert profile.outside == 0
    assert profile.volumes.sum() == pytest.approx(math.pi * 4 * RADIUS**2 * profile.heights[-1])
    assert profile.packing.shape == (6, len(profile.heights) - 1)


def test_a_bar_is_found_in_its_ring_and_layer(shape):
    # A straight one along x from 0.1 to 0.9 of the third ring, in the second layer.
    ring = RADIUS / 6
    bar = shape(0.8 * ring / 2.4, 0.7, (0.0, 0.0)) + np.array([2.5 * ring, 0, 1.5 * ring])
    profile = packing_profile(bar[None], radius=RADIUS, **SECTION)
    assert np.argwhere(profile.packing > 0).tolist() == [[2, 1]]
    volume = math.pi * (9 - 4) * ring**3
    assert profile.packing[2, 1] == pytest.approx(0.8 * ring * T1 * T2 / volume, rel=0.02)
    # Beyond the wall it is in no ring, but not lost.
    moved = packing_profile(bar[None] + [RADIUS, 0, 0], radius=RADIUS, **SECTION)
    assert moved.packing.max() == 0
    assert moved.outside == pytest.approx(profile.solid_volume, rel=0.02)


def test_a_table_has_a_row_per_phase_ring_and_layer(make_run):
    run = make_run([(0, 0.0), (1, 0.0), (1, 0.0), (2, 0.01)])
    table = profile_table(Run(run), rings=3, layer=0.004)
    assert table.groupby("phase")["time [s]"].unique().tolist() == [[0.0], [0.2], [pytest.approx(0.3)]]
    last = table[table["phase"] == 2]
    assert len(last) % 3 == 0
    area = math.pi * (last["outer radius [m]"] ** 2 - last["inner radius [m]"] ** 2)
    solid = (last["phi voxel [-]"] * area * (last["top [m]"] - last["bottom [m]"])).sum()
    assert solid == pytest.approx(6 * T1 * T2 * W * 2.4, rel=0.1)
    assert (last.groupby("bottom [m]")["phi voxel [-]"].sum() > 0).tolist().count(True) >= 2
