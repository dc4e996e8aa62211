"""Measures as tables of a page: what short tables have, and everything, folded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from postprocess.measures.registry import shown_quantities
from postprocess.statistics.points import marked, told_number
from smarticles.reporting.page import Table

if TYPE_CHECKING:
    import pandas as pd


def short_table(table: pd.DataFrame, named: Sequence[str], caption: str) -> Table:
    """The quantities that short tables have, each as `mean ± SE`.

    Args:
        table: of `measured` or `grouped`.
        named: the columns that tell rows apart.
        caption: what it is.
    """
    wanted = [
        (quantity.header, shown)
        for quantity, shown in shown_quantities()
        if quantity.header in table.columns and table[quantity.header].notna().any()
    ]
    rows = []
    for row in table.to_dict("records"):
        cells = [word(row[name]) for name in named]
        for header, shown in wanted:
            error = row.get(marked(header, "SE"), math.nan)
            cells.append(told_number(shown.factor * row[header], shown.form, shown.factor * error))
        rows.append(cells)
    return Table(caption=caption, header=[*named, *(shown.heading for _, shown in wanted)], rows=rows)


def whole_table(table: pd.DataFrame, caption: str) -> Table:
    """All columns, folded."""
    rows = [[word(value) for value in row] for row in table.itertuples(index=False, name=None)]
    return Table(caption=caption, header=[str(name) for name in table.columns], rows=rows, folded=True)


def word(value: Any) -> str:
    """A value as a cell: four digits of a number, a dash for none."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
