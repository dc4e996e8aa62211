"""The runs of a study: the finished ones measured, the others listed, and what must not be averaged refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dem.errors import InputError
from dem.record.document import Phase
from dem.record.run import Run, open_run
from postprocess.statistics.points import SEED

Row = Mapping[str, object]
"""Cells of one row of a table, by the names of its columns."""

ENGINE = "engine"
"""Column of tables of runs of several engines."""

ENGINES = ("links", "yade")
"""Engines in the order of tables and figures: that of the many runs first."""

DEFINITION = "second-highest-com"
"""Definition of the packing fraction that is compared with Gravish's."""

BARS = "Error bars: 95 % confidence of the mean over seeds, Student's t"
"""What error bars are in all figures of studies; the ± of tables says for itself what it is."""

# Runs without a relaxation at the end lack columns, and would put them behind these.
_TAIL = ["escaped at the end [-]", "frames averaged [-]", "scene_sha256", "run"]


@dataclass(frozen=True, kw_only=True)
class MissingRun:
    """A run directory that could not be used.

    Attributes:
        directory: As given.
        status: "not started", "unfinished", "failed", "interrupted", or "unusable" for one that
            cannot be read or was not shaken.
        cause: Why, as far as it is known.
    """

    directory: str
    status: str
    cause: str

    @property
    def common_cause(self) -> str:
        """The cause without the name of the directory: the same for all runs that lack the same."""
        return self.cause.removeprefix(f"{self.directory}: ").replace(self.directory, "RUN")


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredRun:
    """A finished run and what was measured of it.

    Attributes:
        run: The run.
        rows: Its rows of the table of runs: one, unless a study measures the same run in several ways.
        history: Quantities against time by the names of columns, (n,) each; empty where a study has none.
    """

    run: Run
    rows: Sequence[Row] = field(repr=False)
    history: Mapping[str, NDArray[np.float64]] = field(default_factory=dict, repr=False)

    @property
    def row(self) -> Row:
        """The first of its rows."""
        return self.rows[0]

    @property
    def name(self) -> str:
        """Name of its directory, which the table of runs calls it by."""
        return self.run.path.name


@dataclass(frozen=True, kw_only=True, eq=False)
class Collected:
    """The runs of a study that are done and were measured, in the order given, and the others.

    Attributes:
        study: Name of the study, for messages.
        given: All run directories.
        runs: The finished ones, one or more.
        missing: The others.
    """

    study: str
    given: tuple[Path | str, ...]
    runs: tuple[MeasuredRun, ...]
    missing: tuple[MissingRun, ...]

    @property
    def manifests(self) -> tuple[Run, ...]:
        """What the finished runs say of themselves."""
        return tuple(run.run for run in self.runs)

    @property
    def engines(self) -> tuple[str, ...]:
        """The engines that the finished runs were computed by, as in `ENGINES`."""
        present = {run.run.manifest.engine for run in self.runs}
        return tuple(name for name in ENGINES if name in present) + tuple(sorted(present - set(ENGINES)))

    def table(self) -> pd.DataFrame:
        """The rows of all runs; with their engine where there are several."""
        if len(self.engines) > 1:
            return pd.DataFrame([{ENGINE: run.run.manifest.engine, **row} for run in self.runs for row in run.rows])
        return pd.DataFrame([row for run in self.runs for row in run.rows])

    def times(self) -> pd.DataFrame | None:
        """Histories of all runs, one below the other; None where no run has one."""
        tables = [pd.DataFrame({"run": run.name, **run.history}) for run in self.runs if run.history]
        return pd.concat(tables, ignore_index=True) if tables else None

    def refuse_mixture(
        self,
        quantity: str,
        value: Callable[[MeasuredRun], object],
        *,
        within: Callable[[MeasuredRun], Hashable] = lambda _: None,
    ) -> None:
        """Refuses runs that must be alike in some quantity and are not.

        Args:
            quantity: Its name, for messages.
            value: The quantity of a run.
            within: Of which group a run is; only those of one group must be alike.

        Raises:
            InputError: Two runs differ in it.
        """
        firsts: dict[Hashable, MeasuredRun] = {}
        for run in self.runs:
            first = firsts.setdefault(within(run), run)
            if value(run) != value(first):
                msg = (
                    f"study {self.study}: runs of different {quantity} must not be averaged: "
                    f"{first.run.path} is {value(first)}, "
                    f"{run.run.path} is {value(run)}; analyse them apart"
                )
                raise InputError(msg)

    def refuse_repeats(self, name: str, value: Callable[[MeasuredRun], str]) -> None:
        """Refuses two runs with the same seed of the same point.

        Args:
            name: What a point of the study is called, e.g. "l/w".
            value: The point of a run.

        Raises:
            InputError: There are two.
        """
        seen: dict[tuple[str, int, str], MeasuredRun] = {}
        for run in self.runs:
            key = (value(run), run.run.manifest.seed, run.run.manifest.engine)
            if key in seen:
                msg = (
                    f"study {self.study}: {name} = {key[0]} with seed {key[1]} is given twice, "
                    f"{seen[key].run.path} and {run.run.path}; leave one out"
                )
                raise InputError(msg)
            seen[key] = run


