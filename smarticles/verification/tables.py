"""The tables of everything that was checked: known answers, all at once; hard cases, each in a process of its own."""

from __future__ import annotations

import multiprocessing
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from dem.engine.yade.library import yade_version
from dem.record.files import write_json, write_text
from dem.run.run import _git_revision, versions
from smarticles.verification.case import Case, Ladder, Size
from smarticles.verification.check import Check
from smarticles.verification.hard import cases as hard
from smarticles.verification.known import cases as known
from smarticles.verification.known.clumps import flat_impacts

T = TypeVar("T")

# -- known answers -----------------------------------------------------------------------------------------------------


def rows_of_answers(case: Case) -> list[dict[str, object]]:
    """One row per answer."""
    return [
        {
            "case": case.name,
            "quantity": answer.quantity,
            "unit": answer.unit,
            "theory [unit]": answer.theory,
            "measured [unit]": answer.measured,
            "error [1]": answer.error,
            "tolerance [1]": answer.tolerance,
            "ok": answer.good,
            "error relative to [unit]": answer.scale or abs(answer.theory),
            "about": case.about,
            "source": case.theory,
            "reason of the tolerance": answer.reason,
        }
        for answer in case.answers()
    ]


def rows_of_ladder(ladder: Ladder) -> list[dict[str, object]]:
    """One row per time step."""
    return [
        {
            "ladder": ladder.name,
            "quantity": ladder.quantity,
            "unit": ladder.unit,
            "time step [s]": step,
            "error [unit]": error,
            "size of the motion [unit]": ladder.size,
            "order of the scheme [1]": ladder.order,
            "about": ladder.about,
            "why": ladder.why,
        }
        for step, error in zip(ladder.steps, ladder.errors(ladder.steps), strict=True)
    ]


_CLUMP_COLUMNS = {
    "rows": "rows [1]",
    "pitch": "pitch [1]",
    "spheres": "spheres [1]",
    "contacts": "contacts [1]",
    "nominal": "restitution asked for [1]",
    "parallel": "restitution, n in parallel [1]",
    "theory": "restitution, n in parallel and tilt [1]",
    "measured": "restitution measured [1]",
    "at_scene_step": "restitution at the scene's time step [1]",
    "theory_contact": "contact time, theory [s]",
    "measured_contact": "contact time measured [s]",
    "single_contact": "contact time of one elastic contact [s]",
    "theory_sunk": "depth at rest, theory [m]",
    "measured_sunk": "depth at rest measured [m]",
    "step": "time step of the scene [s]",
}


def compute_known(folder: Path) -> None:
    """Run everything.

    Args:
        folder: where the tables go.

    Raises:
        RunError: YADE is not installed, or a disk is full.
    """
    write_json(folder / "versions.json", versions(("yade", yade_version())))
    _write(
        folder / "verification.csv", [row for case in known.CASES for row in _timed(case.name, rows_of_answers, case)]
    )
    _write(folder / "trajectories.csv", [row for one in known.LADDERS for row in _timed(one.name, rows_of_ladder, one)])
    impacts = _timed("flat impacts over the number of spheres", flat_impacts)
    _write(
        folder / "clumps.csv", [{_CLUMP_COLUMNS[key]: value for key, value in asdict(one).items()} for one in impacts]
    )


def _timed(name: str, run: Callable[..., list[T]], *arguments: object) -> list[T]:
    begun = time.perf_counter()
    found = run(*arguments)
    print(f"{time.perf_counter() - begun:6.1f} s  {name}", flush=True)
    return found


def _write(path: Path, rows: list[dict[str, object]]) -> None:
    write_text(path, pd.DataFrame(rows).to_csv(index=False, float_format="%.10g"))


# -- hard cases --------------------------------------------------------------------------------------------------------

COLUMNS = ["case", "form", "what is checked", "measured", "limit", "verdict", "wall time [s]", "commit"]


def rows_of_checks(name: str, size: Size, commit: str) -> list[dict[str, Any]]:
    """Run a case and give its rows of the table."""
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as scratch, ProcessPoolExecutor(1, mp_context=context) as pool:
        try:
            checks, wall = pool.submit(hard.checked, name, size, Path(scratch) / "run").result()
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


def _write_cases(table: pd.DataFrame, out: Path) -> None:
    """Write `cases.csv` and `cases.md`, each whole."""
    lines = ["# Stability, case by case", ""]
    for (name, form), rows in table.groupby(["case", "form"], sort=False):
        about = hard.CASES[name].about if name in hard.CASES else ""
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
    chosen = [name for name in hard.CASES if not only or any(text in name for text in only)]
    path, commit = out / "cases.csv", _git_revision()
    table = pd.read_csv(path, dtype=str) if path.exists() else pd.DataFrame(columns=COLUMNS)
    table["wall time [s]"] = table["wall time [s]"].astype(float)
    for name in chosen:
        known = (table["case"] == name) & (table["form"] == form)
        if (known.any() and not again) or (form == "short" and hard.CASES[name].short is None):
            continue
        rows = pd.DataFrame(rows_of_checks(name, form, commit), columns=COLUMNS)
        table = pd.concat([table[~known], rows], ignore_index=True) if len(table[~known]) else rows
        order = {case: k for k, case in enumerate(hard.CASES)}
        table = table.sort_values("case", key=lambda names: names.map(order), kind="stable", ignore_index=True)
        _write_cases(table, out)
        bad = rows[rows["verdict"] == "BAD"]
        print(f"{'BAD ' if len(bad) else 'good'} {rows['wall time [s]'].iloc[0]:7.1f} s  {name}", flush=True)
        for _, row in bad.iterrows():
            print(f"       {row['what is checked']}: {row['measured']}, to be {row['limit']}", flush=True)
    bad = table[(table["verdict"] == "BAD") & table["case"].isin(chosen)]
    print(f"{table['case'].nunique()} cases in {path}; of those asked for {bad['case'].nunique()} are BAD")
    return bool(bad.empty)
