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

from dem.engine.kinds import engine_kind
from dem.record.files import write_json, write_text
from dem.run.run import _git_revision, versions
from smarticles.verification.case import Case, Ladder, Size
from smarticles.verification.check import Check
from smarticles.verification.hands.kinds import hands_on
from smarticles.verification.hard import cases as hard
from smarticles.verification.known import cases as known
from smarticles.verification.known.clumps import flat_impacts

T = TypeVar("T")

# -- known answers -----------------------------------------------------------------------------------------------------


def rows_of_answers(case: Case, engine: str) -> list[dict[str, object]]:
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
        for answer in case.answers(engine)
    ]


def rows_of_ladder(ladder: Ladder, engine: str) -> list[dict[str, object]]:
    """One row per time step."""
    order, why = ladder.scheme[engine]
    return [
        {
            "ladder": ladder.name,
            "quantity": ladder.quantity,
            "unit": ladder.unit,
            "time step [s]": step,
            "error [unit]": error,
            "size of the motion [unit]": ladder.size,
            "order of the scheme [1]": order,
            "about": ladder.about,
            "why": why,
        }
        for step, error in zip(ladder.steps, ladder.errors(hands_on(engine), ladder.steps), strict=True)
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


def compute_known(folder: Path, engine: str) -> None:
    """Run everything on an engine.

    Args:
        folder: where the tables go.
        engine: its name.

    Raises:
        RunError: the engine is not installed, or a disk is full.
    """
    told = versions((engine, engine_kind(engine).version()))
    absent = [{"case": case.name, "why": case.absent[engine]} for case in known.CASES if engine in case.absent]
    write_json(folder / "versions.json", {**told, "engine": engine})
    cases = [case for case in known.CASES if engine not in case.absent]
    _write(
        folder / "verification.csv", [row for one in cases for row in _timed(one.name, rows_of_answers, one, engine)]
    )
    write_text(folder / "absent.csv", pd.DataFrame(absent, columns=["case", "why"]).to_csv(index=False))
    _write(
        folder / "trajectories.csv",
        [row for one in known.LADDERS for row in _timed(one.name, rows_of_ladder, one, engine)],
    )
    impacts = _timed("flat impacts over the number of points", flat_impacts, hands_on(engine))
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


def rows_of_checks(name: str, engine: str, size: Size, commit: str) -> list[dict[str, Any]]:
    """Run a case on an engine and give its rows of the table."""
    if engine in hard.CASES[name].absent:
        absent = Check("not applicable", hard.CASES[name].absent[engine], "", good=True)
        return [_row(name, size, absent, verdict="n/a", wall=0.0, commit=commit)]
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as scratch, ProcessPoolExecutor(1, mp_context=context) as pool:
        try:
            checks, wall = pool.submit(hard.checked, name, engine, size, Path(scratch) / "run").result()
        except Exception as error:
            # A defect of the suite or of the simulator: it belongs into the table like any other bad end.
            checks, wall = [Check("ends", f"{type(error).__name__}: {error}", "checked", good=False)], float("nan")
    return [
        _row(name, size, check, verdict="good" if check.good else "BAD", wall=wall, commit=commit) for check in checks
    ]


def _row(name: str, size: Size, check: Check, *, verdict: str, wall: float, commit: str) -> dict[str, Any]:
    return {
        "case": name,
        "form": size,
        "what is checked": check.what,
        "measured": check.measured,
        "limit": check.limit,
        "verdict": verdict,
        "wall time [s]": round(wall, 1),
        "commit": commit,
    }


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


def run_cases(out: Path, engine: str, *, form: Size, only: Sequence[str], again: bool) -> bool:
    """Run what is asked for and is not in the table yet.

    Args:
        out: folder of the table.
        engine: its name.
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
        rows = pd.DataFrame(rows_of_checks(name, engine, form, commit), columns=COLUMNS)
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
