"""Read start poses of bodies from a file: their bars, body by body."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from dem.arrays import Array, Numbers
from dem.errors import InputError, nearest, shown
from dem.record.files import cannot_read
from dem.record.frame import read_mesh

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6}  #: Units of length, in metres
POSES = "poses"  #: Name of the copy in a run directory, without its suffix

_AXES = ("x", "y", "z")
_LARGEST = 2**53  # whole numbers up to this one are exact as floats
_REMEDY = "a .csv needs columns body, x, y, z with a point in each row; a .vtu, such as a frame of a run, needs lines"


@dataclass(frozen=True)
class PosedBody:
    """The bars of one body in a file of poses."""

    name: str  #: Number of the body in the file, and where it begins there, for messages
    segments: Array = field(repr=False)  #: (S, 2, 3) both ends of its bars [m]
    kind: int | None = None  #: Its kind; None: the file has no kinds


def read_poses(path: Path, *, unit: str | None = None) -> tuple[PosedBody, ...]:
    """Return the bodies of a file in the order of their numbers.

    A row of a `.csv` is a point of a body (columns `body`, `x`, `y`, `z`); bars join the points of a body in the order
    of the rows. With a column `bar` they join only points of one bar. A column `kind` numbers the kinds. A `.vtu` has
    lines with the cell data `smarticle_id` or `body`, and `kind`, as frames of runs have.

    `unit` is the unit of the coordinates; None: that in the header of a CSV file, `x [mm]`, and m for frames of runs.
    InputError, with file and row, if the file is missing or damaged.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return _read_csv(path, unit)
    if suffix == ".vtu":
        return _read_vtu(path, unit)
    raise InputError(f"{path}: poses are read from .csv and .vtu: got {suffix or 'no suffix'}")


def _read_csv(path: Path, unit: str | None) -> tuple[PosedBody, ...]:
    try:
        text = path.read_text(encoding="utf-8-sig")
        rows = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except OSError as error:
        cannot_read("poses", path, error, _REMEDY)
    except (UnicodeDecodeError, csv.Error) as error:
        cannot_read("poses", path, f"it is no CSV file in UTF-8 ({error})", _REMEDY)
    header = [name.partition("[") for name in rows[0]] if rows else []
    names = [name.strip().lower() for name, _, _ in header]
    known = ("body", "kind", "bar", *_AXES)
    if missing := [name for name in ("body", *_AXES) if name not in names]:
        _reject(path, f"it has no column {', '.join(missing)}")
    if len(set(names)) < len(names) or set(names) - {*known}:
        wrong = [name for k, name in enumerate(names) if name in names[:k] or name not in known]
        _reject(path, f"column {shown(wrong[0])} is unknown, or there twice; known: {', '.join(known)}")
    stated = {
        inside.strip(" ]") for name, (_, mark, inside) in zip(names, header, strict=True) if mark and name in _AXES
    }
    factor = _factor(path, stated, unit)
    bodies: dict[int, list[_Point]] = {}
    for line, row in enumerate(rows[1:], 2):
        if not row:
            continue
        if len(row) != len(names):
            _reject(path, f"line {line} has {len(row)} cells, the header has {len(names)}")
        values = {name: _number(path, line, name, cell) for name, cell in zip(names, row, strict=True)}
        point = _Point(line, factor * np.array([values[axis] for axis in _AXES]), values.get("kind"), values.get("bar"))
        bodies.setdefault(int(values["body"]), []).append(point)
    if not bodies:
        _reject(path, "it holds no point")
    return tuple(_of_points(path, number, bodies[number]) for number in sorted(bodies))


@dataclass(frozen=True)
class _Point:
    line: int
    place: Array
    kind: float | None
    bar: float | None


def _number(path: Path, line: int, name: str, cell: str) -> float:
    """Return the number in a cell of a CSV file; whole and from 0 unless the column is a coordinate."""
    try:
        value = float(cell) if "_" not in cell else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        _reject(path, f"line {line}: {name} is {shown(cell.strip())}, not a finite number")
    if name not in _AXES and not (value == int(value) and 0 <= value < _LARGEST):
        _reject(path, f"line {line}: {name} is {shown(cell.strip())}; give a whole number from 0")
    return value


def _of_points(path: Path, number: int, points: Sequence[_Point]) -> PosedBody:
    pairs = [(a, b) for a, b in pairwise(points) if a.bar == b.bar]
    first, kinds = points[0], {point.kind for point in points}
    if not pairs:
        _reject(path, f"line {first.line}: body {number} has one point; a bar needs two")
    if len(kinds) > 1:
        _reject(path, f"line {first.line}: body {number} has several kinds")
    kind = None if first.kind is None else int(first.kind)
    segments = np.array([[a.place, b.place] for a, b in pairs])
    return PosedBody(f"body {number} (line {first.line})", segments, kind)


def _read_vtu(path: Path, unit: str | None) -> tuple[PosedBody, ...]:
    if not path.is_file():
        cannot_read("poses", path, "No such file or directory", _REMEDY)
    mesh = read_mesh(path, "poses", _REMEDY)
    if [block.type for block in mesh.cells] != ["line"]:
        _reject(path, "it must hold one block of lines and no other cells")
    data: Mapping[str, Any] = {name: np.asarray(values[0]) for name, values in mesh.cell_data.items()}
    name = next((name for name in ("smarticle_id", "body") if name in data), None)
    if name is None:
        _reject(path, "its lines have no cell data smarticle_id or body")
    recorded = {"m"} if "floor_z_m" in data else set()  # a frame of a run
    segments = np.asarray(mesh.points, dtype=np.float64)[np.asarray(mesh.cells[0].data)] * _factor(path, recorded, unit)
    if not np.isfinite(segments).all():
        _reject(path, "a point is not finite")
    if recorded:
        segments[..., 2] -= data["floor_z_m"][:, None]
    if len(times := np.unique(data.get("time_s", 0.0))) > 1:
        _reject(path, f"it holds {len(times)} times by its cell data time_s; keep one")
    numbers = _whole(path, name, data[name])
    kinds = _whole(path, "kind", data["kind"]) if "kind" in data else None
    found = []
    for number in np.unique(numbers):
        of = np.flatnonzero(numbers == number)
        if kinds is not None and (kinds[of] != kinds[of[0]]).any():
            _reject(path, f"body {number} has several kinds")
        kind = None if kinds is None else int(kinds[of[0]])
        found.append(PosedBody(f"body {number}", segments[of], kind))
    return tuple(found)


def _whole(path: Path, name: str, values: Any) -> Numbers:
    if values.ndim != 1 or not (np.isfinite(values) & (values == np.floor(values)) & (values >= 0)).all():
        _reject(path, f"cell data '{name}' must be whole numbers from 0")
    return np.asarray(values, dtype=np.int64)


def _factor(path: Path, stated: set[str], unit: str | None) -> float:
    """Return the unit of a file in metres, from the units that it states and the unit that the user gives."""
    named = sorted(stated | ({unit} if unit else set()))
    if not named:
        raise InputError(f"{path}: states no unit of length; add it to the header, x [mm], or give unit: mm")
    for name in named:
        if name not in UNITS:
            raise InputError(f"{path}: unit {shown(name)} is unknown; {nearest(name, UNITS)}")
    if len({UNITS[name] for name in named}) > 1:
        raise InputError(f"{path}: has the units {' and '.join(named)}, by its header and the key unit; give one")
    return UNITS[named[0]]


def _reject(path: Path, cause: str) -> NoReturn:
    cannot_read("poses", path, cause, _REMEDY)
