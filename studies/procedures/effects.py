"""How the findings on procedures are measured, judged and told: differences, slopes and their verdicts."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Verdict, all_of, judge, negative, told
from postprocess.statistics.pairs import pairs
from postprocess.statistics.seeds import Slope, mean_over_seeds, slope_within
from studies.base.procedures import THETA, of_procedure


def pairs_of(table: pd.DataFrame, quantity: str, one: str, other: str) -> pd.DataFrame:
    """Values of two procedures for the same aspect ratio and seed: columns `one` and `other`."""
    return pairs(of_procedure(table, one), of_procedure(table, other), quantity)


def against_aspect(part: pd.DataFrame, quantity: str) -> Slope:
    """Slope of a quantity against the aspect ratio."""
    return slope_within(part[ASPECT], part[quantity], ["all"] * len(part))


def against_amplitude(part: pd.DataFrame, quantity: str) -> Slope:
    """Slope against θ within runs of the same aspect ratio and seed [per degree]."""
    return slope_within(part[THETA], part[quantity], list(zip(part[ASPECT], part[SEED], strict=True)))


def by_aspect(part: pd.DataFrame, quantity: str, form: str) -> str:
    """`0.4: 1.02, 0.7: 1.05`: means at each aspect ratio."""
    means = part.groupby(ASPECT)[quantity].mean().dropna()
    return ", ".join(f"{aspect:g}: {value:{form}}" for aspect, value in means.items()) or "none"


def compared(table: pd.DataFrame, quantity: str, one: str, others: Sequence[str], sign: int) -> tuple[str, Verdict]:
    """Whether one procedure is above (sign 1) or below (−1) each of others, pair by pair."""
    parts, verdicts = [], []
    for other in others:
        both = pairs_of(table, quantity, one, other)
        differences = both["one"] - both["other"]
        effect, means = mean_over_seeds(differences), differences.groupby(both[ASPECT]).mean()
        places = f", {'above' if sign > 0 else 'below'} at {(sign * means > 0).sum()} of {len(means)} l/w"
        parts.append(f"less {other} {told(effect, 3)}{places if len(means) else ''}")
        verdicts.append(judge(effect if sign > 0 else negative(effect)))
    return "; ".join(parts), all_of(verdicts)
