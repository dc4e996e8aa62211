"""Runs of a study and their tables: finished and missing runs, columns, and several engines.

The *judging engine* of a study is the one whose runs decide its findings: links, if runs are on several engines.
"""

import json
import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd
from numpy.typing import NDArray

from dem.display import Steps, silent
from dem.errors import InputError
from dem.plan.steps import time_steps
from dem.record.document import Phase, Start
from dem.record.run import Run, open_run
from dem.run.run import manifest
from dem.scene.reading import load_scene
from postprocess.statistics.points import ASPECT, SEED, format_with_error, marked
from postprocess.statistics.seeds import mean_over_seeds

Row = Mapping[str, object]  #: Cells of one row of a table by column

# Always last in the table of runs, although runs that end without a relaxation have fewer columns before them.
_TAIL = ["escaped at the end [-]", "frames averaged [-]", "scene_sha256", "run"]
_REMEDY = "give the results folder of an earlier analysis of this study, with runs.csv and provenance.json"

ENGINE = "engine"  #: Column of tables of runs of several engines

ENGINE_NAMES: Mapping[str, str] = MappingProxyType({"links": "links", "yade": "YADE"})
"""Names of engines in texts, in the order of tables and figures; the runs of the first engine judge findings."""

DEFINITION = "second-highest-com"  #: Definition of the packing fraction, as in the papers that are compared with

PAIRS = "pairs [-]"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A column that is measured, averaged over seeds and shown."""

    column: str  #: Name of the column, with unit
    meaning: str = ""  #: Explanation of the quantity for readers of the tables
    label: str = ""  #: Header in the short table; empty: the quantity is in the CSV files only
    form: str = ".3g"  #: Format in the short table
    scale: float = 1.0  #: Factor in the short table and in figures, such as 1e3 for millimetres
    axis: str = ""  #: Label of the axis in figures; empty: the name of the column
    bar: str = "SE"  #: Error that is shown in the short table: `SE` (standard error) or `95 %` (half-width)

    def cell(self, point: Mapping[str, float]) -> str:
        """Format the quantity's mean in a row of the table of points, with its error if known."""
        error = point.get(marked(self.column, self.bar), math.nan)
        return format_with_error(self.scale * point[self.column], self.form, self.scale * error)


def declare(
    rows: Mapping[str, tuple[str, str, str]],
    *,
    axes: Mapping[str, str] = MappingProxyType({}),
    scales: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, Quantity]:
    """Make the quantities of a study, by the name of their column.

    Args:
        rows: label in the short table, format (empty: `.3g`) and meaning of each quantity, by column.
        axes: labels of the axes in figures by column; default: the name of the column.
        scales: factors in the short table and in figures by column, such as 1e3 for millimetres; default: 1.
    """
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
    """A column that names points; a point is one combination of a sweep's variables."""

    column: str  #: Name of the column in tables
    label: str  #: Header in the short table, and name in texts
    form: str = ""  #: Format of numbers; empty for words
    unit: str = ""  #: Text after the number
    scale: float = 1.0  #: Factor from the value in the column to the number in texts
    order: Sequence[str] = ()  #: Order of words in tables; empty: alphabetical

    def text(self, value: object) -> str:
        """Format a value of the column; empty for NaN, such as θ of a pile without oscillation."""
        if not isinstance(value, int | float):
            return str(value)
        return "" if math.isnan(value) else f"{self.scale * value:{self.form}}{self.unit}"


ASPECT_KEY = Key(column=ASPECT, label="l/w", form="g")
THETA_KEY = Key(column="theta [deg]", label="θ", form="g", unit="°")


def sort_rows(table: pd.DataFrame, columns: Sequence[str], keys: Sequence[Key]) -> pd.DataFrame:
    """Return a table sorted by columns; words are sorted by the `Key.order` of their column, if any."""
    ranks = {key.column: {name: rank for rank, name in enumerate(key.order)} for key in keys if key.order}
    return table.sort_values(
        list(columns),
        key=lambda column: column.map(ranks[column.name]) if column.name in ranks else column,
        ignore_index=True,
        kind="stable",
    )


