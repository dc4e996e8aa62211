"""Findings of the study `gravish`: deviations, and answers with evidence.

Gravish's points are compared at equal l/w only and never interpolated. All error bars are
half-widths of 95 % confidence intervals of a mean over seeds, by Student's t. A mean over one seed
has none, and what would need one is left undetermined.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from postprocess.statistics.columns import ASPECT, SEEDS
from postprocess.statistics.points import mean_columns, seeds_of
from postprocess.statistics.seeds import mean_over_seeds
from studies.base.questions import Question, YesNo
from studies.framework.provenance import COLUMNS, DIGITISING_ERROR, reference_at
from studies.framework.runs import DEFINITION
from studies.framework.shaken import SHAKEN, STAGES, measured_quantities

ACCEPTED_DEVIATION = 10.0
"""Mean absolute deviation from Gravish's points that the study accepts [%]."""


_COMPARED = {f"{stage} {DEFINITION}": stage for stage in COLUMNS}


def summarise_runs(runs: pd.DataFrame, reference: pd.DataFrame) -> pd.DataFrame:
    """One row per aspect ratio: means over seeds, their errors, and Gravish's values.

    Args:
        runs: Table of runs, rows of `shaken.measured_row`.
        reference: See `references.read_reference`.

    Returns:
        The table, by ascending aspect ratio. `… 95 % [-]` are half-widths, `… deviation [%]` is
        relative to Gravish's value; empty where there is none.
    """
    rows = []
    for aspect, group in runs.groupby(ASPECT, sort=True):
        row: dict[str, object] = {
            ASPECT: aspect,
            **seeds_of(group),
            SHAKEN: group[SHAKEN].mean(),
        }
        for quantity in measured_quantities(runs):
            mean = mean_over_seeds(group[f"{quantity} [-]"])
            row |= mean_columns(f"{quantity} [-]", mean)
            if quantity in _COMPARED:
                value = reference_at(reference, aspect, _COMPARED[quantity])
                row[f"{quantity} Gravish [-]"] = value
                row[f"{quantity} deviation [%]"] = 100 * (mean.value / value - 1)
        rows.append(row)
    return pd.DataFrame(rows)


def answers(
    runs: pd.DataFrame, summary: pd.DataFrame, deviations: pd.DataFrame, steps: pd.DataFrame
) -> tuple[Question, ...]:
    """Answers to the study's questions.

    Args:
        runs: Table of runs, rows of `shaken.measured_row`.
        summary: See `summarise_runs`.
        deviations: See `deviations_from_reference`.
        steps: See `steps_between_ratios`.

    Returns:
        The questions, answered, by stage.
    """
    return (
        *(_monotone(stage, steps, summary) for stage in _stages(summary)),
        _compacted(runs),
        *(_close_enough(stage, deviations) for stage in _stages(summary)),
    )


def _stages(summary: pd.DataFrame) -> list[str]:
    """The stages that the runs went through: not every run relaxes at the end."""
    return [stage for stage in STAGES if f"{stage} {DEFINITION} [-]" in summary.columns]


def deviations_from_reference(summary: pd.DataFrame) -> pd.DataFrame:
    """One row per stage and aspect ratio at which Gravish has a point.

    Args:
        summary: See `summarise_runs`.

    Returns:
        The table; it has its columns even without rows.
    """
    rows = []
    for stage in _stages(summary):
        quantity = f"{stage} {DEFINITION}"
        for _, row in summary.iterrows():
            value, reference = row[f"{quantity} [-]"], row[f"{quantity} Gravish [-]"]
            if math.isnan(value) or math.isnan(reference):
                continue
            half_width = row[f"{quantity} 95 % [-]"]
            rows.append(
                {
                    "stage": stage,
                    "definition": DEFINITION,
                    ASPECT: row[ASPECT],
                    SEEDS: row[SEEDS],
                    "phi [-]": value,
                    "phi 95 % [-]": half_width,
                    "phi Gravish [-]": reference,
                    "digitising error [-]": DIGITISING_ERROR,
                    "deviation [-]": value - reference,
                    "deviation [%]": row[f"{quantity} deviation [%]"],
                    "deviation 95 % [%]": 100 * half_width / reference,
                }
            )
    columns = ["stage", "definition", ASPECT, SEEDS, "phi [-]", "phi 95 % [-]"]
    columns += ["phi Gravish [-]", "digitising error [-]", "deviation [-]", "deviation [%]"]
    return pd.DataFrame(rows, columns=[*columns, "deviation 95 % [%]"])


def steps_between_ratios(summary: pd.DataFrame) -> pd.DataFrame:
    """Differences of φ between neighbouring aspect ratios, against their errors.

    The error of a difference is the root of the sum of squares of the two half-widths.

    Args:
        summary: See `summarise_runs`.

    Returns:
        One row per stage and pair; `phi` says "falls", "rises", "within error bars", or "no error
        bar".
    """
    rows = []
    for stage in _stages(summary):
        quantity = f"{stage} {DEFINITION}"
        known = summary[summary[f"{quantity} [-]"].notna()]
        pairs = zip(known.iloc[:-1].iterrows(), known.iloc[1:].iterrows(), strict=True)
        for (_, low), (_, high) in pairs:
            difference, half_width = _difference(low, high, quantity)
            rows.append(
                {
                    "stage": stage,
                    "definition": DEFINITION,
                    "from aspect ratio [-]": low[ASPECT],
                    "to aspect ratio [-]": high[ASPECT],
                    "difference [-]": difference,
                    "combined 95 % [-]": half_width,
                    "phi": _direction(difference, half_width),
                }
            )
    columns = ["stage", "definition", "from aspect ratio [-]", "to aspect ratio [-]"]
    return pd.DataFrame(rows, columns=[*columns, "difference [-]", "combined 95 % [-]", "phi"])


