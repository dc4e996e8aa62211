"""Factorial designs: what one factor does where all else is alike.

A difference is taken between two runs that differ in the factor alone, so that what they share, such as the poses that
they were poured from, does not count as scatter. The difference of such differences is an interaction.

Source:
    Box, Hunter and Hunter, Statistics for Experimenters, 2nd ed. (Wiley 2005), chapter 5.
"""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd


def paired_differences(
    table: pd.DataFrame, quantity: str, factor: str, levels: tuple[object, object], others: Sequence[str]
) -> pd.DataFrame:
    """Return what a quantity does when a factor goes from one level to another, all else alike.

    Args:
        table: One row per run.
        quantity: Column.
        factor: Column.
        levels: From, and to.
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
