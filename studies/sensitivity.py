"""Sensitivity of φ before and after shaking to the parameters of the contact model, one at a time.

The first variant is the baseline. Each other variant changes one parameter: restitution, friction, damping, stiffness
or sphere diameter; in `sensitivity-section` pitch and rows of spheres, up to the true cross-section.
"""

import math
import re

import pandas as pd

from dem.errors import InputError
from dem.record.run import Run
from postprocess.statistics.points import ASPECT, SEED, marked, seeds_of
from postprocess.statistics.seeds import Difference, mean_over_seeds, relative_difference
from studies.framework.figures import Rows
from studies.framework.findings import Finding, Outcome, decide
from studies.framework.runs import DEFINITION, Key, Row, declare
from studies.framework.shaken import GRAVISH, SHAKEN, WHEN, gravish_at, gravish_note, measured_row, phi
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
)  #: Variants in the order of the sweeps

COMPARED = {"phi_0": phi("phi_0"), "phi_f": phi("phi_f"), "crossings after": "crossings after [-]"}
QUANTITIES = declare(
    {
        COMPARED["phi_0"]: ("φ_0", ".4f", "φ before shaking"),
        COMPARED["phi_f"]: ("φ_f", ".4f", "φ at the end of shaking"),
        COMPARED["crossings after"]: ("⟨N⟩ after", ".2f", "links through a smarticle's plane after shaking"),
    }
)


def measure(run: Run) -> Row:
    """Measure φ and crossings before and after shaking; return the run's row, with its variant.

    A variant is a choice of the contact model, see `VARIANTS`. It is read from the name of the run, VARIANT_seedNUMBER;
    InputError if the name is another one.
    """
    found = re.fullmatch(r"(.+)_seed(\d+)", run.path.name)
    if found is None or int(found[2]) != run.manifest.seed:
        raise InputError(
            f"{run.path}: must be named VARIANT_seed{run.manifest.seed}; give the run its name back, or run it again"
        )
    return {VARIANT: found[1], **measured_row(run, [DEFINITION])}


def changes(runs: pd.DataFrame, column: str) -> dict[str, Difference]:
    """Return the change of a column's mean against the baseline [%] by variant, with its 95 % interval.

    The baseline is the variant of the first run. Its mean counts as exact where changes are divided by it. The
    intervals are Welch's.
    """
    means = {str(name): mean_over_seeds(part[column]) for name, part in runs.groupby(VARIANT, sort=False)}
    first, *others = means
    return {name: relative_difference(means[name], means[first]) for name in others}


def summarise(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Make the table `summary`: means over seeds, and changes against the baseline [%], a row per variant."""
    compared = {name: changes(runs, column) for name, column in COMPARED.items()}
    rows = []
    for variant, group in runs.groupby(VARIANT, sort=False):
        row: dict[str, object] = {VARIANT: variant, **seeds_of(group)}
        for name, column in COMPARED.items():
            mean, change = mean_over_seeds(group[column]), compared[name].get(str(variant))
            row |= {column: mean.value, marked(column, "95 %"): mean.half_width}
            row[f"{name} change [%]"] = change.value if change else math.nan
            row[f"{name} change 95 % [%]"] = change.half_width if change else math.nan
            row[f"{name} clear"] = bool(change and change.clear)
        rows.append(row)
    return {"summary": pd.DataFrame(rows)}


def depends(name: str) -> Finding:
    """Make the finding that a quantity depends on a parameter of the contact model.

    `name` is the quantity, a key of `COMPARED`.
    """
    column = COMPARED[name]

    def outcome(runs: pd.DataFrame) -> Outcome:
        found = changes(runs, column)
        texts = [
            f"{variant} {one.value:+.1f} ± {one.half_width:.1f} %{', clear' * one.clear}, not judged"
            for variant, one in found.items()
        ]
        clear = any(one.clear for one in found.values())
        return Outcome(note="; ".join(texts), verdict=decide(clear, data=bool(found)))

    return Finding(
        id=f"{name.replace(' ', '-').replace('_', '-')}-changes",
        says=f"(ours) {QUANTITIES[column].label} depends on a choice of the contact model",
        outcome=outcome,
        found_if="a change of the mean against the baseline beyond its 95 % half-width, by Welch; where a choice "
        "changes nothing, one change in twenty still is",
    )


STUDY = Study(
    name="sensitivity",
    title="Packing and the choices of the contact model",
    measure=measure,
    keys=(Key(column=VARIANT, label="variant", order=VARIANTS),),
    quantities=tuple(QUANTITIES.values()),
    findings=tuple(map(depends, COMPARED)),
    figures=(
        Rows(
            name="sensitivity",
            quantities=[QUANTITIES[COMPARED[stage]] for stage in ("phi_0", "phi_f")],
            row=VARIANT,
            levels={COMPARED[stage]: gravish_at(0.7, stage) for stage in ("phi_0", "phi_f")},
            notes=[f"Lines: {gravish_note([0.7])}"],
        ),
    ),
    extra=summarise,
    order=(VARIANT, SEED),
    constant={ASPECT: (), SHAKEN: ()},
    same_count=(),
    one_engine=True,
    remarks=(f"φ by {DEFINITION}; {WHEN}.",),
    reference=GRAVISH,
    pictured={"variant": "draft"},
)
