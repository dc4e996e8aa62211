"""How a chain is laid out, and when it has come apart."""

import math

import numpy as np
import pytest
from scenes import chain

from dem.body.chain import extent, parted
from dem.body.state import State
from dem.phases.arrange import chain_of
from dem.scene.scene import Scene


def rest(scene: Scene) -> State:
    poses = chain_of(scene).poses()
    still = np.zeros_like(poses.positions)
    rotations = np.array([rotation.as_matrix() for rotation in poses.rotations])
    return State.rigid(scene.body.boxes, poses.positions, rotations, still, still)


def test_the_chain_is_laid_out_hooked_and_a_gap_apart() -> None:
    scene = chain()
    layout, state, d = chain_of(scene), rest(scene), scene.sphere_diameter
    spheres = state.spheres(scene.body)
    for k in range(5):
        apart = np.linalg.norm(spheres[k][:, None] - spheres[k + 1][None], axis=-1).min()
        # The nearest spheres of two rows need not face each other.
        assert apart == pytest.approx(d + layout.gap, rel=1e-4)
        # Hooked: the right barb of the left one is on the right of the other's left barb.
        assert state.vertices[k, :, 0].max() > state.vertices[k + 1, :, 0].min() + d
    for k in range(4):
        assert np.linalg.norm(spheres[k][:, None] - spheres[k + 2][None], axis=-1).min() >= d + layout.gap
    assert np.ptp(spheres[..., 1]) + d == pytest.approx(layout.width)
    assert layout.width == pytest.approx(0.062, abs=1e-9)
    assert state.positions.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
    for tied_at, height in (("axis", 0.0), ("tip", None)):
        ends = [
            state.link_positions[tie.smarticle, tie.link]
            + tie.along * state.link_rotations[tie.smarticle, tie.link][:, 0]
            for tie in layout.ties(tied_at)  # type: ignore[arg-type]
        ]
        assert ends[1][0] - ends[0][0] == pytest.approx(layout.length)
        assert ends[0][1] == pytest.approx(-ends[1][1])
        if height is not None:
            assert ends[0][1] == pytest.approx(height, abs=1e-12)


def test_a_chain_of_thicker_bodies_is_as_wide_as_two_and_hooked_a_gap_apart() -> None:
    scene = chain({"smarticle.middle_thickness_in_plane_m": 0.021})
    layout, state, d = chain_of(scene), rest(scene), scene.sphere_diameter
    spheres = state.spheres(scene.body)
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


def test_a_chain_has_parted_when_a_line_separates_two_neighbours() -> None:
    scene = chain()
    state, d = rest(scene), scene.sphere_diameter
    assert not parted(state, d)
    shift = np.zeros((6, 1, 3))
    shift[3:, 0, 0] = chain_of(scene).gap + 2.001 * d
    for factor, expected in ((0.99, False), (1.0, True)):
        moved = State(
            state.boxes,
            state.link_positions + factor * shift,
            state.link_rotations,
            state.link_velocities,
            state.link_spins,
        )
        assert parted(moved, d) is expected
