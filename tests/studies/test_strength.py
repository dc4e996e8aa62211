"""The study of strength: runs with known forces and piles that come off in part; its findings and shipped points."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic import SyntheticRun, write_frame
from synthetic.hooked import HELD, UPPER, weight, write_hooked_run
from synthetic.shapes import W

from dem.record.run import open_run
from postprocess.measures.pull import WINDOW
from postprocess.statistics.points import SEED
from studies.framework.procedures import EXTERNAL, INTERNAL, SHAPE, STATIC
from studies.strength import (
    ABOVE,
    BEFORE,
    BREAK,
    CARRIED,
    HELD_FAST,
    KEPT,
    LIMIT,
    LOST,
    PEAK,
    RAISED,
    STUDY,
    THROUGH,
    WORK,
)

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study strength --out strength"}
ACTIVITY = {EXTERNAL: "shake", SHAPE: "shape-change", INTERNAL: "internal-oscillation"}
APEX, BASE, DEPTH = 0.5, 0.4, 0.01
RISEN = 3


def write(directory: Path, procedure: str, *, seed: int = 1, top: float = 0.5, **stops: float) -> Path:
    """A run whose force is a triangle of a height over n W_s, and whose last frame has three smarticles risen by 2w."""
    active = () if procedure == STATIC else (ACTIVITY[procedure], "relax")
    phases = ("deposit", "relax", *active, "remove-container", "pull-hook")
    keys: dict[str, Any] = {"phases": phases, "packing": (DEPTH,) * len(phases), "frames_per_phase": 2}
    run = SyntheticRun(**keys, seed=seed, shake_time=2.0)
    total = run.count * weight(run)
    write_hooked_run(
        directory, run, lambda time: top * total * np.clip(1 - np.abs(time - APEX) / BASE, 0, None), **stops
    )
    vertices = run.vertices(DEPTH * (1 - 0.002))
    vertices[:RISEN, :, 2] += 2 * W
    last = sorted((directory / "frames").glob("*.vtu"))[-1]
    end = sum(run.durations[kind] for kind in phases)
    write_frame(last, vertices, time=end, phase=len(phases) - 1, contacts=np.zeros(run.count, int))
    return directory


def test_measures_are_those_put_in(tmp_path: Path) -> None:
    run = open_run(write(tmp_path / "one", STATIC))
    row: dict[str, Any] = STUDY.measure(run)
    blunt = 1 - WINDOW / BASE / 4
    assert row[PEAK] == pytest.approx(0.5 * blunt, rel=1e-3)
    assert row[RAISED] == pytest.approx(APEX * W, abs=0.005 * W)
    assert row[LOST] == pytest.approx(1 - BASE / 2 / 0.5 / blunt, abs=2e-3)
    assert row[WORK] == pytest.approx(0.5 * BASE, rel=1e-3)
    # Before the pull one smarticle rests on the hook, and nothing goes through.
    assert row[BEFORE] == pytest.approx(1 / run.manifest.count, rel=1e-5)
    assert row[THROUGH] == pytest.approx(HELD * 0.5 * blunt, rel=1e-3)
    assert row[CARRIED] == RISEN / run.manifest.count
    made = SyntheticRun(seed=1)
    before = made.vertices(DEPTH * (1 - 0.002))
    assert row[BREAK] == pytest.approx(before[:RISEN, :, 2].min(axis=1).mean())
    assert row[ABOVE] == pytest.approx((made.shares() * made.height(DEPTH * (1 - 0.002)) > UPPER).mean())
    assert (row[HELD_FAST], row[LIMIT], row[KEPT]) == (0, math.inf, pytest.approx(1))


def test_a_pile_that_is_held_fast_is_counted(tmp_path: Path) -> None:
    free = write(tmp_path / "free", SHAPE)
    held = write(tmp_path / "held", SHAPE, seed=2, limit=0.01, stops=0.6)
    report = STUDY.analyse([free, held], tmp_path / "out", **ORIGIN)
    runs = pd.read_csv(report.files["runs.csv"], comment="#").set_index(SEED)
    assert runs[HELD_FAST].tolist() == [0, 1]
    # What came off is not known.
    assert runs[CARRIED].isna().tolist() == [False, True]
    assert any("held fast: 1 of 2 runs" in line for line in report.footer)
