"""The recipe that all studies share, by a study that measures next to nothing."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pytest
from synthetic import SyntheticRun, write_manifest

from dem.errors import InputError
from dem.record.manifest import RunManifest
from studies.base.study import Analysis, Study, Tables
from studies.framework.provenance import Reference
from studies.framework.runs import Collected, MeasuredRun

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study toy --out 'my toy'"}


class Toy(Study[str]):
    """Counts smarticles."""

    name = "toy"
    text_name = "toy.md"

    def measure(self, run: RunManifest) -> MeasuredRun:
        if run.name == "odd":
            msg = f"{run.directory}: is odd"
            raise InputError(msg)
        return MeasuredRun(manifest=run, rows=[{"run": run.directory.name, "smarticles [-]": run.count}])

    def refuse(self, found: Collected) -> None:
        found.refuse_mixed_counts()
        found.refuse_repeats("l/w", lambda run: f"{run.manifest.aspect_ratio:g}")

    def tabulate(self, found: Collected) -> Tables:
        return {"runs": found.table()}

    def judge(self, tables: Tables) -> tuple[str, ...]:
        return (f"{tables['runs']['smarticles [-]'].sum()} in all",)

    def judged_tables(self, judged: tuple[str, ...]) -> Tables:
        return {"sums": pd.DataFrame({"sum": judged})}

    def reference_of(self, tables: Tables) -> Reference:
        return Reference(statement="none", facts={"what": "nothing"})

    def statements(self, analysis: Analysis[str]) -> tuple[str, ...]:
        return f"{len(analysis.found.runs)} counted.", "Counts are exact."

    def text(self, analysis: Analysis[str]) -> Sequence[str]:
        return ["# Toys", "", *analysis.judged]

    def about_points(self, analysis: Analysis[str]) -> str:
        return "two toys."

    def draw(self, output: Path, analysis: Analysis[str], footer: Sequence[str]) -> Sequence[Path]:
        # What is drawn last can look at what was written before.
        assert (output / "toy.md").exists()
        (output / "toy.png").write_text("\n".join(footer))
        return [output / "toy.png"]

    def table(self, analysis: Analysis[str]) -> tuple[Sequence[str], Sequence[Sequence[object]]]:
        return ["sum"], [analysis.judged]

    def told(self, analysis: Analysis[str]) -> Sequence[str]:
        return list(analysis.judged)


def write(directory: Path, *, status: str = "done", name: str = "toy", **run: object) -> Path:
    """A run of one phase, without frames."""
    made = SyntheticRun(phases=("relax",), name=name, **run)
    directory.mkdir(parents=True)
    write_manifest(directory, made)
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


def test_what_is_measured_judged_told_and_written(runs: list[Path], tmp_path: Path) -> None:
    report = Toy().analyse(runs, tmp_path / "out", **ORIGIN)
    assert (report.judged, report.told, report.rows) == (("24 in all",), ("24 in all",), [("24 in all",)])
    assert report.tables["runs"]["run"].tolist() == ["good1", "good2"]
    names = {"runs.csv", "sums.csv", "missing.csv", "toy.md", "provenance.json", "toy.png"}
    # Nothing temporary is left.
    assert {path.name for path in (tmp_path / "out").iterdir()} == set(report.files) == names
    assert pd.read_csv(report.files["sums.csv"], comment="#")["sum"].tolist() == ["24 in all"]
    pd.testing.assert_frame_equal(pd.read_csv(report.files["runs.csv"], comment="#"), report.tables["runs"])


def test_every_output_names_its_origin(runs: list[Path], tmp_path: Path) -> None:
    report = Toy().analyse(runs, tmp_path / "out", **ORIGIN)
    assert report.footer == (
        "Study toy, fidelity draft: 2 of 7 runs, 5 missing; 2 counted.",
        "Counts are exact.",
        "Reference: none.",
        "Note: only 2 of 7 runs of what is planned: the full study as shipped",
        "Versions: smarticles 0.1.0; git 0e4b151; yade 2023.02a. Command: smarticles study toy --out 'my toy'",
    )
    for name in ("runs.csv", "sums.csv", "missing.csv", "toy.md"):
        assert all(line in report.files[name].read_text() for line in report.footer)
    # Figures are to be looked at: they say which runs, and where all the rest is.
    assert report.files["toy.png"].read_text().splitlines() == [
        "Study toy, fidelity draft: 2 of 7 runs, 5 missing; two toys.",
        "Planned: the full study as shipped. Commit 0e4b151. More: toy.md, provenance.json.",
    ]
    origin = json.loads(report.files["provenance.json"].read_text())
    assert (origin["study"], origin["command"]) == ("toy", ORIGIN["command"])
    assert origin["note"] == f"only 2 of 7 runs of what is planned: {ORIGIN['note']}"
    assert [run["directory"] for run in origin["runs"]] == list(map(str, runs[:2]))
    assert origin["reference"] == {"what": "nothing"}
    # Of φ only where a table has any.
    assert "definition" not in origin


def test_missing_runs_are_listed_with_their_cause(runs: list[Path], tmp_path: Path) -> None:
    report = Toy().analyse(runs, tmp_path / "out", **ORIGIN)
    table = pd.read_csv(report.files["missing.csv"], comment="#")
    assert table["directory"].tolist() == list(map(str, runs[2:]))
    assert table["status"].tolist() == ["failed", "interrupted", "unfinished", "unusable", "not started"]
    assert table["cause"].tolist()[:4] == [
        "a smarticle escaped",
        "a smarticle escaped",
        "it has not finished",
        f"{runs[5]}: is odd",
    ]
    text = report.files["toy.md"].read_text()
    assert all(f"| 1 | {run.directory} | {run.status} | {run.common_cause} |" in text for run in report.missing)


def test_a_study_that_is_whole_says_so(runs: list[Path], tmp_path: Path) -> None:
    report = Toy().analyse(runs[:2], tmp_path / "out", **ORIGIN)
    assert "Note: the full study as shipped" in report.footer
    assert "The full study as shipped. Commit" in report.files["toy.png"].read_text()


def test_of_a_variant_figures_say_that_it_is_one(runs: list[Path], tmp_path: Path) -> None:
    note = "not the full study: 2 runs instead of 9; l_over_w: only 0.7 of 0.4, 0.7; shake_s: 1.5 instead of 5.0"
    report = Toy().analyse(runs[:2], tmp_path / "out", note=note, command="x")
    assert "Not the full study: 2 runs instead of 9 and more. Commit" in report.files["toy.png"].read_text()
    assert f"Note: {note}" in report.footer


def test_runs_that_are_missing_for_one_cause_are_one_line(runs: list[Path], tmp_path: Path) -> None:
    absent = [tmp_path / f"absent{k}" for k in range(150)]
    report = Toy().analyse([*runs[:2], *absent, runs[2]], tmp_path / "out", **ORIGIN)
    text = report.files["toy.md"].read_text().split("## Missing runs")[1].split("---\n\n")[0]
    rows = [line for line in text.splitlines() if line.startswith("| ")][2:]
    assert len(rows) == 2
    assert rows[0].startswith(
        f"| 150 | {absent[0]}, … | not started | cannot read run directory RUN: no such directory;"
    )
    assert rows[1] == f"| 1 | {runs[2]} | failed | a smarticle escaped |"
    # One by one they are in the table.
    table = pd.read_csv(report.files["missing.csv"], comment="#")
    assert table["directory"].tolist() == [str(path) for path in (*absent, runs[2])]
    assert "`missing.csv`" in text


def test_an_analysis_replaces_an_earlier_one(runs: list[Path], tmp_path: Path) -> None:
    first = Toy().analyse(runs[:1], tmp_path / "out", **ORIGIN)
    assert len(pd.read_csv(first.files["runs.csv"], comment="#")) == 1
    second = Toy().analyse(runs[:2], tmp_path / "out", **ORIGIN)
    assert len(pd.read_csv(second.files["runs.csv"], comment="#")) == 2


def test_without_a_finished_run_there_is_nothing_to_analyse(runs: list[Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"study toy: none of 2 runs is done; the first: .*unfinished: it has not fin"):
        Toy().analyse([runs[4], runs[6]], tmp_path / "out", **ORIGIN)
    with pytest.raises(InputError, match="none of 0 runs is done; finish a run first"):
        Toy().analyse([], tmp_path / "out", **ORIGIN)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"fidelity": "standard"}, r"different fidelity must not be averaged: .*good1 is draft, .*other is standard; "),
        ({"count": 9}, "different count must not be averaged: .* is 12 smarticles at l/w 0.7, .* is 9 smarticles at"),
        ({"seed": 1}, r"l/w = 0\.7 with seed 1 is given twice, .*good1 and .*other; leave one out"),
    ],
)
def test_runs_that_must_not_be_averaged_are_refused(
    runs: list[Path], tmp_path: Path, other: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        Toy().analyse([runs[0], write(tmp_path / "other", **{"seed": 5, **other})], tmp_path / "out", **ORIGIN)
    assert list((tmp_path / "out").iterdir()) == []


def test_what_is_apart_may_differ(runs: list[Path], tmp_path: Path) -> None:
    other = write(tmp_path / "other", count=9, aspect_ratio=0.9)
    assert len(Toy().analyse([runs[0], other], tmp_path / "out", **ORIGIN).tables["runs"]) == 2


def test_an_output_that_is_a_file_is_refused(runs: list[Path], tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(InputError, match="choose another folder as output"):
        Toy().analyse(runs, tmp_path / "out", **ORIGIN)
