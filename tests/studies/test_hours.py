"""Hours of studies: planned ones are those of the sweep, taken ones those of finished runs alone."""

import json
from pathlib import Path

import pandas as pd
import pytest
from synthetic import SyntheticRun, write_run

from dem.errors import InputError
from studies.hours import hours
from templates.sweep.expand import expand
from templates.sweep.folder import create_folder
from templates.sweep.sweep_file import load_sweep

HOURS = Path(__file__).parents[2] / "results" / "hours.csv"
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
    folder, points = tmp_path / "paper", expand(sweep)
    create_folder(
        folder / "two",
        sweep,
        points,
        command="smarticles sweep",
        versions={},
        expected_s=[36.0 if point.scene.engine == "links" else 3600.0 for point in points],
    )
    (folder / "beside").mkdir()
    for name, seconds in (("links_seed1", 18.0), ("yade_seed2", 7200.0)):
        run = write_run(folder / "two" / "runs" / name, SyntheticRun())
        done = json.loads((run / "done.json").read_text())
        (run / "done.json").write_text(json.dumps({**done, "cpu_s": seconds}))
    write_run(folder / "two" / "runs" / "links_seed2", SyntheticRun(status="failed"))
    return folder


def test_hours_are_those_planned_and_those_that_finished_runs_took(studies: Path) -> None:
    table = hours(studies).set_index(["study", "engine"])
    assert list(table.columns) == pd.read_csv(HOURS, nrows=0).columns.tolist()[2:]
    assert table.loc[("two", "links")].tolist() == pytest.approx([2, 0.02, 1, 0.01, 0.005, 0.5])
    assert table.loc[("two", "yade")].tolist() == pytest.approx([2, 2.0, 1, 1.0, 2.0, 2.0])
    assert table.loc[("all", "")].tolist() == pytest.approx([4, 2.02, 2, 1.01, 2.005, 2.005 / 1.01])


def test_a_folder_without_sweeps_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has no folder of a sweep; give"):
        hours(tmp_path)
