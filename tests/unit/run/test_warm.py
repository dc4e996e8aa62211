"""Compiling for a scene: what is called on its engine."""

from types import SimpleNamespace
from typing import Any

import pytest
from double import EngineDouble
from scenes import small

from dem.run import warm


@pytest.mark.parametrize(("removal", "lifted"), [({}, False), ({"speed_m_per_s": 0.1}, True)])
def test_only_a_wall_that_is_lifted_needs_the_code_of_its_edge(
    removal: dict[str, Any], lifted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = small({"phases": [{"type": "deposit"}, {"type": "remove-container", **removal}, {"type": "shake"}]})
    engine = EngineDouble.of(scene, 1e-4)
    monkeypatch.setattr(warm, "engine_kind", lambda _: SimpleNamespace(build=lambda *_: engine))
    monkeypatch.setattr(warm, "time_steps", lambda _: [1e-4])
    monkeypatch.setattr(warm, "_step_and_query", lambda _: None)
    warm.compile_for(scene)
    assert [call for call in engine.calls if call[0] == "lift_wall"] == [("lift_wall", 0.0)] * lifted
