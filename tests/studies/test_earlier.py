"""Runs of which only the tables of an earlier analysis are left."""

import shutil
from pathlib import Path

import pytest
from synthetic import write_run

from dem.errors import InputError
from dem.scene.reading import dump_scene
from studies.framework.runs import MeasuredRun, Wanted, collect_runs, earlier_runs
from studies.registry import shipped
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import load_sweep

RESULTS = Path(__file__).resolve().parents[2] / "results" / "procedures"
NAME = "shape-change_lw0.70_links_seed3"


@pytest.fixture(scope="module")
def points() -> dict[str, Point]:
    return {point.name: point for point in expand(load_sweep(shipped("procedures").sweep_file()))}


@pytest.fixture(scope="module")
def wanted(points: dict[str, Point], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Wanted]:
    folder = tmp_path_factory.mktemp("scenes")
    made = {}
    for name in (NAME, "internal10_lw0.40_links_seed1"):
        scene = folder / f"{name}.yaml"
        scene.write_text(dump_scene(points[name].scene), encoding="utf-8")
        made[name] = Wanted(scene=scene, scene_sha256=points[name].scene_sha256)
    return made


def test_a_run_is_what_the_table_and_the_provenance_say(wanted: dict[str, Wanted]) -> None:
    found = earlier_runs(RESULTS, wanted)
    assert set(found) == set(wanted)
    run = found[NAME]
    line = next(line for line in (RESULTS / "runs.csv").read_text().splitlines() if line.endswith(f",{NAME}"))
    assert str(run.row["crossings [-]"]) in line.split(",")
    assert run.row["seed"] == run.run.manifest.seed == 3
    assert (run.run.manifest.count, run.run.manifest.aspect_ratio, run.run.manifest.engine) == (270, 0.7, "links")
    assert run.run.manifest.command.startswith("smarticles run procedures/scenes/shape-change_lw0.70")
    assert run.run.manifest.versions["git"] in (RESULTS / "provenance.json").read_text()


def test_the_tables_are_reproduced(wanted: dict[str, Wanted], tmp_path: Path, undrawn: None) -> None:
    report = (
        shipped("procedures")
        .load()
        .analyse(
            [tmp_path / name for name in wanted],
            tmp_path / "results",
            note="two",
            command="test",
            earlier=earlier_runs(RESULTS, wanted),
        )
    )
    assert not report.missing
    assert sorted(report.tables["runs"]["run"]) == sorted(wanted)
    again = earlier_runs(tmp_path / "results", wanted)
    before = earlier_runs(RESULTS, wanted)
    for name in wanted:
        cells = {column: value for column, value in before[name].row.items() if column in again[name].row}
        assert len(cells) > 15
        assert again[name].row == pytest.approx(cells, nan_ok=True)


def test_another_scene_of_the_same_name_does_not_count(wanted: dict[str, Wanted]) -> None:
    other = Wanted(scene=wanted[NAME].scene, scene_sha256="0" * 64)
    found = earlier_runs(RESULTS, {**wanted, NAME: other})
    assert NAME not in found
    with pytest.raises(InputError, match=r"none of its \d+ runs is of a scene of this study as it is"):
        earlier_runs(RESULTS, {NAME: other})


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    folder = tmp_path / "copy"
    folder.mkdir()
    for name in ("runs.csv", "provenance.json"):
        shutil.copy(RESULTS / name, folder)
    return folder


@pytest.mark.parametrize(
    ("file", "text", "cause"),
    [
        ("runs.csv", None, "cannot read .*runs.csv: No such file"),
        ("runs.csv", "", "cannot read .*runs.csv: No columns to parse"),
        ("runs.csv", "seed,run\n1,a\n", "cannot read .*runs.csv: column 'scene_sha256' is missing"),
        ("provenance.json", "{", "cannot read .*provenance.json: it is no provenance"),
    ],
)
def test_damaged_tables_are_reported(
    copy: Path, wanted: dict[str, Wanted], file: str, text: str | None, cause: str
) -> None:
    if text is None:
        (copy / file).unlink()
    else:
        (copy / file).write_text(text)
    with pytest.raises(InputError, match=cause):
        earlier_runs(copy, wanted)


def test_a_directory_that_is_there_goes_before_the_tables(wanted: dict[str, Wanted], tmp_path: Path) -> None:
    earlier = earlier_runs(RESULTS, wanted)
    there, gone = tmp_path / NAME, tmp_path / "internal10_lw0.40_links_seed1"
    write_run(there)
    found = collect_runs("test", [there, gone], lambda run: MeasuredRun(run=run, rows=[{"new": 1}]), earlier=earlier)
    assert [run.row.get("new") for run in found.runs] == [1, None]
