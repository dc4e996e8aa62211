"""What the rungs of a ladder of accuracy advise, in sentences; the table is that of `measure.work_precision`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import pandas as pd

from postprocess.statistics.columns import SEEDS
from postprocess.statistics.points import told_number
from studies.accuracy.measure import (
    COMPARED,
    COST,
    IS_REFERENCE,
    KNOB,
    NOT_RESOLVED,
    RESOLVED,
    SYMBOLS,
    UNIT,
    UNKNOWN,
    VALUE,
    VERDICT,
)


@dataclass(frozen=True, kw_only=True)
class Advice:
    """What a knob's rungs say.

    Attributes:
        knob: Its name.
        use: The cheapest value whose errors are not resolved, with its unit; the reference where no cheaper one is.
            None where nothing can be said.
        cheaper: Whether it is cheaper than the reference.
        bound: Largest error of φ_0 and φ_f that its seeds do not exclude [%]; NaN where no cheaper one will do.
        sentence: All of it, with its numbers.
    """

    knob: str
    use: str | None = None
    cheaper: bool = False
    bound: float = math.nan
    sentence: str


def advise(rows: pd.DataFrame) -> Advice:
    """What the rungs of one knob say.

    Args:
        rows: Of the knob, from coarse to fine.

    Returns:
        The cheapest rung whose errors are within their bands, or by how much the nearest one is beyond.
    """
    knob = str(rows[KNOB].iloc[0])
    own = rows[rows[VERDICT] == IS_REFERENCE]
    judged = rows[rows[VERDICT].isin([RESOLVED, NOT_RESOLVED])]
    if own.empty or judged.empty:
        return Advice(knob=knob, sentence=f"{knob}: {_why_not(rows)}")
    if own["sensitivity"].iloc[0]:
        return Advice(knob=knob, sentence=f"{knob}: {_sensitivity(judged, label(own.iloc[0]))}")
    found = _cheapest(own.iloc[0], judged)
    # The finest rung of all may be another one, whose runs are not there.
    finest = rows.iloc[-1]
    lacking = "" if finest[VERDICT] == IS_REFERENCE else f" Its finest rung, {label(finest)}, lacks finished runs."
    return replace(found, sentence=f"{knob}: {found.sentence}{lacking}")


def _why_not(rows: pd.DataFrame) -> str:
    """Why nothing can be said of a knob."""
    known = rows[rows[SEEDS] > 0]
    if known.empty:
        return "no run is finished."
    own = known[known[VERDICT] == IS_REFERENCE]
    if own.empty:
        return f"the reference is missing: no run of the scene itself is finished, only of {_listed(known)}."
    name = label(own.iloc[0])
    if (known[VERDICT] == UNKNOWN).any():
        return f"nothing can be resolved against {name}: an error needs two seeds of both; give more --seeds."
    return f"only {name} has finished runs; there is nothing to compare it with."


def _cheapest(reference: pd.Series, judged: pd.DataFrame) -> Advice:
    """The rung to use, in words that follow the knob's name."""
    knob, name = str(reference[KNOB]), label(reference)
    cheap = judged[judged[COST] < reference[COST]].sort_values(COST)
    will_do = cheap[cheap[VERDICT] == NOT_RESOLVED]
    if not will_do.empty:
        row = will_do.iloc[0]
        bounds = _bounds(row)
        told = ", ".join(f"{bound:.1f} % in {SYMBOLS[name]}" for name, bound in bounds.items() if math.isfinite(bound))
        sentence = (
            f"{label(row)} will do at {row[COST]:.3g} s/s, {reference[COST] / row[COST]:.2g} times as fast as {name}: "
            f"its errors ({told_errors(row)}) are not resolved with {row[SEEDS]} seeds; {told} cannot be "
            f"excluded.{_though(judged, row)}"
        )
        bound = max(bounds[name] for name in ("phi_0", "phi_f"))
        return Advice(knob=knob, use=label(row), cheaper=True, bound=bound, sentence=sentence)
    if cheap.empty:
        return Advice(knob=knob, use=name, sentence=f"no rung that can be judged is cheaper than {name}; use it.")
    row = min((row for _, row in cheap.iterrows()), key=lambda row: _excess(row)[0])
    beyond, quantity = _excess(row)
    sentence = (
        f"nothing cheaper than {name} has errors below the scatter between seeds: {label(row)}, the nearest, is off "
        f"by {told_error(row, quantity)} % in {SYMBOLS[quantity]}, {beyond:.2g} % beyond its band."
    )
    return Advice(knob=knob, use=name, sentence=sentence)


