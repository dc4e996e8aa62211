"""What plans say that the links engine costs, and what a fidelity is there."""

from __future__ import annotations

import pytest

from dem.plan.outlook import Plan, plan
from dem.scene.reading import parse_scene


def rates(made: Plan) -> dict[str, float]:
    """Seconds per simulated second by type of phase."""
    return {phase.type: phase.wall_s / phase.estimate_s for phase in made.phases}


def bench(activity: dict[str, object], count: int = 270) -> Plan:
    """A scene of `benchmarks.engines`, in a container as wide as keeps the pile's height."""
    radius = 0.0234 * (count / 270) ** 0.5
    phases = [{"type": "deposit", "per_layer": max(4, count // 27)}, {"duration_s": 2.0, **activity}]
    data = {"schema_version": 1, "engine": "links", "seed": 1, "count": count, "container": {"radius_m": radius}}
    return plan(parse_scene({**data, "phases": phases}, source="test"))


@pytest.mark.parametrize(
    ("made", "kind", "measured"),
    [
        # results/bench: idle, three seeds each.
        (bench({"type": "shake"}), "shake", 0.98),
        (bench({"type": "internal-oscillation", "theta_deg": 10.0}), "internal-oscillation", 1.74),
        # results/bench/cost.csv, by what a busy machine adds, 0.63.
        (bench({"type": "relax"}), "relax", 0.63 * 1.83),
    ],
)
def test_costs_are_those_measured(made: Plan, kind: str, measured: float) -> None:
    assert rates(made)[kind] == pytest.approx(measured, rel=0.25)
