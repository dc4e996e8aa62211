"""Effects: each says whether a scene calls for it and why, and a plan is made of what the called ones add."""

from __future__ import annotations

import json
from typing import Any

import pytest
from scenes import small

from dem.engine.effect import Adds
from dem.plan.effects import EFFECTS, decide
from dem.plan.outlook import plan
from dem.record.columns import (
    COLUMNS,
    ENERGY_COLUMNS,
    HOOK_COLUMNS,
    LEDGER_COLUMNS,
    MOTOR_COLUMNS,
    RELEASE_COLUMNS,
    STRAIN_COLUMNS,
)
from dem.scene.scene import Scene

DEPOSIT = {"type": "deposit"}
ACTUATED = [DEPOSIT, {"type": "relax"}, {"type": "shape-change"}, {"type": "internal-oscillation", "theta_deg": 5}]
PLAIN = {"phases": [DEPOSIT, {"type": "relax"}], "recording.checkpoint_interval_s": None}
ALWAYS = {"contact", "container", "gravity", "friction", "restitution", "series", "frames"}

# What of a scene turns an effect on, and what `smarticles plan` says about it then.
CALLS: list[tuple[dict[str, Any], set[str], str]] = [
    (
        {"phases": [DEPOSIT, {"type": "shake"}]},
        {"container motion"},
        "phase 1: Γ = 2, f = 30 Hz, A = 0.552 mm",
    ),
    (
        {"phases": ACTUATED},
        {"articulation", "motors", "torque cap"},
        "phases 2, 3: three links and two hinges per smarticle, pins of 5000 N/m; welded in the others",
    ),
    (
        {"phases": ACTUATED, "motor": {"law": "slip"}},
        {"articulation", "motors", "torque cap"},
        "τ_max = 1.61e-05 N m, law slip",
    ),
    (
        {"phases": ACTUATED},
        {"articulation", "motors", "torque cap"},
        "τ_max = 1.61e-05 N m, law halt, by one look gone beyond by up to 0.22 τ_max",
    ),
    ({"hooks": {}}, {"hooks"}, "crosses at 5 and 10 mm, bars of 0.5 mm; no phase pulls one"),
    ({"phases": [DEPOSIT, {"type": "remove-container"}]}, {"wall removal"}, "phase 1: at once"),
    ({"recording.energy": True}, {"energies"}, "recording.energy is true"),
    (
        {"recording.dissipation_interval_s": 1e-3},
        {"energies", "energy account"},
        "recording.dissipation_interval_s is given, and the account needs them",
    ),
    ({"recording.sphere_interval_s": 0.04}, {"sphere glyphs"}, "all spheres every 0.04 s"),
    (
        {"recording.checkpoint_interval_s": 0.4},
        {"checkpoints"},
        "one every 0.4 s; a killed run goes on from the last one",
    ),
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


@pytest.mark.parametrize(("changes", "called", "why"), CALLS)
def test_each_effect_is_called_for_by_its_own_part_of_the_scene(
    changes: dict[str, Any], called: set[str], why: str
) -> None:
    scene = small(PLAIN | changes)
    assert on(scene) == ALWAYS | called
    planned = plan(scene)
    assert why in [effect.why for effect in planned.effects if effect.name in called]
    plain = Adds.together(effect.adds for effect in plan(small(PLAIN)).effects)
    added = Adds.together(effect.adds for effect in planned.effects)
    assert added != plain  # an effect without any trace would need no declaration
    assert set(plain.engines) <= set(added.engines)
    assert set(planned.engines) == set(added.engines)
    assert why in planned.to_text()
    assert json.loads(json.dumps(planned.to_dict()))["effects"][0]["adds"]["engines"] == list(plain.engines)


def test_every_column_belongs_to_one_effect() -> None:
    declared = [name for effect in EFFECTS for name in effect.adds.series]
    tables = (COLUMNS, MOTOR_COLUMNS, ENERGY_COLUMNS, LEDGER_COLUMNS, HOOK_COLUMNS, RELEASE_COLUMNS, STRAIN_COLUMNS)
    assert sorted(declared) == sorted(name for table in tables for name in table)
    assert len(set(declared)) == len(declared)
    assert len({effect.name for effect in EFFECTS}) == len(EFFECTS)
