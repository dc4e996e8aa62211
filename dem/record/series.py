"""Time series of a run: samples of its quantities in one HDF5 file with units."""

from __future__ import annotations

import io
import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from dem.arrays import Array
from dem.errors import InputError
from dem.record import names
from dem.record.columns import COMPONENTS, Columns
from dem.record.files import cannot_read, write_whole
from dem.record.frame import frozen

if TYPE_CHECKING:
    import pandas as pd

PERIOD = 1.0  # s of wall time between two rewrites of the file by `keep_up`
_REMEDY = "give the directory of a run that has recorded its series, or run it again"


@dataclass
class SeriesWriter:
    """Writer of the series, which keeps all rows in memory and always rewrites `series.h5` completely."""

    folder: Path  #: The run directory
    described: Columns  #: Columns of each row, by name
    attributes: Mapping[str, Any]  #: Attributes of the file
    _rows: dict[str, list[Any]] = field(default_factory=dict)
    _written: float = -math.inf

    def __post_init__(self) -> None:
        self._rows = {name: [] for name in self.described}

    def add(self, row: Mapping[str, Any]) -> None:
        """Add one row: a number, or a (2,) or (3,) array, by name of the column."""
        if row.keys() != self._rows.keys():
            raise ValueError(f"a row has other columns than the series: {sorted(row.keys() ^ self._rows.keys())}")
        for name, value in row.items():
            self._rows[name].append(value)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The series so far: (n,), (n, 2) or (n, 3) arrays by name."""
        return {name: np.array(values) for name, values in self._rows.items()}

    def restore(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Replace all rows by the rows of `columns`: (n,), (n, 2) or (n, 3) arrays by name."""
        self._rows = {name: list(columns[name]) for name in self.described}

    def keep_up(self) -> None:
        """Rewrite the file, unless it was written less than `PERIOD` ago."""
        if time.monotonic() - self._written >= PERIOD:
            self.write()

    def write(self) -> None:
        """Rewrite the file with all rows."""
        write_whole(self.folder / names.SERIES, self._write, make_folder=False)
        self._written = time.monotonic()

    def _write(self, path: Path) -> None:
        # Made in memory, since the HDF5 library may abort the process on a full disk.
        content = io.BytesIO()
        with h5py.File(content, "w") as file:
            file.attrs["format"] = names.SERIES_FORMAT
            for name, value in self.attributes.items():
                file.attrs[name] = value
            columns = self.columns
            for name, column in self.described.items():
                values = columns[name]
                # Checksums need chunks, here one per dataset, and no chunk can be empty.
                checked = {"chunks": values.shape, "fletcher32": True} if values.size else {}
                dataset = file.create_dataset(name, data=values, **checked)
                dataset.attrs["unit"] = column.unit
                dataset.attrs["description"] = column.description
        path.write_bytes(content.getvalue())


@dataclass(frozen=True, kw_only=True, eq=False)
class Series(Mapping[str, NDArray[Any]]):
    """The recorded quantities of a run against time: a mapping of names to arrays, which are read-only."""

    path: Path  #: The file
    #: Arrays by name, e.g. "com_height_m": (n,), (n, 2) for barb 1 and barb 2, or (n, 3) for x, y, z. Their names
    #: depend on the scene: only scenes with motors have quantities of motors.
    data: Mapping[str, NDArray[Any]] = field(repr=False)
    units: Mapping[str, str] = field(repr=False)  #: Units by name, e.g. "m"; "1" for a pure number
    descriptions: Mapping[str, str] = field(repr=False)  #: Descriptions by name
    scene_sha256: str
    seed: int

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the array of one quantity; raise InputError if the series has none of that name."""
        try:
            return self.data[name]
        except KeyError:
            raise InputError(f"{self.path} holds no series '{name}'; choose one of: {', '.join(self.data)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self.data)

    def __len__(self) -> int:
        return len(self.data)

    # The mixin methods of Mapping expect KeyError of a missing name, and compare arrays.
    def __contains__(self, name: object) -> bool:
        return name in self.data

    def get(self, name: str, default: Any = None) -> Any:
        """Return the array of one quantity, or `default` if the series has none of that name."""
        return self.data.get(name, default)

    __eq__ = object.__eq__
    __hash__ = object.__hash__

    @property
    def time(self) -> Array:
        """(n,) float64 [s], simulated time of each sample."""
        return np.asarray(self.data["time_s"])

    def table(self) -> pd.DataFrame:
        """Return the series as a table with one row per sample, and units in the column names."""
        import pandas as pd  # noqa: PLC0415  (slow to import, and no run needs it)

        columns = {name: self[name] for name in ("time_s", "phase")}
        for name, values in self.data.items():
            parts = values[:, None] if values.ndim == 1 else values
            marks = COMPONENTS.get(parts.shape[1], ("",)) if values.ndim > 1 else ("",)
            columns |= {f"{name} {mark}".strip(): part for mark, part in zip(marks, parts.T, strict=True)}
        return pd.DataFrame(columns)

    def nearest(self, time: float) -> int:
        """Return the index of the sample nearest to a time [s]."""
        return int(np.argmin(np.abs(self.time - time)))

    def known(self, name: str, phase: int) -> NDArray[np.int64]:
        """Return the indices of a phase's samples at which a quantity (n,) is finite; none without the quantity."""
        return np.flatnonzero((self.data["phase"] == phase) & np.isfinite(self.data.get(name, np.nan)))


