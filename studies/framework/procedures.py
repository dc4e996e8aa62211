"""Procedures: what a pile goes through, the points of studies that compare them, and how they are compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.manifest import RunManifest
from postprocess.statistics.columns import ASPECT, SEEDS
from postprocess.statistics.pairs import mean_difference
from postprocess.statistics.points import mean_columns, ordered, seeds_of
from postprocess.statistics.seeds import SeedMean, mean_over_seeds
from studies.framework.runs import DEFINITION, Collected, MeasuredRun

STATIC, EXTERNAL, SHAPE, INTERNAL = "static", "external", "shape-change", "internal"
PROCEDURES: Mapping[str, str] = MappingProxyType(
    {"shake": EXTERNAL, "shape-change": SHAPE, "internal-oscillation": INTERNAL}
)
"""Procedure of each type of activity."""

AMPLITUDE = 10.0
"""θ of the internal oscillation where procedures are compared, as in the paper [deg]."""

PROCEDURE, THETA, ACTIVE = "procedure", "theta [deg]", "time active [s]"
PHI, CROSSINGS = f"phi {DEFINITION} [-]", "crossings [-]"

BY_RANKS = "mean over seeds of the rank correlation of peak force and ⟨N⟩ > 0; what held fast is above all that did not"
"""Criterion by which the force that tears a pile goes with its entanglement, see `postprocess.statistics.bounded`."""

NAMED: Mapping[str, Callable[[pd.Series], str]] = MappingProxyType(
    {
        "procedure": lambda point: str(point[PROCEDURE]),
        "θ": lambda point: "" if math.isnan(point[THETA]) else f"{point[THETA]:g}°",
        "l/w": lambda point: f"{point[ASPECT]:g}",
        "seeds": lambda point: str(point[SEEDS]),
    }
)
"""What tells a point from others, for a person to read; see `points.told_means`."""


def prepared_by(run: RunManifest, *then: str) -> str:
    """The procedure of a run: a pour, a rest, one activity with a rest of its own or none, and then some phases.

    Args:
        run: A run.
        then: Types of the phases that follow.

    Raises:
        InputError: The phases are others.
    """
    types = [phase.type for phase in run.phases]
    active = [kind for kind in types if kind in PROCEDURES]
    if types != ["deposit", "relax", *([active[0], "relax"] if active else []), *then]:
        msg = (
            f"{run.directory}: its phases are {', '.join(types)}, not a pour, a rest, one activity "
            f"({', '.join(PROCEDURES)}) with a rest or none, {' and '.join(then)}"
        )
        raise InputError(msg)
    return PROCEDURES[active[0]] if active else STATIC


def of_procedure(table: pd.DataFrame, procedure: str) -> pd.DataFrame:
    """Samples of one procedure; of the internal oscillation those that procedures are compared at."""
    chosen = table[table[PROCEDURE] == procedure]
    return chosen[np.isclose(chosen[THETA], AMPLITUDE)] if procedure == INTERNAL and THETA in chosen else chosen


def paired(table: pd.DataFrame, quantity: str, one: str, other: str) -> SeedMean:
    """One procedure less another, mean over pairs of the same aspect ratio and seed."""
    return mean_difference(of_procedure(table, one), of_procedure(table, other), quantity)


def points(table: pd.DataFrame, quantities: Iterable[str]) -> pd.DataFrame:
    """One row per procedure, aspect ratio and θ: means over seeds with their errors.

    Args:
        table: One row per run, or per sample of several runs.
        quantities: Columns that are averaged.

    Returns:
        The table; `… SE` is the standard error, `… 95 %` the half-width of the confidence interval, `… seeds`
        how many seeds have a value.
    """
    rows = []
    for (procedure, aspect, theta), group in table.groupby([PROCEDURE, ASPECT, THETA], sort=True, dropna=False):
        row: dict[str, object] = {PROCEDURE: procedure, THETA: theta, ASPECT: aspect, **seeds_of(group)}
        for quantity in quantities:
            mean = mean_over_seeds(group[quantity])
            row |= mean_columns(quantity, mean)
            row[f"{quantity.rpartition(' [')[0]} seeds [-]"] = mean.count
        rows.append(row)
    return ordered(
        pd.DataFrame(rows), [PROCEDURE, THETA, ASPECT], named=PROCEDURE, order=(STATIC, EXTERNAL, SHAPE, INTERNAL)
    )


def refuse_unlike(found: Collected) -> None:
    """Refuses runs of one procedure that took different times, and a point's runs with the same seed.

    Args:
        found: Runs whose rows tell procedure, θ, aspect ratio and how long they were active.

    Raises:
        InputError: There are such.
    """
    found.refuse_mixture(
        "duration",
        lambda run: f"{run.row[PROCEDURE]} for {run.row[ACTIVE]:.3g} s",
        within=lambda run: str(run.row[PROCEDURE]),
    )
    found.refuse_repeats("point", named_point)


def named_point(run: MeasuredRun) -> str:
    """`internal θ 10° l/w 0.7`: a run's procedure, with θ where barbs oscillate, and aspect ratio."""
    row = run.row
    theta = f" θ {row[THETA]:g}°" if row[PROCEDURE] == INTERNAL else ""
    return f"{row[PROCEDURE]}{theta} l/w {row[ASPECT]:g}"
