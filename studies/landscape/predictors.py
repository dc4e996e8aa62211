"""Which measure of a pile goes with its strength, and is the best one surely better than the others?

Rank correlations: no shape of the law is assumed. Runs of one l/w, procedure, θ and seed are one trajectory, cut off at
several times, and make one block: errors are by drawing trajectories of each l/w anew. A measure is compared with
others in the same draws, so that what both share does not count.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from postprocess.statistics.columns import ASPECT
from postprocess.statistics.ranks import (
    Floats,
    Interval,
    Whole,
    common_slopes,
    few_blocks,
    interval,
    rank_correlations,
    resampled,
)
from studies.framework.procedures import INTERNAL, PROCEDURE, STATIC
from studies.landscape.measure import HELD_FAST, PREDICTORS, STRENGTHS, trajectories

RESAMPLES, DRAW = 1000, 17
STRENGTH, SCOPE, PART, PREDICTOR = "strength", "scope", "runs", "measure"
COUNT, BLOCKS = "runs [-]", "trajectories [-]"
RHO, LOW, HIGH = "rank correlation [-]", "from [-]", "to [-]"
SLOPE, SLOPE_LOW, SLOPE_HIGH = "slope per SD [-]", "slope from [-]", "slope to [-]"
PER_UNIT, FIRST = "slope per unit of the measure", "first in resamples [-]"
BEST, OTHER, LEAD, VERDICT = "best", "other", "rank correlation of the best less the other's, in size [-]", "verdict"

ALL, WITHIN = "over all l/w", "within l/w"
EVERY, FREE, SWUNG = "all", "none held fast", "static and internal alone"
PARTS: Mapping[str, Callable[[pd.DataFrame], pd.DataFrame]] = MappingProxyType(
    {
        EVERY: lambda runs: runs,
        FREE: lambda runs: runs[runs[HELD_FAST] == 0],
        SWUNG: lambda runs: runs[runs[PROCEDURE].isin([STATIC, INTERNAL])],
    }
)
"""Of which runs the correlations are: all, those whose strength is no lower bound, and those of one procedure."""


def predicted(runs: pd.DataFrame, *, count: int = RESAMPLES) -> tuple[pd.DataFrame, pd.DataFrame]:
    """How each measure goes with each strength, and how the best one compares with each other.

    Args:
        runs: Rows of `measure.landscape_row`.
        count: Resamples.

    Returns:
        One row per strength, part of the runs, scope and measure, best first: rank correlation and slope with 95 %
        intervals; and one per other measure with the difference from the best.
    """
    each: list[dict[str, object]] = []
    against: list[dict[str, object]] = []
    for strength in STRENGTHS:
        for name, part in PARTS.items():
            chosen = part(runs)
            if name != EVERY and len(chosen) == len(runs):
                continue
            chosen = chosen[np.isfinite(chosen[[*PREDICTORS, strength]]).all(axis=1)]
            scopes = {ALL: chosen, WITHIN: chosen}
            if name == EVERY:
                scopes |= {f"l/w = {ratio:g}": group for ratio, group in chosen.groupby(ASPECT)}
            for scope, table in scopes.items():
                if len(table) < 4:
                    continue
                labels = {STRENGTH: strength, PART: name, SCOPE: scope}
                told, compared = _of(table, strength, within=scope != ALL, count=count)
                each += [{**labels, **row} for row in told]
                against += [{**labels, **row} for row in compared]
    return pd.DataFrame(each), pd.DataFrame(against)


def _of(
    table: pd.DataFrame, strength: str, *, within: bool, count: int
) -> tuple[list[dict[str, object]], list[dict[str, object]]]:
    """The rows of one part, scope and strength."""
    names = list(PREDICTORS)
    x, y = table[names].to_numpy(dtype=np.float64), table[strength].to_numpy(dtype=np.float64)
    strata = pd.factorize(table[ASPECT])[0].astype(np.int64)
    levels = strata if within else np.zeros_like(strata)
    blocks = trajectories(table).to_numpy(dtype=np.int64)

    def measures(rows: Whole) -> Floats:
        at = x[rows], y[rows], levels[rows]
        return np.concatenate([rank_correlations(*at), common_slopes(*at)])

    found = measures(np.arange(len(table)))
    drawn = resampled(measures, blocks, strata, count=count, seed=DRAW)
    if few_blocks(blocks, strata):
        drawn[:] = np.nan
    rho, slopes = found[: len(names)], found[len(names) :]
    sizes = drawn[:, : len(names)] * np.sign(rho)
    # Of columns that are the same throughout there is no correlation, and none is first.
    order = [int(k) for k in np.argsort(-np.abs(np.where(np.isfinite(rho), rho, 0)), kind="stable")]
    first = np.bincount(np.nanargmax(np.where(np.isfinite(sizes), sizes, -np.inf), axis=1), minlength=len(names))
    unknown = ~np.isfinite(sizes).any()
    spread = _spread(x, levels)
    told = []
    for k in order:
        ends = interval(float(rho[k]), drawn[:, k].tolist())
        tilt = interval(float(slopes[k]), drawn[:, len(names) + k].tolist())
        told.append(
            {
                PREDICTOR: names[k],
                COUNT: len(table),
                BLOCKS: len(np.unique(blocks)),
                RHO: ends.value,
                LOW: ends.low,
                HIGH: ends.high,
                PER_UNIT: tilt.value,
                SLOPE: tilt.value * spread[k],
                SLOPE_LOW: tilt.low * spread[k],
                SLOPE_HIGH: tilt.high * spread[k],
                FIRST: np.nan if unknown else first[k] / count,
            }
        )
    best = order[0]
    compared = []
    for k in order[1:]:
        lead = interval(abs(float(rho[best])) - abs(float(rho[k])), (sizes[:, best] - sizes[:, k]).tolist())
        row = {BEST: names[best], OTHER: names[k], LEAD: lead.value, LOW: lead.low, HIGH: lead.high}
        compared.append({**row, VERDICT: verdict(lead)})
    return told, compared


def verdict(lead: Interval) -> str:
    """Whether the best measure is surely better than another."""
    if np.isnan(lead.value):
        return "no data"
    return "better" if lead.low > 0 else "not resolved"


def _spread(x: Floats, levels: Whole) -> Floats:
    """(m,) standard deviation of each column about the means of its levels."""
    frame = pd.DataFrame(x)
    centred = frame - frame.groupby(levels).transform("mean")
    spread: Floats = centred.to_numpy(dtype=np.float64).std(axis=0)
    return spread
