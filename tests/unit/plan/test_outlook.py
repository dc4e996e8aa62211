"""A plan: which effects a scene calls for, warnings, costs on the links engine."""

import json
from dataclasses import asdict, replace
from typing import Any

import pytest
from scenes import small

from dem.engine.demand import Activity
from dem.engine.effect import Adds, EffectName
from dem.engine.kinds import engine_kind
from dem.plan.effects import ADDS, decide
from dem.plan.outlook import Plan, plan, warnings_of
from dem.record.columns import (
    COLUMNS,
    ENERGY_COLUMNS,
    FILAMENT_COLUMNS,
    GRIP_COLUMNS,
    HOOK_COLUMNS,
    JOINT_COLUMNS,
    LEDGER_COLUMNS,
    MOTOR_COLUMNS,
    PLATE_COLUMNS,
    RELEASE_COLUMNS,
    STRAIN_COLUMNS,
)
from dem.scene.reading import parse_scene
from dem.scene.scene import Scene

DEPOSIT = {"type": "deposit"}
ACTUATED = [DEPOSIT, {"type": "relax"}, {"type": "shape-change"}, {"type": "internal-oscillation", "theta_deg": 5}]
PLAIN = {"phases": [DEPOSIT, {"type": "relax"}], "recording.checkpoint_interval_s": None}
ALWAYS = {"contact", "container", "gravity", "friction", "restitution", "series", "frames"}

ACTUATION = {"articulation", "motors", "torque cap"}
CALLS: list[tuple[dict[str, Any], set[str]]] = [
    ({"phases": [DEPOSIT, {"type": "shake"}]}, {"container motion"}),
    ({"phases": ACTUATED}, ACTUATION),
    ({"phases": ACTUATED, "motor": {"law": "slip"}}, ACTUATION),
    ({"hooks": {}}, {"hooks"}),
    ({"phases": [DEPOSIT, {"type": "remove-container"}]}, {"wall removal"}),
    ({"recording.energy": True}, {"energies"}),
    ({"recording.dissipation_interval_s": 1e-3}, {"energies", "energy account"}),
    ({"recording.sphere_interval_s": 0.04}, {"sphere glyphs"}),
    ({"recording.checkpoint_interval_s": 0.4}, {"checkpoints"}),
]


def on(scene: Scene) -> set[str]:
    return {decision.name for decision in decide(scene) if decision.on}


def test_a_plain_scene_calls_for_the_plain_effects() -> None:
    scene = small(PLAIN)
    assert on(scene) == ALWAYS
    assert plan(scene).engines == ("ForceResetter", "InsertionSortCollider", "InteractionLoop", "NewtonIntegrator")
    for decision in decide(scene):
        assert decision.why
        assert decision.on or decision.adds == Adds()


@pytest.mark.parametrize(("changes", "called"), CALLS)
def test_each_effect_is_called_for_by_its_own_part_of_the_scene(changes: dict[str, Any], called: set[str]) -> None:
    scene = small(PLAIN | changes)
    assert on(scene) == ALWAYS | called
    planned = plan(scene)
    plain = Adds.together(effect.adds for effect in plan(small(PLAIN)).effects)
    added = Adds.together(effect.adds for effect in planned.effects)
    assert added != plain  # an effect without any trace would need no declaration
    assert set(plain.engines) <= set(added.engines)
    assert set(planned.engines) == set(added.engines)
    assert json.loads(json.dumps(asdict(planned)))["effects"][0]["adds"]["engines"] == list(plain.engines)


def test_the_total_counts_the_start_of_a_run() -> None:
    planned = replace(plan(small(PLAIN)), wall_s=0.0, compile_s=0.0)
    lines = [line.split() for line in planned.to_text().splitlines()]
    assert ["starting", "2.5", "s"] in lines
    assert next(line for line in lines if line[:1] == ["total"])[-2:] == ["2.5", "s"]


def test_a_reason_about_barbs_is_about_bodies_that_have_some() -> None:
    rods = small({"engine": "links", "particle": {"shape": "rod", "length_m": 0.01, "diameter_m": 0.001}})
    reasons = [next(d.why for d in decide(scene) if d.name == EffectName.ARTICULATION) for scene in (small({}), rods)]
    assert "each smarticle is one rigid body" in reasons[0]
    assert "smarticle is" not in reasons[1]


def test_knobs_are_compared_with_those_of_the_name_in_this_scene() -> None:
    narrow = {"engine": "links", "fidelity": "standard", "smarticle": {"thickness_normal_m": 5e-4}}
    assert "fidelity standard: 1 strand, 1000 N/m, time step 0.92 of the stable one\n" in plan(small(narrow)).to_text()
    two = plan(small({"engine": "links", "fidelity": {"base": "standard", "rows": 2, "diameter_m": 5e-4}})).to_text()
    line = next(line for line in two.splitlines() if line.startswith("fidelity standard: 2 strands, 1000 N/m, "))
    assert line.endswith(" of the stable one (by name 1, 1000 N/m)")
    wide = plan(small({"engine": "links", "fidelity": "standard", "smarticle": {"thickness_normal_m": 3e-3}}))
    assert "fidelity standard: 5 strands, since fewer leave holes, 1000 N/m, " in wide.to_text()


def test_every_column_belongs_to_one_effect() -> None:
    declared = [name for adds in ADDS.values() for name in adds.series]
    tables = (COLUMNS, MOTOR_COLUMNS, ENERGY_COLUMNS, LEDGER_COLUMNS, HOOK_COLUMNS, RELEASE_COLUMNS, STRAIN_COLUMNS)
    tables += (FILAMENT_COLUMNS, JOINT_COLUMNS, PLATE_COLUMNS, GRIP_COLUMNS)
    assert sorted(declared) == sorted(name for table in tables for name in table)
    assert len(set(declared)) == len(declared)


