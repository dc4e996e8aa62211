"""The runs of a study and their tables: runs measured, listed or rejected, columns, and rows of several engines."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd
from numpy.typing import NDArray

from dem.errors import InputError
from dem.plan.steps import time_steps
from dem.record.document import Phase
from dem.record.run import Run, open_run
from dem.run.run import manifest
from dem.scene.reading import load_scene
from postprocess.statistics.points import ASPECT, SEED, marked, told_number
from postprocess.statistics.seeds import mean_over_seeds

Row = Mapping[str, object]  #: Cells of one row of a table, by the names of its columns

# Runs without a relaxation at the end lack columns, and would put them behind these.
_TAIL = ["escaped at the end [-]", "frames averaged [-]", "scene_sha256", "run"]
_REMEDY = "give the results folder of an earlier analysis of this study, with runs.csv and provenance.json"


ENGINE = "engine"  #: Column of tables of runs of several engines

ENGINE_NAMES: Mapping[str, str] = MappingProxyType({"links": "links", "yade": "YADE"})
"""Engines in the order of tables and figures, the one that judges first, with their names in text."""

DEFINITION = "second-highest-com"  #: Definition of the packing fraction that is compared with Gravish's

PAIRS = "pairs [-]"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A column that is measured, averaged over seeds and shown."""

    column: str  #: Name in tables, with its unit
    meaning: str = ""  #: What it is, for readers of the table
    label: str = ""  #: Header in the short table; empty: only in the CSV files
    form: str = ".3g"  #: Format of a number there
    scale: float = 1.0  #: Factor of the numbers in the short table and in figures, such as 1e3 for millimetres
    axis: str = ""  #: Label of an axis of a figure; by default the column's name
    bar: str = "SE"  #: Which error of the points stands behind a number: `SE` or `95 %`

    def cell(self, point: Mapping[str, float]) -> str:
        """Format the mean of a point with its error, where it has one."""
        error = point.get(marked(self.column, self.bar), math.nan)
        return told_number(self.scale * point[self.column], self.form, self.scale * error)


def declare(
    rows: Mapping[str, tuple[str, str, str]],
    *,
    axes: Mapping[str, str] = MappingProxyType({}),
    scales: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, Quantity]:
    """Declare quantities by column: label, format and meaning; axes and factors where they are not the default."""
    return {
        column: Quantity(
            column=column,
            label=label,
            form=form or ".3g",
            meaning=meaning,
            axis=axes.get(column, ""),
            scale=scales.get(column, 1.0),
        )
        for column, (label, form, meaning) in rows.items()
    }


@dataclass(frozen=True, kw_only=True)
class Key:
    """A column that names a point: one combination of a sweep's variables."""

    column: str  #: Name in tables
    label: str  #: Header in the short table, and in statements about the runs
    form: str = ""  #: Format; empty for words
    unit: str = ""  #: Behind the number in the short table
    scale: float = 1.0  #: Factor of the number shown
    order: Sequence[str] = ()  #: Order of the values, where it is not their own

    def text(self, value: object) -> str:
        """Format a value; empty where a point has none, such as θ of a pile at rest."""
        if not isinstance(value, int | float):
            return str(value)
        return "" if math.isnan(value) else f"{self.scale * value:{self.form}}{self.unit}"


ASPECT_KEY = Key(column=ASPECT, label="l/w", form="g")
THETA_KEY = Key(column="theta [deg]", label="θ", form="g", unit="°")


def sort_rows(table: pd.DataFrame, columns: Sequence[str], keys: Sequence[Key]) -> pd.DataFrame:
    """Sort rows by columns; a key with an order of its own is sorted by that."""
    ranks = {key.column: {name: rank for rank, name in enumerate(key.order)} for key in keys if key.order}
    return table.sort_values(
        list(columns),
        key=lambda column: column.map(ranks[column.name]) if column.name in ranks else column,
        ignore_index=True,
        kind="stable",
    )


def engines_of(table: pd.DataFrame) -> tuple[str, ...]:
    """List the engines of a table of runs, the one that judges first; none where the table has one engine."""
    if ENGINE not in table.columns:
        return ()
    return tuple(sorted(set(table[ENGINE]), key=lambda name: (name not in ENGINE_NAMES, name)))


def of_engine(table: pd.DataFrame, engine: str) -> pd.DataFrame:
    """Select the rows of one engine, without the column `engine`."""
    return table[table[ENGINE] == engine].drop(columns=ENGINE)


