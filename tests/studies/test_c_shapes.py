"""The study of C shapes: laws and critical numbers that are known come out again, and verdicts for made-up runs."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dem.errors import InputError
from postprocess.measures.graph import EntanglementGraph
from postprocess.statistics.points import SEED
from studies.c_shapes import (
    AGAINST_END,
    AGAINST_LINE,
    CRITICAL,
    DELAYED,
    GROWTH,
    LAWS,
    OPENING,
    RANDOM,
    SHARE,
    SHARE_POURED,
    STUDY,
    at_random,
    critical_links,
    linked,
    links_per_body,
    measure,
    opening_of,
    residual,
)

RADIUS = 1.0


def ring(corners: int = 12) -> Any:
    """Segments (S, 2, 3) of a ring of radius 1 around the z axis, open at one corner."""
    angle = np.radians(10) + np.linspace(0, 2 * np.pi - np.radians(20), corners)
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return np.stack([points[:-1], points[1:]], axis=1)


def graph(number: int, i: Any, j: Any) -> EntanglementGraph:
    return EntanglementGraph(bodies=np.arange(number), i=np.asarray(i), j=np.asarray(j))


def test_links_are_counted_once_per_pair() -> None:
    first = ring()
    second = first[..., [0, 2, 1]] - [1.0, 0.0, 0.0]  # stands upright, and passes through the first one
    third = first + np.array([10.0, 0.0, 0.0])
    segments = np.concatenate([first, second, third])
    found = linked(segments, np.repeat([0, 1, 2], len(first)))
    assert links_per_body(found) == pytest.approx(1 / 3)
    assert found.clusters.largest == pytest.approx(2 / 3)


@pytest.mark.parametrize("law", LAWS)
def test_a_law_leaves_nothing_of_itself_and_more_of_the_others(law: str) -> None:
    times = np.geomspace(0.1, 6, 24)
    values = 0.5 + 0.7 * LAWS[law](times, 1.0)
    left = {other: residual(other, times, values) for other in LAWS}
    assert left[law] < 1e-3
    # A long exponential is a line, and so is a late logarithm; an early one has no onset.
    near = {("line", "exponential"), ("line", "delayed logarithm"), ("logarithm", "delayed logarithm")}
    assert all(left[other] > 5e-3 for other in LAWS if other != law and (law, other) not in near)


def test_random_graphs_become_giant_where_theory_says() -> None:
    """Half of an Erdős–Rényi graph is in one cluster at a mean degree of 2 ln 2, where S = 1 − exp(−c S)."""
    generator, number = np.random.default_rng(1), 1500
    i, j = np.triu_indices(number, k=1)
    kept = generator.random(len(i)) < 3 / number
    found = critical_links(graph(number, i[kept], j[kept]), generator)
    assert found == pytest.approx(np.log(2), rel=0.05)


def test_networks_without_a_giant_cluster_have_no_critical_number() -> None:
    generator = np.random.default_rng(1)
    assert np.isnan(critical_links(graph(50, np.arange(10), np.arange(10) + 20), generator))
    assert np.isnan(critical_links(graph(20, [], []), generator))


def test_bodies_placed_at_random_fill_the_cylinder() -> None:
    generator = np.random.default_rng(2)
    bodies = np.repeat(ring()[None], 2000, axis=0)
    centres = bodies.mean(axis=(1, 2))
    placed = at_random(bodies, centres, 3.0, 8.0, generator).reshape(bodies.shape)
    middle = placed.mean(axis=(1, 2))
    away = np.hypot(middle[:, 0], middle[:, 1])
    # Means over 2000 bodies: a uniform disc has 2/3 of its radius, a uniform height its half; 4 standard errors.
    assert away.mean() == pytest.approx(2.0, abs=0.07)
    assert middle[:, 2].mean() == pytest.approx(4.0, abs=0.21)
    lengths = np.linalg.norm(placed[:, :, 1] - placed[:, :, 0], axis=-1)
    np.testing.assert_allclose(lengths, np.linalg.norm(bodies[:, :, 1] - bodies[:, :, 0], axis=-1))
    normal = np.cross(placed[:, 0, 1] - placed[:, 0, 0], placed[:, 4, 1] - placed[:, 4, 0])
    up = np.abs(normal[:, 2]) / np.linalg.norm(normal, axis=1)
    assert up.mean() == pytest.approx(0.5, abs=0.03)


def test_other_runs_are_left_out() -> None:
    run: Any = SimpleNamespace(path="run", scene={"particle": [{"shape": "ring"}]}, phases=[])
    with pytest.raises(InputError, match="not C shapes of one kind"):
        opening_of(run)
    with pytest.raises(InputError, match="not deposit, relax, shake"):
        measure(run)


def runs_of(**values: float) -> pd.DataFrame:
    """Eight seeds of three opening angles; `values` are means by column, with a scatter of a tenth."""
    generator, rows = np.random.default_rng(7), []
    means = {GROWTH: 0.8, SHARE: 0.9, SHARE_POURED: 0.2, CRITICAL: 1.0, RANDOM: 1.0, AGAINST_LINE: -0.7}
    names = {"growth": GROWTH, "share": SHARE, "random": RANDOM, "line": AGAINST_LINE, "end": AGAINST_END}
    means |= {
        AGAINST_END: -0.3,
        DELAYED: -0.3,
        **{names[name]: value for name, value in values.items() if name in names},
    }
    for opening in (20.0, 40.0, 60.0):
        for seed in range(1, 9):
            noisy = {name: mean * (1 + 0.1 * generator.standard_normal()) for name, mean in means.items()}
            noisy[CRITICAL] *= 1 + values.get("slope", 0.0) * (opening - 40)
            rows.append({OPENING: opening, SEED: seed, **noisy})
    return pd.DataFrame(rows)


def verdicts(runs: pd.DataFrame) -> dict[str, str]:
    return {finding.id: str(finding.judge(runs).verdict) for finding in STUDY.findings}


def test_the_papers_findings_are_found_in_runs_that_have_them() -> None:
    found = verdicts(runs_of(slope=0.01))
    del found["growth-with-opening"]
    assert set(found.values()) == {"found"}


def test_the_opposite_is_not_found() -> None:
    found = verdicts(runs_of(growth=-0.5, share=0.2, random=2.0, line=0.4))
    assert [found[name] for name in ("links-grow", "logarithm", "percolates", "as-rings-at-random")] == [
        "not found"
    ] * 4


def test_a_critical_number_that_does_not_depend_on_the_opening_is_not_resolved() -> None:
    assert verdicts(runs_of())["critical-with-opening"] == "not resolved"
    assert verdicts(runs_of(slope=-0.01))["critical-with-opening"] == "found"
