"""The study `landscape`: packing, entanglement, linking and strength over l/w, θ and the energy spent.

What is measured of a run, and what its strength is, stands in `studies.landscape.measure`; how measures are compared in
`studies.landscape.predictors`, what strength costs in `studies.landscape.cost`, what is asked in
`studies.landscape.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.measures.pull import WINDOW
from postprocess.report.markdown import meaning_lines, table_lines
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.points import averaged, marked, seeds_of, told_number
from studies.base.questions import Question, QuestionStudy, questions_lines
from studies.base.study import Analysis, Tables
from studies.framework.procedures import CROSSINGS, INTERNAL, PHI, PROCEDURE, SHAPE, STATIC, THETA
from studies.framework.provenance import NOTHING, Reference
from studies.framework.runs import DEFINITION, Collected, MeasuredRun, runs_table, told_seeds
from studies.landscape import figures
from studies.landscape.cost import COMMON, FRONTIER, GAIN, HIGH, LOW, PAIRS, YIELD, common_aspects, costs
from studies.landscape.findings import SHORT, answers, named_point, told_interval
from studies.landscape.measure import (
    ABOVE,
    CALLED,
    ENERGY,
    HELD_FAST,
    LIFTS,
    LINKING,
    OTHERS,
    PEAK,
    PLANNED,
    PREDICTORS,
    STRENGTHS,
    landscape_row,
)
from studies.landscape.predictors import (
    ALL,
    BLOCKS,
    COUNT,
    EVERY,
    FIRST,
    FREE,
    PART,
    PREDICTOR,
    RESAMPLES,
    RHO,
    SCOPE,
    SLOPE,
    SLOPE_HIGH,
    SLOPE_LOW,
    STRENGTH,
    SWUNG,
    WITHIN,
    predicted,
)

_SHOWN = {PHI: ("φ", ".4f"), CROSSINGS: ("⟨N⟩", ".2f"), LINKING: ("linking", ".3f"), ABOVE: ("above the hook", ".2f")}


class Landscape(QuestionStudy):
    """Runs of a pour, one activity or none, and a hook that is lifted out.

    Args:
        resamples: Of the intervals.
    """

    name = "landscape"
    about_numbers = (
        "Poured, after a shape change, and after the oscillation that made it strongest; strength over n W_s."
    )
    text_name = "landscape.md"
    told_by_tables = True

    def __init__(self, resamples: int = RESAMPLES) -> None:
        self.resamples = resamples

    def measure(self, run: RunManifest) -> MeasuredRun:
        """The pile before the pull, the energy spent on it, and its strength."""
        return MeasuredRun(manifest=run, rows=[landscape_row(run)])

    def refuse(self, found: Collected) -> None:
        """Other numbers of smarticles at one l/w, a point and seed twice."""
        found.refuse_mixed_counts()
        found.refuse_repeats("point", lambda run: f"{named_point(pd.Series(run.row))} l/w {run.row[ASPECT]:g}")

    def tabulate(self, found: Collected) -> Tables:
        """Runs, means over seeds, how measures go with strength, and what strength costs."""
        keys = [ASPECT, PROCEDURE, THETA, PLANNED]
        runs = runs_table(found).sort_values([*keys, SEED], ignore_index=True, kind="stable")
        means = [
            {**dict(zip(keys, place, strict=True)), **seeds_of(group), **averaged(group, _averaged())}
            for place, group in runs.groupby(keys, dropna=False)
        ]
        predictors, comparisons = predicted(runs, count=self.resamples)
        return {
            "runs": runs,
            "points": pd.DataFrame(means),
            "predictors": predictors,
            "comparisons": comparisons,
            "cost": costs(runs, count=self.resamples),
        }

    def judge(self, tables: Tables) -> tuple[Question, ...]:
        """Answers to the study's questions."""
        return answers(*(tables[name] for name in ("runs", "predictors", "comparisons", "cost")))

    def reference_of(self, tables: Tables) -> Reference:
        """Nothing."""
        return NOTHING

    def statements(self, analysis: Analysis[Question]) -> tuple[str, ...]:
        """Which runs, what strength is, and how errors come about."""
        runs, points = analysis.tables["runs"], analysis.tables["points"]
        counts = runs.groupby(ASPECT)["smarticles [-]"].first()
        ratios = ", ".join(f"{ratio:g} ({count})" for ratio, count in counts.items())
        held = int(runs[HELD_FAST].sum())
        bounds = [f"Held fast: {held} of {len(runs)} runs; their strength is a lower bound."] if held else []
        return (
            f"{len(points)} points, l/w (smarticles) {ratios}, {told_seeds(runs, points['seeds [-]'], 'point')}.",
            f"Strength: largest mean over {WINDOW:g} s of the force that raises a hook out of the pile, over the "
            f"weight n W_s of all smarticles. φ by {DEFINITION}; all measures at rest before the pull. Energy: work of "
            "the motors, or of the shaken floor, per smarticle.",
            f"Intervals: 95 % by {self.resamples} resamples of whole trajectories (one l/w, procedure, θ and seed) "
            "within each l/w, percentiles; of gains per energy, of pairs of one l/w and seed.",
            *bounds,
        )

    def text(self, analysis: Analysis[Question]) -> Sequence[str]:
        """Answers, how measures go with strength, what strength costs, and what columns are."""
        tables = analysis.tables
        predictors, cost = tables["predictors"], tables["cost"]
        lines = [
            "# Packing, entanglement, linking and strength over l/w, θ and the energy spent",
            "",
            *questions_lines(analysis.judged),
            "",
            "Strength is the peak force of a hook that is lifted out of the pile, over the weight of all smarticles:",
            "the largest share of its own weight that a pile bears hanging, with what friction at the wall adds. A",
            "heap without cohesion makes the hook lift what lies above it; the second strength is without that.",
        ]
        for strength in STRENGTHS:
            for part, scope in ((EVERY, ALL), (EVERY, WITHIN), (FREE, WITHIN), (SWUNG, WITHIN)):
                lines += _told_predictors(predictors, strength, part, scope)
        lines += [
            "",
            f"## What strength costs, over l/w = {', '.join(f'{one:g}' for one in common_aspects(tables['runs']))}",
            "",
            "Gain: strength less that of the poured pile of the same l/w and seed, mean ± 95 %. Energy over W_s w, the",
            "work that lifts a smarticle by its width. In bold what nothing else beats in both.",
            "",
            *table_lines(
                ["procedure", "pairs", "energy / W_s w", "energy [J]", "gain / n W_s", "gain per energy (95 %)"],
                [_cost(row) for _, row in (cost[cost[SCOPE] == COMMON] if len(cost) else cost).iterrows()],
            ),
        ]
        return [*lines, *meaning_lines("runs.csv", {**PREDICTORS, **STRENGTHS, **OTHERS})]

    def about_points(self, analysis: Analysis[Question]) -> str:
        """Seeds of the points, and what strength is."""
        runs, points = analysis.tables["runs"], analysis.tables["points"]
        seeds = told_seeds(runs, points["seeds [-]"], "point")
        return f"{len(points)} points, {seeds}. Strength: peak force of a hook lifted out, over the weight of all."

    def draw(self, output: Path, analysis: Analysis[Question], footer: Sequence[str]) -> Sequence[Path]:
        """Maps over energy, l/w and θ, strength against measures, correlations, and cost."""
        tables = analysis.tables
        return figures.draw(
            output,
            runs=tables["runs"],
            points=tables["points"],
            predictors=tables["predictors"],
            cost=tables["cost"],
            footer=footer,
        )

    def table(self, analysis: Analysis[Question]) -> tuple[Sequence[str], Sequence[Sequence[object]]]:
        """Means of every procedure at each l/w: poured, shape change, and the strongest oscillation."""
        points = analysis.tables["points"]
        header = ["l/w", "pile", "seeds", *(name for name, _ in _SHOWN.values()), "energy [J]", "strength"]
        rows = []
        for _, part in points.groupby(ASPECT):
            chosen = [part[part[PROCEDURE] == name] for name in (STATIC, SHAPE)]
            chosen.append(part[part[PROCEDURE] == INTERNAL].nlargest(1, PEAK))
            rows += [_point(row) for few in chosen for _, row in few.iterrows()]
        return header, rows


