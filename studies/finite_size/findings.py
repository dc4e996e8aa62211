"""What the study `finite-size` asks, and what its tables answer."""

from __future__ import annotations

import math

import pandas as pd

from postprocess.statistics.columns import ASPECT
from postprocess.statistics.findings import judge, told_more
from postprocess.statistics.points import told_number
from studies.base.questions import Question, YesNo
from studies.finite_size.measure import AFTER, BEFORE, COUNT, STAGES, crossings, phi, share, spans
from studies.finite_size.percolation import (
    AT_THRESHOLD,
    AXIS,
    HIGH,
    LOW,
    PLACE,
    POWER,
    POWER_BAR,
    RUNS,
    SPANNED,
    STAGE,
    VERDICT,
    axes,
    near,
    profiles_of,
    shifted,
)
from studies.finite_size.scaling import POWERS, Scaling, fitted

PAPER_ASPECT, PAPER_COUNT = 0.7, 270
"""The paper's pile that is asked about: its l/w, and its number of smarticles there."""

ASKED = {
    phi(BEFORE): ("φ_0", ".4f"),
    phi(AFTER): ("φ_f", ".4f"),
    phi(AFTER, "voxel"): ("φ_f by voxels of the inside", ".4f"),
    crossings(BEFORE): ("⟨N⟩_0", ".3f"),
    crossings(AFTER): ("⟨N⟩_f", ".3f"),
}
"""Quantities that are asked about, what they are called, and how they are told."""

_REFUSED = 0.05
_POWERS = (1 / 6, 2 / 3)  # within half of 1/3 and twice it the law is told from others


def answers(runs: pd.DataFrame, thresholds: pd.DataFrame, growths: pd.DataFrame) -> tuple[Question, ...]:
    """The study's questions, answered.

    Args:
        runs: Rows of `measure.size_row`.
        thresholds: See `percolation.thresholds`.
        growths: See `percolation.growths`.
    """
    laws = {quantity: fitted(runs, PAPER_ASPECT, quantity) for quantity in ASKED}
    return (
        *(_bias(quantity, law) for quantity, law in laws.items()),
        *(_law(quantity, law) for quantity, law in laws.items()),
        _whole(runs),
        *(_shift(runs, thresholds, stage, axis) for axis in ("l/w", "⟨N⟩") for stage in STAGES),
        *(_falls(growths, stage) for stage in STAGES),
    )


def _bias(quantity: str, law: Scaling | None) -> Question:
    name, form = ASKED[quantity]
    question = (
        f"Is {name} of {PAPER_COUNT} smarticles of l/w = {PAPER_ASPECT:g} below that of a pile without end of the "
        "same shape?"
    )
    if law is None:
        return Question(question=question, answer="undetermined", evidence="no data")
    bias = law.bias(PAPER_COUNT)
    above = judge(bias)
    answer: YesNo = "undetermined"
    if not math.isnan(bias.half_width):
        answer = "no" if above == "found" else "yes" if above == "not found" else "undetermined"
    part, error = 100 * bias.value / law.bulk, 100 * bias.half_width / abs(law.bulk)
    return Question(
        question=question,
        answer=answer,
        evidence=f"by {told_number(part, '+.1f', error)} %: {law.at(PAPER_COUNT):{form}} of "
        f"{told_number(law.bulk, form, law.error(1, 0))}, {law.runs} runs of {law.sizes} sizes"
        + (f"; {told_more(above)}" if told_more(above) else ""),
    )


def _law(quantity: str, law: Scaling | None) -> Question:
    name, _ = ASKED[quantity]
    question = f"Does {name} come to that as N^(-1/3), surface over volume?"
    if law is None or math.isnan(law.refused):
        return Question(question=question, answer="undetermined", evidence="no data")
    best, low, high = law.powers
    answer: YesNo = "undetermined"
    if law.refused < _REFUSED:
        answer = "no"
    elif low >= _POWERS[0] and high <= _POWERS[1]:
        answer = "yes"
    return Question(
        question=question,
        answer=answer,
        evidence=f"it leaves {law.excess:.2g} times what scatter explains, p = {law.refused:.2g}; power "
        f"{_power(best)} ({_power(low)} to {_power(high)})",
    )


