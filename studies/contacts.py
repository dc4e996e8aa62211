"""Effect of friction between smarticles, friction at the container and restitution on packing.

All combinations of two values of these three factors at three l/w, shaken as by Gravish et al. The effect of a factor
is the mean of paired differences, second value less first, between runs that are equal in everything else. Differences
at one l/w and seed are averaged first, so that the number of samples is that of the seeds.
"""

import math

import numpy as np
import pandas as pd

from dem.record.run import Run
from postprocess.geometry.links import centres_of_mass
from postprocess.statistics.points import (
    ASPECT,
    SEED,
    SEEDS,
    format_with_error,
    marked,
    mean_columns,
    paired_differences,
)
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.figures import Rows, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, Verdict, decide
from studies.framework.runs import ASPECT_KEY, DEFINITION, Key, Quantity, Row, declare
from studies.framework.shaken import (
    DIGITISING_ERROR,
    FRICTION,
    GRAVISH,
    WHEN,
    WINDOW,
    contact_of,
    gravish_at,
    phi,
    timed_row,
)
from studies.framework.study import Study

MARGIN = 5.0  # %, accepted deviation from Gravish's points
WALL, RESTITUTION = "friction at the container [-]", "restitution [-]"
FACTORS: dict[str, tuple[float, float]] = {FRICTION: (0.4, 0.8), WALL: (0.4, 0.8), RESTITUTION: (0.7, 0.3)}
"""First value (of Savoie et al.) and second value of each factor [-]."""

CALLED = {FRICTION: "friction between smarticles", WALL: "friction at the container", RESTITUTION: "restitution"}
RISEN, CROSSED = "lowest tenth after less before shaking [w]", "crossings after [-]"
PHI_0, PHI_F, PHI_RELAXED = (phi(stage) for stage in ("phi_0", "phi_f", "phi_f relaxed"))
QUANTITIES = declare(
    {
        PHI_0: ("phi_0", ".4f", "packing fraction before shaking"),
        PHI_F: ("phi_f", ".4f", "packing fraction at the end of shaking"),
        PHI_RELAXED: ("phi_f at rest again", ".4f", "packing fraction after the rest that follows"),
        CROSSED: ("N after shaking", ".2f", "links through a smarticle's plane at the end of shaking"),
        RISEN: (
            "the rise of the lowest tenth [w]",
            ".3f",
            "mean height of the lowest tenth of smarticles, after less before",
        ),
    },
    axes={RISEN: "rise of the lowest tenth [w]"},
)
TOGETHER, EVERYWHERE = "both frictions together", "all"
QUANTITY, FACTOR, EFFECT, SHARE = "quantity", "factor", "effect [unit of the quantity]", "effect over the mean [%]"
DEVIATION = "deviation of phi_f from Gravish [%]"


def measure(run: Run) -> Row:
    """Measure φ before, during and after shaking, and the rise of the lowest smarticles; return the row."""
    contact = contact_of(run)
    known = {
        FRICTION: contact["friction_smarticle"],
        WALL: contact["friction_wall"],
        RESTITUTION: contact["restitution"],
        RISEN: lowest_rise(run),
    }
    return timed_row(run, known)


def lowest_rise(run: Run) -> float:
    """Return the rise of the lowest tenth of all smarticles by shaking, over their middle length w [-].

    It is negative in a pile that compacts, and positive if the whole pile climbs in its container and leaves a gap at
    the floor. Mean heights of the lowest tenth are averaged over the last `WINDOW` of shaking and of the phase before.
    """
    frames, heights = run.frames, []
    shaken = next(phase.index for phase in run.phases if phase.type == "shake")
    for phase in (shaken - 1, shaken):
        part = run.at_intervals(frames.in_phase(phase))
        late = part.after(part.times[-1] - WINDOW)
        levels = [centres_of_mass(one.vertices)[:, 2] - one.floor_z for one in late]
        count = max(round(len(levels[0]) / 10), 1)
        heights.append(float(np.mean([np.partition(each, count - 1)[:count].mean() for each in levels])))
    return (heights[1] - heights[0]) / run.manifest.middle_length_m


