"""What a run directory holds, for tests to read."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np


def series(out: Path) -> dict[str, np.ndarray]:
    """The columns of a run's series."""
    with h5py.File(out / "series.h5") as file:
        return {name: dataset[()] for name, dataset in file.items()}


def frame_files(out: Path) -> list[Path]:
    """A run's frames in the order of time."""
    return sorted((out / "frames").glob("*.vtu"))
