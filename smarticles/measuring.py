"""Make tables of the measures of runs and sweeps, with the variables of a sweep as columns."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext, suppress
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.display import Steps, silent
from dem.errors import InputError, nearest, shown
from dem.record.names import OF_SWEEP
from dem.record.sizes import measuring_cost
from smarticles.kept_tables import keep, key_of, read_kept
from smarticles.memory import free_memory

if TYPE_CHECKING:
    import pandas as pd

    from dem.record.document import Manifest
    from postprocess.measures.registry import FrameMeasure
    from postprocess.measures.table import Costly
    from templates.sweep.folder import Folder

_MIN_RUNS_FOR_PROCESSES = 6  #: With fewer runs, loading the libraries in each process takes longer than it saves

STATE, DONE = "state", "done"  #: Column with the state of a run, and the state of a finished run
SHARE = 0.8  #: Part of the free memory that processes may take together

PHASE = ("phase", "phase type")  #: Columns that identify a phase within a run


def has_frames(directory: Path) -> bool:
    """Return whether a run directory contains frames."""
    from dem.record.run import Run  # noqa: PLC0415

    return Run(directory).has_frames


def sources(directories: Sequence[Path]) -> dict[Path, Mapping[str, Any]]:
    """Find the runs to measure in directories of runs and sweeps; InputError if a sweep has no frames.

    Returns the values of the sweep's variables by run directory, empty for runs without a sweep. Runs of a sweep
    without frames are left out.
    """
    found: dict[Path, Mapping[str, Any]] = {}
    for directory in directories:
        runs = _runs_in(directory)
        if directory not in runs:  # a sweep
            runs = {run: values for run, values in runs.items() if has_frames(run)}
        if not runs:
            msg = f"{directory}: no run of this sweep has frames yet; start them with: smarticles resume {directory}"
            raise InputError(msg)
        found |= runs
    return found


def _runs_in(directory: Path) -> dict[Path, Mapping[str, Any]]:
    """Return the values of the sweep's variables by run directory; a run without a sweep has none."""
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    if not (directory / OF_SWEEP).is_file():
        return {directory: {}}
    folder = open_folder(directory)
    return {folder.run(entry): entry.values for entry in folder.entries}


def states(directories: Sequence[Path]) -> pd.DataFrame:
    """Return a table of all runs in directories of runs and sweeps, with or without frames.

    The columns are "run", "state", and the variables of the sweeps.
    """
    import pandas as pd  # noqa: PLC0415

    from dem.record.run import Run  # noqa: PLC0415

    rows: list[Mapping[str, Any]] = []
    for directory in directories:
        for run, values in _runs_in(directory).items():
            cells = {name: as_cell(value) for name, value in values.items()}
            rows.append({**cells, "run": str(run), STATE: Run(run).status.state})
    return pd.DataFrame(rows)


