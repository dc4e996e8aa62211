"""The study of casting: piles that were laid by hand into a mould."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic.released import stack, write_released

from dem.record.run import open_run
from studies.casting import (
    FILLED,
    FILLED_AFTER,
    HEIGHT,
    KEPT,
    MATERIAL,
    MATERIAL_AFTER,
    NECK,
    OVERLAP,
    STUDY,
    WHOLE_KEPT,
)

MOULD = [
    {"radius_m": 0.012, "height_m": 0.006},
    {"radius_m": 0.0108, "height_m": 0.006},
    {"radius_m": 0.0096, "height_m": 0.006},
    {"radius_m": 0.0096, "height_m": 0.1},
]
KEYS: dict[str, Any] = {"tiers": MOULD, "aspect_ratio": 0.8}


def crossed(count: int) -> NDArray[np.float64]:
    """Lay U-shapes on each other, each turned by a right angle against the one below."""
    pile = stack(count, 0.8)
    pile[1::2] = pile[1::2] @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    return pile


def row_of(directory: Path) -> dict[str, Any]:
    return dict(STUDY.measured(open_run(directory)).row)


def test_a_run_has_what_each_tier_holds_before_and_after(tmp_path: Path) -> None:
    # 14 levels of 1.27 mm before, 17.8 mm; 10 after, 12.7 mm, the lowest four with two smarticles each.
    before, after = crossed(14), np.concatenate([crossed(10), crossed(10)])[:14]
    row = row_of(write_released(tmp_path, "internal", before=before, after=after, **KEYS))
    # Centrelines lie at 0.635, 1.905 … mm: five of them below 6 mm, four below 12 and five below 18 mm.
    assert [row[name] for name in MATERIAL.values()] == pytest.approx([5 / 14, 4 / 14, 5 / 14])
    assert [row[name] for name in MATERIAL_AFTER.values()] == pytest.approx([9 / 14, 4 / 14, 1 / 14])
    assert row[NECK] == pytest.approx(0)
    assert row[FILLED_AFTER["upper"]] < 0.3 * row[FILLED["upper"]]
    assert row[KEPT["lower"]] == pytest.approx(1, abs=0.02)
    assert row[KEPT["upper"]] == pytest.approx(row[FILLED_AFTER["upper"]] / row[FILLED["upper"]], rel=0.02)
    assert row[WHOLE_KEPT] == pytest.approx(row[OVERLAP], abs=0.05)  # nothing lies outside the mould
    assert row[HEIGHT] == pytest.approx(13.5 * 1.27e-3, rel=0.05)


def test_a_tier_that_holds_less_than_the_ball_has_no_share(tmp_path: Path) -> None:
    pile = crossed(9)  # 11.4 mm high: all in the lower two tiers
    upright = pile[-1:].copy()
    upright[..., 2] = 0.0115 + np.array([0.005, 0, 0, 0.005])  # but for the ends of two barbs
    pile = np.concatenate([pile, upright])
    row = row_of(write_released(tmp_path, "static", before=pile, after=pile, **KEYS))
    assert 0 < row[FILLED["upper"]] < 0.05
    assert (row[KEPT["lower"]], row[KEPT["middle"]], row[WHOLE_KEPT], row[OVERLAP]) == (1, 1, 1, 1)
    assert math.isnan(row[KEPT["upper"]])
