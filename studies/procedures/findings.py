"""The paper's findings on its procedures, each judged by our own runs.

A finding is a difference, a slope or a ratio with a 95 % confidence interval by Student's t. Runs of the same
aspect ratio and seed begin with the same pile, so they are compared pair by pair, and slopes against θ are
taken within them; the scatter over seeds and aspect ratios is what makes the error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Finding, Verdict, all_of, judge, negative, told
from postprocess.statistics.seeds import difference, mean_over_seeds
from studies.base.activity import ENERGY, HALF, HEIGHT, PHI_ACTIVE, STRAIGHT
from studies.base.procedures import (
    AMPLITUDE,
    CROSSINGS,
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
from studies.procedures.effects import against_amplitude, against_aspect, by_aspect, compared, pairs_of

FLAT = 0.2
"""⟨N⟩ is flat if it changes by less than this share of its mean over the aspect ratios [-]."""

EARLY = 0.24
"""Half of the compaction is early up to this share of the activity: twice the paper's 12 % [-]."""

ENERGY_FACTOR = 10.0
"""How many times the energy of the internal oscillation the shape change costs at least [-]."""


def findings(table: pd.DataFrame) -> tuple[Finding, ...]:
    """All findings, judged.

    Args:
        table: See `activity.samples`.
    """
    judges: Sequence[Callable[[pd.DataFrame], Finding]] = (
        _rises,
        _stays_up,
        _internal_densest,
        _shape_change_loosest,
        _compacts_early,
        _tighter_at_low_amplitude,
        _shape_change_costs,
        _energy_grows_with_amplitude,
        _energy_grows_with_aspect,
        _static_least_entangled,
        _static_flat,
        _shape_change_most_entangled,
        _shape_change_rises,
        lambda table: _greatest_near_one(table, EXTERNAL),
        lambda table: _greatest_near_one(table, INTERNAL),
        _falls_with_amplitude,
        _peaks_with_amplitude,
    )
    return tuple(finding(table) for finding in judges)


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


def _shape_change_costs(table: pd.DataFrame) -> Finding:
    both = pairs_of(table, ENERGY, SHAPE, INTERNAL)
    both = both[(both["one"] > 0) & (both["other"] > 0)]
    ratio = np.log10(both["one"] / both["other"])
    effect = mean_over_seeds(ratio)
    ours = "no data"
    if effect.count:
        means = (10 ** ratio.groupby(both[ASPECT]).mean()).items()
        spread = effect.standard_error
        error = f" ×/÷ {10**spread:.3g}" if math.isfinite(spread) else " without an error"
        ours = f"ratio {10**effect.value:.3g}{error} (n = {effect.count}, geometric mean and standard error); by l/w "
        ours += ", ".join(f"{aspect:g}: {value:.3g}" for aspect, value in means)
    return Finding(
        paper="Shape change costs more than 10 times the energy of internal oscillation",
        ours=ours,
        verdict=judge(effect, threshold=math.log10(ENERGY_FACTOR)),
        criterion=f"geometric mean of the ratio > {ENERGY_FACTOR:g}, paired by l/w and seed, θ = {AMPLITUDE:g}°",
    )


def _energy_grows_with_amplitude(table: pd.DataFrame) -> Finding:
    slope = against_amplitude(table[table[PROCEDURE] == INTERNAL], ENERGY)
    return Finding(
        paper="Internal oscillation: energy grows with θ",
        ours=f"energy per smarticle against θ {told(slope, 3, ' J per degree')}",
        verdict=judge(slope),
        criterion="slope of the energy against θ > 0, within runs of the same l/w and seed",
    )


def _energy_grows_with_aspect(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, INTERNAL)
    slope = against_aspect(part, ENERGY)
    return Finding(
        paper="Internal oscillation: energy grows with l/w",
        ours=f"energy per smarticle against l/w {told(slope, 3, ' J')}; by l/w {by_aspect(part, ENERGY, '.3g')} J",
        verdict=judge(slope),
        criterion=f"slope of the energy against l/w > 0, θ = {AMPLITUDE:g}°",
    )


def _static_least_entangled(table: pd.DataFrame) -> Finding:
    ours, verdict = compared(table, CROSSINGS, STATIC, (EXTERNAL, INTERNAL, SHAPE), -1)
    return Finding(
        paper="⟨N⟩ is lowest for static",
        ours=f"⟨N⟩ of static {ours}",
        verdict=verdict,
        criterion="⟨N⟩ below that of each activity, paired by l/w and seed",
    )