@pytest.mark.parametrize(
    ("key", "left_out"),
    [("frame_interval_s", "each phase has one frame, at its end"), ("sphere_interval_s", "no spheres are written")],
)
def test_an_interval_longer_than_the_run_gives_a_warning(key: str, left_out: str) -> None:
    assert warnings_of(small({f"recording.{key}": 0.88})) == ()
    scene = small({f"recording.{key}": 10.0})
    (warning,) = plan(scene).warnings
    assert warning.startswith(f"recording.{key}: 10 s is longer than the whole run, about 0.9 s, so that {left_out}; ")
    assert f"warning: {warning}" in plan(scene).to_text().splitlines()
    assert json.loads(json.dumps(asdict(plan(scene))))["warnings"] == [warning]


def test_knobs_that_do_nothing_on_links_give_a_warning_where_they_are_set() -> None:
    assert warnings_of(small({"engine": "links"})) == ()
    knobs = {"base": "draft", "pitch": 0.5, "wall_facets": 128}
    assert warnings_of(small({"fidelity": knobs})) == ()
    (warning,) = warnings_of(small({"engine": "links", "fidelity": knobs}))
    assert warning == (
        "fidelity: pitch (0.5), wall_facets (128) have no meaning on the engine links; leave out what does nothing"
    )


def rates(made: Plan) -> dict[str, float]:
    """Seconds per simulated second by type of phase."""
    return {phase.type: phase.wall_s / phase.estimate_s for phase in made.phases}


def bench(activity: dict[str, object], fidelity: str = "standard", count: int = 270) -> Plan:
    """A scene of `benchmarks.engines`, in a container as wide as keeps the pile's height."""
    radius = 0.0234 * (count / 270) ** 0.5
    phases = [{"type": "deposit", "per_layer": max(4, count // 27)}, {"duration_s": 2.0, **activity}]
    data = {"schema_version": 1, "engine": "links", "seed": 1, "count": count, "container": {"radius_m": radius}}
    data |= {"fidelity": fidelity, "recording": {"series_interval_s": 0.02, "frame_interval_s": 0.1}}
    return plan(parse_scene({**data, "phases": phases}, source="test"))


@pytest.mark.parametrize(
    ("made", "kind", "measured"),
    [
        # results/accuracy-links/cost.csv.
        (bench({"type": "shake"}, "draft"), "shake", 1.10),
        (bench({"type": "shake"}), "shake", 2.30),
        (bench({"type": "shake"}, "reference"), "shake", 4.43),
        (bench({"type": "internal-oscillation", "theta_deg": 10.0}, "draft"), "internal-oscillation", 3.2),
        (bench({"type": "internal-oscillation", "theta_deg": 10.0}), "internal-oscillation", 5.9),
        (bench({"type": "internal-oscillation", "theta_deg": 10.0}, "reference"), "internal-oscillation", 11.0),
        (bench({"type": "relax"}), "relax", 1.9),
    ],
)
def test_costs_are_those_measured(made: Plan, kind: str, measured: float) -> None:
    assert rates(made)[kind] == pytest.approx(measured, rel=0.25)


@pytest.mark.parametrize(("sections", "least", "most"), [("r", 1.0, 1.0), ("f", 1.05, 2.0), ("rf", 1.02, 1.5)])
def test_strands_are_those_of_each_body(sections: str, least: float, most: float) -> None:
    """Bars with a round section have one strand, whatever the fidelity says."""
    rods = {"f": {"shape": "rod", "length_m": 0.01}}
    rods["r"] = {**rods["f"], "diameter_m": 0.001}
    one, two = (
        small(
            {
                "engine": "links",
                "particle": [rods[key] for key in sections],
                "fidelity": {"base": "draft", "rows": rows},
            }
        )
        for rows in (1, 2)
    )
    assert "bodies (rod) of smooth links of 1 strand," in plan(one).to_text()
    strands = "1 strand," if sections == "r" else "2 strands,"
    assert f"bodies (rod) of smooth links of {strands}" in plan(two).to_text()
    assert "fidelity draft: 2 strands" in plan(two).to_text()
    cost = [engine_kind("links").seconds_per_second(scene, 1e-5, Activity.SHAKE) for scene in (one, two)]
    assert least <= cost[1] / cost[0] <= most


def test_a_plan_says_what_frames_and_measures_take() -> None:
    """Sizes as written, and peak memory as measured, of 40 to 600 bodies."""
    one = plan(small({"count": 40}))
    assert 10_000 < one.measuring.frame_bytes < 20_000  # 12.8 kB of 40 smarticles
    assert f"frames: about {one.frames} of " in one.to_text()
    # Pour, rest and shake of some 0.9 s at 40 ms, and one frame at the end of each.
    assert one.frames == 3 + round(sum(phase.estimate_s for phase in one.phases) / 0.04)
    for count, most in ((150, 246), (300, 317), (600, 440)):
        assert most < plan(small({"count": count})).measuring.memory_bytes / 2**20 < 1.2 * most
    rods = {"engine": "links", "count": 400, "particle": {"shape": "rod", "length_m": 0.012, "diameter_m": 1e-3}}
    planned = plan(small(rods))
    assert 150 < planned.measuring.memory_bytes / 2**20 < 190
    assert 40_000 < planned.measuring.frame_bytes < 60_000  # 55.5 kB
    assert "smarticles measure: about 166 MiB of memory in each process, 0.2 s of processor time" in planned.to_text()
