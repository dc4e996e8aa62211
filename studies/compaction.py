"""U-shapes of l/w = 0.7 are shaken for 200 s at two coefficients of friction.

This is ten times as long as Gravish et al. shook. Does φ still grow, and by which law? Gravish et al. (PRL 108, 208001,
2012) describe the relaxation of staples by the stretched exponential of Kohlrausch, Williams and Watts. Tapped columns
of beads follow the inverse logarithm of Knight, Fandrich, Lau, Jaeger and Nagel, Phys. Rev. E 51, 3957 (1995). Both
laws have four parameters, so that their residuals can be compared.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from dem.record.run import Run
from postprocess.statistics.points import ASPECT, SEED, format_with_error
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.findings import Effect, Finding
from studies.framework.runs import ASPECT_KEY, Key, Quantity, Row
from studies.framework.shaken import (
    FRICTION,
    GRAVISH,
    PHI_TIME,
    SHAKE_TIME,
    common_friction,
    packing_history,
    timed_row,
    while_shaken,
)
from studies.framework.study import Study

Array = NDArray[np.float64]

TIMES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)  # s; φ is a mean over the last fifth of each time
EARLY = 0.25  # share of the shaking time that a law is fitted to when it has to predict φ at the end
FIRST = 0.1  # s, time at which fits begin: three periods of shaking
INTERVALS = 40  # logarithmic intervals over which φ is averaged before a fit
STRETCHED, LOGARITHMIC = "stretched exponential", "inverse logarithm"

# (φ_∞ − φ)/(φ_∞ − φ_b), the remaining share of the change, at times [s], by τ [s] and β or B.
LAWS: dict[str, Callable[[Array, float, float], Array]] = {
    STRETCHED: lambda t, tau, beta: np.exp(-((t / tau) ** beta)),
    LOGARITHMIC: lambda t, tau, rate: 1 / (1 + rate * np.log1p(t / tau)),
}
_TAUS, _POWERS = (0.3, 3.0, 30.0), (0.3, 0.8)  # initial values of τ [s] and of β or B in fits

BEGIN, END, TAU, POWER = "phi_b [-]", "phi_inf [-]", "tau [s]", "beta or B [-]"
RESIDUAL, MISSED = "residual [-]", "missed at the end [-]"
_MEANINGS = {
    BEGIN: "φ as shaking begins",
    END: "φ in the end",
    TAU: "τ",
    POWER: "β or B",
    RESIDUAL: "root mean square of the residuals",
    MISSED: f"mean φ over the last tenth of the time, by the law fitted to its first {100 * EARLY:g} %, less measured",
}


class Fit(NamedTuple):
    """A law fitted to φ against time. Its φ_∞ is uncertain if φ is still far from it at the last time."""

    law: str  #: Key of `LAWS`
    begin: float  #: φ_b, φ when shaking begins [-]
    end: float  #: φ_∞, φ after infinite time [-]
    tau: float  #: τ [s]
    power: float  #: β of the stretched exponential, B of the inverse logarithm [-]
    residual: float  #: Root mean square of the residuals [-]

    def at(self, times: Array) -> Array:
        """Return φ (n,) [-] at times since shaking began (n,) [s]."""
        share = LAWS[self.law](np.asarray(times, dtype=np.float64), self.tau, self.power)
        return np.asarray(self.end - (self.end - self.begin) * share, dtype=np.float64)


def fit(law: str, times: Array, packing: Array) -> Fit:
    """Fit a law to φ (n,) [-] at times (n,) [s] by least squares.

    Only τ and the power are searched for. φ is linear in φ_b and φ_∞, so that linear least squares give these exactly.
    """

    def solved(parameters: Array) -> tuple[Array, Array]:
        share = LAWS[law](times, float(np.exp(parameters[0])), float(np.exp(parameters[1])))
        matrix = np.stack([share, 1 - share], axis=1)
        ends, *_ = np.linalg.lstsq(matrix, packing, rcond=None)
        return np.asarray(ends, dtype=np.float64), np.asarray(matrix @ ends - packing, dtype=np.float64)

    # A τ far beyond the last time or far before the first one cannot be determined.
    low, high = np.log([times[0] / 10, 0.05]), np.log([10 * times[-1], 20.0])
    starts = (np.clip(np.log(pair), low + 1e-6, high - 1e-6) for pair in product(_TAUS, _POWERS))
    tries = (least_squares(lambda x: solved(x)[1], start, bounds=(low, high)) for start in starts)
    best = min(tries, key=lambda found: float(found.cost))
    (begin, end), left = solved(best.x)
    tau, power = map(float, np.exp(best.x))
    return Fit(law, float(begin), float(end), tau, power, float(np.sqrt(np.mean(left**2))))


def spread_out(times: Array, packing: Array) -> tuple[Array, Array]:
    """Average φ (n,) [-] at times (n,) [s] over logarithmic intervals; empty intervals are left out.

    Returns the geometric centres of the intervals (m,) [s], and means of φ (m,) [-].
    """
    edges = np.geomspace(FIRST, times[-1] * (1 + 1e-9), INTERVALS + 1)
    place = np.searchsorted(edges, times, side="right") - 1
    inside = (place >= 0) & (place < INTERVALS)
    number = np.bincount(place[inside], minlength=INTERVALS)
    total = np.bincount(place[inside], weights=packing[inside], minlength=INTERVALS)
    there = number > 0
    return np.sqrt(edges[:-1] * edges[1:])[there], total[there] / number[there]


def phi_column(time: float) -> str:
    """Return the name of the column of φ after some time of shaking [s]."""
    return f"phi {time:g} s [-]"


def law_column(law: str, column: str) -> str:
    """Return the name of the column of a parameter or residual of a law."""
    return f"{law} {column}"


def measure(run: Run) -> Row:
    """Measure φ at all times, and fit both laws; return the run's row."""
    row = timed_row(run, {FRICTION: common_friction(run)})
    history, shaken = packing_history(run), while_shaken(run)
    for time in TIMES:
        late = (history.times > 0.8 * time) & (history.times <= time * (1 + 1e-9))
        known = time <= history.active * (1 + 1e-9) and late.any()
        row[phi_column(time)] = float(history.values[late].mean()) if known else float("nan")
    times, values = shaken.times, shaken.values
    first, last = times <= EARLY * times[-1], times > 0.9 * times[-1]
    whole, early = spread_out(times, values), spread_out(times[first], values[first])
    for law in LAWS:
        found = fit(law, *whole)
        row |= {law_column(law, name): number for name, number in zip(_MEANINGS, found[1:], strict=False)}
        row[law_column(law, MISSED)] = float(np.mean(fit(law, *early).at(times[last]))) - float(np.mean(values[last]))
    return row


