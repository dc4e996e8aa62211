"""Smarticles as vertices: tip, hinge, hinge, tip."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

W, T1, T2, RADIUS = 0.0117, 0.00127, 0.0005, 0.0234


def bent(
    width: float = W, aspect_ratio: float = 0.7, angles: tuple[float, float] = (90.0, 90.0)
) -> NDArray[np.float64]:
    """(4, 3) [m]: one smarticle in the plane z = 0, middle link along x, mouth up y; angles in degrees."""
    first, second = np.radians(angles)
    barb = aspect_ratio * width
    left, right = np.array([-width / 2, 0, 0]), np.array([width / 2, 0, 0])
    tip_left = left + barb * np.array([-np.cos(first), np.sin(first), 0])
    tip_right = right + barb * np.array([np.cos(second), np.sin(second), 0])
    return np.array([tip_left, left, right, tip_right])


def u_shape(barb: float, middle: float = W) -> NDArray[np.float64]:
    """(4, 3) [m]: a U in the x-y plane with its centre of mass at the origin."""
    shape = bent(middle, barb / middle)
    shape[:, 1] -= barb**2 / (middle + 2 * barb)
    return shape


def random_scene(
    count: int,
    seed: int,
    *,
    box: float = 3.0,
    width: float = 1.0,
    aspect_ratio: float = 0.7,
    angles: tuple[float, float] | None = None,
) -> NDArray[np.float64]:
    """(N, 4, 3): smarticles at random poses in a cube of `box` widths; random angles unless given."""
    rng = np.random.default_rng(seed)
    scene = []
    for _ in range(count):
        bend = rng.uniform(-15, 105, 2) if angles is None else angles
        turn = Rotation.random(rng=rng).as_matrix()
        shape = bent(width, aspect_ratio, bend)
        scene.append(shape @ turn.T + rng.uniform(0, box * width, 3))
    return np.array(scene)
