"""The study `friction`: which coefficient of friction gives Gravish's packing fractions, and is it that of steel?

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012). Smarticles and walls
have the same friction, static and sliding alike. How errors come about is in `studies.friction.scatter` and
`studies.friction.curve`, what is asked in `studies.friction.findings`, what steel has in `studies.friction.steel`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.report.markdown import table_lines
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.points import marked, told_number
from studies.base.questions import Question, QuestionStudy, questions_lines
from studies.base.study import Analysis, Tables
from studies.framework.provenance import GRAVISH, SHAKE_TIME, Reference, read_reference
from studies.framework.runs import DEFINITION, Collected, MeasuredRun, runs_table, told_seeds
from studies.framework.shaken import WHEN, told_shaken
from studies.friction import figures
from studies.friction.findings import answers, told_crossing
from studies.friction.measure import FRICTION, TIMES, WINDOW, at_time, friction_run, refuse_repeats
from studies.friction.scatter import scatters
from studies.friction.steel import AS_IT_COMES, CLEANED
from studies.friction.tables import (
    COMPARED_POINTS,
    CONFIDENCE,
    DEVIATION,
    GROWTHS,
    LARGEST,
    MARGIN,
    MEAN,
    PHI,
    REFERENCE,
    STAGE,
    SURE,
    VERDICT,
    WHAT,
    crossings,
    curves,
    growth,
    nearest_frictions,
    points,
    verdicts,
)


class Friction(QuestionStudy):
    """Runs that were poured and shaken, at several coefficients of friction."""

    name = "friction"
    text_name = "friction.md"

    def measure(self, run: RunManifest) -> MeasuredRun:
        """φ before, in the course of, at the end of and after shaking."""
        return friction_run(run)

    def refuse(self, found: Collected) -> None:
        """Other numbers of smarticles at one l/w, a point and seed twice."""
        refuse_repeats(found)

    def tabulate(self, found: Collected) -> Tables:
        """Runs, means, the friction that each curve asks for, how near each friction comes, and growth."""
        runs = runs_table(found).sort_values([ASPECT, FRICTION, SEED], ignore_index=True, kind="stable")
        scatter = scatters(runs)
        means = points(runs, read_reference(), scatter)
        found_curves = curves(means, scatter)
        return {
            "runs": runs,
            "points": means,
            "crossings": crossings(found_curves),
            "verdicts": verdicts(found_curves),
            "nearest": nearest_frictions(found_curves),
            "growth": growth(runs),
            "scatter": pd.DataFrame(
                [
                    {STAGE: stage, "relative scatter [%]": 100 * one.value, "degrees of freedom [-]": one.freedom}
                    for stage, one in scatter.items()
                ]
            ),
        }

    def judge(self, tables: Tables) -> tuple[Question, ...]:
        """Answers to the study's questions."""
        return answers(*(tables[name] for name in ("crossings", "verdicts", "nearest", "growth")))

    def reference_of(self, tables: Tables) -> Reference:
        """Gravish's packing fractions."""
        return GRAVISH

    def statements(self, analysis: Analysis[Question]) -> tuple[str, ...]:
        """Which runs, how φ is taken, and how errors come about."""
        runs = analysis.tables["runs"]
        counts = runs.groupby([ASPECT, FRICTION]).size()
        ratios, frictions = (
            " ".join(f"{value:g}" for value in sorted(runs[name].unique())) for name in (ASPECT, FRICTION)
        )
        return (
            f"l/w {ratios}, μ {frictions}, {told_seeds(runs, counts, 'point')}; shaken for {told_shaken(runs)} "
            f"(Gravish: {SHAKE_TIME:g} s).",
            f"φ by {DEFINITION}; {WHEN}; in the course of shaking a mean over {WINDOW:g} s.",
            "Error bars: 95 % confidence of the mean over seeds, Student's t; scatter relative to the mean, pooled "
            "over all points of a stage.",
        )

    def text(self, analysis: Analysis[Question]) -> Sequence[str]:
        """Answers, the friction that each curve asks for, verdicts, φ at every point, its growth, and steel."""
        tables = analysis.tables
        return [
            "# Friction that packs smarticles as Gravish et al. 2012 found",
            "",
            *questions_lines(analysis.judged),
            "",
            "## The friction at which φ is Gravish's",
            "",
            f"Interpolated between the measured points, with its 95 % interval; {at_time(TIMES[0])} and "
            f"{at_time(TIMES[1])} as if Gravish had shaken no longer.",
            "",
            *table_lines(
                ["stage", "l/w", "Gravish", "friction"], [_crossing(row) for row in _rows(tables["crossings"])]
            ),
            "",
            f"## Within {MARGIN:g} % of Gravish's",
            "",
            f"The confidence is that all points are within {MARGIN:g} %: yes from {100 * SURE:.0f} %. No: one of "
            "them is surely farther off.",
            "",
            *table_lines(
                ["what", "friction", "points", "mean absolute", "largest", "confidence", "verdict"],
                [_verdict(row) for row in _rows(tables["verdicts"])],
            ),
            "",
            "## φ",
            "",
            *table_lines(
                ["stage", "l/w", "friction", "seeds", "φ", "Gravish", "deviation %"],
                [_point(row) for row in _rows(tables["points"])],
            ),
            "",
            "## Growth while shaken",
            "",
            *table_lines(
                ["l/w", "friction", *map(at_time, TIMES), *GROWTHS], [_grown(r) for r in _rows(tables["growth"])]
            ),
            "",
            "## Published friction of dry steel on steel, static",
            "",
            *table_lines(
                ["surface", "friction", "source"],
                [
                    [one.surface, f"{one.low:g}" + (f" to {one.high:g}" if one.high > one.low else ""), one.source]
                    for one in (*AS_IT_COMES, *CLEANED)
                ],
            ),
        ]

    def about_points(self, analysis: Analysis[Question]) -> str:
        """Seeds, and what φ is."""
        runs = analysis.tables["runs"]
        counts = runs.groupby([ASPECT, FRICTION]).size()
        return f"{told_seeds(runs, counts, 'point')}; shaken for {told_shaken(runs)}; φ by {DEFINITION}."

    def draw(self, output: Path, analysis: Analysis[Question], footer: Sequence[str]) -> Sequence[Path]:
        """φ and its deviation against friction, and φ against time."""
        return figures.draw(
            output,
            points=analysis.tables["points"],
            crossings=analysis.tables["crossings"],
            runs=analysis.found.runs,
            footer=footer,
        )

    def table(self, analysis: Analysis[Question]) -> tuple[Sequence[str], Sequence[Sequence[object]]]:
        """The friction that each curve asks for."""
        header = ["φ", "l/w", "Gravish", "friction (95 %)"]
        return header, [_crossing(row) for row in _rows(analysis.tables["crossings"])]


