"""The study `gravish`: packing fraction before and after shaking, against Gravish et al. 2012.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012):
steel staples shaken vertically at 30 Hz and a peak acceleration of 2 g for 20 s. Their points are
digitised (`reference/README.md`); they are compared at equal l/w only and never interpolated.
How errors and answers come about is in `studies.gravish.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.measures.packing import DEFINITIONS
from postprocess.report.markdown import table_lines
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.points import told_number
from studies.base.questions import Question, QuestionStudy
from studies.base.study import Analysis, Tables
from studies.framework.engines import (
    TOLD,
    by_engine,
    compared_engines,
    engine_lines,
    engines_of,
    judging,
    of_engine,
    told_engines,
)
from studies.framework.provenance import GRAVISH, SHAKE_TIME, Reference, read_reference
from studies.framework.runs import DEFINITION, ENGINE, Collected, MeasuredRun, runs_table, told_bars, told_seeds
from studies.framework.shaken import SHAKEN, STAGES, WHEN, measured_row, told_shaken
from studies.gravish import figures
from studies.gravish.findings import (
    answers,
    deviations_from_reference,
    steps_between_ratios,
    summarise_runs,
)

COMPARED = (
    *(f"{stage} {DEFINITION} [-]" for stage in STAGES),
    *(f"crossings {when} [-]" for when in ("before", "after", "relaxed")),
)
"""What is compared between engines: columns of the table of runs."""


class Gravish(QuestionStudy):
    """Runs that were poured and shaken.

    Args:
        definitions: Definitions of the packing fraction to tabulate, keys of `packing.DEFINITIONS`; the one that is
            compared is always among them. Those in `packing.COSTLY_DEFINITIONS` take seconds per run.

    Raises:
        InputError: A definition is unknown.
    """

    name = "gravish"
    text_name = "deviations.md"
    answers_name = "verdicts"
    one_engine = False

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
        runs = runs_table(found).sort_values([ASPECT, SEED], ignore_index=True, kind="stable")
        reference = read_reference()
        summary = by_engine(runs, lambda part: summarise_runs(part, reference))
        tables = {
            "runs": runs,
            "summary": summary,
            "deviations": by_engine(summary, deviations_from_reference),
            "steps": by_engine(summary, steps_between_ratios),
        }
        if engines_of(runs):
            # Piles that were shaken for different times agree before shaking at most.
            before = [name for name in COMPARED if "phi_0" in name or "before" in name]
            after = [name for name in COMPARED if name in runs.columns and name not in before]
            tables["engines"] = pd.concat(
                [
                    compared_engines(runs, [ASPECT], before),
                    compared_engines(runs, [ASPECT], after, alike=[SHAKEN]),
                ],
                ignore_index=True,
            )
        return tables

    def judge(self, tables: Tables) -> tuple[Question, ...]:
        """Answers to the study's questions, by the engine that judges."""
        return answers(*(judging(tables[name]) for name in ("runs", "summary", "deviations", "steps")))

    def reference_of(self, tables: Tables) -> Reference:
        """Gravish's packing fractions."""
        return GRAVISH

    def statements(self, analysis: Analysis[Question]) -> tuple[str, ...]:
        """Which runs, and how φ is taken."""
        every = analysis.tables["runs"]
        runs = judging(every)
        counts = runs.groupby(ASPECT).size()
        others = told_engines(every)
        ratios = " ".join(f"{ratio:g}" for ratio in counts.index)
        return (
            f"l/w {ratios}, {told_seeds(runs, counts, 'l/w')}; shaken for {told_shaken(runs)} "
            f"(Gravish: {SHAKE_TIME:g} s).",
            *([others, *_others_shaken(every)] if others else []),
            f"φ by {DEFINITION} unless named otherwise; {WHEN} (voxel and voronoi: the last frame). "
            f"{told_bars(counts, 'l/w')}.",
        )

    def text(self, analysis: Analysis[Question]) -> Sequence[str]:
        """Answers, and deviations by stage and point."""
        deviations = analysis.tables["deviations"]
        stages = []
        for stage, part in judging(deviations).groupby("stage", sort=False):
            percent = part["deviation [%]"]
            largest = percent.loc[percent.abs().idxmax()]
            numbers = [f"{percent.abs().mean():.1f} %", f"{percent.mean():+.1f} %", f"{largest:+.1f} %"]
            stages.append([str(stage), STAGES[str(stage)], str(len(part)), *numbers])
        points = [
            [
                *_engine_cell(row),
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
            *table_lines([*_engine_header(deviations), "stage", "l/w", "seeds", "φ", "Gravish", "deviation"], points),
            *engine_lines(analysis.tables.get("engines"), {"l/w": lambda row: f"{row[ASPECT]:g}"}),
        ]

    def about_points(self, analysis: Analysis[Question]) -> str:
        """Seeds, and what φ is."""
        every = analysis.tables["runs"]
        runs = judging(every)
        seeds = told_seeds(runs, runs.groupby(ASPECT).size(), "l/w")
        others = _others_shaken(every) if told_engines(every) else []
        return " ".join([f"{seeds}; shaken for {told_shaken(runs)}; φ by {DEFINITION}.", *others])

    def draw(self, output: Path, analysis: Analysis[Question], footer: Sequence[str]) -> Sequence[Path]:
        """φ and crossings against l/w, and φ against time."""
        return figures.draw(
            output,
            summary=analysis.tables["summary"],
            reference=read_reference(),
            manifests=analysis.found.manifests,
            definition=DEFINITION,
            footer=footer,
        )

    def table(self, analysis: Analysis[Question]) -> tuple[Sequence[str], Sequence[Sequence[object]]]:
        """Deviations from Gravish's points."""
        deviations = analysis.tables["deviations"]
        rows = [
            [
                *_engine_cell(row),
                row["stage"],
                row[ASPECT],
                row[SEEDS],
                f"{row['phi [-]']:.4f}",
                f"{row['phi 95 % [-]']:.4f}",
                f"{row['phi Gravish [-]']:.4f}",
                f"{row['deviation [%]']:+.1f}",
            ]
            for row in deviations.to_dict("records")
        ]
        return [*_engine_header(deviations), "φ", "l/w", "seeds", "here", "± 95 %", "Gravish", "deviation %"], rows


def _engine_header(table: pd.DataFrame) -> list[str]:
    return [ENGINE] if ENGINE in table.columns else []


def _engine_cell(row: pd.Series | dict[str, object]) -> list[object]:
    return [row[ENGINE]] if ENGINE in row else []


def _others_shaken(runs: pd.DataFrame) -> list[str]:
    """How long the runs of the other engines were shaken, where it is another time."""
    first, *others = engines_of(runs)
    own = told_shaken(of_engine(runs, first))
    times = {TOLD[name]: told_shaken(of_engine(runs, name)) for name in others}
    return [f"{name} was shaken for {time}." for name, time in times.items() if time != own]
