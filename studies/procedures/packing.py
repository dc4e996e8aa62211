"""The paper's findings on height and packing fraction; see `studies.procedures.findings`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Finding, judge, negative, told
from postprocess.statistics.seeds import mean_over_seeds, parabola
from studies.base.activity import HALF, HEIGHT, LOWEST, PHI_ACTIVE, STRAIGHT
from studies.base.procedures import (
    AMPLITUDE,
    EXTERNAL,
    INTERNAL,
    PHI,
    PROCEDURE,
    SHAPE,
    STATIC,
    THETA,
    of_procedure,
    paired,
)
from studies.procedures.effects import (
    against_amplitude,
    by_aspect,
    compared,
    gains,
    mean_above_zero,
    with_aspect,
)

EARLY = 0.24
"""Half of the compaction is early up to this share of the activity: twice the paper's 12 % [-]."""

MARGINAL = 0.5
"""A gain in φ is marginal below this share of that at θ = 10° [-]."""


def _poured_falls(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, STATIC)
    return with_aspect("φ_0 of the poured pile falls with l/w", part, PHI, "φ_0", sign=-1, form=".4f")


def _shaken_falls(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, EXTERNAL)
    return with_aspect("External oscillation: φ_f falls with l/w", part, PHI_ACTIVE, "φ_f", sign=-1, form=".4f")


def _shaken_bends(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, EXTERNAL).dropna(subset=[PHI_ACTIVE])
    bend = parabola(part[ASPECT], part[PHI_ACTIVE], at=1.0).bend
    return Finding(
        paper="External oscillation: φ changes with l/w faster than linearly",
        ours=f"bend of φ_f against l/w, of the parabola through all runs, {told(bend, 3)}",
        verdict=judge(bend),
        criterion="φ_f against l/w is convex: bend > 0, that is a fall that is steeper at small l/w",
    )


def _shaken_compacts(table: pd.DataFrame) -> Finding:
    gained = gains(table, EXTERNAL, PHI_ACTIVE)
    return mean_above_zero("External oscillation makes the pile denser", gained[PHI_ACTIVE], "φ_f − φ_0")


def _rises(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, SHAPE)
    effect = mean_over_seeds(part[STRAIGHT] - 1)
    return Finding(
        paper="Shape change: the centre of mass rises when the smarticles straighten",
        ours=f"h/h0 − 1 while straight {told(effect, 3)}; h/h0 by l/w {by_aspect(part, STRAIGHT, '.3f')}",
        verdict=judge(effect),
        criterion="h/h0 − 1 at the end of the straight state > 0, mean over runs",
    )


def _stays_up(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, SHAPE)
    effect = mean_over_seeds(part[HEIGHT] - 1)
    return Finding(
        paper="Shape change: the centre of mass does not come back to h0",
        ours=f"h/h0 − 1 at rest again {told(effect, 3)}; h/h0 by l/w {by_aspect(part, HEIGHT, '.3f')}",
        verdict=judge(effect),
        criterion="h/h0 − 1 at rest after the shape change > 0, mean over runs",
    )


def _internal_densest(table: pd.DataFrame) -> Finding:
    ours, verdict = compared(table, PHI_ACTIVE, INTERNAL, (STATIC, EXTERNAL, SHAPE), 1)
    rest = told(paired(table, PHI, INTERNAL, EXTERNAL), 3)
    return Finding(
        paper="Internal oscillation packs densest",
        ours=f"φ_f of internal {ours}; beside the criterion: less external, both at rest again, {rest}",
        verdict=verdict,
        criterion=f"φ_f at θ = {AMPLITUDE:g}°, at the end of the activity as in the paper, above that of each other "
        "procedure, paired by l/w and seed",
    )


def _shape_change_loosest(table: pd.DataFrame) -> Finding:
    ours, verdict = compared(table, PHI_ACTIVE, SHAPE, (EXTERNAL, INTERNAL), -1)
    static = told(paired(table, PHI_ACTIVE, SHAPE, STATIC), 3)
    return Finding(
        paper="Of the three activities shape change packs least densely",
        ours=f"φ_f of shape-change {ours}; beside the criterion: less static {static}",
        verdict=verdict,
        criterion="φ_f at the end of the activity below those of external and internal oscillation, paired by l/w and "
        "seed",
    )


