"""Findings: statements of a paper, each judged by effects with their errors that are computed from a table of runs.

A `Finding` has an id, by which `claims.yaml` refers to it, the statement, what makes it true, and a function from a
table to effects. An `Effect` is a number with its 95 % interval, the sign that the statement asks for, and a
threshold. The verdict and the text about our numbers follow from the effects. `above`, `slope`, `mean` and `ranks`
make findings of the usual kinds; any other function of a table that gives an `Outcome` will do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
import pandas as pd

from postprocess.statistics.findings import CRITERION, Unresolved, judge, told, told_more
from postprocess.statistics.points import ASPECT, pairs
from postprocess.statistics.ranks import correlation_within
from postprocess.statistics.seeds import SeedMean, Slope, mean_over_seeds, slope_within

__all__ = ["CRITERION", "Effect", "Finding", "Judged", "Outcome", "Verdict", "above", "mean", "ranks", "slope"]

Rows = Callable[[pd.DataFrame], pd.DataFrame]
"""Selects or derives the rows that a finding is about."""


class Verdict(StrEnum):
    """What our runs say of a finding."""

    FOUND = "found"
    NOT_FOUND = "not found"
    NOT_RESOLVED = "not resolved"
    NO_DATA = "no data"


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A number with its error.

    Attributes:
        label: What it is.
        value: The estimate.
        sign: +1 where the statement asks for more than the threshold, −1 for less, 0 where it is shown, not judged.
        threshold: In the unit of the estimate.
        unit: Of the number shown, with a space before.
        text: The number as shown, where it is not the estimate itself, such as that of a logarithm.
        note: What is shown behind it.
        may_be_higher: Whether the estimate is a lower bound.
        may_be_lower: Whether it is an upper bound.
    """

    label: str
    value: SeedMean | Slope
    sign: int = 1
    threshold: float = 0.0
    unit: str = ""
    text: str = ""
    note: str = ""
    may_be_higher: bool = False
    may_be_lower: bool = False

    @property
    def verdict(self) -> Verdict:
        """Whether the effect is beyond its threshold."""
        verdict = Verdict(str(self._judged))
        high, low = (self.may_be_higher, self.may_be_lower)[:: self.sign or 1]
        if (verdict == Verdict.FOUND and low) or (verdict == Verdict.NOT_FOUND and high):
            return Verdict.NOT_RESOLVED
        return verdict

    @property
    def more(self) -> float:
        """How many times as many runs would resolve it; NaN where it is resolved, or where that is not known."""
        judged = self._judged
        return judged.more if isinstance(judged, Unresolved) else math.nan

    @property
    def _judged(self) -> str:
        signed = replace(self.value, value=self.sign * self.value.value)
        return judge(signed, threshold=self.sign * self.threshold)

    def __str__(self) -> str:
        """`shape-change less internal +0.12 ± 0.01 (n = 8)`."""
        beside = "" if self.sign else ", not judged"
        return f"{self.label} {self.text or told(self.value, 3, self.unit)}{self.note}{beside}"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a finding comes to.

    Attributes:
        effects: All those with a sign must have it.
        note: What is shown besides.
        verdict: Where it does not follow from the effects.
    """

    effects: Sequence[Effect] = ()
    note: str = ""
    verdict: Verdict | None = None


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A statement and how it is judged.

    Attributes:
        id: Short name, unique in its study.
        says: The statement, as the paper has it or our own.
        found_if: What makes it true.
        outcome: Effects of a table of runs or samples.
        rows: Applied to the table before.
        tables: Names of the study's tables that `outcome` takes instead, one argument each.
    """

    id: str
    says: str
    found_if: str
    outcome: Callable[..., Outcome | Sequence[Effect]] = field(repr=False)
    rows: Rows = field(default=lambda table: table, repr=False)
    tables: Sequence[str] = ()

    def judge(self, samples: pd.DataFrame, tables: Mapping[str, pd.DataFrame] | None = None) -> Judged:
        """Judge the finding by a table of samples, or by the study's tables that it names."""
        given = [(tables or {})[name] for name in self.tables] if self.tables else [self.rows(samples)]
        outcome = self.outcome(*given)
        outcome = outcome if isinstance(outcome, Outcome) else Outcome(effects=outcome)
        verdict, more = _verdict([effect for effect in outcome.effects if effect.sign])
        if outcome.verdict is not None:
            verdict, more = outcome.verdict, math.nan if outcome.verdict != verdict else more
        ours = "; ".join(filter(None, [*map(str, outcome.effects), outcome.note])) or "no data"
        return Judged(finding=self, ours=ours, verdict=verdict, more=more)


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A finding with its verdict.

    Attributes:
        finding: The finding.
        ours: Our numbers; errors are standard errors.
        verdict: The verdict.
        more: How many times as many runs would resolve it; NaN where that does not apply.
    """

    finding: Finding
    ours: str
    verdict: Verdict
    more: float = math.nan

    @property
    def needed(self) -> str:
        """What it would take to resolve the finding; empty where that does not apply."""
        return told_more(Unresolved(more=self.more))


def _verdict(effects: Sequence[Effect]) -> tuple[Verdict, float]:
    """Judge by all effects, with `Effect.more` of the one that needs most."""
    verdict = all_of(effect.verdict for effect in effects)
    needed = [effect.more for effect in effects if effect.verdict == verdict == Verdict.NOT_RESOLVED]
    return verdict, float(np.max(needed)) if needed else math.nan


def all_of(verdicts: Iterable[Verdict]) -> Verdict:
    """Judge a finding that says several things: one that is clearly wrong refutes it."""
    found = list(verdicts)
    order = (Verdict.NOT_FOUND, Verdict.NO_DATA, Verdict.NOT_RESOLVED, Verdict.FOUND)
    return next((verdict for verdict in order if verdict in found), Verdict.NO_DATA)


def within(value: float, half_width: float, margin: float) -> Verdict:
    """Judge whether a number with its 95 % half-width is as near to 0 as a margin, both ways beyond its error."""
    if math.isnan(value):
        return Verdict.NO_DATA
    if abs(value) + half_width <= margin:
        return Verdict.FOUND
    return Verdict.NOT_FOUND if abs(value) - half_width > margin else Verdict.NOT_RESOLVED


def findings_table(judged: Sequence[Judged]) -> pd.DataFrame:
    """`findings.csv`: one row per finding."""
    rows = [
        {
            "finding in the paper": one.finding.says,
            "ours": one.ours,
            "verdict": str(one.verdict),
            "criterion": one.finding.found_if,
            "needed": one.needed,
            "id": one.finding.id,
        }
        for one in judged
    ]
    return pd.DataFrame(rows, columns=["finding in the paper", "ours", "verdict", "criterion", "needed", "id"])


def above(
    name: str,
    says: str,
    quantity: str,
    one: str,
    others: Sequence[str],
    *,
    of: Callable[[pd.DataFrame, str], pd.DataFrame],
    found_if: str,
    sign: int = 1,
    label: str = "",
    beside: Sequence[str] = (),
    beside_quantity: str | None = None,
    bounds: str | None = None,
    rows: Rows = lambda table: table,
    note: Callable[[pd.DataFrame], str] = lambda _: "",
) -> Finding:
    """A group is above (sign 1) or below (−1) each of others, paired by aspect ratio and seed.

    Args:
        name: Id of the finding.
        says: See `Finding`.
        quantity: Column.
        one: Name of the group.
        others: Names of the others.
        of: Rows of a group.
        found_if: See `Finding`.
        sign: Which way.
        label: What the quantity is called.
        beside: Groups that are shown, not judged.
        beside_quantity: Column of those, where it is another one.
        bounds: Column that is above 0 where the quantity is a lower bound.
        rows: See `Finding`.
        note: Shown behind the effects.
    """

    def outcome(table: pd.DataFrame) -> Outcome:
        bounded = {name: bounds is not None and bool(of(table, name)[bounds].any()) for name in (one, *others)}
        effects: list[Effect] = []
        for other, judged in [*((name, sign) for name in others), *((name, 0) for name in beside)]:
            column = quantity if judged else beside_quantity or quantity
            both = pairs(of(table, one), of(table, other), column)
            difference = both["one"] - both["other"]
            means = difference.groupby(both[ASPECT]).mean()
            side = "above" if sign > 0 else "below"
            effects.append(
                Effect(
                    label=f"{label or quantity} of {one} less {other}" if not effects else f"less {other}",
                    value=mean_over_seeds(difference),
                    sign=judged,
                    note=f", {side} at {(sign * means > 0).sum()} of {len(means)} l/w" if len(means) > 1 else "",
                    may_be_higher=bool(judged) and bounded[one],
                    may_be_lower=bool(judged) and bounded[other],
                )
            )
        return Outcome(effects=effects, note=note(table))

    return Finding(id=name, says=says, found_if=found_if, outcome=outcome, rows=rows)


def slope(
    name: str,
    says: str,
    quantity: str,
    against: str,
    *,
    sign: int,
    label: str,
    found_if: str,
    within: Sequence[str] = (),
    rows: Rows = lambda table: table,
    unit: str = "",
    means: str = "",
) -> Finding:
    """A quantity rises (sign 1) or falls (−1) with a variable, by a straight line within blocks.

    Args:
        name: Id of the finding.
        says: See `Finding`.
        quantity: Column.
        against: Column of the variable.
        sign: Which way.
        label: What the slope is of.
        found_if: See `Finding`.
        within: Columns that make a block, which has its own level; none: one line through all rows.
        rows: See `Finding`.
        unit: Of the slope, with a space before.
        means: Format of means by the variable, shown behind it; empty: none.
    """

    def outcome(table: pd.DataFrame) -> Outcome:
        value = slope_within(table[against], table[quantity], blocks(table, within))
        by = f"by {'l/w' if against == ASPECT else against} {means_by(table, quantity, against, means)}"
        return Outcome(effects=[Effect(label=label, value=value, sign=sign, unit=unit)], note=by if means else "")

    return Finding(id=name, says=says, found_if=found_if, outcome=outcome, rows=rows)


def mean(
    name: str,
    says: str,
    values: Callable[[pd.DataFrame], pd.Series],
    label: str,
    *,
    rows: Rows = lambda table: table,
    sign: int = 1,
    threshold: float = 0.0,
    found_if: str = "",
    note: Callable[[pd.DataFrame], str] = lambda _: "",
) -> Finding:
    """A value of each row is above (sign 1) or below (−1) a threshold in the mean."""

    def outcome(table: pd.DataFrame) -> Outcome:
        effect = Effect(label=label, value=mean_over_seeds(values(table)), sign=sign, threshold=threshold)
        return Outcome(effects=[effect], note=note(table))

    side = ">" if sign > 0 else "<"
    found_if = found_if or f"{label} {side} {threshold:g}, mean over runs"
    return Finding(id=name, says=says, found_if=found_if, outcome=outcome, rows=rows)


def ranks(
    name: str,
    says: str,
    x: str,
    y: str,
    *,
    within: Sequence[str],
    bounds: str,
    found_if: str,
    unit: str,
    rows: Rows = lambda table: table,
    beside: Callable[[pd.DataFrame], Sequence[Effect]] = lambda _: (),
) -> Finding:
    """Y goes with x, by their rank correlation within blocks; a lower bound ranks above all that is none.

    A pile that held fast has a peak of at least what it took, and one that a single smarticle braces has one many times
    that of others: neither has a place on a straight line, but each has its rank among the piles of its block.

    Args:
        name: Id of the finding.
        says: See `Finding`.
        x: Column.
        y: Column.
        within: Columns that make a block.
        bounds: Column that is above 0 where y is a lower bound.
        found_if: See `Finding`.
        unit: Of the slope, which is shown beside.
        rows: See `Finding`.
        beside: Effects that are shown besides.
    """

    def outcome(table: pd.DataFrame) -> Outcome:
        across, up, held = table[x].tolist(), table[y].tolist(), table[bounds] > 0
        within_blocks = blocks(table, within)
        found = correlation_within(across, np.where(held, math.inf, up).tolist(), within_blocks)
        line = slope_within(across, up, within_blocks)
        note = f"{int(held.sum())} values are lower bounds" if held.any() else ""
        return Outcome(
            effects=[
                Effect(label="rank correlation", value=found, text=told(found, 2)),
                Effect(label="slope", value=line, sign=0, unit=f" {unit}"),
                *beside(table),
            ],
            note=note,
        )

    return Finding(id=name, says=says, found_if=found_if, outcome=outcome, rows=rows)


def blocks(table: pd.DataFrame, columns: Sequence[str]) -> Sequence[Hashable]:
    """Block of each row, by the values of columns; one block without columns."""
    return list(map(tuple, table[list(columns)].to_numpy().tolist())) if columns else ["all"] * len(table)


def means_by(table: pd.DataFrame, quantity: str, by: str, form: str) -> str:
    """`0.4: 1.02, 0.7: 1.05`: means at each value of a column."""
    means = table.groupby(by)[quantity].mean().dropna()
    cells = {value if isinstance(value, str) else f"{value:g}": one for value, one in means.items()}
    return ", ".join(f"{value}: {one:{form}}" for value, one in cells.items()) or "none"


def ranked(means: Mapping[str, float], form: str = ".3g") -> str:
    """`shape-change 5.1 > internal 4.2`."""
    known = sorted((name for name in means if math.isfinite(means[name])), key=lambda name: -means[name])
    return " > ".join(f"{name} {means[name]:{form}}" for name in known) or "none"
