"""The paper's findings on ⟨N⟩, the mean number of entanglements; see `studies.procedures.findings`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Finding, Verdict, all_of, judge, negative, told
from postprocess.statistics.seeds import CONFIDENCE, difference, mean_over_seeds, parabola
from studies.base.procedures import CROSSINGS, EXTERNAL, INTERNAL, PROCEDURE, SHAPE, STATIC, THETA, of_procedure
from studies.procedures.effects import against_amplitude, against_aspect, by_aspect, compared, with_aspect

FLAT = 0.2
"""⟨N⟩ is flat if it changes by less than this share of its mean over the aspect ratios [-]."""

NEAR = 0.15
"""How far from l/w = 1.0 a maximum is still near it [-]: one and a half steps of the paper's l/w."""


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
    return with_aspect("⟨N⟩ of shape change rises with l/w", part, CROSSINGS, "⟨N⟩", sign=1, form=".2f")


def _greatest_near_one(table: pd.DataFrame, procedure: str) -> Finding:
    part = of_procedure(table, procedure).dropna(subset=[CROSSINGS])
    before, after = (parabola(part[ASPECT], part[CROSSINGS], at=place) for place in (1 - NEAR, 1 + NEAR))
    beyond = bool((part[ASPECT] > 1.0).any())
    if beyond and not before.fits < 1 - CONFIDENCE:
        verdict = all_of([judge(before.slope), judge(negative(after.slope))])
        ours = f"slope of ⟨N⟩ at l/w = {1 - NEAR:g} {told(before.slope, 3)}, at {1 + NEAR:g} {told(after.slope, 3)}"
        ours += f", highest at {before.top:.2f}" if before.bend.value < 0 else ""
    else:
        ours, verdict = _greatest_of_means(part)
    ours += f"; by l/w {by_aspect(part, CROSSINGS, '.2f')}"
    return Finding(
        paper=f"⟨N⟩ of {procedure} oscillation is greatest near l/w = 1.0",
        ours=ours if beyond else f"{ours}; nothing beyond 1 was run, so a fall there is not tested",
        verdict=verdict,
        criterion=f"the parabola through all runs still rises at l/w = {1 - NEAR:g} and falls at {1 + NEAR:g}, so that "
        "of the paper's l/w 0.9, 1.0 or 1.1 is the nearest to its maximum; where none describes the means at 95 %, or "
        "nothing beyond 1.0 was run: slope of ⟨N⟩ up to l/w = 1.0 > 0, and no other mean above that at 1.0",
    )


def _greatest_of_means(part: pd.DataFrame) -> tuple[str, Verdict]:
    means = {float(aspect): mean_over_seeds(group[CROSSINGS]) for aspect, group in part.groupby(ASPECT)}
    near = min(means, key=lambda aspect: abs(aspect - 1), default=math.nan)
    if len(means) < 2 or abs(near - 1) > 0.1:
        return "no slope", "no data"
    slope = against_aspect(part[part[ASPECT] <= near], CROSSINGS)
    others = [difference(mean, means[near]) for aspect, mean in means.items() if aspect != near]
    verdict = judge(slope)
    if any(other.value > other.half_width for other in others):
        verdict = "not found"
    elif verdict == "found" and any(other.value > 0 for other in others):
        verdict = "not resolved"
    return f"⟨N⟩ against l/w up to {near:g} {told(slope, 3)}", verdict


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


JUDGES: Sequence[Callable[[pd.DataFrame], Finding]] = (
    _static_least_entangled,
    _static_flat,
    _shape_change_most_entangled,
    _shape_change_rises,
    lambda table: _greatest_near_one(table, EXTERNAL),
    lambda table: _greatest_near_one(table, INTERNAL),
    _falls_with_amplitude,
    _peaks_with_amplitude,
)
"""In the paper's order."""