def _compacts_early(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, INTERNAL)
    drop, share = mean_over_seeds(1 - part[HEIGHT]), mean_over_seeds(part[HALF])
    early = judge(negative(share), threshold=-EARLY)
    # Half of nothing is reached at any time: there must be a compaction to speak of.
    compacted = judge(drop)
    after = told(share, 3).lstrip("+")
    return Finding(
        paper="Internal oscillation: half of the compaction is reached after about 12 % of the activity",
        ours=f"half is reached after {after} of the activity; in all h comes down by {told(drop, 3)} of h0",
        verdict=compacted if compacted != "found" else early,
        criterion=f"the centre of mass comes down, by half of it within {EARLY:g} of the activity, twice the paper's "
        "0.12 (a steady descent would take 0.5)",
    )


def _tighter_at_low_amplitude(table: pd.DataFrame) -> Finding:
    slope = against_amplitude(table[table[PROCEDURE] == INTERNAL], PHI_ACTIVE)
    return Finding(
        paper="Internal oscillation: lower θ packs tighter",
        ours=f"φ_f against θ {told(slope, 3, ' per degree')}",
        verdict=judge(negative(slope)),
        criterion="slope of φ_f against θ < 0, within runs of the same l/w and seed",
    )


def _sinks_while_closing(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, SHAPE)
    return mean_above_zero(
        "Shape change: the pile sinks at first when the barbs close",
        part[STRAIGHT] - part[LOWEST],
        "h/h0 while straight less the lowest while closing",
    )


def _rises_after_the_drop(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, SHAPE)
    return mean_above_zero(
        "Shape change: after that drop the pile grows upwards again",
        part[HEIGHT] - part[LOWEST],
        "h/h0 at rest again less the lowest while closing",
    )


def _shape_change_falls(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, SHAPE)
    return with_aspect("Shape change: φ_f falls with l/w", part, PHI_ACTIVE, "φ_f", sign=-1, form=".4f")


def _internal_falls(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, INTERNAL)
    return with_aspect("Internal oscillation: φ_f falls with l/w", part, PHI_ACTIVE, "φ_f", sign=-1, form=".4f")


def _internal_gains_more(table: pd.DataFrame) -> Finding:
    gained = gains(table, INTERNAL, PHI_ACTIVE)
    paper = "Internal oscillation: Δφ = φ_f − φ_0 grows with l/w"
    return with_aspect(paper, gained, PHI_ACTIVE, "Δφ", sign=1, form=".4f")


def _internal_sinks(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, INTERNAL)
    return mean_above_zero(
        "Internal oscillation: the pile becomes lower than it was poured", 1 - part[HEIGHT], "1 − h/h0 at rest again"
    )


def _largest_amplitude_gains_little(table: pd.DataFrame) -> Finding:
    shares = []
    for (aspect, seed), group in table[table[PROCEDURE] == INTERNAL].groupby([ASPECT, SEED]):
        poured = table[(table[PROCEDURE] == STATIC) & (table[ASPECT] == aspect) & (table[SEED] == seed)]
        gained = group.set_index(THETA)[PHI_ACTIVE] - float(poured[PHI_ACTIVE].mean())
        if {AMPLITUDE, 30.0} <= set(gained.index):
            shares.append(float(gained[30.0] / gained[AMPLITUDE]))
    share = mean_over_seeds(shares)
    return Finding(
        paper="Internal oscillation: the largest amplitude packs only marginally denser than static",
        ours=f"Δφ at 30° over that at {AMPLITUDE:g}° {told(share, 3).lstrip('+')}",
        verdict=judge(negative(share), threshold=-MARGINAL),
        criterion=f"below {MARGINAL:g}, within runs of the same l/w and seed",
    )


JUDGES: Sequence[Callable[[pd.DataFrame], Finding]] = (
    _poured_falls,
    _shaken_falls,
    _shaken_bends,
    _shaken_compacts,
    _rises,
    _sinks_while_closing,
    _stays_up,
    _rises_after_the_drop,
    _shape_change_falls,
    _internal_sinks,
    _compacts_early,
    _internal_falls,
    _internal_gains_more,
    _tighter_at_low_amplitude,
    _largest_amplitude_gains_little,
    _internal_densest,
    _shape_change_loosest,
)
"""In the paper's order."""
