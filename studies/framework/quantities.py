"""Columns of the tables of studies, each declared once: name, label, format and meaning."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import pandas as pd

from postprocess.statistics.points import ToldTable, marked, told_number


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A column that is measured, averaged over seeds and shown.

    Attributes:
        column: Name in tables, with its unit.
        meaning: What it is, for readers of the table.
        label: Header in the short table; empty: only in the CSV files.
        form: Format of a number there.
        scale: Factor of the numbers shown, such as 1e3 for millimetres.
        axis: Label of an axis of a figure; by default the column's name.
        axis_scale: Factor of the numbers in figures.
        bar: Which error of the points stands behind a number: `SE` or `95 %`.
    """

    column: str
    meaning: str
    label: str = ""
    form: str = ".3g"
    scale: float = 1.0
    axis: str = ""
    axis_scale: float = 1.0
    bar: str = "SE"

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
            axis_scale=scales.get(column, 1.0),
        )
        for column, (label, form, meaning) in rows.items()
    }


@dataclass(frozen=True, kw_only=True)
class Key:
    """A column that names a point: one combination of a sweep's variables.

    Attributes:
        column: Name in tables.
        label: Header in the short table, and in statements about the runs.
        form: Format; empty for words.
        unit: Behind the number in the short table.
        scale: Factor of the number shown.
        order: Order of the values, where it is not their own.
    """

    column: str
    label: str
    form: str = ""
    unit: str = ""
    scale: float = 1.0
    order: Sequence[str] = ()

    def text(self, value: object) -> str:
        """Format a value; empty where a point has none, such as θ of a pile at rest."""
        if not isinstance(value, int | float):
            return str(value)
        return "" if math.isnan(value) else f"{self.scale * value:{self.form}}{self.unit}"

    def cell(self, point: Mapping[str, object]) -> str:
        """Format the value of a point."""
        return self.text(point[self.column])


def sort_rows(table: pd.DataFrame, columns: Sequence[str], keys: Sequence[Key]) -> pd.DataFrame:
    """Sort rows by columns; a key with an order of its own is sorted by that."""
    ranks = {key.column: {name: rank for rank, name in enumerate(key.order)} for key in keys if key.order}
    return table.sort_values(
        list(columns),
        key=lambda column: column.map(ranks[column.name]) if column.name in ranks else column,
        ignore_index=True,
        kind="stable",
    )


def cells_of(keys: Sequence[Key]) -> Mapping[str, Callable[[pd.Series], str]]:
    """Header and cell of each key, for tables."""
    return {key.label: key.cell for key in keys}


def short_table(
    points: pd.DataFrame, named: Mapping[str, Callable[[pd.Series], str]], quantities: Sequence[Quantity]
) -> ToldTable:
    """Means with their standard errors for a person to read; quantities without a label are left out."""
    shown = [quantity for quantity in quantities if quantity.label]
    rows = [
        [*(cell(point) for cell in named.values()), *(quantity.cell(point) for quantity in shown)]
        for _, point in points.iterrows()
    ]
    return [*named, *(quantity.label for quantity in shown)], rows
