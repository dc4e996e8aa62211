"""Does the force that tears a pile go with its entanglement? One criterion for all studies that pull at piles.

A pile that holds fast has a peak of at least what it took, and one that a single smarticle braces for a moment has one
many times that of its like. Neither has a place on a straight line, but each has its rank among the piles of its seed.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence

import numpy as np
import pandas as pd

from postprocess.statistics.findings import Verdict, judge, told
from postprocess.statistics.ranks import correlation_within
from postprocess.statistics.seeds import slope_within

BY_RANKS = "mean over seeds of the rank correlation of peak force and ⟨N⟩ > 0; what held fast is above all that did not"


def goes_with(
    crossings: pd.Series, peaks: pd.Series, held: pd.Series, blocks: Sequence[Hashable]
) -> tuple[str, Verdict]:
    """Whether peaks go with ⟨N⟩ within blocks, by ranks, and the slope beside it.

    Args:
        crossings: ⟨N⟩ of each run [-].
        peaks: Its peak force, in any unit: at least, where it held fast.
        held: Above 0 where it held fast.
        blocks: What begins with one pile.
    """
    found = correlation_within(crossings.tolist(), np.where(held > 0, math.inf, peaks).tolist(), blocks)
    slope = slope_within(crossings.tolist(), peaks.tolist(), blocks)
    number = int((held > 0).sum())
    bounds = f", {number} of the peaks lower bounds" if number else ""
    ours = f"rank correlation {told(found, 2)}; slope, not judged, {told(slope, 3, ' n W_s per link')}{bounds}"
    return ours, judge(found)
