"""Read centre lines of bodies from a file, such as those of a tomography, as segments."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dem.errors import InputError, nearest
from dem.record.files import cannot_read
from dem.record.frame import frozen, read_mesh
from postprocess.geometry.links import Floats, Whole
from postprocess.geometry.segments import checked_segments

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6}  #: Units of length, in metres
BODY_FIELDS = ("body", "smarticle_id")  #: Cell data with body numbers in VTK files; the first one found is used

_REMEDY = "a CSV file needs columns body, x, y, z with one point per row, a VTK file needs lines"


@dataclass(frozen=True, kw_only=True, eq=False)
class Centrelines:
    """M segments of bodies; all arrays are read-only."""

    segments: Floats = field(repr=False)  #: (M, 2, 3) float64 [m], both ends of each segment
    body: Whole = field(repr=False)  #: (M,) int64, number of the body of each segment
    kind: NDArray[Any] | None = field(repr=False)  #: (M,) kind of the body of each segment, if the file has kinds


def read_centrelines(path: Path | str, *, unit: str | None = None) -> Centrelines:
    """Read the centre lines of bodies from a file.

    - `.csv`: columns `body` (whole numbers), `x`, `y`, `z`, and `kind` if bodies are of several kinds. Each row is a
      point; rows of one body, in their order, are joined by segments. A closed body repeats its first point at the end.
      The unit may be in the header, `x [mm]`.
    - `.vtu`, `.vtp`, `.vtk`: lines or polylines. Cell data `body` or `smarticle_id` number the bodies, so that frames
      of a run can be read. Without these, lines that share points are one body. `.vtp` and `.vtk` need PyVista, the
      extra `viz`.

    Points that follow each other and coincide are one point.

    Args:
        path: The file.
        unit: Unit of its coordinates: m, cm, mm or um. None: the unit in the header of a CSV file; a VTK file states no
            unit, so that it must be given.

    Raises:
        InputError: The file is missing, damaged or without segments, or its unit is unknown.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if unit is not None:
        _factor(path, unit)
    if suffix == ".csv":
        points, lines, body, kind, unit = _read_csv(path, unit)
    elif suffix in {".vtu", ".vtp", ".vtk"}:
        points, lines, body, kind = _read_vtu(path) if suffix == ".vtu" else _read_polydata(path)
    else:
        raise InputError(f"{path}: centre lines are read from .csv, .vtu, .vtp and .vtk: got {suffix or 'no suffix'}")
    if unit is None:
        raise InputError(f"{path}: states no unit of length; give unit='mm', or another one of {', '.join(UNITS)}")
    segments = points[lines] * _factor(path, unit)
    real = np.any(segments[:, 0] != segments[:, 1], axis=1)
    if not real.any():
        _reject(path, "it holds no segment")
    try:
        segments, body = checked_segments(segments[real], body[real])
    except InputError as error:
        _reject(path, str(error))
    return Centrelines(segments=frozen(segments), body=frozen(body), kind=None if kind is None else frozen(kind[real]))


_Lines = tuple[Floats, Whole, Whole, NDArray[Any] | None]  # points (P, 3), lines (M, 2), bodies (M,), kinds (M,)


