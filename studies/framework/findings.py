"""Findings: statements that are judged by effects, which are computed from tables of runs.

A `Finding` is a statement with a function that computes effects from a table. An `Effect` is a number with its 95 %
interval; it supports the statement if it lies beyond a threshold on the side that the statement asks for. The verdict
and the text with our numbers follow from the effects. `above`, `slope`, `mean` and `ranks` make common findings.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from postprocess.statistics.points import ASPECT, SEED, pairs
from postprocess.statistics.ranks import correlation_within
from postprocess.statistics.seeds import CONFIDENCE, SeedMean, Slope, mean_over_seeds, slope_within
from studies.framework.procedures import CROSSINGS, ENERGY, PHI, PHI_ACTIVE, PROCEDURE, THETA, of_procedure

_SYMBOLS = {ASPECT: "l/w", SEED: "seed", THETA: "θ", PHI: "φ", PHI_ACTIVE: "φ_f", CROSSINGS: "⟨N⟩", ENERGY: "energy"}

CRITERION = (
    "A finding is found where it holds beyond the 95 % half-width (Student's t) of the scatter over pairs or runs, "
    "not found where the opposite does, not resolved in between; where nothing holds at all, "
    "one verdict in forty is still `found`"
)  #: Definition of the verdicts, for footers of figures and tables

_MOST_RUNS = 1 << 20  # more runs count as infinitely many
_MOST_TIMES = 100  # a larger ratio of runs is stated as "more than 100"

Rows = Callable[[pd.DataFrame], pd.DataFrame]  #: Selects or computes the rows that a finding is judged by


class Verdict(StrEnum):
    """Result of judging a finding by our runs."""

    FOUND = "found"
    NOT_FOUND = "not found"
    NOT_RESOLVED = "not resolved"
    NO_DATA = "no data"


def judge(effect: SeedMean, *, threshold: float = 0.0) -> Verdict:
    """Decide whether an effect is above a threshold, by its 95 % interval, as `CRITERION` defines."""
    low, high = effect.value - effect.half_width, effect.value + effect.half_width
    return decide(low > threshold, high < threshold, data=not math.isnan(effect.value))


def more_runs(effect: SeedMean, *, threshold: float = 0.0) -> float:
    """Return the factor by which the number of runs must grow to resolve an effect of this size.

    The effect is resolved if it differs from the threshold. The scatter is assumed to stay. The factor is infinite if
    more than a million runs are needed, and NaN if the scatter is unknown.
    """
    size, scatter = abs(effect.value - threshold), effect.standard_error * math.sqrt(effect.count)
    if not math.isfinite(scatter):
        return math.nan

    def enough(runs: int) -> bool:
        return bool(scatter * stdtrit(runs - 1, (1 + CONFIDENCE) / 2) / math.sqrt(runs) <= size)

    counts = range(2, _MOST_RUNS + 1)
    place = bisect_left(counts, True, key=enough)
    return counts[place] / effect.count if place < len(counts) else math.inf


def effect_text(effect: SeedMean, digits: int = 3, unit: str = "") -> str:
    """Return `+0.0123 ± 0.0011 N (n = 15)`: effect, standard error, `unit`, number of runs; or `no data`."""
    if math.isnan(effect.value):
        return "no data"
    error = f" ± {effect.standard_error:.{digits}g}" if math.isfinite(effect.standard_error) else " without an error"
    return f"{effect.value:+.{digits}g}{error}{unit} (n = {effect.count})"


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A number with its error, such as a difference or a slope."""

    label: str  #: Name of the number in texts
    value: SeedMean | Slope  #: Estimate with its error
    #: +1 if the statement asks for more than the threshold, −1 if for less, 0 if the number is shown but not judged
    sign: int = 1
    threshold: float = 0.0  #: Threshold in the unit of the estimate
    unit: str = ""  #: Unit of the number in texts, with a space before it
    text: str = ""  #: Number in texts, if it is not the estimate itself but, for example, its exponential
    note: str = ""  #: Text after the number
    may_be_higher: bool = False  #: Whether the estimate is a lower bound
    may_be_lower: bool = False  #: Whether the estimate is an upper bound

    @property
    def verdict(self) -> Verdict:
        """Verdict on whether the estimate lies above its threshold (sign +1) or below it (sign −1).

        It is not resolved if the estimate is a bound and the true value may lie on the other side.
        """
        verdict = self._judged
        high, low = (self.may_be_higher, self.may_be_lower)[:: self.sign or 1]
        if (verdict == Verdict.FOUND and low) or (verdict == Verdict.NOT_FOUND and high):
            return Verdict.NOT_RESOLVED
        return verdict

    @property
    def more(self) -> float:
        """Factor by which the number of runs must grow to resolve the effect; NaN if resolved or unknown."""
        unresolved = self._judged == Verdict.NOT_RESOLVED
        return more_runs(self.value, threshold=self.threshold) if unresolved else math.nan

    @property
    def _judged(self) -> Verdict:
        signed = replace(self.value, value=self.sign * self.value.value)
        return judge(signed, threshold=self.sign * self.threshold)

    def __str__(self) -> str:
        """Format the effect with its error: `shape-change less internal +0.12 ± 0.01 (n = 8)`."""
        beside = "" if self.sign else ", not judged"
        return f"{self.label} {self.text or effect_text(self.value, unit=self.unit)}{self.note}{beside}"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Effects that a finding is judged by, and text about them."""

    effects: Sequence[Effect] = ()  #: The finding is found if all effects with a sign are beyond their thresholds
    note: str = ""  #: Text after the effects
    verdict: Verdict | None = None  #: None: the verdict follows from the effects


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A statement, with the function that computes the effects for its verdict."""

    id: str  #: Short name, unique in its study; `claims.yaml` refers to findings by it
    says: str  #: The statement, of the paper or our own
    #: Computes the effects from the samples (see `Study.samples`), or from the tables named by `tables`
    outcome: Callable[..., Outcome | Sequence[Effect]] = field(repr=False)
    rows: Rows = field(default=lambda table: table, repr=False)  #: Selects the samples that `outcome` gets
    #: Names of the study's tables that are passed to `outcome`, one argument each; empty: `outcome` gets the samples
    tables: Sequence[str] = ()
    found_if: str = ""  #: Criterion in words; empty: all effects with a sign beyond their thresholds

    def judge(self, samples: pd.DataFrame, tables: Mapping[str, pd.DataFrame] | None = None) -> Judged:
        """Judge the finding by the samples, or by the tables that `Finding.tables` names.

        `samples` has a row per run or group of runs, see `Study.samples`; `tables` has all tables of the study by name.
        """
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
    """A finding with its verdict and our numbers."""

    finding: Finding
    ours: str  #: Our numbers with standard errors, as text
    verdict: Verdict
    more: float = math.nan  #: Factor by which the number of runs would have to grow to resolve it; NaN if unknown
    criterion: str = ""  #: Criterion for the verdict `found`

    @property
    def needed(self) -> str:
        """Text on how many more runs would resolve the finding; empty if resolved, or if that is unknown."""
        if math.isnan(self.more):
            return ""
        times = f"more than {_MOST_TIMES}" if self.more > _MOST_TIMES else f"{self.more:.2g}"
        return f"an effect of this size would take {times} times as many runs"