def _sensitivity(judged: pd.DataFrame, reference: str) -> str:
    clear = [f"{label(row)} ({told_errors(row)})" for _, row in judged[judged[VERDICT] == RESOLVED].iterrows()]
    rest = _listed(judged[judged[VERDICT] == NOT_RESOLVED])
    parts = [f"resolved: {', '.join(clear)}"] * bool(clear) + [f"not resolved: {rest}"] * bool(rest)
    return f"a matter of what is modelled, not of accuracy; against {reference}, {'; '.join(parts)}."


def _bounds(row: pd.Series) -> dict[str, float]:
    """Largest errors that the seeds do not exclude [%], by key of `COMPARED`."""
    return {name: abs(row[f"{name} error [%]"]) + row[f"{name} error 95 % [%]"] for name in COMPARED}


def _though(judged: pd.DataFrame, row: pd.Series) -> str:
    """What speaks against a rung that will do: finer ones whose errors are resolved."""
    finer = judged.loc[row.name :]
    clear = _listed(finer[finer[VERDICT] == RESOLVED])
    return f" But errors of a finer rung are resolved: {clear}." if clear else ""


def _excess(row: pd.Series) -> tuple[float, str]:
    """By how much the worst error is beyond its band [%], and of what."""
    beyond = {name: abs(row[f"{name} error [%]"]) - row[f"{name} error 95 % [%]"] for name in COMPARED}
    return max((excess, name) for name, excess in beyond.items() if math.isfinite(excess))


def _listed(rows: pd.DataFrame) -> str:
    return ", ".join(label(row) for _, row in rows.iterrows())


def label(row: pd.Series) -> str:
    """Value and unit of a rung."""
    return f"{row[VALUE]} {row[UNIT]}".rstrip()


def told_error(row: pd.Series, name: str) -> str:
    """An error with its band, both in per cent, as far as there are any; `name` is a key of `COMPARED`."""
    return told_number(row[f"{name} error [%]"], "+.1f", row[f"{name} error 95 % [%]"])


def told_errors(row: pd.Series) -> str:
    """All errors of a rung."""
    errors = {name: told_error(row, name) for name in SYMBOLS}
    return ", ".join(f"{SYMBOLS[name]} {error} %" for name, error in errors.items() if error != "-")


def told_closing(advice: Sequence[Advice], table: pd.DataFrame) -> str:
    """What to do: the cheapest rung of each knob whose error is below the scatter between seeds, or that none is.

    Args:
        advice: Of each knob.
        table: See `measure.work_precision`.
    """
    cheap = [f"{one.knob} {one.use} ({one.bound:.1f} %)" for one in advice if one.use is not None and one.cheaper]
    dear = [f"{one.knob} ({one.use})" for one in advice if one.use is not None and not one.cheaper]
    if not cheap and not dear:
        return "Nothing can be recommended yet: no knob of accuracy has two rungs of two finished seeds each."
    parts = []
    if cheap:
        fewest = int(table.loc[table[SEEDS] > 1, SEEDS].min())
        parts.append(
            f"Use {', '.join(cheap)}: each is the cheapest whose errors against the reference are below the scatter of "
            f"{fewest} seeds, and in brackets the largest error of φ that they do not exclude. Not resolved is not "
            "equal: more seeds narrow it."
        )
    if dear:
        parts.append(f"Nothing cheaper than the reference will do for {', '.join(dear)}.")
    return " ".join(parts)
