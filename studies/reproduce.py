"""Compute one cell of each published table anew and compare it: `python -m studies.reproduce [TABLE ...]`.

`cells.yaml` names one run of each table in results/. Its scene is built from the study's sweep and must have the hash
that the table has. The run is computed and measured as the study does. Each of its numbers must lie where a further
seed of its point would lie: within the scatter of the published seeds. On a processor of the kind that the table was
made on, the numbers themselves come out; on others the last bits differ, and a pile with them.
"""

import argparse
import math
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from scipy.special import stdtrit

from dem.engine.cores import usable_cores
from dem.errors import InputError, RunError
from dem.record.run import open_run
from dem.scene.reading import dump_scene, load_scene
from dem.scene.scene import Scene
from studies import accuracy
from studies.framework.runs import read_runs
from studies.framework.study import Study
from studies.registry import shipped
from templates.sweep.expand import Point, expand
from templates.sweep.sweep_file import SEED, Sweep, load_sweep, on_engine

RESULTS = Path(__file__).parents[1] / "results"
CELLS = Path(__file__).with_name("cells.yaml")

CHANCE = 0.01  #: Probability that a sound run is outside, all its columns together
FEWEST = 3  #: Fewest published seeds of a point that give a scatter

_NUMBERED = (SEED, "block")  # variables that tell runs of one point apart; `finite-size` has several blocks of seeds
_DIGITS = 1e-5  # tables have six
_MACHINE = ("processor", "wall time")  # first words of columns that describe the machine
_LADDER_SEEDS = range(1, 21)


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """One cell of a table that is computed anew, and where its scene comes from."""

    table: str  #: Folder under results/
    run: str  #: Name of the run
    column: str  #: Column of runs.csv that is shown
    cpu_s: float  #: Processor time of the run on the machine of `cells.yaml` [s]
    study: str = ""  #: Shipped study that measures the run; empty: that of the table's name
    engine: str = ""  #: Engine of all runs of the table; empty: that of the study's sweep
    quick: bool = False  #: Whether the table is of the study's quick variant
    ladder: str = ""  #: Scene beside the table whose ladder it is (`smarticles accuracy`); empty: it is of no ladder

    @property
    def measured_by(self) -> Study:
        """The study that measures the run."""
        if self.ladder:
            return accuracy.study(self._ladder.rungs)
        return shipped(self.study or self.table).load()

    @property
    def _ladder(self) -> accuracy.Ladder:
        path = RESULTS / self.table / self.ladder
        return accuracy.build_ladder(load_scene(path), source=str(path))

    @property
    def sweep(self) -> Sweep:
        """The sweep of the table's scenes."""
        if self.ladder:
            scene = load_scene(RESULTS / self.table / self.ladder)
            return accuracy.ladder_sweep(scene, self._ladder, _LADDER_SEEDS)
        sweep = load_sweep(shipped(self.study or self.table).sweep_file(quick=self.quick))
        return on_engine(sweep, self.engine) if self.engine else sweep


@dataclass(frozen=True, kw_only=True)
class Cell:
    """The published numbers of all seeds of one point."""

    table: str  #: Folder under results/
    run: str  #: Name of one run
    rows: pd.DataFrame  #: Numbers of all seeds of its point, by run

    def half_width(self, column: str) -> float:
        """Return the half-width of the interval in which a further seed lies; NaN if seeds are too few.

        The probability that a sound run is outside in any of the table's columns is `CHANCE`.
        """
        seeds = self.rows[column].dropna()
        if len(seeds) < FEWEST:
            return math.nan
        factor = float(stdtrit(len(seeds) - 1, 1 - CHANCE / len(self._columns) / 2))
        return float(factor * seeds.std() * math.sqrt(1 + 1 / len(seeds)) + _DIGITS * abs(seeds.mean()))

    @property
    def _columns(self) -> list[str]:
        return [str(name) for name in self.rows if not str(name).startswith(_MACHINE)]

    def outside(self, row: Mapping[str, object]) -> dict[str, str]:
        """Return the columns in which a row lies outside of the seeds' interval, with the numbers as text."""
        found = {}
        for name in self._columns:
            value, width, mean = _number(row, name), self.half_width(name), self.rows[name].mean()
            if abs(value - mean) > width:
                found[name] = f"{value:g}, where the others are {mean:g} ± {width:g}"
        return found

    def same(self, row: Mapping[str, object]) -> bool:
        """Return whether all numbers of a row are the published ones of this run."""
        published = self.rows.loc[self.run]
        return all(
            math.isclose(_number(row, name), value, rel_tol=_DIGITS, abs_tol=1e-9)
            for name, value in published[self._columns].dropna().items()
        )


def _number(row: Mapping[str, object], column: str) -> float:
    return float(str(row.get(column, math.nan)))


def chosen() -> dict[str, Chosen]:
    """Read the cells that are computed anew, by table."""
    return {table: Chosen(table=table, **entry) for table, entry in _listed()["cells"].items()}


def left_out() -> dict[str, str]:
    """Read the reasons for which tables are left out, by table."""
    return dict(_listed()["left_out"])


def _listed() -> dict[str, Any]:
    listed: dict[str, Any] = yaml.safe_load(CELLS.read_text(encoding="utf-8"))
    return listed


@cache
def points_of(one: Chosen) -> dict[str, Point]:
    """Return the points of a table's sweep by the name of the run."""
    return {point.name: point for point in expand(one.sweep)}


@cache
def published(table: str) -> pd.DataFrame:
    """Read a table of runs by name of the run; of a run that is measured in several ways the first row."""
    rows = read_runs(RESULTS / table).set_index("run")
    return rows[~rows.index.duplicated()]


