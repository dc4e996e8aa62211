"""`make stability`: the long form of all cases, one process each; writes a table of everything that was checked.

A case whose rows are there is skipped, so that a run that was stopped goes on, and parts can be run apart.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, get_args

import pandas as pd

from dem.run import _git_revision
from stability.cases import CASES, Size, checked
from stability.check import Check

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
        partial = out / f".{name}.partial"
        partial.write_text(text, encoding="utf-8")
        partial.replace(out / name)


def main() -> int:
    """Run what is asked for and is not in the table yet."""
    parser = argparse.ArgumentParser(prog="python -m stability", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/stability"), help="folder of the table")
    parser.add_argument("--form", choices=get_args(Size), default="long", help="size of the cases")
    parser.add_argument("--only", nargs="+", metavar="TEXT", help="cases whose name contains one of these")
    parser.add_argument("--again", action="store_true", help="run cases whose rows are there already, too")
    parser.add_argument("--list", action="store_true", help="list the cases and run none")
    arguments = parser.parse_args()
    chosen = [name for name in CASES if not arguments.only or any(text in name for text in arguments.only)]
    if arguments.list:
        print(*chosen, sep="\n")
        return 0
    os.environ["OMP_NUM_THREADS"] = "1"
    arguments.out.mkdir(parents=True, exist_ok=True)
    path, commit = arguments.out / "cases.csv", _git_revision()
    table = pd.read_csv(path, dtype=str) if path.exists() else pd.DataFrame(columns=COLUMNS)
    table["wall time [s]"] = table["wall time [s]"].astype(float)
    for name in chosen:
        known = (table["case"] == name) & (table["form"] == arguments.form)
        if (known.any() and not arguments.again) or (arguments.form == "short" and CASES[name].short is None):
            continue
        rows = pd.DataFrame(rows_of(name, arguments.form, commit), columns=COLUMNS)
        table = pd.concat([table[~known], rows], ignore_index=True) if len(table[~known]) else rows
        order = {case: k for k, case in enumerate(CASES)}
        table = table.sort_values("case", key=lambda names: names.map(order), kind="stable", ignore_index=True)
        write(table, arguments.out)
        bad = rows[rows["verdict"] == "BAD"]
        print(f"{'BAD ' if len(bad) else 'good'} {rows['wall time [s]'].iloc[0]:7.1f} s  {name}", flush=True)
        for _, row in bad.iterrows():
            print(f"       {row['what is checked']}: {row['measured']}, to be {row['limit']}", flush=True)
    bad = table[(table["verdict"] == "BAD") & table["case"].isin(chosen)]
    print(f"{table['case'].nunique()} cases in {path}, {bad['case'].nunique()} of those asked for are BAD")
    return 1 if len(bad) else 0


if __name__ == "__main__":
    sys.exit(main())
