"""Poses of rigid smarticles from the vertices that frames hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

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
        Kabsch, Acta Cryst. A 32, 922 (1976).
    """
    centre, own = vertices.mean(axis=1), boxes.vertices.mean(axis=0)
    u, _, vt = np.linalg.svd(np.einsum("nvi,vj->nij", vertices - centre[:, None], boxes.vertices - own))
    # No reflection: a flat shape fits as well either way.
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    turns = u @ vt
    positions = centre - turns @ own
    places = np.einsum("nij,vj->nvi", turns, boxes.vertices) + positions[:, None]
    off: Array = np.linalg.norm(places - vertices, axis=-1).max(axis=1)
    return Poses(positions, tuple(Rotation.from_matrix(turn) for turn in turns)), off
