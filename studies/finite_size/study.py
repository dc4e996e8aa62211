"""The study `finite-size`: packing, entanglement and its percolation from 100 to 10 000 smarticles.

What is measured of a run stands in `studies.finite_size.measure`; the law in the size in `studies.finite_size.scaling`,
where clusters begin to reach through piles in `studies.finite_size.percolation`, what is asked in
`studies.finite_size.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.report.markdown import meaning_lines, table_lines
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.points import averaged, marked, seeds_of, told_number
from studies.base.questions import Question, QuestionStudy, questions_lines
from studies.base.study import Analysis, Tables
from studies.finite_size import figures
from studies.finite_size.findings import PAPER_ASPECT, PAPER_COUNT, answers
from studies.finite_size.measure import AFTER, BEFORE, COUNT, QUANTITIES, RADIUS, crossings, phi, share, size_row, spans
from studies.finite_size.percolation import growths, thresholds
from studies.finite_size.scaling import (
    BULK,
    BULK_BAR,
    EXCESS,
    POWER_BEST,
    POWER_HIGH,
    POWER_LOW,
    QUANTITY,
    REFUSED,
    SIZES,
    SLOPE,
    SLOPE_BAR,
    scalings,
)
from studies.framework.provenance import NOTHING, Reference
from studies.framework.runs import DEFINITION, Collected, MeasuredRun, runs_table, told_seeds

_SHOWN = {
    phi(BEFORE): ("φ_0", ".4f"),
    phi(AFTER): ("φ_f", ".4f"),
    crossings(BEFORE): ("⟨N⟩_0", ".2f"),
    crossings(AFTER): ("⟨N⟩_f", ".2f"),
    share(BEFORE): ("largest cluster 0", ".3f"),
    share(AFTER): ("largest cluster f", ".3f"),
}
_SPANS = {spans(BEFORE): "spanned 0", spans(AFTER): "spanned f"}


class FiniteSize(QuestionStudy):
    """Runs of a pour, a rest, a shake and a rest, of piles of one shape and many sizes."""

    name = "finite-size"
    about_numbers = "0: poured, f: shaken, both at rest; ± 95 %."
    text_name = "finite-size.md"
    told_by_tables = True

    def measure(self, run: RunManifest) -> MeasuredRun:
        """The pile at rest before and after the shake."""
        return MeasuredRun(manifest=run, rows=[size_row(run)])

    def refuse(self, found: Collected) -> None:
        """Piles of one l/w and number in other containers, a point and seed twice."""
        found.refuse_mixture(
            "radius",
            lambda run: f"of radius {run.row[RADIUS]:.6g} w",
            within=lambda run: (run.row[ASPECT], run.row[COUNT]),
        )
        found.refuse_repeats("point", lambda run: f"l/w {run.row[ASPECT]:g} N {run.row[COUNT]}")

    def tabulate(self, found: Collected) -> Tables:
        """Runs, means over seeds, laws in the size, places of thresholds, and how clusters grow."""
        runs = runs_table(found).sort_values([ASPECT, COUNT, SEED], ignore_index=True, kind="stable")
        means = [
            {
                ASPECT: ratio,
                COUNT: count,
                RADIUS: group[RADIUS].iloc[0],
                **seeds_of(group),
                **averaged(group, QUANTITIES),
            }
            for (ratio, count), group in runs.groupby([ASPECT, COUNT])
        ]
        return {
            "runs": runs,
            "points": pd.DataFrame(means),
            "laws": scalings(runs),
            "thresholds": thresholds(runs),
            "growth": growths(runs),
        }

    def judge(self, tables: Tables) -> tuple[Question, ...]:
        """Answers to the study's questions."""
        return answers(tables["runs"], tables["thresholds"], tables["growth"])

    def reference_of(self, tables: Tables) -> Reference:
        """Nothing."""
        return NOTHING

    def statements(self, analysis: Analysis[Question]) -> tuple[str, ...]:
        """Which runs, what is measured, and how errors come about."""
        return (
            self.about_points(analysis),
            f"φ by {DEFINITION} unless said otherwise; all measures of the last frame of a rest. Clusters: smarticles "
            "of which one passes through the other's plane.",
            "Laws q_∞ + a N^(-1/3): least squares, weights by a scatter that is a power of N, fitted within sizes; "
            "where the law leaves more than scatter, errors are larger by the square root of the ratio. A power of N "
            "is told from 1/3 where its 95 % interval lies within 1/6 and 2/3.",
            "Thresholds: logistic function of its own width at each size, profile likelihood, 95 %; one for all sizes "
            "against one for each by the ratio of likelihoods, refused below p = 0.05.",
        )

    def text(self, analysis: Analysis[Question]) -> Sequence[str]:
        """Answers, points, laws, thresholds, and what columns are."""
        tables = analysis.tables
        laws = [
            [
                f"{row[ASPECT]:g}",
                str(row[QUANTITY]).removesuffix(" [-]"),
                str(row[SIZES]),
                told_number(row[BULK], ".4f", row[BULK_BAR]),
                told_number(row[SLOPE], "+.3f", row[SLOPE_BAR]),
                told_number(row[EXCESS], ".2g"),
                told_number(row[REFUSED], ".2g"),
                f"{row[POWER_BEST]:.2f} ({row[POWER_LOW]:.2f} to {row[POWER_HIGH]:.2f})",
            ]
            for _, row in tables["laws"].iterrows()
        ]
        header, rows = self.table(analysis)
        return [
            "# Finite size: 100 to 10 000 smarticles",
            "",
            *questions_lines(analysis.judged),
            "",
            "## Points",
            "",
            "Means over seeds ± 95 %; how many of the piles are spanned.",
            "",
            *table_lines(header, rows),
            "",
            "## Laws",
            "",
            "q_∞ + a N^(-1/3), ± 95 %; what it leaves of means over what scatter explains; p, were it true; the power "
            "of N that fits best, 95 %.",
            "",
            *table_lines(["l/w", "quantity", "sizes", "q_∞", "a", "left", "p", "power"], laws),
            *meaning_lines("runs.csv", QUANTITIES),
        ]

    def about_points(self, analysis: Analysis[Question]) -> str:
        """Sizes, seeds, and the piles' shape."""
        runs, points = analysis.tables["runs"], analysis.tables["points"]
        counts = " ".join(str(count) for count in sorted(runs[COUNT].unique()))
        ratios = " ".join(f"{ratio:g}" for ratio in sorted(runs[ASPECT].unique()))
        time = runs["time shaken [s]"].median()
        return (
            f"l/w {ratios}, N {counts}, {told_seeds(runs, points['seeds [-]'], 'point')}, shaken for {time:g} s; "
            f"radius 2 w at {PAPER_COUNT} smarticles of l/w {PAPER_ASPECT:g}, as the cube root of N."
        )

    def draw(self, output: Path, analysis: Analysis[Question], footer: Sequence[str]) -> Sequence[Path]:
        """φ and ⟨N⟩ against the size, and the entanglement graph against l/w."""
        tables = analysis.tables
        return figures.draw(output, runs=tables["runs"], points=tables["points"], footer=footer)

    def table(self, analysis: Analysis[Question]) -> tuple[list[str], list[list[str]]]:
        """Every point."""
        header = ["l/w", "N", "seeds", *(name for name, _ in _SHOWN.values()), *_SPANS.values()]
        rows = []
        for _, row in analysis.tables["points"].iterrows():
            seeds = int(row["seeds [-]"])
            cells = [told_number(row[name], form, row[marked(name, "95 %")]) for name, (_, form) in _SHOWN.items()]
            spanned = [f"{round(seeds * row[name])}/{seeds}" for name in _SPANS]
            rows.append([f"{row[ASPECT]:g}", str(row[COUNT]), str(seeds), *cells, *spanned])
        return header, rows
