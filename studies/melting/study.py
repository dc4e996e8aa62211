"""The study `melting`: the container's wall is taken from a pile, at once or lifted, after each procedure.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023, section "Melting behavior".
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.measures.spread import OUTSIDE, TOUCHING
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.findings import Finding
from studies.base.paper import PaperStudy
from studies.base.release import in_order, means
from studies.base.study import Analysis, Tables
from studies.framework.engines import judging, tables_of, told_engines
from studies.framework.procedures import PROCEDURE
from studies.framework.runs import Collected, MeasuredRun, told_bars, told_seeds
from studies.melting import figures
from studies.melting.findings import findings
from studies.melting.measure import (
    BASE,
    CONTACT,
    ENTANGLED,
    HEIGHT,
    LIFT,
    QUANTITIES,
    SLOUGHED,
    SPREAD,
    TILT,
    TOP,
    TOPPLED,
    measure_melting,
)

_KEYS = [LIFT, ASPECT, PROCEDURE]


class Melting(PaperStudy):
    """Runs of a pour, one activity or none, and the removal of the wall.

    Args:
        name: Of the study: by the paper's text, or by its code.
    """

    one_engine = False
    title = "Piles whose wall is taken away"
    quantities = QUANTITIES
    named = MappingProxyType(
        {
            "procedure": lambda point: str(point[PROCEDURE]),
            "l/w": lambda point: f"{point[ASPECT]:g}",
            "lift [m/s]": lambda point: f"{point[LIFT]:g}",
            "seeds": lambda point: str(point[SEEDS]),
        }
    )
    shown = MappingProxyType(
        {
            BASE: ("radius before [m]", ".4f"),
            TOP: ("height before [m]", ".4f"),
            CONTACT: ("cluster by contact", ".3f"),
            ENTANGLED: ("by crossings", ".3f"),
            HEIGHT: ("h/h0", ".3f"),
            SPREAD: ("radius / before", ".2f"),
            SLOUGHED: ("sloughed", ".3f"),
            TILT: ("tilt [deg]", ".1f"),
            TOPPLED: ("toppled", ".2f"),
        }
    )

    def __init__(self, name: str = "melting") -> None:
        self.name = name

    def measure(self, run: RunManifest) -> MeasuredRun:
        """The pile before, in the end, and against time since the wall began to go."""
        return measure_melting(run)

    def refuse(self, found: Collected) -> None:
        """A point and seed twice, other numbers of smarticles at one l/w."""
        found.refuse_repeats(
            "point", lambda run: f"{run.row[PROCEDURE]} l/w {run.row[ASPECT]:g} lifted at {run.row[LIFT]:g} m/s"
        )
        found.refuse_mixed_counts()

    def tabulate(self, found: Collected) -> Tables:
        """Runs, points, and every measure of every run against time."""
        runs = in_order(found.table(), [LIFT, ASPECT, SEED, PROCEDURE])
        times = [pd.DataFrame({"run": run.name, **run.history}) for run in found.runs]
        tables = tables_of(runs, _KEYS, QUANTITIES, lambda part: means(part, _KEYS, list(QUANTITIES)))
        return {**tables, "times": pd.concat(times, ignore_index=True)}

    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """The findings, by runs of the engine that judges."""
        return findings(judging(tables["runs"]))

    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Which runs, and what is measured."""
        every = analysis.tables["runs"]
        runs, others = judging(every), told_engines(every)
        counts = judging(analysis.tables["points"]).set_index(_KEYS)[SEEDS]
        manifests = analysis.found.manifests
        sizes = ", ".join(
            f"{count} smarticles in r = {radius:g} m at l/w {aspect:g}"
            for aspect, count, radius in sorted(
                {(run.aspect_ratio, run.count, run.container_radius) for run in manifests}
            )
        )
        return (
            f"{sizes}; {told_seeds(runs, counts, 'point')}.",
            *([others] if others else []),
            f"Clusters: centrelines within {TOUCHING:g} sphere diameters, or links through planes. Sloughed: centre of "
            f"mass farther from the pile's middle (median) than the wall was, by {OUTSIDE:g} w. Tilt: of the line to "
            "the centre of mass from the floor below where it was before. Toppled: centre of mass beyond the radius "
            "that held 95 % before.",
            f"{told_bars(counts, 'point')}.",
        )

    @property
    def about_numbers(self) -> str:
        """Says when they are taken as well."""
        return "Means over seeds ± standard error, at the end of the run."

    def about_points(self, analysis: Analysis[Finding]) -> str:
        """Seeds."""
        runs, points = (judging(analysis.tables[name]) for name in ("runs", "points"))
        return f"{told_seeds(runs, points[SEEDS], 'point')}."

    def draw(self, output: Path, analysis: Analysis[Finding], footer: Sequence[str]) -> Sequence[Path]:
        """Every measure against time, and pictures."""
        return figures.draw(output, runs=judging(analysis.tables["runs"]), melted=analysis.found.runs, footer=footer)
