"""What accuracy costs in time: the ladder of one scene, measured, and the advice that follows from it.

What is measured of a run, and how errors and their bands come about, is in `studies.accuracy.measure`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from dem.record.manifest import RunManifest
from postprocess.measures.packing import DEFINITIONS
from postprocess.measures.table import LAST_FRAMES
from postprocess.report.markdown import table_lines
from postprocess.statistics.columns import ASPECT, SEEDS
from postprocess.statistics.points import ToldTable, marked, told_number
from studies.accuracy import figures
from studies.accuracy.advice import Advice, advise, label, told_closing, told_error
from studies.accuracy.measure import (
    ACTIVITY,
    COMPARED,
    COST,
    GAP,
    IS_REFERENCE,
    KNOB,
    RESIDUAL,
    SYMBOLS,
    VERDICT,
    accuracy_row,
    measured,
    work_precision,
)
from studies.accuracy.rung import Rung
from studies.base.study import Analysis, Study, Tables
from studies.base.variants import VARIANT
from studies.framework.provenance import Reference
from studies.framework.runs import DEFINITION, Collected, MeasuredRun, runs_table, told_seeds

TABLE = "work_precision"
"""Name of the table, without suffix."""

_FORMS = {"phi_0": ".4f", "phi_f": ".4f", "height": ".2e", "crossings": ".2f", "hook_force": ".2f"}


class Accuracy(Study[Advice]):
    """Runs of the variants of one scene, named `SETTING_seedN`; its judgements are an advice for each knob.

    Args:
        rungs: Each knob's rungs from coarse to fine.
        expected_s: Expected wall time of a run by its name, for the ratio of measured to expected [s].
    """

    name = "accuracy"
    text_name = "accuracy.md"
    one_fidelity = False
    one_engine = False

    def __init__(self, *, rungs: Sequence[Rung], expected_s: Mapping[str, float] = MappingProxyType({})) -> None:
        self.rungs = tuple(rungs)
        self.expected_s = expected_s

    def measure(self, run: RunManifest) -> MeasuredRun:
        """What a run cost, and what is compared."""
        return MeasuredRun(manifest=run, rows=[accuracy_row(run, self.expected_s)])

    def refuse(self, found: Collected) -> None:
        """Other aspect ratios, numbers of smarticles or phases, a setting and seed twice."""
        found.refuse_mixture("l/w", lambda run: f"{run.manifest.aspect_ratio:g}")
        found.refuse_other_counts()
        found.refuse_mixture("phases", lambda run: " ".join(phase.type for phase in run.manifest.phases))
        found.refuse_repeats("setting", lambda run: str(run.row[VARIANT]))

    def tabulate(self, found: Collected) -> Tables:
        """Runs, and the table of work and precision."""
        runs = runs_table(found)
        return {"runs": runs, TABLE: work_precision(runs, self.rungs)}

    def judge(self, tables: Tables) -> tuple[Advice, ...]:
        """One advice per knob."""
        return tuple(advise(rows) for _, rows in tables[TABLE].groupby(KNOB, sort=False))

    def reference_of(self, tables: Tables) -> Reference:
        """The reference of every knob."""
        table = tables[TABLE]
        named = {row[KNOB]: row for _, row in table[table[VERDICT] == IS_REFERENCE].iterrows()}
        told = ", ".join(f"{knob} {label(row)}" for knob, row in named.items())
        told = told or "none, no run of a knob is finished"
        return Reference(
            statement=f"of each knob its finest rung with finished runs, or the scene itself for a sensitivity: {told}",
            facts=MappingProxyType({str(knob): str(row[VARIANT]) for knob, row in named.items()}),
        )

    def statements(self, analysis: Analysis[Advice]) -> tuple[str, ...]:
        """Which runs, what is compared, what errors are against, and what costs are."""
        runs, table = analysis.tables["runs"], analysis.tables[TABLE]
        counts = runs.groupby(VARIANT, sort=False).size()
        bands = table[[f"{name} error 95 % [%]" for name in COMPARED]]
        judged = int(bands[table[VERDICT] != IS_REFERENCE].notna().sum().sum())
        return (
            f"l/w = {runs[ASPECT].iloc[0]:g}, {analysis.found.manifests[0].count} smarticles, "
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

    def text(self, analysis: Analysis[Advice]) -> Sequence[str]:
        """What to do, and the table."""
        run = analysis.found.manifests[0]
        return [
            f"# What accuracy costs: {run.count} smarticles of l/w = {run.aspect_ratio:g}",
            "",
            f"**{told_closing(analysis.judged, analysis.tables[TABLE])}**",
            "",
            *(f"- {one.sentence}" for one in analysis.judged),
            "",
            "Errors against the knob's reference; * beyond their band.",
            "",
            *table_lines(*self.table(analysis)),
        ]

    def about_points(self, analysis: Analysis[Advice]) -> str:
        """Seeds, what is done, and what errors are of."""
        runs = analysis.tables["runs"]
        seeds = told_seeds(runs, runs.groupby(VARIANT, sort=False).size(), "setting")
        return f"{seeds}; activity: {runs[ACTIVITY].iloc[0]}; φ by {DEFINITION}; errors against the knob's reference."

    def draw(self, output: Path, analysis: Analysis[Advice], footer: Sequence[str]) -> Sequence[Path]:
        """Errors against costs."""
        return figures.draw(output / "accuracy", table=analysis.tables[TABLE], footer=footer)

    def table(self, analysis: Analysis[Advice]) -> ToldTable:
        """The table of work and precision."""
        table = analysis.tables[TABLE]
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

    def told(self, analysis: Analysis[Advice]) -> Sequence[str]:
        """What each knob's rungs say, and what to do."""
        closing = told_closing(analysis.judged, analysis.tables[TABLE])
        sentences = (one.sentence for one in analysis.judged)
        return ["* beyond the seed-to-seed band, 95 %.", "", *sentences, "", closing]
