"""Read centre lines of bodies from a file, such as those of a tomography, as segments."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dem.errors import InputError, nearest, shown
from dem.record.files import cannot_read, read_csv
from dem.record.frame import frozen
from dem.record.poses import UNITS
from postprocess.geometry.links import Floats, Whole
from postprocess.geometry.segments import checked_segments

BODY_FIELDS = ("body", "smarticle_id")  #: Data with body numbers in VTK files; the first one found is used

#: Columns and data that number times; a file with several values of one has the same bodies several times
TIMES = ("frame", "time", "time_s", "t", "step", "timestep", "snapshot", "timevalue")
ORDER = "index"  #: Column with the order of the points of a body

# Numbers of VTK's cells: lines and polylines; quadratic, cubic and Lagrange curves; cells without lines.
_LINES, _CURVED, _POINTS = (3, 4), (21, 35, 68), (0, 1, 2)
_READERS = {".vtu": "vtkXMLUnstructuredGridReader", ".vtp": "vtkXMLPolyDataReader", ".vtk": "vtkDataSetReader"}
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
      point; rows of one body, in their order or in that of a column `index`, are joined by segments. A closed body
      repeats its first point at the end. The unit may be in the header, `x [mm]`.
    - `.vtu`, `.vtp`, `.vtk`: lines, polylines and curved edges, which become segments between their points. Cell data
      or point data `body` or `smarticle_id` number the bodies, so that frames of a run can be read. Without these,
      lines that share points are one body. These files need PyVista, the extra `viz`.

    Points that follow each other and coincide are one point. Numbers of bodies are whole numbers, 0 or more. The file
    has the bodies at one time: a column or data of `TIMES` has one value.

    Args:
        path: The file.
        unit: Unit of its coordinates: m, cm, mm or um. None: the unit in the header of a CSV file; a VTK file states no
            unit, so that it must be given.

    Raises:
        InputError: The file is missing, damaged, without segments or of several times, or its unit is unknown.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"centre lines: {shown(path)} is no file; give its path; of a frame, use segments_of(frame)")
    path = Path(path)
    suffix = path.suffix.lower()
    if unit is not None:
        _factor(path, unit)
    if suffix == ".csv":
        points, lines, body, kind, unit = _read_csv(path, unit)
    elif suffix in _READERS:
        points, lines, body, kind = _read_vtk(path, suffix)
    else:
        raise InputError(f"{path}: centre lines are read from .csv, .vtu, .vtp and .vtk: got {suffix or 'no suffix'}")
    if unit is None:
        raise InputError(f"{path}: states no unit of length; give unit='mm', or another one of {', '.join(UNITS)}")
    segments = points[lines] * _factor(path, unit)
    real = np.any(segments[:, 0] != segments[:, 1], axis=1)
    if not real.any():
        _reject(path, "it holds no segment")
    if len(lost := np.setdiff1d(body, body[real])):
        _reject(path, f"all points of body {lost[0]} coincide")
    try:
        segments, body = checked_segments(segments[real], body[real])
    except InputError as error:
        _reject(path, str(error))
    return Centrelines(segments=frozen(segments), body=frozen(body), kind=None if kind is None else frozen(kind[real]))


_Lines = tuple[Floats, Whole, Whole, NDArray[Any] | None]  # points (P, 3), lines (M, 2), bodies (M,), kinds (M,)


def _read_csv(path: Path, unit: str | None) -> tuple[Floats, Whole, Whole, NDArray[Any] | None, str | None]:
    table = read_csv("centre lines", path, _REMEDY, skipinitialspace=True)
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
    except (TypeError, ValueError) as error:
        _reject(path, f"a value is no number ({error})")
    wrong = np.nonzero(~np.isfinite(points).all(axis=1))[0]
    if len(wrong):
        _reject(path, f"line {wrong[0] + 2} needs three finite coordinates")
    for name in table.columns:
        _reject_times(path, f"column {name}", name, table[name].to_numpy())
    body = _whole(path, table["body"].to_numpy(), "line", np.arange(len(table)) + 2)
    order = np.lexsort((_places(path, table, body), body))
    joined = body[order][1:] == body[order][:-1]
    lines = np.stack([order[:-1], order[1:]], axis=1)[joined]
    single = np.setdiff1d(body, body[lines.ravel()])
    if len(single):
        _reject(path, f"body {single[0]} has one point")
    kind = None
    if "kind" in table.columns:
        if len(absent := np.nonzero(table["kind"].isna())[0]):
            _reject(path, f"line {absent[0] + 2} has no kind")
        kind = table["kind"].to_numpy()[lines[:, 0]]
    return points, lines, body[lines[:, 0]], kind, unit or next(iter(stated), None)


def _places(path: Path, table: pd.DataFrame, body: Whole) -> Whole | Floats:
    """Return the places (n,) of points in their bodies (n,): of the column `index`, or the order of the rows."""
    if ORDER not in table.columns:
        return np.arange(len(table))
    places: Floats = pd.to_numeric(table[ORDER], errors="coerce").to_numpy(np.float64)
    if len(wrong := np.nonzero(~np.isfinite(places))[0]):
        _reject(path, f"line {wrong[0] + 2}: {ORDER} is {table[ORDER].iloc[wrong[0]]}, no number")
    if len(again := np.nonzero(pd.DataFrame({"body": body, ORDER: places}).duplicated())[0]):
        _reject(
            path,
            f"line {again[0] + 2}: body {body[again[0]]} has {ORDER} {places[again[0]]:g} twice",
            "number the points of each body in their order, and keep one time per file",
        )
    return places


def _reject_times(path: Path, where: str, name: str, values: NDArray[Any]) -> None:
    """Raise InputError if values (n,) whose name means a time are several."""
    if name.lower() in TIMES and (number := len(pd.unique(values))) > 1:
        remedy = "keep one time per file, or rename what is no time"
        _reject(path, f"{where} has {number} values: it holds the bodies at several times", remedy)


def _read_vtk(path: Path, suffix: str) -> _Lines:
    """Return the lines of a VTK file, with the numbers and kinds of their bodies.

    The numbers are those of `BODY_FIELDS`. Without such data all lines that share points are one body.
    """
    mesh, types, offset, corners = _mesh(path, suffix)
    line = np.isin(types, [*_LINES, *_CURVED])
    if not line.any():
        _reject(path, f"it holds no lines, but a {type(mesh).__name__}")
    if len(wrong := np.nonzero(~line & ~np.isin(types, _POINTS))[0]):
        _reject(path, f"cell {wrong[0]} is no line ({len(wrong)} such cells)", "save the lines alone")
    if len(corners) and not (corners.min() >= 0 and corners.max() < mesh.n_points):
        _reject(path, f"a line needs a point that the file lacks; it has {mesh.n_points}")
    # The second point of a curved cell is its end; those between follow it.
    for curved in np.nonzero(np.isin(types, _CURVED))[0]:
        later = corners[offset[curved] + 1 : offset[curved + 1]]
        later[:] = np.roll(later, -1)
    cells = np.repeat(np.arange(len(types)), np.diff(offset))
    joined = np.nonzero((cells[1:] == cells[:-1]) & line[cells[1:]])[0]
    lines, cell = np.stack([corners[joined], corners[joined + 1]], axis=1), cells[joined]
    if len(single := np.setdiff1d(np.nonzero(line)[0], cell)):
        _reject(path, f"cell {single[0]} is a line of one point")
    for what, data in (("cell", mesh.cell_data), ("point", mesh.point_data)):
        for name in data:
            _reject_times(path, f"{what} data {name}", name, np.asarray(data[name]).ravel())
    kind = mesh.cell_data["kind"][cell] if "kind" in mesh.cell_data else None
    return np.asarray(mesh.points, dtype=np.float64), lines, _bodies(path, mesh, lines, cell), kind


def _mesh(path: Path, suffix: str) -> tuple[Any, NDArray[np.uint8], Whole, Whole]:
    """Read a VTK file; InputError if it cannot be read whole.

    Returns the mesh of PyVista, the types of its K cells (K,), where the points of each cell begin and the last ones
    end (K + 1,), and the points of all cells, cell by cell.
    """
    try:
        import pyvista as pv  # noqa: PLC0415
        from vtkmodules import vtkIOLegacy, vtkIOXML  # noqa: PLC0415
        from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow  # noqa: PLC0415
    except ImportError:
        raise InputError(f"{path}: needs PyVista: pip install 'smarticles[viz]', or save the lines as .csv") from None
    if not path.is_file():
        cannot_read("centre lines", path, "No such file or directory", _REMEDY)
    reader = getattr(vtkIOLegacy if suffix == ".vtk" else vtkIOXML, _READERS[suffix])()
    if suffix == ".vtk":  # otherwise only the first array of each kind is read
        reader.ReadAllScalarsOn()
        reader.ReadAllFieldsOn()
    # VTK only prints what is wrong, also of a file that is cut off, and returns a mesh.
    said, before, window = vtkStringOutputWindow(), vtkLogger.GetCurrentVerbosityCutoff(), vtkOutputWindow.GetInstance()
    vtkOutputWindow.SetInstance(said)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        reader.SetFileName(str(path))
        reader.Update()
    finally:
        vtkOutputWindow.SetInstance(window)
        vtkLogger.SetStderrVerbosity(before)
    if said.GetOutput():
        cause = said.GetOutput().partition("): ")[2].partition("\n")[0]  # after place and class
        cannot_read("centre lines", path, f"truncated or not VTK ({cause})", _REMEDY)
    mesh = pv.wrap(reader.GetOutput())
    if not isinstance(mesh, pv.PolyData | pv.UnstructuredGrid) or mesh.n_cells == 0:
        _reject(path, f"it holds no lines, but a {type(mesh).__name__}")
    grid = mesh.cast_to_unstructured_grid() if isinstance(mesh, pv.PolyData) else mesh
    arrays = grid.GetCells().GetOffsetsArray(), grid.GetCells().GetConnectivityArray()
    offset, corners = (np.array(pv.convert_array(one), dtype=np.int64) for one in arrays)
    return mesh, grid.celltypes, offset, corners


def _bodies(path: Path, mesh: Any, lines: Whole, cell: Whole) -> Whole:
    """Return the number of the body of each line (M,), given by the points (M, 2) that it joins and its cell (M,)."""
    for name in BODY_FIELDS:
        if name in mesh.cell_data:
            return _whole(path, np.asarray(mesh.cell_data[name])[cell], "cell", cell)
        if name in mesh.point_data:
            body = _whole(path, np.asarray(mesh.point_data[name])[lines.ravel()], "point", lines.ravel()).reshape(-1, 2)
            if len(wrong := np.nonzero(body[:, 0] != body[:, 1])[0]):
                _reject(path, f"cell {cell[wrong[0]]} joins points of body {body[wrong[0]][0]} and {body[wrong[0]][1]}")
            return body[:, 0]
    graph = coo_array((np.ones(len(lines)), (lines[:, 0], lines[:, 1])), shape=(mesh.n_points, mesh.n_points))
    _, found = np.unique(connected_components(graph, directed=False)[1][lines[:, 0]], return_inverse=True)
    return found.astype(np.int64)


def _whole(path: Path, values: NDArray[Any], what: str, number: Whole) -> Whole:
    """Return numbers of bodies (n,) as int64; InputError, which has the `number` (n,) of the `what` that is wrong."""
    if values.ndim != 1:
        _reject(path, f"{what}s have {values.shape[1:]} numbers of bodies each; one is needed")
    if values.dtype.kind in "iuf":
        # Of larger floats several whole numbers are one.
        most = 2 ** (np.finfo(values.dtype).nmant + 1) - 1 if values.dtype.kind == "f" else np.iinfo(np.int64).max
        right = (values >= 0) & (values <= most) & (np.floor(values) == values)
    else:
        most = 10**18 - 1
        right = np.array([str(value).isdecimal() and int(value) <= most for value in values], dtype=bool)
    wrong = np.nonzero(~right)[0]
    if len(wrong):
        _reject(
            path,
            f"{what} {number[wrong[0]]}: body {values[wrong[0]]} is no whole number from 0 to {most}",
            "number the bodies 0, 1, 2, …, and leave out what belongs to none",
        )
    return values.astype(np.int64)


def _factor(path: Path, unit: str) -> float:
    """Return a unit of length in metres; InputError, which names the file `path`, if it is unknown."""
    if unit not in UNITS:
        raise InputError(f"{path}: unit {unit!r} is unknown; {nearest(str(unit), UNITS)}")
    return UNITS[unit]


def _reject(path: Path, cause: str, remedy: str = _REMEDY) -> NoReturn:
    cannot_read("centre lines", path, cause, remedy)
