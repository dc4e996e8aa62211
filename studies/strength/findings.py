"""The paper's findings on tensile loading, judged by piles that are torn between a grip on the floor and a hook.

A seed is poured alike for all procedures, and for both heights of the hook nearly so: what is compared are means over
the heights within a seed, procedure by procedure, so that seeds alone are counted. A pile that held fast has a peak of
at least what it took: of two procedures one is then only said to be above the other where that cannot change it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import pandas as pd

from postprocess.statistics.bounded import above, goes_with
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Finding, Verdict, all_of, judge, negative, told
from postprocess.statistics.pairs import mean_difference, told_less
from postprocess.statistics.seeds import SeedMean, slope_within
from studies.base.procedures import (
    BY_RANKS,
    CROSSINGS,
    EXTERNAL,
    INTERNAL,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    of_procedure,
)
from studies.strength.measure import ABOVE, CARRIED, HELD_FAST, PEAK, PEAK_RAISED, THROUGH, UPPER, WORK

THREE = (EXTERNAL, INTERNAL, SHAPE)
COMPARED = (PEAK, PEAK_RAISED, WORK, THROUGH, CARRIED, ABOVE, CROSSINGS, HELD_FAST)


def findings(runs: pd.DataFrame) -> tuple[Finding, ...]:
    """All findings, judged.

    Args:
        runs: One row per run, see `measure.strength_row`.
    """
    table = over_heights(runs)
    judges: Sequence[Callable[[pd.DataFrame], Finding]] = (
        _shape_change_strongest,
        _internal_weakest,
        _other_order_than_crossings,
        _harder_but_more_brittle,
        _tougher,
    )
    return (*(one(table) for one in judges), _goes_with_crossings(compared(runs)), _over_amplitude(runs))


def over_heights(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per procedure, l/w and seed: means over the heights of the hook, where there are runs at all of them."""
    table, keys, every = compared(runs), [PROCEDURE, ASPECT, SEED], runs[UPPER].nunique()
    grouped = table.groupby(keys)
    means = grouped[list(COMPARED)].mean()
    return means[grouped[UPPER].nunique() == every].reset_index()


