"""The runs of a study: the finished ones measured, the others listed, and what must not be averaged rejected."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
from numpy.typing import NDArray

from dem.errors import InputError
from dem.plan.steps import time_steps
from dem.record.document import Phase
from dem.record.run import Run, open_run
from dem.run.run import manifest
from dem.scene.reading import load_scene
from postprocess.statistics.columns import ASPECT, SEED
from studies.framework.tables import ENGINE

Row = Mapping[str, object]
"""Cells of one row of a table, by the names of its columns."""

# Runs without a relaxation at the end lack columns, and would put them behind these.
_TAIL = ["escaped at the end [-]", "frames averaged [-]", "scene_sha256", "run"]
_REMEDY = "give the results folder of an earlier analysis of this study, with runs.csv and provenance.json"


@dataclass(frozen=True, kw_only=True)
class MissingRun:
    """A run directory that could not be used.

    Attributes:
        directory: As given.
        status: "not started", "unfinished", "failed", "interrupted", or "unusable" for one that cannot be measured.
        cause: Why, as far as it is known.
    """

    directory: str
    status: str
    cause: str

    @property
    def common_cause(self) -> str:
        """The cause without the name of the directory, to be counted."""
        return self.cause.removeprefix(f"{self.directory}: ").replace(self.directory, "RUN")


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredRun:
    """A finished run and what was measured of it.

    Attributes:
        rows: Its rows of the table of runs: one, unless a study measures a run in several ways.
        history: Quantities against time by the names of columns, (n,) each; empty where a study has none.
    """

    run: Run
    rows: Sequence[Row] = field(repr=False)
    history: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False)

    @property
    def row(self) -> Row:
        """The first of its rows."""
        return self.rows[0]


@dataclass(frozen=True, kw_only=True, eq=False)
class Collected:
    """The runs of a study that are done and were measured, in the order given, and the others.

    Attributes:
        study: Name of the study, for messages.
    """

    study: str
    runs: Sequence[MeasuredRun]
    missing: Sequence[MissingRun]

    def table(self) -> pd.DataFrame:
        """Make the table of runs: with their engine where there are several, and what names a run at its end."""
        several = len({run.run.manifest.engine for run in self.runs}) > 1
        table = pd.DataFrame(
            [{ENGINE: run.run.manifest.engine, **row} if several else row for run in self.runs for row in run.rows]
        )
        tail = [name for name in _TAIL if name in table]
        return table[[*table.columns.difference(tail, sort=False), *tail]]

    def times(self) -> pd.DataFrame | None:
        """Put the histories of all runs one below the other; None where no run has one."""
        tables = [pd.DataFrame({"run": run.run.path.name, **run.history}) for run in self.runs if run.history]
        return pd.concat(tables, ignore_index=True) if tables else None

    def reject_mixture(
        self,
        quantity: str,
        value: Callable[[MeasuredRun], object],
        *,
        within: Callable[[MeasuredRun], Hashable] = lambda _: None,
    ) -> None:
        """Reject runs that differ in some quantity within a group.

        Raises:
            InputError: Two runs differ in it.
        """
        firsts: dict[Hashable, MeasuredRun] = {}
        for run in self.runs:
            first = firsts.setdefault(within(run), run)
            if value(run) != value(first):
                msg = (
                    f"study {self.study}: runs of different {quantity} must not be averaged: {first.run.path} is "
                    f"{value(first)}, {run.run.path} is {value(run)}; analyse them apart"
                )
                raise InputError(msg)

    def reject_repeats(self, point: Callable[[MeasuredRun], str]) -> None:
        """Reject two runs with the same seed of the same point.

        Raises:
            InputError: There are two.
        """
        seen: dict[tuple[str, int, str], MeasuredRun] = {}
        for run in self.runs:
            key = (point(run), run.run.manifest.seed, run.run.manifest.engine)
            if seen.setdefault(key, run) is not run:
                msg = (
                    f"study {self.study}: point = {key[0]} with seed {key[1]} is given twice, "
                    f"{seen[key].run.path} and {run.run.path}; leave one out"
                )
                raise InputError(msg)


def collect_runs(
    study: str,
    run_dirs: Sequence[Path | str],
    measure: Callable[[Run], MeasuredRun],
    *,
    earlier: Mapping[str, MeasuredRun] | None = None,
) -> Collected:
    """Measure the finished runs, and list the others.

    Args:
        study: Its name, for messages.
        run_dirs: Run directories.
        measure: Measures one run; an InputError makes the run unusable.
        earlier: Runs measured before by the names of their directories, for those whose directories are not there.

    Raises:
        InputError: No run is done.
    """
    runs: list[MeasuredRun] = []
    missing: list[MissingRun] = []
    for directory in run_dirs:
        before = (earlier or {}).get(Path(directory).name)
        if before is not None and not Path(directory).exists():
            runs.append(before)
            continue
        try:
            run = open_run(directory)
            if run.status.state == "done":
                runs.append(measure(run))
                continue
            status, cause = str(run.status.state), run.status.cause or "it has not finished"
        except InputError as error:
            status = "unusable" if Path(directory, "run.json").exists() else "not started"
            cause = str(error)
        missing.append(MissingRun(directory=str(directory), status=status, cause=cause))
    if not runs:
        why = f"; the first: {missing[0].directory}: {missing[0].cause}" if missing else ""
        msg = f"study {study}: none of {len(run_dirs)} runs is done{why}; finish a run first"
        raise InputError(msg)
    return Collected(study=study, runs=runs, missing=missing)


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """A run that a study plans: its scene file, and the hash of that scene."""

    scene: Path
    scene_sha256: str


def earlier_runs(results: Path | str, wanted: Mapping[str, Wanted]) -> dict[str, MeasuredRun]:
    """Read those runs of an earlier analysis that are of the scenes wanted, by name.

    What was measured comes from its table of runs, to the six digits that are there; versions and command come from its
    provenance. Only a run of the very scene counts, by name and hash. The rest of a manifest follows from the scene.

    Args:
        results: Folder with `runs.csv` and `provenance.json`.
        wanted: The runs planned, by name.

    Raises:
        InputError: The folder holds no such files, they are damaged, or none of its runs is wanted.
    """
    results = Path(results)
    table = read_runs(results)
    path = results / "provenance.json"
    try:
        runs = json.loads(path.read_text(encoding="utf-8"))["runs"]
        origins = {Path(run["directory"]).name: run for run in runs}
    except (OSError, ValueError, KeyError, TypeError) as error:
        cause = error.strerror if isinstance(error, OSError) else f"it is no provenance of a study ({error!r})"
        msg = f"cannot read {path}: {cause}; {_REMEDY}"
        raise InputError(msg) from None
    found: dict[str, MeasuredRun] = {}
    for name, rows in table.groupby("run", sort=False):
        run, origin = wanted.get(str(name)), origins.get(str(name))
        if run and origin and {run.scene_sha256, origin["scene_sha256"]} == set(rows["scene_sha256"]):
            cells: list[Row] = rows.drop(columns=ENGINE, errors="ignore").to_dict(orient="records")
            found[str(name)] = MeasuredRun(run=_manifest(run, origin), rows=cells)
    if not found:
        msg = f"{results}: none of its {table['run'].nunique()} runs is of a scene of this study as it is; {_REMEDY}"
        raise InputError(msg)
    return found


def read_runs(results: Path) -> pd.DataFrame:
    """Read the table of runs as a study wrote it.

    Raises:
        InputError: There is none, or it lacks the columns that name a run.
    """
    path = results / "runs.csv"
    try:
        table = pd.read_csv(path, comment="#", dtype={"run": str, "scene_sha256": str, SEED: int})
        cause = next((f"column '{name}' is missing" for name in ("run", "scene_sha256") if name not in table), "")
    except (OSError, ValueError) as error:
        cause = str((isinstance(error, OSError) and error.strerror) or error)
    if cause:
        msg = f"cannot read {path}: {cause}; {_REMEDY}"
        raise InputError(msg)
    return table


def _manifest(run: Wanted, origin: Mapping[str, Any]) -> Run:
    """Rebuild the run of an earlier analysis from its scene and provenance."""
    scene = load_scene(run.scene)
    versions = dict(origin["versions"])
    made = manifest(
        scene,
        Path(origin["directory"]),
        steps=time_steps(scene),
        command=origin["command"],
        made_by=(scene.engine, versions.get(scene.engine, "unknown")),
        threads=1,
    )
    found = Run(Path(origin["directory"]))
    # Its directory is not here.
    vars(found)["manifest"] = made.model_copy(update={"started": origin["started"], "versions": versions})
    return found


def duration(phase: Phase) -> float:
    """Compute how long a phase of a finished run took [s]."""
    if phase.start_s is None or phase.end_s is None:
        return math.nan
    return phase.end_s - phase.start_s


def run_columns(run: Run) -> dict[str, object]:
    """Give the cells that say what pile a run is of."""
    return {
        ASPECT: round(run.manifest.aspect_ratio, 6),
        SEED: run.manifest.seed,
        "smarticles [-]": run.manifest.count,
        "fidelity": run.manifest.fidelity,
    }


def last_columns(run: Run) -> dict[str, object]:
    """Give the cells that name a run, the last ones of its row."""
    return {"scene_sha256": run.manifest.scene_sha256, "run": run.path.name}
