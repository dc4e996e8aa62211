"""Runs of one aspect ratio and seed were poured alike: what was done to them is compared pair by pair."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Verdict, all_of, judge, negative, told
from postprocess.statistics.seeds import SeedMean, mean_over_seeds


def pairs(one: pd.DataFrame, other: pd.DataFrame, quantity: str) -> pd.DataFrame:
    """Values of two parts of a table of runs for the same aspect ratio and seed: columns `one` and `other`."""
    keys = [ASPECT, SEED]
    left = one[[*keys, quantity]].rename(columns={quantity: "one"})
    right = other[[*keys, quantity]].rename(columns={quantity: "other"})
    return left.merge(right, on=keys).dropna()


def mean_difference(one: pd.DataFrame, other: pd.DataFrame, quantity: str) -> SeedMean:
    """One part less the other, mean over pairs."""
    both = pairs(one, other, quantity)
    return mean_over_seeds(both["one"] - both["other"])


def told_less(differences: Mapping[str, SeedMean], between: str) -> str:
    """`less static +0.1 ± 0.02 (n = 3), …`: how something compares with each of others, by their names."""
    return between.join(f"less {name} {told(effect, 3)}" for name, effect in differences.items())


def compared(differences: Mapping[str, SeedMean], sign: int) -> tuple[str, Verdict]:
    """Whether something is above (sign 1) or below (−1) each of others: numbers and verdict.

    Args:
        differences: It less each of the others, by their names.
        sign: 1 or −1.
    """
    verdicts = [judge(effect if sign > 0 else negative(effect)) for effect in differences.values()]
    return told_less(differences, "; "), all_of(verdicts)
