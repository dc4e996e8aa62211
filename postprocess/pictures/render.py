"""Draw pictures and films of runs, without a display."""

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
from postprocess.measures.pile import why_no_pile
from postprocess.pictures import film
from postprocess.pictures.canvas import (
    MILLIMETRE,
    VIEWS,
    Canvas,
    Style,
    Subject,
    axes_from,
    extent,
    union,
    visible_meshes,
)
from postprocess.report import figures
from postprocess.report.tables import reject_existing, whole_file

DEFINITION = "second-highest-com"
"""Definition of the packing fraction in captions; it is also the first one that `smarticles measure` prints."""

Limits = Span | Literal["run"] | None
"""Ends of the colour scale: two values; "run": extremes of all frames of the runs; None: of the drawn frames."""

Track = Callable[[Iterable[Image.Image], int], Iterable[Image.Image]]
"""Shows the progress of a film: takes its pictures and their number, returns the pictures."""

_OTHERS = "#c4ccd4"
_ASKEW = np.radians([25.0, 20.0])  # angles of the camera from the smarticle's normal, across and along the middle link


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
    """Draw one frame of a run: boxes of the links, hooks, strings, and the container cut open in front.

    A removed wall is drawn as a faint outline. Returns the path of the written file.

    Args:
        directory: A run directory with at least one frame; the run may be unfinished.
        compare: Further runs, drawn side by side at one time, with one scale and one colour scale.
        output: File to write, `.png`; `render.png` in the run directory if not given.
        time: Simulated time [s]; the nearest frame of each run is drawn. The last time common to all runs if not given.
        color_by: Name or short name of a field; None: crossings, or smarticle_id if the run is planar.
        limits: Ends of the colour scale, see `Limits`; the extremes in this picture if not given.
        smarticle: Number of a smarticle, which is drawn alone with the smarticles that pass through its plane; the
            camera points into its mouth.
        size: Width and height of the picture of one run [pixel].
        view: Key of `VIEWS`; None: "front", or "top" if the run is planar.
        forces: Whether to draw contact forces as lines, with a thickness proportional to the normal force, in front of
            pale smarticles.
        overwrite: Whether to replace an existing output.

    Raises:
        InputError: No frame, an unknown field or view, a time outside the recorded frames, a bad size, bad limits, an
            unknown smarticle, or an output that exists.
    """
    output = _checked_output(directory, output, "render.png", (".png",))
    subjects = [Subject(path, forces=forces) for path in (directory, *compare)]
    if time is None and compare:
        time = float(common_times(subjects)[-1])
    indices = [[len(subject.frames) - 1 if time is None else subject.frames.nearest(time)] for subject in subjects]
    style = Style.of([subject.run for subject in subjects], color_by=color_by, size=size, view=view)
    reject_existing(output, overwrite=overwrite)
    if smarticle is not None:
        if compare or color_by is not None or view is not None or forces:
            msg = f"smarticle {smarticle}: is drawn alone, with its own colours and view; leave out the other options"
            raise InputError(msg)
        image = _focused(subjects[0], indices[0][0], smarticle, style)
    else:
        image = next(pictures(subjects, indices, style, limits))
    with whole_file(output, overwrite=overwrite) as temporary:
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
    forces: bool = False,
    track: Track | None = None,
    overwrite: bool = False,
) -> Path:
    """Draw a film of a run with one camera and one colour scale, and return the path of the written file.

    The pictures are at equal intervals of simulated time; each shows the nearest recorded frame. The caption states the
    speed.

    Args:
        directory: A run directory with at least two frames; the run may be unfinished.
        output: File to write: `.gif` or `.webp`, or `.mp4`, which needs the package imageio-ffmpeg; `film.gif` in the
            run directory if not given.
        compare: Further runs, drawn side by side; the film ends at the last time common to all runs.
        color_by: Name or short name of a field; None: crossings, or smarticle_id if the run is planar.
        limits: Ends of the colour scale, see `Limits`; the extremes in this film if not given.
        size: Width and height of the picture of one run [pixel]; even numbers for `.mp4`.
        view: Key of `VIEWS`; None: "front", or "top" if the run is planar.
        frames_per_second: Rate at which the film shows pictures [1/s].
        start: Simulated time at which the film begins [s]; that of the first frame if not given.
        end: Simulated time at which the film ends [s]; that of the last frame if not given.
        every: Simulated time between two pictures [s]; if not given, a multiple of the recorded interval.
        forces: Whether to draw contact forces as lines, with a thickness proportional to the normal force.
        track: Shows the progress, see `Track`.
        overwrite: Whether to replace an existing output.

    Raises:
        InputError: Fewer than two frames, an output that exists or cannot be written, or an argument out of its range.
    """
    output = _checked_output(directory, output, "film.gif", film.KINDS)
    subjects = [Subject(path, forces=forces) for path in (directory, *compare)]
    style = Style.of([subject.run for subject in subjects], color_by=color_by, size=size, view=view)
    film.check_film(output, (size[0] * len(subjects), size[1]))
    film_times = film.FilmTimes.choose(
        common_times(subjects), start=start, end=end, every=every, rate=frames_per_second
    )
    indices = [film_times.indices(subject.frames.times) for subject in subjects]
    reject_existing(output, overwrite=overwrite)
    images, count = pictures(subjects, indices, style, limits, quick=True, pace=film_times.pace), len(film_times.times)
    with whole_file(output, overwrite=overwrite) as temporary:
        film.write_film(temporary, track(images, count) if track else images, count=count, rate=film_times.rate)
    return output


