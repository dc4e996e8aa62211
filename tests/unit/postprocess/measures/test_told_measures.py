"""What `smarticles measure` tells of chains in a plane and of hooks that nothing touches: no empty column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic import SyntheticRun, write_run
from synthetic.hooked import AFTER_REST, write_hooked_run
from synthetic.strained import write_strained_run

from postprocess import measure_run, summarise_run
from postprocess.measures.strain import AT_PEAK, FRACTURE, PEAK, WIDENING, YIELD
from smarticles.main import main

HIGHEST = 0.6  # strain up to which the chain below holds


def force(strains: NDArray[np.float64]) -> NDArray[np.float64]:
    """3 N times strain, until it parts."""
    return np.where(strains <= HIGHEST, 3 * strains, 0.0)


def told(capsys: pytest.CaptureFixture[str], *words: str | Path) -> list[str]:
    assert main(["measure", *map(str, words)]) == 0
    return capsys.readouterr().out.splitlines()


def test_a_chain_has_its_force_and_strain(tmp_path: Path) -> None:
    row = summarise_run(write_strained_run(tmp_path / "a", force)).iloc[0]
    assert row[PEAK] == pytest.approx(3 * HIGHEST, rel=1e-3)
    assert row[AT_PEAK] == row[FRACTURE] == pytest.approx(HIGHEST, rel=1e-3)
    assert np.isnan(row[YIELD])
    assert row[WIDENING] == pytest.approx(0.1 * HIGHEST, rel=1e-3)


def test_a_plane_has_nothing_that_needs_a_height_or_a_container(tmp_path: Path) -> None:
    columns = set(measure_run(write_strained_run(tmp_path / "a", force)).columns)
    assert {"smarticles [-]", "contacts mean [-]", "pulled string force x [N]", "chain length [m]"} <= columns
    assert not [name for name in columns if any(word in name for word in ("phi", "height", "crossings", "cluster"))]


def test_a_chain_beside_a_pile_leaves_what_it_has_not_blank(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chain, pile = write_strained_run(tmp_path / "a", force), write_run(tmp_path / "b", SyntheticRun())
    lines = told(capsys, chain, pile)
    assert "φ" in lines[0]
    assert "peak F [N]" in lines[0]
    assert "-" in lines[2].split()
    assert any("φ by " in line for line in lines)


@pytest.mark.parametrize(("share", "notes"), [(0.0, 1), (1.0, 0)])
def test_a_hook_that_nothing_touched_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], share: float, notes: int
) -> None:
    run = write_hooked_run(
        tmp_path / "a", SyntheticRun(phases=AFTER_REST), lambda times: share * np.full_like(times, 1e-3)
    )
    found = [line for line in told(capsys, run) if line.startswith("note: ")]
    assert len(found) == notes
    if notes:
        assert found == [
            f"note: {run}: phase 2 (pull-hook): nothing touched the hook while it was raised, its force is 0 N "
            "throughout; lower hooks.upper_height_m or raise count"
        ]


def test_a_hook_that_its_limit_stopped_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    force = {"limit": 1e-3, "stops": 0.5}
    held = write_hooked_run(tmp_path / "a", SyntheticRun(phases=AFTER_REST), lambda t: 1e-3 * np.ones_like(t), **force)
    found = [line for line in told(capsys, held) if line.startswith("note: ")]
    assert found == [
        f"note: {held}: phase 2 (pull-hook): force_limit_N stopped the hook after 5.85 mm; its peak is a lower bound"
    ]
