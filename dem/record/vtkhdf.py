"""Frames of a run in one file, `frames.vtkhdf`, a temporal PolyData of VTKHDF 2.0.

docs/reference/files.md describes the file. A step is the frame of one time: a mesh of lines with data by name. Steps
with equal lines share them in the file. The rows of a step begin a new chunk, so that a later step changes no chunk of
an earlier step; VTK reads by offsets and skips the gaps.

Source: https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/vtkhdf_specifications.html
"""

import io
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import h5py
import meshio
import numpy as np
from numpy.typing import ArrayLike, NDArray

from dem.arrays import Array
from dem.record.files import cannot_read, cannot_write, write_whole
from dem.record.journal import Journaled, journal_of, roll_back
from dem.record.names import SCENE

REMEDY = "put the file back, or run {} anew elsewhere"  #: Advice for messages, to be filled with the path of a scene
RADIUS = "radius_m"  #: Name of the dataset of radii, for ParaView's filter Tube
_KINDS = ("Vertices", "Lines", "Polygons", "Strips")  # in the order of VTK's columns of offsets
_LINES = _KINDS.index("Lines")
_BY_KIND = ("CellOffsets", "ConnectivityIdOffsets")  # lists with a column per kind
_CELLS = "RowOffsets"  # list of the first rows of the data of cells
_CHUNK, _SHORT = 1024, 256  # rows of a chunk of data, and of lists with a row per step
_FORMAT = ("v110", "v110")  # of HDF5: the oldest whose own structures have checksums
_TRIES = 20  # how often a reader repeats while the run writes
_DEFLATED = 1100  # zlib makes data at most 1032 times smaller: a file that claims more was made to fill the memory

T = TypeVar("T")


def create(path: Path, mesh: meshio.Mesh, time: float) -> None:
    """Write a new file with one step, of the time `time` [s]; raise RunError if it cannot be written."""
    content = io.BytesIO()
    with h5py.File(content, "w", libver=_FORMAT) as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0])
        root.attrs["Type"] = np.bytes_("PolyData")
        data = {f"CellData/{name}": values[0] for name, values in mesh.cell_data.items()}
        data |= {f"PointData/{name}": values for name, values in mesh.point_data.items()}
        for name, values in {"Points": mesh.points, **data}.items():
            _make(root, name, np.asarray(values)[:0], _CHUNK)
        none = np.empty(0, np.int64)
        _make(root, "NumberOfPoints", none, _SHORT)
        for kind in _KINDS:
            for name in ("NumberOfCells", "NumberOfConnectivityIds", "Offsets", "Connectivity"):
                _make(root, f"{kind}/{name}", none, _SHORT if name.startswith("N") else _CHUNK)
        root.create_group("Steps").attrs["NSteps"] = np.int64(0)
        _make(root, "Steps/Values", np.empty(0), _SHORT)
        for name in ("PartOffsets", "NumberOfParts", "PointOffsets", _CELLS):
            _make(root, f"Steps/{name}", none, _SHORT)
        # All data of cells begin in one row, and those of points with the points: one list under several names.
        for group, _, name in (each.partition("/") for each in data):
            root[f"Steps/{group}Offsets/{name}"] = root["Steps"]["PointOffsets" if group == "PointData" else _CELLS]
        for name in _BY_KIND:
            _make(root, f"Steps/{name}", np.empty((0, len(_KINDS)), np.int64), _SHORT)
        _append(root, mesh, time)
    write_whole(path, lambda temporary: temporary.write_bytes(content.getvalue()), make_folder=False)


def append(path: Path, mesh: meshio.Mesh, time: float) -> None:
    """Append a step, of the time `time` [s], to a file; raise RunError if it cannot be written."""
    _change(path, lambda root: _append(root, mesh, time))


def truncate(path: Path, number: int) -> None:
    """Keep the first `number` steps, and remove later ones; raise RunError if the file cannot be written."""
    if number == 0:
        path.unlink(missing_ok=True)
        journal_of(path).unlink(missing_ok=True)
    else:
        _change(path, lambda root: _truncate(root, number))


def read_times(path: Path) -> Array:
    """Return the times of all steps, (n,) float64 [s]; raise InputError if the file is missing or damaged."""
    return _read(path, "frames", lambda root: np.asarray(_rows(root, "Steps/Values", 0, _count(root)), np.float64))


def read_step(path: Path, number: int) -> meshio.Mesh:
    """Return the mesh of a step; raise InputError if the step or the file is missing or damaged."""
    return _read(path, f"frame {number} of", lambda root: _step(root, number))


def check_times(path: Path, times: Sequence[float]) -> None:
    """Raise InputError unless the first steps have these times [s] and any later steps can be removed.

    This is checked in memory, before a run is resumed; the file does not change. Without times nothing is checked.
    """
    if not times:
        return
    if not np.array_equal(read_times(path)[: len(times)], times):
        cause = f"its first {len(times)} frames are not those of the checkpoint"
        cannot_read("frames", path, cause, REMEDY.format(path.with_name(SCENE)))
    try:  # in memory alone
        with Journaled(path) as stored, h5py.File(stored, "r+", libver=_FORMAT) as file:
            _truncate(file["VTKHDF"], len(times))
    except Exception as error:
        _reject(path, "frames", error)


