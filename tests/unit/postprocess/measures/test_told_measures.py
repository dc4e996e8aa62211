"""What `smarticles measure` tells of chains in a plane and of hooks that nothing touches: no empty column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic.strained import write_strained_run

from dem.record.run import Run
from postprocess import measure_run, summarise_run
from postprocess.measures.strain import AT_PEAK, FRACTURE, PEAK, WIDENING, YIELD

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
