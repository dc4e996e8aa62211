"""Points of studies: means over seeds with their errors as columns of a table, and as cells for a person to read."""

from __future__ import annotations

import math
from collections.abc import Iterable

import pandas as pd

from postprocess.statistics.columns import SEED, SEEDS
from postprocess.statistics.seeds import SeedMean, mean_over_seeds

ToldTable = tuple[list[str], list[list[str]]]
"""Header and rows of a table for a person to read."""


def marked(quantity: str, mark: str) -> str:
    """Name of a column that belongs to a quantity's: the mark stands before the unit."""
    name, _, unit = quantity.rpartition(" [")
    return f"{name} {mark} [{unit}"


def mean_columns(quantity: str, mean: SeedMean) -> dict[str, float]:
    """A mean over seeds as columns: `… SE` is the standard error, `… 95 %` the half-width by Student's t."""
    return {
        quantity: mean.value,
        marked(quantity, "SE"): mean.standard_error,
        marked(quantity, "95 %"): mean.half_width,
    }


def averaged(group: pd.DataFrame, quantities: Iterable[str]) -> dict[str, float]:
    """Means of columns over the seeds of a point, each as its `mean_columns`."""
    found: dict[str, float] = {}
    for quantity in quantities:
        found |= mean_columns(quantity, mean_over_seeds(group[quantity]))
    return found


def seeds_of(group: pd.DataFrame) -> dict[str, object]:
    """How many seeds a point has, and which, as columns."""
    return {SEEDS: len(group), "seeds": " ".join(map(str, sorted(group[SEED])))}


def told_number(value: float, form: str, error: float = math.nan) -> str:
    """`0.123 ± 0.004`: a number with its error, as far as there are any; the error never has a sign."""
    if math.isnan(value):
        return "-"
    return f"{value:{form}}" + (f" ± {error:{form.removeprefix('+')}}" if math.isfinite(error) else "")
