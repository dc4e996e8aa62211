"""A middle link thicker in the plane than the barbs: boxes against a known answer."""

import math

import numpy as np
import pytest

from dem.body.particle import Boxes

W, L, T1, BARB, BODY, RHO = 0.0467, 0.042, 0.021, 0.0095, 0.0213, 1250.0


def test_mass_centre_and_inertia_are_those_of_three_boxes_written_out() -> None:
    boxes = Boxes(
        middle_length=W,
        barb_length=L,
        thickness_normal=T1,
        thickness_in_plane=BARB,
        density=RHO,
        angles=(math.pi / 2, math.pi / 2),
        middle_thickness_in_plane=BODY,
    )
    middle, barb = RHO * W * BODY * T1, RHO * L * BARB * T1
    mass = middle + 2 * barb
    y = 2 * barb * (L / 2) / mass  # centre of mass above the middle link
    along_x = middle * (T1**2 + BODY**2) / 12 + middle * y**2
    along_x += 2 * (barb * (L**2 + T1**2) / 12 + barb * (L / 2 - y) ** 2)
    along_y = middle * (W**2 + T1**2) / 12 + 2 * (barb * (T1**2 + BARB**2) / 12 + barb * (W / 2) ** 2)
    along_z = middle * (W**2 + BODY**2) / 12 + middle * y**2
    along_z += 2 * (barb * (L**2 + BARB**2) / 12 + barb * ((W / 2) ** 2 + (L / 2 - y) ** 2))
    assert boxes.volume == pytest.approx(mass / RHO, rel=1e-13)
    assert boxes.mass == pytest.approx(mass, rel=1e-13)
    assert boxes.link_masses == pytest.approx([barb, middle, barb], rel=1e-13)
    assert boxes.inertia == pytest.approx([along_x, along_y, along_z], rel=1e-12)
    assert boxes.vertices[:, 1] == pytest.approx([L - y, -y, -y, L - y], rel=1e-12)
    own = np.array([[T1**2 + t**2, length**2 + T1**2, length**2 + t**2] for length, t in ((L, BARB), (W, BODY))]) / 12
    assert boxes.link_inertias == pytest.approx(np.array([barb * own[0], middle * own[1], barb * own[0]]), rel=1e-12)
