"""What plans say that LAMMPS costs, against what was measured; and that each engine is asked for its own."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks.lammps import scene_data
from dem.plan.outlook import plan
from dem.scene.reading import parse_scene
from smarticles.sweeps import expected_wall_s


def rates(data: dict[str, Any]) -> dict[str, float]:
    """Seconds per simulated second by type of phase."""
    return {phase.type: phase.wall_s / phase.estimate_s for phase in plan(parse_scene(data, source="x")).phases}


PHASES = ({"type": "deposit"}, {"type": "relax", "duration_s": 0.2}, {"type": "shake", "duration_s": 0.6})


@pytest.mark.parametrize(
    ("data", "kind", "measured"),
    [
        # results/lammps, agree: six seeds.
        (scene_data("lammps", 1, 60, "draft", *PHASES), "relax", 1.9),
        (scene_data("lammps", 1, 60, "draft", *PHASES), "shake", 4.6),
    ],
)
def test_costs_are_those_measured(data: dict[str, Any], kind: str, measured: float) -> None:
    assert rates(data)[kind] == pytest.approx(measured, rel=0.3)


def test_large_piles_cost_more_each() -> None:
    # results/lammps, ranks.csv: 10.35 us per step and smarticle at 5000, standard; results/scaling: 4.1 at 300.
    each = {}
    for count in (300, 5000):
        data = {
            **scene_data("lammps", 1, count, "standard", *PHASES),
            "recording": {"series_interval_s": 0.2, "frame_interval_s": 0.2, "checkpoint_interval_s": None},
        }
        data["container"] = {"radius_m": 0.0234 * (count / 270) ** 0.5}
        made = plan(parse_scene(data, source="x"))
        each[count] = 1e6 * made.phases[2].wall_s / 0.6 * made.time_step_s / count
    assert each[300] == pytest.approx(4.13, rel=0.25)
    assert each[5000] == pytest.approx(10.35, rel=0.25)


def test_each_engine_is_asked_for_its_own_costs_by_plan_and_by_requests_of_a_cluster() -> None:
    data = scene_data("lammps", 1, 60, "draft", *PHASES)
    scenes = [parse_scene({**data, "engine": name}, source="x") for name in ("links", "yade", "lammps")]
    expected = [expected_wall_s(scene) for scene in scenes]
    assert expected == [plan(scene).wall_s for scene in scenes]
    assert expected[0] < expected[1] / 3 < expected[2]
