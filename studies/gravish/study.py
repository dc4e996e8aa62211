"""The study `gravish`: packing fraction before and after shaking, against Gravish et al. 2012.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012):
steel staples shaken vertically at 30 Hz and a peak acceleration of 2 g for 20 s. Their points are
digitised (`reference/README.md`); they are compared at equal l/w only and never interpolated.
How errors and answers come about is in `studies.gravish.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.measures.packing import DEFINITIONS
from postprocess.report.markdown import table_lines
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.points import told_number
from studies.base.references import DIGITISING_ERROR, GRAVISH, SHAKE_TIME, Reference, read_reference
from studies.base.runs import DEFINITION, Collected, MeasuredRun, runs_table, told_bars, told_seeds
from studies.base.shaken import STAGES, WHEN, measured_row, told_shaken
from studies.base.study import Analysis, Study, Tables
from studies.gravish import figures
from studies.gravish.findings import (
    Question,
    answers,
    deviations_from_reference,
    steps_between_ratios,
    summarise_runs,
)


class Gravish(Study[Question]):
    """Runs that were poured and shaken.

    Args:
        definitions: Definitions of the packing fraction to tabulate, keys of `packing.DEFINITIONS`; the one that is
            compared is always among them. Those in `packing.COSTLY_DEFINITIONS` take seconds per run.

    Raises:
        InputError: A definition is unknown.
    """

    name = "gravish"
    text_name = "deviations.md"

    def __init__(self, definitions: Sequence[str] = tuple(DEFINITIONS)) -> None:
        unknown = set(definitions) - set(DEFINITIONS)
        if unknown:
            msg = f"unknown definition '{min(unknown)}' of φ: choose from {', '.join(DEFINITIONS)}"
            raise InputError(msg)
        self.definitions = tuple(definitions)

    def measure(self, run: RunManifest) -> MeasuredRun:
        """φ and crossings before and after shaking."""
        return MeasuredRun(manifest=run, rows=[measured_row(run, self.definitions)])

    def refuse(self, found: Collected) -> None:
        """An aspect ratio and seed twice."""
        found.refuse_repeats("l/w", lambda run: f"{run.manifest.aspect_ratio:.6g}")

    def tabulate(self, found: Collected) -> Tables:
        """Runs, means over seeds, deviations from Gravish's points, and steps between neighbouring aspect ratios."""
        runs = runs_table(found).sort_values([ASPECT, SEED], ignore_index=True)
        summary = summarise_runs(runs, read_reference())
        return {
            "runs": runs,
            "summary": summary,
            "deviations": deviations_from_reference(summary),
            "steps": steps_between_ratios(summary),
        }

    def judge(self, tables: Tables) -> tuple[Question, ...]:
        """Answers to the study's questions."""
        return answers(tables["runs"], tables["summary"], tables["deviations"], tables["steps"])

    def judged_tables(self, judged: tuple[Question, ...]) -> Tables:
        """`verdicts.csv`."""
        return {"verdicts": pd.DataFrame([asdict(one) for one in judged])}

    def reference_of(self, tables: Tables) -> Reference:
        """Gravish's packing fractions."""
        return GRAVISH

    def statements(self, analysis: Analysis[Question]) -> tuple[str, ...]:
        """Which runs, and how φ is taken."""
        runs = analysis.tables["runs"]
        counts = runs.groupby(ASPECT).size()
        ratios = " ".join(f"{ratio:g}" for ratio in counts.index)
        return (
            f"l/w {ratios}, {told_seeds(runs, counts, 'l/w')}; shaken for {told_shaken(runs)} "
            f"(Gravish: {SHAKE_TIME:g} s).",
            f"φ by {DEFINITION} unless named otherwise; {WHEN} (voxel and voronoi: the last frame). "
            f"{told_bars(counts, 'l/w')}.",
        )

    def text(self, analysis: Analysis[Question]) -> Sequence[str]:
        """Answers, and deviations by stage and point."""
        deviations = analysis.tables["deviations"]
        stages = []
        for stage, part in deviations.groupby("stage", sort=False):
            percent = part["deviation [%]"]
            largest = percent.loc[percent.abs().idxmax()]
            numbers = [f"{percent.abs().mean():.1f} %", f"{percent.mean():+.1f} %", f"{largest:+.1f} %"]
            stages.append([str(stage), STAGES[str(stage)], str(len(part)), *numbers])
        points = [
            [
                row["stage"],
                f"{row[ASPECT]:g}",
                str(row[SEEDS]),
                told_number(row["phi [-]"], ".4f", row["phi 95 % [-]"]),
                f"{row['phi Gravish [-]']:.4f}",
                f"{row['deviation [%]']:+.1f} %",
            ]
            for _, row in deviations.iterrows()
        ]
        judged = [(one.question, one.answer, one.evidence) for one in analysis.judged]
        return [
            "# Packing of shaken smarticles against Gravish et al. 2012",
            "",
            "## Verdicts",
            "",
            *table_lines(["question", "answer", "evidence"], judged),
            "",
            "## Mean absolute deviation",
            "",
            *table_lines(["stage", "meaning", "points", "mean absolute", "mean, signed", "largest"], stages),
            "",
            "## Points",
            "",
            *table_lines(["stage", "l/w", "seeds", "φ", "Gravish", "deviation"], points),
        ]

    def draw(self, output: Path, analysis: Analysis[Question], footer: Sequence[str]) -> Sequence[Path]:
        """φ and crossings against l/w, and φ against time."""
        return figures.draw(
            output,
            summary=analysis.tables["summary"],
            reference=read_reference(),
            manifests=analysis.found.manifests,
            definition=DEFINITION,
            reading_error=DIGITISING_ERROR,
            footer=footer,
        )

    def table(self, analysis: Analysis[Question]) -> tuple[Sequence[str], Sequence[Sequence[object]]]:
        """Deviations from Gravish's points."""
        rows = [
            [
                row["stage"],
                row[ASPECT],
                row[SEEDS],
                f"{row['phi [-]']:.4f}",
                f"{row['phi 95 % [-]']:.4f}",
                f"{row['phi Gravish [-]']:.4f}",
                f"{row['deviation [%]']:+.1f}",
            ]
            for row in analysis.tables["deviations"].to_dict("records")
        ]
        return ["φ", "l/w", "seeds", "here", "± 95 %", "Gravish", "deviation %"], rows

    def told(self, analysis: Analysis[Question]) -> Sequence[str]:
        """Questions with their answers."""
        return [f"{one.question} {one.answer.upper()}\n    {one.evidence}" for one in analysis.judged]