def usual_jobs(directories: Sequence[Path]) -> int:
    """Return the default number of processes that measure runs and sweeps: one per core, as far as memory allows.

    Directories without frames, of which there is nothing to measure, need no memory.
    """
    from dem.engine.cores import usable_cores  # noqa: PLC0415
    from dem.record.run import Run  # noqa: PLC0415

    free, needed = free_memory(), list[int]()
    with suppress(InputError):
        needed = [_memory_of(Run(directory).manifest) for directory in sources(directories)]
    if free is None or not needed:
        return usable_cores()
    return max(1, min(usable_cores(), int(SHARE * free) // max(needed)))


def _memory_of(made: Manifest) -> int:
    """Return the memory of a process that measures a run [bytes]."""
    from dem.body.particle import LINKS  # noqa: PLC0415

    kinds, cells = made.kinds, made.kinds is None and not made.planar and made.container_tiers == 1
    bars = LINKS * made.count if kinds is None else sum(kind.bodies * kind.bars for kind in kinds)
    return measuring_cost(made.count, bars, len(made.phases), cells=cells).memory_bytes


def values_in(folder: Folder) -> dict[str, list[Any]]:
    """Return the distinct values of each variable and constant of a sweep, in the order of the sweep."""
    found: dict[str, list[Any]] = {}
    for entry in folder.entries:
        for name, value in entry.values.items():
            values = found.setdefault(name, [])
            if value not in values:
                values.append(value)
    return found


def follows(name: str, other: str, points: Iterable[Mapping[str, object]]) -> bool:
    """Return whether equal values of the variable `other` imply equal values of `name` at these points."""
    seen: dict[str, object] = {}
    return all(seen.setdefault(str(point.get(other)), point.get(name)) == point.get(name) for point in points)


def measured(
    directories: Sequence[Path],
    *,
    frames: bool = False,
    costly: Costly = "phase-end",
    also: Sequence[str] = (),
    measures: Sequence[FrameMeasure] = (),
    jobs: int = 1,
    progress: Steps = silent,
) -> pd.DataFrame:
    """Measure runs and sweeps; tables of runs that have not changed since are read from their directories.

    Args:
        directories: directories of runs and sweeps.
        frames: return one row per frame instead of one row per run and phase.
        costly: frames for which costly packing fractions are computed: "never", "phase-end" or "every-frame".
        also: names of measures that are computed on request only, such as "crossing-number".
        measures: measures that the caller defines; with them, tables are neither read from directories nor stored
            there.
        jobs: number of processes. More than 1 needs `if __name__ == "__main__":` in the calling script, since the
            processes import it.
        progress: function that is called after each measured run.

    Returns:
        One table of all runs, with units in the column names. The variables of a sweep follow the first column, `run`;
        then comes `state`, see `dem.record.run.State`. A variable is called "NAME (swept)" if there is a measured
        column NAME with other values.

    Raises:
        InputError: a sweep has no run with frames yet, or a file is missing or damaged.
    """
    import pandas as pd  # noqa: PLC0415

    # A further measure is a function whose source may be unknown, so that its tables are not kept.
    found, kind = sources(directories), "" if measures else "-".join(["frames" if frames else "phases", costly, *also])
    keys = {directory: key_of(directory) if kind else "" for directory in found}
    tables = {directory: read_kept(directory, kind, key) if kind else None for directory, key in keys.items()}
    missing = [directory for directory, table in tables.items() if table is None]
    take = partial(_measure_and_keep, frames=frames, costly=costly, also=also, measures=measures, kind=kind)
    processes = 1 if len(missing) < _MIN_RUNS_FOR_PROCESSES else min(jobs, len(missing))
    # Spawned, since a forked process would not have the threads of VTK and matplotlib.
    pool = nullcontext() if processes == 1 else ProcessPoolExecutor(processes, mp_context=get_context("spawn"))
    with pool as executor:
        each = map if executor is None else executor.map
        made = each(take, missing, [keys[directory] for directory in missing])
        for number, (directory, table) in enumerate(zip(missing, made, strict=True), start=1):
            tables[directory] = table
            progress("runs measured", number, len(missing))
    return pd.concat(
        [_with_variables(table, found[run]) for run, table in tables.items() if table is not None], ignore_index=True
    )


def _measure_and_keep(
    directory: Path,
    key: str,
    *,
    frames: bool,
    costly: Costly,
    also: Sequence[str],
    measures: Sequence[FrameMeasure],
    kind: str,
) -> pd.DataFrame:
    from dem.record.run import Run  # noqa: PLC0415
    from postprocess.measures.table import measure_run, summarise_run  # noqa: PLC0415

    table = (measure_run if frames else summarise_run)(Run(directory), costly=costly, also=also, measures=measures)
    if kind:
        keep(table, directory, kind, key)
    return table


def _with_variables(table: pd.DataFrame, values: Mapping[str, Any]) -> pd.DataFrame:
    """Insert the variables of a run's sweep (`values` by name) and its state after the first column of its table."""
    from dem.record.run import Run  # noqa: PLC0415

    table.insert(1, STATE, Run(Path(table["run"].iloc[0])).status.state)
    for place, (name, value) in enumerate(values.items(), start=1):
        column, cell = name, as_cell(value)
        if name in table.columns and (table[name] == cell).all():
            table = table.drop(columns=name)  # inserted again below
        elif name in table.columns:
            column = f"{name} (swept)"
        table.insert(place, column, [cell] * len(table))
    return table


def as_cell(value: Any) -> Any:
    """Return the value of a variable as a cell of a table; mappings and lists become JSON."""
    return value if isinstance(value, str | int | float | bool) else json.dumps(value, ensure_ascii=False)


def of_phase(table: pd.DataFrame, phase: str | int) -> pd.DataFrame:
    """Select rows of a table of `measured` by type or number of phase; "last" selects the last phase of each run.

    InputError if no run has such a phase, or none has begun it.
    """
    from dem.record.run import Run  # noqa: PLC0415

    if not isinstance(phase, str):
        chosen = table["phase"] == phase
        if isinstance(phase, bool) or not chosen.any():
            numbers = ", ".join(str(number) for number in sorted(set(table["phase"])))
            raise InputError(f"phase: no run has begun phase {shown(phase)}; known: {numbers}")
        return table[chosen].reset_index(drop=True)
    if phase == "last":
        return table[table["phase"] == table.groupby("run")["phase"].transform("max")].reset_index(drop=True)
    if not (table["phase type"] == phase).any():
        measured_types = [*table["phase type"].unique(), "last"]
        if any(one.type == phase for run in table["run"].unique() for one in Run(Path(run)).phases):
            raise InputError(f"no run has begun a phase of this type; known: {', '.join(measured_types)}")
        raise InputError(f"no run has a phase {phase!r}; {nearest(phase, measured_types)}")
    return table[table["phase type"] == phase].reset_index(drop=True)


def grouped(
    table: pd.DataFrame,
    by: Sequence[str],
    *,
    runs: pd.DataFrame | None = None,
    intervals: bool = False,
    unfinished: bool = False,
) -> pd.DataFrame:
    """Average a table of `measured`, phase by phase, over runs with equal values in the columns `by`.

    Args:
        table: table of `measured`, with one row per run and phase.
        by: columns whose values define the groups.
        runs: table of `states`, to count runs without frames too; None: runs of `table` alone.
        intervals: add half-widths "… 95 % […]" of confidence intervals.
        unfinished: average over unfinished runs too. Their last phase may be incomplete.

    Returns:
        The table of `means_by`. Its column `state` counts the finished runs of a group, such as "3 of 12 finished".
    """
    from postprocess.statistics.points import RUNS, means_by, together  # noqa: PLC0415

    for name in by:
        if name not in table.columns:
            known = [str(column) for column in table.columns if not str(column).endswith("]")]
            raise InputError(f"the tables of these runs have no column {name!r}; {nearest(name, known)}")
    keys, table = [*by, *(name for name in PHASE if name not in by)], together(table, by)
    averaged = table if unfinished else table[table[STATE] == DONE]
    # Groups without a finished run keep their row.
    means = table[keys].drop_duplicates(ignore_index=True)
    if averaged.empty:
        means[RUNS] = 0
    else:
        found = means_by(averaged, keys, intervals=intervals).astype(means.dtypes.to_dict())
        means = means.merge(found, on=keys, how="left").copy()  # in one block, else pandas warns at `insert`
        means[RUNS] = means[RUNS].fillna(0).astype(int)
    if STATE not in by:
        means.insert(means.columns.get_loc(RUNS) + 1, STATE, _finished(means, table, by, runs))
    return means


def group_columns(means: pd.DataFrame, by: Sequence[str]) -> list[str]:
    """Return the columns of a table of `grouped` that identify a row; `state` only if a group has unfinished runs."""
    from postprocess.statistics.points import RUNS  # noqa: PLC0415

    complete = STATE in by or all(re.fullmatch(r"(\d+) of \1 finished", text) for text in means[STATE])
    return [*by, RUNS, *([] if complete else [STATE])]


def _finished(means: pd.DataFrame, table: pd.DataFrame, by: Sequence[str], runs: pd.DataFrame | None) -> Sequence[str]:
    """Return, for each row of `means`, how many runs of its group are finished, such as "3 of 12 finished"."""
    import pandas as pd  # noqa: PLC0415

    from dem.strict import equal  # noqa: PLC0415  (pydantic)

    def same(one: Any, other: Any) -> bool:
        return equal(one, other) or bool(pd.isna(one) and pd.isna(other))  # NaN: a variable of other sweeps

    named = [name for name in by if name not in PHASE]
    counted = runs if runs is not None and set(named) <= set(runs.columns) else table.drop_duplicates(["run", *named])
    every, texts = counted.to_dict("records"), []
    for values in means[named].to_dict("records"):
        found = [run[STATE] for run in every if all(same(run[name], value) for name, value in values.items())]
        texts.append(f"{found.count(DONE)} of {len(found)} finished")
    return texts