def _rows(table: pd.DataFrame) -> list[pd.Series]:
    return [row for _, row in table.iterrows()]


def _crossing(row: pd.Series) -> list[str]:
    return [row[STAGE], f"{row[ASPECT]:g}", f"{row[REFERENCE]:.4f}", told_crossing(row)]


def _verdict(row: pd.Series) -> list[str]:
    return [
        row[WHAT],
        f"{row[FRICTION]:g}",
        str(row[COMPARED_POINTS]),
        f"{row[MEAN]:.1f} %",
        f"{row[LARGEST]:+.1f} %, {row['largest at']}",
        f"{told_number(row[CONFIDENCE], '.0f')} %",
        f"**{row[VERDICT]}**",
    ]


def _point(row: pd.Series) -> list[str]:
    return [
        row[STAGE],
        f"{row[ASPECT]:g}",
        f"{row[FRICTION]:g}",
        str(row[SEEDS]),
        told_number(row[PHI], ".4f", row[marked(PHI, "95 %")]),
        told_number(row[REFERENCE], ".4f"),
        told_number(row[DEVIATION], "+.1f", row[marked(DEVIATION, "95 %")]),
    ]


def _grown(row: pd.Series) -> list[str]:
    return [
        f"{row[ASPECT]:g}",
        f"{row[FRICTION]:g}",
        *(told_number(row[f"{at_time(time)} [-]"], ".4f") for time in TIMES),
        *(told_number(row[name], "+.1f", row[marked(name, "95 %")]) for name in GROWTHS),
    ]
