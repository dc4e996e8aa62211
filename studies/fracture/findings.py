"""The paper's findings on tensile loading, section "Tensile loading and fracture", each judged by our own runs.

Runs of one l/w and seed were poured alike, so they are compared seed by seed, and slopes are taken within seeds. The
paper's text claims nothing of how the force depends on l/w or on θ by itself: of these there are figures and means.

A pile that holds fast, so that the hook stops at its limit, has a peak of at least that, at a place that is not known:
of two procedures one is then only said to be above the other where what is unknown cannot change that, and of places
nothing is said.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Hashable, Sequence

import numpy as np
import pandas as pd

from postprocess.statistics.bounded import above, goes_with
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Finding, Verdict, all_of, judge, negative, told
from postprocess.statistics.pairs import told_less
from studies.fracture.measure import HELD_FAST, NET, PEAK, PEAK_RAISED
from studies.framework.procedures import (
    AMPLITUDE,
    BY_RANKS,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    of_procedure,
    paired,
)

SHOWN_ASPECT = 0.7
"""Aspect ratio at which procedures and amplitudes are compared, as in the paper [-]."""


def findings(table: pd.DataFrame) -> tuple[Finding, ...]:
    """All findings, judged.

    Args:
        table: One row per run, see `measure.fracture_row`.
    """
    judges: Sequence[Callable[[pd.DataFrame], Finding]] = (
        _shape_change_strongest,
        _internal_weakest,
        _other_order_than_crossings,
        _goes_with_crossings_over_amplitude,
        _goes_with_crossings,
        _harder_but_more_brittle,
    )
    return tuple(finding(table) for finding in judges)


def at_shown_aspect(table: pd.DataFrame) -> pd.DataFrame:
    """Runs at the aspect ratio of the comparison of procedures."""
    return table[np.isclose(table[ASPECT], SHOWN_ASPECT)]


def _told_less(table: pd.DataFrame, quantity: str, one: str, others: Sequence[str]) -> str:
    """By how much one procedure is above others, seed by seed."""
    return told_less({other: paired(table, quantity, one, other) for other in others}, ", ")


def _above(table: pd.DataFrame, upper: str, lower: str) -> Verdict:
    """Whether the peaks of one procedure are above those of another, which are lower bounds where a pile held fast."""
    holding = {"upper": bool(_holding(table, upper)), "lower": bool(_holding(table, lower))}
    return above(paired(table, PEAK, upper, lower), **holding)


def _holding(table: pd.DataFrame, procedure: str) -> int:
    """How many piles of a procedure held fast."""
    return int(of_procedure(table, procedure)[HELD_FAST].sum())


def _told_holding(part: pd.DataFrame) -> str:
    """`held fast: static 1 of 3, …`."""
    rows = {name: of_procedure(part, name) for name in (STATIC, EXTERNAL, SHAPE, INTERNAL)}
    told_rows = [f"{name} {_holding(part, name)} of {len(found)}" for name, found in rows.items() if len(found)]
    return f"held fast: {', '.join(told_rows) or 'no data'}"


def _told_against(part: pd.DataFrame, one: str, others: Sequence[str]) -> str:
    """How the peak of one procedure compares with those of others."""
    static = told(paired(part, PEAK, one, STATIC), 3)
    return (
        f"peak of {one} {_told_less(part, PEAK, one, others)}; beside the criterion: less static {static}; "
        f"peak less the lower hook's force {_told_less(part, NET, one, (*others, STATIC))}"
    )


def _shape_change_strongest(table: pd.DataFrame) -> Finding:
    part, others = at_shown_aspect(table), (EXTERNAL, INTERNAL)
    return Finding(
        paper=f"Shape change has the highest peak force of the three procedures, l/w = {SHOWN_ASPECT:g}",
        ours=f"{_told_against(part, SHAPE, others)}; {_told_holding(part)}",
        verdict=all_of([_above(part, SHAPE, other) for other in others]),
        criterion=f"peak force above those of external and of internal oscillation at θ = {AMPLITUDE:g}°, seed by seed",
    )


def _internal_weakest(table: pd.DataFrame) -> Finding:
    part, others = at_shown_aspect(table), (EXTERNAL, SHAPE)
    return Finding(
        paper=f"Internal oscillation has the least peak force of the three procedures, l/w = {SHOWN_ASPECT:g}",
        ours=_told_against(part, INTERNAL, others),
        verdict=all_of([_above(part, other, INTERNAL) for other in others]),
        criterion=f"peak force at θ = {AMPLITUDE:g}° below that of external oscillation and of shape change, by seed",
    )


def _other_order_than_crossings(table: pd.DataFrame) -> Finding:
    part, names = at_shown_aspect(table), (EXTERNAL, INTERNAL, SHAPE)
    against: list[str] = []
    along: list[str] = []
    unknown = False
    for one, other in itertools.combinations(names, 2):
        signs = []
        for quantity in (CROSSINGS, PEAK):
            effect = paired(part, quantity, one, other)
            unknown |= math.isnan(effect.value)
            above, below = judge(effect) == "found", judge(negative(effect)) == "found"
            unsure = quantity == PEAK and (_holding(part, one) or _holding(part, other))
            signs.append(0 if unsure else above - below)
        if all(signs):
            (along if signs[0] == signs[1] else against).append(f"{one} and {other}")
    verdict: Verdict = "not resolved"
    if against:
        verdict = "found"
    elif unknown:
        verdict = "no data"
    elif len(along) == len(names):
        verdict = "not found"
    ours = "; ".join(
        f"by {name}: {_ranked(part, quantity, names)}" for name, quantity in (("⟨N⟩", CROSSINGS), ("peak", PEAK))
    )
    ours += f"; clearly apart the other way round: {', '.join(against) or 'none'}, alike: {', '.join(along) or 'none'}"
    return Finding(
        paper="Over the three procedures, peak force and ⟨N⟩ do not keep the same order",
        ours=ours,
        verdict=verdict,
        criterion="two procedures differ clearly in both, in opposite senses; not found if all three pairs differ "
        "clearly in the same sense",
    )


def _ranked(part: pd.DataFrame, quantity: str, names: Sequence[str]) -> str:
    """`shape-change 5.1 > internal 4.2`, means over seeds."""
    means = {name: float(of_procedure(part, name)[quantity].mean()) for name in names}
    known = sorted((name for name in names if math.isfinite(means[name])), key=lambda name: -means[name])
    return " > ".join(f"{name} {means[name]:.3g}" for name in known) or "none"


def _goes_with_crossings_over_amplitude(table: pd.DataFrame) -> Finding:
    part = at_shown_aspect(table[table[PROCEDURE] == INTERNAL])
    thetas = " ".join(f"{theta:g}" for theta in sorted(part[THETA].unique()))
    ours, verdict = _against_crossings(part, part[SEED].tolist())
    return Finding(
        paper="Internal oscillation: over θ, the peak force goes with ⟨N⟩",
        ours=f"{ours}, θ = {thetas}°, l/w = {SHOWN_ASPECT:g}" if thetas else "no data",
        verdict=verdict,
        criterion=f"over θ within seeds, l/w = {SHOWN_ASPECT:g}: {BY_RANKS}",
    )


def _goes_with_crossings(table: pd.DataFrame) -> Finding:
    blocks = list(zip(table[ASPECT], table[SEED], strict=True))
    ours, verdict = _against_crossings(table, blocks)
    internal = table[table[PROCEDURE] == INTERNAL]
    beside, _ = _against_crossings(internal, internal[SEED].tolist())
    return Finding(
        paper="Tensile strength and number of entanglements are connected",
        ours=f"all runs: {ours}; beside the criterion: internal over θ and l/w: {beside}",
        verdict=verdict,
        criterion=f"over all procedures and θ, within runs of one l/w and seed: {BY_RANKS}",
    )


def _against_crossings(part: pd.DataFrame, blocks: Sequence[Hashable]) -> tuple[str, Verdict]:
    crossings, peaks, held = part[CROSSINGS], part[PEAK], part[HELD_FAST]
    return goes_with(crossings, peaks, held, blocks, unit="n W_s per link", called="peaks")


def _harder_but_more_brittle(table: pd.DataFrame) -> Finding:
    part = at_shown_aspect(table)
    harder, brittle = (paired(part, quantity, SHAPE, INTERNAL) for quantity in (PEAK, PEAK_RAISED))
    unknown = bool(_holding(part, SHAPE) or _holding(part, INTERNAL))
    return Finding(
        paper="Like a metal cooled fast, a pile after shape change is harder but more brittle than after internal "
        "oscillation",
        ours=f"shape-change less internal: peak {told(harder, 3)}, hook raised at the peak {told(brittle, 3, ' m')}",
        verdict=all_of([_above(part, SHAPE, INTERNAL), above(negative(brittle), upper=unknown, lower=unknown)]),
        criterion="peak force above, and reached at a smaller displacement of the hook, seed by seed; the paper says "
        "that its fracture tests support this, not by which measure",
    )
