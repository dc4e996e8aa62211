"""Pictures and films of runs, off-screen: what is drawn, and where to. How is in `postprocess.pictures.canvas`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image

from dem.errors import InputError
from postprocess.pictures import film
from postprocess.pictures.camera import Look
from postprocess.pictures.canvas import Canvas
from postprocess.pictures.captions import caption_of, titles_of
from postprocess.pictures.colouring import COLOURINGS, ColourScale
from postprocess.pictures.focus import focused
from postprocess.pictures.moments import MOST, RATE, Moments
from postprocess.pictures.page import Page, page_size
from postprocess.pictures.shot import Shot, Span, common_times, span_of
from postprocess.report import figures

Limits = Span | Literal["run"] | None
"""Ends of the scale of colours: given, of all frames of the runs, or of what is shown."""

Track = Callable[[Iterable[int], int], Iterable[int]]
"""Follows the pictures of a film, of which there are so many."""


def render_run(
    directory: Path | str,
    *,
    compare: Sequence[Path | str] = (),
    output: Path | str | None = None,
    time: float | None = None,
    color_by: str | None = None,
    limits: Limits = None,
    smarticle: int | None = None,
    size: tuple[int, int] = (1200, 1200),
    view: str | None = None,
    forces: bool = False,
    overwrite: bool = False,
) -> Path:
    """Draws one frame of a run: every link as its real box, in a container cut open in front, with hooks and strings.

    A cylinder is drawn up to a little above the pile, a mould of tiers as it is. A wall that is being lifted is where
    it is then; of one that was taken away its outline is left, faint. A bar tells how long a millimetre is half way
    between the nearest and the farthest point.

    Args:
        directory: A run directory with at least one frame; the run need not be done.
        compare: Further runs, drawn beside it at the same time, from the same distance and in the same colours.
        output: File to write, `.png`; `render.png` in the run directory if not given.
        time: Simulated time [s], the nearest frame is taken; the last one that all runs have if not given.
        color_by: Key of `COLOURINGS`; None: crossings, and of motion in a plane, which has none, id.
        limits: Ends of the scale of colours; those of this picture if not given.
        smarticle: Number of a smarticle: only it and those that pass through its plane are drawn, looked at through
            its mouth.
        size: Width and height of the picture of one run [pixel].
        view: Key of `VIEWS`; None: from the front, of motion in a plane from above.
        forces: Whether lines of force are drawn, through smarticles that let them be seen; as thick as the normal force
            is large.
        overwrite: Whether an existing file may be replaced.

    Returns:
        The file written.

    Raises:
        InputError: No frame, unknown colouring or view, a time before the first or after the last
            frame, a bad size, bad limits, no such smarticle, or an output that exists.
        RunError: This machine lacks the libraries to draw without a display.

    Example:
        >>> render_run("runs/pile", color_by="height", view="oblique").name
        'render.png'
    """
    output = _checked_output(directory, output, "render.png", (".png",))
    shots = [Shot.of(path) for path in (directory, *compare)]
    if time is None and compare:
        time = float(common_times(shots)[-1])
    indices = [[shot.frame_at(time)] for shot in shots]
    look = _look(shots, color_by, size, view)
    # Before an hour of drawing, not after it; and after all that is wrong with what was asked for.
    figures.refuse_to_overwrite(output, overwrite=overwrite)
    if smarticle is not None:
        if compare or color_by is not None or view is not None or forces:
            msg = f"smarticle {smarticle}: is drawn alone, in colours and from a side of its own; leave out the others"
            raise InputError(msg)
        image = focused(shots[0], indices[0][0], smarticle, size)
    else:
        with _Set(shots, indices, look, limits, quick=False, forces=forces) as scenery:
            image = scenery.picture([frames[0] for frames in indices])
    with figures.whole_file(output, overwrite=overwrite) as temporary:
        image.save(temporary)
    return output


def render_film(
    directory: Path | str,
    output: Path | str | None = None,
    *,
    compare: Sequence[Path | str] = (),
    color_by: str | None = None,
    limits: Limits = None,
    size: tuple[int, int] = (720, 720),
    view: str | None = None,
    frames_per_second: float = RATE,
    start: float | None = None,
    end: float | None = None,
    every: float | None = None,
    most_frames: int = MOST,
    forces: bool = False,
    track: Track | None = None,
    overwrite: bool = False,
) -> Path:
    """Draws a film of a run with one camera and one scale of colours throughout.

    Its pictures are at equal distances in simulated time, each the nearest recorded frame, so that it plays at one
    speed, which its caption tells.

    Args:
        directory: A run directory with at least two frames.
        output: File to write: `.gif` or `.webp`, or `.mp4`, which needs the package imageio-ffmpeg;
            `film.gif` in the run directory if not given.
        compare: Further runs, as in `render_run`; the film shows the times that all have come to.
        color_by: Key of `COLOURINGS`; None: crossings, and of motion in a plane, which has none, id.
        limits: Ends of the scale of colours; those of the film if not given.
        size: Width and height of the picture of one run [pixel]; for `.mp4` even numbers.
        view: Key of `VIEWS`; None: from the front, of motion in a plane from above.
        frames_per_second: Of the film.
        start: Simulated time at which it begins [s]; that of the first frame if not given.
        end: Simulated time at which it ends [s]; that of the last frame if not given.
        every: Simulated time from one picture to the next [s]; if not given, that between frames.
        most_frames: Unless `every` is given, longer runs are thinned evenly to so many pictures.
        forces: As in `render_run`; the thickest line is that of the largest force of the film.
        track: Follows the drawing, see `Track`.
        overwrite: Whether an existing file may be replaced.

    Returns:
        The file written.

    Raises:
        InputError: Fewer than two frames, a kind of file that cannot be written here, an output
            that exists, times that make no film, or as in `render_run`.
    """
    output = _checked_output(directory, output, "film.gif", film.KINDS)
    if most_frames < 2:
        msg = f"a film needs most_frames of at least 2: got {most_frames}; leave it out for {MOST}"
        raise InputError(msg)
    shots = [Shot.of(path) for path in (directory, *compare)]
    look = _look(shots, color_by, size, view)
    film.check_film(output, page_size(look, len(shots)))
    moments = Moments.chosen(
        common_times(shots), start=start, end=end, every=every, rate=frames_per_second, most=most_frames
    )
    indices = [moments.indices(shot.frames.times).tolist() for shot in shots]
    figures.refuse_to_overwrite(output, overwrite=overwrite)
    numbers = range(len(moments.times))
    with (
        _Set(shots, indices, look, limits, quick=True, forces=forces) as scenery,
        figures.whole_file(output, overwrite=overwrite) as temporary,
    ):

        def picture(number: int) -> Image.Image:
            return scenery.picture([frames[number] for frames in indices], pace=moments.pace)

        last = numbers[-1]
        sampled = sorted({0, last // 3, 2 * last // 3, last}) if output.suffix == ".gif" else []
        film.write_film(
            temporary,
            map(picture, numbers if track is None else track(numbers, len(numbers))),
            count=len(numbers),
            rate=moments.rate,
            samples=[picture(number) for number in sampled],
            keys=scenery.scale.keys,
        )
    return output


class _Set:
    """Runs side by side under one camera, in one scale of colours.

    Args:
        shots: The runs.
        indices: Of the frames of each that are to be shown.
        look: Of each.
        limits: Ends of the scale.
        quick: See `Canvas`.
        forces: Whether lines of force are drawn.

    Raises:
        InputError: A run records no forces, or as in `render_run`.
    """

    def __init__(
        self,
        shots: Sequence[Shot],
        indices: Sequence[Sequence[int]],
        look: Look,
        limits: Limits,
        *,
        quick: bool,
        forces: bool,
    ) -> None:
        self._shots = shots
        self._look = look
        self._titles = titles_of([shot.run for shot in shots])
        pairs = list(zip(shots, indices, strict=True))
        self._values = [dict(zip(frames, shot.values(frames, look), strict=True)) for shot, frames in pairs]
        self.scale = ColourScale.of(look.colouring, *self._span(limits))
        self._largest = max(shot.largest_force(frames) for shot, frames in pairs) if forces else None
        extents = [shot.extent(frames, look) for shot, frames in pairs]
        # All walls are drawn as high as the highest pile asks for, and some are wider than that one's.
        top = float(np.concatenate(extents)[:, 2].max())
        extents += [shot.rims(top, look) for shot in shots]
        self._stack = ExitStack()
        with ExitStack() as stack:
            self._canvases = [
                stack.enter_context(
                    Canvas(
                        shot.run, look, shot.around, np.concatenate(extents), quick=quick, largest_force=self._largest
                    )
                )
                for shot in shots
            ]
            self._stack = stack.pop_all()
        self._page = Page(look, self.scale, self._canvases[0].pixel, columns=len(shots))

    def __enter__(self) -> _Set:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _span(self, limits: Limits) -> Span:
        if isinstance(limits, tuple):
            low, high = limits
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                msg = f"limits of the colours must be two finite numbers in order: got {low:g} and {high:g}"
                raise InputError(msg)
            return low, high
        if limits == "run":
            return span_of(
                values for shot in self._shots for values in shot.values(range(len(shot.frames)), self._look)
            )
        return span_of(values for of_run in self._values for values in of_run.values())

    def picture(self, indices: Sequence[int], *, pace: str = "") -> Image.Image:
        """One picture of a frame of each run."""
        panels, captions = [], []
        parts = zip(self._shots, self._canvases, self._values, self._titles, indices, strict=True)
        for shot, canvas, values, title, index in parts:
            frame = shot.frames[index]
            panels.append(canvas.panel(frame, self.scale.colours(values[index])))
            known = values[index] if self._look.colouring is COLOURINGS["crossings"] else None
            captions.append(caption_of(frame, shot.run, pace=pace, title=title, force=self._largest, crossings=known))
        return self._page.picture(panels, captions)


def _look(shots: Sequence[Shot], color_by: str | None, size: tuple[int, int], view: str | None) -> Look:
    planar = shots[0].run.manifest.planar
    if any(shot.run.manifest.planar != planar for shot in shots):
        msg = "a run in a plane and one in space have no view in common; compare runs of one kind"
        raise InputError(msg)
    return Look.checked(
        color_by=color_by or ("id" if planar else "crossings"), size=size, view=view or ("top" if planar else "front")
    )


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
