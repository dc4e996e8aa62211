"""The study `procedures`: shape change, external and internal oscillation against the findings of Savoie et al.

Savoie, Tuazon, Bhamla and Goldman, "Amorphous Entangled Active Matter", Soft Matter 2023: smarticles poured
into a cylinder go through one of three activities. What is measured of a run is in
`studies.base.activity`, what the paper found and how it is judged in `studies.procedures.findings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType

from dem.record.manifest import RunManifest
from postprocess.measures.packing import DEFINITIONS
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.findings import Finding
from studies.base.activity import ENERGY, HEIGHT, PHI_ACTIVE, QUANTITIES, procedure_row, samples, static_spread
from studies.base.engines import by_engine, compared_engines, engines_of, judging, told_engines
from studies.base.paper import PaperStudy
from studies.base.procedures import ACTIVE, AMPLITUDE, CROSSINGS, NAMED, PHI, PROCEDURE, THETA, points, refuse_unlike
from studies.base.runs import DEFINITION, Collected, MeasuredRun, runs_table, told_bars, told_range, told_seeds
from studies.base.study import Analysis, Tables
from studies.procedures import figures
from studies.procedures.findings import findings


class Procedures(PaperStudy):
    """Runs of one activity between two rests; static is the state before it.

    Args:
        name: Of the study: by the paper's text, or by its code.
    """

    one_engine = False
    told_by_tables = True
    title = "Procedures of smarticles against the findings of Savoie et al."
    quantities = QUANTITIES
    named = NAMED
    shown = MappingProxyType(
        {
            PHI_ACTIVE: ("φ_f", ".4f"),
            PHI: ("φ at rest again", ".4f"),
            CROSSINGS: ("⟨N⟩", ".2f"),
            ENERGY: ("energy [J]", ".2e"),
            HEIGHT: ("h/h0", ".3f"),
        }
    )

    def __init__(self, name: str = "procedures") -> None:
        self.name = name

    def measure(self, run: RunManifest) -> MeasuredRun:
        """One activity, and the rests before and after it."""
        return MeasuredRun(manifest=run, rows=[procedure_row(run)])

    def refuse(self, found: Collected) -> None:
        """Other numbers of smarticles at one aspect ratio, other durations of an activity, a point and seed twice."""
        found.refuse_mixed_counts()
        refuse_unlike(found)

    def tabulate(self, found: Collected) -> Tables:
        """Runs and points."""
        runs = runs_table(found).sort_values([PROCEDURE, THETA, ASPECT, SEED], ignore_index=True, kind="stable")
        tables = {"runs": runs, "points": by_engine(runs, lambda part: points(samples(part), QUANTITIES))}
        if engines_of(runs):
            alike = by_engine(runs, samples)
            tables["engines"] = compared_engines(alike, [PROCEDURE, THETA, ASPECT], QUANTITIES)
        return tables

    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """The findings, by samples of the engine that judges."""
        return findings(samples(judging(tables["runs"])))

    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Which runs, and how φ, ⟨N⟩ and the energy are taken."""
        every = analysis.tables["runs"]
        runs, others = judging(every), told_engines(every)
        counts = judging(analysis.tables["points"]).set_index([PROCEDURE, ASPECT, THETA])[SEEDS]
        ratios = " ".join(f"{ratio:g}" for ratio in sorted(runs[ASPECT].unique()))
        times = ", ".join(f"{name} {time:.3g} s" for name, time in runs.groupby(PROCEDURE)[ACTIVE].first().items())
        numbers = told_range(runs.groupby(ASPECT)["smarticles [-]"].first())
        return (
            f"l/w {ratios}, {numbers} smarticles, {told_seeds(runs, counts, 'point')}; active for: {times}.",
            *([others] if others else []),
            f"φ by {DEFINITION} ({DEFINITIONS[DEFINITION]}), ⟨N⟩ the links of others through a smarticle's plane: φ_f "
            "is the mean over the last 20 frames of the activity, as in the paper, ⟨N⟩ that over the frames of the "
            "relaxation after it; static ones are means over the frames of the relaxation before it (runs of one l/w "
            f"and seed agree there within {static_spread(runs):.2g} in φ). h0 is the mean height of the centre of mass "
            "there. Energy: work of the motors, or of the shaken container without its own weight. Procedures are "
            f"compared at θ = {AMPLITUDE:g}°. {told_bars(counts, 'point')}.",
        )

    @property
    def about_table(self) -> Sequence[str]:
        """Of means, and of θ that the hinge does not reach."""
        return [
            "Means over seeds ± standard error. Of θ only what the hinge reaches is run: a barb",
            "swings to 90° + θ/2 · 0.7/(l/w), 105° at most, so θ is at most 30° (l/w)/0.7.",
        ]

    def about_points(self, analysis: Analysis[Finding]) -> str:
        """Seeds, and what φ is."""
        points_ = judging(analysis.tables["points"])
        seeds = told_seeds(judging(analysis.tables["runs"]), points_[SEEDS], "point")
        return f"{seeds}; φ_f by {DEFINITION} over the last 20 frames of the activity."

    def draw(self, output: Path, analysis: Analysis[Finding], footer: Sequence[str]) -> Sequence[Path]:
        """Heights against time, and means against l/w and θ."""
        return figures.draw(
            output,
            points=analysis.tables["points"],
            runs=analysis.tables["runs"],
            manifests=analysis.found.manifests,
            footer=footer,
        )
