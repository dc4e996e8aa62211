"""The paper's findings on energy, integrated and as a sum over moments far apart; see `studies.procedures.findings`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from postprocess.measures.motors import APART
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Finding, all_of, judge, negative, told
from postprocess.statistics.pairs import told_less
from postprocess.statistics.seeds import mean_over_seeds
from studies.base.activity import ENERGY, SAMPLED
from studies.base.procedures import AMPLITUDE, EXTERNAL, INTERNAL, PROCEDURE, SHAPE, of_procedure
from studies.procedures.effects import against_amplitude, compared, pairs_of, with_aspect

ENERGY_FACTOR = 10.0
"""How many times the energy of the internal oscillation the shape change costs at least [-]."""

BY_SAMPLES = f", summed every {APART:g} s"
PEAK = 0.9
"""l/w of the energy's local maximum [-]."""


def _shape_change_costs_most(table: pd.DataFrame) -> Finding:
    ours, verdict = compared(table, ENERGY, SHAPE, (EXTERNAL, INTERNAL), 1)
    return Finding(
        paper="Shape change needs the most energy, at any l/w",
        ours=f"energy per smarticle [J] of shape-change {ours}",
        verdict=verdict,
        criterion="energy above that of each other activity, paired by l/w and seed",
    )


def _internal_costs_least(table: pd.DataFrame) -> Finding:
    ours, verdict = compared(table, ENERGY, INTERNAL, (EXTERNAL, SHAPE), -1)
    return Finding(
        paper="Internal oscillation needs the least energy",
        ours=f"energy per smarticle [J] of internal {ours}",
        verdict=verdict,
        criterion=f"energy at θ = {AMPLITUDE:g}° below that of each other activity, paired by l/w and seed",
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
    return with_aspect(
        "Internal oscillation: energy grows with l/w",
        of_procedure(table, INTERNAL), ENERGY, "energy per smarticle", sign=1, form=".3g", unit=" J",
        when=f", θ = {AMPLITUDE:g}°",
    )  # fmt: skip


def _shape_change_costs_by_samples(table: pd.DataFrame) -> Finding:
    both = pairs_of(table, SAMPLED, SHAPE, INTERNAL)
    excess = mean_over_seeds(both["one"] - ENERGY_FACTOR * both["other"])
    means = both.groupby(ASPECT)[["one", "other"]].mean()
    told_means = ", ".join(f"{aspect:g}: {row['one']:.3g} and {row['other']:.3g}" for aspect, row in means.iterrows())
    return Finding(
        paper=f"Shape change costs more than 10 times the energy of internal oscillation{BY_SAMPLES}",
        ours=f"shape-change less 10 times internal {told(excess, 3, ' J')}; the two by l/w {told_means or 'none'} J",
        verdict=judge(excess),
        criterion="the mean of the difference > 0, paired by l/w and seed; no ratio, since a sum over samples can be "
        "zero or negative",
    )


def _sampled_energy_grows_with_amplitude(table: pd.DataFrame) -> Finding:
    slope = against_amplitude(table[table[PROCEDURE] == INTERNAL], SAMPLED)
    return Finding(
        paper=f"Internal oscillation: energy grows with θ{BY_SAMPLES}",
        ours=f"energy per smarticle against θ {told(slope, 3, ' J per degree')}",
        verdict=judge(slope),
        criterion="slope of the energy against θ > 0, within runs of the same l/w and seed",
    )


def _sampled_energy_grows_with_aspect(table: pd.DataFrame) -> Finding:
    return with_aspect(
        f"Internal oscillation: energy grows with l/w{BY_SAMPLES}",
        of_procedure(table, INTERNAL), SAMPLED, "energy per smarticle", sign=1, form=".3g", unit=" J",
        when=f", θ = {AMPLITUDE:g}°",
    )  # fmt: skip


def _peaks(table: pd.DataFrame, quantity: str, how: str) -> Finding:
    part = of_procedure(table, INTERNAL)
    wide = part.pivot_table(index=SEED, columns=ASPECT, values=quantity)
    around = [aspect for aspect in wide.columns if 0.05 < abs(aspect - PEAK) < 0.15] if PEAK in wide else []
    effects = {f"at {aspect:g}": mean_over_seeds(wide[PEAK] - wide[aspect]) for aspect in around}
    known = len(effects) == 2
    return Finding(
        paper=f"Internal oscillation: the energy has a local maximum at l/w = {PEAK:g}{how}",
        ours=f"energy per smarticle there {told_less(effects, '; ')} J" if known else "no data",
        verdict=all_of([judge(effect) for effect in effects.values()]) if known else "no data",
        criterion="above that at either neighbouring l/w, seed by seed, mean over seeds",
    )


def _internal_costs_a_little_less_than_external(table: pd.DataFrame) -> Finding:
    both = pairs_of(table, ENERGY, INTERNAL, EXTERNAL)
    both = both[(both["one"] > 0) & (both["other"] > 0)]
    ratio = mean_over_seeds(np.log(both["one"] / both["other"]))
    less, similar = judge(negative(ratio)), judge(ratio, threshold=-math.log(2))
    told_ratio = f"{math.exp(ratio.value):.3g} ×/÷ {math.exp(ratio.half_width):.3g}" if ratio.count > 1 else "no data"
    return Finding(
        paper="External and internal oscillation need similar energies, internal slightly less",
        ours=f"internal over external, geometric mean and 95 %: {told_ratio} (n = {ratio.count})",
        verdict=all_of([less, similar]),
        criterion="geometric mean of the ratio between 1/2 and 1, paired by l/w and seed",
    )


JUDGES: Sequence[Callable[[pd.DataFrame], Finding]] = (
    _shape_change_costs_most,
    _shape_change_costs,
    _shape_change_costs_by_samples,
    _internal_costs_least,
    _energy_grows_with_amplitude,
    _sampled_energy_grows_with_amplitude,
    _energy_grows_with_aspect,
    _sampled_energy_grows_with_aspect,
    lambda table: _peaks(table, ENERGY, ""),
    lambda table: _peaks(table, SAMPLED, BY_SAMPLES),
    _internal_costs_a_little_less_than_external,
)
"""In the paper's order."""