def judging(table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of the engine that judges: all where there is one engine."""
    several = engines_of(table)
    return of_engine(table, several[0]) if several else table


def by_engine(table: pd.DataFrame, made: Callable[[pd.DataFrame], pd.DataFrame]) -> pd.DataFrame:
    """Make a table of the rows of each engine, one below the other; the column `engine` first, if there are several."""
    several = engines_of(table)
    if not several:
        return made(table)
    parts = pd.concat({engine: made(of_engine(table, engine)) for engine in several}, names=[ENGINE])
    return parts.reset_index(ENGINE).reset_index(drop=True)


def compared_engines(runs: pd.DataFrame, keys: Sequence[str], quantities: Iterable[str]) -> pd.DataFrame:
    """Subtract the engines from each other, point by point, paired by seed.

    Runs of the same point and seed were poured from the same poses on both engines. Granular piles are chaotic: a pair
    shares its poses, and soon nothing else, so pairing narrows little.

    Returns:
        One row per point, engine other than the judging one, and quantity: both means over the pairs, their
        difference, its 95 % half-width by Student's t, and both in per cent of the other engine's mean.
    """
    first, *others = engines_of(runs)
    rows = []
    for other in others:
        parts = of_engine(runs, first), of_engine(runs, other)
        both = parts[0].merge(parts[1], on=[*keys, SEED], suffixes=(" one", " other"))
        for point, group in both.groupby(list(keys), dropna=False):
            for quantity in quantities:
                pairs = group[[f"{quantity} one", f"{quantity} other"]].dropna().to_numpy()
                if not len(pairs):
                    continue
                one, base = pairs.mean(axis=0)
                effect = mean_over_seeds(pairs[:, 0] - pairs[:, 1])
                change = effect.value, effect.half_width
                scale = 100 / abs(base) if base else math.nan
                means = [effect.count, one, base, *change, *(scale * part for part in change)]
                rows.append([*point, quantity, first, other, *means])
    columns = [*keys, "quantity", "engine", "other engine", PAIRS, "mean", "other mean"]
    columns += ["difference", "difference 95 %", "difference [%]", "difference 95 % [%]"]
    return pd.DataFrame(rows, columns=columns)


@dataclass(frozen=True, kw_only=True)
class MissingRun:
    """A run directory that could not be used."""

    directory: str  #: As given
    status: str  #: "not started", "unfinished", "failed", "interrupted", or "unusable" for one that cannot be measured
    cause: str  #: Why, as far as it is known

    @property
    def common_cause(self) -> str:
        """The cause without the name of the directory, to be counted."""
        return self.cause.removeprefix(f"{self.directory}: ").replace(self.directory, "RUN")


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredRun:
    """A finished run and what was measured of it."""

    run: Run
    #: Its rows of the table of runs: one, unless a study measures a run in several ways
    rows: Sequence[Row] = field(repr=False)
    #: Quantities against time by the names of columns, (n,) each; empty where a study has none
    history: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False)

    @property
    def row(self) -> Row:
        """The first of its rows."""
        return self.rows[0]


@dataclass(frozen=True, kw_only=True, eq=False)
class Collected:
    """The runs of a study that are done and were measured, in the order given, and the others."""

    study: str  #: Name of the study, for messages
    runs: Sequence[MeasuredRun]
    missing: Sequence[MissingRun]

    def table(self) -> pd.DataFrame:
        """Make the table of runs: with their engine where there are several, and what names a run at its end."""
        several = len({run.run.manifest.engine for run in self.runs}) > 1
        table = pd.DataFrame(
            [{ENGINE: run.run.manifest.engine, **row} if several else row for run in self.runs for row in run.rows]
        )
        tail = [name for name in _TAIL if name in table]
        return table[[*table.columns.difference(tail, sort=False), *tail]]

    def times(self) -> pd.DataFrame | None:
        """Put the histories of all runs one below the other; None where no run has one."""
        tables = [pd.DataFrame({"run": run.run.path.name, **run.history}) for run in self.runs if run.history]
        return pd.concat(tables, ignore_index=True) if tables else None

    def reject_mixture(
        self,
        quantity: str,
        value: Callable[[MeasuredRun], object],
        *,
        within: Callable[[MeasuredRun], Hashable] = lambda _: None,
    ) -> None:
        """Reject runs that differ in some quantity within a group, by an InputError."""
        firsts: dict[Hashable, MeasuredRun] = {}
        for run in self.runs:
            first = firsts.setdefault(within(run), run)
            if value(run) != value(first):
                raise InputError(
                    f"study {self.study}: runs of different {quantity} must not be averaged: {first.run.path} is "
                    f"{value(first)}, {run.run.path} is {value(run)}; analyse them apart"
                )

    def reject_repeats(self, point: Callable[[MeasuredRun], str]) -> None:
        """Reject two runs with the same seed of the same point, by an InputError."""
        seen: dict[tuple[str, int, str], MeasuredRun] = {}
        for run in self.runs:
            key = (point(run), run.run.manifest.seed, run.run.manifest.engine)
            if seen.setdefault(key, run) is not run:
                raise InputError(
                    f"study {self.study}: point = {key[0]} with seed {key[1]} is given twice, "
                    f"{seen[key].run.path} and {run.run.path}; leave one out"
                )


def collect_runs(
    study: str,
    run_dirs: Sequence[Path | str],
    measure: Callable[[Run], MeasuredRun],
    *,
    earlier: Mapping[str, MeasuredRun] | None = None,
) -> Collected:
    """Measure the finished runs, and list the others; an InputError while measuring makes a run unusable.

    Of directories that are not there the runs of an earlier analysis stand in, by name.

    Raises:
        InputError: No run is done.
    """
    runs: list[MeasuredRun] = []
    missing: list[MissingRun] = []
    for directory in run_dirs:
        before = (earlier or {}).get(Path(directory).name)
        if before is not None and not Path(directory).exists():
            runs.append(before)
            continue
        try:
            run = open_run(directory)
            if run.status.state == "done":
                runs.append(measure(run))
                continue
            status, cause = str(run.status.state), run.status.cause or "it has not finished"
        except InputError as error:
            status = "unusable" if Path(directory, "run.json").exists() else "not started"
            cause = str(error)
        missing.append(MissingRun(directory=str(directory), status=status, cause=cause))
    if not runs:
        why = f"; the first: {missing[0].directory}: {missing[0].cause}" if missing else ""
        raise InputError(f"study {study}: none of {len(run_dirs)} runs is done{why}; finish a run first")
    return Collected(study=study, runs=runs, missing=missing)


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """A run that a study plans: its scene file, and the hash of that scene."""

    scene: Path
    scene_sha256: str


def earlier_runs(results: Path | str, wanted: Mapping[str, Wanted]) -> dict[str, MeasuredRun]:
    """Read those runs of an earlier analysis that are of the scenes wanted, by name.

    What was measured comes from `runs.csv` in the results, to the six digits that are there; versions and command come
    from `provenance.json`. Only a run of the very scene counts, by name and hash.

    Raises:
        InputError: The folder holds no such files, they are damaged, or none of its runs is wanted.
    """
    results = Path(results)
    table = read_runs(results)
    path = results / "provenance.json"
    try:
        runs = json.loads(path.read_text(encoding="utf-8"))["runs"]
        origins = {Path(run["directory"]).name: run for run in runs}
    except (OSError, ValueError, KeyError, TypeError) as error:
        cause = error.strerror if isinstance(error, OSError) else f"it is no provenance of a study ({error!r})"
        raise InputError(f"cannot read {path}: {cause}; {_REMEDY}") from None
    found: dict[str, MeasuredRun] = {}
    for name, rows in table.groupby("run", sort=False):
        run, origin = wanted.get(str(name)), origins.get(str(name))
        if run and origin and {run.scene_sha256, origin["scene_sha256"]} == set(rows["scene_sha256"]):
            cells: list[Row] = rows.drop(columns=ENGINE, errors="ignore").to_dict(orient="records")
            found[str(name)] = MeasuredRun(run=_manifest(run, origin), rows=cells)
    if not found:
        msg = f"{results}: none of its {table['run'].nunique()} runs is of a scene of this study as it is; {_REMEDY}"
        raise InputError(msg)
    return found


def read_runs(results: Path) -> pd.DataFrame:
    """Read the table of runs as a study wrote it; InputError where it is none."""
    path = results / "runs.csv"
    try:
        table = pd.read_csv(path, comment="#", dtype={"run": str, "scene_sha256": str, SEED: int})
        cause = next((f"column '{name}' is missing" for name in ("run", "scene_sha256") if name not in table), "")
    except (OSError, ValueError) as error:
        cause = str((isinstance(error, OSError) and error.strerror) or error)
    if cause:
        raise InputError(f"cannot read {path}: {cause}; {_REMEDY}")
    return table


def _manifest(run: Wanted, origin: Mapping[str, Any]) -> Run:
    """Rebuild the run of an earlier analysis from its scene and provenance."""
    scene = load_scene(run.scene)
    versions = dict(origin["versions"])
    made = manifest(
        scene,
        Path(origin["directory"]),
        steps=time_steps(scene),
        command=origin["command"],
        made_by=(scene.engine, versions.get(scene.engine, "unknown")),
        threads=1,
    )
    found = Run(Path(origin["directory"]))
    # Its directory is not here.
    vars(found)["manifest"] = made.model_copy(update={"started": origin["started"], "versions": versions})
    return found


def duration(phase: Phase) -> float:
    """Compute how long a phase of a finished run took [s]."""
    if phase.start_s is None or phase.end_s is None:
        return math.nan
    return phase.end_s - phase.start_s


def run_columns(run: Run) -> dict[str, object]:
    """Give the cells that say what pile a run is of."""
    return {
        ASPECT: round(run.manifest.aspect_ratio, 6),
        SEED: run.manifest.seed,
        "smarticles [-]": run.manifest.count,
        "fidelity": run.manifest.fidelity,
    }


def last_columns(run: Run) -> dict[str, object]:
    """Give the cells that name a run, the last ones of its row."""
    return {"scene_sha256": run.manifest.scene_sha256, "run": run.path.name}
