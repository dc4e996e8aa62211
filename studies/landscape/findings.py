"""What the study `landscape` asks, and what its tables answer."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import judge, told
from postprocess.statistics.points import told_number
from postprocess.statistics.ranks import Interval
from postprocess.statistics.seeds import mean_over_seeds
from studies.base.questions import Question, YesNo
from studies.framework.procedures import CROSSINGS, INTERNAL, PHI, PROCEDURE, SHAPE, THETA
from studies.landscape.cost import COMMON, GAIN, YIELD, at_point, best_points, common_aspects, gains, yields_compared
from studies.landscape.measure import BEYOND, CALLED, ENERGY, LIFTS, LINKING, PEAK, PLANNED
from studies.landscape.predictors import (
    ALL,
    EVERY,
    FIRST,
    HIGH,
    LEAD,
    LOW,
    OTHER,
    PART,
    PREDICTOR,
    RHO,
    SCOPE,
    STRENGTH,
    SWUNG,
    VERDICT,
    WITHIN,
)

SHORT = {PEAK: "strength", BEYOND: "strength beyond the weight above the hook"}
_SIGNS = ((CROSSINGS, "⟨N⟩"), (LINKING, "the linking number"), (PHI, "the packing fraction"))


def answers(
    runs: pd.DataFrame, predictors: pd.DataFrame, comparisons: pd.DataFrame, costs: pd.DataFrame
) -> tuple[Question, ...]:
    """The study's questions, answered.

    Args:
        runs: Rows of `measure.landscape_row`.
        predictors: See `predictors.predicted`.
        comparisons: Likewise.
        costs: See `cost.costs`.
    """
    return (
        *(_best(predictors, comparisons, strength, scope) for strength in SHORT for scope in (ALL, WITHIN)),
        *(_sign(predictors, measure, name) for measure, name in _SIGNS),
        _energy(predictors),
        _cheapest(runs, costs),
        _as_strong(runs, costs),
    )


def told_interval(value: float, low: float, high: float, form: str = "+.2f") -> str:
    """`+0.71 (+0.60 to +0.79)`, with the 95 % interval as far as there is one."""
    if math.isnan(value):
        return "-"
    return f"{value:{form}}" + (f" ({low:{form}} to {high:{form}})" if math.isfinite(low) else " (no error)")


def _at(table: pd.DataFrame, strength: str, part: str, scope: str) -> pd.DataFrame:
    if table.empty:
        return table
    return table[(table[STRENGTH] == strength) & (table[PART] == part) & (table[SCOPE] == scope)]


def _rho(row: pd.Series) -> str:
    return told_interval(row[RHO], row[LOW], row[HIGH])


def _best(predictors: pd.DataFrame, comparisons: pd.DataFrame, strength: str, scope: str) -> Question:
    where = "over runs of all l/w" if scope == ALL else "within runs of one l/w"
    question = f"Is one measure surely the best to tell {SHORT[strength]}, {where}?"
    found, against = (_at(table, strength, EVERY, scope) for table in (predictors, comparisons))
    if found.empty or not np.isfinite(found[RHO].iloc[0]):
        return Question(question=question, answer="undetermined", evidence="no data")
    first = found.iloc[0]
    rivals = against[against[VERDICT] == "not resolved"]
    surely = rivals.empty and len(against) > 0 and math.isfinite(first[LOW])
    listed = ", ".join(f"{CALLED[row[PREDICTOR]]} {_rho(row)}" for _, row in found.iloc[:4].iterrows())
    told_leads = ", ".join(
        f"{CALLED[row[OTHER]]} {told_interval(row[LEAD], row[LOW], row[HIGH])}"
        for _, row in against.iloc[:3].iterrows()
    )
    open_ = f"; not resolved against {', '.join(CALLED[name] for name in rivals[OTHER])}" if len(rivals) else ""
    return Question(
        question=question,
        answer="yes" if surely else "undetermined",
        evidence=f"{CALLED[first[PREDICTOR]]}, first in {told_number(100 * first[FIRST], '.0f')} % of resamples; rank "
        f"correlations {listed}; in size the first less {told_leads}{open_}",
    )


def _sign(predictors: pd.DataFrame, measure: str, name: str) -> Question:
    rows = {
        scope: _at(predictors, PEAK, EVERY, scope).pipe(lambda t: t[t[PREDICTOR] == measure] if len(t) else t)
        for scope in (ALL, WITHIN)
    }
    question = f"Within runs of one l/w, is a pile stronger the larger {name} is?"
    if any(part.empty for part in rows.values()):
        return Question(question=question, answer="undetermined", evidence="no data")
    row = rows[WITHIN].iloc[0]
    return Question(
        question=question,
        answer=_positive(Interval(value=row[RHO], low=row[LOW], high=row[HIGH])),
        evidence=f"rank correlation {_rho(row)}; over all l/w {_rho(rows[ALL].iloc[0])}",
    )


def _positive(found: Interval) -> YesNo:
    if found.low > 0:
        return "yes"
    return "no" if found.high < 0 else "undetermined"


def _energy(predictors: pd.DataFrame) -> Question:
    question = "Within runs of one l/w, is a pile stronger the more energy an internal oscillation has spent on it?"
    found = _at(predictors, PEAK, SWUNG, WITHIN)
    found = found[found[PREDICTOR] == ENERGY] if len(found) else found
    if found.empty:
        return Question(question=question, answer="undetermined", evidence="no data")
    row = found.iloc[0]
    answer = _positive(Interval(value=row[RHO], low=row[LOW], high=row[HIGH]))
    return Question(question=question, answer=answer, evidence=f"rank correlation {_rho(row)}, poured piles among them")


def named_point(row: pd.Series) -> str:
    """`internal θ = 10° for 2 s`."""
    theta = "" if math.isnan(row[THETA]) else f" θ = {row[THETA]:g}°"
    return f"{row[PROCEDURE]}{theta} for {row[PLANNED]:g} s"


def _cheapest(runs: pd.DataFrame, costs: pd.DataFrame) -> Question:
    question = "Is one procedure surely the cheapest per unit of strength, each at its best?"
    best = best_points(costs)
    if best.empty:
        return Question(question=question, answer="undetermined", evidence="no procedure surely gains strength")
    first = best.iloc[0]
    ratios = {row[PROCEDURE]: yields_compared(runs, first, row) for _, row in best.iloc[1:].iterrows()}
    listed = "; ".join(
        f"{named_point(row)} {told_interval(row[YIELD], row[LOW], row[HIGH], '.3g')}" for _, row in best.iterrows()
    )
    told_ratios = ", ".join(
        f"{told_interval(ratio.value, ratio.low, ratio.high, '.3g')} times {name}" for name, ratio in ratios.items()
    )
    surely = bool(ratios) and all(ratio.low > 1 for ratio in ratios.values())
    without = sorted({str(name) for name in costs[PROCEDURE].unique()} - set(best[PROCEDURE]))
    missed = f"; no sure gain: {', '.join(without)}" if without else ""
    return Question(
        question=question,
        answer="yes" if surely else "undetermined",
        evidence=f"n W_s gained per W_s w of energy and smarticle: {listed}"
        f"{f'; the first {told_ratios}' if ratios else ''}{missed}",
    )


def _as_strong(runs: pd.DataFrame, costs: pd.DataFrame) -> Question:
    question = "Does any internal oscillation make a pile as strong as a shape change does?"
    table = costs[costs[SCOPE] == COMMON] if len(costs) else costs
    shape, swung = (table[table[PROCEDURE] == name] if len(table) else table for name in (SHAPE, INTERNAL))
    if shape.empty or swung.empty:
        return Question(question=question, answer="undetermined", evidence="no data")
    gained = gains(runs)
    gained = gained[gained[ASPECT].isin(common_aspects(runs))]
    by_shape = at_point(gained, shape.iloc[0])[GAIN]
    lacks = {
        named_point(row): mean_over_seeds((by_shape - at_point(gained, row)[GAIN]).dropna().tolist())
        for _, row in swung.iterrows()
    }
    nearest = min(lacks, key=lambda name: math.inf if math.isnan(lacks[name].value) else lacks[name].value)
    weaker = [judge(effect) == "found" for effect in lacks.values()]
    stronger = judge(lacks[nearest]) == "not found"
    answer: YesNo = "yes" if stronger else "no" if all(weaker) else "undetermined"
    energy = shape.iloc[0][LIFTS]
    return Question(
        question=question,
        answer=answer,
        evidence=f"shape change less the strongest, {nearest}: {told(lacks[nearest], 3)} n W_s over l/w and "
        f"{SEED}s; it spends {energy:.3g} W_s w per smarticle",
    )
