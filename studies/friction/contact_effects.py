"""What the study `contacts` asks of its runs: means of combinations, effects of factors, answers.

The effect of a factor is the mean of paired differences, second level less first, all else alike; those of one aspect
ratio and seed are averaged first, so that a seed counts once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dem.record.frames import read_frames
from dem.record.manifest import RunManifest
from postprocess.geometry.links import centres_of_mass
from postprocess.statistics.columns import ASPECT, SEED, SEEDS
from postprocess.statistics.factorial import paired_differences
from postprocess.statistics.points import averaged, marked, mean_columns, seeds_of, told_number
from postprocess.statistics.seeds import SeedMean, mean_over_seeds
from studies.base.questions import Question, YesNo, above_zero
from studies.framework.provenance import DIGITISING_ERROR, read_reference, reference_at
from studies.friction.measure import FRICTION, WINDOW, column
from studies.friction.tables import MARGIN

WALL, RESTITUTION = "friction at the container [-]", "restitution [-]"

FACTORS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {FRICTION: (0.4, 0.8), WALL: (0.4, 0.8), RESTITUTION: (0.7, 0.3)}
)
"""From the paper's values to others."""

RISEN = "lowest tenth after less before shaking [w]"
CROSSED = "crossings after [-]"
PHI_0, PHI_F, PHI_RELAXED = (column(stage) for stage in ("phi_0", "phi_f", "phi_f relaxed"))

QUANTITIES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        PHI_0: ("phi_0", ".4f"),
        PHI_F: ("phi_f", ".4f"),
        PHI_RELAXED: ("phi_f at rest again", ".4f"),
        CROSSED: ("N after shaking", ".2f"),
        RISEN: ("the rise of the lowest tenth [w]", ".3f"),
    }
)
"""What factors act on: what each is called, and how it is written."""

CALLED: Mapping[str, str] = MappingProxyType(
    {
        FRICTION: "friction between smarticles",
        WALL: "friction at the container",
        RESTITUTION: "restitution",
    }
)

TOGETHER = "both frictions together"
QUANTITY, FACTOR, EFFECT, SHARE = "quantity", "factor", "effect [unit of the quantity]", "effect over the mean [%]"
EVERYWHERE = "all"
DEVIATION = "deviation of phi_f from Gravish [%]"


def risen(run: RunManifest) -> float:
    """By how much the lowest tenth of all smarticles rose while the pile was shaken [w].

    The mean height of their centres of mass above the floor at the end of shaking, less that before it, each over the
    last `studies.friction.measure.WINDOW` of its phase. A pile that packs lets it sink; one that climbs its container
    as a whole leaves a gap below.

    Raises:
        InputError: Its frames cannot be read.
    """
    frames, heights = read_frames(run.directory), []
    shaken = next(phase.index for phase in run.phases if phase.type == "shake")
    for phase in (shaken - 1, shaken):
        part = frames.in_phase(phase)
        late = part.after(part.times[-1] - WINDOW)
        heights.append(
            float(np.mean([_lowest_tenth(centres_of_mass(one.vertices)[:, 2] - one.floor_z) for one in late]))
        )
    return (heights[1] - heights[0]) / run.middle_length


def _lowest_tenth(heights: NDArray[np.float64]) -> float:
    count = max(round(len(heights) / 10), 1)
    return float(np.partition(heights, count - 1)[:count].mean())