def positive(name: str, says: str, values: Callable[[pd.DataFrame], pd.Series], form: str) -> Finding:
    """Make the finding that the mean of a value over all runs is above 0.

    `says` is its statement, `form` a text with `{}` for the mean and its 95 % half-width.
    """

    def outcome(runs: pd.DataFrame) -> list[Effect]:
        mean = mean_over_seeds(values(runs).dropna().tolist())
        text = form.format(format_with_error(mean.value, "+.2f", mean.half_width))
        return [Effect(label="mean over runs, ± 95 %:", value=mean, text=f"{text} (n = {mean.count})")]

    return Finding(id=name, says=says, outcome=outcome)


def _law_curves(
    _: Mapping[str, pd.DataFrame], rows: pd.DataFrame, __: str, times: Array
) -> dict[str, tuple[ArrayLike, ArrayLike]]:
    """Compute φ by both laws, averaged over runs of one coefficient of friction, as curves of a figure.

    Times are (n,) [s]. Returns values (n,) and their 95 % half-widths (n,), here NaN, by the name of the law.
    """
    fits = {law: rows[[law_column(law, name) for name in _MEANINGS][:5]].itertuples(index=False) for law in LAWS}
    means = {law: np.mean([Fit(law, *run).at(times) for run in runs], axis=0) for law, runs in fits.items()}
    return {law: (mean, np.full(len(times), np.nan)) for law, mean in means.items()}


FINDINGS = (
    positive(
        "still-grows",
        f"phi still grows between {TIMES[-2]:g} and {TIMES[-1]:g} s",
        lambda runs: 100 * (runs[phi_column(TIMES[-1])] / runs[phi_column(TIMES[-2])] - 1),
        "by {} %",
    ),
    positive(
        "below-at-20-s",
        f"phi after Gravish's {SHAKE_TIME:g} s is below that after {TIMES[-1]:g} s",
        lambda runs: -100 * (runs[phi_column(SHAKE_TIME)] / runs[phi_column(TIMES[-1])] - 1),
        "below by {} %",
    ),
    positive(
        "stretched-leaves-less",
        "A stretched exponential leaves less than an inverse logarithm",
        lambda runs: -100 * np.log(runs[law_column(STRETCHED, RESIDUAL)] / runs[law_column(LOGARITHMIC, RESIDUAL)]),
        "ln of the ratio of what they leave {} %",
    ),
    positive(
        "stretched-predicts",
        f"It tells the end better, fitted to the first {100 * EARLY:g} % of the time",
        lambda runs: 1e3 * (runs[law_column(LOGARITHMIC, MISSED)].abs() - runs[law_column(STRETCHED, MISSED)].abs()),
        "nearer by {}e-3",
    ),
)


STUDY = Study(
    name="compaction",
    title="Piles that are shaken for long",
    measure=measure,
    keys=(ASPECT_KEY, Key(column=FRICTION, label="friction", form="g")),
    quantities=(
        *(
            Quantity(
                column=phi_column(time), label=f"φ {time:g} s", form=".4f", meaning=f"φ after {time:g} s of shaking"
            )
            for time in TIMES
        ),
        *(
            Quantity(column=law_column(law, name), meaning=f"{law}: {_MEANINGS[name]}")
            for law in LAWS
            for name in _MEANINGS
        ),
    ),
    findings=FINDINGS,
    figures=(
        replace(
            PHI_TIME,
            fit=_law_curves,
            marks=[SHAKE_TIME],
            notes=[f"Laws: means over the runs; broken line: Gravish's {SHAKE_TIME:g} s."],
        ),
    ),
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
