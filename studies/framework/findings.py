"""Findings: statements, each judged by effects with their errors that are computed from a table of runs.

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

from postprocess.statistics.findings import Unresolved, effect_text, judge, more_runs_text
from postprocess.statistics.points import ASPECT, SEED, pairs
from postprocess.statistics.ranks import correlation_within
from postprocess.statistics.seeds import SeedMean, Slope, mean_over_seeds, slope_within
from studies.framework.procedures import CROSSINGS, ENERGY, PHI, PHI_ACTIVE, PROCEDURE, THETA, of_procedure

_SYMBOLS = {ASPECT: "l/w", SEED: "seed", THETA: "θ", PHI: "φ", PHI_ACTIVE: "φ_f", CROSSINGS: "⟨N⟩", ENERGY: "energy"}

Rows = Callable[[pd.DataFrame], pd.DataFrame]  #: Selects or derives the rows that a finding is about


class Verdict(StrEnum):
    """What our runs say of a finding."""

    FOUND = "found"
    NOT_FOUND = "not found"
    NOT_RESOLVED = "not resolved"
    NO_DATA = "no data"


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A number with its error."""

    label: str  #: What it is
    value: SeedMean | Slope  #: The estimate
    #: +1 where the statement asks for more than the threshold, −1 for less, 0 where it is shown, not judged
    sign: int = 1
    threshold: float = 0.0  #: In the unit of the estimate
    unit: str = ""  #: Of the number shown, with a space before
    text: str = ""  #: The number as shown, where it is not the estimate itself, such as that of a logarithm
    note: str = ""  #: What is shown behind it
    may_be_higher: bool = False  #: Whether the estimate is a lower bound
    may_be_lower: bool = False  #: Whether it is an upper bound

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
        return f"{self.label} {self.text or effect_text(self.value, 3, self.unit)}{self.note}{beside}"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a finding comes to."""

    effects: Sequence[Effect] = ()  #: All those with a sign must have it
    note: str = ""  #: What is shown besides
    verdict: Verdict | None = None  #: Where it does not follow from the effects


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A statement and how it is judged."""

    id: str  #: Short name, unique in its study
    says: str  #: The statement, as the paper has it or our own
    outcome: Callable[..., Outcome | Sequence[Effect]] = field(repr=False)  #: Effects of a table of runs or samples
    rows: Rows = field(default=lambda table: table, repr=False)  #: Applied to the table before
    tables: Sequence[str] = ()  #: Names of the study's tables that `outcome` takes instead, one argument each
    found_if: str = ""  #: What makes it true, where that is more than all effects beyond their thresholds

    def judge(self, samples: pd.DataFrame, tables: Mapping[str, pd.DataFrame] | None = None) -> Judged:
        """Judge the finding by a table of samples, or by the study's tables that it names."""
        given = [(tables or {})[name] for name in self.tables] if self.tables else [self.rows(samples)]
        outcome = self.outcome(*given)
        outcome = outcome if isinstance(outcome, Outcome) else Outcome(effects=outcome)
        verdict, more = _verdict([effect for effect in outcome.effects if effect.sign])
        if outcome.verdict is not None:
            verdict, more = outcome.verdict, math.nan if outcome.verdict != verdict else more
        ours = "; ".join(filter(None, [*map(str, outcome.effects), outcome.note])) or "no data"
        sides = [
            f"{one.label} {'>' if one.sign > 0 else '<'} {one.threshold:.4g}" for one in outcome.effects if one.sign
        ]
        return Judged(finding=self, ours=ours, verdict=verdict, more=more, criterion=self.found_if or "; ".join(sides))


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A finding with its verdict."""

    finding: Finding
    ours: str  #: Our numbers; errors are standard errors
    verdict: Verdict
    more: float = math.nan  #: How many times as many runs would resolve it; NaN where that does not apply
    criterion: str = ""  #: What makes the finding true

    @property
    def needed(self) -> str:
        """What it would take to resolve the finding; empty where that does not apply."""
        return more_runs_text(Unresolved(more=self.more))


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


def decide(found: bool, wrong: bool = False, *, data: bool = True) -> Verdict:
    """Turn what was found into a verdict; `wrong`: whether the opposite was."""
    if not data:
        return Verdict.NO_DATA
    return Verdict.FOUND if found else Verdict.NOT_FOUND if wrong else Verdict.NOT_RESOLVED


def within(value: float, half_width: float, margin: float) -> Verdict:
    """Judge whether a number with its 95 % half-width is as near to 0 as a margin, both ways beyond its error."""
    size = abs(value)
    return decide(size + half_width <= margin, size - half_width > margin, data=not math.isnan(value))


def findings_table(judged: Sequence[Judged]) -> pd.DataFrame:
    """`findings.csv`: one row per finding."""
    rows = [
        {
            "finding in the paper": one.finding.says,
            "ours": one.ours,
            "verdict": str(one.verdict),
            "criterion": one.criterion,
            "needed": one.needed,
            "id": one.finding.id,
        }
        for one in judged
    ]
    return pd.DataFrame(rows, columns=["finding in the paper", "ours", "verdict", "criterion", "needed", "id"])


def above(
    name: str,
    says: str,
    quantities: str | Mapping[str, int],
    one: str,
    others: Sequence[str],
    *,
    sign: int = 1,
    beside: Sequence[str] = (),
    beside_quantity: str | None = None,
    bounds: str | None = None,
    rows: Rows = lambda table: table,
    shown: Sequence[str] = (),
    found_if: str = "",
) -> Finding:
    """Judge whether a procedure is above (sign 1) or below (−1) each of others, paired by aspect ratio and seed.

    Several quantities have a sign each. Procedures `beside`, by the column `beside_quantity` if it is another one, and
    means of the columns `shown` are shown and not judged. Where the column `bounds` is above 0 the first quantity is a
    lower bound, and the others are unknown.
    """
    signs = {quantities: sign} if isinstance(quantities, str) else quantities

    def outcome(table: pd.DataFrame) -> Outcome:
        bounded = {
            name: bounds is not None and bool(of_procedure(table, name)[bounds].any()) for name in (one, *others)
        }
        effects: list[Effect] = []
        for number, (quantity, wanted) in enumerate(signs.items()):
            for other, judged in [*((other, wanted) for other in others), *((other, 0) for other in beside)]:
                column = quantity if judged else beside_quantity or quantity
                both = pairs(of_procedure(table, one), of_procedure(table, other), column)
                difference = both["one"] - both["other"]
                means = difference.groupby(both[ASPECT]).mean()
                side = f", {'above' if wanted > 0 else 'below'} at {(wanted * means > 0).sum()} of {len(means)} l/w"
                high, low = bounded[one], bounded.get(other, False)
                effects.append(
                    Effect(
                        label=f"{symbol(column)} of {one} less {other}"
                        if other == others[0] and judged
                        else f"less {other}",
                        value=mean_over_seeds(difference),
                        sign=judged,
                        unit=unit_of(column),
                        note=side if len(means) > 1 else "",
                        may_be_higher=bool(judged) and (high or (number > 0 and low)),
                        may_be_lower=bool(judged) and (low or (number > 0 and high)),
                    )
                )
        note = "; ".join(f"{symbol(column)}: {means_by(table, column, PROCEDURE, '.3g')}" for column in shown)
        return Outcome(effects=effects, note=note)

    return Finding(id=name, says=says, found_if=found_if, outcome=outcome, rows=rows)


def slope(
    name: str,
    says: str,
    quantity: str,
    against: str,
    *,
    sign: int = 1,
    within: Sequence[str] = (),
    rows: Rows = lambda table: table,
    label: str = "",
) -> Finding:
    """Judge whether a quantity rises (sign 1) or falls (−1) with a variable, by a straight line within blocks.

    Columns `within` make a block, which has its own level; without them there is one line through all rows.
    """
    label = f"{label or symbol(quantity)} against {symbol(against)}"

    def outcome(table: pd.DataFrame) -> Outcome:
        value = slope_within(table[against], table[quantity], blocks(table, within))
        note = "" if within else f"by {symbol(against)} {means_by(table, quantity, against, '.4g')}"
        unit = unit_of(quantity) + (f" per{unit_of(against)}" if unit_of(against) else "")
        return Outcome(effects=[Effect(label=label, value=value, sign=sign, unit=unit)], note=note)

    return Finding(id=name, says=says, outcome=outcome, rows=rows)


def mean(
    name: str,
    says: str,
    values: Callable[[pd.DataFrame], pd.Series],
    label: str,
    *,
    rows: Rows = lambda table: table,
    threshold: float = 0.0,
    shown: Sequence[str] = (),
    by: str = PROCEDURE,
) -> Finding:
    """Judge whether a value of each row is above a threshold in the mean.

    Means of the columns `shown` at each value of the column `by` are shown, not judged.
    """

    def outcome(table: pd.DataFrame) -> Outcome:
        effect = Effect(label=label, value=mean_over_seeds(values(table)), threshold=threshold)
        note = "; ".join(f"{symbol(column)}: {means_by(table, column, by, '.3g')}" for column in shown)
        return Outcome(effects=[effect], note=note)

    return Finding(id=name, says=says, outcome=outcome, rows=rows)


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
) -> Finding:
    """Judge whether y goes with x, by their rank correlation within blocks; a lower bound ranks above all others.

    A pile that held fast has a peak of at least what it took, and one that a single smarticle braces has one many times
    that of others: neither has a place on a straight line, but each has its rank among the piles of its block.

    Columns `within` make a block; the column `bounds` is above 0 where y is a lower bound; `unit` is that of the slope,
    which is shown beside.
    """

    def outcome(table: pd.DataFrame) -> Outcome:
        across, up, held = table[x].tolist(), table[y].tolist(), table[bounds] > 0
        within_blocks = blocks(table, within)
        found = correlation_within(across, np.where(held, math.inf, up).tolist(), within_blocks)
        line = slope_within(across, up, within_blocks)
        note = f"{int(held.sum())} values are lower bounds" if held.any() else ""
        return Outcome(
            effects=[
                Effect(label="rank correlation", value=found, text=effect_text(found, 2)),
                Effect(label="slope", value=line, sign=0, unit=f" {unit}"),
            ],
            note=note,
        )

    return Finding(id=name, says=says, found_if=found_if, outcome=outcome, rows=rows)


def symbol(column: str) -> str:
    """Give what a column is called in text: its symbol, or its name without the unit."""
    return _SYMBOLS.get(column) or column.partition(" [")[0]


def unit_of(column: str) -> str:
    """Give the unit of a column, with a space before; empty for a pure number."""
    unit = column.rpartition(" [")[2].removesuffix("]") if column.endswith("]") else "-"
    return "" if unit == "-" else f" {unit}"


def blocks(table: pd.DataFrame, columns: Sequence[str]) -> Sequence[Hashable]:
    """Block of each row, by the values of columns; one block without columns."""
    return list(map(tuple, table[list(columns)].to_numpy().tolist())) if columns else ["all"] * len(table)


def means_by(table: pd.DataFrame, quantity: str, by: str, form: str) -> str:
    """`0.4: 1.02, 0.7: 1.05`: means at each value of a column."""
    means = table.groupby(by)[quantity].mean().dropna()
    cells = {value if isinstance(value, str) else f"{value:g}": one for value, one in means.items()}
    return ", ".join(f"{value}: {one:{form}}" for value, one in cells.items()) or "none"
