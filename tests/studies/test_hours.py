"""Hours of studies: planned ones are those of the sweep, taken ones those of finished runs alone."""

import json
from pathlib import Path

import pytest
from synthetic import SyntheticRun, write_run

from studies.hours import ALL, DONE, ENGINE, EXPECTED, OVER, PLANNED, RUNS, STUDY, TAKEN, hours
from templates.sweep.expand import expand
from templates.sweep.folder import create_folder
from templates.sweep.sweep_file import load_sweep

SWEEP = """\
schema_version: 1
name: two
template: scene.yaml.j2
run_name: "{{ engine }}_seed{{ seed }}"
points: {grid: {engine: [links, yade]}}
repeats: {seeds: [1, 2]}
"""
SCENE = """\
schema_version: 1
name: hours
engine: {{ engine }}
seed: {{ seed }}
count: 5
phases: [{type: deposit}]
"""


@pytest.fixture
def studies(tmp_path: Path) -> Path:
    """A study of two runs on each engine, one of each done; a folder that is no study beside it."""
    (tmp_path / "two.yaml").write_text(SWEEP)
    (tmp_path / "scene.yaml.j2").write_text(SCENE)
    sweep = load_sweep(tmp_path / "two.yaml")
    folder = tmp_path / "paper"
    create_folder(
        folder / "two",
        sweep,
        expand(sweep),
        command="smarticles sweep",
        versions={},
        expected_s=lambda scene: 36.0 if scene.engine == "links" else 3600.0,
    )
    (folder / "beside").mkdir()
    for name, seconds in (("links_seed1", 18.0), ("yade_seed2", 7200.0)):
        run = write_run(folder / "two" / "runs" / name, SyntheticRun())
        done = json.loads((run / "done.json").read_text())
        (run / "done.json").write_text(json.dumps({**done, "cpu_s": seconds}))
    write_run(folder / "two" / "runs" / "links_seed2", SyntheticRun(status="failed"))
    return folder


def test_hours_are_those_planned_and_those_that_finished_runs_took(studies: Path) -> None:
    table = hours(studies).set_index([STUDY, ENGINE])
    links, yade, every = table.loc[("two", "links")], table.loc[("two", "yade")], table.loc[(ALL, "")]
    assert (links[RUNS], links[DONE], yade[RUNS], yade[DONE]) == (2, 1, 2, 1)
    assert (links[PLANNED], links[EXPECTED], links[TAKEN]) == pytest.approx((0.02, 0.01, 0.005))
    assert (yade[PLANNED], yade[EXPECTED], yade[TAKEN]) == pytest.approx((2.0, 1.0, 2.0))
    assert (links[OVER], yade[OVER]) == pytest.approx((0.5, 2.0))
    assert (every[RUNS], every[DONE], every[TAKEN]) == pytest.approx((4, 2, 2.005))
