"""What plans say that the links engine costs, and what a fidelity is there."""

from __future__ import annotations

import pytest

from dem.plan.outlook import Plan, plan
from dem.scene.reading import parse_scene

KINDS = ("deposit", "relax", "shake", "internal-oscillation")


def planned(*, count: int = 80, radius: float = 0.0234, **fidelity: object) -> Plan:
    phases = [
        {"type": "deposit", "per_layer": 10},
        {"type": "relax", "duration_s": 0.4},
        {"type": "shake", "duration_s": 1, "frequency_hz": 30, "peak_acceleration_g": 2},
        {"type": "internal-oscillation", "theta_deg": 10, "duration_s": 1},
    ]
    data = {
        **{"schema_version": 1, "engine": "links", "seed": 1, "count": count, "phases": phases},
        "container": {"radius_m": radius},
        "fidelity": {"stiffness_N_per_m": 500, **fidelity},
        "recording": {"series_interval_s": 0.02, "frame_interval_s": 0.06, "checkpoint_interval_s": None},
    }
    return plan(parse_scene(data, source="test"))


def rates(made: Plan) -> dict[str, float]:
    """Seconds per simulated second by type of phase."""
    return {phase.type: phase.wall_s / phase.estimate_s for phase in made.phases}


@pytest.mark.parametrize(
    ("made", "measured"),
    [
        # results/accuracy-links: 8 or more seeds each.
        (planned(), {"deposit": 0.41, "relax": 0.48, "shake": 0.52, "internal-oscillation": 1.39}),
        (planned(rows=2), {"deposit": 0.85, "relax": 0.86, "shake": 1.26, "internal-oscillation": 2.40}),
        (planned(rows=3), {"deposit": 1.23, "relax": 1.16, "shake": 1.98}),
        (planned(stiffness_N_per_m=4000), {"deposit": 0.69, "relax": 1.05, "shake": 0.76}),
        (planned(stiffness_N_per_m=125), {"deposit": 0.37, "relax": 0.33, "shake": 0.45, "internal-oscillation": 1.15}),
        # One run each.
        (planned(count=270), {"deposit": 1.23, "relax": 1.53, "shake": 2.20, "internal-oscillation": 5.21}),
        (planned(count=1000, radius=0.045), {"relax": 7.8, "shake": 9.7, "internal-oscillation": 19.2}),
    ],
)
def test_costs_are_those_measured(made: Plan, measured: dict[str, float]) -> None:
    found = rates(made)
    for kind, cost in measured.items():
        assert found[kind] == pytest.approx(cost, rel=0.25), kind


def test_costs_grow_with_what_is_to_be_done() -> None:
    plain = rates(planned())
    for dearer in (planned(count=120), planned(rows=2), planned(stiffness_N_per_m=2000)):
        found = rates(dearer)
        assert all(found[kind] > plain[kind] for kind in KINDS)
    # Softer springs allow longer steps, but what moves has to be looked for all the same.
    assert rates(planned(stiffness_N_per_m=125))["shake"] > 0.8 * plain["shake"]


def test_a_plan_says_what_a_fidelity_is_on_links() -> None:
    text = planned().to_text()
    assert "fidelity standard: 1 strand, 500 N/m, time step 0." in text
    text = planned(base="reference").to_text()
    assert "fidelity reference: 2 strands, 500 N/m, time step " in text
    assert "of the stable one (by name 2, 1000 N/m)\n" in text
