"""The sequence of a run's frames: numbered files, and the ParaView collection with their times."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from numbers import Real
from operator import attrgetter
from pathlib import Path
from typing import overload
from xml.etree import ElementTree as ET
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np

from dem.arrays import Array
from dem.errors import InputError, RunError, shown
from dem.record import names
from dem.record.files import GONE, cannot_read, write_text, write_whole
from dem.record.frame import Frame, read_frame
from dem.record.vtkhdf import RADIUS, append, create, read_times, truncate

_REMEDY = "give the directory of a run that has written a frame"


@dataclass
class FrameWriter:
    """Writer of frames into a run directory; with each frame it rewrites `frames.pvd`, the list of frames."""

    folder: Path  #: The run directory
    noun: str = names.FRAME  #: Noun for names of files; "sphere" gives `spheres.pvd` and `spheres/sphere_000000.vtu`
    times: list[float] = field(default_factory=list)  #: Times of the frames written so far [s]

    def write(self, mesh: meshio.Mesh, time: float) -> None:
        """Write one frame at a simulated time [s]."""
        name = names.member(self.noun, len(self.times))
        write_whole(self.folder / name, lambda path: mesh.write(path, file_format="vtu"))
        self.times.append(time)
        write_text(self.folder / names.collection(self.noun), self._collection(), make_folder=False)

    def check(self) -> None:
        """Raise RunError if a file that this writer wrote is missing."""
        folder = self.folder / names.folder(self.noun)
        present = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
        for number in range(len(self.times)):
            path = self.folder / names.member(self.noun, number)
            if path.name not in present:
                raise RunError(f"{path}: {GONE}")

    def truncate(self, times: Sequence[float]) -> None:
        """Keep the first frames, whose times [s] are given, and remove all later ones."""
        self.times = list(times)
        kept = {self.folder / names.member(self.noun, k) for k in range(len(self.times))}
        for path in set((self.folder / names.folder(self.noun)).glob("*.vtu")) - kept:
            path.unlink()
        write_text(self.folder / names.collection(self.noun), self._collection(), make_folder=False)

    def _collection(self) -> str:
        rows = [
            f'    <DataSet timestep="{time:.9g}" group="" part="0" file={quoteattr(names.member(self.noun, k))}/>'
            for k, time in enumerate(self.times)
        ]
        head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        return head + "  <Collection>\n" + "\n".join(rows) + "\n  </Collection>\n</VTKFile>\n"


@dataclass
class OneFileWriter(FrameWriter):
    """Writer of frames into one file, `frames.vtkhdf`, with the radius of each line."""

    radii: Sequence[float] = ()  #: Radius of the lines of each kind of body or link [m]
    kind: str = "link"  #: Name of the cell data with the kind of each line, an index of `radii`

    def write(self, mesh: meshio.Mesh, time: float) -> None:
        """Write one frame at a simulated time [s]."""
        radii = np.asarray(self.radii)[mesh.cell_data[self.kind][0]]
        at_points = np.zeros(len(mesh.points))
        for end in mesh.cells[0].data.T:
            np.maximum.at(at_points, end, radii)
        cell_data = {**mesh.cell_data, RADIUS: [radii]}
        whole = meshio.Mesh(mesh.points, mesh.cells, point_data={RADIUS: at_points}, cell_data=cell_data)
        (append if self.times else create)(self.folder / names.VTKHDF, whole, time)
        self.times.append(time)

    def check(self) -> None:
        """Raise RunError if the file is missing although frames were written."""
        path = self.folder / names.VTKHDF
        if self.times and not path.is_file():
            raise RunError(f"{path}: {GONE}")

    def truncate(self, times: Sequence[float]) -> None:
        """Keep the first frames, whose times [s] are given, and remove all later ones."""
        self.times = list(times)
        truncate(self.folder / names.VTKHDF, len(times))


class FrameSequence(Sequence[Frame]):
    """The frames of a run in time order; access to a frame reads its file, a slice reads no file.

    Attributes:
        times: (n,) float64 [s], as listed in `frames.pvd` or `frames.vtkhdf`.
        paths: (n,) files in time order; a file that holds all frames is repeated.
        numbers: (n,) numbers of the frames in their run; 0, 1, 2, … by default.
    """

    def __init__(self, times: Array, paths: tuple[Path, ...], numbers: Sequence[int] | None = None) -> None:
        self.times = times
        self.paths = paths
        self.numbers = range(len(paths)) if numbers is None else numbers

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
            return FrameSequence(self.times[index], self.paths[index], self.numbers[index])
        return read_frame(self.paths[index], self.numbers[index])

    def nearest(self, time: float) -> int:
        """Return the index of the frame nearest to a time [s]; raise InputError outside of the frames' times."""
        first, last = float(self.times[0]), float(self.times[-1])
        slack = 1e-9 * max(abs(first), abs(last), 1.0)
        if not first - slack <= time <= last + slack:
            raise InputError(f"time must be between {first:g} s and {last:g} s, the run's frames: got {time:g} s")
        return int(np.argmin(np.abs(self.times - time)))

    def after(self, time: float) -> FrameSequence:
        """Return the frames later than a time [s], without reading a file."""
        # Times in the list are rounded to nine digits.
        return self[bisect_right(self.times, time + 1e-8 * max(abs(time), 1.0)) :]

    def in_phase(self, phase: int) -> FrameSequence:
        """Return the frames of the phase with index `phase`; bisection reads only a few files.

        Raises InputError if `phase` is not 0, 1, 2, …
        """
        if not (isinstance(phase, Real) and phase >= 0 and phase % 1 == 0):
            raise InputError(
                f"in_phase: {shown(phase)} is no number of a phase; give one from 0, as the scene lists them"
            )
        first = bisect_left(self, phase, key=attrgetter("phase"))
        last = bisect_right(self, phase, lo=first, key=attrgetter("phase"))
        return self[first:last]


def read_frames(directory: Path | str) -> FrameSequence:
    """Return the frames of a run directory, whose run may be done, failed or still running."""
    path, stored = (Path(directory) / name for name in (names.collection(names.FRAME), names.VTKHDF))
    files: list[Path] = []
    cause: BaseException | str | None = None
    if stored.exists():
        path, times = stored, read_times(stored).tolist()
        files = [stored] * len(times)
    else:
        times = []
        try:
            for entry in ET.parse(path).getroot().iter("DataSet"):
                times.append(float(entry.attrib["timestep"]))
                name = Path(entry.attrib["file"])
                if name.is_absolute() or ".." in name.parts:
                    cause = f"{shown(str(name))} lies outside of the run directory"
                files.append(path.parent / name)
        except FileNotFoundError as error:
            cause = f"{error.strerror}, and no {names.VTKHDF} either"
        except (OSError, ET.ParseError) as error:
            cause = error
        except (KeyError, ValueError) as error:
            cause = f"entry {len(files)} lacks a time or a file ({error})"
    if cause is None and not files:
        cause = "it lists no frame"
    elif cause is None and (not np.all(np.isfinite(times)) or np.any(np.diff(times) < 0)):
        cause = "its times do not ascend"
    if cause is not None:
        cannot_read("list of frames", path, cause, _REMEDY)
    return FrameSequence(np.array(times), tuple(files))
