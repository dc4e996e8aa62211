"""Two runs, or two sweeps, beside each other: what differs in scene, versions and measures, and whether in any bit."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from dem.errors import InputError
from dem.record.frames import read_frames
from dem.record.names import FRAME, MANIFEST, SERIES, collection
from dem.record.run import Run, open_run
from dem.record.series import read_series
from postprocess.statistics.points import marked
from smarticles.measuring import PHASE, grouped, measured, values_in
from templates.sweep.folder import MANIFEST as SWEEP
from templates.sweep.folder import Folder, open_folder
from templates.sweep.sweep_file import SEED

if TYPE_CHECKING:
    from numpy.typing import NDArray

Differences = dict[str, tuple[Any, Any]]
"""What two things say of a key; None where one of them says nothing."""

A, B, DIFFERENCE, ERROR = "A", "B", "B - A", "SE of B - A"
"""Columns of `Comparison.measures`."""


@dataclass(frozen=True, kw_only=True)
class Bits:
    """How far two runs are the same, bit for bit.

    Attributes:
        series: whether all columns of the series that both have are; None where one has no series.
        differs_at: simulated time of the first sample that differs [s]; None where none does.
        frames: frames that are the same.
        compared: frames that both have.
        same_count: whether both have the same frames, the same samples and the same columns.
    """

    series: bool | None
    differs_at: float | None
    frames: int
    compared: int
    same_count: bool

    @property
    def identical(self) -> bool:
        """Whether nothing differs."""
        return self.series is not False and self.frames == self.compared and self.same_count


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Two runs or two sweeps.

    Attributes:
        kind: "run" or "sweep".
        scene: keys of the scene that differ, dots for nesting; of sweeps, of their constants and variables.
        versions: likewise.
        only: runs that one sweep alone has, by its letter; empty of runs.
        bits: by the runs' names; of two runs one entry.
        measures: one row per phase, or group and phase, and quantity: A, B, B - A, and its standard error where both
            have one.
    """

    kind: str
    scene: Differences
    versions: Differences
    only: Mapping[str, tuple[str, ...]]
    bits: Mapping[str, Bits]
    measures: pd.DataFrame

    @property
    def identical(self) -> bool:
        """Whether all that was compared is the same, bit for bit, and nothing was left out."""
        return bool(self.bits) and not any(self.only.values()) and all(bits.identical for bits in self.bits.values())


def compare(one: Path, other: Path) -> Comparison:
    """Two runs, or two sweeps.

    Raises:
        InputError: one is a run and the other a sweep, or they are neither.
    """
    kinds = [_kind(path) for path in (one, other)]
    if kinds[0] != kinds[1]:
        msg = f"{one} is a {kinds[0]} and {other} a {kinds[1]}; give two of a kind"
        raise InputError(msg)
    return _sweeps(open_folder(one), open_folder(other)) if kinds[0] == "sweep" else _runs(one, other)


def _kind(path: Path) -> str:
    if (path / SWEEP).is_file():
        return "sweep"
    if (path / MANIFEST).is_file():
        return "run"
    msg = f"{path}: is neither a run directory nor that of a sweep; give what `smarticles run` or `sweep` made"
    raise InputError(msg)


def _runs(one: Path, other: Path) -> Comparison:
    first, second = open_run(one), open_run(other)
    return Comparison(
        kind="run",
        scene=differences(first.scene, second.scene),
        versions=differences(_made_by(first), _made_by(second)),
        only={},
        bits={first.manifest.name: same_bits(one, other)},
        measures=_beside(_begun(one), _begun(other), list(PHASE)),
    )


def _begun(path: Path) -> pd.DataFrame:
    """Measures of a run; none of one that has no frame yet."""
    return measured([path]) if (path / collection(FRAME)).is_file() else pd.DataFrame(columns=list(PHASE))


def _made_by(run: Run) -> dict[str, Any]:
    return {
        "engine": run.manifest.engine,
        **run.manifest.versions,
        "threads": run.manifest.threads,
        "status": run.status.state,
    }


def _sweeps(one: Folder, other: Folder) -> Comparison:
    names = [{entry.name: entry for entry in folder.entries} for folder in (one, other)]
    both = [name for name in names[0] if name in names[1]]
    begun = [
        name
        for name in both
        if all((f.run(e[name]) / MANIFEST).is_file() for f, e in zip((one, other), names, strict=True))
    ]
    variables = [values_in(folder) for folder in (one, other)]
    by = [name for name in variables[0] if name != SEED and name in variables[1]]
    keys = [*by, *PHASE]
    return Comparison(
        kind="sweep",
        scene=differences(*({name: _told(v) for name, v in varied.items()} for varied in variables)),
        versions=differences(*(_versions(folder) for folder in (one, other))),
        only={
            A: tuple(name for name in names[0] if name not in names[1]),
            B: tuple(name for name in names[1] if name not in names[0]),
        },
        bits={name: same_bits(one.run(names[0][name]), other.run(names[1][name])) for name in begun},
        measures=_beside(grouped(measured([one.path]), keys), grouped(measured([other.path]), keys), keys),
    )


