"""Studies whose runs were computed by several engines: one of them judges, the others are set beside it.

Runs of the same point and seed were poured from the same poses on both engines, so they are compared pair by pair.
Granular piles are chaotic: a pair shares its poses, and soon nothing else, so pairing narrows little.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType

import pandas as pd

from postprocess.report.tables import table_lines
from postprocess.statistics.points import SEED, told_number
from postprocess.statistics.seeds import SeedMean, mean_over_seeds
from studies.framework.runs import ENGINE, ENGINES

TOLD: Mapping[str, str] = MappingProxyType({"links": "links", "yade": "YADE"})
"""What an engine is called in figures and text."""

PAIRS = "pairs [-]"


def engines_of(table: pd.DataFrame) -> tuple[str, ...]:
    """The engines of a table of runs, the one that judges first; none where the table does not tell."""
    if ENGINE not in table.columns:
        return ()
    present = set(table[ENGINE])
    return tuple(name for name in ENGINES if name in present) + tuple(sorted(present - set(ENGINES)))


def judging(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of the engine that judges: all where there is one engine."""
    several = engines_of(table)
    return of_engine(table, several[0]) if several else table


def of_engine(table: pd.DataFrame, engine: str) -> pd.DataFrame:
    """The rows of one engine, without saying so."""
    return table[table[ENGINE] == engine].drop(columns=ENGINE)


def by_engine(table: pd.DataFrame, made: Callable[[pd.DataFrame], pd.DataFrame]) -> pd.DataFrame:
    """What is made of the rows of each engine, one below the other; the column `engine` first, if there are several."""
    several = engines_of(table)
    if not several:
        return made(table)
    parts = {engine: made(of_engine(table, engine)) for engine in several}
    return pd.concat([_named(part, engine) for engine, part in parts.items()], ignore_index=True)


def _named(part: pd.DataFrame, engine: str) -> pd.DataFrame:
    named = part.copy()
    named.insert(0, ENGINE, engine)
    return named


def told_engines(runs: pd.DataFrame) -> str:
    """`Engines: links 64 runs, yade 9 runs; …`: for footers, where there are several; else nothing."""
    several = engines_of(runs)
    if not several:
        return ""
    counts = ", ".join(f"{TOLD.get(name, name)} {(runs[ENGINE] == name).sum()} runs" for name in several)
    return f"Engines: {counts}, from the same poses where point and seed are the same; {TOLD[several[0]]} judges."


def compared_engines(
    runs: pd.DataFrame, keys: Sequence[str], quantities: Iterable[str], *, alike: Sequence[str] = ()
) -> pd.DataFrame:
    """Differences between the engines, point by point, paired by seed.

    Args:
        runs: Table of runs of several engines.
        keys: Columns that make a point.
        quantities: Columns that are compared.
        alike: Columns that must be equal in a pair as well, such as how long it was shaken; pairs that differ in one
            are left out.

    Returns:
        One row per point, engine other than the judging one, and quantity: both means over the pairs, their
        difference, its 95 % half-width by Student's t, and both in per cent of the other engine's mean. It has its
        columns even without rows.
    """
    columns = [*keys, "quantity", "engine", "other engine", PAIRS, "mean", "other mean"]
    columns += ["difference", "difference 95 %", "difference [%]", "difference 95 % [%]"]
    rows: list[dict[str, object]] = []
    several = engines_of(runs)
    for other in several[1:]:
        both = pairs_of_engines(runs, keys, several[0], other)
        for name in alike:
            both = both[(both[f"{name} one"] - both[f"{name} other"]).abs() < 1e-6]
        for point, group in both.groupby(list(keys), dropna=False):
            for quantity in quantities:
                one, another = group[f"{quantity} one"], group[f"{quantity} other"]
                known = one.notna() & another.notna()
                effect = mean_over_seeds(one[known] - another[known])
                if not effect.count:
                    continue
                base = float(another[known].mean())
                rows.append(
                    {
                        **dict(zip(keys, point, strict=True)),
                        "quantity": quantity,
                        "engine": several[0],
                        "other engine": other,
                        PAIRS: effect.count,
                        "mean": float(one[known].mean()),
                        "other mean": base,
                        **_differences(effect, base),
                    }
                )
    return pd.DataFrame(rows, columns=columns)


def pairs_of_engines(runs: pd.DataFrame, keys: Sequence[str], one: str, other: str) -> pd.DataFrame:
    """Rows of runs of the same point and seed on two engines; columns get `one` or `other` behind their names."""
    names = [*keys, SEED]
    return of_engine(runs, one).merge(of_engine(runs, other), on=names, suffixes=(" one", " other"))


def _differences(effect: SeedMean, base: float) -> dict[str, float]:
    scale = 100 / abs(base) if base else math.nan
    return {
        "difference": effect.value,
        "difference 95 %": effect.half_width,
        "difference [%]": scale * effect.value,
        "difference 95 % [%]": scale * effect.half_width,
    }


def told_by_engine(
    points: pd.DataFrame, named: Mapping[str, Callable[[pd.Series], str]]
) -> Mapping[str, Callable[[pd.Series], str]]:
    """What tells a point from others, the engine first where there are several; see `points.told_means`."""
    if not engines_of(points):
        return named
    return {"engine": lambda point: str(point[ENGINE]), **named}


def engine_lines(table: pd.DataFrame | None, named: Mapping[str, Callable[[pd.Series], str]]) -> list[str]:
    """The part of a text that compares engines; nothing without several.

    Args:
        table: See `compared_engines`.
        named: What tells a point from others: header and cell.
    """
    if table is None:
        return []
    rows = [
        [
            *(cell(row) for cell in named.values()),
            str(row["quantity"]),
            str(row[PAIRS]),
            f"{row['mean']:.4g}",
            f"{row['other mean']:.4g}",
            f"{told_number(row['difference [%]'], '+.1f', row['difference 95 % [%]'])} %",
        ]
        for _, row in table.iterrows()
    ]
    header = [*named, "quantity", "pairs of seeds", "links", "YADE", "difference ± 95 %"]
    return ["", "## Engines", "", "The same seeds on both engines.", "", *table_lines(header, rows)]
