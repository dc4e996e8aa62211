"""Engines from N = 50 to 100 000: the least of each stretch, and what is extrapolated and said so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from benchmarks import growth, scaling
from benchmarks.steps import LENGTH


def told(count: int, wall: list[float], memory: float = 100.0) -> dict[str, Any]:
    return {
        "count": count,
        "wall": wall,
        "processor": [0.5 * each for each in wall],
        "memory": memory,
        "step": 1e-4,
        "touches": 3.0,
        "spheres": 25,
    }


def test_on_one_core_the_least_processor_time_counts_and_on_two_of_every_stretch_the_least_wall_time() -> None:
    found = [told(100, [1.0, 3.0]), told(100, [2.0, 1.0], memory=120.0)]
    one, two = (growth.row_of("lammps", workers, "standard", found) for workers in (1, 2))
    assert one[growth.EACH] == pytest.approx(1e6 * 0.5 * 3.0 / (2 * LENGTH) / 100)
    assert two[growth.EACH] == pytest.approx(1e6 * 2.0 / (2 * LENGTH) / 100)
    assert two[growth.WALL] == pytest.approx(2.0 / (2 * LENGTH) / 1e-4)
    assert (two[growth.MEMORY], two[growth.MEASURED], two[growth.STEP]) == (120.0, True, pytest.approx(100))


def test_links_are_taken_from_their_own_benchmark(tmp_path: Path) -> None:
    pd.DataFrame(
        [
            {"N [-]": 270, "threads [-]": 2, scaling.WALL: 0.7, growth.MEMORY: 100.0},
            {"N [-]": 20_000, "threads [-]": 1, scaling.WALL: float("nan"), growth.MEMORY: 384.0},
        ]
    ).to_csv(tmp_path / "scaling.csv")
    later = pd.DataFrame([{"N [-]": 270, "threads [-]": 2, scaling.WALL: 0.3, growth.MEMORY: 200.0}])
    later.to_csv(tmp_path / "later.csv")
    (row,) = growth.of_links([tmp_path / "scaling.csv", tmp_path / "later.csv"]).to_dict("records")
    assert (row[growth.ENGINE], row[growth.WORKERS], row[growth.COUNT]) == ("links", 2, 270)
    # The step of standard on links, l/w = 0.7, is 105.3 us (results/bench/idle_activities.csv).
    assert row[growth.STEP] == pytest.approx(105.26, rel=1e-3)
    assert row[growth.WALL] == pytest.approx(0.3e-6 * 270 / 105.26e-6, rel=1e-3)


def test_ranks_are_taken_from_their_own_benchmark(tmp_path: Path) -> None:
    row = {"N": 5000, "one rank [us per step and smarticle]": 10.0, "two ranks [us]": 6.0}
    pd.DataFrame([row]).to_csv(tmp_path / "ranks.csv")
    one, two = growth.of_ranks(tmp_path / "ranks.csv").to_dict("records")
    assert (one[growth.WORKERS], two[growth.WORKERS]) == (1, 2)
    assert one[growth.WALL] / two[growth.WALL] == pytest.approx(10 / 6)
    assert one[growth.WALL] == pytest.approx(10e-6 * 5000 / (1e-6 * one[growth.STEP]))


def table() -> pd.DataFrame:
    """Wall time as N^1.2, memory as 100 + 0.01 N; a small pile that follows neither."""
    rows = [growth.row_of("lammps", 1, "standard", [told(50, [2.0], 500.0)])]
    for count in (1000, 5000, 20_000):
        rows.append(growth.row_of("lammps", 1, "standard", [told(count, [2 * count**1.2], 100 + 0.01 * count)]))
    return pd.DataFrame(rows)


def test_what_was_not_measured_is_extrapolated_from_large_piles_and_marked() -> None:
    rows = growth.extrapolated(table())
    assert rows[growth.COUNT].tolist() == [50_000, 100_000]
    assert not rows[growth.MEASURED].any()
    assert rows[growth.WALL].tolist() == pytest.approx([20_000**0.2 * n / LENGTH / 1e-4 for n in (50_000, 100_000)])
    assert rows[growth.EACH].tolist() == pytest.approx([1e6 * 20_000**0.2 / LENGTH] * 2)
    assert rows[growth.MEMORY].tolist() == pytest.approx([600.0, 1100.0])
    # Of one large pile alone no line of memory can be drawn.
    assert growth.extrapolated(table().tail(1))[growth.MEMORY].isna().all()


def test_the_figure_has_filled_and_open_markers(tmp_path: Path) -> None:
    whole = pd.concat([table(), growth.extrapolated(table())], ignore_index=True)
    (file,) = growth.draw(whole, tmp_path, ["a note"])
    assert file.name == "engines.png"
    assert file.stat().st_size > 10_000
