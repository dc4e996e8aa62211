"""The studies of sensitivity: run directories with known packing fractions."""

import math
from pathlib import Path
from typing import Any

import pytest
from synthetic import SyntheticRun, write_run

from studies.framework.runs import DEFINITION
from studies.sensitivity import STUDY

PHI_0, PHI_F = f"phi_0 {DEFINITION} [-]", f"phi_f {DEFINITION} [-]"
ORIGIN = {"note": "the full study as shipped", "command": "smarticles study sensitivity --out sensitivity"}
# φ_0 and φ_f of each variant; seeds lie 1 % to either side.
LEVELS = {"draft": (0.100, 0.120), "pitch-0.5": (0.100, 0.120), "two-rows": (0.110, 0.108)}
SPREAD = {1: 0.99, 2: 1.0, 3: 1.01}


def write(directory: Path, **changes: Any) -> Path:
    keys = {"phases": ("deposit", "relax", "shake"), "shake_time": 1.5, "frames_per_phase": 2}
    return write_run(directory, SyntheticRun(**{**keys, "packing": (0.1, 0.1, 0.12), **changes}))


def test_means_and_changes_are_those_put_in(tmp_path: Path) -> None:
    runs = [
        write(tmp_path / f"{variant}_seed{seed}", seed=seed, packing=(0.1, before * factor, after * factor))
        for variant, (before, after) in LEVELS.items()
        for seed, factor in SPREAD.items()
        if (variant, seed) != ("two-rows", 3)
    ]
    report = STUDY.analyse([*runs, tmp_path / "diameter-1.27mm_seed1"], tmp_path / "out", **ORIGIN)
    table = report.tables["summary"].set_index("variant")
    assert table["seeds [-]"].to_dict() == {"draft": 3, "pitch-0.5": 3, "two-rows": 2}
    assert table.loc["draft", [PHI_0, PHI_F]].tolist() == pytest.approx([0.100, 0.120], rel=1e-4)
    # s/√n = 1 %/√3, times t(0.975; 2).
    expected = 0.0012 / math.sqrt(3) * 4.302653
    assert table.loc["draft", f"phi_f {DEFINITION} 95 % [-]"] == pytest.approx(expected, rel=1e-3)
    # Two seeds of 0.99 and 1.00.
    assert table.loc["two-rows", "phi_f change [%]"] == pytest.approx(100 * (0.9 * 0.995 - 1), abs=0.02)
    # Nothing was changed, seed by seed: no change may be found, and its error is no zero.
    assert table.loc["pitch-0.5", "phi_f change [%]"] == pytest.approx(0, abs=1e-6)
    error = 1.0 / math.sqrt(3) * math.sqrt(2) * 2.776445  # t(0.975; 4): equal spreads of 1 %
    assert table.loc["pitch-0.5", "phi_f change 95 % [%]"] == pytest.approx(error, rel=1e-3)
    assert table["phi_f clear"].to_dict() == {"draft": False, "pitch-0.5": False, "two-rows": True}
    assert [one.verdict for one in report.judged] == ["found", "found", "not resolved"]
    assert "two-rows -10.4 ± " in report.judged[1].ours
    assert {"sensitivity.png", "summary.csv"} <= set(report.files)
    assert len(report.missing) == 1
