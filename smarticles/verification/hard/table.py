"""The table of everything that was checked: cases are run, one process each, and their rows written."""

from __future__ import annotations

import multiprocessing
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd

from dem.record.files import write_text
from dem.run.run import _git_revision
from smarticles.verification.hard.cases import CASES, Size, checked
from smarticles.verification.hard.check import Check

COLUMNS = ["case", "form", "what is checked", "measured", "limit", "verdict", "wall time [s]", "commit"]


def rows_of(name: str, size: Size, commit: str) -> list[dict[str, Any]]:
    """Run a case and give its rows of the table."""
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as scratch, ProcessPoolExecutor(1, mp_context=context) as pool:
        try:
            checks, wall = pool.submit(checked, name, size, Path(scratch) / "run").result()
        except Exception as error:
            # A defect of the suite or of the simulator: it belongs into the table like any other bad end.
            checks, wall = [Check("ends", f"{type(error).__name__}: {error}", "checked", good=False)], float("nan")
    return [
        {
            "case": name,
            "form": size,
            "what is checked": check.what,
            "measured": check.measured,
            "limit": check.limit,
            "verdict": "good" if check.good else "BAD",
            "wall time [s]": round(wall, 1),
            "commit": commit,
        }
        for check in checks
    ]


def write(table: pd.DataFrame, out: Path) -> None:
    """Write `cases.csv` and `cases.md`, each whole."""
    lines = ["# Stability, case by case", ""]
    for (name, form), rows in table.groupby(["case", "form"], sort=False):
        about = CASES[name].about if name in CASES else ""
        first = rows.iloc[0]
        lines += [
            f"## {name} ({form})",
            "",
            f"{about} {first['wall time [s]']:g} s of wall time, commit {first['commit']}.",
            "",
            "| what is checked | measured | limit | verdict |",
            "| --- | --- | --- | --- |",
            *(
                f"| {row['what is checked']} | {row['measured']} | {row['limit']} | {row['verdict']} |"
                for _, row in rows.iterrows()
            ),
            "",
        ]
    for name, text in (("cases.csv", table.to_csv(index=False)), ("cases.md", "\n".join(lines))):
        write_text(out / name, text)


def run_cases(out: Path, *, form: Size, only: Sequence[str], again: bool) -> bool:
    """Run what is asked for and is not in the table yet.

    Args:
        out: folder of the table.
        form: size of the cases.
        only: texts; cases whose name contains one of them. None given: all.
        again: run cases whose rows are there already, too.

    Returns:
        Whether all that was asked for is good.
    """
    chosen = [name for name in CASES if not only or any(text in name for text in only)]
    path, commit = out / "cases.csv", _git_revision()
    table = pd.read_csv(path, dtype=str) if path.exists() else pd.DataFrame(columns=COLUMNS)
    table["wall time [s]"] = table["wall time [s]"].astype(float)
    for name in chosen:
        known = (table["case"] == name) & (table["form"] == form)
        if (known.any() and not again) or (form == "short" and CASES[name].short is None):
            continue
        rows = pd.DataFrame(rows_of(name, form, commit), columns=COLUMNS)
        table = pd.concat([table[~known], rows], ignore_index=True) if len(table[~known]) else rows
        order = {case: k for k, case in enumerate(CASES)}
        table = table.sort_values("case", key=lambda names: names.map(order), kind="stable", ignore_index=True)
        write(table, out)
        bad = rows[rows["verdict"] == "BAD"]
        print(f"{'BAD ' if len(bad) else 'good'} {rows['wall time [s]'].iloc[0]:7.1f} s  {name}", flush=True)
        for _, row in bad.iterrows():
            print(f"       {row['what is checked']}: {row['measured']}, to be {row['limit']}", flush=True)
    bad = table[(table["verdict"] == "BAD") & table["case"].isin(chosen)]
    print(f"{table['case'].nunique()} cases in {path}; of those asked for {bad['case'].nunique()} are BAD")
    return bool(bad.empty)
