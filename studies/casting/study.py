"""The study `casting`: smarticles poured into a mould of three tiers, activated, and what is left without its walls.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Casting".
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType

from dem.record.manifest import RunManifest
from postprocess.geometry.outline import BALL
from postprocess.statistics.columns import SEED, SEEDS
from postprocess.statistics.findings import Finding
from studies.base.paper import PaperStudy
from studies.base.release import in_order, means
from studies.base.study import Analysis, Tables
from studies.casting import figures
from studies.casting.findings import findings
from studies.casting.measure import (
    FILLED,
    FILLED_AFTER,
    KEPT,
    LIKENESS,
    LIKENESS_BEFORE,
    NECK,
    OVERLAP,
    QUANTITIES,
    WHOLE,
    WHOLE_AFTER,
    WHOLE_KEPT,
    casting_row,
    mould,
)
from studies.framework.engines import judging, tables_of, told_engines
from studies.framework.procedures import PROCEDURE
from studies.framework.runs import Collected, MeasuredRun, told_bars, told_seeds


class Casting(PaperStudy):
    """Runs of a pour into a mould, one activity or none, and the removal of the mould.

    Args:
        name: Of the study: by the paper's text, or by its code.
    """

    one_engine = False
    title = "Casts of smarticles"
    quantities = QUANTITIES
    named = MappingProxyType(
        {"procedure": lambda point: str(point[PROCEDURE]), "seeds": lambda point: str(point[SEEDS])}
    )
    shown = MappingProxyType(
        {
            **{name: (f"filled {tier}", ".3f") for tier, name in FILLED.items()},
            WHOLE: ("whole", ".3f"),
            NECK: ("in the neck", ".3f"),
            **{name: (f"{tier} after", ".3f") for tier, name in FILLED_AFTER.items()},
            WHOLE_AFTER: ("whole after", ".3f"),
            **{name: (f"kept {tier}", ".3f") for tier, name in KEPT.items()},
            WHOLE_KEPT: ("kept whole", ".3f"),
            OVERLAP: ("overlap", ".3f"),
            LIKENESS_BEFORE: ("likeness", ".3f"),
            LIKENESS: ("likeness after", ".3f"),
        }
    )

    def __init__(self, name: str = "casting") -> None:
        self.name = name

    def measure(self, run: RunManifest) -> MeasuredRun:
        """How the mould was filled, and what is left of its shape."""
        return MeasuredRun(manifest=run, rows=[casting_row(run)])

    def refuse(self, found: Collected) -> None:
        """A procedure and seed twice, other numbers of smarticles, other moulds."""
        found.refuse_repeats("procedure", lambda run: str(run.row[PROCEDURE]))
        found.refuse_other_counts()
        found.refuse_mixture("mould", lambda run: [(tier.radius, tier.top) for tier in mould(run.manifest)])

    def tabulate(self, found: Collected) -> Tables:
        """Runs and points."""
        runs = in_order(found.table(), [SEED, PROCEDURE])
        return tables_of(runs, [PROCEDURE], QUANTITIES, lambda part: means(part, [PROCEDURE], list(QUANTITIES)))

    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """The findings, by runs of the engine that judges."""
        return findings(judging(tables["runs"]))

    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Which runs of which mould, and what the inside of a pile is."""
        every = analysis.tables["runs"]
        runs, others = judging(every), told_engines(every)
        counts = judging(analysis.tables["points"]).set_index(PROCEDURE)[SEEDS]
        one = analysis.found.manifests[0]
        sizes = ", ".join(f"r = {1e3 * tier.radius:.3g} mm" for tier in mould(one))
        return (
            f"l/w {one.aspect_ratio:g}, {one.count} smarticles in tiers of {sizes} (assumed: the paper gives none), "
            f"each {1e3 * mould(one)[0].top:.3g} mm high, below a neck as wide as the top one; "
            f"{told_seeds(runs, counts, 'procedure')}.",
            *([others] if others else []),
            f"Inside the pile is what a ball of radius {BALL:g} w that rolls around links and floor cannot reach.",
            f"{told_bars(counts, 'procedure')}.",
        )

    def about_points(self, analysis: Analysis[Finding]) -> str:
        """Seeds."""
        runs, points = (judging(analysis.tables[name]) for name in ("runs", "points"))
        return f"{told_seeds(runs, points[SEEDS], 'procedure')}."

    def draw(self, output: Path, analysis: Analysis[Finding], footer: Sequence[str]) -> Sequence[Path]:
        """Shares by tier, overlaps, and pictures."""
        return figures.draw(
            output,
            points=judging(analysis.tables["points"]),
            runs=judging(analysis.tables["runs"]),
            manifests=analysis.found.manifests,
            footer=footer,
        )
