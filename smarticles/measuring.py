"""What came out of runs and sweeps as one table, with what a sweep varied as columns."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dem.errors import InputError, nearest

if TYPE_CHECKING:
    import pandas as pd

    from postprocess.measures.table import Costly
    from templates.sweep.folder import Folder

_WORTH_PROCESSES = 6
"""Runs from which on starting processes saves time: each loads its libraries anew."""

PHASE = ("phase", "phase type")
"""Columns that tell the phases of a run apart."""


def sources(directories: Sequence[Path]) -> dict[Path, Mapping[str, Any]]:
    """Run directories among, or inside, the given ones, with what their sweeps varied.

    Args:
        directories: of runs; a sweep's stands for its runs with frames.

    Raises:
        InputError: a sweep has no run with frames yet.
    """
    from templates.sweep.folder import MANIFEST, open_folder  # noqa: PLC0415

    found: dict[Path, Mapping[str, Any]] = {}
    for directory in directories:
        if not (directory / MANIFEST).is_file():
            found[directory] = {}
            continue
        folder = open_folder(directory)
        begun = {
            folder.run(entry): entry.values for entry in folder.entries if (folder.run(entry) / "frames.pvd").is_file()
        }
        if not begun:
            msg = f"{directory}: no run of this sweep has frames yet; start them with: smarticles resume {directory}"
            raise InputError(msg)
        found |= begun
    return found


def values_in(folder: Folder) -> dict[str, list[Any]]:
    """Variables and constants of a sweep and the values that each takes, in the order of the sweep."""
    found: dict[str, list[Any]] = {}
    for entry in folder.entries:
        for name, value in entry.values.items():
            values = found.setdefault(name, [])
            if value not in values:
                values.append(value)
    return found


def measured(
    directories: Sequence[Path], *, frames: bool = False, costly: Costly = "phase-end", jobs: int = 1
) -> pd.DataFrame:
    """Measures of runs and sweeps, one row per run and phase; what a sweep varied stands beside the run.

    Args:
        directories: of runs and sweeps.
        frames: one row per frame instead.
        costly: when to take the costly packing fractions, see `postprocess.measure_run`.
        jobs: runs that are measured at once, each in a process of its own; only for programs that processes may be
            started from, which a script without a guarded main is not.

    Returns:
        A table with units in its columns. A variable of a sweep that has the name of another column and not its
        values is called "NAME (swept)".

    Raises:
        InputError: a sweep has no run with frames yet, or a file is missing or damaged.
    """
    import pandas as pd  # noqa: PLC0415

    found = sources(directories)
    tables = []
    for (_, values), table in zip(found.items(), _tables(list(found), frames, costly, jobs), strict=True):
        swept = {_column(name, value, table): value for name, value in values.items()}
        for place, (name, value) in enumerate(swept.items(), start=1):
            if name in table.columns:
                table = table.drop(columns=name)  # noqa: PLW2901  (the same, put at another place)
            table.insert(place, name, [_cell(value)] * len(table))
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _tables(directories: Sequence[Path], frames: bool, costly: Costly, jobs: int) -> Iterator[pd.DataFrame]:
    """The table of each run, in order."""
    take = partial(_one, frames=frames, costly=costly)
    if jobs == 1 or len(directories) < _WORTH_PROCESSES:
        yield from map(take, directories)
        return
    # Anew, not forked: VTK and matplotlib may have threads here.
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield from pool.map(take, directories)


def _one(directory: Path, *, frames: bool, costly: Costly) -> pd.DataFrame:
    from dem.record.run import Run  # noqa: PLC0415
    from postprocess.measures.table import measure_run, summarise_run  # noqa: PLC0415

    return (measure_run if frames else summarise_run)(Run(directory), costly=costly)


def grouped(table: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """Means over runs, one row per group and phase; see `postprocess.statistics.points.means_by`.

    Args:
        table: of `measured`, one row per run and phase.
        by: columns whose values make a group.

    Raises:
        InputError: there is no such column.
    """
    from postprocess.statistics.points import means_by  # noqa: PLC0415

    for name in by:
        if name not in table.columns:
            known = [str(column) for column in table.columns if not str(column).endswith("]")]
            msg = f"{name!r} is no column of these runs; {nearest(name, known)}"
            raise InputError(msg)
    return means_by(table, [*by, *(name for name in PHASE if name not in by)])


def _column(name: str, value: object, table: pd.DataFrame) -> str:
    """What a variable's column is called: by its name, unless a run says something else under it."""
    if name in table.columns and not (table[name] == value).all():
        return f"{name} (swept)"
    return name


def _cell(value: object) -> object:
    """A variable as one cell; what is no number or text as JSON."""
    return value if isinstance(value, str | int | float | bool) else json.dumps(value, ensure_ascii=False)
