"""The frames of a run, read one at a time from `frames.pvd` and its `.vtu` files."""

from __future__ import annotations

import contextlib
import io
import math
import warnings
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn, overload
from xml.etree import ElementTree as ET

import meshio
import numpy as np

from postprocess.errors import refuse

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

_REMEDY_FRAME = "remove its line from frames.pvd, or run again with --resume"
_REMEDY_RUN = "give the directory of a run that has written a frame"
_LINKS = 3
_CORNERS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """The smarticles at one recorded time; all arrays are read-only.

    Attributes:
        path: The file it came from.
        time: Simulated time [s].
        floor_z: Height of the container's floor [m]; heights are measured from it.
        phase: Index into `RunManifest.phases`.
        vertices: (N, 4, 3) float64 [m], barb tip, hinge, hinge, barb tip of each smarticle, in the shape that it has
            at that time.
        smarticle_ids: (N,) int64.
        link_velocity: (N, 3, 3) float64 [m/s], of the centres of barb 1, middle link, barb 2.
        link_angular_velocity: (N, 3, 3) float64 [rad/s].
        contacts: (N,) int64, how many other smarticles each one touches, by the engine.
        cell_data: Further data of the file, (N, 3, …) one value per link, by name. Frames of scenes that actuate have
            `angle_rad`, `motor_torque_N_m` and `motor_work_J`, NaN on the middle link and on welded smarticles, and
            `halted`.
    """

    path: Path
    time: float
    floor_z: float
    phase: int
    vertices: NDArray[np.float64] = field(repr=False)
    smarticle_ids: NDArray[np.int64] = field(repr=False)
    link_velocity: NDArray[np.float64] = field(repr=False)
    link_angular_velocity: NDArray[np.float64] = field(repr=False)
    contacts: NDArray[np.int64] = field(repr=False)
    cell_data: Mapping[str, NDArray[Any]] = field(repr=False)

    @property
    def count(self) -> int:
        """Number of smarticles poured so far."""
        return len(self.vertices)


class FrameSequence(Sequence[Frame]):
    """The frames of a run in time order; a file is read only when its frame is asked for.

    A slice is again a lazy sequence. Frames are not kept: each access reads the file anew.

    Attributes:
        times: (n,) float64 [s], as listed in `frames.pvd`; needs no frame to be read.
        paths: The files, in time order.
    """

    def __init__(self, times: NDArray[np.float64], paths: tuple[Path, ...]) -> None:
        self.times = times
        self.paths = paths

    def __repr__(self) -> str:
        if not self.paths:
            return "FrameSequence(empty)"
        span = f"{self.times[0]:g} s … {self.times[-1]:g} s"
        return f"FrameSequence({len(self)} frames, {span})"

    def __len__(self) -> int:
        return len(self.paths)

    @overload
    def __getitem__(self, index: int) -> Frame: ...

    @overload
    def __getitem__(self, index: slice) -> FrameSequence: ...

    def __getitem__(self, index: int | slice) -> Frame | FrameSequence:
        if isinstance(index, slice):
            return FrameSequence(self.times[index], self.paths[index])
        return read_frame(self.paths[index])

    def in_phase(self, phase: int) -> FrameSequence:
        """The frames of one phase, found by bisection: phases follow each other in time.

        Args:
            phase: Index into `RunManifest.phases`.

        Returns:
            Its frames; empty if the run has not recorded any.
        """
        first = bisect_left(self, phase, key=attrgetter("phase"))
        last = bisect_right(self, phase, lo=first, key=attrgetter("phase"))
        return self[first:last]


def read_frames(directory: Path | str) -> FrameSequence:
    """Opens the frames of a run; the run may be done, failed or still going on.

    Args:
        directory: A run directory.

    Returns:
        The frames in time order, read lazily.

    Raises:
        InputError: `frames.pvd` is missing, damaged or not in time order.

    Source:
        ARCHITECTURE.md, "The run directory".

    Example:
        >>> for frame in read_frames("runs/pile")[-20:]:  # doctest: +SKIP
        ...     print(frame.time, frame.vertices.shape)
    """
    path = Path(directory) / "frames.pvd"
    try:
        root = ET.parse(path).getroot()
    except (OSError, ET.ParseError) as error:
        refuse("list of frames", path, error, _REMEDY_RUN)
    times, files = [], []
    for entry in root.iter("DataSet"):
        try:
            times.append(float(entry.attrib["timestep"]))
            files.append(path.parent / entry.attrib["file"])
        except (KeyError, ValueError) as error:
            cause = f"entry {len(files)} lacks a time or a file ({error})"
            refuse("list of frames", path, cause, _REMEDY_RUN)
    if not files:
        refuse("list of frames", path, "it lists no frame", _REMEDY_RUN)
    if not np.all(np.isfinite(times)) or np.any(np.diff(times) < 0):
        refuse("list of frames", path, "its times do not ascend", _REMEDY_RUN)
    return FrameSequence(np.array(times), tuple(files))


