"""U-shapes of l/w = 0.7 are shaken for 200 s, ten times as long as Gravish's, at two coefficients of friction.

Does φ still grow, and by which law: the stretched exponential of Kohlrausch, Williams and Watts, with which Gravish et
al. (PRL 108, 208001, 2012) describe how piles of staples relax, or the inverse logarithm of Knight, Fandrich, Lau,
Jaeger and Nagel, Phys. Rev. E 51, 3957 (1995), which tapped columns of beads follow? Both have four parameters, so that
what they leave can be compared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares

from dem.errors import InputError
from dem.record.run import Run
from postprocess.report import figures as style
from postprocess.statistics.points import ASPECT, SEED, told_number
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.figures import Analysis, Drawing
from studies.framework.findings import Effect, Finding
from studies.framework.plots import BAND, finished
from studies.framework.provenance import GRAVISH, SHAKE_TIME
from studies.framework.quantities import Key, Quantity
from studies.framework.runs import Row
from studies.framework.shaken import FRICTION, common_friction, packing_history, timed_row, while_shaken
from studies.framework.study import Study

Array = NDArray[np.float64]

TIMES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)  # s; φ is a mean over the last fifth of each
EARLY = 0.25  # share of the time that a law is fitted to, to see whether it tells the rest
FIRST, INTERVALS = 0.1, 40  # s, three periods of shaking: where fits begin; and in how many intervals
STRETCHED, LOGARITHMIC = "stretched exponential", "inverse logarithm"

# Share of the way from begin to end that is left after a time, by τ [s] and β or B.
LAWS: dict[str, Callable[[Array, float, float], Array]] = {
    STRETCHED: lambda t, tau, beta: np.exp(-((t / tau) ** beta)),
    LOGARITHMIC: lambda t, tau, rate: 1 / (1 + rate * np.log1p(t / tau)),
}
_TAUS, _POWERS = (0.3, 3.0, 30.0), (0.3, 0.8)  # where fits begin

BEGIN, END, TAU, POWER = "phi_b [-]", "phi_inf [-]", "tau [s]", "beta or B [-]"
RESIDUAL, MISSED = "residual [-]", "missed at the end [-]"
_MEANINGS = {
    BEGIN: "φ as shaking begins",
    END: "φ in the end",
    TAU: "τ",
    POWER: "β or B",
    RESIDUAL: "root mean square of what the law leaves",
    MISSED: f"the law fitted to the first {100 * EARLY:g} % of the time less what φ is in the last tenth of it",
}


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A law fitted to a history.

    Attributes:
        law: Its name.
        begin: φ as shaking begins [-].
        end: φ in the end [-]; of a law that has not come near its end as uncertain as it looks.
        tau: τ [s].
        power: β or B [1].
        residual: Root mean square of what the law leaves [-].
    """

    law: str
    begin: float
    end: float
    tau: float
    power: float
    residual: float

    def at(self, times: Array) -> Array:
        """Compute φ at times since shaking began [s]."""
        share = LAWS[self.law](np.asarray(times, dtype=np.float64), self.tau, self.power)
        return np.asarray(self.end - (self.end - self.begin) * share, dtype=np.float64)


def fit(law: str, times: Array, packing: Array) -> Fit:
    """Fit a law by least squares; begin and end enter linearly and are solved for exactly at every τ and power."""

    def solved(parameters: Array) -> tuple[Array, Array]:
        share = LAWS[law](times, float(np.exp(parameters[0])), float(np.exp(parameters[1])))
        matrix = np.stack([share, 1 - share], axis=1)
        ends, *_ = np.linalg.lstsq(matrix, packing, rcond=None)
        return np.asarray(ends, dtype=np.float64), np.asarray(matrix @ ends - packing, dtype=np.float64)

    # Within what was seen: a τ far beyond the last time, or before the first one, says nothing.
    low, high = np.log([times[0] / 10, 0.05]), np.log([10 * times[-1], 20.0])
    starts = (np.clip(np.log(pair), low + 1e-6, high - 1e-6) for pair in product(_TAUS, _POWERS))
    tries = (least_squares(lambda x: solved(x)[1], start, bounds=(low, high)) for start in starts)
    best = min(tries, key=lambda found: float(found.cost))
    (begin, end), left = solved(best.x)
    tau, power = np.exp(best.x)
    residual = float(np.sqrt(np.mean(left**2)))
    return Fit(law=law, begin=float(begin), end=float(end), tau=float(tau), power=float(power), residual=residual)


