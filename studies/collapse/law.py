"""From collapse times to Δ: the law τ = (1/f) exp(Δ/Γ), its activation at each aspect ratio, and whether it holds.

What has not collapsed by the end of its run gives a bound, and is never left out: an acceleration Γ at which a run gave
a bound is not used for Δ of its aspect ratio, since the others alone are the quick ones and would make it too small.
The mean there, with bounds for times, is a bound in its turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.points import marked, mean_columns, ordered
from postprocess.statistics.seeds import SeedMean, Slope, mean_over_seeds, slope_within
from studies.base.collapse.column import DEFINITIONS
from studies.collapse.measure import DEFINITION, DELTA, GAMMA, LOG, is_seen
from studies.collapse.reference import reference_delta

ACTIVATION = "Delta [-]"
ERROR, HALF_WIDTH, LOG_HALF_WIDTH = marked(ACTIVATION, "SE"), marked(ACTIVATION, "95 %"), marked(LOG, "95 %")
AT_LEAST, CENSORED, USED = "Delta at least [-]", "runs with a bound [-]", "Gamma used [g]"
REFERENCE, DEVIATION, DEVIATION_HALF_WIDTH = "Delta Gravish [-]", "deviation [%]", "deviation 95 % [%]"


def levels(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per definition, aspect ratio and Γ: mean of ln(fτ) over seeds, with its error.

    Args:
        rows: Of runs and definitions, see `measure.collapse_rows`.

    Returns:
        The table. Where a run gave a bound, the mean with it is a bound too, and has no error.
    """
    found = []
    for (definition, aspect, gamma), group in rows.groupby([DEFINITION, ASPECT, GAMMA], sort=False):
        seen, mean = is_seen(group), mean_over_seeds(group[LOG])
        whole = bool(seen.all())
        found.append(
            {
                DEFINITION: definition,
                ASPECT: aspect,
                GAMMA: gamma,
                SEEDS: len(group),
                CENSORED: int((~seen).sum()),
                **mean_columns(LOG, mean if whole else _without_error(mean)),
                DELTA: gamma * mean.value,
            }
        )
    return _sorted(pd.DataFrame(found), [ASPECT, GAMMA])


def activations(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per definition and aspect ratio: Δ, the slope of ln(fτ) against 1/Γ through the origin.

    The slope is taken seed by seed over the accelerations at which every run collapsed; its mean over seeds has the
    error. A seed that lacks a run at one of them does not count, since it would have another slope where the law does
    not hold. Where there is no such acceleration Δ is empty, and there is only what it is at least.

    Args:
        rows: See `levels`.
    """
    found = []
    every = levels(rows)
    for (definition, aspect), group in rows.groupby([DEFINITION, ASPECT], sort=False):
        own = every[(every[DEFINITION] == definition) & (every[ASPECT] == aspect)]
        used = own.loc[own[CENSORED] == 0, GAMMA].tolist()
        seeds = [one for _, one in group[group[GAMMA].isin(used)].groupby(SEED) if len(one) == len(used)]
        mean = mean_over_seeds([slope_through_origin(1 / one[GAMMA], one[LOG]) for one in seeds])
        bounds = own.loc[own[CENSORED] > 0, DELTA]
        gravish = reference_delta(float(aspect))
        found.append(
            {
                DEFINITION: definition,
                ASPECT: aspect,
                SEEDS: len(seeds),
                **mean_columns(ACTIVATION, mean),
                AT_LEAST: bounds.max() if len(bounds) else math.nan,
                CENSORED: int(own[CENSORED].sum()),
                USED: " ".join(f"{gamma:g}" for gamma in used),
                REFERENCE: gravish,
                DEVIATION: 100 * (mean.value / gravish - 1),
                DEVIATION_HALF_WIDTH: 100 * mean.half_width / gravish,
            }
        )
    return _sorted(pd.DataFrame(found), [ASPECT])


def _without_error(mean: SeedMean) -> SeedMean:
    return replace(mean, standard_error=math.nan, half_width=math.nan)


def _sorted(table: pd.DataFrame, columns: Sequence[str]) -> pd.DataFrame:
    return ordered(table, [DEFINITION, *columns], named=DEFINITION, order=DEFINITIONS)


def slope_through_origin(x: Sequence[float], y: Sequence[float]) -> float:
    """Least-squares slope of y against x of a straight line through the origin."""
    across, up = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return float(across @ up / (across @ across))


@dataclass(frozen=True, kw_only=True)
class LawCheck:
    """Whether the law holds over the accelerations that were run, by one definition.

    Attributes:
        rise: Slope of ln(fτ) against 1/Γ, free of the origin [-].
        change: Of Γ ln(fτ), from the least Γ to the greatest, over its mean [-]; 0 by the law.
    """

    rise: Slope
    change: Slope


def check_law(rows: pd.DataFrame, definition: str) -> LawCheck:
    """The law against all runs whose Γ is used for Δ, each aspect ratio and seed with a level of its own.

    Args:
        rows: See `levels`.
        definition: Of the height.
    """
    own = rows[rows[DEFINITION] == definition]
    censored = own.assign(seen=is_seen(own)).groupby([ASPECT, GAMMA])["seen"].transform("all")
    used = own[censored]
    blocks = list(zip(used[ASPECT], used[SEED], strict=True))
    # Each aspect ratio weighs the same, whatever its Δ.
    means = used.groupby(ASPECT)[DELTA].transform("mean")
    span = float(np.ptp(used[GAMMA])) if len(used) else math.nan
    return LawCheck(
        rise=slope_within(list(1 / used[GAMMA]), list(used[LOG]), blocks),
        change=slope_within(list(used[GAMMA] / span), list(used[DELTA] / means), blocks)
        if span > 0
        else slope_within([], [], []),
    )


def activation_of(table: pd.DataFrame, definition: str, aspect: float) -> SeedMean:
    """Δ of one aspect ratio, as a mean over seeds; NaN where there is none.

    Args:
        table: See `activations`.
        definition: Of the height.
        aspect: l/w [-].
    """
    row = table[(table[DEFINITION] == definition) & (table[ASPECT] == aspect)].iloc[0]
    return SeedMean(
        value=float(row[ACTIVATION]),
        standard_error=float(row[ERROR]),
        half_width=float(row[HALF_WIDTH]),
        count=int(row[SEEDS]),
    )
