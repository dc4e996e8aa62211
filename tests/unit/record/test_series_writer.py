"""Time series on disk: units on every dataset, one length, replaced whole."""

import math
from pathlib import Path

import h5py
import numpy as np
import pytest

from dem.record.columns import COLUMNS
from dem.record.packing import packing_fraction
from dem.record.series import SeriesWriter


def writer_of(folder: Path, rows: int = 0) -> SeriesWriter:
    writer = SeriesWriter(folder, COLUMNS, {"scene_sha256": "abc", "seed": 7})
    for number in range(rows):
        writer.add({name: 0.004 * number for name in COLUMNS} | {"container_force_N": np.full(3, number)})
    return writer


def test_every_dataset_has_unit_description_and_equal_length(tmp_path: Path) -> None:
    writer_of(tmp_path, rows=4).write()
    with h5py.File(tmp_path / "series.h5") as file:
        assert {name: dataset.attrs["unit"] for name, dataset in file.items()} == {
            name: column.unit for name, column in COLUMNS.items()
        }
        assert all(len(dataset.attrs["description"]) > 5 for dataset in file.values())
        assert {name: dataset.shape for name, dataset in file.items()} == {
            name: (4, 3) if name == "container_force_N" else (4,) for name in COLUMNS
        }
        assert dict(file.attrs) == {"format": 1, "scene_sha256": "abc", "seed": 7}
        assert file["container_force_N"][()].tolist() == [[k] * 3 for k in range(4)]


def test_writing_twice_replaces_the_file_and_restoring_cuts_it_back(tmp_path: Path) -> None:
    writer = writer_of(tmp_path, rows=2)
    writer.write()
    kept = writer.columns
    writer = writer_of(tmp_path, rows=3)
    for expected in ([0, 0.004, 0.008], [0, 0.004]):
        writer.write()
        with h5py.File(tmp_path / "series.h5") as file:
            assert file["time_s"][()] == pytest.approx(expected)
        writer.restore(kept)
    assert [path.name for path in tmp_path.iterdir()] == ["series.h5"]


def test_a_row_with_other_columns_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"other columns than the series: .*'count'.*'more'"):
        writer_of(tmp_path).add(dict.fromkeys(COLUMNS.keys() - {"count"}, 0.0) | {"more": 1.0})


def test_packing_fraction_of_the_second_highest() -> None:
    heights = np.array([0.01, 0.04, 0.02, 0.03])
    assert packing_fraction(heights, solid_volume=1e-8, radius=0.02) == pytest.approx(4e-8 / (math.pi * 4e-4 * 0.03))
    assert math.isnan(packing_fraction(heights[:1], solid_volume=1e-8, radius=0.02))
    assert math.isnan(packing_fraction(np.zeros(0), solid_volume=1e-8, radius=0.02))
    assert math.isnan(packing_fraction(np.array([-1.0, -2.0]), solid_volume=1e-8, radius=0.02))
