"""Known answers from tables that are made up here: judged, told and drawn without YADE."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dem.errors import InputError
from smarticles.verification.report import BAND, clump_sentences, order_table, report_verification


def ladder(name: str, *, scheme: int, observed: float) -> list[dict[str, object]]:
    return [
        {
            "ladder": name,
            "quantity": "height",
            "unit": "m",
            "time step [s]": step,
            "error [unit]": 3e-3 * (step / 1e-5) ** observed,
            "size of the motion [unit]": 0.1,
            "order of the scheme [1]": scheme,
            "about": "a ball",
            "why": "leapfrog",
        }
        for step in (1e-5, 2e-5, 4e-5)
    ]


def check(*, error: float = 1e-4) -> dict[str, object]:
    return {
        "case": "rebound",
        "quantity": "speed",
        "unit": "m/s",
        "theory [unit]": 0.2,
        "measured [unit]": 0.2 * (1 + error),
        "error [1]": error,
        "tolerance [1]": 1e-3,
        "ok": abs(error) <= 1e-3,
        "error relative to [unit]": 0.2,
        "about": "a ball",
        "source": "energy",
        "reason of the tolerance": "rounding",
    }


def clump(*, rows: int, contacts: int) -> dict[str, float]:
    return {
        "rows [1]": rows,
        "pitch [1]": 1.0,
        "spheres [1]": rows * contacts,
        "contacts [1]": contacts,
        "restitution asked for [1]": 0.7,
        "restitution, n in parallel [1]": 0.7 ** np.sqrt(contacts),
        "restitution, n in parallel and tilt [1]": 0.7 ** np.sqrt(contacts),
        "restitution measured [1]": 0.7 ** np.sqrt(contacts),
        "restitution at the scene's time step [1]": 0.5,
        "contact time, theory [s]": 1e-3 / np.sqrt(contacts),
        "contact time measured [s]": 1e-3 / np.sqrt(contacts),
        "contact time of one elastic contact [s]": 1e-3,
        "depth at rest, theory [m]": 1e-6 / contacts,
        "depth at rest measured [m]": 1e-6 / contacts,
        "time step of the scene [s]": 5e-5,
    }


def tables(folder: Path, *, error: float = 1e-4, observed: float = 2.0) -> Path:
    pd.DataFrame([check(), check(error=error)]).to_csv(folder / "verification.csv", index=False)
    rows = [*ladder("first", scheme=1, observed=1.0), *ladder("second", scheme=2, observed=observed)]
    pd.DataFrame(rows).to_csv(folder / "trajectories.csv", index=False)
    pd.DataFrame([clump(rows=1, contacts=4), clump(rows=2, contacts=16)]).to_csv(folder / "clumps.csv", index=False)
    (folder / "versions.json").write_text(json.dumps({"smarticles": "0", "git": "abc", "yade": "2023"}))
    return folder


def test_all_that_is_met_is_told_and_drawn(tmp_path: Path) -> None:
    report = report_verification(tables(tmp_path), command="smarticles verify")
    assert report.failed == ()
    assert {"orders.csv", "verification.md", "orders.png", "clumps.png"} <= set(report.files)
    assert all(path.stat().st_size for path in report.files.values())
    text = (tmp_path / "verification.md").read_text()
    assert "2 of 2 quantities and 2 of 2 orders are as theory has them." in text
    assert "git abc" in text


def test_an_error_beyond_its_tolerance_fails(tmp_path: Path) -> None:
    (line,) = report_verification(tables(tmp_path, error=-0.01), command="").failed
    assert line == "rebound, speed: 0.198 m/s, theory 0.2: error -0.01, tolerance 0.001"
    assert f"- **not**: {line}" in (tmp_path / "verification.md").read_text()


@pytest.mark.parametrize("observed", [1.0, 1.5, 2.5, 0.0])
def test_another_order_than_the_schemes_fails(tmp_path: Path, observed: float) -> None:
    (line,) = report_verification(tables(tmp_path, observed=observed), command="").failed
    assert line.startswith("second: observed order")


def test_band_parts_the_first_order_from_the_second() -> None:
    assert BAND < 0.5
    orders = order_table(pd.DataFrame(ladder("one", scheme=2, observed=2 - 0.9 * BAND)))
    assert orders["ok"].all()
    assert orders["order observed [1]"].iloc[0] == pytest.approx(2 - 0.9 * BAND)
    assert orders["error at the finest step [unit]"].iloc[0] == pytest.approx(3e-3)


def test_sentences_tell_what_flat_impacts_are_not() -> None:
    damped, stiff = clump_sentences(pd.DataFrame([clump(rows=1, contacts=4), clump(rows=2, contacts=16)]))
    assert "asked for is 0.7" in damped
    assert "0.49 of its speed on 4 contacts and 0.24 on 16" in damped
    assert "4.0 times less and touches 2.0 times shorter" in stiff


def test_missing_table_is_one_clear_line(tmp_path: Path) -> None:
    tables(tmp_path)
    (tmp_path / "trajectories.csv").unlink()
    with pytest.raises(InputError, match=r"trajectories\.csv: cannot be read .* compute it by `smarticles verify"):
        report_verification(tmp_path, command="")