def _verdict(effects: Sequence[Effect]) -> tuple[Verdict, float]:
    """Return the combined verdict of all effects, and the largest `Effect.more` if it is not resolved."""
    verdict = all_of(effect.verdict for effect in effects)
    needed = [effect.more for effect in effects if effect.verdict == verdict == Verdict.NOT_RESOLVED]
    return verdict, float(np.max(needed)) if needed else math.nan


def all_of(verdicts: Iterable[Verdict]) -> Verdict:
    """Combine the verdicts on the parts of a statement to a verdict on the whole.

    It is the first of these that applies: `not found` if any part is not found; `no data` if any part has no data, or
    if there are no parts; `not resolved` if any part is not resolved; `found`.
    """
    found = list(verdicts)
    order = (Verdict.NOT_FOUND, Verdict.NO_DATA, Verdict.NOT_RESOLVED, Verdict.FOUND)
    return next((verdict for verdict in order if verdict in found), Verdict.NO_DATA)


def decide(found: bool, wrong: bool = False, *, data: bool = True) -> Verdict:
    """Return "no data" unless `data`; "found" if `found`; "not found" if `wrong`; else "not resolved"."""
    if not data:
        return Verdict.NO_DATA
    return Verdict.FOUND if found else Verdict.NOT_FOUND if wrong else Verdict.NOT_RESOLVED


