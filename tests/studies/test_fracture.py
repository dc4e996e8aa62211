"""The study of fracture: runs with known forces, and its findings on samples made to order."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, W
from synthetic.hooked import AFTER_REST, UPPER, weight, write_hooked_run
from synthetic.hooked import HELD as GOES_ON

from dem.record.run import open_run
from postprocess.measures.pull import WINDOW
from postprocess.statistics.points import ASPECT, SEED
from studies.fracture import (
    ABOVE,
    ACCOUNT,
    BEFORE,
    CAME_FREE,
    FREE_TIME,
    HELD,
    HELD_FAST,
    LEFT,
    LIMIT,
    LOST,
    NET,
    PEAK,
    PEAK_TIME,
    RAISED,
    STUDY,
    WINDOWS,
    WORK,
)
from studies.framework.procedures import CROSSINGS, EXTERNAL, INTERNAL, PHI, PROCEDURE, SHAPE, STATIC, THETA

ACTIVITY = {EXTERNAL: "shake", SHAPE: "shape-change", INTERNAL: "internal-oscillation"}
TOP, APEX, BASE = 0.6, 0.5, 0.4  # of a triangular history of force over the weight of all [-, s, s]
DEPTH = 0.01  # packing fraction at which twelve smarticles bury the hook


def made(procedure: str, **changes: Any) -> SyntheticRun:
    active = () if procedure == STATIC else (ACTIVITY[procedure], "relax")
    phases = (*AFTER_REST[:-1], *active, AFTER_REST[-1])
    keys = {"phases": phases, "packing": (DEPTH,) * len(phases), "frames_per_phase": 2, "theta": 10.0}
    return SyntheticRun(**{**keys, "shake_time": 2.0, **changes})


def write(directory: Path, procedure: str, **changes: Any) -> Path:
    run = made(procedure, **changes)
    height = TOP * run.count * weight(run)
    return write_hooked_run(directory, run, lambda time: height * np.clip(1 - np.abs(time - APEX) / BASE, 0, None))


def row_of(directory: Path) -> dict[str, Any]:
    return dict(STUDY.measured(open_run(directory)).row)


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    row = row_of(write(tmp_path, INTERNAL))
    for window, column in {WINDOW: PEAK, **WINDOWS}.items():
        # A window is rounded to whole samples, which have no finer structure.
        assert row[column] == pytest.approx(TOP * (1 - window / BASE / 4), rel=5e-3)
    assert (row[HELD], row[NET]) == pytest.approx((GOES_ON * row[PEAK], (1 - GOES_ON) * row[PEAK]), rel=1e-3)
    assert (row[PEAK_TIME], row[RAISED]) == pytest.approx((APEX, APEX * W), abs=0.005)
    # A hook at w per second is w/2 beyond the peak after 0.5 s; the force has come to 0 by then.
    assert row[LOST] == pytest.approx(1 - BASE / 2 / 0.5 / (1 - WINDOW / BASE / 4), abs=2e-3)
    assert row[WORK] == pytest.approx(TOP * BASE, rel=1e-3)
    assert row[BEFORE] == pytest.approx(1 / row["smarticles [-]"], rel=1e-5)
    assert (row[CAME_FREE], row[LEFT], row[HELD_FAST], row[LIMIT]) == (1, 0, 0, math.inf)
    assert row[FREE_TIME] == pytest.approx(APEX + 0.9 * BASE, abs=0.02)
    assert row[ACCOUNT] == pytest.approx(0, abs=1e-9)
    assert row[PHI] == pytest.approx(DEPTH, rel=1e-3)
    run = made(INTERNAL)
    assert row[ABOVE] == pytest.approx((run.shares() * run.height(DEPTH * (1 - 0.002)) > UPPER).mean())
    assert (row[PROCEDURE], row[THETA]) == (INTERNAL, 10)


def test_a_hook_that_stops_on_the_way_was_held_fast(tmp_path: Path) -> None:
    run = made(SHAPE)
    total = run.count * weight(run)
    force = {"limit": 1.5 * total, "stops": 0.8}
    row = row_of(write_hooked_run(tmp_path, run, lambda time: 1.5 * total * (time > 0.8), **force))
    assert (row[HELD_FAST], row[LIMIT], row[PEAK]) == (1, pytest.approx(1.5), pytest.approx(1.5, rel=1e-3))
    assert math.isnan(row[LOST])


def sample(procedure: str, seed: int, peak: float, crossings: float, **others: float) -> dict[str, object]:
    named = {PROCEDURE: procedure, SEED: seed, PEAK: peak, NET: peak, CROSSINGS: crossings}
    return named | {THETA: math.nan, ASPECT: 0.7, RAISED: 0.01, LOST: 0.3, HELD_FAST: 0.0} | others


def as_in_the_paper() -> pd.DataFrame:
    """Samples with all findings of the paper."""
    rows = []
    for seed in range(1, 9):
        rows += [sample(STATIC, seed, 0.3, 2.0), sample(EXTERNAL, seed, 0.6, 3.0)]
        rows += [sample(SHAPE, seed, 1.5, 6.0, **{LOST: 0.6})]
        # More entangled than the shaken pile, and weaker.
        for theta, crossings in ((5.0, 3.8), (10.0, 4.0), (15.0, 4.2), (30.0, 3.4)):
            rows.append(sample(INTERNAL, seed, 0.5 + 0.1 * (crossings - 4), crossings, **{THETA: theta}))
    table, generator = pd.DataFrame(rows), np.random.default_rng(0)
    for name, scale in ((PEAK, 1.0), (CROSSINGS, 1.0), (LOST, 1.0)):
        table[name] += 0.01 * scale * generator.normal(size=len(table))
    return table


def verdicts(table: pd.DataFrame) -> list[str]:
    return [str(finding.judge(table).verdict) for finding in STUDY.findings]


def test_brittle_is_what_loses_more_of_its_peak_and_is_unknown_where_a_pile_held_fast() -> None:
    table = as_in_the_paper()
    assert verdicts(table)[-1] == "found"
    gentle = table.assign(**{LOST: 0.9 - table[LOST]})
    assert verdicts(gentle)[-1] == "not found"
    table.loc[table.index[table[PROCEDURE] == INTERNAL][1], HELD_FAST] = 1.0  # at θ = 10°
    assert verdicts(table)[-1] == "not resolved"


def test_a_lower_bound_is_enough_to_be_above_another_and_not_to_be_below() -> None:
    def holding(procedure: str) -> list[str]:
        held = table.copy()
        held.loc[held.index[held[PROCEDURE] == procedure][0], HELD_FAST] = 1.0
        return verdicts(held)

    table = as_in_the_paper()
    assert holding(SHAPE)[:2] == ["found", "found"]
    assert holding(EXTERNAL)[:2] == ["not resolved", "found"]
    table = table[table[THETA] != 5]
    assert (holding(INTERNAL)[1], holding(INTERNAL)[5]) == ("not resolved", "not resolved")
    table[PEAK] = 2 - table[PEAK]
    assert (verdicts(table)[0], holding(SHAPE)[0]) == ("not found", "not resolved")
