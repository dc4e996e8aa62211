"""The series of a synthetic run, as `dem.record.series` writes it."""

from collections.abc import Mapping
from pathlib import Path

import h5py
from numpy.typing import ArrayLike


def write_series(directory: Path, columns: Mapping[str, tuple[ArrayLike, str]], *, seed: int) -> None:
    """Writes `series.h5`; `columns` are values and unit by name."""
    with h5py.File(directory / "series.h5", "w") as file:
        file.attrs.update({"format": 1, "scene_sha256": "0" * 64, "seed": seed})
        for name, (values, unit) in columns.items():
            file[name] = values
            file[name].attrs.update({"unit": unit, "description": name})
