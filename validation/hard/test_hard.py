"""Tests of hard cases, of killed and resumed runs, and of the onset of instability."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from validation.access import engine_access
from validation.cases import HARD
from validation.conftest import ON, Tables
from validation.hard import broken, edges, violence
from validation.hard.kills import SAME, kills
from validation.hard.onset import SETTINGS, climb, onset
from validation.hard.runs import timed

assert all((broken, edges, violence))  # imported to register their cases

Call = Callable[..., Any]


@pytest.mark.filterwarnings("ignore")  # extreme scenes may warn
@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("size", ["short", pytest.param("long", marks=pytest.mark.long)])
@pytest.mark.parametrize(("name", "run", "short", "long", "absent"), HARD)
def test_hard_case(
    call: Call,
    call_alone: Call,
    tables: Tables,
    *,
    tmp_path: Path,
    name: str,
    run: Call,
    short: dict[str, Any] | None,
    long: dict[str, Any],
    absent: dict[str, str],
    size: str,
    engine: str,
) -> None:
    if engine in absent:
        pytest.skip(f"not applicable: {absent[engine]}")
    if short is None and size == "short":
        pytest.skip("only in its long form")
    tables.skip_recorded(engine, "cases", case=name, form=size)
    options = {**(short or {}), **(long if size == "long" else {})}
    arguments = (timed, run, engine_access(engine), tmp_path / "run")
    # The long form measures memory and time, and therefore runs in a new process.
    checks, wall = call_alone(*arguments, **options) if size == "long" else call(engine, *arguments, **options)
    rows = [
        {
            "case": name,
            "form": size,
            "what is checked": check.what,
            "measured": check.measured,
            "limit": check.limit,
            "verdict": "good" if check.good else "BAD",
            "wall time [s]": round(wall, 1),
        }
        for check in checks
    ]
    tables.write(engine, "cases", rows, ["case", "form"])
    assert checks
    assert not [check for check in checks if not check.good]


@pytest.mark.long
@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize(("seed", "number"), [(1, 17), (2, 17), (3, 16)])
def test_kills_keep_every_bit(tables: Tables, tmp_path: Path, seed: int, number: int, engine: str) -> None:
    tables.skip_recorded(engine, "kills", seed=seed)
    rows = kills(engine, number, tmp_path, seed=seed)
    tables.write(engine, "kills", rows, ["seed"])
    assert [row for row in rows if row[SAME] != "yes"] == []


@pytest.mark.long
@pytest.mark.parametrize("engine", ON)
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", SETTINGS)
def test_stable_step_is_below_the_onset(call_alone: Call, tables: Tables, name: str, seed: int, engine: str) -> None:
    tables.skip_recorded(engine, "onset_runs", scene=name, seed=seed)
    rows = call_alone(climb, engine, name, seed)
    tables.write(engine, "onset_runs", rows, ["scene", "seed"])
    recorded = tables.read(engine, "onset_runs")
    found = onset(name, pd.DataFrame(rows) if recorded is None else recorded[recorded["scene"] == name])
    tables.write(engine, "onset", [found], ["scene"])
    # The named fidelities use 0.9 of the stable step, which must be below the onset of blow-up.
    assert found["blow-up from, least [1]"] > 0.9
