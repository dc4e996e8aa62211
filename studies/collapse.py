"""Free-standing columns on a vibrating floor: collapse times, and Δ of τ = (1/f) exp(Δ/Γ) against l/w.

Gravish, Franklin, Hu and Goldman, "Entangled granular media", Phys. Rev. Lett. 108, 208001 (2012), found Δ greatest at
an intermediate l/w. A run pours, shakes with the wall, rests, takes the wall away, and shakes the floor.

What has not collapsed by the end of its run gives a bound, and is never left out: an acceleration Γ at which a run gave
a bound is not used for Δ of its aspect ratio, since the others alone are the quick ones and would make it too small.
The mean there, with bounds for times, is a bound in its turn.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dem.record.run import Run
from postprocess.measures.collapse import (
    COM,
    CORE,
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
from postprocess.report import figures as style
from postprocess.statistics.points import ASPECT, SEED, SEEDS, marked, mean_columns, told_number
from postprocess.statistics.seeds import SeedMean, Slope, difference, mean_over_seeds, slope_within
from studies.framework.figures import Analysis, Drawing, Histories, one_by_one
from studies.framework.findings import Effect, Finding, Outcome, Verdict, all_of, within
from studies.framework.plots import ASPECT_LABEL, History, draw_bounds, draw_means, finished, marker
from studies.framework.provenance import Reference
from studies.framework.quantities import Key, Quantity, sort_rows
from studies.framework.runs import Row, duration
from studies.framework.study import Study

GAMMA, FREQUENCY, WATCHED = "peak acceleration [g]", "frequency [Hz]", "time vibrated [s]"
RADIUS, DEFINITION, TIME = "container radius [m]", "definition", "tau [s]"
LOG, DELTA = "ln(f tau) [-]", "Delta of the run [-]"
ACTIVATION, AT_LEAST = "Delta [-]", "Delta at least [-]"
CENSORED, USED = "runs with a bound [-]", "Gamma used [g]"
REFERENCE, DEVIATION, DEVIATION_95 = "Delta Gravish [-]", "deviation [%]", "deviation 95 % [%]"

INTERMEDIATE = 0.40
"""l/w of Gravish's greatest Δ [-]."""

CONSTANT = 0.20
"""How much Γ ln(fτ) may change from the least Γ to the greatest where the law holds, over its mean [-]."""

CLOSE = 0.20
"""How far from Gravish's Δ ours may be, over it [-]: neighbouring points of theirs differ as much."""

_DIGITISED = files("postprocess") / "reference" / "gravish2012_collapse.csv"
KEYS = (
    Key(column=DEFINITION, label="height", order=tuple(HEIGHTS)),
    Key(column=ASPECT, label="l/w", form="g"),
    Key(column=GAMMA, label="Γ", form="g"),
)


def read_gravish() -> pd.DataFrame:
    """Read Gravish's digitised points: columns `l_over_w` [-] and `delta` [-]; compared at equal l/w only."""
    with _DIGITISED.open(encoding="utf-8") as file:
        return pd.read_csv(file)


