"""What Gravish et al. found of collapsing columns, each judged by our runs; criteria were set before the study ran."""

from __future__ import annotations

import math
from collections.abc import Callable

import pandas as pd

from postprocess.statistics.columns import ASPECT
from postprocess.statistics.findings import Finding, Verdict, all_of, judge, told
from postprocess.statistics.points import told_number
from postprocess.statistics.seeds import Difference, Slope, difference
from studies.base.collapse.column import DEFINITIONS, REMAINING
from studies.collapse.law import (
    ACTIVATION,
    AT_LEAST,
    DEVIATION,
    DEVIATION_HALF_WIDTH,
    ERROR,
    LawCheck,
    activation_of,
    activations,
    check_law,
)
from studies.collapse.measure import DEFINITION

INTERMEDIATE = 0.40
"""l/w of Gravish's greatest Δ [-]."""

CONSTANT = 0.20
"""How much Γ ln(fτ) may change from the least Γ to the greatest where the law holds, over its mean [-]."""

CLOSE = 0.20
"""How far from Gravish's Δ ours may be, over it [-]: neighbouring points of theirs differ as much."""


def findings(rows: pd.DataFrame) -> tuple[Finding, ...]:
    """All findings, by the height `REMAINING`.

    Args:
        rows: Of runs and definitions, see `measure.collapse_rows`.
    """
    table = activations(rows)
    return (_later_when_gentler(rows), _law(rows), _greatest_between(table), _as_gravish(table))


def _later_when_gentler(rows: pd.DataFrame) -> Finding:
    rise, others = _by_definition(rows, lambda law: law.rise)
    return Finding(
        paper="Columns collapse the later the gentler the vibration",
        ours=f"ln(fτ) against 1/Γ rises by {told(rise, 2)}; {others}",
        verdict=judge(rise),
        criterion="slope of ln(fτ) against 1/Γ > 0, within runs of the same l/w and seed",
    )


def _law(rows: pd.DataFrame) -> Finding:
    change, others = _by_definition(rows, lambda law: law.change)
    return Finding(
        paper="τ = (1/f) exp(Δ/Γ) with one Δ at each l/w",
        ours=f"Γ ln(fτ) from the least Γ to the greatest, over its mean: {told(change, 2)}; {others}",
        verdict=_within(change.value, change.half_width, CONSTANT),
        criterion=f"Γ ln(fτ) changes by less than {CONSTANT:.0%} of its mean, at 95 %",
    )


def _by_definition(rows: pd.DataFrame, effect: Callable[[LawCheck], Slope]) -> tuple[Slope, str]:
    """An effect by the height `REMAINING`, and in words by the others."""
    by_name = {name: effect(check_law(rows, name)) for name in DEFINITIONS}
    first = by_name.pop(REMAINING)
    return first, "; ".join(f"by {name} {told(other, 2)}" for name, other in by_name.items())


def _greatest_between(table: pd.DataFrame) -> Finding:
    aspects = sorted(table[ASPECT].unique())
    verdict: Verdict = "no data"
    if INTERMEDIATE in aspects[1:-1]:
        verdict = all_of([_above(table, aspects[0]), _above(table, aspects[-1])])
    parts = [f"by {name}: {_by_aspect(table[table[DEFINITION] == name])}" for name in DEFINITIONS]
    return Finding(
        paper="Δ is greatest at an intermediate l/w, near 0.4",
        ours=f"Δ {'; '.join(parts)}",
        verdict=verdict,
        criterion=f"Δ at l/w = {INTERMEDIATE:g} above that at the least and at the greatest l/w that were run, at 95 %",
    )


def _above(table: pd.DataFrame, end: float) -> Verdict:
    """Whether Δ at the intermediate aspect ratio is above that at an end."""
    one, other = (activation_of(table, REMAINING, aspect) for aspect in (INTERMEDIATE, end))
    gap: Difference = difference(one, other)
    if math.isnan(gap.value):
        return "no data"
    if gap.clear:
        return "found" if gap.value > 0 else "not found"
    return "not resolved"


def _by_aspect(part: pd.DataFrame) -> str:
    return ", ".join(f"{row[ASPECT]:g}: {told_delta(row)}" for _, row in part.iterrows())


def told_delta(row: pd.Series) -> str:
    """Δ with its standard error, or what it is at least."""
    if math.isnan(row[ACTIVATION]):
        return f"≥ {row[AT_LEAST]:.1f}"
    return told_number(row[ACTIVATION], ".2f", row[ERROR])


def _as_gravish(table: pd.DataFrame) -> Finding:
    own = table[table[DEFINITION] == REMAINING].dropna(subset=[DEVIATION])
    verdicts = [
        _within(value / 100, half_width / 100, CLOSE)
        for value, half_width in zip(own[DEVIATION], own[DEVIATION_HALF_WIDTH], strict=True)
    ]
    ours = ", ".join(
        f"l/w = {row[ASPECT]:g}: {told_number(row[DEVIATION], '+.0f', row[DEVIATION_HALF_WIDTH])} %"
        for _, row in own.iterrows()
    )
    return Finding(
        paper="Δ as measured",
        ours=f"deviations with 95 % half-widths: {ours}" if ours else "no data",
        verdict=all_of(verdicts) if verdicts else "no data",
        criterion=f"Δ within {CLOSE:.0%} of Gravish's at every l/w, at 95 %",
    )


def _within(value: float, half_width: float, limit: float) -> Verdict:
    """Whether a number is as near to 0 as a limit, both ways beyond its error."""
    if math.isnan(value):
        return "no data"
    if abs(value) + half_width <= limit:
        return "found"
    return "not found" if abs(value) - half_width > limit else "not resolved"