def spread_out(times: Array, packing: Array) -> tuple[Array, Array]:
    """Average over intervals that are equally long on a logarithmic axis; gives geometric centres [s] and means [-]."""
    edges = np.geomspace(FIRST, times[-1] * (1 + 1e-9), INTERVALS + 1)
    place = np.searchsorted(edges, times, side="right") - 1
    inside = (place >= 0) & (place < INTERVALS)
    number = np.bincount(place[inside], minlength=INTERVALS)
    total = np.bincount(place[inside], weights=packing[inside], minlength=INTERVALS)
    there = number > 0
    return np.sqrt(edges[:-1] * edges[1:])[there], total[there] / number[there]


def at(time: float) -> str:
    """Name the column of φ after some time of shaking [s]."""
    return f"phi {time:g} s [-]"


def of(law: str, column: str) -> str:
    """Name the column of a law's number."""
    return f"{law} {column}"


def measure(run: Run) -> Row:
    """Measure φ in the course of time, and fit both laws."""
    row = timed_row(run, {FRICTION: common_friction(run)})
    history, shaken = packing_history(run), while_shaken(run)
    for time in TIMES:
        late = (history.times > 0.8 * time) & (history.times <= time * (1 + 1e-9))
        known = time <= history.active * (1 + 1e-9) and late.any()
        row[at(time)] = float(history.values[late].mean()) if known else float("nan")
    times, values = shaken.times, shaken.values
    first, last = times <= EARLY * times[-1], times > 0.9 * times[-1]
    whole, early = spread_out(times, values), spread_out(times[first], values[first])
    for law in LAWS:
        found = fit(law, *whole)
        numbers = (found.begin, found.end, found.tau, found.power, found.residual)
        row |= {of(law, name): number for name, number in zip(_MEANINGS, numbers, strict=False)}
        row[of(law, MISSED)] = float(np.mean(fit(law, *early).at(times[last]))) - float(np.mean(values[last]))
    return row


def positive(name: str, says: str, values: Callable[[pd.DataFrame], pd.Series], told: str) -> Finding:
    """Make the finding that a number of each run is above 0 in the mean."""

    def outcome(runs: pd.DataFrame) -> list[Effect]:
        mean = mean_over_seeds(values(runs).dropna().tolist())
        text = told.format(told_number(mean.value, "+.2f", mean.half_width))
        return [Effect(label="mean over runs, ± 95 %:", value=mean, text=f"{text} (n = {mean.count})")]

    return Finding(id=name, says=says, outcome=outcome, found_if="mean over runs > 0")


def _residuals(runs: pd.DataFrame) -> pd.Series:
    return -100 * np.log(runs[of(STRETCHED, RESIDUAL)] / runs[of(LOGARITHMIC, RESIDUAL)])


def _misses(runs: pd.DataFrame) -> pd.Series:
    return 1e3 * (runs[of(LOGARITHMIC, MISSED)].abs() - runs[of(STRETCHED, MISSED)].abs())