def engines_of(table: pd.DataFrame) -> tuple[str, ...]:
    """Return the engines in a table, first the one whose runs decide the findings.

    The result is empty if the table has no column `engine`.
    """
    if ENGINE not in table.columns:
        return ()
    return tuple(sorted(set(table[ENGINE]), key=lambda name: (name not in ENGINE_NAMES, name)))


def of_engine(table: pd.DataFrame, engine: str) -> pd.DataFrame:
    """Return the rows of one engine, without the column `engine`."""
    return table[table[ENGINE] == engine].drop(columns=ENGINE)


def judging(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the engine whose runs decide the findings, without the column `engine`.

    All rows are returned if the table has no such column.
    """
    several = engines_of(table)
    return of_engine(table, several[0]) if several else table


def by_engine(table: pd.DataFrame, made: Callable[[pd.DataFrame], pd.DataFrame]) -> pd.DataFrame:
    """Apply the function `made` to the rows of each engine, and concatenate the tables that it returns.

    The result has the column `engine` first if the given table has several engines.
    """
    several = engines_of(table)
    if not several:
        return made(table)
    parts = pd.concat({engine: made(of_engine(table, engine)) for engine in several}, names=[ENGINE])
    return parts.reset_index(ENGINE).reset_index(drop=True)


def compared_engines(runs: pd.DataFrame, keys: Sequence[str], quantities: Iterable[str]) -> pd.DataFrame:
    """Compare the judging engine with each other engine: differences at each point, paired by seed.

    The judging engine is the one whose runs decide the findings. Runs with equal point and seed were poured from equal
    poses. Piles are chaotic and soon forget their poses, so pairing reduces the scatter only a little. The table has
    one row per point, other engine and quantity. A row has the mean of each engine over the pairs, and their difference
    with its 95 % half-width by Student's t, also in per cent of the other engine's mean. `keys` are the columns that
    identify a point, `quantities` the compared columns.
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
    """A run that is not in the tables of its study."""

    directory: str  #: Path of the run directory, as given
    status: str  #: "not started", "unfinished", "failed", "interrupted", or "unusable" if it cannot be measured
    cause: str  #: Reason as a text

    @property
    def common_cause(self) -> str:
        """Cause with RUN in place of the path of the directory, so that equal causes can be counted."""
        return self.cause.removeprefix(f"{self.directory}: ").replace(self.directory, "RUN")


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredRun:
    """A finished run with its rows of the table of runs."""

    run: Run
    rows: Sequence[Row] = field(repr=False)  #: Rows of the run: one, or one per definition
    #: Columns of the table `times`, (n,) each: a time and quantities at that time; empty if a study has no such table
    history: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False)

    @property
    def row(self) -> Row:
        """First row of the run."""
        return self.rows[0]