def points(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per combination and aspect ratio: means, and how far φ_f is from Gravish's, errors of both included."""
    reference, rows = read_reference(), []
    for key, group in runs.groupby([*FACTORS, ASPECT], sort=True):
        combination = dict(zip((*FACTORS, ASPECT), key, strict=True))
        row = {**combination, **seeds_of(group), **averaged(group, QUANTITIES)}
        value = reference_at(reference, float(combination[ASPECT]), "phi_f")
        row[DEVIATION] = 100 * (row[PHI_F] / value - 1)
        row[marked(DEVIATION, "95 %")] = 100 * math.hypot(row[marked(PHI_F, "95 %")], DIGITISING_ERROR) / value
        rows.append(row)
    return pd.DataFrame(rows)


def by_seed(runs: pd.DataFrame, quantity: str, *changed: str) -> pd.DataFrame:
    """What a quantity does when factors change: one row per aspect ratio and seed, other factors averaged.

    Args:
        runs: One row per run.
        quantity: Column.
        changed: One factor: its effect. Two: how much more the first does where the second is changed too.
    """
    table, left = runs, [*FACTORS, ASPECT, SEED]
    for factor in changed:
        left = [name for name in left if name != factor]
        table = paired_differences(table, quantity, factor, FACTORS[factor], left)
    return table.groupby([ASPECT, SEED], as_index=False)[quantity].mean()


def effects(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per quantity, factor and aspect ratio, the last one of all aspect ratios together."""
    rows = []
    for quantity, (called, _) in QUANTITIES.items():
        for factor, changed in {**{CALLED[name]: (name,) for name in FACTORS}, TOGETHER: (FRICTION, WALL)}.items():
            table = by_seed(runs, quantity, *changed)
            for place, group in [*((f"{ratio:g}", part) for ratio, part in table.groupby(ASPECT)), (EVERYWHERE, table)]:
                effect = mean_over_seeds(group[quantity])
                mean = float(runs[runs[ASPECT].isin(group[ASPECT])][quantity].mean())
                rows.append(
                    {
                        QUANTITY: called,
                        FACTOR: factor,
                        ASPECT: place,
                        SEEDS: effect.count,
                        **mean_columns(EFFECT, effect),
                        SHARE: 100 * effect.value / mean if mean else math.nan,
                    }
                )
    return pd.DataFrame(rows)


def answers(runs: pd.DataFrame, means: pd.DataFrame) -> tuple[Question, ...]:
    """The study's questions, answered over all aspect ratios.

    Args:
        runs: One row per run.
        means: See `points`.
    """
    asked = []
    for quantity in (PHI_0, PHI_F, PHI_RELAXED):
        called = QUANTITIES[quantity][0]
        for factor, (low, high) in FACTORS.items():
            asked.append(
                _asked(
                    f"Does {called} fall when {CALLED[factor]} goes from {low:g} to {high:g}?",
                    by_seed(runs, quantity, factor),
                    quantity,
                )
            )
    between, wall = by_seed(runs, PHI_F, FRICTION), by_seed(runs, PHI_F, WALL)
    both = between.merge(wall, on=[ASPECT, SEED], suffixes=("", " wall"))
    both[PHI_F] = both[PHI_F] - both[f"{PHI_F} wall"]
    return (
        *asked,
        _asked("Does friction between smarticles lower phi_f more than friction at the container?", both, PHI_F),
        _asked(
            "Does friction at the container lower phi_f more where that between smarticles is 0.8?",
            by_seed(runs, PHI_F, FRICTION, WALL),
            PHI_F,
        ),
        _asked(
            "Do the lowest smarticles rise more when friction at the container goes from 0.4 to 0.8?",
            by_seed(runs, RISEN, WALL),
            RISEN,
            sign=1,
        ),
        _near_gravish(means),
    )


def _asked(question: str, table: pd.DataFrame, quantity: str, *, sign: int = -1) -> Question:
    """Whether an effect is clearly of a sign, over all aspect ratios and seeds."""
    effect, form = mean_over_seeds(table[quantity]), QUANTITIES[quantity][1]
    places = ", ".join(
        f"{ratio:g}: {_told(mean_over_seeds(group[quantity]), form)}" for ratio, group in table.groupby(ASPECT)
    )
    return Question(
        question=question,
        answer=above_zero(sign * effect.value, effect.half_width),
        evidence=f"{_told(effect, form)} (n = {effect.count}); by l/w {places}",
    )


def _told(mean: SeedMean, form: str) -> str:
    return told_number(mean.value, f"+{form}", mean.half_width)


def _near_gravish(means: pd.DataFrame) -> Question:
    """Whether φ_f of one combination is within the margin at every l/w: yes or no only where errors leave no doubt."""
    question = f"Does a combination bring phi_f within {MARGIN:g} % of Gravish's at every l/w measured?"
    known = means[means[DEVIATION].notna()]
    if known.empty:
        return Question(question=question, answer="undetermined", evidence="no points of Gravish's at these l/w")
    off, error = known[DEVIATION].abs(), known[marked(DEVIATION, "95 %")]
    told = known.assign(_inside=off + error <= MARGIN, _outside=off - error > MARGIN, _off=off)
    each = told.groupby(list(FACTORS)).agg({"_inside": "all", "_outside": "any", "_off": ["max", "size"]})
    each.columns = pd.Index(["inside", "outside", "off", "places"])
    # A combination that lacks an aspect ratio can be refused by another one, and not accepted.
    whole = each[each["places"] == each["places"].max()]
    answer: YesNo = "yes" if whole["inside"].any() else "no" if each["outside"].all() else "undetermined"
    best = pd.Series(dict(zip(FACTORS, whole["off"].idxmin(), strict=True)))
    rows = told[np.all([told[name] == best[name] for name in FACTORS], axis=0)]
    places = ", ".join(
        f"{row[ASPECT]:g}: {told_number(row[DEVIATION], '+.1f', row[marked(DEVIATION, '95 %')])} %"
        for _, row in rows.iterrows()
    )
    return Question(question=question, answer=answer, evidence=f"nearest: {named(best)}; by l/w {places}")


def named(row: pd.Series) -> str:
    """Name of a combination."""
    return f"μ = {row[FRICTION]:g}, container {row[WALL]:g}, e = {row[RESTITUTION]:g}"