def read_series(directory: Path | str) -> Series:
    """Return the time series of a run directory, whose run may be done, failed or still running."""
    path = Path(directory) / names.SERIES
    if not path.is_file():
        cannot_read("series", path, "no such file", _REMEDY)
    cause: Exception | str | None
    try:
        # HDF5 refuses a name that this or another process has open in another way, and file systems without locks.
        with path.open("rb") as stored, h5py.File(stored, "r") as file:
            if not (cause := _foreign(file)):
                attributes = dict(file.attrs)
                data = {name: frozen(np.atleast_1d(file[name][()])) for name in file}
                texts = {key: {name: str(file[name].attrs[key]) for name in file} for key in ("unit", "description")}
                cause = _wrong(attributes, data)
                seed = 0 if cause else int(attributes["seed"])
    # h5py fails with OSError, KeyError or RuntimeError, depending on where the damage lies.
    except Exception as error:
        checksum = "filter returned failure" in str(error)
        cause = "its content does not fit its checksums" if checksum else error
    if cause:
        cannot_read("series", path, cause, _REMEDY)
    return Series(
        path=path,
        data=MappingProxyType(data),
        units=MappingProxyType(texts["unit"]),
        descriptions=MappingProxyType(texts["description"]),
        scene_sha256=str(attributes["scene_sha256"]),
        seed=seed,
    )


def _foreign(file: h5py.File) -> str | None:
    """Return a message about the first dataset that is unsafe to read, or None if all are safe.

    A safe dataset holds numbers that are stored in the file. Links may lead to other files, and a dataset that is
    compressed or not stored may fill the memory.
    """
    for name in file:
        linked = not isinstance(file.get(name, getlink=True), h5py.HardLink)
        values = None if linked else file[name]
        if not isinstance(values, h5py.Dataset) or values.external or values.is_virtual:
            return f"'{name}' is not stored in this file"
        if values.dtype.kind not in "bfiu" or values.id.get_storage_size() < values.nbytes:
            return f"'{name}' is not stored as plain numbers"
    return None


def _wrong(attributes: dict[str, Any], data: dict[str, NDArray[Any]]) -> str | None:
    """Return in words what is wrong with the attributes or datasets of `series.h5`; None if nothing is."""
    for key in ("format", "scene_sha256", "seed"):
        if key not in attributes:
            return f"attribute '{key}' is missing"
    if int(attributes["format"]) != names.SERIES_FORMAT:
        return f"'format' must be {names.SERIES_FORMAT}: got {attributes['format']}"
    for name in ("time_s", "phase"):
        if name not in data:
            return f"dataset '{name}' is missing"
    rows = len(data["time_s"])
    if rows == 0:
        return "it holds no sample yet"
    for name, values in data.items():
        if values.shape not in ((rows,), (rows, 2), (rows, 3)):
            return f"'{name}' has shape {values.shape}, 'time_s' has {rows} samples"
    return None