@dataclass(frozen=True, kw_only=True, eq=False)
class Collected:
    """Runs of a study: measured runs, in the order of the given directories, and missing runs."""

    study: str  #: Name of the study, for messages
    runs: Sequence[MeasuredRun]
    missing: Sequence[MissingRun]

    def table(self) -> pd.DataFrame:
        """Make the table of runs; it begins with the column `engine` if there are several engines."""
        several = len({run.run.manifest.engine for run in self.runs}) > 1
        table = pd.DataFrame(
            [{ENGINE: run.run.manifest.engine, **row} if several else row for run in self.runs for row in run.rows]
        )
        tail = [name for name in _TAIL if name in table]
        return table[[*table.columns.difference(tail, sort=False), *tail]]

    def times(self) -> pd.DataFrame | None:
        """Concatenate the histories of all runs, with the column `run`; None if no run has a history."""
        tables = [pd.DataFrame({"run": run.run.path.name, **run.history}) for run in self.runs if run.history]
        return pd.concat(tables, ignore_index=True) if tables else None

    def reject_mixture(
        self,
        quantity: str,
        value: Callable[[MeasuredRun], object],
        *,
        within: Callable[[MeasuredRun], Hashable] = lambda _: None,
    ) -> None:
        """Raise InputError if a value differs between runs that must be alike, such as runs averaged together.

        `value` returns the value of a run, `within` its group; only runs of one group must have equal values. By
        default all runs are one group.
        """
        firsts: dict[Hashable, MeasuredRun] = {}
        for run in self.runs:
            first = firsts.setdefault(within(run), run)
            if value(run) != value(first):
                raise InputError(
                    f"study {self.study}: runs of different {quantity} must not be averaged: {first.run.path} is "
                    f"{value(first)}, {run.run.path} is {value(run)}; analyse them apart"
                )

    def reject_repeats(self, point: Callable[[MeasuredRun], str]) -> None:
        """Raise InputError if two runs have equal point, seed and engine.

        A point is a combination of the sweep's variables; `point` returns the name of a run's point.
        """
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
    progress: Steps = silent,
) -> Collected:
    """Measure the finished runs among given run directories, and list the others as missing.

    If `measure` raises InputError, the run is missing, with the status "unusable". Measured runs of an `earlier`
    analysis, by name, replace directories that do not exist. `progress` is called before each run. InputError if no
    run is finished.
    """
    runs: list[MeasuredRun] = []
    missing: list[MissingRun] = []
    for number, directory in enumerate(run_dirs):
        progress("runs measured", number, len(run_dirs))
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
    """A run that a study plans: path of its scene file and hash of its scene."""

    scene: Path
    scene_sha256: str


def earlier_runs(results: Path | str, wanted: Mapping[str, Wanted]) -> dict[str, MeasuredRun]:
    """Read planned runs from the results of an earlier analysis, so that they need not be computed again.

    Rows come from `runs.csv`, whose numbers have six digits; versions and command come from `provenance.json`. A run is
    read only if its name and the hash of its scene are those of a planned run. InputError if a file is missing or
    damaged, or no run in it is planned.
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
    """Read the table `runs.csv` from a folder of results; InputError if it is missing or lacks columns."""
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
    """Make the `Run` of an absent directory from its scene and its entry in `provenance.json`."""
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
    # A cached property: it would be read from the directory, which does not exist.
    resumed = tuple(Start(**start) for start in origin.get("resumed", ()))
    known = {"started": origin["started"], "versions": versions, "machine": origin.get("machine"), "resumed": resumed}
    vars(found)["manifest"] = made.model_copy(update=known)
    return found


def require_frames(run: Run, phases: Iterable[int]) -> None:
    """Raise InputError if a run has no frame of one of the phases with these indices."""
    for index in phases:
        if not run.frames.in_phase(index):
            raise InputError(f"{run.path}: no frame of phase {index} ({run.phases[index].type}); run it again")


def duration(phase: Phase) -> float:
    """Return the simulated time of a phase [s]; NaN if the phase has not ended."""
    if phase.start_s is None or phase.end_s is None:
        return math.nan
    return phase.end_s - phase.start_s


def phase_of(run: Run, type_: str) -> int:
    """Return the index of the first phase of a type; InputError if a run has no such phase."""
    for phase in run.phases:
        if phase.type == type_:
            return phase.index
    raise InputError(f"{run.path}: has no phase {type_}; leave it out")


def run_columns(run: Run) -> dict[str, object]:
    """Return aspect ratio, seed, count and fidelity of a run, by column."""
    return {
        ASPECT: round(run.manifest.aspect_ratio, 6),
        SEED: run.manifest.seed,
        "smarticles [-]": run.manifest.count,
        "fidelity": run.manifest.fidelity,
    }


def last_columns(run: Run) -> dict[str, object]:
    """Return the hash of a run's scene and the name of its directory, by column."""
    return {"scene_sha256": run.manifest.scene_sha256, "run": run.path.name}