def within(value: float, half_width: float, margin: float) -> Verdict:
    """Decide whether a value lies within ±margin, by its 95 % interval value ± half_width."""
    size = abs(value)
    return decide(size + half_width <= margin, size - half_width > margin, data=not math.isnan(value))


def findings_table(judged: Sequence[Judged]) -> pd.DataFrame:
    """Make the table `findings.csv`: statement, numbers, verdict and criterion, a row per finding."""
    rows = [(one.finding.says, one.ours, str(one.verdict), one.criterion, one.needed, one.finding.id) for one in judged]
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
    """Make the finding that a procedure is above others in a quantity, paired by aspect ratio and seed.

    `quantities` is a column, or several with a sign each: +1 if the statement says above, −1 if below. The difference
    of `one` from the procedures `beside`, in the column `beside_quantity` if given, and means of the columns `shown`
    are not judged. The column `bounds` is above 0 in runs whose first quantity is a lower bound, and whose other
    quantities are unknown.
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
    """Make the finding that a quantity rises (sign +1) or falls (−1) with a variable, by straight lines.

    All blocks, rows with equal values in the columns `within`, have one slope, and each has its own intercept.
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
    sign: int = 1,
    threshold: float = 0.0,
    shown: Sequence[str] = (),
    by: str = PROCEDURE,
) -> Finding:
    """Make the finding that the mean of a value is above a threshold (sign +1) or below it (−1).

    `values` computes the value of each row, in the unit of the threshold. Means of the columns `shown`, at each value
    of the column `by`, are shown but not judged.
    """

    def outcome(table: pd.DataFrame) -> Outcome:
        effect = Effect(label=label, value=mean_over_seeds(values(table)), sign=sign, threshold=threshold)
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
    """Make the finding that y rises with x, by their rank correlation within blocks of rows.

    Ranks are used since peak forces do not follow a straight line: a pile that held fast gives a lower bound, which
    ranks above all other values, and a pile that a single smarticle braces has a peak many times those of other piles.

    Ranks are taken within blocks, rows with equal values in the columns `within`. The column `bounds` is above 0 if y
    is a lower bound. The slope of y against x, in `unit`, is shown but not judged.
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
    """Return the symbol of a column for texts; its name without the unit if it has none."""
    return _SYMBOLS.get(column) or column.partition(" [")[0]


def unit_of(column: str) -> str:
    """Return the unit in the name of a column, with a space before the unit; empty for a pure number."""
    unit = column.rpartition(" [")[2].removesuffix("]") if column.endswith("]") else "-"
    return "" if unit == "-" else f" {unit}"


def blocks(table: pd.DataFrame, columns: Sequence[str]) -> Sequence[Hashable]:
    """Return the block of each row: its values of some columns; without columns all rows are one block."""
    return list(map(tuple, table[list(columns)].to_numpy().tolist())) if columns else ["all"] * len(table)


def means_by(table: pd.DataFrame, quantity: str, by: str, form: str) -> str:
    """Format means at each value of the column `by` in the format `form`: `0.4: 1.02, 0.7: 1.05`."""
    means = table.groupby(by)[quantity].mean().dropna()
    cells = {value if isinstance(value, str) else f"{value:g}": one for value, one in means.items()}
    return ", ".join(f"{value}: {one:{form}}" for value, one in cells.items()) or "none"