def collect_runs(
    study: str,
    run_dirs: Sequence[Path | str],
    measure: Callable[[Run], MeasuredRun],
    *,
    earlier: Mapping[str, MeasuredRun] | None = None,
) -> Collected:
    """Measures the finished runs, and lists the others.

    Args:
        study: Its name, for messages.
        run_dirs: Run directories.
        measure: What is measured of one run; an InputError makes the run unusable.
        earlier: Runs measured before by the names of their directories, for those whose directories are not there.

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
            if run.status.state != "done":
                cause = run.status.cause or "it has not finished"
                missing.append(MissingRun(directory=str(directory), status=run.status.state, cause=cause))
                continue
            runs.append(measure(run))
        except InputError as error:
            status = "unusable" if Path(directory, "run.json").exists() else "not started"
            missing.append(MissingRun(directory=str(directory), status=status, cause=str(error)))
    if not runs:
        why = f"; the first: {missing[0].directory}: {missing[0].cause}" if missing else ""
        msg = f"study {study}: none of {len(run_dirs)} runs is done{why}; finish a run first"
        raise InputError(msg)
    return Collected(study=study, given=tuple(run_dirs), runs=tuple(runs), missing=tuple(missing))


def duration(phase: Phase) -> float:
    """How long a phase of a finished run took [s]."""
    if phase.start_s is None or phase.end_s is None:
        return math.nan
    return phase.end_s - phase.start_s


def runs_table(found: Collected) -> pd.DataFrame:
    """One row per run, the columns that tell runs from measures at its ends."""
    table = found.table()
    tail = [name for name in _TAIL if name in table]
    return table[[*table.columns.difference(tail, sort=False), *tail]]


def told_bars(counts: pd.Series, point: str) -> str:
    """What error bars mean, for footers.

    Args:
        counts: Seeds of each point.
        point: What a point of the study is called, e.g. "l/w".
    """
    if counts.max() > 1:
        return BARS
    return f"One seed per {point}: no error bars"


def told_seeds(runs: pd.DataFrame, counts: pd.Series, point: str) -> str:
    """Which seeds there are and how many per point, for footers; arguments as in `told_bars`."""
    return f"seeds {told_numbers(runs[SEED])} ({told_range(counts)} per {point})"


def told_numbers(numbers: Iterable[int]) -> str:
    """`1 2 3`, or `1 to 8` where five or more follow each other.

    Example:
        >>> told_numbers([1, 2, 3, 4, 5, 9])
        '1 to 5 9'
    """
    rows: list[list[int]] = []
    for number in sorted(set(numbers)):
        if rows and number == rows[-1][-1] + 1:
            rows[-1].append(number)
        else:
            rows.append([number])
    return " ".join(f"{row[0]} to {row[-1]}" if len(row) > 4 else " ".join(map(str, row)) for row in rows)


def told_range(counts: pd.Series) -> str:
    """`3` or `1 to 3`: how many there are of each."""
    return str(counts.min()) if counts.nunique() == 1 else f"{counts.min()} to {counts.max()}"