FINDINGS = (
    positive(
        "still-grows",
        f"phi still grows between {TIMES[-2]:g} and {TIMES[-1]:g} s",
        lambda runs: 100 * (runs[at(TIMES[-1])] / runs[at(TIMES[-2])] - 1),
        "by {} %",
    ),
    positive(
        "below-at-20-s",
        f"phi after Gravish's {SHAKE_TIME:g} s is below that after {TIMES[-1]:g} s",
        lambda runs: -100 * (runs[at(SHAKE_TIME)] / runs[at(TIMES[-1])] - 1),
        "below by {} %",
    ),
    positive(
        "stretched-leaves-less",
        "A stretched exponential leaves less than an inverse logarithm",
        _residuals,
        "ln of the ratio of what they leave {} %",
    ),
    positive(
        "stretched-predicts",
        f"It tells the end better, fitted to the first {100 * EARLY:g} % of the time",
        _misses,
        "nearer by {}e-3",
    ),
)


def _draw(path: Path, analysis: Analysis) -> list[Path]:
    """Draw φ against time with both laws, and what these leave."""
    figure = style.blank_figure(6.4, 2.9)
    left, right = figure.subplots(1, 2)
    lines = {STRETCHED: "solid", LOGARITHMIC: (0, (4, 2))}
    colours = (style.BLUE, style.ORANGE, style.GREEN)
    for (friction, runs), colour in zip(analysis.runs.groupby(FRICTION), colours, strict=False):
        piles = []
        for name in runs["run"]:
            try:
                shaken = while_shaken(analysis.manifests[name])
            except (InputError, KeyError):
                continue
            piles.append(spread_out(shaken.times, shaken.values))
        if not piles:
            continue
        times, values = piles[0][0], np.stack([packing for _, packing in piles])
        mean = values.mean(axis=0)
        left.fill_between(times, values.min(axis=0), values.max(axis=0), color=colour, alpha=0.2, linewidth=0)
        left.plot(times, mean, "o", color=colour, markersize=2.2, label=rf"$\mu = {friction:g}$")
        for law, line in lines.items():
            found = fit(law, times, mean).at(times)
            left.plot(times, found, color=colour, linestyle=line, linewidth=0.9, label=f"{law}, {friction:g}")
            right.plot(times, 1e3 * (mean - found), color=colour, linestyle=line, linewidth=0.9)
    if not left.lines:
        return []
    left.axvline(SHAKE_TIME, color=style.GREY, linewidth=0.6, linestyle=":")
    right.axhline(0.0, color=style.GREY, linewidth=0.6)
    left.set_ylabel(r"packing fraction $\phi$ [-]")
    right.set_ylabel(r"$\phi$ less the law [$10^{-3}$]")
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_xlabel("time since shaking began [s]")
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    told = f"Points: mean over seeds, {BAND}; lines: laws fitted to it; dotted: Gravish's {SHAKE_TIME:g} s."
    return finished(figure, path, [told], analysis.footer)


STUDY = Study(
    name="compaction",
    title="Piles that are shaken for long",
    measure=measure,
    keys=(Key(column=ASPECT, label="l/w", form="g"), Key(column=FRICTION, label="friction", form="g")),
    quantities=(
        *(
            Quantity(column=at(time), label=f"φ {time:g} s", form=".4f", meaning=f"φ after {time:g} s of shaking")
            for time in TIMES
        ),
        *(Quantity(column=of(law, name), meaning=f"{law}: {_MEANINGS[name]}") for law in LAWS for name in _MEANINGS),
    ),
    findings=FINDINGS,
    figures=(Drawing(name="phi_time", of=_draw),),
    order=(ASPECT, FRICTION, SEED),
    one_engine=True,
    remarks=(
        "φ by the median height that the series records, a mean over the last fifth of each time. Laws are fitted to "
        f"each run, means over {INTERVALS} intervals equally long on a logarithmic axis from {FIRST:g} s on. "
        f"{STRETCHED}: φ = φ_∞ − (φ_∞ − φ_b) exp(−(t/τ)^β); {LOGARITHMIC}: the exponential is 1 / (1 + B ln(1 + t/τ)).",
    ),
    reference=GRAVISH,
    pictured={"friction": 0.4},
)
