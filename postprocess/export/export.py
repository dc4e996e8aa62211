"""A run as files for other programs: what is written, of which frames, and where to."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from dem.errors import InputError, RunError, nearest
from dem.record.frame import Frame
from dem.record.frames import read_frames
from dem.record.run import open_run
from postprocess.bodies.fields import IDENTITY, fields_of
from postprocess.bodies.meshes import Bodies, checked_kinds
from postprocess.export.collection import write_collection
from postprocess.export.solids import SUFFIXES, Painter

FORMATS = ("vtp", *SUFFIXES)
"""What a run can be exported to."""

_FIELDLESS = ("stl", "obj")

Tell = Callable[[int, int], None]
"""Receives how many frames are written, and of how many."""


def export_run(
    directory: Path | str,
    *,
    to: str,
    output: Path | str | None = None,
    time: float | None = None,
    every_frame: bool = False,
    wanted: Sequence[str] = (),
    unwanted: Sequence[str] = (),
    color_by: str | None = None,
    tell: Tell = lambda _done, _all: None,
) -> Path:
    """Write true bodies of a run for other programs.

    Args:
        directory: A run directory with at least one frame; the run need not be done.
        to: One of `FORMATS`.
        output: What to write, which must not exist: of vtp and of all frames a folder, else a file that ends as `to`
            says; `export-TO` or `export.TO` in the run directory if not given.
        time: Simulated time [s], the nearest frame is taken; the last one if not given.
        every_frame: All frames instead.
        wanted: Kinds of bodies besides the usual ones, see `postprocess.bodies.meshes.KINDS`.
        unwanted: Kinds and fields to leave out.
        color_by: Name of a field, for formats with colours; None: crossings, in a plane smarticle_id.
        tell: Progress.

    Returns:
        What was written; it is whole or not there.

    Raises:
        InputError: An unknown format, kind or field, no frame, a damaged one, a time before the first or after the last
            frame, or an output that exists.
        RunError: It cannot be written.
    """
    if to not in FORMATS:
        msg = f"--to {to}: no such format; {nearest(to, FORMATS, cutoff=0.5)}"
        raise InputError(msg)
    if every_frame and time is not None:
        msg = f"--time {time:g}: all frames are asked for; leave --time or --all out"
        raise InputError(msg)
    run = open_run(directory)
    fields = fields_of(run)
    kinds = checked_kinds(wanted, unwanted, also=[field.name for field in fields])
    frames = read_frames(directory)
    chosen = range(len(frames)) if every_frame else [len(frames) - 1 if time is None else frames.nearest(time)]
    folder = every_frame or to == "vtp"
    path = _checked_output(run.path, output, to, folder=folder)
    carried = [field for field in fields if field.name in IDENTITY or not (to in _FIELDLESS or field.name in unwanted)]
    bodies = Bodies(run, kinds, carried)
    bodies.hold(frames[index] for index in chosen)

    def followed() -> Iterator[tuple[int, Frame]]:
        for done, index in enumerate(chosen):
            yield index, frames[index]
            tell(done + 1, len(chosen))

    with _whole(path) as made:
        if folder:
            made.mkdir()
        if to == "vtp":
            found = write_collection(made, bodies, followed())
        else:
            painter = Painter(bodies, color_by, frames, chosen)
            found = 0
            for index, frame in followed():
                content = painter.content(frame, to)
                if content is not None:  # a wall alone that was taken away is no file
                    (made / f"frame_{index:06d}.{to}" if folder else made).write_bytes(content)
                    found += 1
        if not found:
            msg = f"nothing is left to export: of {', '.join(kinds)} there is none here; leave out less"
            raise InputError(msg)
    return path


def _checked_output(directory: Path, output: Path | str | None, to: str, *, folder: bool) -> Path:
    """Return where to write.

    Raises:
        InputError: There is something, or it cannot be there.
    """
    path = Path(output) if output is not None else directory / (f"export-{to}" if folder else f"export.{to}")
    if not folder and path.suffix != f".{to}":
        msg = f"--output {path}: a file of --to {to} must end in .{to}; got {path.suffix!r}"
        raise InputError(msg)
    if os.path.lexists(path):
        msg = f"--output {path}: exists, and exports replace nothing; choose another name"
        raise InputError(msg)
    if not path.parent.is_dir():
        msg = f"--output {path}: the folder {path.parent} does not exist; create it or choose another output"
        raise InputError(msg)
    return path


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """Give a path that does not exist yet, in a folder beside; moved to `path` when the block ends well, else removed.

    Raises:
        RunError: It cannot be written.
    """
    scratch: Path | None = None
    try:
        scratch = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
        made = scratch / path.name
        yield made
        made.rename(path)
    except OSError as error:
        msg = f"{path}: cannot be written ({error.strerror or error}); free space or choose another --output"
        raise RunError(msg) from error
    finally:
        if scratch is not None:
            shutil.rmtree(scratch, ignore_errors=True)