def _averaged() -> list[str]:
    return list(dict.fromkeys([*PREDICTORS, *STRENGTHS, *OTHERS]))


def _point(row: pd.Series) -> list[str]:
    return [
        f"{row[ASPECT]:g}",
        named_point(row),
        str(row["seeds [-]"]),
        *(f"{row[name]:{form}}" for name, (_, form) in _SHOWN.items()),
        f"{row[ENERGY]:.2e}",
        told_number(row[PEAK], ".3f", row[marked(PEAK, "SE")]),
    ]


def _told_predictors(table: pd.DataFrame, strength: str, part: str, scope: str) -> list[str]:
    """A heading and the table of one strength, part of the runs and scope; nothing without data."""
    same = (table[STRENGTH] == strength) & (table[PART] == part) & (table[SCOPE] == scope) if len(table) else []
    found = table[same] if len(table) else table
    if found.empty:
        return []
    first = found.iloc[0]
    runs = "" if part == EVERY else f", runs: {part}"
    rows = [
        [
            CALLED[row[PREDICTOR]],
            told_interval(row[RHO], row["from [-]"], row["to [-]"]),
            told_interval(row[SLOPE], row[SLOPE_LOW], row[SLOPE_HIGH], "+.3f"),
            told_number(100 * row[FIRST], ".0f"),
        ]
        for _, row in found.iterrows()
    ]
    title = SHORT[strength].capitalize()
    header = ["measure", "rank correlation (95 %)", "n W_s per SD of the measure (95 %)", "first in % of resamples"]
    return [
        "",
        f"## {title}, {scope}{runs}",
        "",
        f"{first[COUNT]} runs, {first[BLOCKS]} trajectories.",
        "",
        *table_lines(header, rows),
    ]


def _cost(row: pd.Series) -> list[str]:
    name = named_point(row)
    return [
        f"**{name}**" if row[FRONTIER] else name,
        str(row[PAIRS]),
        f"{row[LIFTS]:.3g}",
        f"{row[ENERGY]:.2e}",
        told_number(row[GAIN], "+.3f", row[marked(GAIN, "95 %")]),
        told_interval(row[YIELD], row[LOW], row[HIGH], "+.3g"),
    ]
