"""Which smarticles hang together: connected parts of the graphs of contact and of entanglement."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from postprocess.errors import UndefinedMeasureError
from postprocess.geometry.links import checked_vertices
from postprocess.measures.contacts import contact_pairs
from postprocess.measures.entanglement import crossing_pairs

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Clusters:
    """Connected parts of a graph whose nodes are the smarticles of a frame.

    Attributes:
        labels: (N,) int64, number of each smarticle's cluster, 0 for the largest one.
        sizes: (C,) int64, smarticles of each cluster, descending.
    """

    labels: NDArray[np.int64] = field(repr=False)
    sizes: NDArray[np.int64]

    @property
    def largest(self) -> float:
        """Share of the smarticles that belong to the largest cluster [-]."""
        return float(self.sizes[0] / len(self.labels))


def contact_clusters(vertices: ArrayLike, distance: float) -> Clusters:
    """Smarticles joined by contact, directly or through others.

    Args:
        vertices: (N, 4, 3) [m], barb tip, hinge, hinge, barb tip of each smarticle.
        distance: Distance of centrelines up to which two smarticles touch [m], see `contacts.contact_pairs`.

    Returns:
        The clusters.

    Raises:
        InputError: Bad vertices or distance.
        UndefinedMeasureError: There is no smarticle.
    """
    pairs = contact_pairs(vertices, distance)
    return _clusters(len(checked_vertices(vertices)), pairs.i, pairs.j)


def entanglement_clusters(vertices: ArrayLike) -> Clusters:
    """Smarticles joined by entanglement: a link of one passes through the plane of the other, whichever it is.

    Args:
        vertices: (N, 4, 3) [m], barb tip, hinge, hinge, barb tip of each smarticle.

    Returns:
        The clusters.

    Raises:
        InputError: Bad vertices.
        UndefinedMeasureError: There is no smarticle.
    """
    pairs = crossing_pairs(vertices)
    return _clusters(len(checked_vertices(vertices)), pairs.i, pairs.j)


def _clusters(count: int, i: NDArray[np.int64], j: NDArray[np.int64]) -> Clusters:
    if count == 0:
        msg = "a cluster needs at least 1 smarticle: got 0"
        raise UndefinedMeasureError(msg)
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(count, count))
    _, found = connected_components(graph, directed=False)
    sizes = np.bincount(found)
    order = np.argsort(-sizes, kind="stable")
    ranks = np.empty_like(order)
    ranks[order] = np.arange(len(order))
    return Clusters(labels=ranks[found].astype(np.int64), sizes=sizes[order].astype(np.int64))
