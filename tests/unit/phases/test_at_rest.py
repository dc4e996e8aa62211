"""Phases in which nothing drives the pile: a kind of one's own counts as at rest in all that is measured."""

import json
from pathlib import Path
from typing import Any, Literal

import pytest
from double import KindDouble
from scenes import SMALL, changed

from dem.phases.phase import Phase
from dem.phases.relax import Relax
from dem.record.run import Run
from dem.run.run import run_scene
from dem.scene.reading import parse_scene
from studies.framework.procedures import activity


class Calm(Relax):
    """A phase that no part of the program knows by its name."""

    type: Literal["calm"]  # type: ignore[assignment]


def run_with(own: Phase, out: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Deposit, the phase of one's own, shake, and it again; on the engine in memory."""
    kind = KindDouble()
    monkeypatch.setattr("dem.engine.yade.kind.YadeKind", lambda: kind)
    data = changed(SMALL, {"recording": {"series_interval_s": 0.004, "frame_interval_s": 0.02}})
    scene = parse_scene(data, source="test")
    pour, _, shake = scene.phases
    run_scene(scene.model_copy(update={"phases": (pour, own, shake, own)}), out, command="test")
    return Run(out)


# The schema of a scene lists the kinds that there are.
@pytest.mark.filterwarnings("ignore:Pydantic serializer warnings")
def test_phi_is_taken_around_the_activity(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_with(Calm(type="calm", duration_s=0.1), tmp_path / "run", monkeypatch)
    assert activity(run).index == 2
    for name in ("run.json", "done.json"):
        phases = json.loads((run.path / name).read_text())["phases"]
        assert [phase["at_rest"] for phase in phases] == [True, True, False, True], name


def test_old_manifests_say_it_by_the_type(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_with(Relax(type="relax", duration_s=0.1), tmp_path / "run", monkeypatch)
    for name in ("run.json", "done.json"):
        file = run.path / name
        document: dict[str, Any] = json.loads(file.read_text())
        for phase in document["phases"]:
            del phase["at_rest"]
        file.write_text(json.dumps(document))
    assert [phase.at_rest for phase in Run(run.path).phases] == [True, True, False, True]
