"""The study of rods: fields and onsets that are known, and verdicts for made-up series."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dem.errors import InputError
from postprocess.statistics.points import SEED
from studies.rods import (
    ACN,
    DENSITY,
    KEPT,
    LEVEL,
    ORDER,
    POURED,
    SERIES,
    SHAKEN,
    SLENDER,
    SLIPPERY,
    STUDY,
    length_of,
    local_crossings,
    measure,
    onsets,
    spanning_level,
)

RATIOS = (8.0, 12.0, 16.0, 24.0, 32.0)


def test_the_spanning_level_is_that_of_the_weakest_point_of_the_best_way() -> None:
    field = np.ones((2, 2, 4))
    field[0, 0] = [9, 7, 3, 8]
    field[1, 1] = [5, 5, 5, 4]
    assert spanning_level(field) == 4
    # A way through cells that share an edge alone is none.
    diagonal = np.zeros((2, 1, 2))
    diagonal[0, 0, 0] = diagonal[1, 0, 1] = 1.0
    assert spanning_level(diagonal) == 0


def test_the_field_is_that_of_the_inside_of_the_pile() -> None:
    # Two crossed rods at half the height, on the axis of a wide container.
    segments = np.array([[[-1.0, 0, 2.0], [1, 0, 2]], [[0, -1, 2.01], [0, 1, 2.01]]])
    frame: Any = SimpleNamespace(segments=segments, body=np.array([0, 1]), floor_z=0.0)
    field = local_crossings(frame, length=2.0, radius=4.0, top=4.0)
    # Boxes of 5.6 and 3.2, points 0.5 apart.
    assert field.shape == (12, 12, 7)
    assert field.max() == field[5:7, 5:7, 2:5].max() > 0.3
    assert field[0].max() == field[:, :, 0].max() == 0


def series_of(onset: dict[str, float], level: dict[str, float], *, seeds: int = 8, noise: float = 0.02) -> pd.DataFrame:
    """Rows of all series; piles keep half at `onset`, where the spanning level is `level`."""
    generator, rows = np.random.default_rng(11), []
    for series, place in onset.items():
        for seed in range(1, seeds + 1):
            for ratio in RATIOS:
                # Levels scatter, so that they lie close to the onset, too.
                away = np.log(ratio / place) + noise * generator.standard_normal()
                rows.append(
                    {SERIES: series, SEED: seed, SLENDER: ratio, KEPT: 0.5 + 0.3 * away}
                    | {LEVEL: level[series] * np.exp(2 * away), DENSITY: 5 * ratio, ACN: ratio}
                )
    return pd.DataFrame(rows)


def test_onsets_are_those_put_in() -> None:
    onset, level = {SHAKEN: 17.0, POURED: 20.0}, {SHAKEN: 100.0, POURED: 150.0}
    found = onsets(series_of(onset, level, seeds=30, noise=0.3)).set_index(["against", SERIES])
    for series, place in level.items():
        row = found.loc[LEVEL, series]
        # Thresholds are tried 2 % apart.
        assert row["from [-]"] / 1.02 < place < 1.02 * row["to [-]"]
        assert row["half of piles stand at [-]"] == pytest.approx(place, rel=0.1)
        # Scatter moves piles across the onset in the aspect ratio, not in the level.
        assert found.loc[SLENDER, series]["from [-]"] < onset[series] < found.loc[SLENDER, series]["to [-]"]
    assert found.loc[LEVEL, SHAKEN]["runs [-]"] == 150


def verdicts(runs: pd.DataFrame) -> dict[str, str]:
    return {finding.id: str(finding.judge(runs).verdict) for finding in STUDY.findings}


def test_one_level_for_all_series_is_found() -> None:
    runs = series_of({SHAKEN: 14.0, POURED: 18.0, SLIPPERY: 20.0}, dict.fromkeys(ORDER, 100.0), seeds=60, noise=0.5)
    assert set(verdicts(runs).values()) == {"found"}


def test_other_levels_are_not_found() -> None:
    level = {SHAKEN: 100.0, POURED: 102.0, SLIPPERY: 1000.0}
    found = verdicts(series_of(dict.fromkeys(ORDER, 16.0), level, noise=0.2))
    assert (found["one-level-poured"], found["one-level-slippery"]) == ("found", "not found")
    one = verdicts(series_of({SHAKEN: 16.0}, {SHAKEN: 100.0}))
    assert (one["one-level-poured"], one["stands-from"]) == ("no data", "found")


def test_other_runs_are_left_out() -> None:
    run: Any = SimpleNamespace(path="run", scene={"particle": [{"shape": "ring"}]}, phases=[])
    with pytest.raises(InputError, match="not rods of one kind"):
        length_of(run)
    with pytest.raises(InputError, match="not a pour, a rest, a removal"):
        measure(run)