def scene_of(one: Chosen) -> Scene:
    """Return the scene of a chosen run; InputError if the study's scene is no longer that of the table."""
    point, made = points_of(one)[one.run], published(one.table).loc[one.run]["scene_sha256"]
    if point.scene_sha256 != made:
        raise InputError(
            f"results/{one.table}/runs.csv: {one.run} is of scene {made[:12]}, that of the study is now "
            f"{point.scene_sha256[:12]}; make the table again"
        )
    return point.scene


def cell_of(one: Chosen) -> Cell:
    """Return the published numbers of all seeds of the point of a chosen run; InputError if seeds are too few."""
    rows, points = published(one.table), points_of(one)
    alike = {name: value for name, value in points[one.run].values.items() if name not in _NUMBERED}
    seeds = [
        name
        for name, point in points.items()
        if name in rows.index and {key: point.values[key] for key in alike} == alike
    ]
    if len(seeds) < FEWEST:
        raise InputError(f"results/{one.table}: {len(seeds)} seeds of the point of {one.run}; choose one with {FEWEST}")
    return Cell(table=one.table, run=one.run, rows=rows.loc[seeds].select_dtypes("number").drop(columns=[SEED]))


def compute(scene: Scene, out: Path) -> Path:
    """Compute a scene in a new process and return the run directory; RunError if it fails."""
    file = out.parent.parent / f"{out.name}.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(dump_scene(scene), encoding="utf-8")
    command = [sys.executable, "-m", "smarticles", "run", str(file), "--out", str(out)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode:
        raise RunError((done.stderr.strip().splitlines() or ["no message"])[-1])
    return out


@dataclass(frozen=True, kw_only=True)
class Result:
    """Outcome of computing a cell anew."""

    one: Chosen
    published: float  #: Published number
    anew: float = math.nan  #: Number computed now
    error: float = math.nan  #: Half-width of the interval of a further seed
    verdict: str  #: `same`, `within`, `outside: …` or `failed: …`
    cpu_s: float = math.nan  #: Processor time of the run [s]

    @property
    def agrees(self) -> bool:
        """Whether all numbers of the run are the published ones, or within the scatter of seeds."""
        return self.verdict in ("same", "within")


def compare(one: Chosen, run_dir: Callable[[], Path]) -> Result:
    """Measure a run and compare it with its cell; `run_dir` returns its directory once it is done."""
    was = float(published(one.table).loc[one.run][one.column])
    try:
        run = open_run(run_dir())
        row, cell = one.measured_by.measured(run).rows[0], cell_of(one)
    except (InputError, RunError) as error:
        return Result(one=one, published=was, verdict=f"failed: {error}")
    outside = "; ".join(f"{name} {text}" for name, text in cell.outside(row).items())
    return Result(
        one=one,
        published=was,
        anew=_number(row, one.column),
        error=cell.half_width(one.column),
        verdict="same" if cell.same(row) else f"outside: {outside}" if outside else "within",
        cpu_s=run.status.cpu_s or math.nan,
    )


def table_of(results: Sequence[Result]) -> pd.DataFrame:
    """Make the table that is printed: a row per cell."""
    return pd.DataFrame(
        {
            "table": one.one.table,
            "run": one.one.run,
            "quantity": one.one.column,
            "published": one.published,
            "computed anew": one.anew,
            "error": one.error,
            "verdict": one.verdict,
            "processor time [s]": one.cpu_s,
        }
        for one in results
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Compute cells anew, print and write the table; return 0 if all agree, otherwise 1."""
    parser = argparse.ArgumentParser(prog="python -m studies.reproduce", description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument(
        "tables", nargs="*", metavar="TABLE", help="folders under results/ (default: all of cells.yaml)"
    )
    parser.add_argument("--out", type=Path, required=True, help="new folder for the runs and for cells.csv")
    parser.add_argument("--jobs", type=int, default=usable_cores(), help="simultaneous runs (default: one per core)")
    given, cells, reasons = parser.parse_args(arguments), chosen(), left_out()
    for name in given.tables:
        if name not in cells:
            parser.error(f"{name}: {reasons.get(name) or 'not in cells.yaml, which has ' + ', '.join(cells)}")
    wanted = [cells[name] for name in given.tables or cells]
    out: Path = given.out
    if out.exists():
        parser.error(f"--out {out}: exists; give a new folder")
    out.mkdir(parents=True)

    def start(one: Chosen) -> Path:
        return compute(scene_of(one), out / one.table / "runs" / one.run)

    results = []
    # Long runs first, so that no core is idle at the end.
    ordered = sorted(wanted, key=lambda one: -one.cpu_s)
    with ThreadPoolExecutor(given.jobs) as pool:
        for one, future in [(one, pool.submit(start, one)) for one in ordered]:
            results.append(compare(one, future.result))
            print(f"{len(results)} of {len(wanted)}: {one.table}: {results[-1].verdict}", flush=True)
    table = table_of(results).sort_values("table")
    table.to_csv(out / "cells.csv", index=False, float_format="%.6g")
    print("\n" + table.to_string(index=False, float_format="{:.4g}".format))
    print(f"\nerror: half-width of the interval of a further seed ({100 * (1 - CHANCE):g} %, all columns together)")
    print("same: all columns are the published ones to six digits; within: all are in the interval")
    if not given.tables:
        print("Left out:", *(f"  {name}: {reason}" for name, reason in reasons.items()), sep="\n")
    failed = sum(not one.agrees for one in results)
    print(f"{len(results) - failed} of {len(results)} cells agree; {out / 'cells.csv'}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
