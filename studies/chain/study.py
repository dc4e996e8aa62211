"""The studies `chain` and `chain-bodies`: strain tests of a chain of robots between two walls, against Savoie et al.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, "Robophysical experiment".
What is measured of a run is in `studies.chain.measure`, what the paper found and how it is judged in
`studies.chain.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.measures.strain import (
    AT_PEAK,
    CARRIES,
    FRACTURE,
    LOSS,
    PEAK,
    QUANTITIES,
    STIFFNESS,
    WALL,
    WIDENING,
    YIELD,
)
from postprocess.report.markdown import table_lines
from postprocess.statistics.columns import SEED, SEEDS
from postprocess.statistics.findings import Finding
from postprocess.statistics.points import told_number
from studies.base.paper import PaperStudy
from studies.base.study import Analysis, Tables
from studies.chain import figures
from studies.chain.findings import findings, sensitivity
from studies.chain.measure import CONFINEMENT, COUNT, PAPER_WIDTH, SPEED, START, VARIANT, chain_row, points
from studies.framework.runs import Collected, MeasuredRun, told_range


class Chain(PaperStudy):
    """Runs of one strain test each; runs of one seed have the same servos.

    Args:
        name: which of the two shipped studies.
    """

    title = "The strain test of a chain of robots against the findings of Savoie et al."
    means = "Means over trials ± standard error."
    quantities = QUANTITIES
    named = MappingProxyType(
        {
            "variant": lambda point: str(point[VARIANT]),
            "n": lambda point: str(point[COUNT]),
            "h/H": lambda point: f"{point[CONFINEMENT]:g}",
            "mm/s": lambda point: f"{1e3 * point[SPEED]:g}",
            "trials": lambda point: str(point[SEEDS]),
        }
    )
    shown = MappingProxyType(
        {
            PEAK: ("peak force [N]", ".3f"),
            AT_PEAK: ("strain at the peak", ".3f"),
            FRACTURE: ("strain at fracture", ".3f"),
            YIELD: ("strain at the yield drop", ".3f"),
            STIFFNESS: ("stiffness [N]", ".2f"),
            WIDENING: ("widening", ".3f"),
            WALL: ("wall force [N]", ".2f"),
        }
    )

    def __init__(self, name: str = "chain") -> None:
        self.name = name

    def measure(self, run: RunManifest) -> MeasuredRun:
        """Force, strain and width of the chain."""
        return MeasuredRun(manifest=run, rows=[chain_row(run)])

    def refuse(self, found: Collected) -> None:
        """A point and seed twice."""
        found.refuse_repeats("point", lambda run: f"{run.row[VARIANT]} n {run.row[COUNT]} h/H {run.row[CONFINEMENT]}")

    def tabulate(self, found: Collected) -> Tables:
        """Runs, points, and what each variant changes against the baseline."""
        runs = found.table().sort_values([VARIANT, COUNT, CONFINEMENT, SEED], ignore_index=True)
        return {"runs": runs, "points": points(runs), "sensitivity": sensitivity(runs)}

    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """The findings, by runs."""
        return findings(tables["runs"])

    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Which trials, and how force and strain are taken."""
        return (
            _told_trials(analysis.tables["points"]),
            "Force: of the pulled string, means over 1 ms. Strain: of the distance along x between the strings' ties. "
            f"A chain holds while it carries {CARRIES:.0%} of its peak force. A yield drop loses {LOSS:.0%} of the "
            "force or more. Trials differ in the strength of their servos, ±10 %.",
            *told_bodies(analysis.tables["runs"], analysis.found.manifests),
        )

    def below_table(self, analysis: Analysis[Finding]) -> Sequence[str]:
        """What the assumptions matter, where there are runs of others than the baseline."""
        changes = analysis.tables["sensitivity"]
        if changes.empty:
            return ()
        names = [PEAK, FRACTURE, STIFFNESS]
        rows = [
            [
                str(variant),
                *(
                    told_number(row["change [%]"], "+.1f", row["change 95 % [%]"])
                    for _, row in group.set_index("quantity").loc[names].iterrows()
                ),
            ]
            for variant, group in changes.groupby(VARIANT, sort=False)
        ]
        return [
            "",
            "## What the assumptions matter",
            "",
            "Change against the baseline, in per cent ± 95 % half-width over pairs of runs with the same servos.",
            "",
            *table_lines(["variant", *(name.rpartition(" [")[0] for name in names)], rows),
        ]

    def about_points(self, analysis: Analysis[Finding]) -> str:
        """How many trials."""
        return f"{told_range(analysis.tables['points'][SEEDS])} trials per point."

    def draw(self, output: Path, analysis: Analysis[Finding], footer: Sequence[str]) -> Sequence[Path]:
        """Force and width against strain, peaks against confinement, changes by variant."""
        return figures.draw(
            output,
            points=analysis.tables["points"],
            runs=analysis.tables["runs"],
            changes=analysis.tables["sensitivity"],
            manifests=analysis.found.manifests,
            footer=footer,
        )


def told_bodies(runs: pd.DataFrame, manifests: Sequence[RunManifest]) -> tuple[str, ...]:
    """What h is where middle links have a thickness of their own; nothing where they do not."""
    own = {run.middle_thickness_in_plane for run in manifests} - {None}
    if not own:
        return ()
    thick = ", ".join(f"{1e3 * body:g}" for body in sorted(body for body in own if body))
    return (
        f"Bodies are {thick} mm thick in the plane. h is the paper's {1e3 * PAPER_WIDTH:g} mm, so that walls are where "
        f"the paper's are; the chain is {1e3 * runs[START].mean():.1f} mm wide at the start.",
    )


def _told_trials(means: pd.DataFrame) -> str:
    told = []
    for speed, group in means.groupby(SPEED)[[VARIANT, COUNT]]:
        names = dict.fromkeys(f"{variant} n = {count}" for variant, count in group.itertuples(index=False))
        told.append(f"{1e3 * float(str(speed)):g} mm/s: {', '.join(names)}")
    return f"{told_range(means[SEEDS])} trials per point; {'; '.join(told)}."
