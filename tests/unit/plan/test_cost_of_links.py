"""What plans say that the links engine costs, and what a fidelity is there."""

from __future__ import annotations

import pytest

from dem.plan.outlook import Plan, plan
from dem.scene.reading import parse_scene

KINDS = ("deposit", "relax", "shake", "internal-oscillation")


def planned(*, count: int = 80, tiers: list[dict[str, float]] | None = None, **fidelity: object) -> Plan:
    phases = [
        {"type": "deposit", "per_layer": 10},
        {"type": "relax", "duration_s": 0.4},
        {"type": "shake", "duration_s": 1, "frequency_hz": 30, "peak_acceleration_g": 2},
        {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 1},
    ]
    data = {
        **{"schema_version": 1, "engine": "links", "seed": 1, "count": count, "phases": phases},
        "container": {"tiers": tiers} if tiers else {"radius_m": 0.0234},
        "fidelity": {"stiffness_N_per_m": 500, **fidelity},
        "recording": {"series_interval_s": 0.02, "frame_interval_s": 0.06, "checkpoint_interval_s": None},
    }
    return plan(parse_scene(data, source="test"))


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


@pytest.mark.parametrize(("count", "growth"), [(1000, 1.06), (5000, 1.28), (10_000, 1.52)])
def test_what_a_smarticle_costs_grows_as_memory_is_used_up(count: int, growth: float) -> None:
    # results/scaling: steps alone, idle.
    few, many = (rates(bench({"type": "shake"}, each))["shake"] / each for each in (100, count))
    assert many / few == pytest.approx(growth, rel=0.25)


def test_edges_of_a_wall_of_tiers_cost() -> None:
    plain = planned(count=131)
    data = [{"radius_m": radius, "height_m": 0.03} for radius in (0.0234, 0.0187, 0.014)]
    tiers = planned(count=131, tiers=data)
    # results/bench/cost.csv, casting: 7.1e-7 s per smarticle and step at rest with three edges, 4.0e-7 with none.
    assert 1.2 < rates(tiers)["relax"] / rates(plain)["relax"] < 2.0


def test_costs_grow_with_what_is_to_be_done() -> None:
    plain = rates(planned())
    for dearer in (planned(count=120), planned(rows=2), planned(stiffness_N_per_m=2000)):
        found = rates(dearer)
        assert all(found[kind] > plain[kind] for kind in KINDS)
    # Softer springs allow longer steps, but what moves has to be looked for all the same: less than in proportion.
    soft = rates(planned(stiffness_N_per_m=125))["shake"] / plain["shake"]
    assert 0.55 < soft < 0.8


def test_a_plan_says_what_a_fidelity_is_on_links() -> None:
    text = planned().to_text()
    assert "fidelity standard: 1 strand, 500 N/m, time step 0." in text
    text = planned(base="reference").to_text()
    assert "fidelity reference: 2 strands, 500 N/m, time step " in text
    assert "of the stable one (by name 2, 1000 N/m)\n" in text
