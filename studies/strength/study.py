"""The study `strength`: piles torn between a grip over the whole floor and the paper's hook, without a wall.

In the paper's own test (study `fracture`) one rigid smarticle may hold both hooks, and what the hook feels else is the
weight of a pile that comes along as a whole, rubbing on the wall. Here a grid of bars 2.5 mm above the floor holds the
pile, the wall is gone before the pull, and the hook is farther from the grid than a smarticle is long: what it feels
beyond what it lifts goes through the pile.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.record.manifest import RunManifest
from postprocess.measures.pull import WINDOW
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.findings import Finding
from postprocess.statistics.points import ToldTable, marked, told_means
from studies.base.engines import judging, tables_of, told_by_engine, told_engines
from studies.base.paper import PaperStudy
from studies.base.procedures import ACTIVE, CROSSINGS, PROCEDURE, STATIC, THETA, named_point
from studies.base.release import in_order, means
from studies.base.runs import Collected, MeasuredRun, told_bars, told_range, told_seeds
from studies.base.study import Analysis, Tables
from studies.strength import figures
from studies.strength.findings import findings
from studies.strength.measure import (
    ABOVE,
    BEFORE,
    BREAK,
    CARRIED,
    HELD_FAST,
    KEPT,
    LIMIT,
    PEAK,
    PEAK_RAISED,
    QUANTITIES,
    THROUGH,
    TOP,
    UPPER,
    WORK,
    strength_row,
)

_KEYS = [ASPECT, UPPER, PROCEDURE, THETA]
_LENGTHS = (PEAK_RAISED, BREAK, TOP)


class Strength(PaperStudy):
    """Runs of a pour onto a grid, one activity or none, the removal of the wall, and a pull.

    Args:
        name: Of the study: by the paper's text, or by its code.
    """

    one_engine = False
    title = "Piles torn between a grip on the floor and a hook, against the findings of Savoie et al."
    remarks = (
        "This is not the paper's test, which has two hooks alike and a wall (study `fracture`): there one smarticle "
        "may hold both hooks, and the pile is lifted as a whole.",
    )
    means = "Means over seeds ± standard error; forces over n W_s."
    quantities = QUANTITIES
    named = MappingProxyType(
        {
            "procedure": lambda point: str(point[PROCEDURE]),
            "θ [°]": lambda point: "–" if math.isnan(point[THETA]) else f"{point[THETA]:g}",
            "l/w": lambda point: f"{point[ASPECT]:g}",
            "hook [mm]": lambda point: f"{1e3 * point[UPPER]:g}",
            "seeds": lambda point: str(point[SEEDS]),
        }
    )
    shown = MappingProxyType(
        {
            PEAK: ("peak", ".3f"),
            PEAK_RAISED: ("raised at it [mm]", ".1f"),
            BEFORE: ("before", ".3f"),
            THROUGH: ("through to the grid", ".3f"),
            WORK: ("work / n W_s w", ".3f"),
            CARRIED: ("carried off", ".3f"),
            BREAK: ("broke at [mm]", ".1f"),
            HELD_FAST: ("held fast", ".2f"),
            ABOVE: ("above the hook", ".2f"),
            TOP: ("height [mm]", ".1f"),
            KEPT: ("kept without wall", ".3f"),
            CROSSINGS: ("⟨N⟩", ".2f"),
        }
    )

    def __init__(self, name: str = "strength") -> None:
        self.name = name

    def measure(self, run: RunManifest) -> MeasuredRun:
        """The pile before it is torn, what the hook felt, and what came off."""
        return MeasuredRun(manifest=run, rows=[strength_row(run)])

    def refuse(self, found: Collected) -> None:
        """A point and seed twice, other numbers of smarticles, other durations of an activity."""
        found.refuse_repeats("point", lambda run: f"{named_point(run)}, hook at {run.row[UPPER]:g} m")
        found.refuse_mixed_counts()
        found.refuse_mixture(
            "duration",
            lambda run: f"{run.row[ACTIVE]:.3g} s of {run.row[PROCEDURE]}",
            within=lambda run: run.row[PROCEDURE],
        )

    def tabulate(self, found: Collected) -> Tables:
        """Runs and points."""
        runs = in_order(found.table(), [ASPECT, UPPER, SEED, PROCEDURE, THETA])
        return tables_of(runs, _KEYS, QUANTITIES, lambda part: means(part, _KEYS, list(QUANTITIES)))

    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """The findings, by runs of the engine that judges."""
        return findings(judging(tables["runs"]))

    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Which runs, what a peak is, and how many piles held fast."""
        every = analysis.tables["runs"]
        runs, others = judging(every), told_engines(every)
        counts = judging(analysis.tables["points"]).set_index(_KEYS)[SEEDS]
        active = runs[runs[PROCEDURE] != STATIC].groupby(PROCEDURE)[ACTIVE].first()
        times = ", ".join(f"{name} {time:.3g} s" for name, time in active.items()) or "none"
        places = ", ".join(f"{1e3 * height:g}" for height in sorted(runs[UPPER].unique()))
        numbers = told_range(runs.groupby(ASPECT)["smarticles [-]"].first())
        return (
            f"{numbers} smarticles, hook {places} mm above the floor, {told_seeds(runs, counts, 'point')}; active for: "
            f"{times}.",
            *([others] if others else []),
            f"Peak: largest mean over {WINDOW:g} s of the force that raises the hook, over the weight n W_s of all "
            "smarticles. Carried off: rose by more than half of the hook's way. ⟨N⟩: links of others through a "
            f"smarticle's plane at rest before the wall went. {told_bars(counts, 'point')}.",
            _told_held(every),
        )

    def table(self, analysis: Analysis[Finding]) -> ToldTable:
        """Means over seeds, lengths in millimetres."""
        points = analysis.tables["points"]
        columns = [name for length in _LENGTHS for name in (length, marked(length, "SE"))]
        return told_means(points.assign(**(1e3 * points[columns])), told_by_engine(points, self.named), self.shown)

    def about_points(self, analysis: Analysis[Finding]) -> str:
        """Seeds, and how many piles held fast."""
        runs = judging(analysis.tables["runs"])
        counts = judging(analysis.tables["points"])[SEEDS]
        return f"{told_seeds(runs, counts, 'point')}. {_told_held(runs)}"

    def draw(self, output: Path, analysis: Analysis[Finding], footer: Sequence[str]) -> Sequence[Path]:
        """Force against displacement, means by procedure, and peaks against ⟨N⟩."""
        return figures.draw(
            output,
            points=judging(analysis.tables["points"]),
            runs=judging(analysis.tables["runs"]),
            manifests=analysis.found.manifests,
            footer=footer,
        )


def _told_held(runs: pd.DataFrame) -> str:
    """How many piles held fast, and what their numbers are then."""
    held = int(runs[HELD_FAST].sum())
    if not held:
        return "No pile held fast."
    limits = told_range(runs[LIMIT].round(3))
    return (
        f"Held fast: {held} of {len(runs)} runs, whose hook stopped at {limits} n W_s; their peaks and work are lower "
        "bounds."
    )
