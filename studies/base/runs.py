"""What every study of shaken piles does with its runs: find the finished ones, measure them in one row each."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import pandas as pd

from dem.errors import InputError
from dem.record.manifest import PhaseRecord, RunManifest, read_run
from postprocess.measures.packing import COSTLY_DEFINITIONS, DEFINITIONS
from postprocess.measures.table import LAST_FRAMES, packing_change, summarise_run
from postprocess.statistics import points

DEFINITION = "second-highest-com"
"""Definition of the packing fraction that is compared with Gravish's."""

QUICK_DEFINITIONS = tuple(name for name in DEFINITIONS if name != "voronoi")
"""Definitions that take tenths of a second per frame at most; `voronoi` takes seconds."""

ASPECT, SEED, SEEDS, SHAKEN = points.ASPECT, points.SEED, points.SEEDS, "time shaken [s]"

STAGES: Mapping[str, str] = MappingProxyType(
    {
        "phi_0": "before shaking",
        "phi_f": "at the end of shaking",
        "phi_f relaxed": "after the relaxation that follows shaking",
    }
)
"""When a packing fraction is taken; each is a mean over the last frames of its phase."""

WHEN = f"before shaking and at the end of shaking, means over the last {LAST_FRAMES} frames or fewer"
"""How the stages are averaged, for footers."""

VARIANT = "variant"

_SHAKE = "shake"
_VARIANT_RUN = re.compile(r"(?P<variant>.+)_seed(?P<seed>\d+)")
# Runs without a relaxation at the end lack columns, and would put them behind these.
_TAIL = ["escaped at the end [-]", "frames averaged [-]", "scene_sha256", "run"]


@dataclass(frozen=True, kw_only=True)
class MissingRun:
    """A run directory that could not be used.

    Attributes:
        directory: As given.
        status: "not started", "unfinished", "failed", "interrupted", or "unusable" for one that
            cannot be read or was not shaken.
        cause: Why, as far as it is known.
    """

    directory: str
    status: str
    cause: str


def collect_runs(
    study: str,
    run_dirs: Sequence[Path | str],
    row: Callable[[RunManifest], dict[str, object]],
    *,
    one_fidelity: bool = True,
) -> tuple[list[RunManifest], list[dict[str, object]], tuple[MissingRun, ...]]:
    """Manifests and rows of the finished runs, and the others.

    Args:
        study: Its name, for messages.
        run_dirs: Run directories.
        row: One run's row of the table; an InputError makes the run unusable.
        one_fidelity: Whether all must have the same.

    Raises:
        InputError: No run is done, or the runs differ in fidelity and must not.
    """
    manifests: list[RunManifest] = []
    rows: list[dict[str, object]] = []
    missing: list[MissingRun] = []
    for directory in run_dirs:
        status = "unusable"
        try:
            run = read_run(directory)
            if run.status != "done":
                cause = run.cause or "it has not finished"
                missing.append(MissingRun(directory=str(directory), status=run.status, cause=cause))
                continue
            rows.append(row(run))
            manifests.append(run)
        except InputError as error:
            if not Path(directory, "run.json").exists():
                status = "not started"
            missing.append(MissingRun(directory=str(directory), status=status, cause=str(error)))
    if not manifests:
        why = f"; the first: {missing[0].directory}: {missing[0].cause}" if missing else ""
        msg = f"study {study}: none of {len(run_dirs)} runs is done{why}; finish a run first"
        raise InputError(msg)
    if one_fidelity:
        refuse_mixture(study, manifests, "fidelity", lambda run: run.fidelity)
    return manifests, rows, tuple(missing)


