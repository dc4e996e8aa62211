"""What the studies that take the container away have in common: their runs, means over seeds, and comparisons.

A run is poured, goes through one activity or none, rests, and loses its wall in the last phase.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import pandas as pd

from dem.errors import InputError
from postprocess.findings import Finding, Verdict, all_of, judge, negative, told
from postprocess.frames import Frame, FrameSequence, read_frames
from postprocess.manifest import PhaseRecord, RunManifest
from postprocess.measure import PASSIVE_PHASES
from postprocess.procedures_runs import (
    EXTERNAL,
    INTERNAL,
    PROCEDURE,
    PROCEDURES,
    SHAPE,
    STATIC,
    marked,
)
from postprocess.seeds import SeedMean, mean_over_seeds
from postprocess.study_runs import ASPECT, SEED, SEEDS

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
    """What the pile went through before: a key of `procedures_runs.PROCEDURES`' values, or static.

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
        keys: Columns that make a point.
        quantities: Columns that are averaged.

    Returns:
        The table; `… SE` is the standard error, `… 95 %` the half-width of the confidence interval.
    """
    rows = []
    for values, group in runs.groupby(list(keys), sort=True):
        row: dict[str, object] = dict(zip(keys, values if isinstance(values, tuple) else (values,), strict=True))
        row |= {SEEDS: len(group), "seeds": " ".join(map(str, sorted(group[SEED])))}
        for quantity in quantities:
            mean = mean_over_seeds(group[quantity])
            row[quantity] = mean.value
            row[marked(quantity, "SE")] = mean.standard_error
            row[marked(quantity, "95 %")] = mean.half_width
        rows.append(row)
    return in_order(pd.DataFrame(rows), [key for key in keys if key != PROCEDURE])


def in_order(table: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """Rows by keys, then by procedure as in `ORDER`."""
    ranks = table[PROCEDURE].map({name: rank for rank, name in enumerate(ORDER)})
    return table.assign(rank=ranks).sort_values([*keys, "rank"], ignore_index=True).drop(columns="rank")


def of(runs: pd.DataFrame, name: str) -> pd.DataFrame:
    """Runs of one procedure."""
    return runs[runs[PROCEDURE] == name]


def paired(runs: pd.DataFrame, quantity: str, one: str, other: str) -> SeedMean:
    """One procedure less another, mean over pairs of runs that were poured alike."""
    keys = [ASPECT, SEED]
    both = of(runs, one)[[*keys, quantity]].merge(of(runs, other)[[*keys, quantity]], on=keys).dropna()
    return mean_over_seeds(both[f"{quantity}_x"] - both[f"{quantity}_y"])


def compared(runs: pd.DataFrame, quantity: str, one: str, others: Sequence[str], sign: int) -> tuple[str, Verdict]:
    """Whether one procedure is above (sign 1) or below (−1) each of others, pair by pair; numbers and verdict."""
    effects = {other: paired(runs, quantity, one, other) for other in others}
    ours = "; ".join(f"less {other} {told(effect, 3)}" for other, effect in effects.items())
    return ours, all_of([judge(effect if sign > 0 else negative(effect)) for effect in effects.values()])


def by_procedure(runs: pd.DataFrame, quantity: str, form: str = ".3f") -> str:
    """`static 0.98 ± 0.01, …`: means over runs with their standard errors."""
    parts = []
    for name in ORDER:
        mean = mean_over_seeds(of(runs, name)[quantity])
        if mean.count:
            error = f" ± {mean.standard_error:{form}}" if mean.count > 1 else ""
            parts.append(f"{name} {mean.value:{form}}{error}")
    return ", ".join(parts) or "none"


def told_means(points: pd.DataFrame, keys: Sequence[Hashable], shown: dict[str, tuple[str, str]]) -> list[list[str]]:
    """Rows of a table of means for a person to read.

    Args:
        points: See `means`.
        keys: Columns that come first as they are.
        shown: Name and format of each quantity.
    """
    rows = []
    for _, point in points.iterrows():
        row = [f"{point[key]:g}" if isinstance(point[key], float) else str(point[key]) for key in keys]
        for quantity, (_, form) in shown.items():
            value, error = point[quantity], point[marked(quantity, "SE")]
            cell = "-" if pd.isna(value) else f"{value:{form}}"
            row.append(f"{cell} ± {error:{form}}" if pd.notna(error) else cell)
        rows.append(row)
    return rows


def markdown(
    title: str, found: Sequence[Finding], table: tuple[list[str], list[list[str]]], meanings: dict[str, str]
) -> list[str]:
    """Lines of `findings.md`: findings, points, and what their columns are."""
    lines = [f"# {title}", "", "| finding in the paper | ours (± standard error) | verdict | found if |"]
    lines += ["| --- " * 4 + "|"]
    lines += [f"| {one.paper} | {one.ours} | **{one.verdict}** | {one.criterion} |" for one in found]
    header, rows = table
    lines += ["", "## Points", "", "Means over seeds ± standard error.", ""]
    lines += [f"| {' | '.join(header)} |", "| --- " * len(header) + "|"]
    lines += [f"| {' | '.join(row)} |" for row in rows]
    lines += ["", "What the columns of `points.csv` are:", ""]
    return lines + [f"- `{name}`: {meaning}" for name, meaning in meanings.items()]
