"""Compute tables over runs: means over the seeds of a point, and differences between paired runs.

The two runs of a pair differ in one factor alone. Their difference has no scatter from conditions that both runs share,
such as the initial poses. The difference of such differences is an interaction.

Source:
    Box, Hunter and Hunter, Statistics for Experimenters, 2nd ed. (Wiley 2005), chapter 5.
"""

import math
from collections.abc import Iterable, Sequence

import pandas as pd

from dem.strict import equal
from postprocess.statistics.seeds import SeedMean, mean_over_seeds

ASPECT, SEED, SEEDS = "aspect ratio [-]", "seed", "seeds [-]"
RUNS = "runs [-]"  #: Column with the number of runs over which a row is averaged


def marked(quantity: str, mark: str) -> str:
    """Return the name of a column with a mark before its unit: `phi [-]` and `SE` give `phi SE [-]`."""
    name, _, unit = quantity.rpartition(" [")
    return f"{name} {mark} [{unit}"


def counted(quantity: str) -> str:
    """Return the name of the column with the number of values in the mean of a quantity: `hook work n [-]`."""
    return f"{quantity.rpartition(' [')[0]} n [-]"


def mean_columns(quantity: str, mean: SeedMean) -> dict[str, float]:
    """Return the columns of a mean over seeds: `phi [-]`, `phi SE [-]` and the half-width `phi 95 % [-]`."""
    return {
        quantity: mean.value,
        marked(quantity, "SE"): mean.standard_error,
        marked(quantity, "95 %"): mean.half_width,
    }


def averaged(group: pd.DataFrame, quantities: Iterable[str]) -> dict[str, float]:
    """Average quantities over the rows of a table, one row per seed; return the columns of their means.

    `mean_columns` describes the columns.
    """
    found: dict[str, float] = {}
    for quantity in quantities:
        found |= mean_columns(quantity, mean_over_seeds(group[quantity]))
    return found


def together(table: pd.DataFrame, columns: Iterable[str]) -> pd.DataFrame:
    """Return a table in which numbers of columns that differ by rounding alone, see `equal`, are equal.

    Each becomes the one with the fewest digits: 0.3 instead of 0.30000000000000004.
    """
    found = {}
    for name in columns:
        if table[name].dtype.kind in "fO":
            groups: list[list[float]] = []
            for value in sorted({one for one in table[name] if isinstance(one, float) and math.isfinite(one)}):
                if groups and equal(value, groups[-1][-1]):
                    groups[-1].append(value)
                else:
                    groups.append([value])
            shortest = {value: min(group, key=lambda one: len(repr(one))) for group in groups for value in group}
            found[name] = table[name].map(lambda one, names=shortest: names.get(one, one))
    return table.assign(**found)


def means_by(table: pd.DataFrame, by: Sequence[str], *, intervals: bool = False) -> pd.DataFrame:
    """Average the rows of each group of a table, with standard errors from the scatter of the rows.

    Args:
        table: One row per run, or per run and phase; names of quantities end with their unit in brackets. Standard
            errors within a run ("… SE […]") are ignored.
        by: Columns whose values define the groups; numbers that differ by rounding alone are one value.
        intervals: Whether to add the half-widths "… 95 % […]" of confidence intervals.

    Returns:
        One row per group, in the order of its first row: the columns `by`, `RUNS`, then each quantity with its standard
        error "… SE […]", NaN for a single run. Values of NaN are left out of the means. A quantity with means of fewer
        rows than `RUNS` has a column "… n [-]" with the number of values, see `counted`.

    Example:
        >>> runs = pd.DataFrame({"friction": [0.2, 0.2, 0.4], "phi [-]": [0.1, 0.3, 0.5]})
        >>> means_by(runs, ["friction"]).round(3).values.tolist()
        [[0.2, 2.0, 0.2, 0.1], [0.4, 1.0, 0.5, nan]]
    """
    table = together(table, by)
    numbers = table.select_dtypes(["number", "bool"]).columns
    quantities = [name for name in numbers if name.endswith("]") and name not in (*by, ASPECT) and " SE [" not in name]
    groups, rows = table.groupby(list(by), sort=False, dropna=False), []
    some = groups[quantities].count()
    incomplete = some.columns[((some > 0) & some.lt(groups.size(), axis=0)).any()]
    for values, group in groups:
        row: dict[str, object] = {**dict(zip(by, values, strict=True)), RUNS: len(group)}
        for name in quantities:
            columns = mean_columns(name, mean_over_seeds(group[name]))
            if not intervals:
                del columns[marked(name, "95 %")]
            row |= columns
            if name in incomplete:
                row[counted(name)] = int(group[name].notna().sum())
        rows.append(row)
    return pd.DataFrame(rows)


def seeds_of(group: pd.DataFrame) -> dict[str, object]:
    """Return two columns of a table that describe the seeds of a group of runs.

    The column `SEEDS` has the number of seeds, the column "seeds" the seeds in ascending order as text.
    """
    return {SEEDS: len(group), "seeds": " ".join(map(str, sorted(group[SEED])))}


def format_with_error(value: float, form: str, error: float = math.nan) -> str:
    """Return `0.123 ± 0.004`: a value with its error, both in the format `form`.

    The error has no sign. A value that is NaN gives `-`, an error that is not finite is left out.
    """
    if math.isnan(value):
        return "-"
    return f"{value:{form}}" + (f" ± {error:{form.removeprefix('+')}}" if math.isfinite(error) else "")


def pairs(one: pd.DataFrame, other: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """Join a quantity of two tables of runs by aspect ratio and seed, as the columns `one` and `other`."""
    keys = [ASPECT, SEED]
    left = one[[*keys, quantity]].rename(columns={quantity: "one"})
    right = other[[*keys, quantity]].rename(columns={quantity: "other"})
    return left.merge(right, on=keys).dropna()


def mean_difference(one: pd.DataFrame, other: pd.DataFrame, quantity: str) -> SeedMean:
    """Average the difference of a quantity over pairs of runs, `one` less `other`; see `pairs`."""
    both = pairs(one, other, quantity)
    return mean_over_seeds(both["one"] - both["other"])


def paired_differences(
    table: pd.DataFrame, quantity: str, factor: str, levels: tuple[object, object], others: Sequence[str]
) -> pd.DataFrame:
    """Compute the change of a quantity between two levels of a factor, for each pair of runs.

    `others` are the seed and the columns of all other factors in which runs differ; the two runs of a pair agree in
    them. Returns one row per pair: the columns `others`, and the quantity at the second level less that at the first.
    Runs without a partner are left out. To get an interaction, apply the function to its result with another factor.

    Example:
        >>> runs = pd.DataFrame({"mu": [0.4, 0.8, 0.4, 0.8], "seed": [1, 1, 2, 2], "N": [5.0, 6.0, 5.5, 7.5]})
        >>> paired_differences(runs, "N", "mu", (0.4, 0.8), ["seed"])["N"].tolist()
        [1.0, 2.0]
    """
    table = together(table, others)
    parts = (table[[equal(value, level) for value in table[factor]]] for level in levels)
    first, second = (part.groupby(list(others))[quantity].mean().dropna() for part in parts)
    return (second - first).dropna().rename(quantity).reset_index()