def compared(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs of procedures that are compared: of the internal oscillation those of one θ."""
    return pd.concat([of_procedure(runs, name) for name in runs[PROCEDURE].unique()]) if len(runs) else runs


def of(table: pd.DataFrame, procedure: str) -> pd.DataFrame:
    """Rows of one procedure."""
    return table[table[PROCEDURE] == procedure]


def less(table: pd.DataFrame, quantity: str, one: str, other: str) -> SeedMean:
    """One procedure less another, seed by seed."""
    return mean_difference(of(table, one), of(table, other), quantity)


def _above(table: pd.DataFrame, upper: str, lower: str, quantity: str = PEAK) -> Verdict:
    """Whether one procedure is above another in what is a lower bound where a pile held fast."""
    holding = {"upper": bool(_holding(table, upper)), "lower": bool(_holding(table, lower))}
    return above(less(table, quantity, upper, lower), **holding)


def _holding(table: pd.DataFrame, procedure: str) -> bool:
    return bool(of(table, procedure)[HELD_FAST].any())


def _told_less(table: pd.DataFrame, quantity: str, one: str, others: Sequence[str]) -> str:
    return told_less({other: less(table, quantity, one, other) for other in others}, ", ")


def _ranked(table: pd.DataFrame, quantity: str, names: Sequence[str]) -> str:
    """`shape-change 5.1 > internal 4.2`, means over seeds."""
    means = {name: float(of(table, name)[quantity].mean()) for name in names}
    known = sorted((name for name in names if math.isfinite(means[name])), key=lambda name: -means[name])
    return " > ".join(f"{name} {means[name]:.3g}" for name in known) or "none"


def _told_all(table: pd.DataFrame) -> str:
    """Peaks of all procedures in order, and how many held fast."""
    held = int((table[HELD_FAST] > 0).sum())
    return f"{_ranked(table, PEAK, (*THREE, STATIC))}; held fast: {held} of {len(table)} seeds and procedures"


def _shape_change_strongest(table: pd.DataFrame) -> Finding:
    others = (EXTERNAL, INTERNAL)
    return Finding(
        paper="Shape change has the highest peak force of the three procedures",
        ours=f"peak of {SHAPE} {_told_less(table, PEAK, SHAPE, others)}; beside the criterion: "
        f"{_told_less(table, PEAK, SHAPE, (STATIC,))}; {_told_all(table)}",
        verdict=all_of([_above(table, SHAPE, other) for other in others]),
        criterion="peak force above those of external and of internal oscillation, seed by seed, mean over the heights",
    )


def _internal_weakest(table: pd.DataFrame) -> Finding:
    others = (EXTERNAL, SHAPE)
    return Finding(
        paper="Internal oscillation has the least peak force of the three procedures",
        ours=f"peak of {INTERNAL} {_told_less(table, PEAK, INTERNAL, others)}; beside the criterion: "
        f"{_told_less(table, PEAK, INTERNAL, (STATIC,))}",
        verdict=all_of([_above(table, other, INTERNAL) for other in others]),
        criterion="peak force below those of external oscillation and of shape change, seed by seed, mean over the "
        "heights",
    )


def _other_order_than_crossings(table: pd.DataFrame) -> Finding:
    against: list[str] = []
    along: list[str] = []
    unknown = False
    for one, other in itertools.combinations(THREE, 2):
        signs = []
        for quantity in (CROSSINGS, PEAK):
            effect = less(table, quantity, one, other)
            unknown |= math.isnan(effect.value)
            unsure = quantity == PEAK and (_holding(table, one) or _holding(table, other))
            signs.append(0 if unsure else (judge(effect) == "found") - (judge(negative(effect)) == "found"))
        if all(signs):
            (along if signs[0] == signs[1] else against).append(f"{one} and {other}")
    verdict: Verdict = "not resolved"
    if against:
        verdict = "found"
    elif unknown:
        verdict = "no data"
    elif len(along) == len(THREE):
        verdict = "not found"
    return Finding(
        paper="Over the three procedures, peak force and ⟨N⟩ do not keep the same order",
        ours=f"by ⟨N⟩: {_ranked(table, CROSSINGS, THREE)}; by peak: {_ranked(table, PEAK, THREE)}; clearly apart the "
        f"other way round: {', '.join(against) or 'none'}, alike: {', '.join(along) or 'none'}",
        verdict=verdict,
        criterion="two procedures differ clearly in both, in opposite senses; not found if all three pairs differ "
        "clearly in the same sense",
    )


def _harder_but_more_brittle(table: pd.DataFrame) -> Finding:
    harder, brittle = (less(table, quantity, SHAPE, INTERNAL) for quantity in (PEAK, PEAK_RAISED))
    unknown = bool(_holding(table, SHAPE) or _holding(table, INTERNAL))
    return Finding(
        paper="Like a metal cooled fast, a pile after shape change is harder but more brittle than after internal "
        "oscillation",
        ours=f"shape-change less internal: peak {told(harder, 3)}, hook raised at the peak {told(brittle, 3, ' m')}",
        verdict=all_of([_above(table, SHAPE, INTERNAL), above(negative(brittle), upper=unknown, lower=unknown)]),
        criterion="peak force above, and reached at a smaller displacement of the hook, seed by seed; the paper says "
        "that its fracture tests support this, not by which measure",
    )


def _tougher(table: pd.DataFrame) -> Finding:
    others = (EXTERNAL, INTERNAL)
    return Finding(
        paper="(ours, not the paper's) shape change takes the most work to tear",
        ours=f"work of {SHAPE} {_told_less(table, WORK, SHAPE, others)}; {_ranked(table, WORK, (*THREE, STATIC))}; "
        f"through to the grid at the peak {_ranked(table, THROUGH, (*THREE, STATIC))}; carried off "
        f"{_ranked(table, CARRIED, (*THREE, STATIC))}; above the hook {_ranked(table, ABOVE, (*THREE, STATIC))}",
        verdict=all_of([_above(table, SHAPE, other, WORK) for other in others]),
        criterion="∫ F dz over the whole pull above those of external and of internal oscillation, seed by seed, mean "
        "over the heights",
    )


def _goes_with_crossings(runs: pd.DataFrame) -> Finding:
    ours, verdict = _against_crossings(runs)
    return Finding(
        paper="Tensile strength and number of entanglements are connected",
        ours=ours,
        verdict=verdict,
        criterion=f"over all procedures, within runs of one height and seed: {BY_RANKS}",
    )


def _over_amplitude(runs: pd.DataFrame) -> Finding:
    internal = runs[runs[PROCEDURE] == INTERNAL]
    several = internal.groupby([ASPECT, UPPER])[THETA].transform("nunique") > 1
    part = internal[several]
    thetas = " ".join(f"{theta:g}" for theta in sorted(part[THETA].unique()))
    ours, verdict = _against_crossings(part)
    strength, links = (slope_within(part[THETA], part[quantity], _blocks(part)) for quantity in (PEAK, CROSSINGS))
    beside = f"against θ: peak {told(strength, 3, ' per degree')}, ⟨N⟩ {told(links, 3, ' per degree')}"
    return Finding(
        paper="Internal oscillation: over θ, the peak force goes with ⟨N⟩",
        ours=f"{ours}, θ = {thetas}°; beside the criterion: {beside}" if thetas else "no data",
        verdict=verdict,
        criterion=f"over θ, within runs of one height and seed: {BY_RANKS}",
    )


def _blocks(part: pd.DataFrame) -> list[str]:
    """Height, l/w and seed of each run: what begins with one pile."""
    return [f"{upper} {aspect} {seed}" for upper, aspect, seed in part[[UPPER, ASPECT, SEED]].to_numpy()]


def _against_crossings(part: pd.DataFrame) -> tuple[str, Verdict]:
    crossings, peaks, held = part[CROSSINGS], part[PEAK], part[HELD_FAST]
    return goes_with(crossings, peaks, held, _blocks(part), unit="n W_s per link", called="peaks")
