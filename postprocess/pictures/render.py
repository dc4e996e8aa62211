"""Pictures and films of runs, off-screen."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image

from dem.errors import InputError
from dem.record.forces import read_forces
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.bodies.colours import ColourScale, Paint, Span, span
from postprocess.geometry.links import Floats, plane_frames
from postprocess.measures.entanglement import entanglement, has_plane, link_passages
from postprocess.measures.packing import packing_of
from postprocess.pictures import film
from postprocess.pictures.canvas import MILLIMETRE, VIEWS, Canvas, Look, Shot, axes_from, drawn, extent, union
from postprocess.report import figures

DEFINITION = "second-highest-com"
"""Definition of the packing fraction in captions, as in the first column of `smarticles measure`."""

Limits = Span | Literal["run"] | None
"""Ends of the scale of colours: given, of all frames of the runs, or of what is shown."""

Track = Callable[[Iterable[Image.Image], int], Iterable[Image.Image]]
"""Follows the pictures of a film, of which there are so many."""

_OTHERS = "#c4ccd4"
_ASKEW = np.radians([25.0, 20.0])  # how far the camera is turned from the normal, across and along the middle link


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
    """Draw one frame of a run: real boxes of links, a container cut open in front, hooks and strings.

    A wall that is being lifted is where it is then; of one that was taken away its outline is left, faint.

    Args:
        directory: A run directory with at least one frame; the run need not be done.
        compare: Further runs, drawn beside it at the same time, from the same distance and in the same colours.
        output: File to write, `.png`; `render.png` in the run directory if not given.
        time: Simulated time [s], the nearest frame is taken; the last one that all runs have if not given.
        color_by: Name of a field, or height, speed, id; None: crossings, and of motion in a plane, which has none, id.
        limits: Ends of the scale of colours; those of this picture if not given.
        smarticle: Number of a smarticle: only it and those that pass through its plane are drawn, seen through
            its mouth.
        size: Width and height of the picture of one run [pixel].
        view: Key of `VIEWS`; None: from the front, of motion in a plane from above.
        forces: Whether lines of force are drawn, in front of pale smarticles; their thickness is in proportion to
            the normal force.

    Raises:
        InputError: No frame, unknown field or view, a time before the first or after the last
            frame, a bad size, bad limits, no such smarticle, or an output that exists.
        RunError: This machine lacks the libraries to draw without a display.

    Example:
        >>> render_run("runs/pile", color_by="height", view="oblique").name
        'render.png'
    """
    output = _checked_output(directory, output, "render.png", (".png",))
    shots = [Shot(path, forces=forces) for path in (directory, *compare)]
    if time is None and compare:
        time = float(common_times(shots)[-1])
    indices = [[len(shot.frames) - 1 if time is None else shot.frames.nearest(time)] for shot in shots]
    look = Look.of([shot.run for shot in shots], color_by=color_by, size=size, view=view)
    # Before an hour of drawing, not after it; and after all that is wrong with what was asked for.
    figures.reject_existing(output, overwrite=overwrite)
    if smarticle is not None:
        if compare or color_by is not None or view is not None or forces:
            msg = f"smarticle {smarticle}: is drawn alone, in colours and from a side of its own; leave out the others"
            raise InputError(msg)
        image = _focused(shots[0], indices[0][0], smarticle, look)
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

    Arguments without a description are those of `render_run`.

    Args:
        directory: A run directory with at least two frames.
        output: File to write: `.gif` or `.webp`, or `.mp4`, which needs the package imageio-ffmpeg;
            `film.gif` in the run directory if not given.
        compare: Further runs; the film shows the times that all have come to.
        limits: Ends of the scale of colours; those of the film if not given.
        size: Width and height of the picture of one run [pixel]; for `.mp4` even numbers.
        start: Simulated time at which it begins [s]; that of the first frame if not given.
        end: Simulated time at which it ends [s]; that of the last frame if not given.
        every: Simulated time from one picture to the next [s]; if not given, that between frames.
        most_frames: Unless `every` is given, longer runs are thinned evenly to so many pictures.
        track: Follows the drawing, see `Track`.

    Raises:
        InputError: Fewer than two frames, a kind of file that cannot be written here, an output
            that exists, times that make no film, or as in `render_run`.
    """
    output = _checked_output(directory, output, "film.gif", film.KINDS)
    shots = [Shot(path, forces=forces) for path in (directory, *compare)]
    look = Look.of([shot.run for shot in shots], color_by=color_by, size=size, view=view)
    film.check_film(output, (size[0] * len(shots), size[1]))
    moments = film.Moments.chosen(
        common_times(shots), start=start, end=end, every=every, rate=frames_per_second, most=most_frames
    )
    indices = [moments.indices(shot.frames.times) for shot in shots]
    figures.reject_existing(output, overwrite=overwrite)
    images, count = pictures(shots, indices, look, limits, quick=True, pace=moments.pace), len(moments.times)
    with figures.whole_file(output, overwrite=overwrite) as temporary:
        film.write_film(temporary, track(images, count) if track else images, count=count, rate=moments.rate)
    return output


