"""What Savoie et al. say of piles whose wall is taken away, each statement judged by our own runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pandas as pd

from postprocess.statistics.findings import Finding, Verdict, all_of, judge, negative, told
from postprocess.statistics.pairs import mean_difference, pairs
from postprocess.statistics.seeds import mean_over_seeds
from studies.base.release import by_procedure, compared_with, of, paired
from studies.framework.procedures import INTERNAL, SHAPE, STATIC
from studies.melting.measure import (
    BASE,
    CENTRE,
    CONTACT,
    ENTANGLED,
    HEIGHT,
    LIFT,
    OFFSET,
    SLOUGHED,
    TOP,
    TOPPLED,
)

WHOLE = 0.95
"""A pile holds together if more than this share of it is one cluster [-]: of 60 smarticles, no more than 2 apart."""

SAME_WIDTH = 0.05
"""Two piles are equally wide if their radii differ by less than this share [-]; smarticles are 0.5 of it long."""


def findings(runs: pd.DataFrame) -> tuple[Finding, ...]:
    """All findings, judged by the runs whose wall goes at once; the last ones by those where it is lifted as well.

    Args:
        runs: Rows of `measure.measure_melting`.
    """
    at_once = runs[runs[LIFT] == 0]
    judges: Sequence[Callable[[pd.DataFrame], Finding]] = (
        _holds_together,
        _entangled,
        _keeps_its_edge,
        _narrow_and_high,
        _topples,
        _sloughs,
        _low_and_wide,
        _more_stable,
    )
    return (*(one(at_once) for one in judges), _lifted(runs))


def _holds_together(runs: pd.DataFrame) -> Finding:
    effect = mean_over_seeds(of(runs, SHAPE)[CONTACT])
    return Finding(
        paper="Shape change: the pile does not break apart",
        ours=f"largest cluster by contact in the end: {by_procedure(runs, CONTACT)}",
        verdict=judge(effect, threshold=WHOLE),
        criterion=f"after shape change more than {WHOLE:g} of the smarticles are one cluster in the end",
    )


def _entangled(runs: pd.DataFrame) -> Finding:
    ours, verdict = compared_with(runs, ENTANGLED, SHAPE, (INTERNAL, STATIC), 1)
    return Finding(
        paper="Shape change holds together by entanglement, more than internal oscillation",
        ours=f"largest cluster by crossings in the end, shape-change {ours}; {by_procedure(runs, ENTANGLED)}",
        verdict=verdict,
        criterion="the share entangled in one cluster in the end is above that of internal and of static, paired by "
        "l/w and seed",
    )


def _keeps_its_edge(runs: pd.DataFrame) -> Finding:
    ours, verdict = compared_with(runs, SLOUGHED, SHAPE, (INTERNAL,), -1)
    return Finding(
        paper="Shape change: smarticles at the edge do not come off, unlike after internal oscillation",
        ours=f"sloughed share, shape-change {ours}; {by_procedure(runs, SLOUGHED)}",
        verdict=verdict,
        criterion="the sloughed share is below that after internal oscillation, paired by l/w and seed",
    )


def _narrow_and_high(runs: pd.DataFrame) -> Finding:
    radius, height = paired(runs, BASE, SHAPE, STATIC), paired(runs, TOP, SHAPE, STATIC)
    return Finding(
        paper="Shape change narrows the base and raises the pile",
        ours=f"before the wall goes, less static: radius of 95 % {told(radius, 3, ' m')}, height of 95 % "
        f"{told(height, 3, ' m')}",
        verdict=all_of([judge(negative(radius)), judge(height)]),
        criterion="radius < and height > those of static before the wall goes, paired by l/w and seed",
    )


def _topples(runs: pd.DataFrame) -> Finding:
    part = of(runs, SHAPE)
    fallen, total = int(part[TOPPLED].sum()), len(part)
    verdict: Verdict = "no data"
    ours = "no runs"
    if total:
        verdict = "found" if fallen else "not resolved"
        # One-sided: the largest share with which none of n falls in one out of twenty.
        most = "" if fallen else f", so at most {1 - 0.05 ** (1 / total):.0%} of such piles do, at 95 %"
        ours = f"{fallen} of {total} fell over{most}; com offset over the base's radius {by_procedure(runs, OFFSET)}"
    return Finding(
        paper="Shape change: the pile may fall onto its side (one example is shown)",
        ours=ours,
        verdict=verdict,
        criterion="the centre of mass of at least one pile ends beyond its base",
    )


def _sloughs(runs: pd.DataFrame) -> Finding:
    effect = mean_over_seeds(of(runs, INTERNAL)[SLOUGHED])
    return Finding(
        paper="Internal oscillation: some smarticles slough off the outer edge",
        ours=f"sloughed share {told(effect, 3)}; less static {told(paired(runs, SLOUGHED, INTERNAL, STATIC), 3)}",
        verdict=judge(effect),
        criterion="the sloughed share > 0, mean over runs",
    )


def _low_and_wide(runs: pd.DataFrame) -> Finding:
    height = paired(runs, CENTRE, INTERNAL, STATIC)
    both = pairs(of(runs, INTERNAL), of(runs, STATIC), BASE)
    width = mean_over_seeds(both["one"] / both["other"] - 1)
    bounds = [judge(negative(width), threshold=-SAME_WIDTH), judge(width, threshold=-SAME_WIDTH)]
    return Finding(
        paper="Internal oscillation lowers the pile and keeps its width",
        ours=f"before the wall goes, less static: com height {told(height, 3, ' m')}, radius of 95 % "
        f"{told(width, 3)} of it",
        verdict=all_of([judge(negative(height)), *bounds]),
        criterion=f"com height below that of static, radius within {SAME_WIDTH:.0%} of it, paired by l/w and seed",
    )


def _more_stable(runs: pd.DataFrame) -> Finding:
    ours, verdict = compared_with(runs, HEIGHT, INTERNAL, (STATIC,), 1)
    return Finding(
        paper="Internal oscillation makes the pile more stable than it was as poured",
        ours=f"com height kept, internal {ours}; {by_procedure(runs, HEIGHT)}",
        verdict=verdict,
        criterion="share of the com height kept in the end above that of static, paired by l/w and seed",
    )


def _lifted(runs: pd.DataFrame) -> Finding:
    parts, verdicts = [], []
    for name in (INTERNAL, SHAPE):
        part = of(runs, name)
        for quantity, told_as in ((HEIGHT, "com height kept"), (SLOUGHED, "sloughed")):
            effect = mean_difference(part[part[LIFT] > 0], part[part[LIFT] == 0], quantity)
            parts.append(f"{name} {told_as} {told(effect, 3)}")
            # Either sign is a difference.
            either: Verdict = judge(effect)
            verdicts.append("found" if either == "not found" else either)
    verdict: Verdict = "found" if "found" in verdicts else all_of(verdicts)
    return Finding(
        paper="(ours, not the paper's) lifting the wall differs from taking it away at once",
        ours=f"lifted less at once: {'; '.join(parts)}",
        verdict=verdict,
        criterion="a difference in height kept or in the sloughed share, of either procedure, paired by l/w and seed",
    )
