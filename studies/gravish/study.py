"""The study `gravish`: packing fraction before and after shaking, against Gravish et al. 2012.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012):
steel staples shaken vertically at 30 Hz and a peak acceleration of 2 g for 20 s. Their points are
digitised (`reference/README.md`); they are compared at equal l/w only and never interpolated.
How errors and answers come about is in `studies.gravish.findings`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from postprocess.measures.packing import DEFINITIONS
from postprocess.report.markdown import table_lines
from postprocess.statistics.points import told_number
from studies.base.origin import Origin, make_folder
from studies.base.runs import (
    ASPECT,
    DEFINITION,
    SEED,
    SEEDS,
    STAGES,
    WHEN,
    MissingRun,
    collect_runs,
    measured_row,
    refuse_repeats,
    runs_table,
    told_bars,
    told_seeds,
    told_shaken,
)
from studies.gravish import figures as gravish_figures
from studies.gravish.findings import (
    Verdict,
    answers,
    deviations_from_reference,
    steps_between_ratios,
    summarise_runs,
)
from studies.base.references import DIGITISING_ERROR, SHAKE_TIME, read_reference

_STUDY = "gravish"


@dataclass(frozen=True, kw_only=True, eq=False)
class GravishReport:
    """Tables, answers and files of the study.

    Attributes:
        runs: One row per finished run.
        summary: One row per aspect ratio: means over seeds with errors, and Gravish's values.
        deviations: One row per point that Gravish has as well.
        steps: One row per pair of neighbouring aspect ratios and stage: does φ fall?
        verdicts: Answers to the study's questions.
        missing: Runs that were given and are not in the tables.
        footer: What every figure and table says about its origin, one statement each.
        files: Everything that was written, by name.
    """

    runs: pd.DataFrame = field(repr=False)
    summary: pd.DataFrame = field(repr=False)
    deviations: pd.DataFrame = field(repr=False)
    steps: pd.DataFrame = field(repr=False)
    verdicts: tuple[Verdict, ...]
    missing: tuple[MissingRun, ...]
    footer: tuple[str, ...] = field(repr=False)
    files: Mapping[str, Path] = field(repr=False)


def analyse_gravish(
    run_dirs: Sequence[Path | str],
    output: Path | str,
    *,
    note: str,
    command: str,
    definitions: Sequence[str] = tuple(DEFINITIONS),
) -> GravishReport:
    """Measures the runs of the study and writes its tables and figures.

    Runs that are not done, or cannot be read, are listed as missing. Files of an earlier analysis
    in the same folder are replaced.

    Args:
        run_dirs: Run directories; any subset of the study.
        output: Folder for the results; made if needed.
        note: How these runs differ from the full study; stands in every footer.
        command: Command line to state as the origin.
        definitions: Definitions of the packing fraction to tabulate, keys of
            `packing.DEFINITIONS`; the one that is compared is always among them. Those in
            `packing.COSTLY_DEFINITIONS` take seconds per run.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, the runs differ in fidelity, an unknown
            definition, or the output is no folder.
    """
    unknown = set(definitions) - set(DEFINITIONS)
    if unknown:
        msg = f"unknown definition '{min(unknown)}' of φ: choose from {', '.join(DEFINITIONS)}"
        raise InputError(msg)
    output = make_folder(output)
    manifests, rows, missing = collect_runs(_STUDY, run_dirs, lambda run: measured_row(run, definitions))
    refuse_repeats(_STUDY, manifests, "l/w", lambda run: f"{run.aspect_ratio:.6g}")
    runs = runs_table(rows).sort_values([ASPECT, SEED], ignore_index=True)
    reference = read_reference()
    summary = summarise_runs(runs, reference)
    deviations, steps = deviations_from_reference(summary), steps_between_ratios(summary)
    verdicts = answers(runs, summary, deviations, steps)
    origin = Origin(study=_STUDY, manifests=manifests, missing=missing, note=note, command=command)
    footer = _footer(origin, runs)
    files = origin.write(
        output,
        footer,
        tables={
            "runs": runs,
            "summary": summary,
            "deviations": deviations,
            "steps": steps,
            "verdicts": pd.DataFrame([asdict(verdict) for verdict in verdicts]),
        },
        text=("deviations.md", _markdown(deviations, verdicts)),
        draw=lambda: gravish_figures.draw(
            output,
            summary=summary,
            reference=reference,
            manifests=manifests,
            definition=DEFINITION,
            reading_error=DIGITISING_ERROR,
            footer=footer,
        ),
    )
    return GravishReport(
        runs=runs,
        summary=summary,
        deviations=deviations,
        steps=steps,
        verdicts=verdicts,
        missing=missing,
        footer=footer,
        files=files,
    )


def _footer(origin: Origin, runs: pd.DataFrame) -> tuple[str, ...]:
    counts = runs.groupby(ASPECT).size()
    ratios = " ".join(f"{ratio:g}" for ratio in counts.index)
    return origin.footer(
        f"l/w {ratios}, {told_seeds(runs, counts, 'l/w')}; shaken for {told_shaken(runs)} (Gravish: {SHAKE_TIME:g} s).",
        f"φ by {DEFINITION} unless named otherwise; {WHEN} (voxel and voronoi: the last frame). "
        f"{told_bars(counts, 'l/w')}.",
    )


def _markdown(deviations: pd.DataFrame, verdicts: Sequence[Verdict]) -> list[str]:
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
    return [
        "# Packing of shaken smarticles against Gravish et al. 2012",
        "",
        "## Verdicts",
        "",
        *table_lines(["question", "answer", "evidence"], [(v.question, v.answer, v.evidence) for v in verdicts]),
        "",
        "## Mean absolute deviation",
        "",
        *table_lines(["stage", "meaning", "points", "mean absolute", "mean, signed", "largest"], stages),
        "",
        "## Points",
        "",
        *table_lines(["stage", "l/w", "seeds", "φ", "Gravish", "deviation"], points),
    ]
