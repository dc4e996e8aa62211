"""Runs that an earlier analysis measured and whose directories are gone: its tables, held against the scenes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd

from dem.errors import InputError
from dem.plan.steps import time_steps
from dem.record.run import Run
from dem.run.run import manifest
from dem.scene.reading import load_scene
from studies.framework.runs import ENGINE, MeasuredRun, Row

_REMEDY = "give the results folder of an earlier analysis of this study, with runs.csv and provenance.json"


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """A run that a study plans.

    Attributes:
        scene: Its scene file.
        scene_sha256: Hash of that scene.
    """

    scene: Path
    scene_sha256: str


def earlier_runs(results: Path | str, wanted: Mapping[str, Wanted]) -> Mapping[str, MeasuredRun]:
    """The runs of an earlier analysis that are of the scenes wanted, by name.

    What was measured comes from its table of runs, to the six digits that are there; where a run comes from, versions
    and command among it, from its provenance. Only a run of the very scene counts, by name and hash. The rest of a
    manifest follows from the scene; its times do not, and there are none.

    Args:
        results: Folder with `runs.csv` and `provenance.json`.
        wanted: The runs planned, by name.

    Returns:
        Those of them that were measured, in the order of the table.

    Raises:
        InputError: The folder holds no such files, they are damaged, or none of its runs is wanted.
    """
    results = Path(results)
    table, origins = _table(results / "runs.csv"), _origins(results / "provenance.json")
    found: dict[str, MeasuredRun] = {}
    for name, rows in table.groupby("run", sort=False):
        run, origin = wanted.get(str(name)), origins.get(str(name))
        if run is None or origin is None:
            continue
        if {run.scene_sha256, origin["scene_sha256"]} != set(rows["scene_sha256"]):
            continue
        cells: list[Row] = [
            {str(column): value for column, value in row.items() if column != ENGINE}
            for row in rows.to_dict(orient="records")
        ]
        found[str(name)] = MeasuredRun(run=_manifest(run, origin), rows=cells)
    if not found:
        msg = f"{results}: none of its {table['run'].nunique()} runs is of a scene of this study as it is; {_REMEDY}"
        raise InputError(msg)
    return MappingProxyType(found)


def _table(path: Path) -> pd.DataFrame:
    try:
        table = pd.read_csv(path, comment="#", dtype={"run": str, "scene_sha256": str})
    except (OSError, ValueError) as error:
        cause = error.strerror if isinstance(error, OSError) else error
        msg = f"cannot read {path}: {cause}; {_REMEDY}"
        raise InputError(msg) from None
    lacking = [name for name in ("run", "scene_sha256") if name not in table]
    if lacking:
        msg = f"cannot read {path}: column '{lacking[0]}' is missing; {_REMEDY}"
        raise InputError(msg)
    return table


def _origins(path: Path) -> dict[str, Mapping[str, Any]]:
    try:
        runs = json.loads(path.read_text(encoding="utf-8"))["runs"]
        return {Path(run["directory"]).name: run for run in runs}
    except (OSError, ValueError, KeyError, TypeError) as error:
        cause = error.strerror if isinstance(error, OSError) else f"it is no provenance of a study ({error!r})"
        msg = f"cannot read {path}: {cause}; {_REMEDY}"
        raise InputError(msg) from None


def _manifest(run: Wanted, origin: Mapping[str, Any]) -> Run:
    """What the run said of itself, as far as scene and provenance tell."""
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