def points(runs: pd.DataFrame) -> pd.DataFrame:
    """Average over seeds, and compute the deviation of φ_f from Gravish's φ_f [%].

    The error of the deviation combines the errors of our mean and of reading Gravish's point.
    """
    means = STUDY.points(runs)
    values = means[ASPECT].map(lambda aspect: gravish_at(aspect, "phi_f"))
    error = np.hypot(means[marked(PHI_F, "95 %")], DIGITISING_ERROR)
    changes = {DEVIATION: 100 * (means[PHI_F] / values - 1), marked(DEVIATION, "95 %"): 100 * error / values}
    return means.assign(**changes)


def by_seed(runs: pd.DataFrame, quantity: str, *changed: str) -> pd.DataFrame:
    """Return the effect of one factor, or the interaction of two (`changed`), by l/w and seed."""
    table, left = runs, [*FACTORS, ASPECT, SEED]
    for factor in changed:
        left = [name for name in left if name != factor]
        table = paired_differences(table, quantity, factor, FACTORS[factor], left)
    return table.groupby([ASPECT, SEED], as_index=False)[quantity].mean()


def effects(runs: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the effect of each factor on each quantity: a row for each l/w and one over all l/w."""
    rows = []
    for quantity, declared in QUANTITIES.items():
        for factor, changed in {**{CALLED[name]: (name,) for name in FACTORS}, TOGETHER: (FRICTION, WALL)}.items():
            table = by_seed(runs, quantity, *changed)
            for place, group in [*((f"{ratio:g}", part) for ratio, part in table.groupby(ASPECT)), (EVERYWHERE, table)]:
                effect = mean_over_seeds(group[quantity])
                mean = float(runs[runs[ASPECT].isin(group[ASPECT])][quantity].mean())
                row = {QUANTITY: declared.label, FACTOR: factor, ASPECT: place, SEEDS: effect.count}
                row |= mean_columns(EFFECT, effect)
                rows.append(row | {SHARE: 100 * effect.value / mean if mean else math.nan})
    return pd.DataFrame(rows)


def lowers(name: str, says: str, quantity: str, *changed: str, sign: int = -1, less: str = "") -> Finding:
    """Make the finding that the factor `changed`, or the interaction of two factors, lowers a quantity.

    `says` is its statement. `sign` is −1 for "lowers" and +1 for "raises". With `less`, the name of another
    factor, the statement is that `changed` lowers the quantity by more than `less` does.
    """

    def outcome(runs: pd.DataFrame) -> Outcome:
        table = by_seed(runs, quantity, *changed)
        if less:
            both = table.merge(by_seed(runs, quantity, less), on=[ASPECT, SEED], suffixes=("", " other"))
            table = both.assign(**{quantity: both[quantity] - both[f"{quantity} other"]})
        form, groups = QUANTITIES[quantity].form, {"": table, **dict(iter(table.groupby(ASPECT)))}
        means = {place: mean_over_seeds(group[quantity]) for place, group in groups.items()}
        texts = {place: format_with_error(one.value, f"+{form}", one.half_width) for place, one in means.items()}
        text = f"{texts.pop('')} (n = {means[''].count})"
        effect = Effect(label="effect, ± 95 %,", value=means[""], sign=sign, text=text)
        return Outcome(effects=[effect], note="by l/w " + ", ".join(f"{one:g}: {text}" for one, text in texts.items()))

    return Finding(id=name, says=says, outcome=outcome)


def _near_gravish(means: pd.DataFrame) -> Outcome:
    """Judge whether, for some combination of factors, φ_f is within `MARGIN` of Gravish's at every l/w."""
    known = means[means[DEVIATION].notna()]
    if known.empty:
        return Outcome(note="no points of Gravish's at these l/w", verdict=Verdict.NOT_RESOLVED)
    off, error = known[DEVIATION].abs(), known[marked(DEVIATION, "95 %")]
    judged = known.assign(_inside=off + error <= MARGIN, _outside=off - error > MARGIN, _off=off)
    each = judged.groupby(list(FACTORS)).agg({"_inside": "all", "_outside": "any", "_off": ["max", "size"]})
    each.columns = pd.Index(["inside", "outside", "off", "places"])
    # A combination that was not run at every aspect ratio can be rejected by one of them, but not accepted.
    whole = each[each["places"] == each["places"].max()]
    best = pd.Series(dict(zip(FACTORS, whole["off"].idxmin(), strict=True)))
    rows = judged[np.all([judged[name] == best[name] for name in FACTORS], axis=0)]
    places = ", ".join(
        f"{row[ASPECT]:g}: {format_with_error(row[DEVIATION], '+.1f', row[marked(DEVIATION, '95 %')])} %"
        for _, row in rows.iterrows()
    )
    verdict = decide(whole["inside"].any(), each["outside"].all())
    return Outcome(note=f"nearest: {combination_name(best)}; by l/w {places}", verdict=verdict)


def combination_name(row: pd.Series) -> str:
    """Return the name of a combination of the three factors."""
    return f"μ = {row[FRICTION]:g}, container {row[WALL]:g}, e = {row[RESTITUTION]:g}"


FINDINGS = (
    *(
        lowers(
            f"{stage}-{factor}",
            f"{QUANTITIES[quantity].label} falls when {CALLED[column]} goes from {low:g} to {high:g}",
            quantity,
            column,
        )
        for stage, quantity in (("phi-0", PHI_0), ("phi-f", PHI_F), ("phi-f-relaxed", PHI_RELAXED))
        for factor, (column, (low, high)) in zip(("friction", "container", "restitution"), FACTORS.items(), strict=True)
    ),
    lowers(
        "friction-more-than-container",
        "Friction between smarticles lowers phi_f more than friction at the container",
        PHI_F,
        FRICTION,
        less=WALL,
    ),
    lowers(
        "frictions-together",
        "Friction at the container lowers phi_f more where that between smarticles is 0.8",
        PHI_F,
        FRICTION,
        WALL,
    ),
    lowers(
        "container-raises-lowest",
        "The lowest smarticles rise more when friction at the container goes from 0.4 to 0.8",
        RISEN,
        WALL,
        sign=1,
    ),
    Finding(
        id="near-gravish",
        says=f"A combination brings phi_f within {MARGIN:g} % of Gravish's at every l/w measured",
        outcome=_near_gravish,
        tables=("points",),
        found_if="at 95 %, errors of reading Gravish's points included",
    ),
)

STUDY: Study = Study(
    name="contacts",
    title="Friction between smarticles, friction at the container, restitution",
    measure=measure,
    keys=(*(Key(column=name, label=called, form="g") for name, called in CALLED.items()), ASPECT_KEY),
    quantities=tuple(QUANTITIES.values()),
    findings=FINDINGS,
    figures=(
        Rows(
            name="contacts",
            quantities=[Quantity(column=DEVIATION, axis=r"$\phi_\mathrm{f}$ less Gravish's [%]"), QUANTITIES[RISEN]],
            row=combination_name,
            split=one_by_one(ASPECT, "l/w = {:g}".format),
        ),
    ),
    extra=lambda runs: {"points": points(runs), "effects": effects(runs)},
    order=(*FACTORS, ASPECT, SEED),
    one_engine=True,
    from_tables=True,
    remarks=(f"φ by {DEFINITION}; {WHEN}. Heights of the lowest tenth are means over {WINDOW:g} s.",),
    reference=GRAVISH,
    pictured={"l_over_w": 0.7, "friction": 0.8, "friction_wall": 0.4, "restitution": 0.7},
)
