"""Build the graph of entangled bodies, and follow its links from frame to frame.

Two bodies are joined if they are entangled by a measure of pairs: average crossing number or linking number at or above
a threshold, or one passing through the polygon of the other. The links' number per body is the degree; clusters and
percolation follow from `postprocess.measures.clusters`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from dem.errors import InputError
from postprocess.geometry.links import Flags, Floats, Whole
from postprocess.measures.closed_linking import ClosedLinking
from postprocess.measures.clusters import Clusters, joined_clusters
from postprocess.measures.crossing_number import CrossingNumbers
from postprocess.measures.entanglement import PolygonCrossings


@dataclass(frozen=True, kw_only=True, eq=False)
class EntanglementGraph:
    """Graph of B bodies, with a link for each of the P pairs that are entangled."""

    bodies: Whole = field(repr=False)  #: (B,) int64, numbers of the bodies
    i: Whole = field(repr=False)  #: (P,) int64, index in `bodies` of the first body of each link
    j: Whole = field(repr=False)  #: (P,) int64, index in `bodies` of the second body, above i

    @property
    def degree(self) -> Whole:
        """(B,) number of links of each body."""
        return np.bincount(np.concatenate([self.i, self.j]), minlength=len(self.bodies))

    @property
    def clusters(self) -> Clusters:
        """Connected components; UndefinedMeasureError if there is no body."""
        return joined_clusters(len(self.bodies), self.i, self.j)


@dataclass(frozen=True, kw_only=True, eq=False)
class LinkLifetimes:
    """Times at which L links form and break; a link that breaks and forms again counts twice."""

    first: Whole = field(repr=False)  #: (L,) int64, number of the first body
    second: Whole = field(repr=False)  #: (L,) int64, number of the second body
    begin: Floats = field(repr=False)  #: (L,) float64 [s], time of the first graph with the link
    end: Floats = field(repr=False)  #: (L,) float64 [s], time of the next graph without it, or the last time
    formed: Flags = field(repr=False)  #: (L,) bool, whether the link formed after the first graph
    broken: Flags = field(repr=False)  #: (L,) bool, whether the link broke, so that the last graph lacks it
    observed: float  #: Time from the first to the last graph [s]

    @property
    def mean(self) -> float:
        """Mean lifetime [s]: total time of all links over the number of links that broke; NaN if none broke.

        It is the maximum-likelihood estimate for exponential lifetimes of which some last beyond the observation.
        """
        broken = int(self.broken.sum())
        return float((self.end - self.begin).sum() / broken) if broken else math.nan

    @property
    def formation_rate(self) -> float:
        """Number of links that form per time [1/s]."""
        return float(self.formed.sum() / self.observed)

    @property
    def breaking_rate(self) -> float:
        """Number of links that break per time [1/s]."""
        return float(self.broken.sum() / self.observed)


def entanglement_graph(
    measured: CrossingNumbers | ClosedLinking | PolygonCrossings, *, least: float
) -> EntanglementGraph:
    """Join the bodies whose entanglement is at least a threshold.

    Args:
        measured: Result of `average_crossing_numbers`, `closed_linking` or `polygon_crossings`.
        least: Smallest average crossing number, |linking number|, or number of segments through a polygon [-] of
            entangled bodies. 1 is usual for the latter two. The average crossing number has no natural threshold: two
            long rods that touch at right angles have nearly 0.5.

    Raises:
        InputError: The threshold is not above 0.

    Source:
        Kim, Wu & Han, Nature Communications 2025, 10.1038/s41467-025-66228-3: network of entangled C shapes.
    """
    if not least > 0:
        raise InputError(f"least must be above 0: got {least}; at 0 every body is joined to every other one")
    if isinstance(measured, CrossingNumbers):
        i, j = np.nonzero(np.triu(measured.matrix, k=1) >= least)
    else:
        size = np.abs(measured.number) if isinstance(measured, ClosedLinking) else measured.segments
        pairs = np.stack([measured.i, measured.j], axis=1)[size >= least]
        i, j = np.unique(np.sort(pairs, axis=1), axis=0).reshape(-1, 2).T
    return EntanglementGraph(bodies=measured.bodies, i=i.astype(np.int64), j=j.astype(np.int64))


def link_lifetimes(graphs: Sequence[EntanglementGraph], times: ArrayLike) -> LinkLifetimes:
    """Find when each link forms and breaks, from graphs of the same bodies at ascending times (K,) [s].

    A link that breaks and forms again between two graphs seems unbroken, so that lifetimes are resolved only above the
    time between graphs.

    Raises:
        InputError: There are fewer than 2 graphs, or times are not as many as these, or do not ascend.

    Source:
        Mean with lifetimes cut off by the observation: Epstein & Sobel, J. Am. Stat. Assoc. 48, 486 (1953).
    """
    moments = np.asarray(times, dtype=np.float64)
    if len(graphs) < 2 or moments.shape != (len(graphs),) or not np.all(np.diff(moments) > 0):
        raise InputError(
            f"times must be {len(graphs)} ascending numbers [s], one per graph, 2 or more: got {len(graphs)} graphs "
            f"and an array of shape {moments.shape}"
        )
    rows = [
        np.column_stack([np.sort(graph.bodies[np.stack([graph.i, graph.j], axis=1)], axis=1), np.full(len(graph.i), k)])
        for k, graph in enumerate(graphs)
    ]
    found = np.concatenate(rows)
    found = found[np.lexsort(found.T[::-1])]
    # A row continues a link if it is of the pair of the row before, and of the next graph.
    steps = np.diff(found, axis=0)
    new = np.concatenate([[True] * bool(len(found)), (steps[:, :2] != 0).any(axis=1) | (steps[:, 2] != 1)]).astype(bool)
    start = np.nonzero(new)[0]
    last = found[np.append(start[1:], len(found)) - 1, 2] if len(found) else np.empty(0, dtype=np.int64)
    final = len(graphs) - 1
    return LinkLifetimes(
        first=found[start, 0],
        second=found[start, 1],
        begin=moments[found[start, 2]],
        end=moments[np.minimum(last + 1, final)],
        formed=found[start, 2] > 0,
        broken=last < final,
        observed=float(moments[-1] - moments[0]),
    )