def turntable(directory: Path | str, *, views: int = 24, size: int = 560) -> list[Image.Image]:
    """Draw the last frame of a run from all around, at equal angles from the front.

    Raises:
        InputError: No frame, or a damaged one.
        RunError: This machine lacks the libraries to draw without a display.
    """
    shot = Shot(directory)
    index, frame = len(shot.frames) - 1, shot.frames[-1]
    shot.bodies.hold([frame])
    look = Look.of([shot.run], color_by=None, size=(size, size), view=None)
    around = [axes_from(VIEWS["front"][0] + 360.0 * number / views, 26.0) for number in range(views)]
    (values,) = shot.values([index], look)
    colours = ColourScale.of(look.field, span([values])).painted(values)
    images = []
    in_view = union([shot.extent([index], axes) for axes in around])
    with Canvas(replace(look, axes=around[0]), in_view, shot.run, quick=True) as canvas:
        for axes in around:
            canvas.turn(axes)
            canvas.show(0, frame, drawn(shot.bodies, frame, axes[2]), colours)
            images.append(look.panel(canvas.image()))
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
    """Draw runs side by side under one camera, in one scale of colours, frame after frame by its index."""
    titles = titles_of([shot.run for shot in shots])
    pairs = list(zip(shots, indices, strict=True))
    for shot, shown in pairs:
        shot.bodies.hold(shot.frames[i] for i in shown)
    values = [dict(zip(shown, shot.values(shown, look), strict=True)) for shot, shown in pairs]
    scale = ColourScale.of(look.field, _span(shots, values, look, limits))
    force = None
    if "forces" in shots[0].bodies.kinds:
        # A millinewton where no contact carries a force.
        force = max(_largest_force(shot.frames[i]) for shot, shown in pairs for i in shown) or 1e-3
    in_view = union([shot.extent(shown, look.axes) for shot, shown in pairs])
    with Canvas(look, in_view, shots[0].run, columns=len(shots), scale=scale, quick=quick) as canvas:
        for step in zip(*indices, strict=True):
            for column, (shot, index) in enumerate(zip(shots, step, strict=True)):
                frame = shot.frames[index]
                meshes = drawn(shot.bodies, frame, look.axes[2], largest=force)
                caption = caption_of(frame, shot.run, title=titles[column], pace=pace, force=force)
                canvas.show(column, frame, meshes, scale.painted(values[column][index]), caption)
            yield canvas.image()


def _largest_force(frame: Frame) -> float:
    return float(read_forces(frame).contacts.normal.max(initial=0.0))


def _span(shots: Sequence[Shot], values: Sequence[dict[int, Floats]], look: Look, limits: Limits) -> Span:
    if isinstance(limits, tuple):
        low, high = limits
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InputError(f"limits of the colours must be two finite numbers in order: got {low:g} and {high:g}")
        factor = look.field.shown[0] if look.field.shown else 1.0
        return low / factor, high / factor
    if limits == "run":
        return span(each for shot in shots for each in shot.values(range(len(shot.frames)), look))
    return span(each for of_run in values for each in of_run.values())


def common_times(shots: Sequence[Shot]) -> Floats:
    """Return times of the frames that all runs have come to: those of the one with the fewest [s].

    Raises:
        InputError: There is no time at which all have frames.
    """
    low = max(float(shot.frames.times[0]) for shot in shots)
    high = min(float(shot.frames.times[-1]) for shot in shots)
    if low > high:
        spans = ", ".join(f"{shot.run.path} {shot.frames.times[0]:g} to {shot.frames.times[-1]:g} s" for shot in shots)
        raise InputError(f"the runs have no time in common: {spans}; compare runs that overlap in time")
    inside = [shot.frames.times[(shot.frames.times >= low) & (shot.frames.times <= high)] for shot in shots]
    return min(inside, key=len)


def _checked_output(directory: Path | str, output: Path | str | None, default: str, kinds: tuple[str, ...]) -> Path:
    path = Path(directory) / default if output is None else Path(output)
    if path.suffix not in kinds:
        raise InputError(f"{path}: the output must end in {' or '.join(kinds)}: got '{path.suffix}'")
    return path


