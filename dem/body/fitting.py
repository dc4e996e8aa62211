"""Poses of rigid smarticles from the vertices that frames hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.body.linear import applied, eigen_symmetric
from dem.body.particle import Boxes
from dem.body.placement import Poses

Array = NDArray[np.float64]


def fitted_poses(boxes: Boxes, vertices: Array) -> tuple[Poses, Array]:
    """The poses at which a shape lies nearest to given vertices, by least squares.

    Of a straight shape the turn about its length is unknown, and some is taken, the same for the same vertices.

    Args:
        boxes: the shape.
        vertices: (N, 4, 3) barb tip, hinge, hinge, barb tip of each smarticle [m].

    Returns:
        The poses; and (N,) how far the farthest vertex of each is from its place [m], rounding for the same shape.

    Source:
        Horn, J. Opt. Soc. Am. A 4, 629 (1987).
    """
    centre, own = vertices.mean(axis=1), boxes.vertices.mean(axis=0)
    turns = _turns(np.einsum("nvi,vj->nij", vertices - centre[:, None], boxes.vertices - own))
    positions = centre - applied(turns, own[None])[:, 0]
    places = np.einsum("nij,vj->nvi", turns, boxes.vertices) + positions[:, None]
    off: Array = np.linalg.norm(places - vertices, axis=-1).max(axis=1)
    return Poses(positions, tuple(Rotation.from_matrix(turn) for turn in turns)), off


def _turns(moments: Array) -> Array:
    """(N, 3, 3) rotations R that make trace(Rᵀ M) largest, of M (N, 3, 3)."""
    m = moments / np.abs(moments).max(axis=(1, 2), keepdims=True)
    n = np.empty((len(m), 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        n[:, 1 + i, 1 + i] = m[:, i, i] - m[:, j, j] - m[:, k, k]
        n[:, 0, 1 + i] = n[:, 1 + i, 0] = m[:, k, j] - m[:, j, k]
        n[:, 1 + j, 1 + k] = n[:, 1 + k, 1 + j] = m[:, j, k] + m[:, k, j]
    n[:, 0, 0] = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    values, vectors = eigen_symmetric(n)
    w, x, y, z = np.take_along_axis(vectors, values.argmax(axis=1)[:, None, None], axis=2)[:, :, 0].T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
