"""The time series of a run, `series.h5`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from dem.errors import InputError
from postprocess.errors import refuse

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

_FORMAT = 1
_REMEDY = "give the directory of a run that has recorded its series, or run it again"


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """The recorded quantities of a run against time; all arrays are read-only.

    Attributes:
        path: The file it came from.
        data: Arrays by name, e.g. "com_height_m": (n,), (n, 2) for barb 1 and barb 2, or (n, 3) for x, y, z. What
            there is depends on the scene: one that never actuates has no motors to tell of.
        units: Unit of each, e.g. "m"; "-" for none.
        descriptions: What each one is.
        scene_sha256: Hash of the scene the run was made from.
        seed: Seed of the run.
    """

    path: Path
    data: Mapping[str, NDArray[Any]] = field(repr=False)
    units: Mapping[str, str] = field(repr=False)
    descriptions: Mapping[str, str] = field(repr=False)
    scene_sha256: str
    seed: int

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The array of one quantity.

        Raises:
            InputError: The series does not hold it.
        """
        try:
            return self.data[name]
        except KeyError:
            msg = f"{self.path} holds no series '{name}'; choose one of: {', '.join(self.data)}"
            raise InputError(msg) from None

    def __len__(self) -> int:
        return len(self.time)

    @property
    def time(self) -> NDArray[np.float64]:
        """(n,) float64 [s], simulated time of each sample."""
        times: NDArray[np.float64] = self.data["time_s"]
        return times

    def nearest(self, time: float) -> int:
        """Index of the sample nearest in time.

        Args:
            time: Simulated time [s].

        Returns:
            Index into every array.
        """
        return int(np.argmin(np.abs(self.time - time)))


def read_series(directory: Path | str) -> Series:
    """Reads the time series of a run; the run may be done, failed or still going on.

    Args:
        directory: A run directory.

    Returns:
        The series with their units.

    Raises:
        InputError: The file is missing, damaged, or lacks what it must have.

    Source:
        ARCHITECTURE.md, "The run directory".

    Example:
        >>> series = read_series("runs/pile")  # doctest: +SKIP
        >>> series["com_height_m"][-1], series.units["com_height_m"]  # doctest: +SKIP
    """
    path = Path(directory) / "series.h5"
    if not path.is_file():
        refuse("series", path, "no such file", _REMEDY)
    try:
        with h5py.File(path, "r") as file:
            attributes = dict(file.attrs)
            data = {name: _frozen(file[name]) for name in file}
            texts = {key: {name: str(file[name].attrs[key]) for name in file} for key in ("unit", "description")}
    # h5py fails with OSError, KeyError or RuntimeError, depending on where the damage lies.
    except Exception as error:
        refuse("series", path, error, _REMEDY)
    _check(path, attributes, data)
    return Series(
        path=path,
        data=MappingProxyType(data),
        units=MappingProxyType(texts["unit"]),
        descriptions=MappingProxyType(texts["description"]),
        scene_sha256=str(attributes["scene_sha256"]),
        seed=int(attributes["seed"]),
    )


def _check(path: Path, attributes: dict[str, Any], data: dict[str, NDArray[Any]]) -> None:
    for key in ("format", "scene_sha256", "seed"):
        if key not in attributes:
            refuse("series", path, f"attribute '{key}' is missing", _REMEDY)
    if int(attributes["format"]) != _FORMAT:
        cause = f"'format' must be {_FORMAT}: got {attributes['format']}"
        refuse("series", path, cause, _REMEDY)
    for name in ("time_s", "phase"):
        if name not in data:
            refuse("series", path, f"dataset '{name}' is missing", _REMEDY)
    rows = len(data["time_s"])
    if rows == 0:
        refuse("series", path, "it holds no sample yet", _REMEDY)
    for name, values in data.items():
        if values.shape not in ((rows,), (rows, 2), (rows, 3)):
            cause = f"'{name}' has shape {values.shape}, 'time_s' has {rows} samples"
            refuse("series", path, cause, _REMEDY)


def _frozen(dataset: Any) -> NDArray[Any]:
    values = np.atleast_1d(np.asarray(dataset[()]))
    values.flags.writeable = False
    return values
