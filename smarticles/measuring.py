"""Measures of runs and sweeps as one table, with what a sweep varied as columns."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError, nearest
from dem.record.names import FRAME, OF_SWEEP, collection

if TYPE_CHECKING:
    import pandas as pd

    from postprocess.measures.table import Costly
    from templates.sweep.folder import Folder

_WORTH_PROCESSES = 6  #: Runs from which on starting processes saves time: each loads its libraries anew

PHASE = ("phase", "phase type")  #: Columns that identify a phase of a run


def has_frames(directory: Path) -> bool:
    """Return whether a run directory holds a frame."""
    return (directory / collection(FRAME)).is_file()


def sources(directories: Sequence[Path]) -> dict[Path, Mapping[str, Any]]:
    """Return runs, and of each sweep its runs with frames, with what their sweeps varied.

    Raises:
        InputError: a sweep has no run with frames yet.
    """
    from templates.sweep.folder import open_folder  # noqa: PLC0415

    found: dict[Path, Mapping[str, Any]] = {}
    for directory in directories:
        if not (directory / OF_SWEEP).is_file():
            found[directory] = {}
            continue
        folder = open_folder(directory)
        begun = {run: entry.values for entry in folder.entries if has_frames(run := folder.run(entry))}
        if not begun:
            msg = f"{directory}: no run of this sweep has frames yet; start them with: smarticles resume {directory}"
            raise InputError(msg)
        found |= begun
    return found


def values_in(folder: Folder) -> dict[str, list[Any]]:
    """Return the variables and constants of a sweep with the values of each, in the order of the sweep."""
    found: dict[str, list[Any]] = {}
    for entry in folder.entries:
        for name, value in entry.values.items():
            values = found.setdefault(name, [])
            if value not in values:
                values.append(value)
    return found


def follows(name: str, other: str, points: Iterable[Mapping[str, object]]) -> bool:
    """Return whether a variable is determined by another one, as the columns of a table are by its first."""
    seen: dict[str, object] = {}
    return all(seen.setdefault(str(point.get(other)), point.get(name)) == point.get(name) for point in points)


def measured(
    directories: Sequence[Path], *, frames: bool = False, costly: Costly = "phase-end", jobs: int = 1
) -> pd.DataFrame:
    """Return measures of runs and sweeps, one row per run and phase, with what a sweep varies beside the run.

    Args:
        costly: when to take the costly packing fractions, see `postprocess.measure_run`.
        jobs: runs that are measured at once, each in a process of its own; more than one only in programs from which
            processes may be started: not in a script without a guarded main.

    Returns:
        A table with units in its columns. A variable of a sweep that has the name of another column and not its
        values is called "NAME (swept)".

    Raises:
        InputError: a sweep has no run with frames yet, or a file is missing or damaged.
    """
    import pandas as pd  # noqa: PLC0415

    found = sources(directories)
    take = partial(_table, frames=frames, costly=costly)
    if jobs == 1 or len(found) < _WORTH_PROCESSES:
        tables = list(map(take, found, found.values()))
    else:
        # Anew, not forked: VTK and matplotlib may have threads here.
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            tables = list(pool.map(take, found, found.values()))
    return pd.concat(tables, ignore_index=True)


def _table(directory: Path, values: Mapping[str, Any], *, frames: bool, costly: Costly) -> pd.DataFrame:
    """Return the table of one run, with the variables of its sweep after the first column."""
    from dem.record.run import Run  # noqa: PLC0415
    from postprocess.measures.table import measure_run, summarise_run  # noqa: PLC0415

    table = (measure_run if frames else summarise_run)(Run(directory), costly=costly)
    for place, (name, value) in enumerate(values.items(), start=1):
        column = name
        if name in table.columns and (table[name] == value).all():
            table = table.drop(columns=name)  # inserted at another place
        elif name in table.columns:
            column = f"{name} (swept)"
        cell = value if isinstance(value, str | int | float | bool) else json.dumps(value, ensure_ascii=False)
        table.insert(place, column, [cell] * len(table))
    return table


def grouped(table: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """Return means of `measured` over runs, one row per group and phase.

    Raises:
        InputError: there is no such column.
    """
    from postprocess.statistics.points import means_by  # noqa: PLC0415

    for name in by:
        if name not in table.columns:
            known = [str(column) for column in table.columns if not str(column).endswith("]")]
            raise InputError(f"{name!r} is no column of these runs; {nearest(name, known)}")
    return means_by(table, [*by, *(name for name in PHASE if name not in by)])