def refuse_mixture(
    study: str,
    manifests: Sequence[RunManifest],
    quantity: str,
    value: Callable[[RunManifest], object],
    *,
    within: Callable[[RunManifest], Hashable] = lambda _: None,
) -> None:
    """Refuses runs that must be alike in some quantity and are not.

    Args:
        study: Its name, for messages.
        manifests: The runs.
        quantity: Its name, for messages.
        value: The quantity of a run.
        within: Of which group a run is; only those of one group must be alike.

    Raises:
        InputError: Two runs differ in it.
    """
    firsts: dict[Hashable, RunManifest] = {}
    for run in manifests:
        first = firsts.setdefault(within(run), run)
        if value(run) != value(first):
            msg = (
                f"study {study}: runs of different {quantity} must not be averaged: "
                f"{first.directory} is {value(first)}, "
                f"{run.directory} is {value(run)}; analyse them apart"
            )
            raise InputError(msg)


def refuse_mixed_counts(study: str, manifests: Sequence[RunManifest]) -> None:
    """Refuses runs of one aspect ratio that differ in their number of smarticles.

    Raises:
        InputError: Two runs do.
    """
    refuse_mixture(
        study,
        manifests,
        "count",
        lambda run: f"{run.count} smarticles at l/w {run.aspect_ratio:g}",
        within=lambda run: round(run.aspect_ratio, 6),
    )


def refuse_repeats(
    study: str, manifests: Sequence[RunManifest], name: str, value: Callable[[RunManifest], str]
) -> None:
    """Refuses two runs with the same seed of the same point.

    Args:
        study: Its name, for messages.
        manifests: The runs.
        name: What a point of the study is called, e.g. "l/w".
        value: The point of a run.

    Raises:
        InputError: There are two.
    """
    seen: dict[tuple[str, int], RunManifest] = {}
    for run in manifests:
        key = (value(run), run.seed)
        if key in seen:
            msg = (
                f"study {study}: {name} = {key[0]} with seed {run.seed} is given twice, "
                f"{seen[key].directory} and {run.directory}; leave one out"
            )
            raise InputError(msg)
        seen[key] = run


def named_variant(directory: Path | str) -> tuple[str, int]:
    """Variant and seed of a run of a study of variants, by the name of its directory.

    Raises:
        InputError: It is not named like one.
    """
    found = _VARIANT_RUN.fullmatch(Path(directory).name)
    if found is None:
        msg = f"{directory}: not a run of this study: its runs are named VARIANT_seedN, such as draft_seed1"
        raise InputError(msg)
    return found["variant"], int(found["seed"])


def variant_of(run: RunManifest) -> str:
    """Variant of a run, by the name of its directory.

    Raises:
        InputError: It is not named like a run of such a study, or after another seed.
    """
    variant, seed = named_variant(run.directory)
    if seed != run.seed:
        msg = f"{run.directory}: its name says seed {seed}, run.json says {run.seed}; do not rename runs"
        raise InputError(msg)
    return variant


def variants_of(run_dirs: Sequence[Path | str]) -> list[str]:
    """All variants in the order given, those without a finished run among them."""
    known = [path for path in run_dirs if _VARIANT_RUN.fullmatch(Path(path).name)]
    return list(dict.fromkeys(named_variant(path)[0] for path in known))