def measure(run: Run) -> Sequence[Row]:
    """Measure the collapse time by each definition of the height, a row each."""
    shaken = vibration(run)
    histories = {name: column_history(run, name, shaken) for name in HEIGHTS}
    what: dict[str, object] = {
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
        # A time below a period has a negative logarithm, which is as good as any.
        logarithm = math.log(shaken.frequency * (found.time if math.isfinite(found.time) else found.bound))
        rows.append(
            {
                **what,
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
                "scene_sha256": run.manifest.scene_sha256,
                "run": run.path.name,
            }
        )
    return rows


def times(runs: pd.DataFrame) -> pd.DataFrame:
    """Average ln(fτ) over seeds by definition, l/w and Γ; a mean with a bound in it is a bound, and has no error."""
    found = []
    for (definition, aspect, gamma), group in runs.groupby([DEFINITION, ASPECT, GAMMA], sort=False):
        bounds, mean = int(group[TIME].isna().sum()), mean_over_seeds(group[LOG])
        found.append(
            {
                DEFINITION: definition,
                ASPECT: aspect,
                GAMMA: gamma,
                SEEDS: len(group),
                CENSORED: bounds,
                **mean_columns(LOG, replace(mean, standard_error=math.nan, half_width=math.nan) if bounds else mean),
                DELTA: gamma * mean.value,
            }
        )
    return sort_rows(pd.DataFrame(found), [DEFINITION, ASPECT, GAMMA], KEYS)


def activations(runs: pd.DataFrame) -> pd.DataFrame:
    """Fit Δ by definition and l/w: the slope of ln(fτ) against 1/Γ through the origin.

    The slope is taken seed by seed over the accelerations at which every run collapsed; its mean over seeds has the
    error. A seed that lacks a run at one of them does not count, since it would have another slope where the law does
    not hold. Where there is no such acceleration Δ is empty, and there is only what it is at least.
    """
    found = []
    every, gravish = times(runs), read_gravish().set_index("l_over_w")["delta"]
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


def _used(runs: pd.DataFrame, definition: str) -> pd.DataFrame:
    """Rows of one definition at those l/w and Γ at which every run collapsed."""
    own = runs[runs[DEFINITION] == definition]
    return own[own[TIME].notna().groupby([own[ASPECT], own[GAMMA]]).transform("all")]


def rise(used: pd.DataFrame) -> Slope:
    """Fit the slope of ln(fτ) against 1/Γ, free of the origin, with a level for each l/w and seed [-]."""
    return slope_within(list(1 / used[GAMMA]), list(used[LOG]), list(zip(used[ASPECT], used[SEED], strict=True)))


def change(used: pd.DataFrame) -> Slope:
    """Fit how Γ ln(fτ) changes from the least Γ to the greatest, over its mean at each l/w [-]; 0 by the law."""
    span = float(np.ptp(used[GAMMA])) if len(used) else 0.0
    if not span:
        return slope_within([], [], [])
    relative = used[DELTA] / used.groupby(ASPECT)[DELTA].transform("mean")
    return slope_within(list(used[GAMMA] / span), list(relative), list(zip(used[ASPECT], used[SEED], strict=True)))


def _by_definition(runs: pd.DataFrame, label: str, effect: Callable[[pd.DataFrame], Slope]) -> list[Effect]:
    """The effect by `REMAINING`, which is judged, and by the other definitions."""
    return [
        Effect(label=f"{label}{' by ' + name if name != REMAINING else ''}", value=effect(_used(runs, name)), sign=sign)
        for name, sign in ((REMAINING, 1), (COM, 0), (CORE, 0))
    ]


def _law(runs: pd.DataFrame) -> Outcome:
    effects = _by_definition(runs, "Γ ln(fτ) from the least Γ to the greatest, over its mean", change)
    first = effects[0].value
    return Outcome(
        effects=[replace(one, sign=0) for one in effects], verdict=within(first.value, first.half_width, CONSTANT)
    )


def _cell(row: pd.Series) -> str:
    """Δ with its standard error, or what it is at least."""
    if math.isnan(row[ACTIVATION]):
        return f"≥ {row[AT_LEAST]:.1f}"
    return told_number(row[ACTIVATION], ".2f", row[marked(ACTIVATION, "SE")])


def _greatest_between(table: pd.DataFrame) -> Outcome:
    own = table[table[DEFINITION] == REMAINING].set_index(ASPECT)
    means = {
        aspect: SeedMean(
            value=row[ACTIVATION],
            standard_error=row[marked(ACTIVATION, "SE")],
            half_width=row[marked(ACTIVATION, "95 %")],
            count=int(row[SEEDS]),
        )
        for aspect, row in own.iterrows()
    }
    verdict = Verdict.NO_DATA
    if INTERMEDIATE in list(means)[1:-1]:
        gaps = [difference(means[INTERMEDIATE], means[end]) for end in (min(means), max(means))]
        verdict = all_of(
            Verdict.NO_DATA
            if math.isnan(gap.value)
            else Verdict.NOT_RESOLVED
            if not gap.clear
            else Verdict.FOUND
            if gap.value > 0
            else Verdict.NOT_FOUND
            for gap in gaps
        )
    parts = [
        f"by {name}: " + ", ".join(f"{row[ASPECT]:g}: {_cell(row)}" for _, row in part.iterrows())
        for name, part in table.groupby(DEFINITION, sort=False)
    ]
    return Outcome(note=f"Δ {'; '.join(parts)}", verdict=verdict)


def _as_gravish(table: pd.DataFrame) -> Outcome:
    own = table[table[DEFINITION] == REMAINING].dropna(subset=[DEVIATION])
    numbers = list(zip(own[ASPECT], own[DEVIATION], own[DEVIATION_95], strict=True))
    verdict = all_of(within(value, error, 100 * CLOSE) for _, value, error in numbers) if numbers else Verdict.NO_DATA
    cells = ", ".join(f"l/w = {aspect:g}: {told_number(value, '+.0f', error)} %" for aspect, value, error in numbers)
    return Outcome(note=f"deviations with 95 % half-widths: {cells}", verdict=verdict)


FINDINGS = (
    Finding(
        id="gentler-is-later",
        says="Columns collapse the later the gentler the vibration",
        found_if="slope of ln(fτ) against 1/Γ > 0, within runs of the same l/w and seed",
        outcome=lambda runs: _by_definition(runs, "slope of ln(fτ) against 1/Γ", rise),
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
    y_label=r"height remaining $h/h_0$ [-]",
    told=["Level: 1/e, which a stretched exponential to 0 crosses at τ whatever its exponent."],
)


def _draw_open(axes: Any, x: pd.Series, least: pd.Series, look: Mapping[str, Any]) -> None:
    """Draw lower bounds: open markers with an arrow upwards."""
    draw_bounds(axes, x, least, 0.05 * least.abs() + 0.2, look={"markersize": 3.4, **look, "markerfacecolor": "white"})


def _draw_law(path: Path, analysis: Analysis) -> list[Path]:
    """Draw ln(fτ) against 1/Γ, with the law's line for each l/w that has a Δ."""
    figure, axes = style.new_figure(height=2.9)
    levels, deltas = (table[table[DEFINITION] == REMAINING] for table in (analysis.tables["times"], analysis.points))
    end = 1.12 / levels[GAMMA].min()
    slopes = deltas.set_index(ASPECT)[ACTIVATION]
    for series in one_by_one(ASPECT, lambda aspect: rf"$l/w$ = {aspect:g}")(levels):
        part, look = series.rows, {**series.look, "linestyle": "none"}
        seen = part[part[CENSORED] == 0]
        draw_means(axes, 1 / seen[GAMMA], seen[LOG], seen[marked(LOG, "95 %")], look=look, label=series.label)
        _draw_open(axes, 1 / part[GAMMA], part[LOG].where(part[CENSORED] > 0), look)
        axes.plot([0, end], [0, slopes[part[ASPECT].iloc[0]] * end], color=look["color"], linewidth=0.7)
    axes.set_xlim(0, end)
    axes.set_ylim(0, None)
    axes.set_xlabel(r"inverse peak acceleration $1/\Gamma$ [-]")
    axes.set_ylabel(r"collapse time $\ln(f\tau)$ [-]")
    axes.legend(loc="upper left")
    told = "By the height `remaining`. Lines: τ = (1/f) exp(Δ/Γ). Open, with an arrow: a run did not collapse, a bound."
    return finished(figure, path, [told], analysis.footer)


def _draw_activations(path: Path, analysis: Analysis) -> list[Path]:
    """Draw Δ against l/w by each definition, on Gravish's points."""
    figure, axes = style.new_figure(height=2.9)
    gravish = read_gravish()
    axes.plot(gravish["l_over_w"], gravish["delta"], "D", color=style.BLACK, markerfacecolor="white", label="Gravish")
    looks = {REMAINING: ("o", style.BLUE), COM: ("s", style.ORANGE), CORE: ("^", style.SKY)}
    for number, (name, (shape, colour)) in enumerate(looks.items()):
        part = analysis.points[analysis.points[DEFINITION] == name]
        x, look = part[ASPECT] + 0.012 * (number - 1), marker(shape, colour, colour)
        draw_means(axes, x, part[ACTIVATION], part[marked(ACTIVATION, "95 %")], look=look, label=name)
        _draw_open(axes, x, part[AT_LEAST].where(part[ACTIVATION].isna()), look)
    axes.set_ylim(0, None)
    axes.set_xlabel(ASPECT_LABEL)
    axes.set_ylabel(r"activation $\Delta$ [-]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    told = "Open, with an arrow: no acceleration at which all runs collapsed, a bound."
    return finished(figure, path, [told, f"{STUDY.reference.statement}."], analysis.footer)


STUDY = Study(
    name="collapse",
    title="Collapse of columns against the findings of Gravish et al.",
    measure=measure,
    keys=KEYS,
    quantities=(
        Quantity(column=ACTIVATION, label="Δ", form=".2f", meaning="slope of ln(fτ) against 1/Γ through the origin"),
    ),
    findings=FINDINGS,
    figures=(
        _HISTORIES,
        Drawing(name="time_acceleration", of=_draw_law),
        Drawing(name="delta_aspect", of=_draw_activations),
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
