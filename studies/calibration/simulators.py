"""Compute runs of a calibration by a Python function or read them from a table; measure runs.

`smarticles.commands.calibrate` computes runs as sweeps of scenes.
"""

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dem.errors import InputError, RunError, nearest
from dem.record.files import read_csv
from dem.record.run import Run
from dem.strict import equal
from dem.terminal import warn
from postprocess.measures.packing import DEFINITIONS
from postprocess.measures.table import summarise_run
from studies.calibration.emulator import LEAST_RUNS, Array
from studies.calibration.inference import Measured
from studies.calibration.problem import CONDITION, Problem
from templates.sweep.render import Value
from templates.sweep.sweep_file import cell_value


@dataclass(frozen=True)
class FunctionSimulator:
    """A Python function as the simulation: it takes a run's variables and seed, and returns its measures.

    A RunError of the function is a failed run.
    """

    problem: Problem
    function: Callable[[Mapping[str, Value]], Measured]

    def planned(self, wave: int) -> None:
        """Return None: a function's runs are not stored, so that no wave was begun earlier."""

    def run(self, wave: int, theta: Array) -> list[tuple[Mapping[str, Value], Measured | None]]:
        """Call the function for all runs of a wave."""
        return [(values, self._measured(values)) for values in self.problem.runs(wave, theta)]

    def _measured(self, values: Mapping[str, Value]) -> Measured | None:
        try:
            return self.function(values)
        except RunError:
            return None


def read_runs(path: Path, problem: Problem) -> pd.DataFrame:
    """Read a table of runs made elsewhere; InputError if it cannot be read.

    Variables of the data of the problem are read as they are there: 007 is text.
    """
    variables = dict.fromkeys(problem.conditions[0], str)
    remedy = "give a CSV file whose first line names columns"
    table = read_csv("runs of --table", path, remedy, comment="#", dtype=variables)
    for name in variables.keys() & set(table.columns):
        table[name] = table[name].map(cell_value, na_action="ignore")
    return table