def _told(values: list[Any]) -> Any:
    return values[0] if len(values) == 1 else ", ".join(map(str, values))


def _versions(folder: Folder) -> dict[str, Any]:
    """Versions of all runs of a sweep that have begun."""
    found: dict[str, list[Any]] = {}
    for entry in folder.entries:
        if (folder.run(entry) / MANIFEST).is_file():
            for name, value in _made_by(open_run(folder.run(entry))).items():
                values = found.setdefault(name, [])
                if name != "status" and value not in values:
                    values.append(value)
    return {name: _told(values) for name, values in found.items() if values}


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> Differences:
    """Keys whose values differ, nested ones with dots."""
    first, second = _flat(one), _flat(other)
    keys = [*first, *(key for key in second if key not in first)]
    return {key: (first.get(key), second.get(key)) for key in keys if first.get(key) != second.get(key)}


def _flat(value: Any, place: str = "") -> dict[str, Any]:
    if isinstance(value, Mapping):
        items = value.items()
    elif isinstance(value, list) and any(isinstance(item, Mapping | list) for item in value):
        items = {str(index): item for index, item in enumerate(value)}.items()
    else:
        return {place: value}
    return {
        key: found for name, item in items for key, found in _flat(item, f"{place}.{name}" if place else name).items()
    }


def same_bits(one: Path, other: Path) -> Bits:
    """How far two run directories hold the same numbers, bit for bit.

    Of the series its columns are compared, not its file, which names the scene; of frames the files.
    """
    frames = [read_frames(path).paths if (path / collection(FRAME)).is_file() else () for path in (one, other)]
    same = sum(a.read_bytes() == b.read_bytes() for a, b in zip(*frames, strict=False))
    series: bool | None = None
    differs_at, alike = None, len(frames[0]) == len(frames[1])
    recorded = [(path / SERIES).is_file() for path in (one, other)]
    alike = alike and recorded[0] == recorded[1]
    if all(recorded):
        a, b = read_series(one), read_series(other)
        alike = alike and len(a) == len(b) and a.data.keys() == b.data.keys()
        length = min(len(a), len(b))
        differing = np.zeros(length, dtype=bool)
        for name in a.data.keys() & b.data.keys():
            differing |= _differ(a[name][:length], b[name][:length])
        series = not bool(differing.any())
        differs_at = None if series else float(a.time[differing.argmax()])
    return Bits(series=series, differs_at=differs_at, frames=same, compared=min(map(len, frames)), same_count=alike)


def _differ(one: NDArray[Any], other: NDArray[Any]) -> NDArray[np.bool_]:
    """(n,) whether samples differ in a bit, of two arrays of n samples."""
    if one.dtype != other.dtype or one.shape != other.shape:
        return np.ones(len(one), dtype=bool)
    bits = [np.ascontiguousarray(array).view(np.uint8).reshape(len(array), -1) for array in (one, other)]
    unlike: NDArray[np.bool_] = (bits[0] != bits[1]).any(axis=1)
    return unlike


def _beside(one: pd.DataFrame, other: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    """Quantities of two tables beside each other, one row per place and quantity."""
    second = {_key(row, keys): row for row in other.to_dict("records")}
    rows = []
    for row in one.to_dict("records"):
        twin = second.get(_key(row, keys))
        if twin is None:
            continue
        for name in row:
            if not _is_quantity(str(name), row) or name not in twin or name in keys:
                continue
            a, b = float(row[name]), float(twin[name])
            if math.isnan(a) and math.isnan(b):
                continue
            error = marked(str(name), "SE")
            errors = [float(table.get(error, math.nan)) for table in (row, twin)]
            rows.append(
                {
                    **{key: row[key] for key in keys},
                    "quantity": name,
                    **{A: a, B: b, DIFFERENCE: b - a, ERROR: math.hypot(*errors)},
                }
            )
    return pd.DataFrame(rows, columns=[*keys, "quantity", A, B, DIFFERENCE, ERROR])


def _key(row: Mapping[Any, Any], keys: list[str]) -> str:
    return json.dumps([row[key] for key in keys], default=str)


def _is_quantity(name: str, row: Mapping[Any, Any]) -> bool:
    value = row[name]
    return name.endswith("]") and " SE [" not in name and isinstance(value, int | float | np.number)
