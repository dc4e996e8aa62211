"""The paper's findings on its chain of robots, each judged by our own runs, and what the assumptions matter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from postprocess.measures.strain import (
    AT_PEAK,
    BEND,
    DROP,
    FRACTURE,
    PEAK,
    SLIP_WIDENING,
    STIFFNESS,
    WALL,
    WIDENING,
    YIELD,
)
from postprocess.statistics.columns import SEED
from postprocess.statistics.findings import Finding, Verdict, all_of, judge, negative, told
from postprocess.statistics.seeds import SeedMean, Slope, mean_over_seeds, slope_within
from studies.chain.measure import BASELINE, CONFINEMENT, COUNT, VARIANT

RANGE = (0.52, 0.65)
"""h/H of the paper."""

YIELDS = {2: 0.2, 6: 0.4}
"""Strains at which the paper's single trials yield, by number of smarticles."""

NEAR = 0.1  # of strain: how near a yield strain must be to the paper's, which is read off a sentence
STRAIGHT = 0.25  # how far the second slope may be from the first, relative, to count as a straight line
COUNTS = (2, 6)

_CONFINED = "slope against h/H > 0, trials with the same seed compared with each other"


def findings(runs: pd.DataFrame) -> tuple[Finding, ...]:
    """All findings, judged.

    Args:
        runs: See `measure.chain_row`.
    """
    base = runs[runs[VARIANT] == BASELINE]
    inside, wide = base[base[CONFINEMENT].between(*RANGE)], f"h/H {RANGE[0]:g} to {RANGE[1]:g}"
    whole = " to ".join(f"{end:g}" for end in (base[CONFINEMENT].min(), base[CONFINEMENT].max()))
    return (
        _straight(base),
        *(_yields(base, count) for count in COUNTS),
        _widens(base),
        _rises(inside, PEAK, f"Peak force rises about linearly with confinement, {wide} as in the paper"),
        _rises(inside, FRACTURE, f"Strain at fracture rises about linearly with confinement, {wide} as in the paper"),
        _rises(base, PEAK, f"Peak force rises with confinement, linearly or not, over our range, h/H {whole}"),
        _rises(
            base, FRACTURE, f"Strain at fracture rises with confinement, linearly or not, over our range, h/H {whole}"
        ),
        _more(base),
    )


def _straight(base: pd.DataFrame) -> Finding:
    parts, verdicts = [], []
    for count in COUNTS:
        own = base[base[COUNT] == count]
        ratio, slope = _by_trial(own.assign(**{BEND: own[BEND] - 1}), BEND), _by_trial(own, STIFFNESS)
        parts.append(f"n = {count}: {told(ratio, 3)}, slope {told(slope, 3, ' N')}")
        verdicts.append(all_of([judge(ratio, threshold=-STRAIGHT), judge(negative(ratio), threshold=-STRAIGHT)]))
    return Finding(
        paper="Force starts linear in strain",
        ours=f"second over first slope, less 1: {'; '.join(parts)}",
        verdict=all_of(verdicts),
        criterion=f"the slopes of the lower and the upper half of the first rise differ by less than {STRAIGHT:.0%}",
    )


def _by_trial(part: pd.DataFrame, quantity: str) -> SeedMean:
    """Mean over seeds of means over h/H: before they touch a wall, runs with the same servos are the same run."""
    return mean_over_seeds(part.groupby(SEED)[quantity].mean().tolist())


def _yields(base: pd.DataFrame, count: int) -> Finding:
    part, expected = base[base[COUNT] == count], YIELDS[count]
    yielded = part[part[YIELD].notna()]
    strain, loss = _by_trial(yielded, YIELD), _by_trial(yielded, DROP)
    slip = _by_trial(part[part[YIELD].isna()], AT_PEAK)
    verdict: Verdict = "no data" if part.empty else "not found"
    if strain.count > 1:
        off = _by_trial(yielded.assign(**{YIELD: yielded[YIELD] - expected}), YIELD)
        verdict = all_of([judge(off, threshold=-NEAR), judge(negative(off), threshold=-NEAR)])
    return Finding(
        paper=f"A yield drop near a strain of {expected:g}, n = {count}",
        ours=f"{len(yielded)} of {len(part)} runs have one, at {told(strain, 3)}, of {told(loss, 2)} of the force; "
        f"the others part at their first maximum, at {told(slip, 3)}",
        verdict=verdict,
        criterion=f"mean strain of the yield drop within {NEAR:g} of it; not found without drops",
    )


