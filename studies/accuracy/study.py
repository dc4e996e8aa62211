"""What accuracy costs in time: the ladder of one scene, measured, and the advice that follows from it.

What is measured of a run, and how errors and their bands come about, is in `studies.accuracy.runs`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.measures.packing import DEFINITIONS
from postprocess.measures.table import LAST_FRAMES
from postprocess.report.markdown import table_lines
from postprocess.statistics.points import ToldTable, marked, told_number
from studies.accuracy import figure as accuracy_figure
from studies.accuracy.advice import Advice, advise, label, told_closing, told_error
from studies.accuracy.runs import (
    ACTIVITY,
    COMPARED,
    COST,
    GAP,
    IS_REFERENCE,
    KNOB,
    RESIDUAL,
    SYMBOLS,
    VERDICT,
    Rung,
    accuracy_row,
    measured,
    work_precision,
)
from studies.base.origin import Origin, Reference, make_folder
from studies.base.runs import (
    ASPECT,
    DEFINITION,
    SEEDS,
    VARIANT,
    MissingRun,
    collect_runs,
    named_variant,
    refuse_mixture,
    refuse_repeats,
    runs_table,
    told_seeds,
)

TABLE = "work_precision"
"""Name of the table, without suffix."""

_STUDY = "accuracy"
_FORMS = {"phi_0": ".4f", "phi_f": ".4f", "height": ".2e", "crossings": ".2f", "hook_force": ".2f"}


@dataclass(frozen=True, kw_only=True, eq=False)
class AccuracyReport:
    """Tables, advice and files of a ladder.

    Attributes:
        runs: One row per finished run.
        table: One row per rung, see `accuracy_runs.work_precision`.
        advice: One per knob.
        closing: What to do, in one sentence or a few.
        missing: Runs that were given and are not in the tables.
        footer: What figure and tables say about their origin, one statement each.
        files: Everything that was written, by name.
    """

    runs: pd.DataFrame = field(repr=False)
    table: pd.DataFrame = field(repr=False)
    advice: tuple[Advice, ...]
    closing: str
    missing: tuple[MissingRun, ...]
    footer: tuple[str, ...] = field(repr=False)
    files: Mapping[str, Path] = field(repr=False)


def analyse_accuracy(
    run_dirs: Sequence[Path | str],
    output: Path | str,
    *,
    rungs: Sequence[Rung],
    expected_s: Mapping[str, float] | None = None,
    note: str,
    command: str,
) -> AccuracyReport:
    """Measures the runs of a ladder and writes its tables and its figure.

    Runs that are not done, or cannot be read, are listed as missing. Files of an earlier analysis in the same folder
    are replaced.

    Args:
        run_dirs: Run directories named `SETTING_seedN`.
        output: Folder for the results; made if needed.
        rungs: Each knob's rungs from coarse to fine.
        expected_s: Expected wall time of a run by its name, for the ratio of measured to expected [s].
        note: What the ladder is of; stands in the footer.
        command: Command line to state as the origin.

    Returns:
        The report.

    Raises:
        InputError: No run is done, a run is given twice, the runs differ in aspect ratio, number of smarticles or
            phases, or the output is no folder.
    """
    output = make_folder(output)
    row = partial(accuracy_row, expected_s=expected_s or {})
    manifests, rows, missing = collect_runs(_STUDY, run_dirs, row, one_fidelity=False)
    refuse_mixture(_STUDY, manifests, "l/w", lambda run: f"{run.aspect_ratio:g}")
    refuse_mixture(_STUDY, manifests, "count", lambda run: f"{run.count} smarticles")
    refuse_mixture(_STUDY, manifests, "phases", lambda run: " ".join(phase.type for phase in run.phases))
    refuse_repeats(_STUDY, manifests, "setting", lambda run: named_variant(run.directory)[0])
    runs = runs_table(rows)
    table = work_precision(runs, rungs)
    advice = tuple(advise(rows) for _, rows in table.groupby(KNOB, sort=False))
    closing = told_closing(advice, table)
    origin = Origin(
        study=_STUDY, manifests=manifests, missing=missing, note=note, command=command, reference=_named(table)
    )
    footer = _footer(origin, runs, table)
    files = origin.write(
        output,
        footer,
        tables={"runs": runs, TABLE: table},
        text=("accuracy.md", _markdown(manifests[0], table, advice, closing)),
        draw=lambda: accuracy_figure.draw(output / "accuracy", table=table, footer=footer),
    )
    return AccuracyReport(
        runs=runs, table=table, advice=advice, closing=closing, missing=missing, footer=footer, files=files
    )


def _named(table: pd.DataFrame) -> Reference:
    """The reference of every knob."""
    own = table[table[VERDICT] == IS_REFERENCE]
    named = {row[KNOB]: row for _, row in own.iterrows()}
    told = ", ".join(f"{knob} {label(row)}" for knob, row in named.items()) or "none, no run of a knob is finished"
    return Reference(
        statement=f"of each knob its finest rung with finished runs, or the scene itself for a sensitivity: {told}",
        facts=MappingProxyType({str(knob): str(row[VARIANT]) for knob, row in named.items()}),
    )


def told_rungs(table: pd.DataFrame) -> ToldTable:
    """The table of work and precision for a person to read."""
    header = ["knob", "value", "seeds", "cpu s per s", "± SE"]
    names = measured(table)
    for name in names:
        header += [SYMBOLS[name], "error %"]
    more = {RESIDUAL: "energy residual", GAP: "joint gap [m]"}
    shown = {column: label for column, label in more.items() if table[column].notna().any()}
    rows = []
    for _, row in table.iterrows():
        cells = [str(row[KNOB]), label(row), str(row[SEEDS])]
        cells += [told_number(row[COST], ".3g"), told_number(row[marked(COST, "SE")], ".2g")]
        for name in names:
            column = COMPARED[name]
            cells.append(told_number(row[column], _FORMS[name], row[marked(column, "SE")]))
            cells.append("reference" if row[VERDICT] == IS_REFERENCE else told_error(row, name))
            if row[f"{name} resolved"]:
                cells[-1] += " *"
        rows.append([*cells, *(told_number(row[column], ".2g") for column in shown), str(row[VERDICT])])
    return [*header, *shown.values(), "verdict"], rows


def _footer(origin: Origin, runs: pd.DataFrame, table: pd.DataFrame) -> tuple[str, ...]:
    counts = runs.groupby(VARIANT, sort=False).size()
    judged = int(
        table[[f"{name} error 95 % [%]" for name in COMPARED]][table[VERDICT] != IS_REFERENCE].notna().sum().sum()
    )
    return origin.footer(
        f"l/w = {runs[ASPECT].iloc[0]:g}, {origin.manifests[0].count} smarticles, "
        f"{told_seeds(runs, counts, 'setting')}; activity: {runs[ACTIVITY].iloc[0]}.",
        f"φ by {DEFINITION} ({DEFINITIONS[DEFINITION]}); φ_0 and h_0, the height of the centre of mass, before the "
        "first activity, φ_f and ⟨N⟩ at the end of the last one, means over the last "
        f"{LAST_FRAMES} frames or fewer of the phase.",
        "Errors are relative to the knob's reference, their bands 95 % by Student's t, with the scatter from seed "
        "to seed pooled over all settings; an error within its band "
        "is not resolved. Where a knob changes nothing at all, one error in twenty is still beyond its band; "
        f"{judged} were judged. ± without a name is a standard error over seeds.",
        "Processor time: of the last activity over its simulated time, one thread per run; runs side by side slow "
        "each other's memory.",
    )


def _markdown(run: RunManifest, table: pd.DataFrame, advice: Sequence[Advice], closing: str) -> list[str]:
    lines = [f"# What accuracy costs: {run.count} smarticles of l/w = {run.aspect_ratio:g}", ""]
    lines += [f"**{closing}**", "", *(f"- {one.sentence}" for one in advice), ""]
    lines += ["Errors against the knob's reference; * beyond their band.", ""]
    return [*lines, *table_lines(*told_rungs(table))]
