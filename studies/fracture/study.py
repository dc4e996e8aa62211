"""The study `fracture`: a hook is pulled out of piles prepared by the procedures of Savoie et al.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Tensile loading
and fracture". What is measured of a pull is in `postprocess.measures.pull`, of a run in `studies.fracture.measure`,
what the paper found and how it is judged in `studies.fracture.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.measures.pull import END, FREE, WINDOW
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.findings import Finding
from postprocess.statistics.points import ToldTable, marked, told_means
from studies.base.paper import PaperStudy
from studies.base.study import Analysis, Tables
from studies.fracture import figures
from studies.fracture.findings import findings
from studies.fracture.measure import (
    ABOVE,
    ACCOUNT,
    CAME_FREE,
    HELD,
    HELD_FAST,
    LEFT,
    LIMIT,
    NET,
    PEAK,
    PEAK_RAISED,
    QUANTITIES,
    WINDOWS,
    WORK,
    fracture_row,
)
from studies.framework.engines import judging, tables_of, told_by_engine, told_engines
from studies.framework.procedures import ACTIVE, CROSSINGS, NAMED, PROCEDURE, STATIC, THETA, points, refuse_unlike
from studies.framework.runs import Collected, MeasuredRun, runs_table, told_bars, told_range, told_seeds


class Fracture(PaperStudy):
    """Runs of a pour, one activity or none, and a pull.

    Args:
        name: Of the study: by the paper's text, or by its code.
    """

    one_engine = False
    title = "A hook pulled out of a pile, against the findings of Savoie et al."
    remarks = (
        "Of how the force depends on θ or on l/w by itself the paper's text says nothing; it has figures.",
        "What goes from hook to hook shows on the lower one, where a smarticle may be hooked into both; the peak less "
        "that is what pile and container take.",
    )
    means = "Means over seeds ± standard error; forces over n W_s."
    quantities = QUANTITIES
    named = NAMED
    shown = MappingProxyType(
        {
            PEAK: ("peak", ".3f"),
            WINDOWS[WINDOW / 2]: (f"over {WINDOW / 2:g} s", ".3f"),
            WINDOWS[2 * WINDOW]: (f"over {2 * WINDOW:g} s", ".3f"),
            HELD: ("lower hook at it", ".3f"),
            NET: ("peak less lower hook", ".3f"),
            PEAK_RAISED: ("raised at it [mm]", ".1f"),
            WORK: ("work / n W_s w", ".3f"),
            LEFT: ("load at the end", ".3f"),
            HELD_FAST: ("held fast", ".2f"),
            CAME_FREE: ("came free", ".2f"),
            ABOVE: ("above the hook", ".2f"),
            CROSSINGS: ("⟨N⟩", ".2f"),
        }
    )

    def __init__(self, name: str = "fracture") -> None:
        self.name = name

    def measure(self, run: RunManifest) -> MeasuredRun:
        """The pile before the pull, and what the hook felt."""
        return MeasuredRun(manifest=run, rows=[fracture_row(run)])

    def refuse(self, found: Collected) -> None:
        """Other numbers of smarticles at one l/w, other durations of an activity, a point and seed twice."""
        found.refuse_mixed_counts()
        refuse_unlike(found)

    def tabulate(self, found: Collected) -> Tables:
        """Runs and points."""
        runs = runs_table(found).sort_values([PROCEDURE, ASPECT, THETA, SEED], ignore_index=True, kind="stable")
        return tables_of(runs, [PROCEDURE, THETA, ASPECT], QUANTITIES, lambda part: points(part, QUANTITIES))

    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """The findings, by runs of the engine that judges."""
        return findings(judging(tables["runs"]))

    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Which runs, what a peak is, and how many piles held fast."""
        every = analysis.tables["runs"]
        runs, others = judging(every), told_engines(every)
        counts = judging(analysis.tables["points"]).set_index([PROCEDURE, ASPECT, THETA])[SEEDS]
        ratios = ", ".join(
            f"{ratio:g} ({count})" for ratio, count in runs.groupby(ASPECT)["smarticles [-]"].first().items()
        )
        active = runs[runs[PROCEDURE] != STATIC].groupby(PROCEDURE)[ACTIVE].first()
        times = ", ".join(f"{name} {time:.3g} s" for name, time in active.items()) or "none"
        return (
            f"l/w (smarticles) {ratios}, {told_seeds(runs, counts, 'point')}; active for: {times}.",
            *([others] if others else []),
            f"Peak: largest mean over {WINDOW:g} s of the force that raises the hook, over the weight n W_s of all "
            f"smarticles; free: below {FREE:g} of it for good; load at the end: mean over the last {END:g} s. ⟨N⟩: "
            f"links of others through a smarticle's plane at rest before the pull. {told_bars(counts, 'point')}.",
            *_told_held(runs),
        )

    def table(self, analysis: Analysis[Finding]) -> ToldTable:
        """Means over seeds, the displacement in millimetres."""
        means, raised = analysis.tables["points"], [PEAK_RAISED, marked(PEAK_RAISED, "SE")]
        return told_means(means.assign(**(1e3 * means[raised])), told_by_engine(means, self.named), self.shown)

    def text(self, analysis: Analysis[Finding]) -> Sequence[str]:
        """Ends with what a column of the runs is."""
        account = f"`{ACCOUNT}` of `runs.csv`: ∫ F dz from the series over the work that the engine added up, less 1."
        return [*super().text(analysis), "", account]

    def about_points(self, analysis: Analysis[Finding]) -> str:
        """Seeds, and how many piles held fast."""
        runs, points_ = (judging(analysis.tables[name]) for name in ("runs", "points"))
        return " ".join([f"{told_seeds(runs, points_[SEEDS], 'point')}.", *_told_held(runs)])

    def draw(self, output: Path, analysis: Analysis[Finding], footer: Sequence[str]) -> Sequence[Path]:
        """Forces against time, and peaks against θ, l/w and ⟨N⟩."""
        return figures.draw(
            output,
            points=judging(analysis.tables["points"]),
            runs=judging(analysis.tables["runs"]),
            manifests=analysis.found.manifests,
            footer=footer,
        )


def _told_held(runs: pd.DataFrame) -> tuple[str, ...]:
    """What peaks of piles that held fast are; nothing where none did."""
    held = int(runs[HELD_FAST].sum())
    limits = told_range(runs[LIMIT].round(3))
    told = f"Held fast: {held} of {len(runs)} runs, whose hook stopped at {limits} n W_s; their peaks are lower bounds."
    return (told,) if held else ()
