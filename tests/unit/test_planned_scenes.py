"""Costs that are planned, and runs that were not used for them: the scenes, and the table of ratios."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks import planned
from dem.plan.outlook import plan
from dem.scene.reading import parse_scene


def test_there_are_ten_valid_scenes_and_two_more_on_all_engines_and_each_costs_minutes_at_most() -> None:
    scenes = [parse_scene(data, source="benchmarks") for data in planned.SCENES]
    assert len(scenes) == 12
    assert {scene.engine for scene in scenes} == {"links", "yade", "lammps"}
    assert len({(scene.count, scene.smarticle.aspect_ratio) for scene in scenes}) == 12
    assert max(plan(scene).wall_s for scene in scenes) < 300


def test_phases_are_compared_by_the_second_that_they_took(tmp_path: Path) -> None:
    data: dict[str, Any] = planned.SCENES[0]
    made = plan(parse_scene(data, source="x"))
    # A pour of twice the time that was guessed, and every second half as dear as planned.
    lengths = [2 * made.phases[0].estimate_s, *(phase.estimate_s for phase in made.phases[1:])]
    took = [
        {"start_s": 0.0, "end_s": length, "cpu_s": 0.5 * phase.wall_s / phase.estimate_s * length}
        for phase, length in zip(made.phases, lengths, strict=True)
    ]
    (tmp_path / "01").mkdir()
    (tmp_path / "01" / "done.json").write_text(json.dumps({"phases": took}))
    rows = planned.rows_of(tmp_path, 1, data)
    assert [row["phase"] for row in rows] == ["deposit", "relax", "shake", planned.WHOLE]
    assert [row[planned.RATIO] for row in rows] == pytest.approx([2.0] * 4)
    assert rows[0][planned.AHEAD] == pytest.approx(1.0)
    assert rows[3][planned.AHEAD] == pytest.approx(made.wall_s / sum(one["cpu_s"] for one in took))
