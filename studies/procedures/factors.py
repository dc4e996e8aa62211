"""The study `factors`: which difference between the paper's text and its own code decides what a shape change leaves.

A full factorial of three differences that a shape change feels: the motor's law at its torque limit, friction, and the
radius of the wall. The main effect of one is the mean of paired differences, code less text, over aspect ratios,
seeds and all combinations of the other two.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.scene_file import read_scene
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.factorial import paired_differences
from postprocess.statistics.findings import Finding, judge, negative, told
from postprocess.statistics.points import averaged, seeds_of
from postprocess.statistics.seeds import mean_over_seeds
from studies.base.activity import ENERGY, HEIGHT, PHI_ACTIVE, procedure_row
from studies.base.figures import draw_combinations
from studies.base.paper import PaperStudy
from studies.base.procedures import CROSSINGS, PROCEDURE, SHAPE
from studies.base.runs import Collected, MeasuredRun, runs_table, told_bars, told_range, told_seeds
from studies.base.study import Analysis, Tables

LAW, FRICTION, RADIUS = "law", "friction [-]", "wall radius [m]"
FACTORS: Mapping[str, tuple[object, object]] = MappingProxyType(
    {LAW: ("halt", "ease"), FRICTION: (0.4, 0.2), RADIUS: (0.0234, 0.0224)}
)
"""The differences: by the text, and by the code."""

QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        CROSSINGS: "⟨N⟩ at rest after the shape change",
        HEIGHT: "height of the centre of mass at rest after it, over that before",
        PHI_ACTIVE: "packing fraction over the last frames of the activity",
        ENERGY: "work of the motors",
    }
)
"""What is compared."""

_CALLED = {
    LAW: "the motor's law (half speed, for a halt)",
    FRICTION: "friction (0.2, for 0.4)",
    RADIUS: "the wall's radius (22.4 mm, for 23.4)",
}
_SYMBOLS = {CROSSINGS: "⟨N⟩", HEIGHT: "h/h0", PHI_ACTIVE: "φ_f", ENERGY: "energy per smarticle [J]"}
_DRAWN = {CROSSINGS: r"$\langle N \rangle$ after the shape change [-]", HEIGHT: r"height over $h_0$ after it [-]"}
_SIGNS = {CROSSINGS: 1, HEIGHT: 1, PHI_ACTIVE: -1, ENERGY: 1}


class Factors(PaperStudy):
    """Runs of a shape change, by every combination of the factors."""

    name = "factors"
    told_by_tables = True
    title = "What the paper's text and its own code differ in, one by one: shape change"
    quantities = QUANTITIES
    named: Mapping[str, Callable[[pd.Series], str]] = MappingProxyType(
        {
            "law": lambda point: str(point[LAW]),
            "friction": lambda point: f"{point[FRICTION]:g}",
            "wall [mm]": lambda point: f"{1e3 * point[RADIUS]:.1f}",
            "l/w": lambda point: f"{point[ASPECT]:g}",
            "seeds": lambda point: str(point[SEEDS]),
        }
    )
    shown = MappingProxyType(
        {CROSSINGS: ("⟨N⟩", ".2f"), HEIGHT: ("h/h0", ".3f"), PHI_ACTIVE: ("φ_f", ".4f"), ENERGY: ("energy [J]", ".2e")}
    )

    def measure(self, run: RunManifest) -> MeasuredRun:
        """The shape change, and what of the rules it went by."""
        row = procedure_row(run)
        if row[PROCEDURE] != SHAPE:
            msg = f"{run.directory}: {row[PROCEDURE]}, where factors are of shape changes; leave it out"
            raise InputError(msg)
        scene = read_scene(run.directory)
        motor, contact = scene.part("motor"), scene.part("contact")
        rules = {
            LAW: str(motor.values["law"]) if motor else "",
            FRICTION: contact.number("friction_smarticle") if contact else float("nan"),
            RADIUS: run.container_radius,
        }
        return MeasuredRun(manifest=run, rows=[{**rules, **row}])

    def refuse(self, found: Collected) -> None:
        """Other numbers of smarticles at one aspect ratio, a combination and seed twice."""
        found.refuse_mixed_counts()
        found.refuse_repeats("combination", lambda run: " ".join(f"{run.row[name]}" for name in (*FACTORS, ASPECT)))

    def tabulate(self, found: Collected) -> Tables:
        """Runs, and means of every combination."""
        runs = runs_table(found).sort_values([*FACTORS, ASPECT, SEED], ignore_index=True, kind="stable")
        rows = []
        for key, group in runs.groupby([*FACTORS, ASPECT], sort=True):
            combination = dict(zip((*FACTORS, ASPECT), key, strict=True))
            rows.append({**combination, **seeds_of(group), **averaged(group, QUANTITIES)})
        return {"runs": runs, "points": pd.DataFrame(rows)}

    def judge(self, tables: Tables) -> tuple[Finding, ...]:
        """Main effects: whether each difference pushes a quantity the way in which the paper's findings lie."""
        runs = tables["runs"]
        return tuple(_effect(runs, quantity, factor) for quantity, factor in product(QUANTITIES, FACTORS))

    def about_runs(self, analysis: Analysis[Finding]) -> tuple[str, ...]:
        """Which runs, and what an effect is."""
        runs = analysis.tables["runs"]
        counts = analysis.tables["points"].set_index([*FACTORS, ASPECT])[SEEDS]
        ratios = " ".join(f"{ratio:g}" for ratio in sorted(runs[ASPECT].unique()))
        numbers = told_range(runs.groupby(ASPECT)["smarticles [-]"].first())
        return (
            f"l/w {ratios}, {numbers} smarticles, {told_seeds(runs, counts, 'combination')}. "
            f"{told_bars(counts, 'combination')}.",
            "Effect of a difference: mean of paired differences, code less text, over l/w, seeds and all combinations "
            "of the other two; pairs begin with piles of the same random poses.",
        )

    def about_points(self, analysis: Analysis[Finding]) -> str:
        """Seeds."""
        counts = analysis.tables["points"][SEEDS]
        return f"{told_seeds(analysis.tables['runs'], counts, 'combination')}."

    def draw(self, output: Path, analysis: Analysis[Finding], footer: Sequence[str]) -> Sequence[Path]:
        """⟨N⟩ and height of every combination."""
        return draw_combinations(
            output / "factors",
            points=analysis.tables["points"],
            factors=FACTORS,
            shown=_DRAWN,
            named=_named,
            footer=footer,
        )


