"""Collapse of free-standing columns on a vibrating floor: time τ and Δ in τ = (1/f) exp(Δ/Γ).

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012), found that Δ is
greatest at an intermediate l/w. A run pours the pile, shakes it inside the wall, lets it rest, removes the wall, and
vibrates the floor.

A column that has not collapsed by the end of its run gives a lower bound of τ. If a run at some acceleration Γ gives a
bound, this Γ is not used for Δ at that l/w: the runs that did collapse are the fast ones, and would bias Δ to small
values. The mean at that Γ, computed with the bounds, is a lower bound too.
"""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from dem.record.run import Run
from postprocess.measures.collapse import (
    COM,
    HEIGHTS,
    LEAST_FALL,
    REMAINING,
    REST,
    WORST_ERROR,
    collapse_of,
    column_history,
    height_with_the_wall,
    vibration,
)
from postprocess.statistics.points import ASPECT, SEED, SEEDS, format_with_error, marked, mean_columns
from postprocess.statistics.seeds import SeedMean, Slope, difference, mean_over_seeds, slope_within
from studies.framework.figures import ASPECT_LABEL, Histories, History, Means, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, Verdict, all_of, decide, within
from studies.framework.provenance import Reference
from studies.framework.runs import ASPECT_KEY, Key, Quantity, Row, duration, judging, last_columns, sort_rows
from studies.framework.study import Study

GAMMA, FREQUENCY, WATCHED = "peak acceleration [g]", "frequency [Hz]", "time vibrated [s]"
RADIUS, DEFINITION, TIME = "container radius [m]", "definition", "tau [s]"
LOG, DELTA = "ln(f tau) [-]", "Delta of the run [-]"
ACTIVATION, AT_LEAST = "Delta [-]", "Delta at least [-]"
CENSORED, USED = "runs with a bound [-]", "Gamma used [g]"
REFERENCE, DEVIATION, DEVIATION_95 = "Delta Gravish [-]", "deviation [%]", "deviation 95 % [%]"

INTERMEDIATE = 0.40  #: l/w of Gravish's greatest Δ [-]
CONSTANT = 0.20  #: Accepted change of Γ ln(fτ) from the least to the greatest Γ, over its mean [-]; 0 by the law
CLOSE = 0.20  #: Accepted deviation of Δ over Gravish's Δ [-], about the difference of their neighbouring points

_DIGITISED = files("postprocess") / "reference" / "gravish2012_collapse.csv"
KEYS = (
    Key(column=DEFINITION, label="height", order=tuple(HEIGHTS)),
    ASPECT_KEY,
    Key(column=GAMMA, label="Γ", form="g"),
)

_GRAVISH = pd.read_csv(str(_DIGITISED))  # columns `l_over_w` [-] and `delta` [-]; compared at equal l/w only
DELTA_OF_POINT = Quantity(
    column=ACTIVATION,
    label="Δ",
    form=".2f",
    axis=r"activation $\Delta$ [-]",
    meaning="slope of ln(fτ) against 1/Γ through the origin",
)


def measure(run: Run) -> Sequence[Row]:
    """Measure the collapse time by each definition of the height; return one row for each definition."""
    shaken = vibration(run)
    histories = {name: column_history(run, name, shaken) for name in HEIGHTS}
    shared: dict[str, object] = {
        ASPECT: round(run.manifest.aspect_ratio, 6),
        GAMMA: shaken.acceleration,
        SEED: run.manifest.seed,
        FREQUENCY: shaken.frequency,
        WATCHED: duration(shaken.phase),
        "smarticles [-]": run.manifest.count,
        RADIUS: run.manifest.container_radius_m,
        "com height with the wall [m]": height_with_the_wall(run),
        "com height before vibration [m]": histories[COM].before,
        "within the radius before vibration [-]": histories[REMAINING].before,
        "fidelity": run.manifest.fidelity,
    }
    rows = []
    for name, history in histories.items():
        found = collapse_of(history, name, shaken)
        # Negative if the column collapses within one period.
        logarithm = math.log(shaken.frequency * (found.time if math.isfinite(found.time) else found.bound))
        rows.append(
            {
                **shared,
                DEFINITION: name,
                "outcome": found.outcome,
                TIME: found.time,
                "tau SE in run [s]": found.error,
                "tau above [s]": found.bound,
                "beta [-]": found.exponent,
                "start [-]": found.start,
                "end [-]": found.end,
                "fall [-]": found.fall,
                LOG: logarithm,
                DELTA: shaken.acceleration * logarithm,
                **last_columns(run),
            }
        )
    return rows


