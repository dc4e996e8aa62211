"""Poses from vertices: what a pose makes of a shape gives the pose back."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import W, make_boxes
from scipy.spatial.transform import Rotation

from dem.body.particle import Boxes
from dem.body.placement import Poses, fitted_poses
from dem.body.state import State

COUNT = 40
ROUNDING = 1e-15  # m; some units in the last place of lengths of 0.1 m


def placed(boxes: Boxes, poses: Poses) -> NDArray[np.float64]:
    turns, still = np.array([turn.as_matrix() for turn in poses.rotations]), np.zeros_like(poses.positions)
    return State.rigid(boxes, poses.positions, turns, still, still).vertices


def random_poses(seed: int) -> Poses:
    rng = np.random.default_rng(seed)
    return Poses(rng.uniform(-0.05, 0.05, (COUNT, 3)), tuple(Rotation.random(COUNT, rng=rng)))


@pytest.mark.parametrize("angles", [(90.0, 90.0), (90.0, -15.0), (30.0, 105.0), (-15.0, -15.0)])
@pytest.mark.parametrize("ratio", [0.2, 0.7, 1.4])
def test_poses_come_back(ratio: float, angles: tuple[float, float]) -> None:
    boxes, poses = make_boxes(ratio, angles), random_poses(1)
    found, off = fitted_poses(boxes, placed(boxes, poses))
    np.testing.assert_allclose(found.positions, poses.positions, atol=ROUNDING)
    for one, other in zip(found.rotations, poses.rotations, strict=True):
        # Rounding of a vertex over the shortest lever, a barb of 0.2 w.
        assert (one * other.inv()).magnitude() < 20 * ROUNDING / W
    assert off.max() < 2 * ROUNDING


@pytest.mark.parametrize(("ratio", "angles"), [(0.0, (90.0, 90.0)), (0.7, (0.0, 0.0))])
def test_a_straight_shape_gets_one_reproducible_turn(ratio: float, angles: tuple[float, float]) -> None:
    boxes = make_boxes(ratio, angles)
    vertices = placed(boxes, random_poses(2))
    found, off = fitted_poses(boxes, vertices)
    assert off.max() < 2 * ROUNDING
    assert all(turn.as_matrix()[:, 0] @ turn.as_matrix()[:, 0] == pytest.approx(1) for turn in found.rotations)
    again, _ = fitted_poses(boxes, vertices.copy())
    assert np.array_equal(placed(boxes, found), placed(boxes, again))


def test_another_shape_is_far_off() -> None:
    # A barb at 85° instead of 90°: its tip is 0.7 w · 5° = 0.7 mm away, of which the best fit spreads some.
    _, off = fitted_poses(make_boxes(), placed(make_boxes(angles=(90.0, 85.0)), random_poses(3)))
    assert off.min() > 0.2e-3


def test_a_mirrored_shape_is_no_pose_of_it() -> None:
    boxes = make_boxes(angles=(90.0, 30.0))
    mirrored = placed(boxes, random_poses(4))[:, ::-1]  # barb 2 where barb 1 should be
    _, off = fitted_poses(boxes, mirrored)
    assert off.min() > 1e-3