def _power(value: float) -> str:
    """`0.33`, or the end of what is tried."""
    if value <= POWERS[0] + 1e-9:
        return f"{value:.2f} or less"
    return f"{value:.2f} or more" if value >= POWERS[-1] - 1e-9 else f"{value:.2f}"


def _whole(runs: pd.DataFrame) -> Question:
    question = f"Do entangled clusters reach through all piles of l/w = {PAPER_ASPECT:g}, whatever their size?"
    part = runs[runs[ASPECT] == PAPER_ASPECT]
    if part.empty:
        return Question(question=question, answer="undetermined", evidence="no data")
    sizes = part.groupby(COUNT)
    every = {stage: sizes[share(stage)].mean() for stage in STAGES}
    spanned = part[[spans(stage) for stage in STAGES]].to_numpy()
    listed = ", ".join(f"{size} {every[BEFORE][size]:.3f} and {every[AFTER][size]:.3f}" for size in sizes.groups)
    return Question(
        question=question,
        answer="yes" if (spanned == 1).all() else "no",
        evidence=f"{int(spanned.all(axis=1).sum())} of {len(part)} runs before and after; share of the largest one: "
        f"{listed}",
    )


def _shift(runs: pd.DataFrame, thresholds: pd.DataFrame, stage: str, axis: str) -> Question:
    column = axes(stage)[axis]
    question = f"Does the {axis} at which clusters span half of the piles {stage} the shake go with the piles' size?"
    rows = thresholds[(thresholds[STAGE] == stage) & (thresholds[AXIS] == axis)] if len(thresholds) else thresholds
    if rows.empty:
        return Question(question=question, answer="undetermined", evidence="no data")
    chance = shifted(profiles_of(runs, stage, axis))
    seen = near(runs)[column]
    told = "; ".join(_place(row) for _, row in rows.iterrows())
    return Question(
        question=question,
        answer="yes" if chance < _REFUSED else "undetermined",
        evidence=f"N = {told}; all alike: p = {told_number(chance, '.2g')}; {axis} of {seen.min():.2g} to "
        f"{seen.max():.2g}",
    )


def _place(row: pd.Series) -> str:
    """`300: 0.108 (0.105 to 0.112)`, or how many are spanned where all or none are."""
    if math.isnan(row[PLACE]):
        return f"{row[COUNT]}: {row[SPANNED]} of {row[RUNS]} spanned"
    ends = [f"{end:.3f}" if math.isfinite(end) else "open" for end in (row[LOW], row[HIGH])]
    return f"{row[COUNT]}: {row[PLACE]:.3f} ({ends[0]} to {ends[1]})"


def _falls(growths: pd.DataFrame, stage: str) -> Question:
    question = f"Is there an l/w at which the largest entangled cluster is ever less of larger piles {stage} the shake?"
    rows = growths[growths[STAGE] == stage] if len(growths) else growths
    rows = rows[rows[POWER].notna()] if len(rows) else rows
    if rows.empty:
        return Question(question=question, answer="undetermined", evidence="no data")
    listed = ", ".join(
        f"{row[ASPECT]:g}: {told_number(row[POWER], '+.2f', row[POWER_BAR])}" for _, row in rows.iterrows()
    )
    falling = rows.loc[rows[VERDICT] == "found", ASPECT]
    steady = rows.loc[rows[VERDICT] != "found", ASPECT]
    answer: YesNo = "undetermined"
    if len(falling):
        answer = "yes"
    elif (rows[VERDICT] == "not found").all():
        answer = "no"
    between = f"; surely falling up to l/w = {falling.max():g}" if len(falling) else ""
    between += f", not from {steady.min():g} on" if len(falling) and len(steady) else ""
    return Question(
        question=question,
        answer=answer,
        evidence=f"share as N to the power, at l/w = {listed}{between}; percolation in three dimensions has "
        f"{AT_THRESHOLD:g} at its threshold",
    )
