"""The table: medians over seeds, and what links cost for the same overlap and for a tenth of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pandas as pd

from benchmarks.rivals.ours import RESIDUAL
from benchmarks.rivals.running import BOX_DEPTH, COST, DEPTH, MEAN_DEPTH, MEMORY, PHI_END, PHI_REST, SINKING, STEP
from benchmarks.rivals.settings import OSCILLATE, SHAKE

KEYS = ("activity", "engine", "setting")
MEDIANS = (COST, STEP, DEPTH, MEAN_DEPTH, BOX_DEPTH, PHI_REST, PHI_END, SINKING, RESIDUAL, MEMORY)
SAME, TENTH = "links at this overlap are cheaper by [1]", "links at a tenth of it are cheaper by [1]"
LEAST_COST, MOST_COST = "least cost [s/s]", "greatest cost [s/s]"

# One pile of the project's first days: Chrono at the paper's settings where MuJoCo at the trial's took 85 to 91.
CHRONO, CHRONO_BESIDE = 394.0, 88.0  # s/s
TRIAL = ("MuJoCo", "2e-4 s, CG 50, soft")  # that setting of MuJoCo
STANDARD = ("links", "standard")


def medians(rows: pd.DataFrame) -> pd.DataFrame:
    """One line per activity, engine and setting, in the order of the settings."""
    groups = rows.groupby(list(KEYS), sort=False)
    table = groups[[column for column in MEDIANS if column in rows]].median()
    table.insert(0, "seeds [1]", groups["seed"].nunique())
    table.insert(2, LEAST_COST, groups[COST].min())
    table.insert(3, MOST_COST, groups[COST].max())
    table = table.reset_index()
    for column, share in ((SAME, 1.0), (TENTH, 0.1)):
        table[column] = [_cheaper(table, row, share) for row in table.to_dict("records")]
    return table


def _cheaper(table: pd.DataFrame, row: dict[str, Any], share: float) -> float:
    """Cost of a row over that of the cheapest links whose overlap is at most a share of its; NaN: there are none."""
    if row["engine"] == STANDARD[0]:
        return math.nan
    links = table[(table["engine"] == STANDARD[0]) & (table["activity"] == row["activity"])]
    good = links[links[DEPTH] <= share * row[DEPTH]]
    return float(row[COST] / good[COST].min()) if len(good) else math.nan


def verdicts(table: pd.DataFrame) -> list[str]:
    """What was asked of links, with the numbers of this table; of what was measured alone."""
    said = []
    for activity, limit in ((SHAKE, 25.0), (OSCILLATE, 25.0)):
        ours = _row(table, activity, *STANDARD)
        rivals = table[(table["activity"] == activity) & (table["engine"] == "MuJoCo")]
        if ours is None:
            continue
        for rival in rivals.to_dict("records"):
            ratio = rival[COST] / ours[COST]
            said.append(
                f"{activity}: links, standard, {ratio:.1f} times as cheap as MuJoCo ({rival['setting']}), asked "
                f"{limit:g}: {_held(ratio >= limit)}; overlap {1e3 * ours[DEPTH]:.3f} against "
                f"{1e3 * rival[DEPTH]:.3f} mm"
            )
    for rival in table[(table["activity"] == OSCILLATE) & (table["engine"] == TRIAL[0])].to_dict("records"):
        ratio = _cheaper(table, rival, 1 / 20)
        told = "no setting of links was run" if math.isnan(ratio) else f"links are {ratio:.1f} times as cheap"
        said.append(
            f"{OSCILLATE}: at a twentieth of the overlap of MuJoCo ({rival['setting']}), {1e3 * rival[DEPTH]:.3f} mm, "
            f"{told}, asked 25: {_held(ratio >= 25)}"
        )
    trial, ours = _row(table, SHAKE, *TRIAL), _row(table, SHAKE, *STANDARD)
    if trial is not None and ours is not None:
        ratio = CHRONO / CHRONO_BESIDE * trial[COST] / ours[COST]
        said.append(
            f"{SHAKE}: links, standard, {ratio:.0f} times as cheap as Chrono would be, by its ratio to MuJoCo "
            f"({TRIAL[1]}), {CHRONO:g}/{CHRONO_BESIDE:g}, asked 150: {_held(ratio >= 150)}"
        )
    for activity in table["activity"].unique():
        others = table[(table["activity"] == activity) & (table["engine"] != STANDARD[0])]
        known, missing = others[others[TENTH].notna()], others[others[TENTH].isna()]
        if len(known):
            worst = known.loc[known[TENTH].idxmin()]
            said.append(
                f"{activity}: at a tenth of a rival's overlap links are cheaper by {worst[TENTH]:.2g} or more "
                f"(least: {worst['engine']}, {worst['setting']}), asked more than 1: {_held(worst[TENTH] > 1)}"
            )
        said += [
            f"{activity}: no setting of links was run with a tenth of the overlap of {row['engine']}, {row['setting']}"
            for row in missing.to_dict("records")
        ]
    return said


def _held(holds: bool) -> str:
    return "holds" if holds else "does not hold"


def _row(table: pd.DataFrame, activity: str, engine: str, setting: str) -> dict[str, Any] | None:
    found = table[(table["activity"] == activity) & (table["engine"] == engine) & (table["setting"] == setting)]
    return found.to_dict("records")[0] if len(found) else None


def markdown(table: pd.DataFrame, notes: Sequence[str]) -> str:
    """The table as Markdown, activities one after the other, and notes below."""
    parts = []
    for activity, rows in table.groupby("activity", sort=False):
        shown = rows.drop(columns="activity").dropna(axis="columns", how="all")
        head = [str(column) for column in shown.columns]
        lines = [f"## {activity}", "", _line(head), _line(["---"] * len(head))]
        lines += [_line([_shown(value) for value in row]) for row in shown.itertuples(index=False)]
        parts.append("\n".join(lines))
    return "\n\n".join([*parts, "\n".join(f"- {note}" for note in notes)]) + "\n"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:.3g}"
    return str(value)
