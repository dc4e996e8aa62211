"""Frames in one file: VTK reads what was written, and a process that ends at any moment loses nothing."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import pytest
from synthetic import mesh_of
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkTubeFilter
from vtkmodules.vtkIOHDF import vtkHDFReader

from dem.errors import InputError, RunError
from dem.record import journal, vtkhdf
from dem.record.frame import read_frame
from dem.record.frames import OneFileWriter, read_frames
from dem.record.journal import journal_of
from dem.record.names import VTKHDF

RADII = (2e-4, 3e-4, 2e-4)
COUNTS = (1, 3, 3, 400, 400, 7)  # smarticles; 400 need more than one chunk of points


class KilledError(BaseException):
    """Stands for SIGKILL: nothing that handles errors may run."""


def mesh(count: int, number: int) -> meshio.Mesh:
    random = np.random.default_rng(number)
    made = mesh_of(random.normal(size=(count, 4, 3)), time=time_of(number), contacts=random.integers(0, 9, count))
    made.cell_data["velocity_m_per_s"][0] = random.normal(size=(3 * count, 3))
    return made


def time_of(number: int) -> float:
    return 0.04 * number


def write(folder: Path, counts: Sequence[int] = COUNTS, first: int = 0) -> Path:
    writer = OneFileWriter(folder, times=[time_of(k) for k in range(first)], radii=RADII)
    for number, count in enumerate(counts[first:], first):
        writer.write(mesh(count, number), time_of(number))
    return folder / VTKHDF


def arrays(one: meshio.Mesh) -> Mapping[str, Any]:
    return {"points": one.points, "lines": one.cells[0].data, **{name: rows[0] for name, rows in one.cell_data.items()}}


def holds(path: Path, counts: Sequence[int] = COUNTS) -> None:
    """The file holds exactly these frames, bit by bit."""
    assert vtkhdf.read_times(path).tolist() == [time_of(k) for k in range(len(counts))]
    for number, count in enumerate(counts):
        found, wanted = arrays(vtkhdf.read_step(path, number)), arrays(mesh(count, number))
        assert found.keys() == wanted.keys() | {"radius_m"}
        for name, values in wanted.items():
            assert found[name].dtype == values.dtype
            assert found[name].tobytes() == values.tobytes(), (number, name)


def vtk_step(path: Path, number: int) -> Any:
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    reader.SetStep(number)
    reader.Update()
    assert reader.GetNumberOfSteps() == len(vtkhdf.read_times(path))
    assert reader.GetTimeValue() == pytest.approx(time_of(number))
    return reader.GetOutput()


def read_by_vtk(path: Path, counts: Sequence[int]) -> None:
    for number in (*range(len(counts)), 0):  # and back again
        found, wanted = vtk_step(path, number), mesh(counts[number], number)
        assert np.array_equal(vtk_to_numpy(found.GetPoints().GetData()), wanted.points)
        lines = vtk_to_numpy(found.GetLines().GetConnectivityArray()).reshape(-1, 2)
        assert np.array_equal(lines, wanted.cells[0].data)
        for name, (values,) in wanted.cell_data.items():
            assert np.array_equal(vtk_to_numpy(found.GetCellData().GetArray(name)), values), (number, name)


def test_vtk_reads_every_step_in_any_order(tmp_path: Path) -> None:
    path = write(tmp_path)
    holds(path)
    read_by_vtk(path, COUNTS)


def test_a_file_of_one_step_is_read(tmp_path: Path) -> None:
    path = write(tmp_path, (3,))
    holds(path, (3,))
    read_by_vtk(path, (3,))


def test_the_tubes_of_vtk_have_the_radii_of_the_bodies(tmp_path: Path) -> None:
    found = vtk_step(write(tmp_path, (2,)), 0)
    radii = vtk_to_numpy(found.GetCellData().GetArray("radius_m"))
    assert radii.tolist() == [*RADII, *RADII]
    found.GetPointData().SetActiveScalars("radius_m")
    tube = vtkTubeFilter()
    tube.SetInputData(found)
    tube.SetVaryRadiusToVaryRadiusByAbsoluteScalar()
    tube.SetNumberOfSides(12)
    tube.Update()
    surface = vtk_to_numpy(tube.GetOutput().GetPoints().GetData()).reshape(6, 2, 12, 3)
    ends = mesh(2, 0).points.reshape(2, 4, 3)
    # A hinge belongs to two links and has the larger radius.
    for at, axis, radius in ((0, ends[0, 0], RADII[0]), (1, ends[0, 1], RADII[1])):
        distances = np.linalg.norm(surface[0, at] - axis, axis=1)
        assert distances == pytest.approx(radius, rel=1e-3)  # VTK's tubes have single precision


@pytest.mark.parametrize("kept", range(len(COUNTS) + 1))
def test_a_truncated_file_continues_as_if_it_had_not_been_longer(tmp_path: Path, kept: int) -> None:
    path = write(tmp_path)
    OneFileWriter(tmp_path, radii=RADII).truncate([time_of(k) for k in range(kept)])
    if kept:
        holds(path, COUNTS[:kept])
        read_by_vtk(path, COUNTS[:kept])
    else:
        assert not path.exists()
    write(tmp_path, first=kept)
    holds(path)


def torn_at(pages: int) -> Callable[..., None]:
    """Return `journal._change`, which ends after so many pages of a change are on the disk."""
    change = journal._change

    def torn(path: Path, size: int, changed: Mapping[int, bytes]) -> None:
        some = dict(sorted(changed.items(), reverse=True)[:pages])
        # The size is the last that changes.
        change(path, size if len(some) < pages else max(size, path.stat().st_size), some)
        raise KilledError

    return torn


@pytest.mark.parametrize("shrinks", [False, True], ids=["append", "truncate"])
def test_a_file_is_as_before_wherever_the_process_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shrinks: bool
) -> None:
    path = write(tmp_path)
    before = path.read_bytes()
    for pages in (0, 1, 2, 5, 9, 14, 20, 30, 10**9):
        path.write_bytes(before)
        journal_of(path).unlink(missing_ok=True)
        writer = OneFileWriter(tmp_path, times=[time_of(k) for k in range(len(COUNTS))], radii=RADII)
        change = (
            partial(writer.truncate, writer.times[:1]) if shrinks else partial(writer.write, mesh(9, 6), time_of(6))
        )
        with monkeypatch.context() as patched:
            patched.setattr(journal, "_change", torn_at(pages))
            with pytest.raises(KilledError):
                change()
        assert journal_of(path).exists()
        assert pages == 0 or path.read_bytes() != before
        holds(path)
    write(tmp_path, (*COUNTS, 2, 3), first=len(COUNTS))  # the next process goes on
    holds(path, (*COUNTS, 2, 3))
    assert not journal_of(path).exists()


def test_a_full_disk_leaves_the_file_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path)
    before, change, calls = path.read_bytes(), journal._change, []

    def full(where: Path, size: int, pages: Mapping[int, bytes]) -> None:
        calls.append(size)
        if len(calls) == 1:
            change(where, size, dict(list(pages.items())[:3]))
            raise OSError(28, "No space left on device")
        change(where, size, pages)

    monkeypatch.setattr(journal, "_change", full)
    with pytest.raises(RunError, match=r"frames\.vtkhdf: cannot be written \(No space left on device\); free space"):
        write(tmp_path, (*COUNTS, 2), first=len(COUNTS))
    assert path.read_bytes() == before
    write(tmp_path, (*COUNTS, 2), first=len(COUNTS))
    holds(path, (*COUNTS, 2))


def test_a_killed_process_loses_no_frame_that_it_has_written(tmp_path: Path) -> None:
    path, acknowledged, counts = tmp_path / VTKHDF, tmp_path / "written", (5,) * 10_000
    random = np.random.default_rng(3)
    first = 0
    acknowledged.write_text("0", encoding="ascii")
    for _ in range(8):
        child = os.fork()
        if not child:
            writer = OneFileWriter(tmp_path, times=[time_of(k) for k in range(first)], radii=RADII)
            for number in range(first, len(counts)):
                writer.write(mesh(5, number), time_of(number))
                acknowledged.write_text(f"{number + 1}", encoding="ascii")
            os._exit(0)
        until = time.monotonic() + 60
        while int(acknowledged.read_text(encoding="ascii") or 0) < first + 2:  # a busy machine starts late
            assert time.monotonic() < until
            time.sleep(0.01)
        time.sleep(random.uniform(0.0, 0.1))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        written = int(acknowledged.read_text(encoding="ascii") or first)  # the kill may have come within this file
        number = len(vtkhdf.read_times(path))
        assert number >= max(written, first)
        holds(path, counts[:number])
        first = number
    assert first > 8


def test_a_reader_begins_again_if_the_file_changes_meanwhile(tmp_path: Path) -> None:
    path, numbers = write(tmp_path, (5,)), []

    def number(root: Any) -> int:
        numbers.append(int(root["Steps"].attrs["NSteps"]))
        if len(numbers) == 1:
            write(tmp_path, (5, 5), first=1)
        return numbers[-1]

    assert vtkhdf._read(path, "frames", number) == 2
    assert numbers == [1, 2]


@pytest.mark.parametrize("mode", ["r", "r+"])
@pytest.mark.parametrize("locking", [True, False])
def test_frames_are_read_while_the_file_is_open_elsewhere(tmp_path: Path, mode: str, *, locking: bool) -> None:
    path = write(tmp_path, (3, 5))
    with h5py.File(path, mode, locking=locking):
        holds(path, (3, 5))


@pytest.mark.parametrize("killed", [False, True])
def test_frames_are_read_and_added_while_another_process_has_the_file_open_to_write(
    tmp_path: Path, *, killed: bool
) -> None:
    path = write(tmp_path, (3, 5))
    # HDF5 marks the file as open; the mark of a killed process stays.
    code = f"import h5py, os, sys; f = h5py.File({str(path)!r}, 'r+'); print('open', flush=True); sys.stdin.read()"
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"open\n"
        if killed:
            other.kill()
            other.wait()
        holds(path, (3, 5))
        if killed:
            write(tmp_path, (3, 5, 4), first=2)
            holds(path, (3, 5, 4))
            read_by_vtk(path, (3, 5, 4))
        other.kill()


@pytest.fixture
def damaged(tmp_path: Path) -> Iterator[Callable[[Callable[[h5py.File], object]], Path]]:
    path = write(tmp_path, (3, 3))

    def change(by: Callable[[h5py.File], object]) -> Path:
        with h5py.File(path, "r+") as file:
            by(file["VTKHDF"])
        return path

    return change


def replace(root: Any, name: str, by: Any) -> None:
    del root[name]
    root[name] = by


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda root: replace(root, "Points", h5py.ExternalLink("/etc/passwd", "/x")), "Points is a link"),
        (lambda root: replace(root, "CellData", h5py.SoftLink("/VTKHDF/Lines")), "CellData is a link"),
        (lambda root: replace(root, "Points", np.zeros((24, 3))), "Points is of another kind"),
        (lambda root: root["Points"].resize(2, axis=0), "Points does not hold its rows"),
        (lambda root: root["NumberOfPoints"].write_direct(np.array([10**12])), "Points does not hold its rows"),
        (lambda root: replace(root, "CellData/link", root["CellData/phase"]), "smarticle-major"),
        (lambda root: root.__delitem__("CellData/time_s"), "'time_s' is missing"),
        (lambda root: root["Lines/Offsets"].write_direct(np.arange(10)), "other than two points"),
        (lambda root: root["Steps"].attrs.modify("NSteps", np.int64(0)), "no step 1"),
    ],
)
def test_a_damaged_file_ends_in_one_line(damaged: Any, change: Any, message: str) -> None:
    path = damaged(change)
    with pytest.raises(InputError, match=message) as error:
        read_frame(path, 1)
    text = str(error.value)
    assert "\n" not in text
    assert f"cannot read frame 1 of {path}: " in text
    assert "put the file back, or run " in text


def test_flipped_bits_end_in_one_line_or_change_nothing(tmp_path: Path) -> None:
    path = write(tmp_path, (3, 3))
    content, random = path.read_bytes(), np.random.default_rng(1)
    wanted = [read_frame(path, k).link_velocity.tobytes() for k in range(2)]
    messages = []
    for _ in range(60):
        flipped = bytearray(content)
        flipped[random.integers(len(content))] ^= 1 << int(random.integers(8))
        path.write_bytes(flipped)
        try:
            assert [frame.link_velocity.tobytes() for frame in read_frames(tmp_path)] == wanted
        except InputError as error:
            messages.append(str(error))
    assert len(messages) > 20
    assert not any("\n" in message for message in messages)


@pytest.mark.parametrize("kept", [0, 3, 500, 0.5, 0.99])
def test_a_truncated_file_ends_in_one_line(tmp_path: Path, kept: float) -> None:
    path = write(tmp_path)
    os.truncate(path, kept if isinstance(kept, int) else int(kept * path.stat().st_size))
    with pytest.raises(InputError, match=r"cannot read frames .*frames\.vtkhdf: truncated or not VTKHDF .*; put the"):
        read_frames(tmp_path)


def test_a_damaged_journal_ends_in_one_line(tmp_path: Path) -> None:
    path = write(tmp_path)
    journal_of(path).write_bytes(b"nonsense" * 4)
    with pytest.raises(InputError, match=r"its journal frames\.vtkhdf\.journal is damaged"):
        read_frames(tmp_path)
