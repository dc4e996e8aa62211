"""Effects: each says whether a scene calls for it and why, and a plan is made of what the called ones add."""

from __future__ import annotations

import json
from typing import Any

import pytest
from scenes import small

from dem.engine.effect import Adds
from dem.plan.effects import ADDS, decide
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
    assert json.loads(json.dumps(planned.to_dict()))["effects"][0]["adds"]["engines"] == list(plain.engines)


def test_every_column_belongs_to_one_effect() -> None:
    declared = [name for adds in ADDS.values() for name in adds.series]
    tables = (COLUMNS, MOTOR_COLUMNS, ENERGY_COLUMNS, LEDGER_COLUMNS, HOOK_COLUMNS, RELEASE_COLUMNS, STRAIN_COLUMNS)
    assert sorted(declared) == sorted(name for table in tables for name in table)
    assert len(set(declared)) == len(declared)