def turntable(directory: Path | str, *, views: int = 24, size: int = 560) -> list[Image.Image]:
    """Draw the last frame of a run from `views` directions all around, at equal angles.

    Pictures are `size` wide and high [pixel].
    """
    subject = Subject(directory)
    index, frame = len(subject.frames) - 1, subject.frames[-1]
    subject.bodies.hold([frame])
    style = Style.of([subject.run], color_by=None, size=(size, size), view=None)
    around = [axes_from(VIEWS["front"][0] + 360.0 * number / views, 26.0) for number in range(views)]
    (values,) = subject.values([index], style)
    colours = ColourScale.of(style.field, span([values]), [subject.run]).painted(values)
    images = []
    in_view = union([subject.extent([index], axes) for axes in around])
    with Canvas(replace(style, axes=around[0]), in_view, subject.run, quick=True) as canvas:
        for axes in around:
            canvas.turn(axes)
            canvas.show(0, frame, visible_meshes(subject.bodies, frame, axes[2]), colours)
            images.append(style.panel(canvas.image()))
    return images


def pictures(
    subjects: Sequence[Subject],
    indices: Sequence[Sequence[int]],
    style: Style,
    limits: Limits = None,
    *,
    quick: bool = False,
    pace: str = "",
) -> Iterator[Image.Image]:
    """Yield pictures of runs side by side, with one camera and one colour scale.

    Each of the subjects, from left to right, has `indices` of its frames, one per picture. `quick` leaves out the
    shading of corners, which takes most of the time. `pace` is the speed of a film for the caption.
    """
    titles = titles_of([subject.run for subject in subjects])
    pairs = list(zip(subjects, indices, strict=True))
    for subject, shown in pairs:
        subject.bodies.hold(subject.frames[i] for i in shown)
    values = [dict(zip(shown, subject.values(shown, style), strict=True)) for subject, shown in pairs]
    scale = ColourScale.of(style.field, _span(subjects, values, style, limits), [subject.run for subject in subjects])
    if not any(np.isfinite(each).any() for of_run in values for each in of_run.values()):
        middle = math.nan if scale.colours is None else (scale.low + scale.high) / 2
        scale = replace(scale, labels={middle: "no values here: grey"})
    force = None
    if "forces" in subjects[0].bodies.kinds:
        each = (read_forces(subject.frames[i]).contacts.normal for subject, shown in pairs for i in shown)
        # The scale of the lines must be above 0 if no contact carries a force.
        force = max(float(normal.max(initial=0.0)) for normal in each) or 1e-3
    in_view = union([subject.extent(shown, style.axes) for subject, shown in pairs])
    with Canvas(style, in_view, subjects[0].run, columns=len(subjects), scale=scale, quick=quick) as canvas:
        for step in zip(*indices, strict=True):
            for column, (subject, index) in enumerate(zip(subjects, step, strict=True)):
                frame = subject.frames[index]
                meshes = visible_meshes(subject.bodies, frame, style.axes[2], largest=force)
                caption = caption_of(frame, subject.run, title=titles[column], pace=pace, force=force)
                canvas.show(column, frame, meshes, scale.painted(values[column][index]), caption)
            yield canvas.image()


def _span(subjects: Sequence[Subject], values: Sequence[dict[int, Floats]], style: Style, limits: Limits) -> Span:
    if isinstance(limits, tuple):
        low, high = limits
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InputError(f"limits of the colours must be two finite numbers in order: got {low:g} and {high:g}")
        factor = style.field.shown[0] if style.field.shown else 1.0
        return low / factor, high / factor
    if limits == "run":
        return span(each for subject in subjects for each in subject.values(range(len(subject.frames)), style))
    return span(each for of_run in values for each in of_run.values())


