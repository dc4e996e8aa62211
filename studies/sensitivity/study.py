"""The studies of sensitivity: what φ before and after shaking owes to each choice of the contact model.

Each variant differs from the first one, the baseline, in one choice. Runs are named
`VARIANT_seedN`. A change is clear where it is beyond its own 95 % half-width, by Welch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Never

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.report.markdown import table_lines
from postprocess.statistics.columns import ASPECT, SEEDS
from postprocess.statistics.points import told_number
from studies.base.shaken import WHEN, told_shaken
from studies.base.study import Analysis, Study, Tables
from studies.base.variants import VARIANT, variants_of
from studies.framework.provenance import GRAVISH, Reference, read_reference, reference_at
from studies.framework.runs import DEFINITION, Collected, MeasuredRun, runs_table, told_bars, told_seeds
from studies.sensitivity import figures
from studies.sensitivity.measure import COMPARED, sensitivity_row, summarise_variants


class Sensitivity(Study[Never]):
    """Runs of the variants of one scene; the first run's variant is the baseline.

    Args:
        name: Of the study.
    """

    text_name = "summary.md"

    def __init__(self, name: str) -> None:
        self.name = name

    def measure(self, run: RunManifest) -> MeasuredRun:
        """φ and crossings before and after shaking."""
        return MeasuredRun(manifest=run, rows=[sensitivity_row(run)])

    def refuse(self, found: Collected) -> None:
        """Other aspect ratios, other numbers of smarticles, a variant and seed twice."""
        found.refuse_mixture("l/w", lambda run: f"{run.manifest.aspect_ratio:g}")
        found.refuse_other_counts()
        found.refuse_repeats(VARIANT, lambda run: str(run.row[VARIANT]))

    def tabulate(self, found: Collected) -> Tables:
        """Runs, and means over seeds with changes, also of variants without a finished run."""
        runs = runs_table(found)
        return {"runs": runs, "summary": summarise_variants(runs, variants_of(found.given))}

    def reference_of(self, tables: Tables) -> Reference:
        """Gravish's packing fractions."""
        return GRAVISH

    def statements(self, analysis: Analysis[Never]) -> tuple[str, ...]:
        """Which runs, how φ is taken, and what changes are against."""
        runs = analysis.tables["runs"]
        counts = runs.groupby(VARIANT, sort=False).size()
        return (
            f"l/w = {runs[ASPECT].iloc[0]:g}, {analysis.found.manifests[0].count} smarticles, "
            f"{told_seeds(runs, counts, VARIANT)}; shaken for {told_shaken(runs)}.",
            f"φ by {DEFINITION}; {WHEN}. {told_bars(counts, VARIANT)}.",
            f"Changes are against the baseline {_baseline(analysis)}, their errors 95 % by Welch: where a choice "
            "changes nothing at all, one change in twenty is still beyond its error.",
        )

    def text(self, analysis: Analysis[Never]) -> Sequence[str]:
        """Means and changes of every variant."""
        known = [f"{stage} = {value:.4f}" for stage, value in _gravish(analysis).items() if math.isfinite(value)]
        told = f"Gravish et al. 2012 at this l/w: {', '.join(known)}." if known else "Gravish has no point at this l/w."
        header = ["variant", "seeds", "φ_0", "change %", "φ_f", "change %", "⟨N⟩ after", "change %"]
        cells = _cells(analysis.tables["summary"], lambda change: f"**{change}**")
        return [
            f"# Study {self.name}: packing at l/w = {analysis.found.manifests[0].aspect_ratio:g}",
            "",
            told,
            "Changes are against the first row; those beyond their error are bold.",
            "",
            *table_lines(header, [list(map(str, row)) for row in cells]),
        ]

    def about_points(self, analysis: Analysis[Never]) -> str:
        """Seeds, and what φ is."""
        runs = analysis.tables["runs"]
        seeds = told_seeds(runs, runs.groupby(VARIANT, sort=False).size(), VARIANT)
        return f"{seeds}; baseline {_baseline(analysis)}; φ by {DEFINITION}."

    def draw(self, output: Path, analysis: Analysis[Never], footer: Sequence[str]) -> Sequence[Path]:
        """φ before and after shaking, one row per variant."""
        return figures.draw(
            output / "sensitivity",
            runs=analysis.tables["runs"],
            summary=analysis.tables["summary"],
            aspect=round(analysis.found.manifests[0].aspect_ratio, 6),
            reference=_gravish(analysis),
            footer=footer,
        )

    def table(self, analysis: Analysis[Never]) -> tuple[Sequence[str], Sequence[Sequence[object]]]:
        """Means and changes of every variant."""
        header = ["variant", "seeds"]
        for name in COMPARED:
            header += [name, "change %"]
        return header, _cells(analysis.tables["summary"], lambda change: f"{change} *")

    def told(self, analysis: Analysis[Never]) -> Sequence[str]:
        """What changes are against, and which are marked."""
        return [f"Changes are against {_baseline(analysis)}; * beyond the error at 95 %."]


def _baseline(analysis: Analysis[Never]) -> str:
    """The variant that the others are compared with."""
    return str(analysis.tables["summary"][VARIANT].iloc[0])


def _gravish(analysis: Analysis[Never]) -> dict[str, float]:
    """Gravish's values at the aspect ratio of the runs, by stage; NaN without one [-]."""
    aspect = analysis.found.manifests[0].aspect_ratio
    return {stage: reference_at(read_reference(), aspect, stage) for stage in ("phi_0", "phi_f")}


def _cells(summary: pd.DataFrame, mark: Callable[[str], str]) -> list[list[object]]:
    """Rows for a person to read; changes beyond their error are marked."""
    rows = []
    for row in summary.to_dict("records"):
        cells: list[object] = [row[VARIANT], row[SEEDS]]
        for name, quantity in COMPARED.items():
            form = ".4f" if name.startswith("phi") else ".2f"
            cells.append(told_number(row[f"{quantity} [-]"], form, row[f"{quantity} 95 % [-]"]))
            change = told_number(row[f"{name} change [%]"], "+.1f", row[f"{name} change 95 % [%]"])
            cells.append(mark(change) if row[f"{name} clear"] else change)
        rows.append(cells)
    return rows
