"""The tables of the study `friction`: means, the friction each curve asks for, how near each comes, growth.

Errors are half-widths of 95 % intervals over seeds, from the relative scatter of `studies.friction.scatter`. Gravish's
points are compared at equal l/w only and never interpolated; φ is, between the coefficients of friction.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd

from postprocess.statistics.columns import ASPECT, SEEDS
from postprocess.statistics.points import marked, seeds_of
from postprocess.statistics.seeds import Scatter, pooled_scatter
from studies.base.questions import YesNo
from studies.framework.provenance import DIGITISING_ERROR, reference_at
from studies.friction.curve import Curve
from studies.friction.measure import COMPARED, FRICTION, TIMES, at_time, column
from studies.friction.scatter import half_widths_of

MARGIN = 5.0
"""How far from Gravish's points φ may lie [%]."""

SURE = 0.95
"""Confidence from which a verdict is given, either way."""

JUDGED: Mapping[str, Sequence[str]] = MappingProxyType(
    {
        "phi_0": ("phi_0",),
        "phi_f": ("phi_f",),
        "phi_f relaxed": ("phi_f relaxed",),
        "phi_0 and phi_f": ("phi_0", "phi_f"),
        "phi_0 and phi_f relaxed": ("phi_0", "phi_f relaxed"),
    }
)
"""What is to be near Gravish's at the same friction: stages, by what they are called together."""

STAGE, PHI, REFERENCE, DEVIATION = "stage", "phi [-]", "phi Gravish [-]", "deviation [%]"
CONFIDENCE, LEAST = "confidence [%]", "confidence of the worst point [%]"
LARGEST, MEAN, SIGNED = "largest deviation [%]", "mean absolute deviation [%]", "mean [%]"
VERDICT, WHAT, COMPARED_POINTS = "within 5 %", "what", "points compared [-]"
GROWTHS = tuple(f"growth from {one:g} to {other:g} s [%]" for one, other in itertools.pairwise(TIMES))

Curves = Mapping[tuple[str, float], Curve]
"""By stage and aspect ratio; those that Gravish has a point of."""


def points(runs: pd.DataFrame, reference: pd.DataFrame, scatters: Mapping[str, Scatter]) -> pd.DataFrame:
    """One row per stage, aspect ratio and friction: φ, its error, and its deviation from Gravish's.

    Args:
        runs: Rows of `measure.friction_run`.
        reference: See `references.read_reference`.
        scatters: Relative, by stage.

    Returns:
        The table; the error of a deviation has that of reading Gravish's point in it.
    """
    rows: list[dict[str, object]] = []
    for stage, scatter in scatters.items():
        for (aspect, friction), group in runs.groupby([ASPECT, FRICTION]):
            known = group[group[column(stage)].notna()]
            if known.empty:
                continue
            mean = float(known[column(stage)].mean())
            half_width = half_widths_of(scatter) * scatter.value * mean / math.sqrt(len(known))
            value = reference_at(reference, aspect, COMPARED[stage])
            rows.append(
                {
                    STAGE: stage,
                    ASPECT: aspect,
                    FRICTION: friction,
                    **seeds_of(known),
                    PHI: mean,
                    marked(PHI, "95 %"): half_width,
                    REFERENCE: value,
                    DEVIATION: 100 * (mean / value - 1),
                    marked(DEVIATION, "95 %"): 100 * math.hypot(half_width, DIGITISING_ERROR) / value,
                }
            )
    return pd.DataFrame(rows)


def curves(table: pd.DataFrame, scatters: Mapping[str, Scatter]) -> Curves:
    """φ against friction, where Gravish has a point.

    Args:
        table: See `points`.
        scatters: Relative, by stage.
    """
    found = {}
    for (stage, aspect), group in table[table[REFERENCE].notna()].groupby([STAGE, ASPECT], sort=False):
        rows = group.sort_values(FRICTION)
        found[str(stage), float(aspect)] = Curve(
            friction=rows[FRICTION].to_numpy(),
            packing=rows[PHI].to_numpy(),
            half_widths=rows[marked(PHI, "95 %")].to_numpy(),
            reference=float(rows[REFERENCE].iloc[0]),
            reading_error=DIGITISING_ERROR,
            per_error=half_widths_of(scatters[str(stage)]),
            freedom=scatters[str(stage)].freedom,
        )
    return found


def crossings(found: Curves) -> pd.DataFrame:
    """One row per curve: the friction at which φ is Gravish's, and its 95 % interval; inf beyond what was measured."""
    rows = []
    for (stage, aspect), curve in found.items():
        crossing = curve.crossing()
        rows.append(
            {
                STAGE: stage,
                ASPECT: aspect,
                REFERENCE: curve.reference,
                FRICTION: crossing.value,
                "from [-]": crossing.low,
                "to [-]": crossing.high,
                "lies": crossing.place,
                "measured from [-]": curve.friction[0],
                "measured to [-]": curve.friction[-1],
            }
        )
    return pd.DataFrame(rows)


