"""The scenes that `smarticles init` writes run, in small, and do what they say."""

from pathlib import Path

import pytest

import smarticles
from smarticles.starters import KINDS, starter

FEW = {"hook": 30, "chain": 2}
"""How many smarticles make each scene still meaningful; 8 of the others."""

SHORT = {
    "actuated": ["phases.2.duration_s=0.2"],
    "shaken": ["phases.2.duration_s=0.2"],
    "hook": ["phases.2.speed_m_per_s=0.1"],
    "melting": ["phases.1.duration_s=0.2", "phases.3.duration_s=0.2"],
    "casting": ["phases.1.opening_s=0.3", "phases.1.closing_s=0.3", "phases.3.duration_s=0.2"],
    "collapse": ["phases.1.duration_s=0.2", "phases.4.duration_s=0.2"],
    "chain": ["phases.1.speed_m_per_s=0.2"],
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_starter_runs(kind: str, tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(starter(kind), encoding="utf-8")
    scene = smarticles.load_scene(file, [f"count={FEW.get(kind, 8)}", *SHORT.get(kind, [])])
    done = smarticles.run(scene, tmp_path / "run")
    assert done.status.state == "done"
    assert done.frames[-1].count == scene.count
    assert [phase.type for phase in done.phases] == [phase.kind for phase in scene.phases]
    assert "WARNING" not in (done.path / "log.txt").read_text(encoding="utf-8")
