"""What is read off a strain test, on curves whose maxima, drops and slopes are known."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic.strained import write_strained_run

from dem.record.run import Run
from postprocess import measure_run, summarise_run
from postprocess.measures.strain import (
    AT_PEAK,
    BEND,
    DROP,
    FRACTURE,
    IMBALANCE,
    PEAK,
    SLIP_WIDENING,
    STIFFNESS,
    WALL,
    WIDENING,
    YIELD,
    StrainTest,
    first_drop,
    measured,
)


def pull(*, yields: bool, jolt: float = 0.0) -> StrainTest:
    """Force 3 N times strain to 1.2 N at 0.4, a loss of 0.3 N or of all; in the former case on to 1.8 N at 0.7."""
    strains = np.linspace(0, 0.9, 9001)
    forces = 3 * strains
    forces[:100] += jolt * np.sin(np.linspace(0, 20, 100))
    after = strains > 0.4
    forces[after] = 0.9 + 3 * (strains[after] - 0.4) if yields else 0.0
    forces[strains > 0.7] = 0.0
    widths = 0.06 * (1 + 0.01 * strains + np.where(after, 0.3, 0.0))
    return StrainTest(
        times=strains / 0.06,
        strains=strains,
        forces=forces,
        held=forces - 0.02,
        widths=widths,
        walls=np.where(after, 0.5, 0.0),
    )


@pytest.mark.parametrize("jolt", [0.0, 0.05])
def test_a_yield_drop_is_not_the_fracture(jolt: float) -> None:
    found = measured(pull(yields=True, jolt=jolt))
    assert found[PEAK] == pytest.approx(1.8, rel=1e-3)
    assert found[AT_PEAK] == found[FRACTURE] == pytest.approx(0.7, rel=1e-3)
    assert found[YIELD] == pytest.approx(0.4, abs=0.005)
    assert found[DROP] == pytest.approx(0.25, abs=0.01)
    assert found[STIFFNESS] == pytest.approx(3.0, rel=0.01)
    assert found[BEND] == pytest.approx(1.0, abs=0.01)
    assert found[WIDENING] == pytest.approx(0.307, abs=1e-3)
    assert found[SLIP_WIDENING] == pytest.approx(0.004, abs=1e-3)
    assert found[WALL] == pytest.approx(0.5)
    assert found[IMBALANCE] == pytest.approx(0.02)


def test_a_chain_that_parts_at_its_first_maximum_has_no_yield_drop() -> None:
    found = measured(pull(yields=False))
    assert math.isnan(found[YIELD])
    assert math.isnan(found[DROP])
    assert found[FRACTURE] == found[AT_PEAK] == pytest.approx(0.4, rel=1e-3)
    assert found[WIDENING] < 0.01


def test_a_first_drop_needs_a_tenth_of_the_force() -> None:
    rise = np.linspace(0, 1, 101)
    assert first_drop(rise) == (100, 0.0)
    assert first_drop(np.concatenate([rise, [0.95], 1 + rise]))[1] == 0.0
    top, loss = first_drop(np.concatenate([rise, [0.8, 0.7], 1 + rise]))
    assert (top, loss) == (100, pytest.approx(0.3))


HIGHEST = 0.6  # strain up to which the chain below holds


def force(strains: NDArray[np.float64]) -> NDArray[np.float64]:
    """3 N times strain, until it parts."""
    return np.where(strains <= HIGHEST, 3 * strains, 0.0)


def test_a_chain_has_its_force_and_strain(tmp_path: Path) -> None:
    row = summarise_run(Run(write_strained_run(tmp_path / "a", force))).iloc[0]
    assert row[PEAK] == pytest.approx(3 * HIGHEST, rel=1e-3)
    assert row[AT_PEAK] == row[FRACTURE] == pytest.approx(HIGHEST, rel=1e-3)
    assert np.isnan(row[YIELD])
    assert row[WIDENING] == pytest.approx(0.1 * HIGHEST, rel=1e-3)


def test_a_plane_has_nothing_that_needs_a_height_or_a_container(tmp_path: Path) -> None:
    columns = set(measure_run(Run(write_strained_run(tmp_path / "a", force))).columns)
    assert {"smarticles [-]", "contacts mean [-]", "pulled string force x [N]", "chain length [m]"} <= columns
    assert not [name for name in columns if any(word in name for word in ("phi", "height", "crossings", "cluster"))]
