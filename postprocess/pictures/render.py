"""Pictures and films of a run, off-screen: what is drawn, and where to. How is in `postprocess.pictures.canvas`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from dem.errors import InputError
from dem.record.frames import FrameSequence, read_frames
from dem.record.manifest import RunManifest, read_run
from postprocess.pictures import film
from postprocess.pictures.camera import Look, extent
from postprocess.pictures.canvas import Canvas
from postprocess.pictures.surroundings import read_surroundings
from postprocess.report import figures

if TYPE_CHECKING:
    from numpy.typing import NDArray

_MOST_FILM_FRAMES = 150


def render_run(
    directory: Path | str,
    *,
    output: Path | str | None = None,
    time: float | None = None,
    color_by: str | None = None,
    size: tuple[int, int] = (1200, 1200),
    view: str | None = None,
    overwrite: bool = False,
) -> Path:
    """Draws one frame of a run: every link as its real box, in a container cut open in front, with its hooks.

    A cylinder is drawn up to a little above the pile, a mould of tiers as it is. A wall that is being lifted is where
    it is then; of one that was taken away its outline is left, faint.

    Args:
        directory: A run directory with at least one frame; the run need not be done.
        output: File to write, `.png`; `render.png` in the run directory if not given.
        time: Simulated time [s], the nearest frame is taken; the last one if not given.
        color_by: Key of `COLOURINGS`; None: crossings, and of motion in a plane, which has none, id.
        size: Width and height [pixel].
        view: Key of `VIEWS`; None: from the front, of motion in a plane from above.
        overwrite: Whether an existing file may be replaced.

    Returns:
        The file written.

    Raises:
        InputError: No frame, unknown colouring or view, a time before the first or after the last
            frame, a bad size, or an output that exists.
        RunError: This machine lacks the libraries to draw without a display.

    Example:
        >>> render_run("runs/pile", color_by="height", view="oblique").name
        'render.png'
    """
    output = _checked_output(directory, output, "render.png", (".png",))
    run = read_run(directory)
    look = Look.checked(color_by=color_by or _usual_colour(run), size=size, view=view or _usual_view(run))
    frames = read_frames(directory)
    frame = frames[_frame_at(frames, time)]
    # Before an hour of drawing, not after it; and after all that is wrong with what was asked for.
    figures.refuse_to_overwrite(output, overwrite=overwrite)
    values = look.colouring.values(frame)
    around = read_surroundings(run)
    with Canvas(run, look, around, extent(frame, run, look, around), _span(values)) as canvas:
        image = canvas.picture(frame, values)
    with figures.whole_file(output, overwrite=overwrite) as temporary:
        image.save(temporary)
    return output


def render_film(
    directory: Path | str,
    output: Path | str | None = None,
    *,
    color_by: str | None = None,
    size: tuple[int, int] = (720, 720),
    view: str | None = None,
    frames_per_second: float = 15.0,
    most_frames: int = _MOST_FILM_FRAMES,
    overwrite: bool = False,
) -> Path:
    """Draws a film of a run with one camera and one scale of colours throughout.

    Args:
        directory: A run directory with at least two frames.
        output: File to write: `.gif` or `.webp`, which need nothing further, or `.mp4`, which
            needs the packages imageio and imageio-ffmpeg; `film.gif` in the run directory if not
            given.
        color_by: Key of `COLOURINGS`; None: crossings, and of motion in a plane, which has none, id.
        size: Width and height [pixel]; for `.mp4` even numbers.
        view: Key of `VIEWS`; None: from the front, of motion in a plane from above.
        frames_per_second: Of the film.
        most_frames: Longer runs are thinned evenly to so many frames.
        overwrite: Whether an existing file may be replaced.

    Returns:
        The file written.

    Raises:
        InputError: Fewer than two frames, a kind of file that cannot be written here, an output
            that exists, or as in `render_run`.
    """
    output = _checked_output(directory, output, "film.gif", film.KINDS)
    run = read_run(directory)
    look = Look.checked(color_by=color_by or _usual_colour(run), size=size, view=view or _usual_view(run))
    if not (math.isfinite(frames_per_second) and frames_per_second > 0 and most_frames >= 2):
        msg = (
            "a film needs frames_per_second above 0 1/s and most_frames of at least 2: "
            f"got {frames_per_second} 1/s, {most_frames}"
        )
        raise InputError(msg)
    film.check_film(output, size)
    frames = read_frames(directory)
    if len(frames) < 2:
        msg = f"{directory}: a film needs at least 2 frames: got {len(frames)}; draw a picture (.png)"
        raise InputError(msg)
    figures.refuse_to_overwrite(output, overwrite=overwrite)
    shown = np.unique(np.linspace(0, len(frames) - 1, most_frames).round().astype(int))
    around = read_surroundings(run)
    extents, values = [], []
    for index in shown:
        frame = frames[int(index)]
        extents.append(extent(frame, run, look, around))
        values.append(look.colouring.values(frame))

    with (
        Canvas(run, look, around, np.concatenate(extents), _span(np.concatenate(values))) as canvas,
        figures.whole_file(output, overwrite=overwrite) as temporary,
    ):

        def picture(number: int) -> Image.Image:
            return canvas.picture(frames[int(shown[number])], values[number])

        samples = [picture(number) for number in sorted({0, len(shown) // 3, 2 * len(shown) // 3, len(shown) - 1})]
        film.write_film(temporary, map(picture, range(len(shown))), frames_per_second, samples)
    return output


def _usual_colour(run: RunManifest) -> str:
    return "id" if run.planar else "crossings"


def _usual_view(run: RunManifest) -> str:
    return "top" if run.planar else "front"


def _checked_output(
    directory: Path | str,
    output: Path | str | None,
    default: str,
    kinds: tuple[str, ...],
) -> Path:
    path = Path(directory) / default if output is None else Path(output)
    if path.suffix not in kinds:
        msg = f"{path}: the output must end in {' or '.join(kinds)}: got '{path.suffix}'"
        raise InputError(msg)
    return path


def _frame_at(frames: FrameSequence, time: float | None) -> int:
    """Index of the frame nearest to a time [s]; the last one for None."""
    if time is None:
        return len(frames) - 1
    first, last = float(frames.times[0]), float(frames.times[-1])
    slack = 1e-9 * max(abs(first), abs(last), 1.0)
    if not first - slack <= time <= last + slack:
        msg = f"time must be between {first:g} s and {last:g} s, the run's frames: got {time:g} s"
        raise InputError(msg)
    return int(np.argmin(np.abs(frames.times - time)))


def _span(values: NDArray[Any]) -> tuple[float, float]:
    return float(values.min()), float(values.max())
