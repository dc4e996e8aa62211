"""Files of synthetic runs, written by the writers of `dem.record` themselves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from dem.record.columns import EVERY
from dem.record.series import SeriesWriter


def write_series(directory: Path, columns: Mapping[str, ArrayLike], *, seed: int, scene_sha256: str = "0" * 64) -> None:
    """Writes `series.h5`: some of its columns, with all their samples."""
    described = {name: EVERY[name] for name in columns}
    writer = SeriesWriter(directory, described, {"scene_sha256": scene_sha256, "seed": seed})
    writer.restore({name: np.asarray(values) for name, values in columns.items()})
    writer.write()
