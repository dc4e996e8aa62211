"""Compare runs pair by pair: those of one aspect ratio and seed were poured alike."""

from __future__ import annotations

import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.seeds import SeedMean, mean_over_seeds


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
