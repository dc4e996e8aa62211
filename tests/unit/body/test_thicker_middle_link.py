"""A middle link thicker in the plane than the barbs: boxes, spheres and a chain laid out of them, by known answers."""

import math

import numpy as np
import pytest
from scenes import chain

from dem.body.chain import extent
from dem.body.particle import Boxes
from dem.body.state import State
from dem.phases.arrange import chain_of
from dem.scene.scene import Scene

W, L, T1, BARB, BODY, RHO = 0.0467, 0.042, 0.021, 0.0095, 0.0213, 1250.0
THICK = "smarticle.middle_thickness_in_plane_m"


def robot(body: float | None = BODY, angles: tuple[float, float] = (90.0, 90.0), barb: float = L) -> Boxes:
    return Boxes(
        middle_length=W,
        barb_length=barb,
        thickness_normal=T1,
        thickness_in_plane=BARB,
        density=RHO,
        angles=(math.radians(angles[0]), math.radians(angles[1])),
        middle_thickness_in_plane=body,
    )


def test_mass_centre_and_inertia_are_those_of_three_boxes_written_out() -> None:
    boxes = robot()
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


def rest(scene: Scene) -> State:
    poses = chain_of(scene).poses()
    still = np.zeros_like(poses.positions)
    rotations = np.array([rotation.as_matrix() for rotation in poses.rotations])
    return State.rigid(scene.particle.boxes, poses.positions, rotations, still, still)


def test_the_chain_is_as_wide_as_two_bodies_and_hooked_a_gap_apart() -> None:
    scene = chain({THICK: 0.021})
    layout, state, d = chain_of(scene), rest(scene), scene.sphere_diameter
    spheres = state.spheres(scene.particle)
    # Barb, gap and half a body from row to row, and half a body beyond each.
    assert layout.width == pytest.approx(0.0467 + 0.00105 + 1.5 * 0.021)
    assert np.ptp(spheres[..., 1]) + d == pytest.approx(layout.width)
    assert extent(state, d) == pytest.approx(layout.width)
    for k in range(5):
        apart = np.linalg.norm(spheres[k][:, None] - spheres[k + 1][None], axis=-1).min()
        # The nearest spheres need not face each other.
        assert apart == pytest.approx(d + layout.gap, rel=1e-3)
        # Tips stand a gap before the other's body.
        facing = state.vertices[k, 0, 1] if k % 2 == 0 else state.vertices[k, 3, 1]
        body = state.vertices[k + 1, 1, 1] + math.copysign(0.0105, facing - state.vertices[k + 1, 1, 1])
        assert abs(facing - body) == pytest.approx(layout.gap)
    assert state.positions.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
    ends = [
        state.link_positions[tie.smarticle, tie.link] + tie.along * state.link_rotations[tie.smarticle, tie.link][:, 0]
        for tie in layout.ties("axis")
    ]
    assert ends[0][1] == pytest.approx(0, abs=1e-12)
    assert ends[1][0] - ends[0][0] == pytest.approx(layout.length)