def _focused(shot: Shot, index: int, smarticle: int, look: Look) -> Image.Image:
    """Draw one smarticle and those that pass through its plane.

    It is orange, the plane through its four vertices faintly so; links that pass through are blue, other links of
    theirs grey. The camera points into its mouth, somewhat askew.
    """
    frame, run = shot.frames[index], shot.run
    if run.manifest.planar:
        msg = f"smarticle {smarticle}: in a plane no link passes through another smarticle; draw the whole run"
        raise InputError(msg)
    found = np.flatnonzero(frame.smarticle_ids == smarticle)
    if not len(found):
        low, high = frame.smarticle_ids.min(), frame.smarticle_ids.max()
        raise InputError(f"smarticle {smarticle}: there are {low} to {high} at {frame.time:g} s; choose one of these")
    own = int(found[0])
    passages = link_passages(frame.vertices)
    through = passages.i == own
    shown = np.unique([own, *passages.j[through]])
    part = replace(
        frame,
        vertices=frame.vertices[shown],
        smarticle_ids=frame.smarticle_ids[shown],
        link_velocity=frame.link_velocity[shown],
        link_angular_velocity=frame.link_angular_velocity[shown],
        contacts=frame.contacts[shown],
        cell_data={name: values[shown] for name, values in frame.cell_data.items()},
    )
    colours = np.empty((len(shown), 3, 3), dtype=np.uint8)
    colours[:] = Paint(_OTHERS).rgb
    colours[shown == own] = Paint(figures.ORANGE).rgb
    colours[np.searchsorted(shown, passages.j[through]), passages.link[through]] = Paint(figures.BLUE).rgb
    links, others = int(through.sum()), len(shown) - 1
    said = "straight: it has no plane"
    if has_plane(frame.vertices[own][None])[0]:
        said = f"{links} link{'s' * (links != 1)} of {others} other{'s' * (others != 1)} through its plane"
    caption = (
        f"{run.manifest.name}: smarticle {smarticle}",
        f"{said}   t = {frame.time:.3f} s ({run.phases[frame.phase].type})",
        "orange: the smarticle, faintly its plane; blue: links through it",
    )
    axes = _through_the_mouth(frame.vertices[own])
    boxes = {"smarticles": drawn(shot.bodies, part, axes[2])["smarticles"]}
    with Canvas(replace(look, axes=axes), extent(boxes.values(), axes), run) as canvas:
        canvas.add_patch((frame.vertices[own] - [0.0, 0.0, frame.floor_z]) * MILLIMETRE, figures.ORANGE)
        canvas.show(0, part, boxes, colours, caption)
        return canvas.image()


def _through_the_mouth(vertices: Floats) -> Floats:
    """Return axes (3, 3): right, along the middle link, up, towards the mouth, and forward; askew."""
    normal = plane_frames(vertices[None])[0, 2]
    right = vertices[2] - vertices[1]
    right -= (right @ normal) * normal
    right /= np.linalg.norm(right)
    up = np.cross(-normal, right)
    if up @ (vertices[[0, 3]].mean(axis=0) - vertices[[1, 2]].mean(axis=0)) < 0:
        normal, up = -normal, -up
    across, along = _ASKEW
    forward = -normal * np.cos(across) + right * np.sin(across)
    forward = forward * np.cos(along) - up * np.sin(along)
    forward /= np.linalg.norm(forward)
    aside = np.cross(forward, up)
    aside /= np.linalg.norm(aside)
    return np.stack([aside, np.cross(aside, forward), forward])


def titles_of(runs: Sequence[Run]) -> list[str]:
    """Return the headings of runs beside each other: names, with folders where these are alike."""
    names = [run.manifest.name for run in runs]
    if len(set(names)) == len(names):
        return names
    folders = [run.path.resolve() for run in runs]
    # As much of the path as they differ in: runs of sweeps differ in their last part, others may not.
    depth = 1
    longest = max(len(folder.parts) for folder in folders)
    while len({folder.parts[-depth:] for folder in folders}) < len(set(folders)) and depth < longest:
        depth += 1
    return [f"{name} ({'/'.join(folder.parts[-depth:])})" for name, folder in zip(names, folders, strict=True)]


def caption_of(frame: Frame, run: Run, *, title: str, pace: str = "", force: float | None = None) -> list[str]:
    """Return the lines of the caption of a frame.

    The pace of a film is how fast it plays; the force is that of the thickest line [N], None where none are drawn.
    """
    count = f"{run.manifest.count}" if frame.count == run.manifest.count else f"{frame.count} of {run.manifest.count}"
    phase = run.phases[frame.phase].type if frame.phase < len(run.phases) else "?"
    when = f"t = {frame.time:.3f} s ({phase})"
    lines = [f"l/w = {run.manifest.aspect_ratio:g}   N = {count}   {when}"]
    if pace:
        lines[0] += f"   {pace}"
    if not run.manifest.planar:  # neither packing nor crossings have a meaning there
        mean = entanglement(frame.vertices).mean
        passed = f"⟨N⟩ = {mean:.2f}" if math.isfinite(mean) else "no ⟨N⟩: all are straight"
        lines.append(f"{packing_text(frame, run)}   {passed}")
    if force is not None:
        lines[-1] += f"   widest line: {1e3 * force:.3g} mN"
    return [title, *lines]


def packing_text(frame: Frame, run: Run) -> str:
    """Return φ as `smarticles measure --frames` gives it for this frame, or why it does not."""
    value = packing_of(frame, run, definition=DEFINITION)
    if math.isfinite(value):
        return f"φ = {value:.4f} ({DEFINITION})"
    if run.manifest.container_tiers > 1:
        return f"no φ: a mould of {run.manifest.container_tiers} tiers"
    if not run.manifest.walled(frame.phase):
        return "no φ: the wall is gone"
    if frame.count < 2:
        return "no φ: fewer than 2 smarticles"
    return "no φ: the pile has no height"
