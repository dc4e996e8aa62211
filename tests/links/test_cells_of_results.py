"""A cell of each table of the reproduction, run anew: is what stands in results/ what this version finds?

The cells are those of `make reproduce` (`studies/cells.yaml`). Six run by default, all of them with
`pytest -m "long or not long" tests/links/test_cells_of_results.py`.
"""

from pathlib import Path

import pandas as pd
import pytest

from dem.errors import InputError
from dem.record.run import open_run
from studies import reproduce
from studies.framework.runs import DEFINITION
from studies.reproduce import (
    FEWEST,
    RESULTS,
    Cell,
    Chosen,
    Result,
    cell_of,
    chosen,
    compare,
    compute,
    left_out,
    points_of,
    published,
    scene_of,
    table_of,
)

BY_DEFAULT = ("chain", "chain-bodies", "engines", "finite-size", "rods", "shaft")
"""Cheap ones of all kinds: robots, YADE, three activities, other bodies, motors."""

ALL = chosen()
CELLS = [
    pytest.param(
        one,
        id=one.table,
        marks=[
            *([pytest.mark.long] if one.table not in BY_DEFAULT else []),
            *([pytest.mark.engine] if one.engine == "yade" or one.table == "chain-bodies" else []),
        ],
    )
    for one in ALL.values()
]
OTHERS = [
    ("procedures", "shape-change_lw1.10_links_seed1", "internal10_lw1.10_links_seed1"),
    ("strength-code", "static_h13_lw0.70_links_seed1", "shape-change_h13_lw0.70_links_seed2"),
    ("finite-size", "lw0.09_n100_seed1", "lw0.13_n100_seed1"),
    ("collapse", "lw1.17_gamma4.0_seed1", "lw0.66_gamma4.0_seed1"),
]


@pytest.mark.parametrize("one", CELLS)
def test_a_cell_comes_out_again(one: Chosen, tmp_path: Path) -> None:
    result = compare(one, lambda: compute(scene_of(one), tmp_path / "runs" / one.run))
    assert result.agrees, result.verdict


@pytest.mark.long
def test_a_long_run_begins_as_the_table_has_it(tmp_path: Path) -> None:
    """Two hundred seconds of shaking are minutes; their first five are not."""
    begin, one = 5.0, Chosen(table="compaction", run="lw0.70_mu0.65_seed1", column="", cpu_s=0)
    scene = scene_of(one)
    phases = [
        phase.model_copy(update={"duration_s": begin}) if phase.type == "shake" else phase for phase in scene.phases
    ]
    assert phases != list(scene.phases)
    short = scene.model_copy(update={"phases": tuple(phases)})
    measured = one.measured_by.measured(open_run(compute(short, tmp_path / "runs" / one.run))).rows[0]
    columns = [f"phi_0 {DEFINITION} [-]", "crossings before [-]", f"phi {begin:g} s {DEFINITION} [-]"]
    part = Cell(table=one.table, run=one.run, rows=cell_of(one).rows[columns])
    assert part.outside(measured) == {}
    assert part.outside(published("friction").loc["lw0.40_mu0.65_seed1"].to_dict())


@pytest.mark.parametrize(("table", "run", "other"), OTHERS)
def test_a_run_of_another_cell_is_found_out(table: str, run: str, other: str) -> None:
    one = Chosen(table=table, run=run, column="", cpu_s=0)
    stranger, own = published(table).loc[other].to_dict(), published(table).loc[run].to_dict()
    assert cell_of(one).outside(stranger)
    assert not cell_of(one).same(stranger)
    assert cell_of(one).outside(own) == {}
    assert cell_of(one).same(own)


def test_every_table_is_chosen_or_left_out_with_a_reason() -> None:
    tables = {path.parent.relative_to(RESULTS).as_posix() for path in RESULTS.rglob("*.csv")} - {"."}
    reasons = left_out()
    assert not set(ALL) & set(reasons)
    assert all(reasons.values())
    named = {*ALL, *reasons}
    # A folder that is named speaks for those inside, but not the other way round.
    assert {table for table in tables if table not in named and table.split("/")[0] not in reasons} == set()
    for one in ALL.values():
        row = published(one.table).loc[one.run]
        assert pd.notna(row[one.column]), one
        assert one.cpu_s > 0


def test_all_cells_take_less_than_ten_minutes() -> None:
    """On two idle cores, with ten seconds a process for imports, compiling and measuring."""
    assert sum(one.cpu_s + 10 for one in ALL.values()) / 2 < 600


def test_what_does_not_agree_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = ALL["chain"]

    def nothing() -> Path:
        raise InputError("no such run")

    failed = compare(one, nothing)
    assert (failed.agrees, failed.verdict) == (False, "failed: no such run")
    with pytest.raises(InputError, match=f"seeds of the point of .*; choose one with {FEWEST}"):
        cell_of(Chosen(table="procedures-code-yade", run="shape-change_lw0.40_seed1", column="", cpu_s=0))
    other = Chosen(table="sensitivity", run="stiffness1000_seed1", column="", cpu_s=0)
    monkeypatch.setattr(reproduce, "points_of", lambda _: {other.run: next(iter(points_of(one).values()))})
    row = pd.DataFrame({"scene_sha256": ["0" * 64]}, index=[other.run])
    monkeypatch.setattr(reproduce, "published", lambda _: row)
    with pytest.raises(InputError, match="is of scene 000000000000, that of the study is now"):
        scene_of(other)


def test_the_command_prints_the_table_and_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def made(one: Chosen, _run_dir: object) -> Result:
        agrees = one.table != "rods"
        return Result(
            one=one, published=1.5, anew=1.25, error=0.5, cpu_s=2.0, verdict="within" if agrees else "outside: x"
        )

    monkeypatch.setattr(reproduce, "compare", made)
    monkeypatch.setattr(reproduce, "compute", lambda scene, out: out)
    monkeypatch.setattr(reproduce, "scene_of", lambda one: None)
    out = tmp_path / "out"
    with pytest.raises(SystemExit):
        reproduce.main(["nothing", "--out", str(out)])
    assert "nothing: not in cells.yaml" in capsys.readouterr().err
    assert reproduce.main(["chain", "--out", str(out / "a")]) == 0
    assert reproduce.main(["chain", "rods", "--out", str(out / "b")]) == 1
    said = capsys.readouterr().out
    assert "1 of 2 cells agree" in said
    assert "outside: x" in said
    written = pd.read_csv(out / "b" / "cells.csv")
    assert written["computed anew"].tolist() == [1.25, 1.25]
    assert table_of([]).empty
