"""How the findings on procedures are measured, judged and told: differences, slopes and their verdicts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pandas as pd

from postprocess.procedures_runs import AMPLITUDE, INTERNAL, PROCEDURE, THETA
from postprocess.seeds import SeedMean, Slope, mean_over_seeds, slope_within
from postprocess.study_runs import ASPECT, SEED

Verdict = Literal["found", "not found", "not resolved", "no data"]
Effect = SeedMean | Slope


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


def of_procedure(table: pd.DataFrame, procedure: str) -> pd.DataFrame:
    """Samples of one procedure; of the internal oscillation those that procedures are compared at."""
    chosen = table[table[PROCEDURE] == procedure]
    return chosen[np.isclose(chosen[THETA], AMPLITUDE)] if procedure == INTERNAL else chosen


def pairs(table: pd.DataFrame, quantity: str, one: str, other: str) -> pd.DataFrame:
    """Values of two procedures for the same aspect ratio and seed: columns `one` and `other`."""
    keys = [ASPECT, SEED]
    left = of_procedure(table, one)[[*keys, quantity]].rename(columns={quantity: "one"})
    right = of_procedure(table, other)[[*keys, quantity]].rename(columns={quantity: "other"})
    return left.merge(right, on=keys).dropna()


def paired(table: pd.DataFrame, quantity: str, one: str, other: str) -> SeedMean:
    """One procedure less another, mean over pairs of the same aspect ratio and seed."""
    both = pairs(table, quantity, one, other)
    return mean_over_seeds(both["one"] - both["other"])


def against_aspect(part: pd.DataFrame, quantity: str) -> Slope:
    """Slope of a quantity against the aspect ratio."""
    return slope_within(part[ASPECT], part[quantity], ["all"] * len(part))


def against_amplitude(part: pd.DataFrame, quantity: str) -> Slope:
    """Slope against θ within runs of the same aspect ratio and seed [per degree]."""
    return slope_within(part[THETA], part[quantity], list(zip(part[ASPECT], part[SEED], strict=True)))


def told(effect: Effect, digits: int = 4, unit: str = "") -> str:
    """`+0.0123 ± 0.0011 (n = 15)`: a signed number with its standard error."""
    if math.isnan(effect.value):
        return "no data"
    error = f" ± {effect.standard_error:.{digits}g}" if math.isfinite(effect.standard_error) else " without an error"
    return f"{effect.value:+.{digits}g}{error}{unit} (n = {effect.count})"


def by_aspect(part: pd.DataFrame, quantity: str, form: str) -> str:
    """`0.4: 1.02, 0.7: 1.05`: means at each aspect ratio."""
    means = part.groupby(ASPECT)[quantity].mean().dropna()
    return ", ".join(f"{aspect:g}: {value:{form}}" for aspect, value in means.items()) or "none"


def compared(table: pd.DataFrame, quantity: str, one: str, others: Sequence[str], sign: int) -> tuple[str, Verdict]:
    """Whether one procedure is above (sign 1) or below (−1) each of others, pair by pair."""
    parts, verdicts = [], []
    for other in others:
        both = pairs(table, quantity, one, other)
        differences = both["one"] - both["other"]
        effect, means = mean_over_seeds(differences), differences.groupby(both[ASPECT]).mean()
        places = f", {'above' if sign > 0 else 'below'} at {(sign * means > 0).sum()} of {len(means)} l/w"
        parts.append(f"less {other} {told(effect, 3)}{places if len(means) else ''}")
        verdicts.append(judge(effect if sign > 0 else negative(effect)))
    return "; ".join(parts), all_of(verdicts)
