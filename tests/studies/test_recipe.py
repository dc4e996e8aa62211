"""Every study against its published tables: points, verdicts and numbers follow from the stored table of runs."""

import io
import re
from functools import cache, partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sweeps import of_one_seed

from postprocess.report import figures
from studies.framework.figures import Analysis
from studies.framework.runs import read_runs
from studies.framework.study import Study
from studies.registry import STUDIES, Script
from templates.sweep.expand import expand
from templates.sweep.sweep_file import load_sweep

RESULTS = Path(__file__).resolve().parents[2] / "results"
SCRIPTS = [name for name, study in STUDIES.items() if isinstance(study, Script)]
ON_YADE = ["procedures-links-100", "collapse-yade", "gravish-yade"]
"""Further results of a study: the name of the study is that of the folder up to the first such ending."""

OLDER = ["sensitivity", "sensitivity-section"]
"""Results of scenes as an earlier version wrote them, with other hashes."""

JUDGED = {
    path.parent.name: path
    for table in [*SCRIPTS, *ON_YADE]
    for path in (RESULTS / table / f"{name}.csv" for name in ("verdicts", "findings", "answers"))
    if path.is_file()
}
"""Published verdicts; those of `engines` are in its tables."""

ROUNDING = 1e-3
TIED = 5e-3  # of rank correlations: rounding ties values
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def study_of(table: str) -> Study:
    """Load the study that a folder of results is of."""
    name = next(name for name in sorted(SCRIPTS, key=len, reverse=True) if table.startswith(name))
    study = STUDIES[name].load()
    assert isinstance(study, Study)
    return study


@cache
def tables_of(table: str) -> dict[str, pd.DataFrame]:
    """Tables made of the published table of runs."""
    return study_of(table).tabulate(read_runs(RESULTS / table))


def stored(table: str, name: str) -> pd.DataFrame:
    return pd.read_csv(RESULTS / table / name, comment="#" if name != "findings.csv" else None)


def findings(table: str) -> pd.DataFrame:
    """The findings as published; their text may hold a `#`, so the footer is cut line by line."""
    lines = JUDGED[table].read_text(encoding="utf-8").splitlines(keepends=True)
    text = "".join(line for line in lines if not line.startswith("# "))
    found = pd.read_csv(io.StringIO(text), keep_default_na=False)
    if "question" in found:
        answers = {"yes": "found", "no": "not found", "undetermined": "not resolved"}
        found = found.rename(columns={"answer": "verdict", "evidence": "ours"}).replace({"verdict": answers})
    return found.set_index("id")


def numbers(text: str) -> list[float]:
    return sorted({abs(float(number)) for number in NUMBER.findall(text.replace("−", "-"))})


def reject_other_findings(table: str) -> None:
    """Hold verdicts and numbers of findings against those that are published."""
    published = findings(table)
    study = study_of(table)
    judged = {one.finding.id: one for one in study.judge(tables_of(table))}
    assert list(judged) == published.index.tolist()
    for name, one in judged.items():
        row = published.loc[name]
        assert one.verdict == row["verdict"], name
        assert row.get("finding in the paper", one.finding.says).startswith(one.finding.says), name
        assert one.needed == row.get("needed", one.needed), name
        # Every number with an error stands in the published text, but for the rounding of the table.
        known = numbers(row["ours"])
        for value, error in re.findall(r"([-+]\d[\d.e-]*) ± (\d[\d.e-]*)", one.ours):
            number = abs(float(value))
            nothing = 0.0 in known and number < 1e-4 * float(error)  # a mean of 0 from terms that the table rounded
            same = any(number == pytest.approx(other, rel=0.02) for other in known)
            assert same or nothing, (name, number, row["ours"])


@pytest.mark.parametrize("table", [*SCRIPTS, *ON_YADE])
def test_tables_and_findings_follow_from_the_table_of_runs(table: str) -> None:
    tables = tables_of(table)
    made_of_runs = tables.keys() - {"runs", "engines"}
    published = [name for name in made_of_runs if (RESULTS / table / f"{name}.csv").is_file()]
    assert published or not (RESULTS / table / "points.csv").is_file()
    for name in published:
        made = pd.read_csv(io.StringIO(tables[name].to_csv(index=False, float_format="%.6g")))
        known = stored(table, f"{name}.csv")
        assert made.columns.tolist() == known.columns.tolist()
        numeric = known.select_dtypes("number").columns
        pd.testing.assert_frame_equal(made.drop(columns=numeric), known.drop(columns=numeric), check_dtype=False)
        for column in numeric:
            # An error is a small difference of means that have six digits, and so is a change in per cent.
            mean = known.get(re.sub(r" (SE|95 %)(?= \[|$)", "", column), known[column])
            scale = 100.0 if column.endswith("[%]") else float(mean.abs().replace(np.inf, np.nan).max())
            values, wanted = made[column].astype(float), known[column].astype(float)
            atol = TIED if name in ("predictors", "comparisons") else 1e-5 * scale
            np.testing.assert_allclose(values, wanted, rtol=ROUNDING, atol=atol, err_msg=column)
    if table in JUDGED:
        reject_other_findings(table)


@pytest.mark.parametrize("table", [name for name in SCRIPTS if name not in OLDER])
def test_scenes_of_the_table_are_those_of_the_sweep(table: str) -> None:
    points = expand(of_one_seed(load_sweep(STUDIES[table].sweep_file())))  # others differ in the seed alone
    runs = read_runs(RESULTS / table).drop_duplicates("run").set_index("run")["scene_sha256"]
    known = {point.name: point.scene_sha256 for point in points if point.name in runs}
    assert known
    assert known == runs[list(known)].to_dict()


@pytest.mark.parametrize("table", [name for name in SCRIPTS if not STUDIES[name].variants])
def test_text_and_figures_are_made_from_the_tables(table: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("studies.landscape.RESAMPLES", 30)
    monkeypatch.setattr("postprocess.report.figures.save", partial(figures.save, formats=("png",)))
    study = study_of(table)
    tables = study.tabulate(read_runs(RESULTS / table))
    header, rows = study.table(tables)
    assert all(len(row) == len(header) for row in rows)
    assert "seeds 1" in study.statements(tables)[0]
    text = "\n".join(study.text(study.judge(tables), []))
    assert all(one.says in text for one in study.findings)
    drawn = study.draw(tmp_path, Analysis(tables=tables, runs={}, footer=["A footer."]))
    assert {path.stem for path in drawn} <= {figure.name for figure in study.figures}
    assert all(path.stat().st_size > 1000 for path in drawn)
