"""How the findings on procedures are measured, judged and told: differences, slopes and their verdicts."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Finding, Verdict, all_of, judge, negative, told
from postprocess.statistics.pairs import pairs
from postprocess.statistics.seeds import Slope, mean_over_seeds, slope_within
from studies.base.procedures import STATIC, THETA, of_procedure


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


def with_aspect(
    paper: str, part: pd.DataFrame, quantity: str, symbol: str, *, sign: int, form: str, unit: str = "", when: str = ""
) -> Finding:
    """A finding that a quantity rises (sign 1) or falls (−1) with the aspect ratio.

    Args:
        paper: What the paper says.
        part: Samples of one procedure.
        quantity: Column.
        symbol: What it is called.
        sign: Which way.
        form: Of a number.
        unit: Of it, with a space before.
        when: What the criterion says besides.
    """
    slope = against_aspect(part, quantity)
    return Finding(
        paper=paper,
        ours=f"{symbol} against l/w {told(slope, 3, unit)}; by l/w {by_aspect(part, quantity, form)}{unit}",
        verdict=judge(slope if sign > 0 else negative(slope)),
        criterion=f"slope of {symbol} against l/w {'>' if sign > 0 else '<'} 0{when}",
    )


def mean_above_zero(paper: str, values: pd.Series, symbol: str, unit: str = "") -> Finding:
    """A finding that something is above zero in the mean over runs."""
    effect = mean_over_seeds(values)
    return Finding(
        paper=paper,
        ours=f"{symbol} {told(effect, 3, unit)}",
        verdict=judge(effect),
        criterion=f"{symbol} > 0, mean over runs",
    )


def gains(table: pd.DataFrame, procedure: str, quantity: str) -> pd.DataFrame:
    """What a procedure adds to the static state of the same aspect ratio and seed, in the column of the quantity."""
    both = pairs_of(table, quantity, procedure, STATIC)
    return both.assign(**{quantity: both["one"] - both["other"]})