def times(runs: pd.DataFrame) -> pd.DataFrame:
    """Average ln(fτ) over seeds, for each definition of height, l/w and Γ.

    A mean that contains a lower bound of τ, from a column that did not collapse, has no error.
    """
    found = []
    for point, group in runs.groupby([DEFINITION, ASPECT, GAMMA], sort=False):
        bounds, mean = int(group[TIME].isna().sum()), mean_over_seeds(group[LOG])
        row = dict(zip((DEFINITION, ASPECT, GAMMA), point, strict=True)) | {SEEDS: len(group), CENSORED: bounds}
        row |= mean_columns(LOG, replace(mean, standard_error=math.nan, half_width=math.nan) if bounds else mean)
        found.append(row | {DELTA: float(group[GAMMA].iloc[0]) * mean.value})
    return sort_rows(pd.DataFrame(found), [DEFINITION, ASPECT, GAMMA], KEYS)


def activations(runs: pd.DataFrame) -> pd.DataFrame:
    """Fit Δ, the slope of ln(fτ) against 1/Γ through the origin: one row per definition and l/w.

    Δ is fitted for each seed over those accelerations at which all runs collapsed, then averaged over seeds. A seed
    that lacks a run at one of these accelerations is left out, since its slope would belong to other accelerations.
    If all runs collapsed at no acceleration, Δ is NaN, and the row has a lower bound only.
    """
    found = []
    every, gravish = times(runs), _GRAVISH.set_index("l_over_w")["delta"]
    for (definition, aspect), group in runs.groupby([DEFINITION, ASPECT], sort=False):
        own = every[(every[DEFINITION] == definition) & (every[ASPECT] == aspect)]
        used = own.loc[own[CENSORED] == 0, GAMMA].tolist()
        seeds = [one for _, one in group[group[GAMMA].isin(used)].groupby(SEED) if len(one) == len(used)]
        mean = mean_over_seeds([float(one[LOG] @ (1 / one[GAMMA]) / (1 / one[GAMMA] ** 2).sum()) for one in seeds])
        theirs = float(gravish.get(aspect, math.nan))
        found.append(
            {
                DEFINITION: definition,
                ASPECT: aspect,
                SEEDS: len(seeds),
                **mean_columns(ACTIVATION, mean),
                AT_LEAST: own.loc[own[CENSORED] > 0, DELTA].max(),
                CENSORED: int(own[CENSORED].sum()),
                USED: " ".join(f"{gamma:g}" for gamma in used),
                REFERENCE: theirs,
                DEVIATION: 100 * (mean.value / theirs - 1),
                DEVIATION_95: 100 * mean.half_width / theirs,
            }
        )
    return sort_rows(pd.DataFrame(found), [DEFINITION, ASPECT], KEYS)


