"""U-shapes of several l/w, poured and shaken at Γ = 2 and 30 Hz, against the packing fractions of Gravish et al.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012): steel staples shaken
for 20 s. Their points are digitised (`postprocess/reference/README.md`); they are compared at equal l/w only and never
interpolated. --quick takes minutes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from dem.record.run import Run
from postprocess.measures.packing import DEFINITIONS
from postprocess.statistics.points import ASPECT, SEED, SEEDS
from postprocess.statistics.seeds import SeedMean, mean_over_seeds
from studies.framework.engines import by_engine
from studies.framework.figures import Histories, Means, Series, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, Verdict
from studies.framework.plots import ASPECT_LABEL, CROSSINGS_LABEL, procedure_marker
from studies.framework.procedures import EXTERNAL
from studies.framework.provenance import (
    COLUMNS,
    DIGITISING_ERROR,
    GRAVISH,
    SHAKE_TIME,
    read_reference,
    reference_at,
    told_reference,
)
from studies.framework.quantities import Key, Quantity
from studies.framework.runs import DEFINITION, Row
from studies.framework.shaken import SHAKEN, STAGES, WHEN, measured_row, packing_history, phi
from studies.framework.study import Study

ACCEPTED = 10.0  # % of mean absolute deviation from Gravish's points
COSTLY = "voronoi"  # takes seconds per frame, and is left out of drafts

_SYMBOLS = {
    "phi_0": ("φ_0", "$\\phi_0$ before shaking [-]"),
    "phi_f": ("φ_f", "$\\phi_\\mathrm{f}$ at the end [-]"),
    "phi_f relaxed": ("φ_f at rest again", ""),
}


QUANTITIES = {
    quantity.column: quantity
    for quantity in (
        *(
            Quantity(
                column=phi(stage, definition),
                label=_SYMBOLS[stage][0] if definition == DEFINITION else "",
                form=".4f",
                axis=_SYMBOLS[stage][1],
                meaning=f"packing fraction {meaning}, by {definition}",
            )
            for definition in DEFINITIONS
            for stage, meaning in STAGES.items()
            if stage != "phi_f relaxed" or definition in (DEFINITION, "top-percentile")
        ),
        *(
            Quantity(
                column=f"crossings {when} [-]",
                label=f"⟨N⟩ {when}",
                form=".2f",
                axis=f"{CROSSINGS_LABEL}\n{meaning}",
                meaning=f"links through a smarticle's plane {meaning}",
            )
            for when, meaning in zip(("before", "after", "relaxed"), STAGES.values(), strict=True)
        ),
    )
}


def measure(run: Run) -> Row:
    """Measure φ and crossings before and after shaking."""
    row = measured_row(run, [name for name in DEFINITIONS if name != COSTLY or run.manifest.fidelity != "draft"])
    missing = dict.fromkeys([name for name in QUANTITIES if name not in row], math.nan)
    return row | missing | {SHAKEN: round(float(str(row[SHAKEN])), 3)}


def phi_by_aspect(runs: pd.DataFrame, stage: str) -> Mapping[float, SeedMean]:
    """Average φ of a stage over seeds, by ascending l/w."""
    found = {float(aspect): mean_over_seeds(part[phi(stage)]) for aspect, part in runs.groupby(ASPECT)}
    return {aspect: mean for aspect, mean in found.items() if mean.count}


def deviations(runs: pd.DataFrame) -> pd.DataFrame:
    """Set φ against Gravish's points, one row per stage and l/w at which there is one."""
    reference, rows = read_reference(), []
    for stage in STAGES:
        for aspect, mean in phi_by_aspect(runs, stage).items():
            known = reference_at(reference, aspect, stage)
            if math.isnan(known):
                continue
            rows.append(
                {
                    "stage": stage,
                    "definition": DEFINITION,
                    ASPECT: aspect,
                    SEEDS: mean.count,
                    "phi [-]": mean.value,
                    "phi 95 % [-]": mean.half_width,
                    "phi Gravish [-]": known,
                    "digitising error [-]": DIGITISING_ERROR,
                    "deviation [-]": mean.value - known,
                    "deviation [%]": 100 * (mean.value / known - 1),
                    "deviation 95 % [%]": 100 * mean.half_width / known,
                }
            )
    return pd.DataFrame(rows)