def _read_csv(path: Path, unit: str | None) -> tuple[Floats, Whole, Whole, NDArray[Any] | None, str | None]:
    try:
        table = pd.read_csv(path, skipinitialspace=True)
    except (OSError, ValueError) as error:
        cannot_read("centre lines", path, error, _REMEDY)
    headers = [str(name).partition("[") for name in table.columns]
    table.columns = pd.Index([name.strip().lower() for name, _, _ in headers])
    missing = [name for name in ("body", "x", "y", "z") if name not in table.columns]
    if missing or table.columns.has_duplicates:
        _reject(path, f"it has no column {', '.join(missing)}" if missing else "two columns have one name")
    units = zip(table.columns, headers, strict=True)
    stated = {inside.strip("] ") for name, (_, bracket, inside) in units if name in {"x", "y", "z"} and bracket}
    named = [*stated, *([] if unit is None or not stated else [unit])]
    if len({UNITS.get(name, name) for name in named}) > 1:
        raise InputError(
            f"{path}: states {', '.join(sorted(stated))} as unit of its columns x, y, z"
            + ("" if unit is None else f", unit is {unit}")
            + "; give one unit"
        )
    try:
        points = table[["x", "y", "z"]].to_numpy(dtype=np.float64)
        body = table["body"].to_numpy(dtype=np.float64)
    except (TypeError, ValueError) as error:
        _reject(path, f"a value is no number ({error})")
    wrong = np.nonzero(~(np.isfinite(points).all(axis=1) & (body == np.floor(body))))[0]
    if len(wrong):
        _reject(path, f"line {wrong[0] + 2} needs a whole number as body and three finite coordinates")
    order = np.argsort(body, kind="stable")
    joined = body[order][1:] == body[order][:-1]
    lines = np.stack([order[:-1], order[1:]], axis=1)[joined]
    single = np.setdiff1d(body, body[lines.ravel()])
    if len(single):
        _reject(path, f"body {single[0]:.0f} has one point")
    kind = table["kind"].to_numpy()[lines[:, 0]] if "kind" in table.columns else None
    return points, lines, body[lines[:, 0]].astype(np.int64), kind, unit or next(iter(stated), None)


def _read_vtu(path: Path) -> _Lines:
    mesh = read_mesh(path, "centre lines", _REMEDY)
    blocks = [k for k, block in enumerate(mesh.cells) if block.type == "line"]
    if not blocks:
        _reject(path, "it holds no lines")
    lines = np.concatenate([np.asarray(mesh.cells[k].data, dtype=np.int64) for k in blocks])
    data = {name: np.concatenate([np.asarray(values[k]) for k in blocks]) for name, values in mesh.cell_data.items()}
    return _numbered(np.asarray(mesh.points, dtype=np.float64), lines, data)


def _read_polydata(path: Path) -> _Lines:
    try:
        import pyvista as pv  # noqa: PLC0415
    except ImportError:
        raise InputError(f"{path}: needs PyVista: pip install 'smarticles[viz]', or save the lines as .vtu") from None
    if not path.is_file():
        cannot_read("centre lines", path, "No such file or directory", _REMEDY)
    try:
        mesh = pv.read(path)
    except Exception as error:
        cannot_read("centre lines", path, error, _REMEDY)
    if not isinstance(mesh, pv.PolyData) or mesh.n_lines == 0:
        _reject(path, f"it holds no lines, but a {type(mesh).__name__}")
    chains, at = [], 0
    while at < len(mesh.lines):
        count = int(mesh.lines[at])
        chains.append(np.asarray(mesh.lines[at + 1 : at + 1 + count], dtype=np.int64))
        at += count + 1
    lines = np.concatenate([np.stack([chain[:-1], chain[1:]], axis=1) for chain in chains])
    # Cell data have the vertices first, then the lines.
    first, sizes = mesh.n_verts, [len(chain) - 1 for chain in chains]
    data = {
        name: np.repeat(np.asarray(mesh.cell_data[name])[first : first + len(chains)], sizes, axis=0)
        for name in mesh.cell_data
    }
    return _numbered(np.asarray(mesh.points, dtype=np.float64), lines, data)


def _numbered(points: Floats, lines: Whole, data: dict[str, NDArray[Any]]) -> _Lines:
    """Return the lines of a file with the numbers of the bodies to which they belong.

    The numbers are those of the cell data `BODY_FIELDS`. Without such data all lines that share points are one body.
    Points are (P, 3), lines (M, 2) indices of their two ends.
    """
    name = next((name for name in BODY_FIELDS if name in data), None)
    if name is None:
        graph = coo_array((np.ones(len(lines)), (lines[:, 0], lines[:, 1])), shape=(len(points), len(points)))
        _, body = np.unique(connected_components(graph, directed=False)[1][lines[:, 0]], return_inverse=True)
    else:
        body = data[name]
    return points, lines, body.astype(np.int64), data.get("kind")


def _factor(path: Path, unit: str) -> float:
    """Return a unit of length in metres; InputError, which names the file `path`, if it is unknown."""
    if unit not in UNITS:
        raise InputError(f"{path}: unit {unit!r} is unknown; {nearest(unit, UNITS)}")
    return UNITS[unit]


def _reject(path: Path, cause: str) -> NoReturn:
    cannot_read("centre lines", path, cause, _REMEDY)
