"""What φ before and after shaking owes to each choice of the contact model, one at a time, at l/w = 0.7.

The first variant is the baseline; each other one differs from it in one choice: restitution, friction, damping,
stiffness or sphere diameter, and in `sensitivity-section` pitch and rows of spheres, up to the true section.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.statistics.points import ASPECT, SEED, marked, seeds_of
from postprocess.statistics.seeds import SeedMean, mean_over_seeds, relative_difference
from studies.framework import plots
from studies.framework.figures import Analysis, Drawing
from studies.framework.findings import Effect, Finding, Outcome, Verdict
from studies.framework.provenance import DIGITISING_ERROR, GRAVISH, read_reference, reference_at, told_reference
from studies.framework.quantities import Key, Quantity
from studies.framework.runs import DEFINITION, Row
from studies.framework.shaken import SHAKEN, STAGES, WHEN, measured_row
from studies.framework.study import Study

VARIANT = "variant"
VARIANTS = (
    "draft",
    "restitution-0.2",
    "restitution-0.8",
    "tangential-damping-0",
    "stiffness-1000",
    "friction-0.6",
    "diameter-1.127mm",
    "diameter-1.27mm",
    "pitch-1.0",
    "pitch-0.5",
    "two-rows",
)
"""In the order of the sweeps."""

COMPARED = {
    "phi_0": (f"phi_0 {DEFINITION} [-]", "φ_0", ".4f"),
    "phi_f": (f"phi_f {DEFINITION} [-]", "φ_f", ".4f"),
    "crossings after": ("crossings after [-]", "⟨N⟩ after", ".2f"),
}


def measure(run: Run) -> Row:
    """Measure φ and crossings before and after shaking; the variant is in the name of the run."""
    found = re.fullmatch(r"(.+)_seed(\d+)", run.path.name)
    if found is None or int(found[2]) != run.manifest.seed:
        msg = (
            f"{run.path}: runs of this study are named VARIANT_seedN, here N = {run.manifest.seed}; do not rename runs"
        )
        raise InputError(msg)
    return {VARIANT: found[1], **measured_row(run, [DEFINITION])}


def changes(runs: pd.DataFrame, column: str) -> dict[str, SeedMean]:
    """Change of the mean of each variant against the baseline's, which is taken as exact, by Welch [%]."""
    means = {str(name): mean_over_seeds(part[column]) for name, part in runs.groupby(VARIANT, sort=False)}
    first, *others = means
    found = {name: relative_difference(means[name], means[first]) for name in others}
    return {
        name: SeedMean(value=one.value, standard_error=math.nan, half_width=one.half_width, count=means[name].count)
        for name, one in found.items()
    }


def summarise(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Make `summary`: means over seeds by variant, and changes against the first one."""
    compared = {name: changes(runs, column) for name, (column, _, _) in COMPARED.items()}
    rows = []
    for variant, group in runs.groupby(VARIANT, sort=False):
        row: dict[str, object] = {VARIANT: variant, **seeds_of(group)}
        for name, (column, _, _) in COMPARED.items():
            mean, change = mean_over_seeds(group[column]), compared[name].get(str(variant))
            row |= {column: mean.value, marked(column, "95 %"): mean.half_width}
            row[f"{name} change [%]"] = change.value if change else math.nan
            row[f"{name} change 95 % [%]"] = change.half_width if change else math.nan
            row[f"{name} clear"] = bool(change and abs(change.value) > change.half_width)
        rows.append(row)
    return {"summary": pd.DataFrame(rows)}


def owes(name: str) -> Finding:
    """Make the finding that a quantity changes with a choice."""
    column, symbol, _ = COMPARED[name]

    def outcome(runs: pd.DataFrame) -> Outcome:
        found = changes(runs, column)
        effects = []
        for variant, change in found.items():
            clear = ", clear" if abs(change.value) > change.half_width else ""
            text = f"{change.value:+.1f} ± {change.half_width:.1f} %{clear}"
            effects.append(Effect(label=variant, value=change, sign=0, text=text))
        verdict = Verdict.FOUND if any(effect.text.endswith("clear") for effect in effects) else Verdict.NOT_RESOLVED
        return Outcome(effects=effects, verdict=verdict if found else Verdict.NO_DATA)

    return Finding(
        id=f"{name.replace(' ', '-').replace('_', '-')}-changes",
        says=f"(ours) {symbol} depends on a choice of the contact model",
        outcome=outcome,
        found_if="a change of the mean against the baseline beyond its 95 % half-width, by Welch; where a choice "
        "changes nothing, one change in twenty still is",
    )


def _draw(path: Path, analysis: Analysis) -> list[Path]:
    """Draw φ before and after shaking, a row for each variant."""
    runs, points = analysis.runs, analysis.points
    places = {variant: row for row, variant in enumerate(points[VARIANT])}
    aspect, reference = float(runs[ASPECT].iloc[0]), read_reference()
    figure = style.blank_figure(1.5 * style.COLUMN_WIDTH, max(0.85 + 0.19 * len(points), 2.2))
    panels = figure.subplots(1, 2, sharey=True)
    for axes, stage, symbol in zip(panels, ("phi_0", "phi_f"), (r"$\phi_0$", r"$\phi_\mathrm{f}$"), strict=True):
        column = COMPARED[stage][0]
        bars = points[marked(column, "95 %")].to_numpy()
        low, high = points[column].iloc[0] - bars[0], points[column].iloc[0] + bars[0]
        axes.axvspan(low, high, color=style.SKY, alpha=0.3, linewidth=0, label="baseline, 95 %")
        known = reference_at(reference, aspect, stage)
        if math.isfinite(known):
            edges = known - DIGITISING_ERROR, known + DIGITISING_ERROR
            axes.axvspan(*edges, color=style.ORANGE, alpha=0.12, linewidth=0)
            axes.axvline(known, color=style.ORANGE, linewidth=0.9, label="Gravish et al. 2012")
        axes.plot(runs[column], runs[VARIANT].map(places) + 0.28, ".", markersize=2.4, color=style.GREY)
        look = {**plots.marker("D", style.BLUE, style.BLUE), "linestyle": "none"}
        plots.draw_means(
            axes, points[column], range(len(points)), None, across=bars, look=look, label="mean over seeds"
        )
        axes.set_xlabel(f"{symbol} {STAGES[stage]} [-]")
    panels[0].set_yticks(range(len(points)), labels=list(points[VARIANT]))
    panels[0].set_ylim(len(points) - 0.4, -0.6)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    told = ["Small dots: single runs.", told_reference([aspect], ["phi_0", "phi_f"])]
    return plots.finished(figure, path, told, analysis.footer)


STUDY = Study(
    name="sensitivity",
    title="Packing and the choices of the contact model",
    measure=measure,
    keys=(Key(column=VARIANT, label="variant", order=VARIANTS),),
    quantities=tuple(
        Quantity(column=column, label=label, form=form, meaning=meaning)
        for (column, label, form), meaning in zip(
            COMPARED.values(),
            ("φ before shaking", "φ at the end of shaking", "links through a smarticle's plane after shaking"),
            strict=True,
        )
    ),
    findings=tuple(map(owes, COMPARED)),
    figures=(Drawing(name="sensitivity", of=_draw),),
    extra=summarise,
    order=(VARIANT, SEED),
    constant={ASPECT: (), SHAKEN: ()},
    same_count=(),
    one_engine=True,
    remarks=(f"φ by {DEFINITION}; {WHEN}.",),
    reference=GRAVISH,
    pictured={"variant": "draft"},
)
