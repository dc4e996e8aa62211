"""The shipped study of fracture: its points are the paper's procedures, and its hooks are the paper's."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

import studies
from dem.phases.deposit import Deposit
from dem.phases.internal_oscillation import InternalOscillation
from dem.phases.pull_hook import PullHook
from dem.phases.relax import Relax
from dem.phases.shake import Shake
from dem.phases.shape_change import ShapeChange
from studies.base.shipped import differences
from studies.registry import study_file
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import load_sweep

STUDIES = Path(studies.__file__).parent
W, T2 = 0.0117, 0.5e-3


@pytest.fixture(scope="module")
def full() -> list[Point]:
    return [point for point in expand(load_sweep(study_file("fracture"))) if not point.again]


def test_the_points_are_those_asked_for(full: list[Point]) -> None:
    found = {(p.values["procedure"], p.values["l_over_w"], p.values["theta_deg"], p.scene.seed) for p in full}
    internal = [(0.7, theta) for theta in (5, 10, 15, 20, 30)]
    internal += [(ratio, 10) for ratio in (0.4, 0.5, 0.6, 0.8, 0.9, 1.0, 1.1)]
    wanted = [(name, 0.7, 0) for name in ("static", "external", "shape-change")]
    wanted += [("internal", *point) for point in internal]
    assert found == {(*point, seed) for point in wanted for seed in range(1, 9)}
    assert len(full) == 120
    assert {point.scene.engine for point in full} == {"links"}
    # What compares procedures comes before what varies l/w.
    assert [point.values["l_over_w"] for point in full[:8]] == [0.7] * 8


def test_counts_are_the_papers(full: list[Point]) -> None:
    with (STUDIES / "gravish" / "savoie_counts.csv").open(encoding="utf-8") as file:
        counts = {float(row["l_over_w"]): int(row["n"]) for row in csv.DictReader(file)}
    for point in full:
        assert point.scene.count == counts[point.scene.smarticle.aspect_ratio]


def test_the_hook_is_raised_by_2w_at_w_per_second_after_half_a_second_of_rest(full: list[Point]) -> None:
    for point in full:
        scene = point.scene
        assert scene.hooks is not None
        assert (scene.hooks.lower_height_m, scene.hooks.upper_height_m) == pytest.approx((10 * T2, 20 * T2))
        *_, rest, pull = scene.phases
        assert isinstance(rest, Relax)
        assert isinstance(pull, PullHook)
        assert rest.duration_s == 0.5
        assert (pull.distance_m, pull.speed_m_per_s, pull.duration_s) == pytest.approx((2 * W, W, 2.0))
        assert scene.recording.energy
        weight = scene.count * scene.smarticle.boxes.mass * scene.gravity_m_per_s2
        assert pull.force_limit_N == pytest.approx(1.5 * weight, rel=1e-3)
        # A fifth more than the limit on one contact, and it is not yet so deep in that the watchdog stops the run.
        assert 1.2 * pull.force_limit_N / scene.fidelity.stiffness_N_per_m < 0.5 * scene.sphere_diameter


def test_each_procedure_is_its_activity(full: list[Point]) -> None:
    kinds = {"external": Shake, "shape-change": ShapeChange, "internal": InternalOscillation}
    for point in full:
        phases, procedure = point.scene.phases, str(point.values["procedure"])
        assert isinstance(phases[0], Deposit)
        if procedure == "static":
            assert len(phases) == 3
            continue
        _, rest, active, _, _ = phases
        assert isinstance(rest, Relax)
        assert rest.duration_s == (1.0 if procedure == "shape-change" else 0.5)
        assert isinstance(active, kinds[procedure])
        if isinstance(active, InternalOscillation):
            assert active.scaled
            assert (active.theta_deg, active.duration_s) == (point.values["theta_deg"], 5.0)


def test_the_quick_variant_covers_procedures_and_amplitudes(full: list[Point]) -> None:
    found = expand(load_sweep(study_file("fracture", quick=True)))
    quick, again = [point for point in found if not point.again], [point for point in found if point.again]
    assert {point.name for point in again} == {f"{kind}_lw0.70_yade_seed1" for kind in ("static", "shape-change")}
    names = {point.name.rpartition("_seed")[0] for point in quick}
    kinds = ("static", "external", "shape-change", "internal10", "internal30")
    assert names == {f"{kind}_lw0.70_links" for kind in kinds}
    assert {point.scene.seed for point in quick} == {1, 2, 3}
    lines = differences(quick, full)
    assert lines[:3] == ["15 runs instead of 120", "fidelity: draft instead of standard", "share: 0.5 instead of 1.0"]
    assert {point.scene.count for point in quick} == {135}
    # Which of the paper's numbers is halved follows from l/w.
    assert not any(line.startswith(("n:", "per_layer:")) for line in lines)


def test_a_variable_that_one_of_the_two_lacks_is_told(full: list[Point]) -> None:
    def without(points: list[Point], name: str) -> list[Point]:
        return [
            replace(point, values={key: value for key, value in point.values.items() if key != name})
            for point in points
        ]

    quick = expand(load_sweep(study_file("fracture", quick=True)))
    assert "limit: not there" in differences(without(quick, "limit"), full)
    assert "limit: 1.5" in differences(quick, without(full, "limit"))
