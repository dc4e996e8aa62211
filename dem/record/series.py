"""Time series of a run: sampled often, small, one HDF5 file with units."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from dem.record import names
from dem.record.columns import Columns
from dem.record.files import write_whole


def packing_fraction(heights: NDArray[np.float64], *, solid_volume: float, radius: float) -> float:
    """φ by the second-highest centre of mass, the paper's definition; NaN for fewer than two smarticles.

    Args:
        heights: (N,) centres of mass above the floor [m].
        solid_volume: of one smarticle [m³].
        radius: of the container [m].
    """
    if len(heights) < 2:
        return math.nan
    height = np.partition(heights, -2)[-2]
    return float(len(heights) * solid_volume / (math.pi * radius**2 * height)) if height > 0 else math.nan


@dataclass
class SeriesWriter:
    """Keeps rows, and rewrites `series.h5` whole when asked.

    Args:
        folder: the run directory.
        described: what the columns are; every row has a value for each of them.
        attributes: root attributes: scene hash, seed.
    """

    folder: Path
    described: Columns
    attributes: Mapping[str, Any]
    _rows: dict[str, list[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._rows = {name: [] for name in self.described}

    def add(self, row: Mapping[str, Any]) -> None:
        """Take one row: a number, (2,) or (3,) values for each column."""
        if row.keys() != self._rows.keys():
            msg = f"a row has other columns than the series: {sorted(row.keys() ^ self._rows.keys())}"
            raise ValueError(msg)
        for name, value in row.items():
            self._rows[name].append(value)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The series so far: (n,), (n, 2) or (n, 3) arrays by name."""
        return {name: np.array(values) for name, values in self._rows.items()}

    def restore(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Go on from where `columns` were taken."""
        self._rows = {name: list(columns[name]) for name in self.described}

    def write(self) -> None:
        """Rewrite the file with all rows.

        Raises:
            RunError: it cannot be written.
        """
        write_whole(self.folder / names.SERIES, self._write)

    def _write(self, path: Path) -> None:
        # Made in memory: on a full disk HDF5's own library does not fail cleanly but takes the process with it.
        content = io.BytesIO()
        with h5py.File(content, "w") as file:
            file.attrs["format"] = names.SERIES_FORMAT
            for name, value in self.attributes.items():
                file.attrs[name] = value
            columns = self.columns
            for name, column in self.described.items():
                dataset = file.create_dataset(name, data=columns[name])
                dataset.attrs["unit"] = column.unit
                dataset.attrs["description"] = column.description
        path.write_bytes(content.getvalue())
