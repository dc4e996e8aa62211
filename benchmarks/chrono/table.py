"""The tables: a row per run, by the measures of the study `procedures`, and means over seeds."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.chrono.cases import ACTIVITIES, RULES, Case
from dem.record.manifest import read_run
from postprocess.report.markdown import table_lines
from postprocess.statistics.points import told_number
from postprocess.statistics.seeds import mean_over_seeds
from studies.framework.activity import (
    ENERGY,
    HEIGHT,
    LOWEST,
    PHI_ACTIVE,
    SAMPLED,
    STRAIGHT,
    height_history,
    procedure_row,
)
from studies.framework.procedures import CROSSINGS, PHI, STATIC

HIGHEST = "highest com height over h0 [-]"
STATIC_PHI, STATIC_CROSSINGS = f"{STATIC} {PHI}", f"{STATIC} {CROSSINGS}"
COST = "wall time per simulated time [s/s]"
HELD = {
    "mean_tilt_rad": "mean tilt of barbs at their hinges [rad]",
    "largest_tilt_rad": "largest tilt of a barb at its hinge [rad]",
    "over_limit_share": "motors at the limit or above [-]",
    "greatest_torque_over_limit": "greatest torque over the limit [-]",
    "deepest_m": "deepest overlap by the engine [m]",
}
"""How well Chrono's solver held what it should, see `benchmarks.chrono.records.constraints`; columns of runs."""
KEYS = ("activity", "rules", "engine")
QUANTITIES = {
    HEIGHT: ("h/h0 at rest", ".3f", 1.0),
    HIGHEST: ("h/h0 highest", ".3f", 1.0),
    STATIC_PHI: ("φ_0", ".4f", 1.0),
    PHI_ACTIVE: ("φ_f", ".4f", 1.0),
    PHI: ("φ at rest", ".4f", 1.0),
    STATIC_CROSSINGS: ("⟨N⟩ static", ".2f", 1.0),
    CROSSINGS: ("⟨N⟩", ".2f", 1.0),
    ENERGY: ("E [1e-4 J]", ".2f", 1e4),
    SAMPLED: ("E by samples [1e-4 J]", ".2f", 1e4),
}
"""Columns that are averaged: how tables call them, their form, and by what they are multiplied there."""


def measured(case: Case, directory: Path) -> dict[str, Any]:
    """A run's row.

    Args:
        case: what was run.
        directory: of the finished run.
    """
    run = read_run(directory)
    row, (height, _) = procedure_row(run), height_history(run)
    kept = ("h0 [m]", STRAIGHT, LOWEST, "smarticles [-]", "escaped at the end [-]", "scene_sha256")
    facts = directory / "chrono.json"
    told = json.loads(facts.read_text(encoding="utf-8")) if facts.exists() else {}
    return {
        "activity": case.activity,
        "rules": case.rules,
        "engine": case.engine,
        "seed": case.seed,
        **{name: row[name] for name in QUANTITIES if name != HIGHEST},
        HIGHEST: float(height.max()),
        **{name: row[name] for name in kept},
        COST: (run.wall_time or math.nan) / (run.end_time or math.nan),
        **{column: told.get(name, math.nan) for name, column in HELD.items()},
        "commit": run.versions["git"],
        "run": case.name,
    }


def summary(runs: pd.DataFrame) -> pd.DataFrame:
    """One row per activity, rules and engine: seeds, mean of each quantity, and its standard error; NaN for one."""
    rows = []
    for key, group in runs.groupby(list(KEYS), sort=False):
        row: dict[str, Any] = {**dict(zip(KEYS, key, strict=True)), "seeds": group["seed"].nunique()}
        for name in QUANTITIES:
            mean = mean_over_seeds(group[name])
            row |= {name: mean.value, f"{name} SE": mean.standard_error if mean.count > 1 else math.nan}
        rows.append(row)
    places = {name: place for place, name in enumerate([*ACTIVITIES, *RULES, "chrono", "chrono-warm", "links"])}
    table = pd.DataFrame(rows)
    return table.sort_values(list(KEYS), key=lambda column: column.map(places), ignore_index=True)


def markdown(points: pd.DataFrame) -> str:
    """The table of `summary`, mean ± standard error; a single seed has none, and says so by its n."""
    heads = ["activity", "rules", "engine", "n", *(head for head, _, _ in QUANTITIES.values())]
    rows = []
    for row in points.to_dict("records"):
        cells = [str(row[key]) for key in KEYS] + [str(row["seeds"])]
        for name, (_, form, factor) in QUANTITIES.items():
            cells.append(told_number(factor * row[name], form, factor * row[f"{name} SE"]))
        rows.append(cells)
    return "\n".join(table_lines(heads, rows)) + "\n"