def _difference(low: pd.Series, high: pd.Series, quantity: str) -> tuple[float, float]:
    """Difference of two means and the root of the sum of squares of their half-widths."""
    half_widths = float(low[f"{quantity} 95 % [-]"]), float(high[f"{quantity} 95 % [-]"])
    return float(high[f"{quantity} [-]"] - low[f"{quantity} [-]"]), math.hypot(*half_widths)


def _direction(difference: float, half_width: float) -> str:
    if math.isnan(half_width):
        return "no error bar"
    if abs(difference) <= half_width:
        return "within error bars"
    return "falls" if difference < 0 else "rises"


def _monotone(stage: str, steps: pd.DataFrame, summary: pd.DataFrame) -> Question:
    question = f"Does {stage} fall monotonically with l/w within error bars?"
    found = steps.loc[steps["stage"] == stage]
    if found.empty:
        evidence = "fewer than two aspect ratios"
        return Question(question=question, answer="undetermined", evidence=evidence)
    counts = found["phi"].value_counts()
    falls, rises = int(counts.get("falls", 0)), int(counts.get("rises", 0))
    within, bare = (int(counts.get(name, 0)) for name in ("within error bars", "no error bar"))
    plain = int((found["difference [-]"] < 0).sum())
    parts = [
        f"of {len(found)} steps {falls} fall and {rises} rise by more than the combined 95 % "
        f"half-width, {within} lie within it, {bare} have no error bar",
        f"the means alone fall at {plain} of {len(found)} steps",
    ]
    quantity = f"{stage} {DEFINITION}"
    known = summary[summary[f"{quantity} [-]"].notna()]
    total, half_width = _difference(known.iloc[0], known.iloc[-1], quantity)
    parts.append(
        f"from l/w = {known[ASPECT].iloc[0]:g} to {known[ASPECT].iloc[-1]:g} the change is "
        f"{total:+.4f} ± {half_width:.4f}"
        if math.isfinite(half_width)
        else f"in all the change is {total:+.4f}, without an error bar"
    )
    answer: YesNo = "undetermined"
    if rises:
        answer = "no"
    # A flat line with wide error bars is not monotone: the whole change must be beyond them.
    elif not bare and total < -half_width:
        answer = "yes"
    return Question(question=question, answer=answer, evidence="; ".join(parts))


def _compacted(runs: pd.DataFrame) -> Question:
    question = "Is phi_f above phi_0 at every l/w?"
    gain = runs[f"phi_f {DEFINITION} [-]"] - runs[f"phi_0 {DEFINITION} [-]"]
    means = [mean_over_seeds(part) for _, part in gain.groupby(runs[ASPECT])]
    clear = sum(mean.value > mean.half_width for mean in means)
    least = min((mean.value for mean in means if not math.isnan(mean.value)), default=math.nan)
    evidence = (
        f"gain paired by seed: above 0 by more than its 95 % half-width at {clear} of "
        f"{len(means)} l/w, and in {int((gain > 0).sum())} of {len(gain)} runs; the least mean "
        f"gain is {least:+.4f}"
    )
    answer: YesNo = "undetermined"
    if any(mean.value <= 0 for mean in means):
        answer = "no"
    elif clear == len(means):
        answer = "yes"
    elif any(mean.count < 2 for mean in means):
        evidence += "; where there is one seed there is no error bar"
    return Question(question=question, answer=answer, evidence=evidence)


def _close_enough(stage: str, deviations: pd.DataFrame) -> Question:
    question = f"Is the mean absolute deviation of {stage} from Gravish at most "
    question += f"{ACCEPTED_DEVIATION:g} %?"
    found = deviations.loc[deviations["stage"] == stage]
    if found.empty:
        evidence = "Gravish has no point at these l/w"
        return Question(question=question, answer="undetermined", evidence=evidence)
    deviation = float(found["deviation [%]"].abs().mean())
    half_width = float(np.hypot.reduce(found["deviation 95 % [%]"])) / len(found)
    error = f"± {half_width:.1f} %" if math.isfinite(half_width) else "(without an error bar)"
    worst = found.loc[found["deviation [%]"].abs().idxmax()]
    reading = 100 * DIGITISING_ERROR / found["phi Gravish [-]"].mean()
    evidence = (
        f"{deviation:.1f} % {error} over {len(found)} l/w, {DEFINITION}; the largest is "
        f"{worst['deviation [%]']:+.1f} % at l/w = {worst[ASPECT]:g}; reading Gravish's points "
        f"is uncertain by about {reading:.1f} %"
    )
    answer: YesNo = "yes" if deviation <= ACCEPTED_DEVIATION else "no"
    return Question(question=question, answer=answer, evidence=evidence)
