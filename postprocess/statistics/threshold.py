"""Fit the place x_c at which half of all runs have a property, with its 95 % interval by profile likelihood.

The share of runs that have it rises with x as a logistic function 1/(1 + exp(-(x - x_c)/s)), the width s of whatever
the data allow. So it is sound also where no run below some x has it and all above do, and nothing else is known of s.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

from postprocess.statistics.seeds import CONFIDENCE, Floats

_PLACES, _WIDTHS = 401, 30


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """What the runs of one group say of x_c.

    Attributes:
        places: (n,) where x_c may be, common to all groups.
        likelihood: (n,) log of it, of the best width at each place.
        widths: (n,) these widths.
        runs: Number of runs.
        having: Number of runs with the property.
    """

    places: Floats
    likelihood: Floats
    widths: Floats
    runs: int
    having: int

    @property
    def known(self) -> bool:
        """Whether some runs have the property and some do not."""
        return 0 < self.having < self.runs

    @property
    def best(self) -> float:
        """x_c; where a whole range is as good, its middle. NaN where it is not known."""
        if not self.known:
            return math.nan
        return float(self.places[self.likelihood >= self.likelihood.max() - 1e-3].mean())

    @property
    def width(self) -> float:
        """The logistic function's at the best place; at least the narrowest that is tried."""
        return float(self.widths[self.likelihood.argmax()]) if self.known else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of x_c; infinite where it reaches the end of what is tried."""
        kept = self.likelihood >= self.likelihood.max() - chdtri(1, 1 - CONFIDENCE) / 2
        low, high = self.places[kept][[0, -1]]
        return (-math.inf if kept[0] else float(low), math.inf if kept[-1] else float(high))


def profiles(x: Floats, having: Floats, groups: NDArray[np.int64]) -> dict[int, Profile]:
    """Compute the profile likelihoods of x_c of each group, on common places.

    Args:
        x: (n,) finite, of each run.
        having: (n,) 0 or 1.
        groups: (n,) such as the size.
    """
    span = float(np.ptp(x)) or 1.0
    places = np.linspace(x.min() - span / 2, x.max() + span / 2, _PLACES)
    widths = span * np.geomspace(2e-3, 1, _WIDTHS)
    found = {}
    for group in np.unique(groups):
        own = groups == group
        # (places, widths, runs); log of the probability of what was seen, without an overflow.
        steps = (places[:, None, None] - x[own]) / widths[:, None] * (2 * having[own] - 1)
        likelihood = -np.logaddexp(0, steps).sum(axis=2)
        found[int(group)] = Profile(
            places=places,
            likelihood=likelihood.max(axis=1),
            widths=widths[likelihood.argmax(axis=1)],
            runs=int(own.sum()),
            having=int(having[own].sum()),
        )
    return found


def alike(found: Collection[Profile]) -> float:
    """Return the probability of places so unlike each other, were they all one, by the ratio of likelihoods [1].

    NaN where fewer than two groups know theirs.
    """
    known = [one.likelihood for one in found if one.known]
    if len(known) < 2:
        return math.nan
    apart = sum(float(one.max()) for one in known)
    return float(chdtrc(len(known) - 1, 2 * max(apart - float(np.sum(known, axis=0).max()), 0.0)))