def effects(runs: pd.DataFrame, quantity: str, factor: str) -> pd.DataFrame:
    """Paired differences of a quantity, by the code's rule less by the text's, all else alike."""
    others = [name for name in (*FACTORS, ASPECT, SEED) if name != factor]
    return paired_differences(runs, quantity, factor, FACTORS[factor], others)


def _named(row: pd.Series) -> str:
    return f"{row[LAW]}, μ = {row[FRICTION]:g}, r = {1e3 * row[RADIUS]:.1f} mm"


def _effect(runs: pd.DataFrame, quantity: str, factor: str) -> Finding:
    differences = effects(runs, quantity, factor)
    effect, sign, symbol = mean_over_seeds(differences[quantity]), _SIGNS[quantity], _SYMBOLS[quantity]
    by_aspect = differences.groupby(ASPECT)[quantity].mean()
    places = ", ".join(f"{aspect:g}: {value:+.3g}" for aspect, value in by_aspect.items()) or "none"
    return Finding(
        paper=f"(ours) {symbol} after a shape change is {'raised' if sign > 0 else 'lowered'} by {_CALLED[factor]}",
        ours=f"code less text {told(effect, 3)}; by l/w {places}",
        verdict=judge(effect if sign > 0 else negative(effect)),
        criterion=f"mean of paired differences {'>' if sign > 0 else '<'} 0",
    )
