"""The study `engines`: whether links and chains of spheres on YADE say the same.

Both engines pour the same seeds from the same poses. What is measured is in `studies.engines.measure`, margins and
verdicts are in `studies.engines.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dem.record.manifest import RunManifest
from postprocess.report.markdown import meaning_lines, table_lines
from postprocess.statistics.columns import SEED
from postprocess.statistics.points import told_number
from studies.base.study import Analysis, Study, Tables
from studies.engines import figures
from studies.engines.findings import CRITERION, PITCH, Equivalence, equivalence_table, judged, refinement
from studies.engines.measure import CASE, CASES, COLUMNS, VARIANT, engines_row
from studies.framework.provenance import Reference
from studies.framework.runs import Collected, MeasuredRun, told_numbers

_HEADER = ("quantity", "pairs", "links", "YADE", "difference ± 95 %", "margin", "verdict")


class Engines(Study[Equivalence]):
    """The same seeds on both engines."""

    name = "engines"
    text_name = "equivalence.md"
    one_engine = False

    def measure(self, run: RunManifest) -> MeasuredRun:
        """What its case tells."""
        return MeasuredRun(manifest=run, rows=[engines_row(run)])

    def refuse(self, found: Collected) -> None:
        """Other numbers of smarticles in one case, a case, variant and seed twice."""
        found.refuse_mixture(
            "count", lambda run: f"{run.manifest.count} smarticles", within=lambda run: str(run.row[CASE])
        )
        found.refuse_repeats("case", lambda run: f"{run.row[CASE]} {run.row[VARIANT]}")

    def tabulate(self, found: Collected) -> Tables:
        """Runs, differences, and means by pitch."""
        runs = found.table().dropna(axis="columns", how="all")
        for name in COLUMNS:
            if name not in runs.columns:
                runs[name] = float("nan")
        ranks = {case: rank for rank, case in enumerate(CASES)}
        order = runs.assign(rank=runs[CASE].map(ranks)).sort_values(["rank", VARIANT, SEED], kind="stable").index
        runs = runs.loc[order].reset_index(drop=True)
        return {"runs": runs, "pitch": refinement(runs)}

    def judge(self, tables: Tables) -> tuple[Equivalence, ...]:
        """Each quantity against its margin."""
        return judged(tables["runs"])

    def judged_tables(self, judged: tuple[Equivalence, ...]) -> Tables:
        """`equivalence.csv`."""
        return {"equivalence": equivalence_table(judged)}

    def reference_of(self, tables: Tables) -> Reference:
        """The other engine."""
        return Reference(statement="chains of spheres on YADE, the same seeds", facts={"what": "engine yade"})

    def statements(self, analysis: Analysis[Equivalence]) -> tuple[str, ...]:
        """Which runs, and how verdicts come about."""
        runs = analysis.tables["runs"]
        counts = ", ".join(f"{case} {len(part)}" for case, part in runs.groupby(CASE, sort=False))
        return (
            f"cases and their runs: {counts}; seeds {told_numbers(runs[SEED])}.",
            f"{CRITERION}. One true difference in twenty lies outside its interval by chance.",
        )

    def text(self, analysis: Analysis[Equivalence]) -> Sequence[str]:
        """Verdicts with margins and their reasons, and means by pitch."""
        header, rows = self.table(analysis)
        margins = [[one.quantity.told, f"{one.quantity.margin:g} %", one.quantity.why] for one in analysis.judged]
        pitch = [
            [
                str(row["quantity"]),
                "links" if row[PITCH] == 0 else f"YADE, {row[PITCH]:g}",
                str(row["seeds [-]"]),
                told_number(row["mean [-]"], ".4f", row["mean 95 % [-]"]),
                told_number(row["less links [%]"], "+.1f", row["less links 95 % [%]"]),
            ]
            for _, row in analysis.tables["pitch"].iterrows()
        ]
        return [
            "# Two engines, the same seeds",
            "",
            *table_lines(header, [[str(cell) for cell in row] for row in rows]),
            "",
            "## Margins, chosen before the first run",
            "",
            *table_lines(["quantity", "margin", "why"], margins),
            "",
            "## Ever finer chains",
            "",
            "The shaken pile by pitch of YADE's spheres, of equal mean width; links are the limit 0. Errors are 95 %.",
            "",
            *table_lines(["quantity", "pitch", "seeds", "mean", "less links [%]"], pitch),
            *meaning_lines("runs.csv", COLUMNS),
        ]

    def about_points(self, analysis: Analysis[Equivalence]) -> str:
        """Seeds."""
        return f"seeds {told_numbers(analysis.tables['runs'][SEED])}."

    def draw(self, output: Path, analysis: Analysis[Equivalence], footer: Sequence[str]) -> Sequence[Path]:
        """Differences against margins, and means against pitch."""
        return figures.draw(output, judged=analysis.judged, pitch=analysis.tables["pitch"], footer=footer)

    def table(self, analysis: Analysis[Equivalence]) -> tuple[Sequence[str], Sequence[Sequence[object]]]:
        """Every quantity with its verdict."""
        rows = [
            [
                one.quantity.told,
                str(one.pairs),
                told_number(one.links, ".4g"),
                told_number(one.yade, ".4g"),
                told_number(one.percent, "+.1f", one.half_width),
                f"{one.quantity.margin:g} %",
                one.verdict,
            ]
            for one in analysis.judged
        ]
        return _HEADER, rows

    def told(self, analysis: Analysis[Equivalence]) -> Sequence[str]:
        """Every verdict in a line."""
        return [CRITERION + ".", "", *(f"{one.verdict.upper()}: {one.told}" for one in analysis.judged)]