class TableSimulator:
    """Simulator whose only wave of runs is a table made elsewhere: a row per run, a column per variable and measure."""

    def __init__(self, problem: Problem, table: pd.DataFrame, source: str) -> None:
        if problem.content.waves != 1:
            raise InputError(f"{problem.path}: waves: runs of a table are one wave; set waves to 1")
        needed = {*problem.names, *(name for one in problem.conditions for name in one)}
        needed |= {datum.measure for datum in problem.data}
        for name in sorted(needed - set(table.columns)):
            raise InputError(f"{source}: column {name!r} is missing; columns are {', '.join(table.columns)}")
        self.problem, self.source = problem, source
        self.table = table.assign(**{name: self._numbers(table[name]) for name in problem.names})
        self._placed = [self._condition(row) for row in self.table.to_dict("records")]
        low, high = problem.bounds
        theta, digits = self.planned(1), 5e-5  # points of waves have five digits
        self._outside = (theta < low - digits * abs(low)) | (theta > high + digits * abs(high))
        self._check()

    def _numbers(self, column: pd.Series) -> pd.Series:
        found = pd.to_numeric(column, errors="coerce")
        if (wrong := np.flatnonzero(~np.isfinite(found))).size:
            value = column.iloc[wrong[0]]
            raise InputError(f"{self.source}, row {wrong[0] + 2}: {column.name} is {value}, not a finite number")
        return found

    def _condition(self, row: Mapping[Hashable, Value]) -> int | None:
        """Return the index of the condition of the data that a row matches; None if there is none."""
        own = {name: row[name] for name in self.problem.conditions[0]}
        return next((k for k, condition in enumerate(self.problem.conditions) if equal(own, condition)), None)

    def _check(self) -> None:
        """Raise InputError unless each condition of fitted data has runs within the priors that vary all parameters."""
        inside = ~self._outside.any(axis=1)
        for number, condition in enumerate(self.problem.conditions):
            if not any(datum.fitted and datum.condition == number for datum in self.problem.data):
                continue
            matching = np.array([placed == number for placed in self._placed], dtype=np.bool_)
            place = "".join(f", at {name} {value}" for name, value in condition.items())
            if (used := int((matching & inside).sum())) < LEAST_RUNS:
                reason = self._first_outside(matching)
                raise InputError(
                    f"{self.source}{place}: {used} of {int(matching.sum())} runs have all parameters within their "
                    f"priors{reason}; an emulator needs {LEAST_RUNS}: give more runs, or wider priors"
                )
            for name, values in self.table[list(self.problem.names)][matching & inside].items():
                if values.nunique() == 1:
                    raise InputError(
                        f"{self.source}{place}: {name} is {values.iloc[0]:g} in all runs within the priors, so that "
                        "they say nothing about it; give runs that vary it, or make it one of constants, not of free"
                    )

    def _first_outside(self, among: NDArray[np.bool_]) -> str:
        """Return in words the first parameter that is outside its prior in one of some runs; "" if none is."""
        for row, column in np.argwhere(self._outside & among[:, None]):
            name = self.problem.names[column]
            low, high = (each[column] for each in self.problem.bounds)
            return f" (row {row + 2}: {name} is {self.table[name].iloc[row]:g}, its prior {low:g} to {high:g})"
        return ""

    def planned(self, wave: int) -> Array:
        """Return the parameters (n, d) of all rows."""
        found: Array = self.table[list(self.problem.names)].to_numpy(np.float64)
        return found

    def listing(self) -> str:
        """Return in words how many runs are at conditions of the data, within the priors."""
        found = self.run(1, self.planned(1))
        return f"{self.source}: {len(found)} of {len(self.table)} runs are at conditions of the data"

    def run(self, wave: int, theta: Array) -> list[tuple[Mapping[str, Value], Measured | None]]:
        """Return variables and measures of the rows at conditions of the data, with parameters within the priors.

        `wave` and `theta` are not used: the table is the only wave. Warnings state how many rows are left out.
        """
        found: list[tuple[Mapping[str, Value], Measured | None]] = []
        measures = list(dict.fromkeys(datum.measure for datum in self.problem.data))
        others, outside = [], np.zeros(len(self.table), dtype=np.bool_)
        for number, (row, placed) in enumerate(zip(self.table.to_dict("records"), self._placed, strict=True)):
            if placed is None:
                others.append(row)
            elif self._outside[number].any():
                outside[number] = True
            else:
                parameters = {name: row[name] for name in self.problem.names}
                variables = {**parameters, **self.problem.conditions[placed], CONDITION: placed}
                found.append((variables, {m: row[m] for m in measures}))
        if others:
            place = ", ".join(f"{name} {others[0][name]}" for name in self.problem.conditions[0])
            warn(f"{self.source}: {len(others)} of {len(self.table)} runs are left out: no data are at {place}")
        if outside.any():
            warn(
                f"{self.source}: {int(outside.sum())} of {len(self.table)} runs are left out: outside the priors"
                f"{self._first_outside(outside)}"
            )
        return found


def column_and_phase(name: str, kinds: Sequence[str], where: str) -> tuple[str, int]:
    """Return column and index of the phase of a measure, `COLUMN` or `COLUMN @ PHASE`; see `measured`.

    InputError, which begins with the place `where`, if there is no such phase among those of the given `kinds`.
    """
    column, _, phase = (part.strip() for part in name.partition("@"))
    try:
        return column, range(len(kinds))[int(phase or -1)]
    except (ValueError, IndexError):
        there = ", ".join(f"{index} {kind}" for index, kind in enumerate(kinds))
        raise InputError(f"{where}: measure {name!r}: no phase {phase!r}; there are {there}") from None


def measured(run: Run, names: Sequence[str]) -> dict[str, float]:
    """Return measures of a run by their names, as means over the last frames of a phase.

    Names are `COLUMN` or `COLUMN @ PHASE`: a column of the table that `smarticles measure` prints, and the index of a
    phase, from 0, or from the end as -1; default: the last phase. InputError if there is no such phase or column, or a
    file is damaged.
    """
    kinds = [phase.type for phase in run.phases]
    wanted = {name: column_and_phase(name, kinds, str(run.path)) for name in names}
    # Costly definitions are measured only if they are asked for.
    used = [one for one in DEFINITIONS if any(one in column for column, _ in wanted.values())]
    table = summarise_run(run, definitions=used, phases={index for _, index in wanted.values()}).set_index("phase")
    found = {}
    for name, (column, index) in wanted.items():
        row = table.loc[index]
        if column not in table.columns and row["frames averaged"]:
            raise InputError(f"{run.path}: measure {column!r} is no column; {nearest(column, map(str, table.columns))}")
        found[name] = float(row.get(column, math.nan))  # a run of an older version may lack frames of a phase
    return found
