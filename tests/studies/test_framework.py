"""The recipe that all studies share, by a study that measures next to nothing."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from synthetic import SyntheticRun, write_manifest

import studies
from dem.errors import InputError
from dem.record.run import Run
from postprocess.statistics.points import ASPECT, SEED
from studies.framework.figures import Means, one_by_one
from studies.framework.findings import mean
from studies.framework.provenance import NOTHING
from studies.framework.runs import Key, Quantity, Row
from studies.framework.study import COUNT, Study

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study toy --out 'my toy'"}
LEVEL = Quantity(column="level [m]", label="level [mm]", form=".1f", scale=1e3, meaning="a level")


def measure(run: Run) -> Row:
    if run.manifest.name == "odd":
        msg = f"{run.path}: is odd"
        raise InputError(msg)
    return {
        ASPECT: round(run.manifest.aspect_ratio, 6),
        SEED: run.manifest.seed,
        "smarticles [-]": run.manifest.count,
        "level [m]": 1e-3 * run.manifest.seed,
        "scene_sha256": run.manifest.scene_sha256,
        "run": run.path.name,
    }


TOY = Study(
    name="toy",
    title="Toys",
    measure=measure,
    keys=(Key(column=ASPECT, label="l/w", form="g"),),
    quantities=(LEVEL,),
    findings=(mean("high", "levels are high", lambda runs: runs["level [m]"], "level", threshold=1e-4),),
    figures=(
        Means(name="toy", quantities=[LEVEL], x=ASPECT, x_label="l/w", split=one_by_one(ASPECT, lambda x: f"{x:g}")),
    ),
    order=(ASPECT, SEED),
    reference=NOTHING,
)


def write(directory: Path, *, status: str = "done", name: str = "toy", rows: int = 1, **run: Any) -> Path:
    """A run of one phase, without frames, with `rows` of spheres per link."""
    made = SyntheticRun(phases=("relax",), name=name, **run)
    directory.mkdir(parents=True)
    write_manifest(directory, made)
    scene = {"phases": [{"type": "relax", "duration_s": 0.5}], "fidelity": {"base": made.fidelity, "rows": rows}}
    (directory / "scene.yaml").write_text(json.dumps(scene))
    timed = [{"index": 0, "type": "relax", "start_s": 0.0, "end_s": 0.5, "wall_s": 1.0}]
    done = {"status": "done", "time_s": 0.5, "steps": 10, "wall_s": 1.0, "phases": timed}
    failed = {"status": status, "cause": "a smarticle escaped", "time_s": 0.2}
    if status != "unfinished":
        (directory / f"{'done' if status == 'done' else 'failed'}.json").write_text(
            json.dumps(done if status == "done" else failed)
        )
    return directory


@pytest.fixture
def runs(tmp_path: Path) -> list[Path]:
    """Two that are finished, and one of each kind that is not."""
    made = [write(tmp_path / f"good{seed}", seed=seed) for seed in (1, 2)]
    made += [write(tmp_path / status, seed=3, status=status) for status in ("failed", "interrupted", "unfinished")]
    return [*made, write(tmp_path / "odd", name="odd", seed=4), tmp_path / "absent"]


def test_what_is_measured_judged_and_written(runs: list[Path], tmp_path: Path) -> None:
    report = TOY.analyse(runs, tmp_path / "out", **ORIGIN)
    assert report.rows == [["0.7", "2", "1.5 ± 0.5"]]
    assert [(one.verdict, one.ours) for one in report.judged] == [("not resolved", "level +0.0015 ± 0.0005 (n = 2)")]
    names = {"runs.csv", "points.csv", "findings.csv", "missing.csv", "findings.md", "provenance.json"}
    # Nothing temporary is left.
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == set(report.files) == names | {"toy.pdf", "toy.png", "toy.svg"}
    pd.testing.assert_frame_equal(pd.read_csv(report.files["runs.csv"], comment="#"), report.tables["runs"])
    # An analysis replaces an earlier one.
    assert len(TOY.analyse(runs[:1], tmp_path / "out", **ORIGIN).tables["runs"]) == 1
    assert len(pd.read_csv(report.files["runs.csv"], comment="#")) == 1


def test_every_output_names_its_origin(runs: list[Path], tmp_path: Path) -> None:
    report = TOY.analyse(runs, tmp_path / "out", **ORIGIN)
    first, *_ = report.footer
    assert first.startswith(
        "Study toy, fidelity draft: 2 of 7 runs, 5 missing; l/w 0.7, 12 smarticles, seeds 1 2 (2 per"
    )
    assert report.footer[-2:] == [
        "Note: only 2 of 7 runs of what is planned: the full study as shipped",
        "Versions: smarticles 0.1.0; git 0e4b151; yade 2023.02a. Command: smarticles study toy --out 'my toy'",
    ]
    for name in ("runs.csv", "points.csv", "missing.csv", "findings.md"):
        assert all(line in report.files[name].read_text() for line in report.footer)
    origin = json.loads(report.files["provenance.json"].read_text())
    assert (origin["study"], origin["command"]) == ("toy", ORIGIN["command"])
    assert [run["directory"] for run in origin["runs"]] == list(map(str, runs[:2]))
    assert "Note: the full study as shipped" in TOY.analyse(runs[:2], tmp_path / "out", **ORIGIN).footer


def test_a_run_that_another_version_resumed_is_not_only_of_the_first(tmp_path: Path) -> None:
    runs = [write(tmp_path / f"good{seed}", seed=seed) for seed in (1, 2)]
    made = json.loads((runs[0] / "run.json").read_text())
    later = {"started": "later", "time_s": 0.2, "machine": "node7", "command": "smarticles resume good1", "threads": 1}
    resumed = [{**later, "versions": {**made["versions"], "smarticles": "0.2.0"}}]
    (runs[0] / "run.json").write_text(json.dumps({**made, "machine": "node1", "resumed": resumed}))
    report = TOY.analyse(runs, tmp_path / "out", **ORIGIN)
    versions = "Versions: smarticles 0.1.0, 0.1.0 (resumed by 0.2.0); git 0e4b151; yade 2023.02a. "
    assert report.footer[-1].startswith(versions)
    first, second = json.loads(report.files["provenance.json"].read_text())["runs"]
    assert (first["machine"], first["resumed"]) == ("node1", resumed)
    assert not {"machine", "resumed"} & second.keys()


def test_footers_say_where_a_fidelity_is_not_the_named_one(tmp_path: Path) -> None:
    runs = [write(tmp_path / f"{rows}", seed=rows, rows=rows) for rows in (1, 2)]
    first, *_ = TOY.analyse(runs, tmp_path / "out", **ORIGIN).footer
    assert first.startswith("Study toy, fidelity draft, draft (rows 2): 2 of 2 runs")


def test_missing_runs_are_listed_with_their_cause(runs: list[Path], tmp_path: Path) -> None:
    absent = [tmp_path / f"absent{k}" for k in range(150)]
    report = TOY.analyse([*runs, *absent], tmp_path / "out", **ORIGIN)
    table = pd.read_csv(report.files["missing.csv"], comment="#")
    assert table["directory"].tolist() == list(map(str, [*runs[2:], *absent]))
    assert table["status"].tolist()[:5] == ["failed", "interrupted", "stopped", "unusable", "not started"]
    causes = ["a smarticle escaped", "a smarticle escaped", "it has not finished", f"{runs[5]}: is odd"]
    assert table["cause"].tolist()[:4] == causes
    # Those that are missing for one cause are one line of the text.
    text = report.files["findings.md"].read_text()
    assert f"| 151 | {runs[6]}, … | not started | cannot read run directory RUN: no such directory;" in text


def test_without_a_finished_run_there_is_nothing_to_analyse(runs: list[Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"study toy: none of 2 runs is done; the first: .*unfinished: it has not fin"):
        TOY.analyse([runs[4], runs[6]], tmp_path / "out", **ORIGIN)
    with pytest.raises(InputError, match="none of 0 runs is done; finish a run first"):
        TOY.analyse([], tmp_path / "out", **ORIGIN)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"fidelity": "standard"}, r"different fidelity must not be averaged: .*good1 is draft, .*other is standard; "),
        ({"count": 9}, "different count must not be averaged: .* is 12 smarticles, .* is 9 smarticles; analyse them"),
        ({"seed": 1}, r"point = l/w 0\.7 with seed 1 is given twice, .*good1 and .*other; leave one out"),
    ],
)
def test_runs_that_must_not_be_averaged_are_rejected(
    runs: list[Path], tmp_path: Path, other: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        TOY.analyse([runs[0], write(tmp_path / "other", **{"seed": 5, **other})], tmp_path / "out", **ORIGIN)
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize(
    "figure",
    [
        Means(name="odd", quantities=[LEVEL], x=ASPECT, x_label="l/w", split=one_by_one("colour", str)),
        Means(name="odd", quantities=[LEVEL], x=ASPECT, x_label="l/w", split=lambda _: [], panels="colour"),
    ],
)
def test_a_figure_split_by_a_column_that_is_no_key_is_rejected_when_the_study_is_made(figure: Means) -> None:
    message = r"study toy: figure odd is split by the column 'colour', which is no key; keys: aspect ratio \[-\]; split"
    with pytest.raises(InputError, match=message):
        replace(TOY, figures=[figure])


def test_the_study_of_the_readme_makes_its_points_and_findings() -> None:
    readme = (Path(studies.__file__).parent / "README.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec(readme.split("```python\n")[1].split("```")[0], names)
    cells = [(count, seed) for count in (12, 24) for seed in (1, 2, 3)]
    runs = pd.DataFrame(
        [{ASPECT: 0.7, COUNT: count, SEED: seed, names["HEIGHT"]: 1e-4 * (count + seed)} for count, seed in cells]
    )
    tables = names["STUDY"].tabulate(runs)
    assert names["STUDY"].table(tables)[1] == [["0.7", "12", "3", "1.4 ± 0.1"], ["0.7", "24", "3", "2.6 ± 0.1"]]
    assert [one.verdict for one in names["STUDY"].judge(tables)] == ["found"]
