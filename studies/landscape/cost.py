"""What strength costs: how much a procedure adds to that of a poured pile, and the energy that it spends on it.

Each run is compared with the poured pile of its l/w and seed, which it began with. Ratios are those of means over such
pairs, their errors by drawing pairs anew. Energies are over W_s w, the work that lifts a smarticle by its width, so
that heavier smarticles do not count as dearer.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.points import mean_columns
from postprocess.statistics.ranks import Interval, interval, resampled
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.procedures import PROCEDURE, STATIC, THETA
from studies.landscape.measure import ENERGY, LIFTS, PEAK, PLANNED
from studies.landscape.predictors import DRAW, RESAMPLES, SCOPE

PAIRS = "pairs [-]"
GAIN = "strength gained over n W_s [-]"
YIELD, LOW, HIGH = "strength gained per energy over W_s w [-]", "from [-]", "to [-]"
FRONTIER = "nothing gains as much for less [-]"
COMMON = "l/w where all was run"

_POINT = [PROCEDURE, THETA, PLANNED]


def gains(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs that were active, with what they gained over the poured pile of the same l/w and seed."""
    poured = runs[runs[PROCEDURE] == STATIC].groupby([ASPECT, SEED])[PEAK].mean().rename("poured")
    active = runs[runs[PROCEDURE] != STATIC].join(poured, on=[ASPECT, SEED], how="inner").reset_index(drop=True)
    return active.assign(**{GAIN: active[PEAK] - active["poured"]}).drop(columns="poured")


def common_aspects(runs: pd.DataFrame) -> list[float]:
    """The aspect ratios at which every procedure, θ and planned time of any of them was run.

    Where no aspect ratio has all, those that have most.
    """
    has = runs.groupby(ASPECT).apply(lambda part: set(map(_named, part[_POINT].to_numpy().tolist())))
    most = max((len(one) for one in has), default=0)
    return sorted(float(ratio) for ratio, one in has.items() if len(one) == most)


def _named(point: list[object]) -> tuple[object, ...]:
    """A point that is equal to itself where it has no θ."""
    return tuple(None if isinstance(value, float) and math.isnan(value) else value for value in point)


def costs(runs: pd.DataFrame, *, count: int = RESAMPLES) -> pd.DataFrame:
    """One row per procedure, θ and planned time, over the common l/w together and at each l/w.

    Args:
        runs: Rows of `measure.landscape_row`.
        count: Resamples.

    Returns:
        Means of gain and energy over pairs with their errors, the gain per energy with its 95 % interval, and whether
        no other point of the scope gains as much for less energy.
    """
    gained = gains(runs)
    scopes = {COMMON: gained[gained[ASPECT].isin(common_aspects(runs))]}
    scopes |= {f"l/w = {ratio:g}": part for ratio, part in gained.groupby(ASPECT)}
    tables = []
    for scope, part in scopes.items():
        rows = [
            {SCOPE: scope, **dict(zip(_POINT, point, strict=True)), **_of(group, count)}
            for point, group in part.groupby(_POINT, dropna=False)
        ]
        table = pd.DataFrame(rows)
        if len(table):
            tables.append(table.assign(**{FRONTIER: _frontier(table)}))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def _of(group: pd.DataFrame, count: int) -> dict[str, object]:
    ratio = gain_per_energy(group, count=count)
    return {
        PAIRS: len(group),
        **mean_columns(GAIN, mean_over_seeds(group[GAIN])),
        **mean_columns(ENERGY, mean_over_seeds(group[ENERGY])),
        **mean_columns(LIFTS, mean_over_seeds(group[LIFTS])),
        YIELD: ratio.value,
        LOW: ratio.low,
        HIGH: ratio.high,
    }


def gain_per_energy(group: pd.DataFrame, *, count: int = RESAMPLES) -> Interval:
    """Mean gain over mean energy of pairs, with its 95 % interval; NaN ends below three pairs."""
    values = group[[GAIN, LIFTS]].to_numpy(dtype=np.float64)
    value = _ratio(values)
    if len(values) < 3:
        return Interval(value=value, low=math.nan, high=math.nan)
    blocks, strata = np.arange(len(values)), np.zeros(len(values), dtype=np.int64)
    drawn = resampled(lambda rows: np.array([_ratio(values[rows])]), blocks, strata, count=count, seed=DRAW)
    return interval(value, drawn[:, 0].tolist())


def _ratio(values: np.ndarray) -> float:
    gain, energy = values.mean(axis=0)
    return float(gain / energy) if energy > 0 else math.nan


def _frontier(table: pd.DataFrame) -> list[float]:
    """1 for points that no other one of the table is both as strong and cheaper than, 0 for the others."""
    found = []
    for _, row in table.iterrows():
        cheaper = table[LIFTS] < row[LIFTS]
        found.append(float(row[GAIN] > 0 and not (table[cheaper][GAIN] >= row[GAIN]).any()))
    return found


def best_points(table: pd.DataFrame) -> pd.DataFrame:
    """Of each procedure the point of the common l/w that gains most per energy, among those that surely gain.

    Args:
        table: See `costs`.
    """
    known = table[(table[SCOPE] == COMMON) & (table[LOW] > 0)] if len(table) else table
    if known.empty:
        return known
    return known.sort_values(YIELD, ascending=False).groupby(PROCEDURE, sort=False).head(1).reset_index(drop=True)


def at_point(gained: pd.DataFrame, point: pd.Series) -> pd.DataFrame:
    """Pairs of one procedure, θ and planned time, by l/w and seed."""
    same = (gained[PROCEDURE] == point[PROCEDURE]) & np.isclose(gained[PLANNED], point[PLANNED])
    same &= np.isclose(gained[THETA], point[THETA], equal_nan=True)
    return gained[same].set_index([ASPECT, SEED])


def yields_compared(runs: pd.DataFrame, one: pd.Series, other: pd.Series, *, count: int = RESAMPLES) -> Interval:
    """Ratio of the gains per energy of two points, over the l/w and seeds that both have, drawn together.

    Args:
        runs: Rows of `measure.landscape_row`.
        one: Row of `costs`.
        other: Row of `costs`.
        count: Resamples.
    """
    gained = gains(runs)
    gained = gained[gained[ASPECT].isin(common_aspects(runs))]
    both = pd.concat([at_point(gained, point)[[GAIN, LIFTS]] for point in (one, other)], axis=1, join="inner")
    values = both.to_numpy(dtype=np.float64)
    if len(values) < 3:
        return Interval(value=math.nan, low=math.nan, high=math.nan)

    def ratio(rows: np.ndarray) -> np.ndarray:
        return np.array([_ratio(values[rows, :2]) / _ratio(values[rows, 2:])])

    every = np.arange(len(values))
    drawn = resampled(ratio, every, np.zeros(len(values), dtype=np.int64), count=count, seed=DRAW)
    return interval(float(ratio(every)[0]), drawn[:, 0].tolist())