def steps(runs: pd.DataFrame) -> pd.DataFrame:
    """Subtract φ at neighbouring l/w; errors are the root of the sum of squares of both half-widths."""
    rows = []
    for stage in STAGES:
        for (low, one), (high, other) in itertools.pairwise(phi_by_aspect(runs, stage).items()):
            difference, half_width = other.value - one.value, math.hypot(one.half_width, other.half_width)
            way = "falls" if difference < 0 else "rises"
            if not abs(difference) > half_width:
                way = "no error bar" if math.isnan(half_width) else "within error bars"
            rows.append(
                {
                    "stage": stage,
                    "definition": DEFINITION,
                    "from aspect ratio [-]": low,
                    "to aspect ratio [-]": high,
                    "difference [-]": difference,
                    "combined 95 % [-]": half_width,
                    "phi": way,
                }
            )
    return pd.DataFrame(rows)


def tabulate(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Make `deviations` and `steps`, engine by engine."""
    return {"deviations": by_engine(runs, deviations), "steps": by_engine(runs, steps)}


def falls(stage: str) -> Finding:
    """Make the finding that φ of a stage falls monotonically with l/w."""

    def outcome(runs: pd.DataFrame) -> Outcome:
        means = list(phi_by_aspect(runs, stage).items())
        if len(means) < 2:
            return Outcome(note="fewer than two aspect ratios", verdict=Verdict.NOT_RESOLVED)
        found = steps(runs)
        found = found[found["stage"] == stage]
        ways = found["phi"].value_counts()
        fall, rise, within, bare = (
            ways.get(name, 0) for name in ("falls", "rises", "within error bars", "no error bar")
        )
        (low, first), (high, last) = means[0], means[-1]
        half_width = math.hypot(first.half_width, last.half_width)
        total = SeedMean(value=last.value - first.value, standard_error=math.nan, half_width=half_width, count=2)
        effect = Effect(
            label=f"change from l/w = {low:g} to {high:g}",
            value=total,
            sign=-1,
            text=f"{total.value:+.4f} ± {half_width:.4f} (95 %)",
        )
        note = f"of {len(found)} steps {fall} fall and {rise} rise by more than the combined 95 % half-width, {within} "
        note += f"lie within it, {bare} have no error bar; means fall at {(found['difference [-]'] < 0).sum()}"
        # A flat line with wide error bars is not monotone: the whole change must be beyond them.
        clear = effect.verdict == Verdict.FOUND and not bare
        verdict = Verdict.NOT_FOUND if rise else Verdict.FOUND if clear else Verdict.NOT_RESOLVED
        return Outcome(effects=[effect], note=note, verdict=verdict)

    return Finding(
        id=f"{_id(stage)}-falls",
        says=f"{_SYMBOLS[stage][0]} falls monotonically with l/w within error bars",
        outcome=outcome,
        found_if="no step between neighbouring l/w rises by more than its 95 % half-width, and the whole change is "
        "beyond its own",
    )


def near(stage: str) -> Finding:
    """Make the finding that φ of a stage is near Gravish's."""

    def outcome(runs: pd.DataFrame) -> Outcome:
        found = deviations(runs)
        found = found[found["stage"] == stage] if len(found) else found
        if found.empty:
            return Outcome(note="Gravish has no point at these l/w", verdict=Verdict.NOT_RESOLVED)
        percent = found["deviation [%]"]
        half_width = float(np.hypot.reduce(found["deviation 95 % [%]"])) / len(found)
        worst = found.loc[percent.abs().idxmax()]
        value = SeedMean(value=percent.abs().mean(), standard_error=math.nan, half_width=half_width, count=len(found))
        error = f"± {half_width:.1f} % (95 %)" if math.isfinite(half_width) else "without an error bar"
        note = f"the largest {worst['deviation [%]']:+.1f} % at l/w = {worst[ASPECT]:g}; reading Gravish's points is "
        note += f"uncertain by about {100 * DIGITISING_ERROR / found['phi Gravish [-]'].mean():.1f} %"
        effect = Effect(label="mean absolute deviation", value=value, sign=0, text=f"{value.value:.1f} % {error}")
        verdict = Verdict.FOUND if value.value <= ACCEPTED else Verdict.NOT_FOUND
        return Outcome(effects=[effect], note=note, verdict=verdict)

    return Finding(
        id=f"{_id(stage)}-near",
        says=f"The mean absolute deviation of {_SYMBOLS[stage][0]} from Gravish is at most {ACCEPTED:g} %",
        outcome=outcome,
        found_if="mean over the l/w at which Gravish has a point",
    )


def _id(stage: str) -> str:
    return stage.replace("_", "-").replace(" ", "-")


def _compacts(runs: pd.DataFrame) -> Outcome:
    gain = runs[phi("phi_f")] - runs[phi("phi_0")]
    means = [mean_over_seeds(part) for _, part in gain.groupby(runs[ASPECT])]
    clear = sum(mean.value > mean.half_width for mean in means)
    least = min((mean.value for mean in means if not math.isnan(mean.value)), default=math.nan)
    verdict = Verdict.FOUND if clear == len(means) else Verdict.NOT_RESOLVED
    if any(mean.value <= 0 for mean in means):
        verdict = Verdict.NOT_FOUND
    note = f"gain paired by seed: above 0 by more than its 95 % half-width at {clear} of {len(means)} l/w, and in "
    return Outcome(
        note=f"{note}{(gain > 0).sum()} of {len(gain)} runs; the least mean is {least:+.4f}", verdict=verdict
    )


def _line(points: pd.DataFrame) -> list[Series]:
    return [Series(rows=points, label="simulation", look=procedure_marker(EXTERNAL))]


_PUBLISHED = read_reference()

STUDY = Study(
    name="gravish",
    title="Packing of shaken smarticles against Gravish et al. 2012",
    measure=measure,
    keys=(Key(column=ASPECT, label="l/w", form="g"), Key(column=SHAKEN, label="shaken [s]", form="g")),
    quantities=tuple(QUANTITIES.values()),
    findings=(
        *map(falls, STAGES),
        Finding(
            id="compacts",
            says="φ_f is above φ_0 at every l/w",
            outcome=_compacts,
            found_if="gain paired by seed beyond its 95 % half-width at every l/w",
        ),
        *map(near, STAGES),
    ),
    figures=(
        Means(
            name="phi",
            quantities=[QUANTITIES[phi(stage)] for stage in ("phi_0", "phi_f")],
            x=ASPECT,
            x_label=ASPECT_LABEL,
            split=_line,
            share_y=True,
            reference={
                phi(stage): (_PUBLISHED["l_over_w"], _PUBLISHED[COLUMNS[stage]]) for stage in ("phi_0", "phi_f")
            },
            told=[told_reference(sorted(_PUBLISHED["l_over_w"]), ("phi_0", "phi_f"))],
        ),
        Means(
            name="crossings",
            quantities=[QUANTITIES[f"crossings {when} [-]"] for when in ("before", "after")],
            x=ASPECT,
            x_label=ASPECT_LABEL,
            split=_line,
            share_y=True,
        ),
        Histories(
            name="phi_time",
            history=packing_history,
            split=one_by_one(ASPECT, "l/w = {:g}".format, last=0.9),
            x_label="time since shaking began [s]",
            y_label=r"packing fraction $\phi$ [-]",
        ),
    ),
    extra=tabulate,
    order=(ASPECT, SEED),
    from_tables=True,
    remarks=(
        f"φ by {DEFINITION} unless named otherwise; {WHEN} (voxel and voronoi: the last frame, voronoi not of drafts). "
        f"Gravish et al. shook for {SHAKE_TIME:g} s.",
    ),
    reference=GRAVISH,
    pictured={"l_over_w": 0.7},
)
