"""Find clusters of smarticles joined by contacts or crossings, and whether one spans the container."""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import Chain, Flags, UndefinedMeasureError, Vertices, Whole, checked_vertices
from postprocess.measures.contacts import at_wall, chain_of, on_floor, pairs_in_contact, pairs_of_strands
from postprocess.measures.entanglement import crossing_pairs
from postprocess.measures.heights import material_height
from postprocess.measures.registry import FrameMeasure, Quantity, in_one_cylinder


@dataclass(frozen=True, kw_only=True, eq=False)
class Clusters:
    """The C connected components of a graph whose nodes are the N smarticles of a frame."""

    labels: Whole = field(repr=False)  #: (N,) int64, number of each smarticle's cluster; 0 is the largest cluster
    sizes: Whole  #: (C,) int64, number of smarticles in each cluster, descending

    @property
    def largest(self) -> float:
        """Fraction of the smarticles that belong to the largest cluster [-]."""
        return float(self.sizes[0] / len(self.labels))


def contact_clusters(vertices: Vertices, chain: Chain, distance: float) -> Clusters:
    """Find clusters of smarticles of which two strands' axes are at most a distance [m] apart."""
    vertices = checked_vertices(vertices)
    pairs = pairs_of_strands(vertices, chain, distance)
    return joined_clusters(len(vertices), pairs.i, pairs.j)


def entanglement_clusters(vertices: Vertices) -> Clusters:
    """Find clusters of smarticles joined by crossings."""
    pairs = crossing_pairs(vertices)
    return joined_clusters(len(checked_vertices(vertices)), pairs.i, pairs.j)


def contact_graph(frame: Frame, run: Run) -> Clusters:
    """Find clusters of smarticles that touch in the run's engine, see `contacts.pairs_in_contact`."""
    pairs = pairs_in_contact(frame, run)
    return joined_clusters(frame.count, pairs.i, pairs.j)


def spans_height(clusters: Clusters, vertices: Vertices, *, chain: Chain, floor_z: float) -> bool:
    """Return whether one cluster reaches from the floor to the top of the pile.

    Vertices (N, 4, 3) and height of the floor are in [m]; `chain` has the sizes of the strands. The top is the height
    below which 95 % of the material lies.

    Source:
        Stauffer & Aharony, Introduction to Percolation Theory (1994), section 2: a cluster percolates if it joins
        opposite faces.
    """
    vertices = checked_vertices(vertices)
    top = floor_z + material_height(vertices, floor_z=floor_z)
    return spans(clusters, on_floor(vertices, chain=chain, floor_z=floor_z), vertices[..., 2].max(axis=1) >= top)


def spans(clusters: Clusters, low: Flags, high: Flags) -> bool:
    """Return whether one cluster joins two sets of bodies, such as those at opposite sides of a container.

    The bodies of each set are marked true in an array (N,).

    Source:
        Stauffer & Aharony, Introduction to Percolation Theory (1994), section 2.
    """
    return bool(np.isin(clusters.labels[low], clusters.labels[high]).any())


def spans_width(clusters: Clusters, vertices: Vertices, *, chain: Chain, wall_radius: float) -> bool:
    """Return whether one cluster spans the container from one side of the round wall to the other.

    A cluster spans the container if its contacts with the wall do not all lie on one half of the wall. Vertices
    (N, 4, 3) and radius of the wall are in [m]; the wall is centred at x = y = 0. `chain` has the sizes of the strands.
    """
    vertices = checked_vertices(vertices)
    smarticle, vertex = np.nonzero(at_wall(vertices, chain=chain, wall_radius=wall_radius))
    azimuth = np.arctan2(vertices[smarticle, vertex, 1], vertices[smarticle, vertex, 0])
    for label in np.unique(clusters.labels[smarticle]):
        around = np.sort(azimuth[clusters.labels[smarticle] == label])
        if np.diff(around, append=around[0] + 2 * np.pi).max() < np.pi:
            return True
    return False


def joined_clusters(count: int, i: Whole, j: Whole) -> Clusters:
    """Find the clusters of a graph of `count` smarticles, by the indices i (P,) and j (P,) of its P edges.

    UndefinedMeasureError if there is no smarticle.
    """
    if count == 0:
        raise UndefinedMeasureError("a cluster needs at least 1 smarticle: got 0")
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(count, count))
    _, found = connected_components(graph, directed=False)
    sizes = np.bincount(found)
    order = np.argsort(-sizes, kind="stable")
    ranks = np.empty_like(order)
    ranks[order] = np.arange(len(order))
    return Clusters(labels=ranks[found].astype(np.int64), sizes=sizes[order].astype(np.int64))


def _spans_of(clusters: Clusters, frame: Frame, run: Run) -> tuple[float, float, float]:
    vertices, chain = frame.vertices, chain_of(run)
    height = spans_height(clusters, vertices, chain=chain, floor_z=frame.floor_z)
    # Without a wall there is no width to span.
    walled = run.manifest.walled(frame.phase)
    width = walled and spans_width(clusters, vertices, chain=chain, wall_radius=run.manifest.container_radius_m)
    return clusters.largest, float(height), float(width) if walled else math.nan


MEASURES = tuple(
    FrameMeasure(
        name=f"{name} graph",
        place=55,
        quantities=(
            Quantity(f"{name} graph largest share", "-"),
            Quantity(f"{name} graph spans height", "-"),
            Quantity(f"{name} graph spans width", "-"),
        ),
        take=take,
        available_for=in_one_cylinder,
        costly=True,
    )
    for name, take in (
        ("contact", lambda f, run: _spans_of(contact_graph(f, run), f, run)),
        ("crossing", lambda f, run: _spans_of(entanglement_clusters(f.vertices), f, run)),
    )
)