def _make(root: Any, name: str, empty: NDArray[Any], rows: int) -> None:
    """Create a dataset without rows.

    The array `empty` (0, …) has the type and the shape of the rows to come. Chunks of `_CHUNK` rows are compressed.
    Shorter ones are not, since they grow with every step.
    """
    packed = {"compression": 4, "shuffle": True} if rows == _CHUNK else {}
    shape = empty.shape[1:]
    # Rows whose chunk is lost have values that no frame has.
    lost = math.nan if empty.dtype.kind == "f" else -1
    chunks = {"maxshape": (None, *shape), "chunks": (rows, *shape), "fillvalue": lost, "fletcher32": True}
    root.create_dataset(name, data=empty, **chunks, **packed)


def _append(root: Any, mesh: meshio.Mesh, time: float) -> None:
    lines, steps = np.asarray(mesh.cells[0].data, np.int64), root["Steps"]
    offsets = {"Values": time, "NumberOfParts": 1, **_lines(root, lines, len(mesh.points))}
    offsets["PointOffsets"] = _extend(root["Points"], mesh.points, apart=True)
    data = {"CellData": {name: values[0] for name, values in mesh.cell_data.items()}, "PointData": mesh.point_data}
    for group, rows in data.items():
        if rows.keys() != root.get(group, {}).keys():
            raise ValueError(f"a step has other {group} than those before: {sorted(rows.keys() ^ root[group].keys())}")
        for name, values in rows.items():
            first = _extend(root[group][name], values, apart=True)
            offsets |= {_CELLS: first} if group == "CellData" else {}
    for name, value in offsets.items():
        _extend(steps[name], [value])
    steps.attrs.modify("NSteps", np.int64(len(steps["Values"])))


def _lines(root: Any, lines: NDArray[np.int64], points: int) -> dict[str, Any]:
    """Add the lines of a step to the file, unless they are equal to the lines of the previous step.

    Lines (n, 2) are numbers of the points that they join. Returns where they begin in the file: values for the lists
    `PartOffsets`, `CellOffsets` and `ConnectivityIdOffsets`, by these names.
    """
    parts, number, stored = len(root["NumberOfPoints"]), len(lines), root["Lines"]
    part, cell, end = parts - 1, len(stored["Offsets"]) - (number + 1), len(stored["Connectivity"]) - 2 * number
    counts = (root["NumberOfPoints"][part], stored["NumberOfCells"][part]) if parts else (0, 0)
    if counts != (points, number) or not np.array_equal(stored["Connectivity"][end:], lines.ravel()):
        part, cell, end = parts, len(stored["Offsets"]), len(stored["Connectivity"])
        _extend(root["NumberOfPoints"], [points])
        for kind in _KINDS:
            cells = lines if kind == "Lines" else lines[:0]
            _extend(root[kind]["NumberOfCells"], [len(cells)])
            _extend(root[kind]["NumberOfConnectivityIds"], [cells.size])
            _extend(root[kind]["Offsets"], 2 * np.arange(len(cells) + 1))
            _extend(root[kind]["Connectivity"], cells.ravel())
    row = np.zeros((2, len(_KINDS)), np.int64)
    row[:, _LINES] = cell - part, end  # for each part before, the list of offsets has a row more than there are cells
    return {"PartOffsets": part, "CellOffsets": row[0], "ConnectivityIdOffsets": row[1]}


