"""Findings of a paper, each judged by our own runs: an effect with its error, a verdict, and words for both."""

from __future__ import annotations

import math
from typing import Literal

from scipy.special import stdtrit

from postprocess.statistics.seeds import CONFIDENCE, SeedMean, Slope

Effect = SeedMean | Slope

_MOST_RUNS = 1 << 20  # counted up to
_TELLING = 100  # times as many runs that are told as a number


class Unresolved(str):
    """The verdict `not resolved`, and what it would take.

    Attributes:
        more: So many times as many runs of the same scatter would resolve an effect as large as the one seen [-].
    """

    __slots__ = ("more",)

    def __new__(cls, more: float) -> Unresolved:
        """A verdict; `more` is infinite where no effect is seen at all, NaN where one run has no scatter."""
        verdict = super().__new__(cls, "not resolved")
        verdict.more = more
        return verdict

    more: float


Verdict = Literal["found", "not found", "not resolved", "no data"] | Unresolved

CRITERION = (
    "A finding is found where it holds beyond the 95 % half-width (Student's t) of the scatter over pairs or runs, "
    "not found where the opposite does, not resolved in between; where nothing holds at all, "
    "one verdict in forty is still `found`"
)
"""How verdicts come about, for footers."""


def judge(effect: Effect, *, threshold: float = 0.0) -> Verdict:
    """Whether an effect is clearly above a threshold."""
    if math.isnan(effect.value):
        return "no data"
    if effect.value - effect.half_width > threshold:
        return "found"
    if effect.value + effect.half_width < threshold:
        return "not found"
    return Unresolved(more=_runs_needed(effect, abs(effect.value - threshold)) / max(effect.count, 1))


def _runs_needed(effect: Effect, size: float) -> float:
    """How many runs of the same scatter have a 95 % half-width below some size; inf beyond a million."""
    scatter = effect.standard_error * math.sqrt(effect.count)
    if not math.isfinite(scatter):
        return math.nan
    few, many = 1, 2
    while scatter * stdtrit(many - 1, (1 + CONFIDENCE) / 2) / math.sqrt(many) > size:
        few, many = many, 2 * many
        if many > _MOST_RUNS:
            return math.inf
    while many - few > 1:
        middle = (few + many) // 2
        enough = middle > 1 and scatter * stdtrit(middle - 1, (1 + CONFIDENCE) / 2) / math.sqrt(middle) <= size
        few, many = (few, middle) if enough else (middle, many)
    return float(many)


def told_more(verdict: Verdict) -> str:
    """`an effect of this size would take 3.1 times as many runs` of a verdict that is not resolved; else nothing."""
    more = verdict.more if isinstance(verdict, Unresolved) else math.nan
    if math.isnan(more):
        return ""
    if more > _TELLING:
        return f"an effect of this size would take more than {_TELLING} times as many runs"
    return f"an effect of this size would take {more:.2g} times as many runs"


def negative(effect: Effect) -> SeedMean:
    """The same effect with the other sign."""
    return SeedMean(
        value=-effect.value,
        standard_error=effect.standard_error,
        half_width=effect.half_width,
        count=effect.count,
    )


def told(effect: Effect, digits: int = 4, unit: str = "") -> str:
    """`+0.0123 ± 0.0011 (n = 15)`: a signed number with its standard error."""
    if math.isnan(effect.value):
        return "no data"
    error = f" ± {effect.standard_error:.{digits}g}" if math.isfinite(effect.standard_error) else " without an error"
    return f"{effect.value:+.{digits}g}{error}{unit} (n = {effect.count})"
