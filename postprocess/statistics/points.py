"""Tables over runs: means of runs that are alike, and differences between runs that were poured alike.

A difference is taken between two runs that differ in one factor alone, so that what they share, such as the poses that
they were poured from, does not count as scatter. The difference of such differences is an interaction.

Source:
    Box, Hunter and Hunter, Statistics for Experimenters, 2nd ed. (Wiley 2005), chapter 5.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import pandas as pd

from postprocess.statistics.seeds import SeedMean, mean_over_seeds

ASPECT, SEED, SEEDS = "aspect ratio [-]", "seed", "seeds [-]"


RUNS = "runs [-]"  #: Column with the number of runs that a row is the mean of


def marked(quantity: str, mark: str) -> str:
    """Name a column that belongs to a quantity's: the mark stands before the unit."""
    name, _, unit = quantity.rpartition(" [")
    return f"{name} {mark} [{unit}"


def mean_columns(quantity: str, mean: SeedMean) -> dict[str, float]:
    """Return a mean over seeds as columns, `… SE` the standard error, `… 95 %` the half-width."""
    return {
        quantity: mean.value,
        marked(quantity, "SE"): mean.standard_error,
        marked(quantity, "95 %"): mean.half_width,
    }


def averaged(group: pd.DataFrame, quantities: Iterable[str]) -> dict[str, float]:
    """Average columns over the seeds of a point, each as its `mean_columns`."""
    found: dict[str, float] = {}
    for quantity in quantities:
        found |= mean_columns(quantity, mean_over_seeds(group[quantity]))
    return found


def means_by(table: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """Average the rows of each group, with standard errors from row to row.

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
    numbers = table.select_dtypes(["number", "bool"]).columns
    quantities = [name for name in numbers if name.endswith("]") and name not in (*by, ASPECT) and " SE [" not in name]
    rows = []
    for values, group in table.groupby(list(by), sort=False, dropna=False):
        row: dict[str, object] = {**dict(zip(by, values, strict=True)), RUNS: len(group)}
        for name in quantities:
            mean = mean_over_seeds(group[name])
            row |= {name: mean.value, marked(name, "SE"): mean.standard_error}
        rows.append(row)
    return pd.DataFrame(rows)


def seeds_of(group: pd.DataFrame) -> dict[str, object]:
    """Return the number of a point's seeds, and the seeds, as columns."""
    return {SEEDS: len(group), "seeds": " ".join(map(str, sorted(group[SEED])))}


def format_with_error(value: float, form: str, error: float = math.nan) -> str:
    """Return `0.123 ± 0.004`: a value with its error, both in the format `form`.

    The error has no sign. A value that is NaN gives `-`, an error that is not finite is left out.
    """
    if math.isnan(value):
        return "-"
    return f"{value:{form}}" + (f" ± {error:{form.removeprefix('+')}}" if math.isfinite(error) else "")


def pairs(one: pd.DataFrame, other: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """Join a quantity of two tables of runs by aspect ratio and seed: columns `one` and `other`."""
    keys = [ASPECT, SEED]
    left = one[[*keys, quantity]].rename(columns={quantity: "one"})
    right = other[[*keys, quantity]].rename(columns={quantity: "other"})
    return left.merge(right, on=keys).dropna()


def mean_difference(one: pd.DataFrame, other: pd.DataFrame, quantity: str) -> SeedMean:
    """Average one table less the other over pairs."""
    both = pairs(one, other, quantity)
    return mean_over_seeds(both["one"] - both["other"])


def paired_differences(
    table: pd.DataFrame, quantity: str, factor: str, levels: tuple[object, object], others: Sequence[str]
) -> pd.DataFrame:
    """Return what a quantity does when a factor goes from one level to another, all else alike.

    Args:
        others: Columns of all else that runs differ in, such as the other factors and the seed.

    Returns:
        One row per pair: `others`, and the difference in the quantity's column, in its unit. What lacks a run at
        either level is left out. Given to this function again with another factor: interactions.

    Example:
        >>> runs = pd.DataFrame({"mu": [0.4, 0.8, 0.4, 0.8], "seed": [1, 1, 2, 2], "N": [5.0, 6.0, 5.5, 7.5]})
        >>> paired_differences(runs, "N", "mu", (0.4, 0.8), ["seed"])["N"].tolist()
        [1.0, 2.0]
    """
    first, second = (table[table[factor] == level].groupby(list(others))[quantity].mean().dropna() for level in levels)
    return (second - first).dropna().rename(quantity).reset_index()
