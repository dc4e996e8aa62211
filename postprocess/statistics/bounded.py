"""What can be said of a quantity of which some values are lower bounds, or many times their like.

Such as the force that tears a pile with its entanglement: a pile that holds fast has a peak of at least what it took,
and one that a single smarticle braces for a moment has one many times that of its like. Neither has a place on a
straight line, but each has its rank among the piles of its seed.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence

import numpy as np
import pandas as pd

from postprocess.statistics.findings import Effect, Verdict, judge, told
from postprocess.statistics.ranks import correlation_within
from postprocess.statistics.seeds import slope_within


def above(effect: Effect, *, upper: bool, lower: bool) -> Verdict:
    """Whether one thing is clearly above another, where values of either may be lower bounds.

    Args:
        effect: The one less the other.
        upper: Whether values of the one are lower bounds: it may be higher still, so that it is never below.
        lower: The same of the other.
    """
    verdict = judge(effect)
    if (verdict == "found" and lower) or (verdict == "not found" and upper):
        return "not resolved"
    return verdict


def goes_with(
    x: pd.Series, y: pd.Series, bounds: pd.Series, blocks: Sequence[Hashable], *, unit: str, called: str
) -> tuple[str, Verdict]:
    """Whether y goes with x within blocks, by ranks, and the slope beside it.

    Args:
        x: (n,).
        y: (n,): at least, where it is a bound.
        bounds: (n,) above 0 where y is a lower bound, which ranks above all that are none.
        blocks: What begins alike, such as with one pile.
        unit: That of the slope.
        called: What values of y are called, such as `peaks`.

    Returns:
        The rank correlation, mean over blocks, with the slope; and whether it is above 0.
    """
    found = correlation_within(x.tolist(), np.where(bounds > 0, math.inf, y).tolist(), blocks)
    slope = slope_within(x.tolist(), y.tolist(), blocks)
    number = int((bounds > 0).sum())
    lower = f", {number} of the {called} lower bounds" if number else ""
    ours = f"rank correlation {told(found, 2)}; slope, not judged, {told(slope, 3, f' {unit}')}{lower}"
    return ours, judge(found)
