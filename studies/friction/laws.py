"""Laws that packing fractions of shaken piles follow in time, fitted to one history.

Sources: the stretched exponential of Kohlrausch, Williams and Watts, with which Gravish et al. (PRL 108, 208001, 2012)
describe how piles of staples relax; the inverse logarithm of Knight, Fandrich, Lau, Jaeger and Nagel, Phys. Rev. E 51,
3957 (1995), which tapped columns of beads follow. Both have four parameters, so that what they leave can be compared.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]

STRETCHED, LOGARITHMIC = "stretched exponential", "inverse logarithm"
_TAUS, _POWERS = (0.3, 3.0, 30.0), (0.3, 0.8)
"""Where fits begin: times [s], and β or B [1]."""


@dataclass(frozen=True, kw_only=True)
class Law:
    """A law φ(t) of four parameters: where it begins, where it ends, a time τ, and β or B.

    Attributes:
        formula: Of φ, for a person to read.
        share: Of the way from begin to end that is left after a time [s], by τ [s] and β or B [1].
    """

    formula: str
    share: Callable[[Array, float, float], Array]


LAWS: Mapping[str, Law] = MappingProxyType(
    {
        STRETCHED: Law(
            formula="φ = φ_∞ − (φ_∞ − φ_b) exp(−(t/τ)^β)", share=lambda t, tau, beta: np.exp(-((t / tau) ** beta))
        ),
        LOGARITHMIC: Law(
            formula="φ = φ_∞ − (φ_∞ − φ_b) / (1 + B ln(1 + t/τ))",
            share=lambda t, tau, rate: 1 / (1 + rate * np.log1p(t / tau)),
        ),
    }
)


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A law fitted to a history.

    Attributes:
        law: Its name.
        begin: φ_b, φ as shaking begins [-].
        end: φ_∞ [-].
        tau: τ [s].
        power: β or B [1].
        residual: Root mean square of what it leaves [-].
    """

    law: str
    begin: float
    end: float
    tau: float
    power: float
    residual: float

    def at(self, times: NDArray[np.float64] | float) -> Array:
        """φ at times since shaking began [s]."""
        share = LAWS[self.law].share(np.asarray(times, dtype=np.float64), self.tau, self.power)
        return np.asarray(self.end - (self.end - self.begin) * share, dtype=np.float64)


def fit(law: str, times: Array, packing: Array) -> Fit:
    """The law's best fit by least squares, from several beginnings.

    Begin and end of the way enter linearly, and are solved for exactly at every τ and power.

    Args:
        law: One of `LAWS`.
        times: (n,) since shaking began, positive [s]; five at least.
        packing: (n,) φ there [-].

    Returns:
        The fit; φ_∞ of a law that has not come near its end is as uncertain as it looks.
    """

    def solved(parameters: Array) -> tuple[Array, Array]:
        share = LAWS[law].share(times, float(np.exp(parameters[0])), float(np.exp(parameters[1])))
        matrix = np.stack([share, 1 - share], axis=1)
        ends, *_ = np.linalg.lstsq(matrix, packing, rcond=None)
        return np.asarray(ends, dtype=np.float64), np.asarray(matrix @ ends - packing, dtype=np.float64)

    # Within what was seen: a τ far beyond the last time, or before the first one, says nothing.
    low, high = np.log([times[0] / 10, 0.05]), np.log([10 * times[-1], 20.0])
    tries = (
        least_squares(
            lambda x: solved(x)[1], np.clip(np.log([tau, power]), low + 1e-6, high - 1e-6), bounds=(low, high)
        )
        for tau, power in product(_TAUS, _POWERS)
    )
    best = min(tries, key=lambda found: float(found.cost))
    (begin, end), left = solved(best.x)
    tau, power = np.exp(best.x)
    return Fit(
        law=law,
        begin=float(begin),
        end=float(end),
        tau=float(tau),
        power=float(power),
        residual=float(np.sqrt(np.mean(left**2))),
    )


FIRST, INTERVALS = 0.1, 40
"""Of a history that laws are fitted to: where it begins, three periods of shaking [s], and in how many intervals."""


def spread_out(times: Array, packing: Array, *, first: float = FIRST, count: int = INTERVALS) -> tuple[Array, Array]:
    """Means over intervals of time that are equally long on a logarithmic axis.

    Args:
        times: (n,) [s].
        packing: (n,) φ [-].
        first: Where the first interval begins, positive [s].
        count: Intervals up to the last time; those without a sample are left out.

    Returns:
        Geometric centres [s] and means [-].
    """
    edges = np.geomspace(first, times[-1] * (1 + 1e-9), count + 1)
    place = np.searchsorted(edges, times, side="right") - 1
    inside = (place >= 0) & (place < count)
    number = np.bincount(place[inside], minlength=count)
    total = np.bincount(place[inside], weights=packing[inside], minlength=count)
    there = number > 0
    return np.sqrt(edges[:-1] * edges[1:])[there], total[there] / number[there]