def verdicts(found: Curves) -> pd.DataFrame:
    """One row per friction that was measured and what is to be near Gravish's: how near it comes, and how surely.

    The confidence is that all points compared are within `MARGIN`, their errors taken as independent. It is low also
    where errors are large, so what refuses a friction is a point that is surely farther off, see `verdict`.
    """
    rows = []
    for what, stages in JUDGED.items():
        wanted = {key: curve for key, curve in found.items() if key[0] in stages}
        frictions = sorted({float(friction) for curve in wanted.values() for friction in curve.friction})
        for friction in frictions:
            measured = {key: curve for key, curve in wanted.items() if friction in curve.friction}
            row = {WHAT: what, FRICTION: friction, **nearness(measured, friction), "points wanted [-]": len(wanted)}
            rows.append({**row, VERDICT: verdict(row, whole=len(measured) == len(wanted))})
    return pd.DataFrame(rows)


def nearness(found: Curves, friction: float) -> dict[str, float | int | str]:
    """How near φ comes to Gravish's at a friction: deviations [%], and the confidence that all are within `MARGIN`."""
    at = np.array([friction])
    deviations = {
        f"{stage} at l/w = {aspect:g}": 100 * float(curve.deviation(at)[0]) / curve.reference
        for (stage, aspect), curve in found.items()
    }
    worst = max(deviations, key=lambda name: abs(deviations[name]))
    sure = [curve.within(MARGIN / 100 * curve.reference, friction) for curve in found.values()]
    values = np.array(list(deviations.values()))
    return {
        COMPARED_POINTS: len(deviations),
        MEAN: float(np.abs(values).mean()),
        SIGNED: float(values.mean()),
        LARGEST: deviations[worst],
        "largest at": worst,
        CONFIDENCE: 100 * math.prod(sure),
        LEAST: 100 * min(sure, default=math.nan),
    }


def verdict(near: Mapping[str, float | int | str], *, whole: bool) -> YesNo:
    """Whether all points are near Gravish's.

    Yes: the confidence that all are is at least `SURE`. No: a point is surely farther off, by Bonferroni's rule for as
    many points as were compared. A few of the points can refuse a friction, but not accept it.

    Args:
        near: See `nearness`.
        whole: Whether all points are there.
    """
    confidence, least, count = (float(near[name]) for name in (CONFIDENCE, LEAST, COMPARED_POINTS))
    if confidence >= 100 * SURE and whole:
        return "yes"
    return "no" if least * count <= 100 * (1 - SURE) else "undetermined"


def nearest_frictions(found: Curves) -> pd.DataFrame:
    """One row per what is to be near Gravish's: the friction whose worst point is best, also in between."""
    rows = []
    for what, stages in JUDGED.items():
        wanted = {key: curve for key, curve in found.items() if key[0] in stages}
        grids = [curve.grid() for curve in wanted.values()]
        if not grids:
            continue
        low, high = max(grid[0] for grid in grids), min(grid[-1] for grid in grids)
        grid = np.unique(np.concatenate(grids))
        grid = grid[(grid >= low) & (grid <= high)]
        if not len(grid):
            continue
        worst = np.max([np.abs(curve.deviation(grid)) / curve.reference for curve in wanted.values()], axis=0)
        friction = float(grid[np.argmin(worst)])
        near = nearness(wanted, friction)
        rows.append({WHAT: what, FRICTION: friction, **near, VERDICT: verdict(near, whole=True)})
    return pd.DataFrame(rows)


def growth(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per aspect ratio and friction: φ in the course of shaking, and by how much it grew from time to time.

    Growth is taken run by run; its error is from the scatter that all points have in common.

    Args:
        runs: Rows of `measure.friction_run`.
    """
    names = [column(at_time(time)) for time in TIMES]
    grown = runs.reindex(columns=[*runs.columns, *(set(names) - set(runs.columns))])
    for name, (one, other) in zip(GROWTHS, itertools.pairwise(names), strict=True):
        grown[name] = 100 * (grown[other] / grown[one] - 1)
    groups = grown.groupby([ASPECT, FRICTION])
    widths = {}
    for name in GROWTHS:
        scatter = pooled_scatter([group[name].tolist() for _, group in groups])
        widths[name] = half_widths_of(scatter) * scatter.value
    rows = []
    for (aspect, friction), group in groups:
        row = {ASPECT: aspect, FRICTION: friction, SEEDS: len(group)}
        row |= {f"{at_time(time)} [-]": float(group[name].mean()) for time, name in zip(TIMES, names, strict=True)}
        for name in GROWTHS:
            count = int(group[name].notna().sum())
            row[name] = float(group[name].mean())
            row[marked(name, "95 %")] = widths[name] / math.sqrt(count) if count else math.nan
        rows.append(row)
    return pd.DataFrame(rows)