def common_times(subjects: Sequence[Subject]) -> Floats:
    """Return the frame times (n,) [s] of one run within the time interval that all runs share.

    The run is the one with the fewest frames in this interval. InputError if the runs have no common interval.
    """
    low = max(float(subject.frames.times[0]) for subject in subjects)
    high = min(float(subject.frames.times[-1]) for subject in subjects)
    if low > high:
        spans = ", ".join(f"{one.run.path} {one.frames.times[0]:g} to {one.frames.times[-1]:g} s" for one in subjects)
        raise InputError(f"the runs have no time in common: {spans}; compare runs that overlap in time")
    recorded = [subject.frames.times for subject in subjects]
    return min((times[(times >= low) & (times <= high)] for times in recorded), key=len)


def _checked_output(directory: Path | str, output: Path | str | None, default: str, kinds: tuple[str, ...]) -> Path:
    path = Path(directory) / default if output is None else Path(output)
    if path.suffix not in kinds:
        raise InputError(f"{path}: the output must end in {' or '.join(kinds)}: got '{path.suffix}'")
    return path


def _focused(subject: Subject, index: int, smarticle: int, style: Style) -> Image.Image:
    """Draw one smarticle and all smarticles that pass through its plane, seen obliquely through its mouth.

    The smarticle and its plane are orange, links that pass through the plane blue, other links grey.
    """
    frame, run = subject.frames[index], subject.run
    if run.manifest.kinds is not None:
        raise InputError(f"smarticle {smarticle}: these bodies are no smarticles; draw the whole run, or export it")
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
    crossed = "straight: it has no plane"
    if has_plane(frame.vertices[own][None])[0]:
        crossed = f"{links} link{'s' * (links != 1)} of {others} other{'s' * (others != 1)} through its plane"
    caption = (
        f"{run.manifest.name}: smarticle {smarticle}",
        f"{crossed}   t = {frame.time:.3f} s ({run.phases[frame.phase].type})",
        "orange: the smarticle, faintly its plane; blue: links through it",
    )
    axes = _through_the_mouth(frame.vertices[own])
    boxes = {"smarticles": visible_meshes(subject.bodies, part, axes[2])["smarticles"]}
    with Canvas(replace(style, axes=axes), extent(boxes.values(), axes), run) as canvas:
        canvas.add_patch((frame.vertices[own] - [0.0, 0.0, frame.floor_z]) * MILLIMETRE, figures.ORANGE)
        canvas.show(0, part, boxes, colours, caption)
        return canvas.image()


def _through_the_mouth(vertices: Floats) -> Floats:
    """Return camera axes (3, 3), right, up and forward, for an oblique view through a smarticle's mouth.

    Before the camera is turned by `_ASKEW`, right is along the middle link, and up points towards the mouth.
    """
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
    """Return the titles of runs side by side: their names, followed by folders if names are equal."""
    names = [run.manifest.name for run in runs]
    if len(set(names)) == len(names):
        return names
    folders = [run.path.resolve() for run in runs]
    # The shortest ends of the paths that differ.
    depth = 1
    longest = max(len(folder.parts) for folder in folders)
    while len({folder.parts[-depth:] for folder in folders}) < len(set(folders)) and depth < longest:
        depth += 1
    return [f"{name} ({'/'.join(folder.parts[-depth:])})" for name, folder in zip(names, folders, strict=True)]


def caption_of(frame: Frame, run: Run, *, title: str, pace: str = "", force: float | None = None) -> list[str]:
    """Return the lines of the caption of a frame; the title is the first.

    `pace` is the speed of a film, `force` the normal force of the thickest line [N], None if no forces are drawn.
    """
    count = f"{run.manifest.count}" if frame.count == run.manifest.count else f"{frame.count} of {run.manifest.count}"
    phase = run.phases[frame.phase].type if frame.phase < len(run.phases) else "?"
    when = f"t = {frame.time:.3f} s ({phase})"
    kinds = run.manifest.kinds
    what = f"l/w = {run.manifest.aspect_ratio:g}" if kinds is None else ", ".join(dict.fromkeys(k.shape for k in kinds))
    lines = [f"{what}   N = {count}   {when}"]
    if pace:
        lines[0] += f"   {pace}"
    if kinds is not None:
        lines.append(packing_text(frame, run))
    elif not run.manifest.planar:  # packing and crossings are undefined in a plane
        mean = entanglement(frame.vertices).mean
        passed = f"⟨N⟩ = {mean:.2f}" if math.isfinite(mean) else "no ⟨N⟩: all are straight"
        lines.append(f"{packing_text(frame, run)}   {passed}")
    if force is not None:
        lines[-1] += f"   widest line: {1e3 * force:.3g} mN"
    return [title, *lines]


def packing_text(frame: Frame, run: Run) -> str:
    """Return φ of a frame as text, or the reason why it is undefined."""
    value = packing_of(frame, run, definition=DEFINITION)
    if math.isfinite(value):
        return f"φ = {value:.4f} ({DEFINITION})"
    return f"no φ: {why_no_pile(frame, run) or 'the pile has no height'}"
