"""Tables of studies: columns that are declared once, and the rows of several engines."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.points import marked, told_number
from postprocess.statistics.seeds import mean_over_seeds

ENGINE = "engine"
"""Column of tables of runs of several engines."""

ENGINE_NAMES: Mapping[str, str] = MappingProxyType({"links": "links", "yade": "YADE"})
"""Engines in the order of tables and figures, the one that judges first, with their names in text."""

DEFINITION = "second-highest-com"
"""Definition of the packing fraction that is compared with Gravish's."""

PAIRS = "pairs [-]"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A column that is measured, averaged over seeds and shown.

    Attributes:
        column: Name in tables, with its unit.
        meaning: What it is, for readers of the table.
        label: Header in the short table; empty: only in the CSV files.
        form: Format of a number there.
        scale: Factor of the numbers in the short table and in figures, such as 1e3 for millimetres.
        axis: Label of an axis of a figure; by default the column's name.
        bar: Which error of the points stands behind a number: `SE` or `95 %`.
    """

    column: str
    meaning: str = ""
    label: str = ""
    form: str = ".3g"
    scale: float = 1.0
    axis: str = ""
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


ASPECT_KEY = Key(column=ASPECT, label="l/w", form="g")
THETA_KEY = Key(column="theta [deg]", label="θ", form="g", unit="°")


def sort_rows(table: pd.DataFrame, columns: Sequence[str], keys: Sequence[Key]) -> pd.DataFrame:
    """Sort rows by columns; a key with an order of its own is sorted by that."""
    ranks = {key.column: {name: rank for rank, name in enumerate(key.order)} for key in keys if key.order}
    return table.sort_values(
        list(columns),
        key=lambda column: column.map(ranks[column.name]) if column.name in ranks else column,
        ignore_index=True,
        kind="stable",
    )


def engines_of(table: pd.DataFrame) -> tuple[str, ...]:
    """List the engines of a table of runs, the one that judges first; none where the table has one engine."""
    if ENGINE not in table.columns:
        return ()
    order = list(ENGINE_NAMES)
    return tuple(
        sorted(set(table[ENGINE]), key=lambda name: (order.index(name) if name in order else len(order), name))
    )


def of_engine(table: pd.DataFrame, engine: str) -> pd.DataFrame:
    """Select the rows of one engine, without the column `engine`."""
    return table[table[ENGINE] == engine].drop(columns=ENGINE)


def judging(table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of the engine that judges: all where there is one engine."""
    several = engines_of(table)
    return of_engine(table, several[0]) if several else table


def by_engine(table: pd.DataFrame, made: Callable[[pd.DataFrame], pd.DataFrame]) -> pd.DataFrame:
    """Make a table of the rows of each engine, one below the other; the column `engine` first, if there are several."""
    several = engines_of(table)
    if not several:
        return made(table)
    parts = pd.concat({engine: made(of_engine(table, engine)) for engine in several}, names=[ENGINE])
    return parts.reset_index(ENGINE).reset_index(drop=True)


def compared_engines(runs: pd.DataFrame, keys: Sequence[str], quantities: Iterable[str]) -> pd.DataFrame:
    """Subtract the engines from each other, point by point, paired by seed.

    Runs of the same point and seed were poured from the same poses on both engines. Granular piles are chaotic: a pair
    shares its poses, and soon nothing else, so pairing narrows little.

    Returns:
        One row per point, engine other than the judging one, and quantity: both means over the pairs, their
        difference, its 95 % half-width by Student's t, and both in per cent of the other engine's mean.
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
