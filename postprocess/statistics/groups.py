"""Means over runs that are alike: tables of many runs, one row per group."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import marked
from postprocess.statistics.seeds import mean_over_seeds

RUNS = "runs [-]"
"""Column that says how many runs a row is the mean of."""

_WITHIN = " SE ["


def means_by(table: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """Means over the rows of each group, with their standard errors from row to row.

    Args:
        table: One row per run, or per run and phase; quantities carry their unit in brackets. Errors within a run
            ("… SE […]") are left out: what counts from run to run is the scatter of the runs.
        by: Columns whose values make a group; groups keep the order in which they first appear.

    Returns:
        The columns of `by`, `RUNS`, then each quantity with "… SE […]" beside: s/√n, NaN for one run alone, as in
        `seeds.mean_over_seeds`; a NaN among the values is left out.

    Example:
        >>> runs = pd.DataFrame({"friction": [0.2, 0.2, 0.4], "phi [-]": [0.1, 0.3, 0.5]})
        >>> means_by(runs, ["friction"]).round(3).values.tolist()
        [[0.2, 2.0, 0.2, 0.1], [0.4, 1.0, 0.5, nan]]
    """
    quantities = [
        name
        for name in table.columns
        if name.endswith("]")
        and name not in (*by, ASPECT)
        and _WITHIN not in name
        and pd.api.types.is_numeric_dtype(table[name])
    ]
    rows = []
    for values, group in table.groupby(list(by), sort=False, dropna=False):
        row: dict[str, object] = {**dict(zip(by, values, strict=True)), RUNS: len(group)}
        for name in quantities:
            mean = mean_over_seeds(group[name])
            row |= {name: mean.value, marked(name, "SE"): mean.standard_error}
        rows.append(row)
    return pd.DataFrame(rows)
