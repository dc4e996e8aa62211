"""U-shapes of l/w = 0.7 are shaken for 200 s, ten times as long as Gravish's, at two coefficients of friction.

Does φ still grow, and by which law: the stretched exponential of Kohlrausch, Williams and Watts, with which Gravish et
al. (PRL 108, 208001, 2012) describe how piles of staples relax, or the inverse logarithm of Knight, Fandrich, Lau,
Jaeger and Nagel, Phys. Rev. E 51, 3957 (1995), which tapped columns of beads follow? Both have four parameters, so that
what they leave can be compared.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares

from dem.record.run import Run
from postprocess.statistics.points import ASPECT, SEED, told_number
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

TIMES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)  # s; φ is a mean over the last fifth of each
EARLY = 0.25  # share of the time that a law is fitted to, to see whether it predicts the rest
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


class Fit(NamedTuple):
    """A law fitted to a history: φ as shaking begins and in the end [-], τ [s], β or B, and the root mean square left.

    The end of a law that has not come near it is uncertain.
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
    tau, power = map(float, np.exp(best.x))
    return Fit(law, float(begin), float(end), tau, power, float(np.sqrt(np.mean(left**2))))


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
        row |= {of(law, name): number for name, number in zip(_MEANINGS, found[1:], strict=False)}
        row[of(law, MISSED)] = float(np.mean(fit(law, *early).at(times[last]))) - float(np.mean(values[last]))
    return row


def positive(name: str, says: str, values: Callable[[pd.DataFrame], pd.Series], form: str) -> Finding:
    """Make the finding that a number of each run is above 0 in the mean."""

    def outcome(runs: pd.DataFrame) -> list[Effect]:
        mean = mean_over_seeds(values(runs).dropna().tolist())
        text = form.format(told_number(mean.value, "+.2f", mean.half_width))
        return [Effect(label="mean over runs, ± 95 %:", value=mean, text=f"{text} (n = {mean.count})")]

    return Finding(id=name, says=says, outcome=outcome)


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
        lambda runs: -100 * np.log(runs[of(STRETCHED, RESIDUAL)] / runs[of(LOGARITHMIC, RESIDUAL)]),
        "ln of the ratio of what they leave {} %",
    ),
    positive(
        "stretched-predicts",
        f"It tells the end better, fitted to the first {100 * EARLY:g} % of the time",
        lambda runs: 1e3 * (runs[of(LOGARITHMIC, MISSED)].abs() - runs[of(STRETCHED, MISSED)].abs()),
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
            Quantity(column=at(time), label=f"φ {time:g} s", form=".4f", meaning=f"φ after {time:g} s of shaking")
            for time in TIMES
        ),
        *(Quantity(column=of(law, name), meaning=f"{law}: {_MEANINGS[name]}") for law in LAWS for name in _MEANINGS),
    ),
    findings=FINDINGS,
    figures=(PHI_TIME,),
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
