"""The study `collapse`: free-standing columns on a vibrating base against Gravish et al.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012): columns of
u-particles collapse in τ = (1/f) exp(Δ/Γ), with Δ greatest at an intermediate l/w. A run pours, shakes with the wall,
rests, takes the wall away, and shakes the floor. What is measured of a run is in `studies.collapse.measure`, by which
height in `studies.base.collapse.column`, Δ in `studies.collapse.law`, what is judged in `studies.collapse.findings`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.findings import Finding
from postprocess.statistics.points import ToldTable, told_number
from studies.base.collapse.collapse_time import LEAST_FALL, WORST_ERROR
from studies.base.collapse.column import DEFINITIONS, REMAINING, REST
from studies.base.paper import PaperStudy
from studies.base.study import Analysis, Tables
from studies.collapse import figures
from studies.collapse.findings import findings, told_delta
from studies.collapse.law import ACTIVATION, CENSORED, DEVIATION, HALF_WIDTH, REFERENCE, USED, activations, levels
from studies.collapse.measure import (
    COLUMNS,
    DEFINITION,
    FREQUENCY,
    GAMMA,
    HEIGHT_BEFORE,
    HEIGHT_WITH,
    STANDS,
    WATCHED,
    collapse_rows,
)
from studies.collapse.reference import COLLAPSE
from studies.framework.runs import Collected, MeasuredRun, told_bars, told_seeds


class Collapse(PaperStudy):
    """Runs of free columns; those that have not collapsed by their end are not missing: they give bounds."""

    name = "collapse"
    title = "Collapse of columns against the findings of Gravish et al."
    paper = COLLAPSE
    heading = "Δ by each definition of the height"
    described = "runs.csv"
    quantities = COLUMNS

    def measure(self, run: RunManifest) -> MeasuredRun:
        """The collapse time by each definition of the height, a row each."""
        return MeasuredRun(manifest=run, rows=collapse_rows(run))

    def refuse(self, found: Collected) -> None:
        """Other frequencies, other containers, other numbers of smarticles at one l/w, a point and seed twice."""
        found.refuse_mixture("frequency", lambda run: f"{run.row[FREQUENCY]:g} Hz")
        found.refuse_mixture("container", lambda run: f"{run.manifest.container_radius:g} m wide")
        found.refuse_mixed_counts()
        found.refuse_repeats("point", lambda run: f"l/w {run.manifest.aspect_ratio:g} Γ {run.row[GAMMA]:g}")

    def tabulate(self, found: Collected) -> Tables:
        """Runs by definition, collapse times by Γ, and Δ."""
        runs = found.table().sort_values([ASPECT, GAMMA, SEED], ignore_index=True, kind="stable")
        return {"runs": runs, "times": levels(runs), "points": activations(runs)}

    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """The findings, by runs."""
        return findings(tables["runs"])

    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Which runs, and how collapse times and Δ come about."""
        rows = analysis.tables["runs"]
        counts = analysis.tables["times"].set_index([DEFINITION, ASPECT, GAMMA])[SEEDS]
        shortest, before = rows.groupby(GAMMA)[WATCHED].min(), rows.groupby(ASPECT)[HEIGHT_BEFORE].mean()
        watched = ", ".join(f"{time:.3g} s at Γ = {gamma:g}" for gamma, time in shortest.items())
        heights = ", ".join(f"{2e3 * height:.0f} mm at l/w = {aspect:g}" for aspect, height in before.items())
        run = analysis.found.manifests[0]
        return (
            f"columns of {1e3 * run.container_radius:.3g} mm radius, twice their centre of mass {heights}; f = "
            f"{rows[FREQUENCY].iloc[0]:g} Hz, watched for {watched}; {told_seeds(rows, counts, 'point')}.",
            f"Without its wall, before it was shaken, the column kept {_told_kept(rows)} of its smarticles and of the "
            "height of their centre of mass.",
            f"h by `{REMAINING}`: {DEFINITIONS[REMAINING]}; h0: mean over the last {REST:g} s before the vibration. "
            "τ: fit of h0 exp(-(t/τ)^β) to means over periods; seen where it is shorter than the time watched, the "
            f"fall is at least {LEAST_FALL:.0%} and the error of the fit below {WORST_ERROR:.0%}, else a bound. Δ: "
            "slope of ln(fτ) against 1/Γ through the origin, seed by seed, over the Γ at which every run collapsed. "
            "The floor has no end: smarticles that leave the column go on hopping on it. "
            f"{told_bars(counts, 'point')}.",
        )

    def text_table(self, analysis: Analysis[Finding]) -> ToldTable:
        """Δ by every definition."""
        rows = [
            [
                row[DEFINITION],
                f"{row[ASPECT]:g}",
                told_delta(row),
                told_number(row[REFERENCE], "g"),
                row[USED] or "none",
                str(row[CENSORED]),
            ]
            for _, row in analysis.tables["points"].iterrows()
        ]
        return ["definition", "l/w", "Δ", "Gravish", "Γ used", "runs with a bound"], rows

    def below_table(self, analysis: Analysis[Finding]) -> Sequence[str]:
        """What the definitions are."""
        return ["", *(f"- `{name}`: {meaning}" for name, meaning in DEFINITIONS.items())]

    def table(self, analysis: Analysis[Finding]) -> ToldTable:
        """Δ by the first definition."""
        deltas = analysis.tables["points"]
        rows = []
        for _, row in deltas[deltas[DEFINITION] == REMAINING].iterrows():
            value = told_delta(row).partition(" ± ")[0] if math.isnan(row[ACTIVATION]) else f"{row[ACTIVATION]:.2f}"
            cells = [f"{row[ASPECT]:g}", str(row[SEEDS]), row[USED] or "none", value]
            cells += [told_number(row[HALF_WIDTH], ".2f"), told_number(row[REFERENCE], "g")]
            rows.append([*cells, told_number(row[DEVIATION], "+.0f"), str(row[CENSORED])])
        return ["l/w", "seeds", "Γ used", "Δ", "± 95 %", "Gravish", "deviation %", "runs with a bound"], rows

    @property
    def about_numbers(self) -> str:
        """By which definition Δ is."""
        return f"By {REMAINING}: {DEFINITIONS[REMAINING]}. Others are in points.csv."

    def about_points(self, analysis: Analysis[Finding]) -> str:
        """Seeds."""
        return f"{told_seeds(analysis.tables['runs'], analysis.tables['times'][SEEDS], 'point')}."

    def draw(self, output: Path, analysis: Analysis[Finding], footer: Sequence[str]) -> Sequence[Path]:
        """Heights against time, collapse times against Γ, Δ against l/w."""
        return figures.draw(
            output,
            rows=analysis.tables["runs"],
            levels=analysis.tables["times"],
            activations=analysis.tables["points"],
            manifests=analysis.found.manifests,
            footer=footer,
        )


def _told_kept(rows: pd.DataFrame) -> str:
    """`88 and 87 % at l/w = 0.4`, means over runs."""
    kept = rows.assign(**{HEIGHT_BEFORE: rows[HEIGHT_BEFORE] / rows[HEIGHT_WITH]}).groupby(ASPECT)
    means = kept[[STANDS, HEIGHT_BEFORE]].mean()
    return ", ".join(
        f"{100 * one:.0f} and {100 * high:.0f} % at l/w = {aspect:g}" for aspect, one, high in means.itertuples()
    )
