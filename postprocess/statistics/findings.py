"""Judge findings by effects with errors: a verdict, and the text that states both."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import replace
from typing import Literal

from scipy.special import stdtrit

from postprocess.statistics.seeds import CONFIDENCE, SeedMean

_MOST_RUNS = 1 << 20  # more runs count as infinitely many
_MOST_TIMES = 100  # a larger ratio of runs is stated as "more than 100"


class Unresolved(str):
    """The verdict `not resolved`, with the number of runs that would resolve the effect.

    Attributes:
        more: Runs needed over present runs [-], if effect and scatter stay; infinite for an effect of 0, NaN if the
            scatter is unknown.
    """

    __slots__ = ("more",)
    more: float

    def __new__(cls, more: float) -> Unresolved:
        """Return the verdict with this number."""
        verdict = super().__new__(cls, "not resolved")
        verdict.more = more
        return verdict


Verdict = Literal["found", "not found", "not resolved", "no data"] | Unresolved

CRITERION = (
    "A finding is found where it holds beyond the 95 % half-width (Student's t) of the scatter over pairs or runs, "
    "not found where the opposite does, not resolved in between; where nothing holds at all, "
    "one verdict in forty is still `found`"
)  #: Definition of the verdicts, for footers of figures and tables


def judge(effect: SeedMean, *, threshold: float = 0.0) -> Verdict:
    """Decide whether an effect is above a threshold, by its 95 % interval; see `CRITERION`."""
    if math.isnan(effect.value):
        return "no data"
    if effect.value - effect.half_width > threshold:
        return "found"
    if effect.value + effect.half_width < threshold:
        return "not found"
    return Unresolved(more=_runs_needed(effect, abs(effect.value - threshold)) / max(effect.count, 1))


def _runs_needed(effect: SeedMean, size: float) -> float:
    """Return the least number of runs whose 95 % half-width is at most a size; infinite above a million."""
    scatter = effect.standard_error * math.sqrt(effect.count)
    if not math.isfinite(scatter):
        return math.nan

    def enough(runs: int) -> bool:
        return bool(scatter * stdtrit(runs - 1, (1 + CONFIDENCE) / 2) / math.sqrt(runs) <= size)

    counts = range(2, _MOST_RUNS + 1)
    place = bisect_left(counts, True, key=enough)
    return float(counts[place]) if place < len(counts) else math.inf


def more_runs_text(verdict: Verdict) -> str:
    """Return `an effect of this size would take 3.1 times as many runs` if unresolved, else an empty text."""
    more = verdict.more if isinstance(verdict, Unresolved) else math.nan
    if math.isnan(more):
        return ""
    times = f"more than {_MOST_TIMES}" if more > _MOST_TIMES else f"{more:.2g}"
    return f"an effect of this size would take {times} times as many runs"


def negative(effect: SeedMean) -> SeedMean:
    """Return the effect with the opposite sign and an unchanged error."""
    return replace(effect, value=-effect.value)


def effect_text(effect: SeedMean, digits: int = 4, unit: str = "") -> str:
    """Return `+0.0123 ± 0.0011 (n = 15)`: effect, standard error and number of runs, or `no data`."""
    if math.isnan(effect.value):
        return "no data"
    error = f" ± {effect.standard_error:.{digits}g}" if math.isfinite(effect.standard_error) else " without an error"
    return f"{effect.value:+.{digits}g}{error}{unit} (n = {effect.count})"
