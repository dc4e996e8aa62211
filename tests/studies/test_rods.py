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
    AT_ONSET,
    DENSITY,
    KEPT,
    LEVEL,
    ONSET,
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


def series_of(onset: dict[str, float], level: dict[str, float], *, seeds: int = 8) -> pd.DataFrame:
    """Rows of all series; piles keep half at `onset`, where the spanning level is `level`."""
    generator, rows = np.random.default_rng(11), []
    for series, place in onset.items():
        for seed in range(1, seeds + 1):
            noise = 0.02 * generator.standard_normal(2)
            for ratio in RATIOS:
                away = np.log(ratio / place)
                rows.append(
                    {SERIES: series, SEED: seed, SLENDER: ratio, KEPT: 0.5 + 0.3 * (away + noise[0])}
                    | {LEVEL: level[series] * np.exp(2 * away + noise[1]), DENSITY: 5 * ratio, ACN: ratio}
                )
    return pd.DataFrame(rows)


def test_onsets_are_those_put_in() -> None:
    onset, level = {SHAKEN: 17.0, POURED: 20.0}, {SHAKEN: 100.0, POURED: 150.0}
    found = onsets(series_of(onset, level)).groupby(SERIES)[[ONSET, AT_ONSET]].mean()
    for series, place in onset.items():
        # Eight seeds of 2 % each: 4 standard errors.
        assert found.loc[series, ONSET] == pytest.approx(place, rel=0.03)
        assert found.loc[series, AT_ONSET] == pytest.approx(level[series], rel=0.07)
    late = onsets(series_of({SHAKEN: 60.0}, {SHAKEN: 100.0}, seeds=1))
    assert late[[ONSET, AT_ONSET]].isna().all(axis=None)


def verdicts(runs: pd.DataFrame) -> dict[str, str]:
    tables = {"onsets": onsets(runs)}
    return {finding.id: str(finding.judge(runs, tables).verdict) for finding in STUDY.findings}


def test_one_level_for_all_series_is_found() -> None:
    # With equal noise in both, seeds cancel; the levels are alike although the onsets are not.
    found = verdicts(series_of({SHAKEN: 14.0, POURED: 18.0, SLIPPERY: 20.0}, dict.fromkeys(ORDER, 100.0)))
    assert set(found.values()) == {"found"}


def test_other_levels_are_not_found() -> None:
    level = {SHAKEN: 100.0, POURED: 102.0, SLIPPERY: 300.0}
    found = verdicts(series_of(dict.fromkeys(ORDER, 16.0), level))
    assert (found["one-level-poured"], found["one-level-slippery"]) == ("found", "not found")
    one = verdicts(series_of({SHAKEN: 16.0}, {SHAKEN: 100.0}))
    assert (one["one-level-poured"], one["stands-from"]) == ("no data", "found")


def test_other_runs_are_left_out() -> None:
    run: Any = SimpleNamespace(path="run", scene={"particle": [{"shape": "ring"}]}, phases=[])
    with pytest.raises(InputError, match="not rods of one kind"):
        length_of(run)
    with pytest.raises(InputError, match="not a pour, a rest, a removal"):
        measure(run)
