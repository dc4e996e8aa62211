"""What the studies that take the container away have in common: their runs, means over seeds, and comparisons.

A run is poured, goes through one activity or none, rests, and loses its wall in the last phase.
"""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from dem.errors import InputError
from dem.record.frame import Frame
from dem.record.frames import FrameSequence, read_frames
from dem.record.manifest import PhaseRecord, RunManifest
from postprocess.measures.table import PASSIVE_PHASES
from postprocess.statistics.columns import ASPECT, SEED
from postprocess.statistics.findings import Verdict
from postprocess.statistics.pairs import compared, mean_difference
from postprocess.statistics.points import averaged, ordered, seeds_of, told_number
from postprocess.statistics.seeds import SeedMean, mean_over_seeds
from studies.framework.procedures import EXTERNAL, INTERNAL, PROCEDURE, PROCEDURES, SHAPE, STATIC

ORDER = (STATIC, EXTERNAL, INTERNAL, SHAPE)
"""Procedures in the order of tables and pictures."""

_REMOVAL = "remove-container"


def removal(run: RunManifest) -> PhaseRecord:
    """The phase that takes the wall away.

    Raises:
        InputError: It is not the last one, or no rest goes before it.
    """
    last = run.phases[-1]
    if last.type != _REMOVAL or len(run.phases) < 3 or run.phases[-2].type != "relax":
        types = ", ".join(phase.type for phase in run.phases)
        msg = f"{run.directory}: does not end with a rest and {_REMOVAL}: its phases are {types}"
        raise InputError(msg)
    return last


def procedure(run: RunManifest) -> str:
    """What the pile went through before: a key of `procedures.PROCEDURES`' values, or static.

    Raises:
        InputError: More than one activity, or an unknown one.
    """
    active = [phase.type for phase in run.phases if phase.type not in {*PASSIVE_PHASES, _REMOVAL}]
    if not active:
        return STATIC
    if len(active) > 1 or active[0] not in PROCEDURES:
        msg = f"{run.directory}: not one activity ({', '.join(PROCEDURES)}) or none: it has {', '.join(active)}"
        raise InputError(msg)
    return PROCEDURES[active[0]]


def around(run: RunManifest) -> tuple[Frame, FrameSequence]:
    """The last frame with the wall, and all those since it began to go.

    Raises:
        InputError: There are none.
    """
    phase, frames = removal(run), read_frames(run.directory)
    rest, after = frames.in_phase(phase.index - 1), frames.in_phase(phase.index)
    if not rest or not after:
        msg = f"{run.directory}: no frame of the rest before {_REMOVAL} or of that phase; run it again"
        raise InputError(msg)
    return rest[len(rest) - 1], after


def labels(run: RunManifest) -> dict[str, object]:
    """The columns that tell a run from others."""
    return {
        PROCEDURE: procedure(run),
        ASPECT: round(run.aspect_ratio, 6),
        SEED: run.seed,
        "smarticles [-]": run.count,
        "fidelity": run.fidelity,
    }


def means(runs: pd.DataFrame, keys: Sequence[str], quantities: Sequence[str]) -> pd.DataFrame:
    """Means over seeds with their errors, one row per combination of keys, of which the procedure is one.

    Args:
        runs: One row per run.
        keys: Columns that make a point; NaN is a value of its own.
        quantities: Columns that are averaged.

    Returns:
        The table; `… SE` is the standard error, `… 95 %` the half-width of the confidence interval.
    """
    rows = []
    for values, group in runs.groupby(list(keys), sort=True, dropna=False):
        places = dict(zip(keys, values if isinstance(values, tuple) else (values,), strict=True))
        rows.append({**places, **seeds_of(group), **averaged(group, quantities)})
    return in_order(pd.DataFrame(rows), keys)


def in_order(table: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """Rows by keys, of which the procedure is one, in the order of `ORDER`."""
    return ordered(table, keys, named=PROCEDURE, order=ORDER)


def of(runs: pd.DataFrame, name: str) -> pd.DataFrame:
    """Runs of one procedure."""
    return runs[runs[PROCEDURE] == name]


def paired(runs: pd.DataFrame, quantity: str, one: str, other: str) -> SeedMean:
    """One procedure less another, mean over pairs of runs that were poured alike."""
    return mean_difference(of(runs, one), of(runs, other), quantity)


def compared_with(runs: pd.DataFrame, quantity: str, one: str, others: Sequence[str], sign: int) -> tuple[str, Verdict]:
    """Whether one procedure is above (sign 1) or below (−1) each of others, pair by pair; numbers and verdict."""
    return compared({other: paired(runs, quantity, one, other) for other in others}, sign)


def by_procedure(runs: pd.DataFrame, quantity: str, form: str = ".3f") -> str:
    """`static 0.98 ± 0.01, …`: means over runs with their standard errors."""
    parts = []
    for name in ORDER:
        mean = mean_over_seeds(of(runs, name)[quantity])
        if mean.count:
            parts.append(f"{name} {told_number(mean.value, form, mean.standard_error)}")
    return ", ".join(parts) or "none"