def _widens(base: pd.DataFrame) -> Finding:
    means = {count: _by_trial(base[base[COUNT] == count], WIDENING) for count in COUNTS}
    slips = [told(_by_trial(base[base[COUNT] == count], SLIP_WIDENING), 3) for count in COUNTS]
    return Finding(
        paper="The chain widens while strained (auxetic)",
        ours="widening before the fracture "
        + "; ".join(f"n = {n}: {told(mean, 3)}" for n, mean in means.items())
        + f"; up to the first maximum of the force only {' and '.join(slips)}, the rest when barbs slip",
        verdict=all_of([judge(mean) for mean in means.values()]),
        criterion="largest width before the fracture over that at the start > 1, for n = 2 and 6",
    )


def _rises(part: pd.DataFrame, quantity: str, paper: str) -> Finding:
    parts, verdicts = [], []
    for count in COUNTS:
        own = part[part[COUNT] == count]
        slope = slope_within(own[CONFINEMENT].tolist(), own[quantity].tolist(), own[SEED].tolist())
        wall = own[WALL].max() if len(own) else np.nan
        parts.append(f"n = {count}: {told(slope, 3)} per unit of h/H, force on the walls up to {wall:.2g} N")
        verdicts.append(_judged(slope))
    return Finding(paper=paper, ours="; ".join(parts), verdict=all_of(verdicts), criterion=_CONFINED)


def _judged(slope: Slope) -> Verdict:
    # A slope of nothing at all has no scatter: walls that are never touched change no bit.
    return "not found" if slope.count > 1 and slope.value <= 0 and not slope.half_width > 0 else judge(slope)


def _more(base: pd.DataFrame) -> Finding:
    parts, verdicts = [], []
    for name, quantity, sign in (("force", PEAK, 1), ("strain at fracture", FRACTURE, -1)):
        table = base.pivot_table(index=[CONFINEMENT, SEED], columns=COUNT, values=quantity).reindex(columns=COUNTS)
        effect = _by_trial((table[6] - table[2]).dropna().rename(quantity).reset_index(), quantity)
        parts.append(f"{name} {told(effect, 3)}")
        verdicts.append(judge(effect if sign > 0 else negative(effect)))
    return Finding(
        paper="As n increases, force increases but elongation decreases",
        ours=f"n = 6 less n = 2: {'; '.join(parts)}",
        verdict=all_of(verdicts),
        criterion="peak force of n = 6 above, strain at fracture below that of n = 2, paired by h/H and seed, "
        "means over h/H of each seed",
    )


def sensitivity(runs: pd.DataFrame) -> pd.DataFrame:
    """What each variant changes against the baseline with the same chain and walls, trial by trial.

    Args:
        runs: See `measure.chain_row`.

    Returns:
        One row per variant and quantity; changes are in per cent of the baseline's trial with the same servos.
    """
    rows: list[Sequence[object]] = []
    keys = [COUNT, CONFINEMENT, SEED]
    base = runs[runs[VARIANT] == BASELINE].set_index(keys)
    for variant, group in runs[runs[VARIANT] != BASELINE].groupby(VARIANT, sort=False):
        for quantity in (PEAK, FRACTURE, AT_PEAK, STIFFNESS):
            own = group.set_index(keys)[quantity]
            change = mean_over_seeds((100 * (own / base[quantity] - 1)).dropna().tolist())
            value = mean_over_seeds(own.tolist()).value
            rows.append([variant, quantity, value, change.value, change.half_width, change.count])
    columns = [VARIANT, "quantity", "value", "change [%]", "change 95 % [%]", "trials [-]"]
    return pd.DataFrame(rows, columns=columns)