def measured_row(run: RunManifest, definitions: Sequence[str]) -> dict[str, object]:
    """One run's row: φ by each definition and the crossings before and after shaking, and what the run was.

    Args:
        run: A finished run.
        definitions: Of the packing fraction; `DEFINITION` is always among them. The costly ones
            are taken of the last frame alone, before and at the end of shaking.

    Raises:
        InputError: It was not shaken after another phase, or cannot be read.
    """
    shakes = [phase for phase in run.phases if phase.type == _SHAKE]
    if not shakes or shakes[0].index == 0:
        types = ", ".join(phase.type for phase in run.phases)
        msg = f"{run.directory}: no shaking after another phase: its phases are {types}"
        raise InputError(msg)
    wanted = {"phi_0": shakes[0].index - 1, "phi_f": shakes[-1].index}
    if shakes[-1].index < run.phases[-1].index:
        wanted["phi_f relaxed"] = run.phases[-1].index
    cheap = [DEFINITION, *(set(definitions) - {DEFINITION} - COSTLY_DEFINITIONS)]
    summary = summarise_run(run.directory, definitions=cheap, phases=set(wanted.values()))
    if summary.empty:
        msg = f"{run.directory}: no frame of the phases around shaking; run it again"
        raise InputError(msg)
    table = summary.set_index("phase")
    for phase in wanted.values():
        if phase not in table.index:
            kind = run.phases[phase].type
            msg = f"{run.directory}: no frame of phase {phase} ({kind}); run it again"
            raise InputError(msg)
    row: dict[str, object] = {
        ASPECT: round(run.aspect_ratio, 6),
        SEED: run.seed,
        "smarticles [-]": run.count,
        "fidelity": run.fidelity,
        SHAKEN: sum(map(duration, shakes)),
    }
    for definition in DEFINITIONS:
        if definition in cheap:
            for stage, phase in wanted.items():
                row[f"{stage} {definition} [-]"] = table.loc[phase, f"phi {definition} [-]"]
        elif definition in definitions:
            change = packing_change(run.directory, definition=definition, last=1, activity={_SHAKE})
            row[f"phi_0 {definition} [-]"] = change.before.value
            row[f"phi_f {definition} [-]"] = change.after.value
    for stage, phase in wanted.items():
        row[f"{stage} {DEFINITION} SE in run [-]"] = table.loc[phase, f"phi {DEFINITION} SE [-]"]
    for name, stage in zip(("before", "after", "relaxed"), STAGES, strict=True):
        if stage in wanted:
            row[f"crossings {name} [-]"] = table.loc[wanted[stage], "crossings mean [-]"]
    row["escaped at the end [-]"] = table["escaped [-]"].iloc[-1]
    row["frames averaged [-]"] = int(table.loc[list(wanted.values()), "frames averaged"].min())
    row["scene_sha256"] = run.scene_sha256
    row["run"] = run.directory.name
    return row


def duration(phase: PhaseRecord) -> float:
    """How long a phase of a finished run took [s]."""
    if phase.start is None or phase.end is None:
        return math.nan
    return phase.end - phase.start


def runs_table(rows: Sequence[Mapping[str, object]]) -> pd.DataFrame:
    """One row per run, the columns that tell runs from measures at its ends."""
    table = pd.DataFrame(rows)
    return table[[*table.columns.difference(_TAIL, sort=False), *_TAIL]]


def measured_quantities(runs: pd.DataFrame) -> list[str]:
    """What is averaged over seeds: names of columns without their unit."""
    columns = [f"{stage} {definition}" for definition in DEFINITIONS for stage in STAGES]
    columns += ["crossings before", "crossings after", "crossings relaxed"]
    return [name for name in columns if f"{name} [-]" in runs.columns]


def told_shaken(runs: pd.DataFrame) -> str:
    """How long the runs were shaken, for footers."""
    return ", ".join(sorted({f"{time:g}" for time in runs[SHAKEN].round(3)}, key=float)) + " s"


def told_bars(counts: pd.Series, point: str) -> str:
    """What error bars mean, for footers.

    Args:
        counts: Seeds of each point.
        point: What a point of the study is called, e.g. "l/w".
    """
    if counts.max() > 1:
        return "Error bars: 95 % confidence of the mean over seeds, Student's t"
    return f"One seed per {point}: no error bars"


def told_seeds(runs: pd.DataFrame, counts: pd.Series, point: str) -> str:
    """Which seeds there are and how many per point, for footers; arguments as in `told_bars`."""
    seeds = " ".join(map(str, sorted(set(runs[SEED]))))
    return f"seeds {seeds} ({told_range(counts)} per {point})"


def told_range(counts: pd.Series) -> str:
    """`3` or `1 to 3`: how many there are of each."""
    return str(counts.min()) if counts.nunique() == 1 else f"{counts.min()} to {counts.max()}"