def _static_flat(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, STATIC)
    slope, mean = against_aspect(part, CROSSINGS), float(part[CROSSINGS].mean())
    scale = float(np.ptp(part[ASPECT])) / mean if len(part) and mean else math.nan
    change, half_width = scale * slope.value, scale * slope.half_width
    verdict: Verdict = "not resolved"
    if math.isnan(change):
        verdict = "no data"
    elif abs(change) + half_width <= FLAT:
        verdict = "found"
    elif abs(change) - half_width > FLAT:
        verdict = "not found"
    ours = f"⟨N⟩ against l/w {told(slope, 3)}"
    if math.isfinite(change):
        ours += f", from end to end {100 * change:+.0f} % of the mean"
    return Finding(
        paper="⟨N⟩ of static hardly depends on l/w",
        ours=f"{ours}; by l/w {by_aspect(part, CROSSINGS, '.2f')}",
        verdict=verdict,
        criterion=f"the straight line through all runs changes by less than {FLAT:.0%} of the mean, at 95 %",
    )


def _shape_change_most_entangled(table: pd.DataFrame) -> Finding:
    ours, verdict = compared(table, CROSSINGS, SHAPE, (STATIC, EXTERNAL, INTERNAL), 1)
    return Finding(
        paper="⟨N⟩ is highest for shape change",
        ours=f"⟨N⟩ of shape-change {ours}",
        verdict=verdict,
        criterion="⟨N⟩ above that of each other procedure, paired by l/w and seed",
    )


def _shape_change_rises(table: pd.DataFrame) -> Finding:
    part = of_procedure(table, SHAPE)
    slope = against_aspect(part, CROSSINGS)
    return Finding(
        paper="⟨N⟩ of shape change rises with l/w",
        ours=f"⟨N⟩ against l/w {told(slope, 3)}; by l/w {by_aspect(part, CROSSINGS, '.2f')}",
        verdict=judge(slope),
        criterion="slope of ⟨N⟩ against l/w > 0",
    )


def _greatest_near_one(table: pd.DataFrame, procedure: str) -> Finding:
    part = of_procedure(table, procedure).dropna(subset=[CROSSINGS])
    means = {float(aspect): mean_over_seeds(group[CROSSINGS]) for aspect, group in part.groupby(ASPECT)}
    near = min(means, key=lambda aspect: abs(aspect - 1), default=math.nan)
    verdict: Verdict = "no data"
    ours = f"by l/w {by_aspect(part, CROSSINGS, '.2f')}"
    if len(means) > 1 and abs(near - 1) < 0.1:
        slope = against_aspect(part[part[ASPECT] <= near], CROSSINGS)
        others = [difference(mean, means[near]) for aspect, mean in means.items() if aspect != near]
        verdict = judge(slope)
        if any(other.value > other.half_width for other in others):
            verdict = "not found"
        elif verdict == "found" and any(other.value > 0 for other in others):
            verdict = "not resolved"
        ours = f"⟨N⟩ against l/w up to {near:g} {told(slope, 3)}; {ours}"
        ours += "" if max(means) > near else f"; nothing beyond {near:g} was run, so a fall there is not tested"
    return Finding(
        paper=f"⟨N⟩ of {procedure} oscillation is greatest near l/w = 1.0",
        ours=ours,
        verdict=verdict,
        criterion="slope of ⟨N⟩ up to l/w = 1.0 > 0, and no other mean above that at 1.0",
    )


def _falls_with_amplitude(table: pd.DataFrame) -> Finding:
    part = table[(table[PROCEDURE] == INTERNAL) & (table[ASPECT] < 0.51)]
    slope = against_amplitude(part, CROSSINGS)
    return Finding(
        paper="Internal oscillation: ⟨N⟩ falls with θ at l/w = 0.4 to 0.5",
        ours=f"⟨N⟩ against θ {told(slope, 3, ' per degree')}",
        verdict=judge(negative(slope)),
        criterion="slope of ⟨N⟩ against θ < 0, within runs of the same l/w and seed",
    )


def _peaks_with_amplitude(table: pd.DataFrame) -> Finding:
    part = table[(table[PROCEDURE] == INTERNAL) & (table[ASPECT] > 0.51)]
    gains, losses = [], []
    for _, group in part.groupby([ASPECT, SEED]):
        value, theta = group[CROSSINGS], group[THETA]
        peak = value[(theta > 9) & (theta < 16)].mean()
        gains.append(float(peak - value[theta < 6].mean()))
        losses.append(float(peak - value[theta > 16].mean()))
    gain, loss = mean_over_seeds(gains), mean_over_seeds(losses)
    return Finding(
        paper="Internal oscillation: ⟨N⟩ peaks at θ = 10° to 15° at larger l/w",
        ours=f"⟨N⟩ at 10° to 15° less that at 5° {told(gain, 3)}, less that at 20° to 30° {told(loss, 3)}",
        verdict=all_of([judge(gain), judge(loss)]),
        criterion="both differences > 0, within runs of the same l/w and seed, l/w > 0.5",
    )
