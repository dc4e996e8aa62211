"""Pictures and films of runs, off-screen."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from PIL import Image

from dem.errors import InputError
from dem.record.forces import read_forces
from postprocess.bodies.colours import ColourScale, Span, span
from postprocess.geometry.links import Floats
from postprocess.pictures import film
from postprocess.pictures.canvas import VIEWS, Canvas, Caption, Look, axes_from, drawn, union
from postprocess.pictures.captions import caption_of, titles_of
from postprocess.pictures.focus import focused
from postprocess.pictures.shot import Shot
from postprocess.report import figures

Limits = Span | Literal["run"] | None
"""Ends of the scale of colours: given, of all frames of the runs, or of what is shown."""

Track = Callable[[Iterable[Image.Image], int], Iterable[Image.Image]]
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
    """Draw one frame of a run: every link as its real box, in a container cut open in front, with hooks and strings.

    A wall that is being lifted is where it is then; of one that was taken away its outline is left, faint.

    Args:
        directory: A run directory with at least one frame; the run need not be done.
        compare: Further runs, drawn beside it at the same time, from the same distance and in the same colours.
        output: File to write, `.png`; `render.png` in the run directory if not given.
        time: Simulated time [s], the nearest frame is taken; the last one that all runs have if not given.
        color_by: Name of a field, or height, speed, id; None: crossings, and of motion in a plane, which has none, id.
        limits: Ends of the scale of colours; those of this picture if not given.
        smarticle: Number of a smarticle: only it and those that pass through its plane are drawn, looked at through
            its mouth.
        size: Width and height of the picture of one run [pixel].
        view: Key of `VIEWS`; None: from the front, of motion in a plane from above.
        forces: Whether lines of force are drawn, through smarticles that let them be seen; as thick as the normal force
            is large.
        overwrite: Whether an existing file may be replaced.

    Raises:
        InputError: No frame, unknown field or view, a time before the first or after the last
            frame, a bad size, bad limits, no such smarticle, or an output that exists.
        RunError: This machine lacks the libraries to draw without a display.

    Example:
        >>> render_run("runs/pile", color_by="height", view="oblique").name
        'render.png'
    """
    output = _checked_output(directory, output, "render.png", (".png",))
    shots = [Shot.of(path, forces=forces) for path in (directory, *compare)]
    if time is None and compare:
        time = float(common_times(shots)[-1])
    indices = [[len(shot.frames) - 1 if time is None else shot.frames.nearest(time)] for shot in shots]
    look = _look(shots, color_by, size, view)
    # Before an hour of drawing, not after it; and after all that is wrong with what was asked for.
    figures.refuse_to_overwrite(output, overwrite=overwrite)
    if smarticle is not None:
        if compare or color_by is not None or view is not None or forces:
            msg = f"smarticle {smarticle}: is drawn alone, in colours and from a side of its own; leave out the others"
            raise InputError(msg)
        image = focused(shots[0], indices[0][0], smarticle, size)
    else:
        image = next(pictures(shots, indices, look, limits))
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
    frames_per_second: float = film.RATE,
    start: float | None = None,
    end: float | None = None,
    every: float | None = None,
    most_frames: int = film.MOST,
    forces: bool = False,
    track: Track | None = None,
    overwrite: bool = False,
) -> Path:
    """Draw a film of a run with one camera and one scale of colours throughout.

    Its pictures are at equal distances in simulated time, each the nearest recorded frame, so that it plays at one
    speed, which its caption states.

    Args:
        directory: A run directory with at least two frames.
        output: File to write: `.gif` or `.webp`, or `.mp4`, which needs the package imageio-ffmpeg;
            `film.gif` in the run directory if not given.
        compare: Further runs, as in `render_run`; the film shows the times that all have come to.
        color_by: As in `render_run`.
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

    Raises:
        InputError: Fewer than two frames, a kind of file that cannot be written here, an output
            that exists, times that make no film, or as in `render_run`.
    """
    output = _checked_output(directory, output, "film.gif", film.KINDS)
    if most_frames < 2:
        msg = f"a film needs most_frames of at least 2: got {most_frames}; leave it out for {film.MOST}"
        raise InputError(msg)
    shots = [Shot.of(path, forces=forces) for path in (directory, *compare)]
    look = _look(shots, color_by, size, view)
    film.check_film(output, (size[0] * len(shots), size[1]))
    moments = film.Moments.chosen(
        common_times(shots), start=start, end=end, every=every, rate=frames_per_second, most=most_frames
    )
    indices = [moments.indices(shot.frames.times) for shot in shots]
    figures.refuse_to_overwrite(output, overwrite=overwrite)
    images, count = pictures(shots, indices, look, limits, quick=True, pace=moments.pace), len(moments.times)
    with figures.whole_file(output, overwrite=overwrite) as temporary:
        film.write_film(temporary, track(images, count) if track else images, count=count, rate=moments.rate)
    return output


def turntable(directory: Path | str, *, views: int = 24, size: int = 560, elevation: float = 26.0) -> list[Image.Image]:
    """Draw the last frame of a run from all around, at equal angles from the front.

    Raises:
        InputError: No frame, or a damaged one.
        RunError: This machine lacks the libraries to draw without a display.
    """
    shot = Shot.of(directory)
    frame = shot.frames[-1]
    shot.bodies.hold([frame])
    look = _look([shot], None, (size, size), None)
    around = [axes_from(VIEWS["front"][0] + 360.0 * number / views, elevation) for number in range(views)]
    values = shot.values([len(shot.frames) - 1], look)[0]
    colours = ColourScale.of(look.field, span([values])).painted(values)
    room = union([shot.room([len(shot.frames) - 1], axes) for axes in around])
    images = []
    with Canvas(replace(look, axes=around[0]), room, shot.run, quick=True) as canvas:
        for axes in around:
            canvas.turn(axes)
            canvas.show(0, frame, drawn(shot.bodies, frame, axes[2]), colours, Caption("", ()))
            images.append(canvas.panel())
    return images


def pictures(
    shots: Sequence[Shot],
    indices: Sequence[Sequence[int]],
    look: Look,
    limits: Limits = None,
    *,
    quick: bool = False,
    pace: str = "",
) -> Iterator[Image.Image]:
    """Draw runs side by side under one camera, in one scale of colours, picture after picture.

    Args:
        shots: The runs.
        indices: Of the frames of each that are shown.
        look: Of each panel.
        limits: Ends of the scale.
        quick: See `Canvas`.
        pace: For the captions of a film.
    """
    titles = titles_of([shot.run for shot in shots])
    pairs = list(zip(shots, indices, strict=True))
    for shot, shown in pairs:
        shot.bodies.hold(shot.frames[i] for i in shown)
    values = [dict(zip(shown, shot.values(shown, look), strict=True)) for shot, shown in pairs]
    scale = ColourScale.of(look.field, _span(shots, values, look, limits))
    force = None
    if "forces" in shots[0].bodies.kinds:
        force = max(_largest_force(shot, shown) for shot, shown in pairs)
    room = union([shot.room(shown, look.axes) for shot, shown in pairs])
    with Canvas(look, room, shots[0].run, columns=len(shots), scale=scale, quick=quick) as canvas:
        for step in zip(*indices, strict=True):
            for column, (shot, index) in enumerate(zip(shots, step, strict=True)):
                frame = shot.frames[index]
                meshes = drawn(shot.bodies, frame, look.axes[2], largest=force)
                caption = caption_of(frame, shot.run, title=titles[column], pace=pace, force=force)
                canvas.show(column, frame, meshes, scale.painted(values[column][index]), caption)
            yield canvas.image()


def _largest_force(shot: Shot, indices: Sequence[int]) -> float:
    """Return the largest normal force at a contact in some frames [N]; a millinewton where there is none."""
    return max(float(read_forces(shot.frames[i]).contacts.normal.max(initial=0.0)) for i in indices) or 1e-3


def _span(shots: Sequence[Shot], values: Sequence[dict[int, Floats]], look: Look, limits: Limits) -> Span:
    if isinstance(limits, tuple):
        low, high = limits
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            msg = f"limits of the colours must be two finite numbers in order: got {low:g} and {high:g}"
            raise InputError(msg)
        factor = look.field.shown[0] if look.field.shown else 1.0
        return low / factor, high / factor
    if limits == "run":
        return span(each for shot in shots for each in shot.values(range(len(shot.frames)), look))
    return span(each for of_run in values for each in of_run.values())


def _look(shots: Sequence[Shot], color_by: str | None, size: tuple[int, int], view: str | None) -> Look:
    if len({shot.run.manifest.planar for shot in shots}) > 1:
        msg = "a run in a plane and one in space have no view in common; compare runs of one kind"
        raise InputError(msg)
    return Look.checked(shots[0].run, color_by=color_by, size=size, view=view)


def common_times(shots: Sequence[Shot]) -> Floats:
    """Return times of the frames that all runs have come to: those of the one with the fewest [s].

    Raises:
        InputError: There is no time at which all have frames.
    """
    low = max(float(shot.frames.times[0]) for shot in shots)
    high = min(float(shot.frames.times[-1]) for shot in shots)
    if low > high:
        spans = ", ".join(f"{shot.run.path} {shot.frames.times[0]:g} to {shot.frames.times[-1]:g} s" for shot in shots)
        msg = f"the runs have no time in common: {spans}; compare runs that overlap in time"
        raise InputError(msg)
    inside = [shot.frames.times[(shot.frames.times >= low) & (shot.frames.times <= high)] for shot in shots]
    return min(inside, key=len)


def _checked_output(directory: Path | str, output: Path | str | None, default: str, kinds: tuple[str, ...]) -> Path:
    path = Path(directory) / default if output is None else Path(output)
    if path.suffix not in kinds:
        msg = f"{path}: the output must end in {' or '.join(kinds)}: got '{path.suffix}'"
        raise InputError(msg)
    return path
