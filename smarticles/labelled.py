"""Turn tables of sweeps into labelled arrays, with a dimension for each variable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

import pandas as pd

from dem.errors import InputError
from smarticles.measuring import as_cell, follows

_TEXTS = ("run", "state")  # columns that describe a run


def dataset_of(table: pd.DataFrame, values: Sequence[Mapping[str, Any]]) -> Any:
    """Return a table with one row per run as a `Dataset` of xarray.

    Variables that differ between runs are dimensions. One that follows from another variable is a coordinate along it,
    such as the second variable of a sweep that pairs values. If runs have equal values, the only dimension is `run`.

    Args:
        table: Table of `measured`, of one phase.
        values: Values of the sweep's variables, for each row.

    Returns:
        A dataset with a variable for each column with a unit; `attrs["units"]` is the unit. Points without a run have
        NaN. Directory and state of each run are coordinates.

    Raises:
        InputError: xarray is not installed.
    """
    try:
        xarray = import_module("xarray")  # not a dependency
    except ModuleNotFoundError as error:
        raise InputError("to_xarray needs the package xarray; install it: pip install 'smarticles[arrays]'") from error
    points = pd.DataFrame([{name: as_cell(value) for name, value in each.items()} for each in values])
    varied = [name for name in points if points[name].nunique(dropna=False) > 1]
    rows = points.to_dict("records")
    leading = [name for place, name in enumerate(varied) if not _led(name, varied[:place], varied[place + 1 :], rows)]
    if points[leading].duplicated().any() or not leading:
        leading, points = ["run"], points.assign(run=table["run"].to_numpy())
    columns = [name for name in table.columns if str(name).endswith("]")]
    index = pd.MultiIndex.from_frame(points[leading]) if len(leading) > 1 else pd.Index(points[leading[0]])
    found = xarray.Dataset.from_dataframe(table[columns].set_axis(index))
    # xarray sorts; names of values have no order but that of the sweep.
    found = found.reindex({name: points[name].unique() for name in leading if name != "run" and _named(points[name])})
    for name in columns:
        found[name].attrs["units"] = str(name).rpartition("[")[2][:-1]
    for name in varied:
        if name in leading:
            continue
        leader = next(one for one in leading if one == "run" or follows(name, one, rows))
        known = points.drop_duplicates(leader).set_index(leader)[name]
        found = found.assign_coords({name: (leader, known.reindex(found[leader].values).to_numpy())})
    texts = [name for name in _TEXTS if name in table.columns and name not in leading]
    return found.assign_coords(xarray.Dataset.from_dataframe(table[texts].set_axis(index)).data_vars)


def _named(values: pd.Series[Any]) -> bool:
    return all(isinstance(value, str) for value in values)


def _led(name: str, before: Sequence[str], after: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether a variable follows from another one; of two that follow from each other the first one leads."""
    return any(follows(name, other, rows) for other in before) or any(
        follows(name, other, rows) and not follows(other, name, rows) for other in after
    )
