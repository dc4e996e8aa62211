"""What the study `friction` was asked, and what its tables answer."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from postprocess.statistics.columns import ASPECT
from postprocess.statistics.points import told_number
from postprocess.statistics.seeds import mean_over_seeds, slope_within
from studies.base.questions import Question, YesNo, above_zero
from studies.friction.measure import FRICTION, TIMES
from studies.friction.steel import AS_IT_COMES, CLEANED, Published, spanned
from studies.friction.tables import (
    COMPARED_POINTS,
    CONFIDENCE,
    GROWTHS,
    JUDGED,
    LARGEST,
    MARGIN,
    MEAN,
    STAGE,
    VERDICT,
    WHAT,
)

PAPERS = 0.4
"""Coefficient of friction of Savoie et al. [-]."""

LOW, HIGH = "from [-]", "to [-]"


def answers(
    crossings: pd.DataFrame, verdicts: pd.DataFrame, nearest: pd.DataFrame, growth: pd.DataFrame
) -> tuple[Question, ...]:
    """The study's questions, answered.

    Args:
        crossings: See `tables.crossings`.
        verdicts: See `tables.verdicts`.
        nearest: See `tables.nearest_frictions`.
        growth: See `tables.growth`.
    """
    return (
        *(_one_friction(what, verdicts, nearest) for what in JUDGED),
        _papers(verdicts),
        _common(crossings),
        _steel(crossings, "dry steel as it comes", AS_IT_COMES),
        _steel(crossings, "clean, dry steel", CLEANED),
        *_growing(growth),
    )


def told_crossing(row: pd.Series) -> str:
    """`0.61 (0.52 to 0.74)`, `above 0.8 (from 0.71)`, `below 0.2 (clearly)`: with the 95 % interval."""
    value, low, high = float(row[FRICTION]), float(row[LOW]), float(row[HIGH])
    ends = f"{low:.2f} to {high:.2f}"
    if math.isnan(low):
        ends = "no error"
    elif math.isinf(low) and math.isinf(high):
        ends = "anything measured"
    elif math.isinf(low):
        ends = f"up to {high:.2f}"
    elif math.isinf(high):
        ends = f"from {low:.2f}"
    if math.isinf(value):
        if low == row["measured to [-]"] or high == row["measured from [-]"]:
            ends = "clearly"
        limit = row["measured to [-]"] if value > 0 else row["measured from [-]"]
        return f"{'above' if value > 0 else 'below'} {limit:g} ({ends})"
    return f"{value:.2f} ({ends})"


def _one_friction(what: str, verdicts: pd.DataFrame, nearest: pd.DataFrame) -> Question:
    question = f"Does one friction bring {what} within {MARGIN:g} % of Gravish's at every l/w measured?"
    tried = _of(verdicts, what)
    best = _of(nearest, what)
    if tried.empty or best.empty:
        return Question(question=question, answer="undetermined", evidence="no points of Gravish's at these l/w")
    one = best.iloc[0]
    answer: YesNo = "undetermined"
    if (tried[VERDICT] == "yes").any():
        answer = "yes"
    elif (tried[VERDICT] == "no").all() and one[VERDICT] == "no":
        answer = "no"
    surest = tried.loc[tried[CONFIDENCE].idxmax()] if tried[CONFIDENCE].notna().any() else None
    parts = [
        f"nearest at {one[FRICTION]:.2f} (between measured points): {one[MEAN]:.1f} % on average over "
        f"{_counted(one[COMPARED_POINTS])}, at most {one[LARGEST]:+.1f} %, {one['largest at']}; "
        f"confidence that all are within {MARGIN:g} %: {told_number(one[CONFIDENCE], '.0f')} %",
    ]
    if surest is not None:
        parts.append(
            f"of those measured the surest is {surest[FRICTION]:g}, with {surest[CONFIDENCE]:.0f} %, at most "
            f"{surest[LARGEST]:+.1f} %"
        )
    return Question(question=question, answer=answer, evidence="; ".join(parts))


def _papers(verdicts: pd.DataFrame) -> Question:
    question = (
        f"Does the paper's friction, {PAPERS:g}, bring phi_f within {MARGIN:g} % of Gravish's at every l/w measured?"
    )
    found = _of(verdicts, "phi_f")
    found = found[found[FRICTION] == PAPERS] if len(found) else found
    if found.empty:
        return Question(question=question, answer="undetermined", evidence="no runs at it")
    row = found.iloc[0]
    return Question(
        question=question,
        answer=row[VERDICT],
        evidence=f"{row[MEAN]:.1f} % off on average over {_counted(row[COMPARED_POINTS])}, at most "
        f"{row[LARGEST]:+.1f} %; confidence {told_number(row[CONFIDENCE], '.0f')} %",
    )


def _common(crossings: pd.DataFrame) -> Question:
    question = "Is there a friction that neither phi_0 nor phi_f excludes at 95 % at any l/w?"
    found = _stages(crossings, ("phi_0", "phi_f"))
    if found.empty or found[[LOW, HIGH]].isna().any(axis=None):
        return Question(question=question, answer="undetermined", evidence="no errors")
    low, high = float(found[LOW].max()), float(found[HIGH].min())
    told = "; ".join(f"{row[STAGE]} at l/w = {row[ASPECT]:g}: {told_crossing(row)}" for _, row in found.iterrows())
    if low <= high:
        return Question(question=question, answer="yes", evidence=f"{_told_range(low, high)}; {told}")
    return Question(question=question, answer="no", evidence=told)


def _steel(crossings: pd.DataFrame, surface: str, published: tuple[Published, ...]) -> Question:
    least, most = spanned(published)
    question = f"Is the friction that phi_f asks for that of {surface} (static, as published: {least:g} to {most:g})?"
    found = _stages(crossings, ("phi_f",))
    answer: YesNo = "undetermined"
    if len(found) and found[[LOW, HIGH]].notna().all(axis=None):
        if ((found[LOW] >= least) & (found[HIGH] <= most)).all():
            answer = "yes"
        elif ((found[LOW] > most) | (found[HIGH] < least)).any():
            answer = "no"
    told = "; ".join(f"l/w = {row[ASPECT]:g}: {told_crossing(row)}" for _, row in found.iterrows())
    return Question(question=question, answer=answer, evidence=told or "no points of Gravish's at these l/w")


def _growing(growth: pd.DataFrame) -> tuple[Question, ...]:
    late = GROWTHS[-1]
    known = growth[growth[late].notna()]
    still = f"Does phi still grow between {TIMES[-2]:g} and {TIMES[-1]:g} s of shaking?"
    stronger = f"Does phi grow more between {TIMES[-2]:g} and {TIMES[-1]:g} s where friction is stronger?"
    if known.empty:
        evidence = f"no run was shaken for {TIMES[-1]:g} s"
        return tuple(Question(question=one, answer="undetermined", evidence=evidence) for one in (still, stronger))
    mean, earlier = mean_over_seeds(known[late].tolist()), mean_over_seeds(known[GROWTHS[0]].tolist())
    slope = slope_within(known[FRICTION].tolist(), known[late].tolist(), known[ASPECT].tolist())
    by_friction = known.groupby(FRICTION)[late].mean()
    told = ", ".join(f"{value:+.1f} % at {friction:g}" for friction, value in by_friction.items())
    return (
        Question(
            question=still,
            answer=above_zero(mean.value, mean.half_width),
            evidence=f"by {told_number(mean.value, '+.1f', mean.half_width)} % over {mean.count} points, "
            f"{int((known[late] > 0).sum())} of them grow; from {TIMES[0]:g} to {TIMES[1]:g} s by "
            f"{told_number(earlier.value, '+.1f', earlier.half_width)} %",
        ),
        Question(
            question=stronger,
            answer=above_zero(slope.value, slope.half_width),
            evidence=f"per 0.1 of friction {told_number(slope.value / 10, '+.2f', slope.half_width / 10)} % more at "
            f"equal l/w; mean over l/w: {told}",
        ),
    )


def _counted(count: int) -> str:
    return f"{count} point" if count == 1 else f"{count} points"


def _told_range(low: float, high: float) -> str:
    if math.isinf(low):
        return f"all up to {high:.2f}"
    return f"all from {low:.2f}" if math.isinf(high) else f"from {low:.2f} to {high:.2f}"


def _stages(crossings: pd.DataFrame, stages: Sequence[str]) -> pd.DataFrame:
    return crossings[crossings[STAGE].isin(stages)] if len(crossings) else crossings


def _of(table: pd.DataFrame, what: str) -> pd.DataFrame:
    return table[table[WHAT] == what] if len(table) else table
