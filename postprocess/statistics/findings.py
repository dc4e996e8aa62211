"""Findings of a paper, each judged by our own runs: an effect with its error, a verdict, and words for both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import pandas as pd

from postprocess.statistics.seeds import SeedMean, Slope

Verdict = Literal["found", "not found", "not resolved", "no data"]
Effect = SeedMean | Slope

CRITERION = (
    "A finding is found where it holds beyond the 95 % half-width (Student's t) of the scatter over pairs or runs, "
    "not found where the opposite does, not resolved in between; where nothing holds at all, "
    "one verdict in forty is still `found`"
)
"""How verdicts come about, for footers."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A finding of the paper and what our runs say of it.

    Attributes:
        paper: What the paper found.
        ours: Our numbers; errors are standard errors.
        verdict: Ours.
        criterion: What "found" requires.
    """

    paper: str
    ours: str
    verdict: Verdict
    criterion: str


def judge(effect: Effect, *, threshold: float = 0.0) -> Verdict:
    """Whether an effect is clearly above a threshold."""
    if math.isnan(effect.value):
        return "no data"
    if effect.value - effect.half_width > threshold:
        return "found"
    return "not found" if effect.value + effect.half_width < threshold else "not resolved"


def all_of(verdicts: Sequence[Verdict]) -> Verdict:
    """Of a finding that says several things: one that is clearly wrong is enough to refuse it."""
    for verdict in ("not found", "no data", "not resolved"):
        if verdict in verdicts:
            return verdict
    return "found"


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


def findings_table(found: Sequence[Finding]) -> pd.DataFrame:
    """One row per finding."""
    columns = {"paper": "finding in the paper", "ours": "ours", "verdict": "verdict", "criterion": "criterion"}
    return pd.DataFrame([[getattr(one, name) for name in columns] for one in found], columns=list(columns.values()))