def read_frame(path: Path | str) -> Frame:
    """Reads one frame file.

    Args:
        path: A `.vtu` file as described in ARCHITECTURE.md.

    Returns:
        The frame.

    Raises:
        InputError: The file is missing, damaged, or lacks what a frame must have.

    Source:
        ARCHITECTURE.md, "The run directory".
    """
    path = Path(path)
    return _FrameReader(path, _read_mesh(path)).frame()


def _read_mesh(path: Path) -> Any:
    # meshio's own dispatch prints and calls sys.exit on damaged files, hence the format's reader;
    # that one fails with whatever exception the damaged bytes happen to cause, or prints a warning
    # and goes on, which the checks of shapes catch.
    noise = io.StringIO()
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            contextlib.redirect_stdout(noise),
            contextlib.redirect_stderr(noise),
        ):
            return meshio.vtu.read(str(path))
    except OSError as error:
        refuse("frame", path, error, _REMEDY_FRAME)
    except (Exception, SystemExit) as error:
        cause = f"truncated or not VTK ({type(error).__name__})"
        refuse("frame", path, cause, _REMEDY_FRAME)


class _FrameReader:
    """Turns the mesh of one file into a frame and names what is wrong with it."""

    def __init__(self, path: Path, mesh: Any) -> None:
        self._path = path
        blocks = [block for block in mesh.cells if block.type == "line"]
        if len(mesh.cells) != 1 or len(blocks) != 1:
            self._refuse("it must hold one block of lines and no other cells")
        self._points = np.asarray(mesh.points)
        self._lines = np.asarray(blocks[0].data)
        self._data = {name: np.asarray(values[0]) for name, values in mesh.cell_data.items()}
        self._count = len(self._lines) // _LINKS

    def frame(self) -> Frame:
        self._check_topology()
        identifiers = self._per_link("smarticle_id", np.int64, ())
        links = self._per_link("link", np.int64, ())
        if np.any(identifiers != identifiers[:, :1]) or np.any(links != np.arange(_LINKS)):
            self._refuse("'smarticle_id' and 'link' are not in smarticle-major order")
        phase = self._constant("phase")
        if phase < 0 or phase != math.floor(phase):
            self._refuse(f"'phase' must be a whole number, 0 or more: got {phase:g}")
        return Frame(
            path=self._path,
            time=self._constant("time_s"),
            floor_z=self._constant("floor_z_m"),
            phase=int(phase),
            vertices=self._vertices(),
            smarticle_ids=_frozen(identifiers[:, 0]),
            link_velocity=self._per_link("velocity_m_per_s", np.float64, (3,)),
            link_angular_velocity=self._per_link("angular_velocity_rad_per_s", np.float64, (3,)),
            contacts=_frozen(self._per_link("contacts", np.int64, ())[:, 0]),
            # What is left once the contract's own data are taken out.
            cell_data=MappingProxyType({name: _frozen(self._folded(values)) for name, values in self._data.items()}),
        )

    def _refuse(self, cause: str) -> NoReturn:
        refuse("frame", self._path, cause, _REMEDY_FRAME)

    def _check_topology(self) -> None:
        if self._count == 0:
            self._refuse("it holds no smarticle")
        if self._points.shape != (_CORNERS * self._count, 3):
            self._refuse(
                f"{len(self._lines)} lines need {_CORNERS * self._count} points of 3 coordinates: "
                f"got {self._points.shape}"
            )
        first = _CORNERS * np.arange(self._count)[:, None] + np.arange(_LINKS)
        expected = np.stack([first, first + 1], axis=-1).reshape(-1, 2)
        if not np.array_equal(self._lines, expected):
            self._refuse("its lines do not join tip, hinge, hinge, tip in order")

    def _vertices(self) -> NDArray[np.float64]:
        if not np.all(np.isfinite(self._points)):
            self._refuse("a point is not finite")
        return _frozen(self._points.astype(np.float64).reshape(self._count, _CORNERS, 3))

    def _folded(self, values: NDArray[Any]) -> NDArray[Any]:
        return values.reshape(self._count, _LINKS, *values.shape[1:])

    def _per_link(self, name: str, kind: Any, shape: tuple[int, ...]) -> NDArray[Any]:
        values = self._data.pop(name, None)
        if values is None:
            self._refuse(f"cell data '{name}' is missing")
        if values.shape != (_LINKS * self._count, *shape):
            self._refuse(f"cell data '{name}' has shape {values.shape}")
        return _frozen(self._folded(values.astype(kind)))

    def _constant(self, name: str) -> float:
        values = self._per_link(name, np.float64, ())
        first = float(values.flat[0])
        if not math.isfinite(first) or np.any(values != first):
            self._refuse(f"'{name}' must be finite and the same for all lines")
        return first


def _frozen(values: NDArray[Any]) -> NDArray[Any]:
    values = np.ascontiguousarray(values)
    values.flags.writeable = False
    return values
