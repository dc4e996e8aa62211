"""Graphs, percolation and lifetimes of links that are known."""

import math

import numpy as np
import pytest
from synthetic.curves import rings, torus_curve

from dem.errors import InputError
from postprocess import (
    EntanglementGraph,
    average_crossing_numbers,
    closed_linking,
    entanglement_graph,
    extents,
    link_lifetimes,
    polygon_crossings,
    spans,
)


def chain(count):
    """Rings of radius 1.5 in a row along x, each one linked with the next one, at right angles in turn."""
    t = 2 * np.pi * (np.arange(16) + 0.5) / 16
    ring = 1.5 * np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    return rings(*(ring[:, [0, 1, 2] if k % 2 else [0, 2, 1]] + [2.0 * k, 0, 0] for k in range(count)))


@pytest.mark.parametrize(
    ("measure", "least"), [(closed_linking, 1), (polygon_crossings, 1), (average_crossing_numbers, 1.0)]
)
def test_a_chain_of_rings_is_a_line_of_links_that_percolates(measure, least):
    segments, body = chain(6)
    graph = entanglement_graph(measure(segments, body), least=least)
    assert graph.degree.tolist() == [1, 2, 2, 2, 2, 1]
    assert (graph.i.tolist(), graph.j.tolist()) == ([0, 1, 2, 3, 4], [1, 2, 3, 4, 5])
    low, high = extents(segments, body)
    assert spans(graph.clusters, low[:, 0] < -1, high[:, 0] > 11)
    opened = body != 2
    cut = entanglement_graph(measure(segments[opened], body[opened]), least=least)
    assert cut.bodies.tolist() == [0, 1, 3, 4, 5]
    assert cut.clusters.sizes.tolist() == [3, 2]
    assert cut.clusters.largest == 0.6
    low, high = extents(segments[opened], body[opened])
    assert not spans(cut.clusters, low[:, 0] < -1, high[:, 0] > 11)


def test_a_random_graph_has_its_giant_cluster_above_one_link_per_two_bodies():
    """Erdős and Rényi: with mean degree c the largest cluster has the share s = 1 - exp(-c s), for c = 2 s = 0.797."""
    random, count = np.random.default_rng(0), 4000
    for degree, expected, band in ((0.5, 0.0, 0.02), (2.0, 0.7968, 0.03)):
        pairs = random.integers(0, count, size=(int(degree * count / 2), 2))
        pairs = np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1)
        graph = EntanglementGraph(bodies=np.arange(count), i=pairs[:, 0], j=pairs[:, 1])
        assert graph.clusters.largest == pytest.approx(expected, abs=band)


def graphs_of(*rows):
    """Graphs of bodies 10, 11, … from lists of pairs of indices."""
    return [
        EntanglementGraph(bodies=np.arange(10, 20), i=pairs[:, 0], j=pairs[:, 1])
        for pairs in (np.array(row, dtype=np.int64).reshape(-1, 2) for row in rows)
    ]


def test_a_link_that_breaks_and_forms_again_counts_twice():
    found = link_lifetimes(graphs_of([(0, 1)], [(0, 1), (2, 3)], [(2, 3)], [(0, 1), (2, 3)]), [0.0, 1.0, 3.0, 6.0])
    assert list(zip(found.first.tolist(), found.second.tolist(), strict=True)) == [(10, 11), (10, 11), (12, 13)]
    assert found.begin.tolist() == [0, 6, 1]
    assert found.end.tolist() == [3, 6, 6]
    assert found.formed.tolist() == [False, True, True]
    assert found.broken.tolist() == [True, False, False]
    assert found.mean == 3 + 0 + 5
    assert (found.formation_rate, found.breaking_rate) == pytest.approx((2 / 6, 1 / 6))
    none = link_lifetimes(graphs_of([], []), [0.0, 1.0])
    assert math.isnan(none.mean)
    assert none.formation_rate == 0


def test_exponential_lifetimes_are_found_though_the_observation_cuts_them_off():
    """Links of mean life 5 s over 6 s in steps of 0.05 s; leaving the unbroken ones out would give less than 3 s."""
    random, times = np.random.default_rng(4), np.arange(0, 6.01, 0.05)
    life = random.exponential(5.0, size=4000)
    bodies = np.arange(8000)
    graphs = [
        EntanglementGraph(bodies=bodies, i=2 * np.nonzero(life > t)[0], j=2 * np.nonzero(life > t)[0] + 1)
        for t in times
    ]
    found = link_lifetimes(graphs, times)
    # Four standard errors of 2800 broken links, and half a step.
    assert found.mean == pytest.approx(5.0, abs=4 * 5 / math.sqrt(found.broken.sum()) + 0.03)
    assert (found.end - found.begin)[found.broken].mean() < 3


def test_thresholds_and_times_that_mean_nothing_are_rejected():
    with pytest.raises(InputError, match="least must be above 0: got 0"):
        entanglement_graph(closed_linking(*rings(torus_curve(1, 0))), least=0)
    with pytest.raises(InputError, match="times must be 2 ascending numbers"):
        link_lifetimes(graphs_of([], []), [1.0, 0.0])
