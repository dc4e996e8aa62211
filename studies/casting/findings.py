"""What Savoie et al. say of casting smarticles in tiers, each statement judged by our own runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pandas as pd

from postprocess.statistics.findings import Finding, all_of, judge, negative, told
from postprocess.statistics.seeds import mean_over_seeds
from studies.base.release import by_procedure, compared_with, of, paired
from studies.casting.measure import (
    FILLED,
    HEIGHT,
    IN_MOULD,
    KEPT,
    LIKENESS,
    LIKENESS_BEFORE,
    NECK,
    OVERLAP,
    TIERS,
    WHOLE,
    WHOLE_KEPT,
)
from studies.framework.procedures import INTERNAL, SHAPE, STATIC

FULL = 0.7
"""A tier is filled if the pile has more than this share of its volume [-].

Of a plain cylinder of r = 1.2 w, a pour has 0.74 ± 0.02 by this measure (three seeds, up to 3/4 of its height): the
ball dips in between smarticles at the wall."""


def findings(runs: pd.DataFrame) -> tuple[Finding, ...]:
    """All findings, judged.

    Args:
        runs: Rows of `measure.casting_row`.
    """
    judges: Sequence[Callable[[pd.DataFrame], Finding]] = (
        _pour_fills,
        _internal_fills,
        _shape_change_fills_less,
        _internal_falls_apart,
        _shape_change_keeps,
        _internal_looks_like_the_mould,
    )
    return tuple(one(runs) for one in judges)


def _pour_fills(runs: pd.DataFrame) -> Finding:
    part = of(runs, STATIC)
    effects = {tier: mean_over_seeds(part[FILLED[tier]]) for tier in TIERS}
    ours = ", ".join(f"{tier} {told(effect, 2).lstrip('+')}" for tier, effect in effects.items())
    return Finding(
        paper="The mould is filled by pouring (shown in a picture)",
        ours=f"filled as poured: {ours}; material left in the neck {by_procedure(part, NECK)}",
        verdict=all_of([judge(effect, threshold=FULL) for effect in effects.values()]),
        criterion=f"more than {FULL:g} of each tier is inside the pile as poured",
    )


def _internal_fills(runs: pd.DataFrame) -> Finding:
    # A pile that packs denser sinks, and leaves the upper tier; the lower one is where it has enough to fill with.
    ours, verdict = compared_with(runs, FILLED["lower"], INTERNAL, (STATIC, SHAPE), 1)
    return Finding(
        paper="Internal oscillation fills the mould more completely, like a fluid",
        ours=f"filled share of the lower tier, internal {ours}; {by_procedure(runs, FILLED['lower'])}; of the whole "
        f"mould {by_procedure(runs, WHOLE)}",
        verdict=verdict,
        criterion="the filled share of the lower tier above that of static and of shape change, paired by seed",
    )


def _shape_change_fills_less(runs: pd.DataFrame) -> Finding:
    less, height = paired(runs, FILLED["lower"], SHAPE, INTERNAL), paired(runs, HEIGHT, SHAPE, INTERNAL)
    return Finding(
        paper="Shape change grows inward and upward rather than outward: it does not fill the mould",
        ours=f"less internal: filled share of the lower tier {told(less, 3)}, height of 95 % {told(height, 3, ' m')}; "
        f"beside the criterion, less static: filled {told(paired(runs, FILLED['lower'], SHAPE, STATIC), 3)}, height "
        f"{told(paired(runs, HEIGHT, SHAPE, STATIC), 3, ' m')}",
        verdict=all_of([judge(negative(less)), judge(height)]),
        criterion="filled share of the lower tier below and height above those of internal oscillation, paired by seed",
    )


def _internal_falls_apart(runs: pd.DataFrame) -> Finding:
    part = of(runs, INTERNAL)
    effect = mean_over_seeds(1 - part[WHOLE_KEPT])
    tiers = ", ".join(f"{tier} {told(mean_over_seeds(part[KEPT[tier]]), 2).lstrip('+')}" for tier in TIERS)
    return Finding(
        paper="Internal oscillation: without the walls the overhangs fall apart",
        ours=f"lost of what was filled {told(effect, 3)}; kept by tier: {tiers}",
        verdict=judge(effect, threshold=0.05),
        criterion="more than 0.05 of the filled volume of the mould is lost in 1 s",
    )


def _shape_change_keeps(runs: pd.DataFrame) -> Finding:
    ours, verdict = compared_with(runs, OVERLAP, SHAPE, (INTERNAL,), 1)
    return Finding(
        paper="Shape change keeps its shape better, as a hardened structure",
        ours=f"overlap before and after, shape-change {ours}; {by_procedure(runs, OVERLAP)}; kept of what was filled "
        f"{by_procedure(runs, WHOLE_KEPT)}",
        verdict=verdict,
        criterion="overlap of the pile before and after above that of internal oscillation, paired by seed",
    )


def _internal_looks_like_the_mould(runs: pd.DataFrame) -> Finding:
    ours, verdict = compared_with(runs, LIKENESS_BEFORE, INTERNAL, (SHAPE,), 1)
    return Finding(
        paper="Internal oscillation sculpts to the mould more easily than shape change",
        ours=f"likeness to the mould before, internal {ours}; {by_procedure(runs, LIKENESS_BEFORE)}; after "
        f"{by_procedure(runs, LIKENESS)}; material in the mould after {by_procedure(runs, IN_MOULD)}",
        verdict=verdict,
        criterion="likeness of pile and mould in the instant before the walls go above that of shape change, paired "
        "by seed",
    )