def _extend(dataset: Any, values: ArrayLike, *, apart: bool = False) -> int:
    """Add rows to a dataset, and return the index of the first; with `apart` the rows begin a new chunk."""
    start = len(dataset)
    if apart:
        start = -(-start // _CHUNK) * _CHUNK
    rows = np.asarray(values)
    dataset.resize(start + len(rows), axis=0)
    dataset[start:] = rows
    return start


def _truncate(root: Any, number: int) -> None:
    steps = root["Steps"]
    last = {name: steps[name][number - 1] for name in ("PartOffsets", "CellOffsets", "ConnectivityIdOffsets")}
    part = last["PartOffsets"]
    points, cells = root["NumberOfPoints"][part], root["Lines/NumberOfCells"][part]
    sizes = {"NumberOfPoints": part + 1, "Points": steps["PointOffsets"][number - 1] + points}
    for group, rows in (("CellData", steps[_CELLS][number - 1] + cells), ("PointData", sizes["Points"])):
        sizes |= dict.fromkeys((f"{group}/{name}" for name in root.get(group, {})), rows)
    for k, kind in enumerate(_KINDS):
        held = cells if kind == "Lines" else 0
        sizes |= {f"{kind}/NumberOfCells": part + 1, f"{kind}/NumberOfConnectivityIds": part + 1}
        sizes[f"{kind}/Offsets"] = last["CellOffsets"][k] + part + held + 1
        sizes[f"{kind}/Connectivity"] = last["ConnectivityIdOffsets"][k] + 2 * held
    steps.visititems(lambda name, item: sizes.update({f"Steps/{name}": number} if hasattr(item, "shape") else {}))
    for name, size in sizes.items():
        root[name].resize(int(size), axis=0)
    steps.attrs.modify("NSteps", np.int64(number))


def _change(path: Path, change: Callable[[Any], None]) -> None:
    try:
        roll_back(path)
        with Journaled(path) as stored:
            with h5py.File(stored, "r+", libver=_FORMAT) as file:
                change(file["VTKHDF"])
            stored.commit()
    except (OSError, KeyError, RuntimeError) as error:  # HDF5 raises the latter on a file that was damaged meanwhile
        cannot_write(path, error)


def _read(path: Path, what: str, take: Callable[[Any], T]) -> T:
    """Return what `take` reads from a file, in a consistent state although a run may write into it."""
    for attempt in range(_TRIES):
        before = _stamp(path)
        failed: Exception | None = None
        try:
            with _opened(path) as file:
                taken = take(file["VTKHDF"])
        except Exception as error:  # HDF5 and h5py raise any exception on damaged files
            failed = error
        if attempt + 1 == _TRIES or before == _stamp(path):
            break
    if failed is not None:
        _reject(path, what, failed)
    return taken


def _reject(path: Path, what: str, error: Exception) -> NoReturn:
    text = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    cause = error if isinstance(error, FileNotFoundError) else f"truncated or not VTKHDF ({text})"
    cannot_read(what, path, cause, REMEDY.format(path.with_name(SCENE)))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    # HDF5 refuses a name that this or another process has open in another way, or that a killed one had open.
    found = Journaled(path) if journal_of(path).exists() else path.open("rb", buffering=0)
    with found as stored, h5py.File(stored, "r") as file:
        yield file


def _stamp(path: Path) -> tuple[float, ...]:
    """Return sizes and modification times of a file and its journal; any change of the file changes them."""
    found: list[float] = []
    for each in (path, journal_of(path)):
        try:
            state = each.stat()
        except OSError:
            found.append(-1)
        else:
            found += [state.st_size, state.st_mtime_ns]
    return tuple(found)


def _rows(root: Any, name: str, start: int, number: int) -> NDArray[Any]:
    """Return rows `start` to `start + number` of a dataset; raise ValueError if they are not in this file.

    HDF5's own functions are called, since h5py's indexing doubles the time for reading a frame.
    """
    for part in (name.partition("/")[0], name):
        if root.id.links.get_info(part.encode()).type != h5py.h5l.TYPE_HARD:
            raise ValueError(f"{part} is a link")
    dataset = h5py.h5d.open(root.id, name.encode())
    # What is in chunks is neither virtual nor in another file.
    if dataset.get_create_plist().get_layout() != h5py.h5d.CHUNKED or dataset.dtype.kind not in "iuf":
        raise ValueError(f"{name} is of another kind")
    length, *more = dataset.shape
    size = number * math.prod(more) * dataset.dtype.itemsize
    if start < 0 or number < 0 or start + number > length or size > _DEFLATED * root.file.id.get_filesize():
        raise ValueError(f"{name} does not hold its rows")
    rows, space = np.empty((number, *more), dataset.dtype), dataset.get_space()
    if number:
        space.select_hyperslab((start, *[0] * len(more)), rows.shape)
        dataset.read(h5py.h5s.create_simple(rows.shape), space, rows)
    return rows


def _count(root: Any) -> int:
    return int(root["Steps"].attrs["NSteps"])


def _step(root: Any, number: int) -> meshio.Mesh:
    if not 0 <= number < _count(root):
        raise ValueError(f"no step {number}")
    names = ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets", _CELLS)
    part, point, cell, end, row = (
        int(_rows(root, f"Steps/{name}", number, 1).reshape(-1)[_LINES if name in _BY_KIND else 0]) for name in names
    )
    points, cells = (int(_rows(root, name, part, 1)[0]) for name in ("NumberOfPoints", "Lines/NumberOfCells"))
    lines = _rows(root, "Lines/Connectivity", end, 2 * cells).reshape(-1, 2)
    if not np.array_equal(_rows(root, "Lines/Offsets", cell + part, cells + 1), 2 * np.arange(cells + 1)):
        raise ValueError("its lines have other than two points")
    return meshio.Mesh(
        _rows(root, "Points", point, points),
        [("line", lines)],
        point_data={name: _rows(root, f"PointData/{name}", point, points) for name in root.get("PointData", ())},
        cell_data={name: [_rows(root, f"CellData/{name}", row, cells)] for name in root.get("CellData", ())},
    )