def _used(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the definition `REMAINING`, at each l/w for those Γ at which all runs collapsed."""
    own = runs[runs[DEFINITION] == REMAINING]
    return own[own[TIME].notna().groupby([own[ASPECT], own[GAMMA]]).transform("all")]


def rise(used: pd.DataFrame) -> Slope:
    """Fit one slope of ln(fτ) against 1/Γ [-] to all runs, with an intercept for each l/w and seed."""
    return slope_within(list(1 / used[GAMMA]), list(used[LOG]), list(zip(used[ASPECT], used[SEED], strict=True)))


def change(used: pd.DataFrame) -> Slope:
    """Fit the change of Γ ln(fτ) from the least to the greatest Γ, over its mean at each l/w [-]."""
    span = float(np.ptp(used[GAMMA])) if len(used) else 0.0
    if not span:
        return slope_within([], [], [])
    relative = used[DELTA] / used.groupby(ASPECT)[DELTA].transform("mean")
    return slope_within(list(used[GAMMA] / span), list(relative), list(zip(used[ASPECT], used[SEED], strict=True)))


def _law(runs: pd.DataFrame) -> Outcome:
    found = change(_used(runs))
    effect = Effect(label="Γ ln(fτ) from the least Γ to the greatest, over its mean", value=found, sign=0)
    return Outcome(effects=[effect], verdict=within(found.value, found.half_width, CONSTANT))


def _greatest_between(table: pd.DataFrame) -> Outcome:
    own = table[table[DEFINITION] == REMAINING].set_index(ASPECT)
    columns = own[[ACTIVATION, marked(ACTIVATION, "SE"), marked(ACTIVATION, "95 %"), SEEDS]]
    means = {
        aspect: SeedMean(value=value, standard_error=error, half_width=half_width, count=int(count))
        for aspect, value, error, half_width, count in columns.itertuples()
    }
    verdict = Verdict.NO_DATA
    if INTERMEDIATE in list(means)[1:-1]:
        gaps = [difference(means[INTERMEDIATE], means[end]) for end in (min(means), max(means))]
        verdict = all_of(decide(gap.clear and gap.value > 0, gap.clear, data=not math.isnan(gap.value)) for gap in gaps)
    cells = [
        f"{aspect:g}: " + (format_with_error(mean.value, ".2f", mean.standard_error) if mean.count else "a bound")
        for aspect, mean in means.items()
    ]
    return Outcome(note=f"Δ by {REMAINING}: {', '.join(cells)}", verdict=verdict)


def _as_gravish(table: pd.DataFrame) -> Outcome:
    own = table[table[DEFINITION] == REMAINING].dropna(subset=[DEVIATION])
    numbers = list(zip(own[ASPECT], own[DEVIATION], own[DEVIATION_95], strict=True))
    verdict = all_of(within(value, error, 100 * CLOSE) for _, value, error in numbers) if numbers else Verdict.NO_DATA
    cells = ", ".join(
        f"l/w = {aspect:g}: {format_with_error(value, '+.0f', error)} %" for aspect, value, error in numbers
    )
    return Outcome(note=f"deviations with 95 % half-widths: {cells}", verdict=verdict)


FINDINGS = (
    Finding(
        id="gentler-is-later",
        says="Columns collapse the later the gentler the vibration",
        outcome=lambda runs: [Effect(label="slope of ln(fτ) against 1/Γ", value=rise(_used(runs)))],
    ),
    Finding(
        id="law",
        says="τ = (1/f) exp(Δ/Γ) with one Δ at each l/w",
        found_if=f"Γ ln(fτ) changes by less than {CONSTANT:.0%} of its mean, at 95 %",
        outcome=_law,
    ),
    Finding(
        id="greatest-between",
        says="Δ is greatest at an intermediate l/w, near 0.4",
        found_if=f"Δ at l/w = {INTERMEDIATE:g} above that at the least and at the greatest l/w that were run, at 95 %",
        outcome=_greatest_between,
        tables=["points"],
    ),
    Finding(
        id="as-gravish",
        says="Δ as measured",
        found_if=f"Δ within {CLOSE:.0%} of Gravish's at every l/w, at 95 %",
        outcome=_as_gravish,
        tables=["points"],
    ),
)


def _history(run: Run) -> History:
    history = column_history(run, REMAINING, vibration(run))
    return History(times=history.times, values=history.heights, active=float(history.times[-1]))


_HISTORIES = Histories(
    name="height_time",
    history=_history,
    rows=lambda runs: runs[runs[DEFINITION] == REMAINING],
    split=one_by_one(GAMMA, lambda gamma: rf"$\Gamma$ = {gamma:g}", last=0.8),
    panels=ASPECT,
    panel=r"$l/w$ = {:g}",
    level=1 / math.e,
    x_label="time since the vibration began [s]",
    quantities={"": r"height remaining $h/h_0$ [-]"},
    notes=["Level: 1/e, which a stretched exponential to 0 crosses at τ whatever its exponent."],
)


def _law_curves(
    tables: Mapping[str, pd.DataFrame], rows: pd.DataFrame, _: str, places: NDArray[np.float64]
) -> dict[str, tuple[ArrayLike, ArrayLike]]:
    """Compute the fitted law ln(fτ) = Δ/Γ at one l/w, as a curve of a figure.

    The places are values of 1/Γ (n,). Returns values (n,) of ln(fτ) and 95 % half-widths (n,), by the label of the
    curve.
    """
    points = judging(tables["points"])
    own = points[(points[DEFINITION] == REMAINING) & (points[ASPECT] == rows[ASPECT].iloc[0])].iloc[0]
    return {"_Δ": (own[ACTIVATION] * places, own[marked(ACTIVATION, "95 %")] * places)}


STUDY = Study(
    name="collapse",
    title="Collapse of columns against the findings of Gravish et al.",
    measure=measure,
    keys=KEYS,
    quantities=(DELTA_OF_POINT,),
    findings=FINDINGS,
    figures=(
        _HISTORIES,
        Means(
            name="time_acceleration",
            table="times",
            quantities=[Quantity(column=LOG, axis=r"collapse time $\ln(f\tau)$ [-]")],
            x=GAMMA,
            transform=lambda gamma: 1 / gamma,
            x_label=r"inverse peak acceleration $1/\Gamma$ [-]",
            rows=lambda table: table[table[DEFINITION] == REMAINING].assign(
                **{LOG: table[LOG].where(table[CENSORED] == 0), AT_LEAST: table[LOG]}
            ),
            bounds={LOG: AT_LEAST},
            split=one_by_one(ASPECT, lambda aspect: rf"$l/w$ = {aspect:g}"),
            fit=_law_curves,
            notes=[
                "By the height `remaining`. Open, with an arrow: a run did not collapse, a bound. Lines: "
                "τ = (1/f) exp(Δ/Γ) with the Δ of each l/w and its 95 % interval."
            ],
        ),
        Means(
            name="delta_aspect",
            quantities=[DELTA_OF_POINT],
            x=ASPECT,
            x_label=ASPECT_LABEL,
            split=one_by_one(DEFINITION, str),
            bounds={ACTIVATION: AT_LEAST},
            reference={ACTIVATION: (_GRAVISH["l_over_w"], _GRAVISH["delta"])},
            published="Gravish 2012",
            notes=[
                "Open, with an arrow: no acceleration at which all runs collapsed, a bound.",
                "Experiment: Gravish et al., PRL 108, 208001 (2012), digitised.",
            ],
        ),
    ),
    extra=lambda runs: {"times": times(runs), "points": activations(runs)},
    order=(ASPECT, GAMMA, SEED),
    constant={FREQUENCY: (), RADIUS: ()},
    remarks=(
        "; ".join(f"`{name}`: {meaning}" for name, meaning in HEIGHTS.items())
        + f"; before: mean over the last {REST:g} s. τ: fit of exp(-(t/τ)^β) to means over periods; seen where it is "
        f"shorter than the time watched, the fall is at least {LEAST_FALL:.0%} and the error of the fit below "
        f"{WORST_ERROR:.0%}, else a bound. Δ: seed by seed, over the Γ at which every run collapsed. The floor has no "
        "end: smarticles that leave the column go on hopping on it.",
    ),
    reference=Reference(
        statement="Δ of Gravish et al., PRL 108, 208001 (2012), digitised; Γ = 1.23 to 2.5, errors unknown",
        facts={"file": _DIGITISED.name, "sha256": hashlib.sha256(_DIGITISED.read_bytes()).hexdigest()},
    ),
    pictured={"l_over_w": 0.4, "gamma": 2.5},
)
