"""The study of friction: curves that cross Gravish's values, and each finding from data that deserve each verdict."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic import SyntheticRun, write_run

from postprocess.statistics.seeds import Scatter
from studies.framework.shaken import DIGITISING_ERROR, FRICTION, phi
from studies.friction import STUDY, Curve

ORIGIN = {"note": "the full study as shipped", "command": "smarticles study friction --out friction"}
FRICTIONS = np.array([0.2, 0.4, 0.6, 0.8])


def curve(reference: float, half_width: float = 0.004, packing: Any = 0.20 - 0.2 * (FRICTIONS - 0.2)) -> Curve:
    """Make a curve whose φ falls by two thousandths per hundredth of friction."""
    widths = np.full(len(packing), half_width)
    scatter = Scatter(value=0.01, freedom=20)
    keys = {"friction": FRICTIONS[: len(packing)], "packing": np.asarray(packing), "half_widths": widths}
    return Curve(**keys, reference=reference, scatter=scatter)


def test_the_error_of_friction_is_that_of_packing_over_the_slope() -> None:
    value, low, high, place = curve(0.16, half_width=0.0).crossing()
    assert (value, place) == (pytest.approx(0.4), "within the range")
    assert (low, high) == pytest.approx((0.4 - DIGITISING_ERROR / 0.2, 0.4 + DIGITISING_ERROR / 0.2), abs=0.0011)


@pytest.mark.parametrize(
    ("reference", "value", "interval"), [(0.05, math.inf, (0.8, math.inf)), (0.25, -math.inf, (-math.inf, 0.2))]
)
def test_beyond_what_was_measured_nothing_is_extrapolated(
    reference: float, value: float, interval: tuple[float, float]
) -> None:
    assert curve(reference).crossing()[:3] == (value, *interval)


def test_odd_curves_have_crossings() -> None:
    # Scatter that crosses twice gives the middle; one within the error of the last point an open interval.
    assert curve(0.15, packing=[0.2, 0.14, 0.16, 0.1]).crossing()[0] == pytest.approx((11 / 30 + 19 / 30) / 2)
    assert curve(0.081).crossing()[2] == math.inf
    assert math.isnan(curve(0.15, half_width=math.nan).crossing()[1])
    assert curve(0.15, packing=[0.2]).crossing()[0] == math.inf
    # At the edge of the 95 % interval it is 97.5 % sure that φ is on one side of Gravish's.
    error = float(curve(0.16).error(np.array([0.4]))[0])
    assert curve(0.16 - error).within(10.0, 0.4) == pytest.approx(1)
    assert curve(0.16 - 2 * error).within(error, 0.4) == pytest.approx(0.025, abs=1e-3)


def test_what_was_put_into_runs_is_found(tmp_path: Path) -> None:
    runs = []
    for friction, seed in ((0.2, 1), (0.2, 2), (0.8, 1), (0.8, 2)):
        factor = (1 + 0.01 * (-1) ** seed) * (1 - 0.6 * (friction - 0.5))
        packing = tuple(factor * share for share in (0.09, 0.105, 0.13, 0.14))
        run = SyntheticRun(aspect_ratio=0.7, seed=seed, packing=packing, friction=friction)
        runs.append(write_run(tmp_path / f"mu{friction}_{seed}", run))
    other = write_run(tmp_path / "other", SyntheticRun(friction=0.4, friction_wall=0.2))
    report = STUDY.analyse([*runs, other], tmp_path / "out", **ORIGIN)
    row, factor = report.tables["runs"].set_index("run").loc["mu0.2_2"], 1.01 * 1.18
    assert [row[phi(stage)] / factor for stage in ("phi_0", "phi_f", "phi_f relaxed")] == pytest.approx(
        [0.105, 0.13, 0.14], rel=1e-4
    )
    for time in (5, 10, 20):
        # The series rises as 1 - exp(-5 t / 20 s); the mean over the last second lies a little below.
        value = factor * (0.105 + 0.025 * (1 - math.exp(-(time - 0.45) / 4)))
        assert row[phi(f"phi {time} s")] == pytest.approx(value, rel=2e-3)
    assert report.tables["crossings"].set_index("stage").loc["phi_f", FRICTION] == pytest.approx(0.5, abs=1e-3)
    assert {"phi_friction.png", "phi_time.png", "crossings.csv"} <= set(report.files)
    assert "friction is 0.4 between smarticles, 0.2 at walls" in report.missing[0].cause
    assert json.loads((tmp_path / "out" / "provenance.json").read_text())["study"] == "friction"
