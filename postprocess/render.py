"""Pictures and films of a run, drawn off-screen. The only module that imports PyVista.

The three-dimensional part is drawn by VTK at twice its size and scaled down; caption and colour
bar are set by matplotlib around it. No display is needed: VTK falls back to EGL.
"""

from __future__ import annotations

import ctypes
import math
import os
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from PIL import Image

from dem.errors import InputError, RunError
from postprocess import figures, film
from postprocess.colouring import COLOURINGS, Colouring, ColourScale
from postprocess.entanglement import entanglement
from postprocess.errors import UndefinedMeasureError
from postprocess.frames import Frame, FrameSequence, read_frames
from postprocess.geometry import checked_vertices, link_lengths, plane_frames
from postprocess.manifest import RunManifest, read_run
from postprocess.packing import packing_fraction

with warnings.catch_warnings():
    # PyVista imports pyplot: see postprocess.figures.
    warnings.filterwarnings("ignore", message="Unable to import Axes3D")
    import pyvista as pv
    import pyvista.plotting

from vtkmodules.vtkCommonCore import vtkLogger

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

VIEWS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"front": (-90.0, 14.0), "oblique": (-62.0, 34.0), "top": (-90.0, 90.0)}
)
"""Named views: the camera's azimuth and elevation [degree], seen from the pile."""

_MILLIMETRE = 1e3  # drawn in mm: VTK's tolerances do not suit scenes of centimetres in m
_OVERSAMPLING = 2
_LEAST_SIZE, _LARGEST_SIZE = 200, 8000
_FIELD_OF_VIEW = 22.0  # degree, vertical
_FILL = 0.97  # share of the panel that the pile and its container may take
_PANEL = (0.87, 0.885)  # width and height as shares of the picture, from its lower left corner
_MOST_FILM_FRAMES = 150

# Corners of a box (along, in plane, normal) and its faces, seen from outside.
_CORNERS = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) / 2
_FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def link_boxes(vertices: ArrayLike, *, thickness_normal: float, thickness_in_plane: float) -> pv.PolyData:
    """The links of all smarticles as one mesh of boxes.

    The section of a straight smarticle, or of one without barbs, is turned about its length by an
    angle that four vertices do not tell: some angle is taken. Links without length have no box.

    Args:
        vertices: (N, 4, 3) [m], barb tip, hinge, hinge, barb tip of each smarticle.
        thickness_normal: t1, along the normal of the smarticle's plane [m].
        thickness_in_plane: t2, in the smarticle's plane [m].

    Returns:
        Six quadrilaterals and eight points per box [m]; cell data `smarticle`, the index into
        `vertices`, and `link`, 0 to 2.

    Raises:
        InputError: Bad vertices or thicknesses.
    """
    vertices = checked_vertices(vertices)
    if not (thickness_normal > 0 and thickness_in_plane > 0):
        msg = f"thicknesses must be above 0 m: got {thickness_normal} m, {thickness_in_plane} m"
        raise InputError(msg)
    lengths = link_lengths(vertices)
    smarticle, link = np.nonzero(lengths > 1e-9 * lengths.sum(axis=1, keepdims=True))
    start, end = vertices[smarticle, link], vertices[smarticle, link + 1]
    along = end - start
    across = np.cross(plane_frames(vertices)[smarticle, 2], along)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    # Square to the link even where the four vertices are not quite in one plane.
    normal = np.cross(along, across)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    edges = np.stack([along, thickness_in_plane * across, thickness_normal * normal], axis=1)
    points = ((start + end) / 2)[:, None] + np.einsum("ce,bex->bcx", _CORNERS, edges)
    faces: Any = _FACES + 8 * np.arange(len(points))[:, None, None]
    mesh: pv.PolyData = pv.PolyData.from_regular_faces(points.reshape(-1, 3), faces.reshape(-1, 4))
    mesh.cell_data["smarticle"] = np.repeat(smarticle, len(_FACES))
    mesh.cell_data["link"] = np.repeat(link, len(_FACES))
    return mesh


def render_run(
    directory: Path | str,
    *,
    output: Path | str | None = None,
    time: float | None = None,
    color_by: str = "crossings",
    size: tuple[int, int] = (1200, 1200),
    view: str = "front",
    overwrite: bool = False,
) -> Path:
    """Draws one frame of a run: every link as its real box, in a cylinder cut open in front.

    The cylinder is drawn up to a little above the pile: a run does not record how tall its
    container is.

    Args:
        directory: A run directory with at least one frame; the run need not be done.
        output: File to write, `.png`; `render.png` in the run directory if not given.
        time: Simulated time [s], the nearest frame is taken; the last one if not given.
        color_by: Key of `COLOURINGS`.
        size: Width and height [pixel].
        view: Key of `VIEWS`.
        overwrite: Whether an existing file may be replaced.

    Returns:
        The file written.

    Raises:
        InputError: No frame, unknown colouring or view, a time before the first or after the last
            frame, a bad size, or an output that exists.
        RunError: This machine lacks the libraries to draw without a display.

    Example:
        >>> render_run("runs/pile", color_by="height", view="oblique")  # doctest: +SKIP
    """
    output = _checked_output(directory, output, "render.png", (".png",), overwrite=overwrite)
    look = _Look.checked(color_by=color_by, size=size, view=view)
    run, frames = read_run(directory), read_frames(directory)
    frame = frames[_frame_at(frames, time)]
    values = look.colouring.values(frame)
    with _Stage(run, look, _extent(frame, run, look), _span(values)) as stage:
        image = stage.picture(frame, values)
    with figures.whole_file(output, overwrite=overwrite) as temporary:
        image.save(temporary)
    return output


def render_film(
    directory: Path | str,
    output: Path | str | None = None,
    *,
    color_by: str = "crossings",
    size: tuple[int, int] = (720, 720),
    view: str = "front",
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
        color_by: Key of `COLOURINGS`.
        size: Width and height [pixel]; for `.mp4` even numbers.
        view: Key of `VIEWS`.
        frames_per_second: Of the film.
        most_frames: Longer runs are thinned evenly to so many frames.
        overwrite: Whether an existing file may be replaced.

    Returns:
        The file written.

    Raises:
        InputError: Fewer than two frames, a kind of file that cannot be written here, an output
            that exists, or as in `render_run`.
    """
    output = _checked_output(directory, output, "film.gif", film.KINDS, overwrite=overwrite)
    look = _Look.checked(color_by=color_by, size=size, view=view)
    if not (math.isfinite(frames_per_second) and frames_per_second > 0 and most_frames >= 2):
        msg = (
            "a film needs frames_per_second above 0 1/s and most_frames of at least 2: "
            f"got {frames_per_second} 1/s, {most_frames}"
        )
        raise InputError(msg)
    film.check_film(output, size)
    run, frames = read_run(directory), read_frames(directory)
    if len(frames) < 2:
        msg = f"{directory}: a film needs at least 2 frames: got {len(frames)}; use render_run"
        raise InputError(msg)
    shown = np.unique(np.linspace(0, len(frames) - 1, most_frames).round().astype(int))
    extents, values = [], []
    for index in shown:
        frame = frames[int(index)]
        extents.append(_extent(frame, run, look))
        values.append(look.colouring.values(frame))

    with (
        _Stage(run, look, np.concatenate(extents), _span(np.concatenate(values))) as stage,
        figures.whole_file(output, overwrite=overwrite) as temporary,
    ):

        def picture(number: int) -> Image.Image:
            return stage.picture(frames[int(shown[number])], values[number])

        samples = [picture(number) for number in sorted({0, len(shown) // 3, 2 * len(shown) // 3, len(shown) - 1})]
        film.write_film(temporary, map(picture, range(len(shown))), frames_per_second, samples)
    return output


def _checked_output(
    directory: Path | str,
    output: Path | str | None,
    default: str,
    kinds: tuple[str, ...],
    *,
    overwrite: bool,
) -> Path:
    path = Path(directory) / default if output is None else Path(output)
    if path.suffix not in kinds:
        msg = f"{path}: the output must end in {' or '.join(kinds)}: got '{path.suffix}'"
        raise InputError(msg)
    # Before an hour of drawing, not after it.
    figures.refuse_to_overwrite(path, overwrite=overwrite)
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


@dataclass(frozen=True, kw_only=True)
class _Look:
    """How a picture is to look, checked."""

    colouring: Colouring
    size: tuple[int, int]
    azimuth: float
    elevation: float

    @classmethod
    def checked(cls, *, color_by: str, size: tuple[int, int], view: str) -> Self:
        if color_by not in COLOURINGS:
            msg = f"color_by must be one of {', '.join(COLOURINGS)}: got '{color_by}'"
            raise InputError(msg)
        if view not in VIEWS:
            msg = f"view must be one of {', '.join(VIEWS)}: got '{view}'"
            raise InputError(msg)
        if not all(_LEAST_SIZE <= side <= _LARGEST_SIZE for side in size):
            msg = f"size must be {_LEAST_SIZE} to {_LARGEST_SIZE} pixels each way: got {size[0]} x {size[1]}"
            raise InputError(msg)
        azimuth, elevation = VIEWS[view]
        return cls(colouring=COLOURINGS[color_by], size=size, azimuth=azimuth, elevation=elevation)

    @property
    def panel(self) -> tuple[int, int]:
        """Width and height of the three-dimensional part [pixel]."""
        return round(self.size[0] * _PANEL[0]), round(self.size[1] * _PANEL[1])

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3), rows: right, up, and forward from the camera into the scene."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
        forward = -np.array(
            [
                math.cos(elevation) * math.cos(azimuth),
                math.cos(elevation) * math.sin(azimuth),
                math.sin(elevation),
            ]
        )
        return np.stack([right, np.cross(right, forward), forward])


def _extent(frame: Frame, run: RunManifest, look: _Look) -> NDArray[np.float64]:
    """Points (n, 3) [mm] above the floor that must be in the picture; the floor is at z = 0."""
    points = (frame.vertices.reshape(-1, 3) - [0.0, 0.0, frame.floor_z]) * _MILLIMETRE
    top = _wall_height(float(points[:, 2].max()), run)
    rim = _circle(run.container_radius * _MILLIMETRE, top)
    if look.elevation < 90:
        rim = rim[rim @ look.axes[2] > look.axes[2, 2] * top]
    floor = _circle(run.container_radius * _MILLIMETRE, 0.0)
    return np.concatenate([points, floor, rim])


def _wall_height(top: float, run: RunManifest) -> float:
    """Height up to which the wall is drawn [mm]: above the pile, in whole quarters of w."""
    step = run.middle_length * _MILLIMETRE / 4
    return max(4.0, math.ceil(top / step) + 1.0) * step


def _circle(radius: float, z: float, points: int = 181) -> NDArray[np.float64]:
    angle = np.linspace(0, 2 * math.pi, points)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(points, z)], axis=1)


def _fitted_camera(
    points: NDArray[np.float64], axes: NDArray[np.float64], aspect: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position and focal point of the nearest camera that has all points in its picture.

    Args:
        points: (n, 3).
        axes: (3, 3), rows: right, up, forward.
        aspect: Width over height of the picture.

    Returns:
        Position (3,) and focal point (3,).
    """
    tangent = math.tan(math.radians(_FIELD_OF_VIEW / 2)) * _FILL
    tangents = np.array([tangent * aspect, tangent])
    x, depth = points @ axes[:2].T, points @ axes[2]
    # |x - c| <= tangent (distance + depth): for each direction two families of straight lines in
    # (c, distance); where their upper envelopes meet lies the centre with the least distance.
    high = (x / tangents - depth[:, None]).max(axis=0)
    low = (-x / tangents - depth[:, None]).max(axis=0)
    distance = float(((high + low) / 2).max())
    # The other direction has room to spare, which goes to both sides alike.
    low, high = x.min(axis=0), x.max(axis=0)
    for _ in range(60):
        centre = (low + high) / 2
        share = (x - centre) / (distance + depth)[:, None]
        right = share.max(axis=0) + share.min(axis=0) > 0
        low, high = np.where(right, centre, low), np.where(right, high, centre)
    middle = (depth.min() + depth.max()) / 2
    focus = centre @ axes[:2] + middle * axes[2]
    return focus - (distance + middle) * axes[2], focus


class _Stage:
    """Container, camera and lights of one picture or film; draws frame after frame."""

    def __init__(
        self,
        run: RunManifest,
        look: _Look,
        extent: NDArray[np.float64],
        span: tuple[float, float],
    ) -> None:
        self._run = run
        self._look = look
        self._scale = ColourScale.of(look.colouring, *span)
        _check_graphics()
        with _quiet_vtk():
            width, height = look.panel
            self._plotter: Any = pv.Plotter(
                off_screen=True,
                window_size=[_OVERSAMPLING * width, _OVERSAMPLING * height],
                lighting="none",
            )
            self._build(extent)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._plotter.close()

    def picture(self, frame: Frame, values: NDArray[Any]) -> Image.Image:
        """One finished picture of a frame coloured by one value per smarticle."""
        boxes = link_boxes(
            frame.vertices - [0.0, 0.0, frame.floor_z],
            thickness_normal=self._run.thickness_normal,
            thickness_in_plane=self._run.thickness_in_plane,
        )
        boxes.points *= _MILLIMETRE
        boxes.cell_data["colour"] = self._scale.colours(values[boxes.cell_data["smarticle"]])
        with _quiet_vtk():
            self._plotter.add_mesh(
                boxes,
                scalars="colour",
                rgb=True,
                name="smarticles",
                ambient=0.22,
                diffuse=0.85,
                specular=0.12,
                specular_power=20,
                show_edges=True,
                edge_color="#101418",
                edge_opacity=0.55,
                line_width=0.5 * _OVERSAMPLING,
                reset_camera=False,
                render=False,
            )
            self._plotter.render()
            pixels = self._plotter.screenshot(return_img=True)
        panel = Image.fromarray(pixels).resize(self._look.panel, Image.Resampling.LANCZOS)
        return self._composed(np.asarray(panel), self._caption(frame))

    def _build(self, extent: NDArray[np.float64]) -> None:
        plotter, axes = self._plotter, self._look.axes
        radius = self._run.container_radius * _MILLIMETRE
        top = float(extent[:, 2].max())  # of the wall's rim, which is above the pile
        plotter.set_background("white")
        floor = pv.Disc(inner=0, outer=radius, c_res=180)
        plotter.add_mesh(floor, color="#e9e9e7", ambient=0.45, diffuse=0.6, render=False)
        arc = _back_arc(radius, axes[2])
        if arc is not None:
            wall = pv.MultipleLines(arc).extrude((0.0, 0.0, top), capping=False)
            plotter.add_mesh(wall, color="#9db4c8", opacity=0.22, lighting=False, render=False)
            upper = arc + np.array([0.0, 0.0, top])
            self._add_outline(np.concatenate([arc[:1], upper, arc[-1:]]))
        self._add_outline(_circle(radius, 0.0 if arc is not None else top))
        width, height = self._look.panel
        position, focus = _fitted_camera(extent, axes, width / height)
        self._light(position, focus)
        camera = plotter.camera
        camera.view_angle = _FIELD_OF_VIEW
        camera.position = tuple(position)
        camera.focal_point = tuple(focus)
        camera.up = tuple(axes[1])
        distance = float(np.linalg.norm(position - focus))
        reach = float(np.linalg.norm(extent - focus, axis=1).max()) + radius
        camera.clipping_range = (max(distance - reach, distance / 1000), distance + reach)
        plotter.enable_ssao(
            radius=0.6 * self._run.middle_length * _MILLIMETRE,
            bias=0.4 * self._run.thickness_in_plane * _MILLIMETRE,
            kernel_size=64,
            blur=True,
        )

    def _add_outline(self, points: NDArray[np.float64]) -> None:
        self._plotter.add_mesh(
            pv.MultipleLines(points),
            color="#7d8f9f",
            line_width=1.8 * _OVERSAMPLING,
            lighting=False,
            render=False,
        )

    def _light(self, position: NDArray[np.float64], focus: NDArray[np.float64]) -> None:
        right, up, forward = self._look.axes
        distance = float(np.linalg.norm(position - focus))
        for side, rise, strength in ((-0.6, 1.1, 0.85), (0.9, 0.35, 0.32), (0.0, 0.0, 0.25)):
            source = focus + distance * (side * right + rise * up - forward)
            self._plotter.add_light(
                pv.Light(
                    position=tuple(source),
                    focal_point=tuple(focus),
                    intensity=strength,
                    light_type="scene light",
                )
            )

    def _caption(self, frame: Frame) -> tuple[str, str, str]:
        run = self._run
        count = f"{run.count}" if frame.count == run.count else f"{frame.count} of {run.count}"
        phase = run.phases[frame.phase].type if frame.phase < len(run.phases) else "?"
        try:
            phi = packing_fraction(
                frame.vertices,
                radius=run.container_radius,
                solid_volume=run.solid_volume,
                floor_z=frame.floor_z,
            )
            packing = f"φ = {phi.value:.3f} (definition {phi.definition})"
        except UndefinedMeasureError:
            packing = "φ undefined"
        mean = entanglement(frame.vertices).mean
        crossings = f"⟨N⟩ = {mean:.2f}" if math.isfinite(mean) else "⟨N⟩ undefined"
        return (
            run.name,
            f"l/w = {run.aspect_ratio:g}   N = {count}   t = {frame.time:.3f} s ({phase})",
            f"{packing}   {crossings}",
        )

    def _composed(self, panel: NDArray[np.uint8], caption: tuple[str, str, str]) -> Image.Image:
        """The drawn panel with its caption and colour bar."""
        width, height = self._look.size
        unit = min(width, height) / 100  # pixel; text scales with the picture
        with figures.style():
            figure = figures.blank_figure(width / 72, height / 72, dpi=72)
            figure.figimage(panel, xo=0, yo=0, origin="upper")
            rows = ((2.0, 2.4, "bold", figures.BLACK), (5.4, 1.85, "normal", figures.GREY))
            for text, (below, points, weight, colour) in zip((caption[0], "\n".join(caption[1:])), rows, strict=True):
                figure.text(
                    2.6 * unit / width,
                    1 - below * unit / height,
                    text,
                    fontsize=points * unit,
                    weight=weight,
                    color=colour,
                    va="top",
                    linespacing=1.35,
                    parse_math=False,
                )
            self._scale.draw(figure, self._look.colouring.label, unit)
            return Image.fromarray(figures.pixels(figure))


def _back_arc(radius: float, forward: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The half of the rim (n, 3) that faces the camera from behind; None seen from above."""
    if math.hypot(forward[0], forward[1]) < 1e-9:
        return None
    middle = math.atan2(forward[1], forward[0])
    angle = middle + np.linspace(-math.pi / 2, math.pi / 2, 91)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)


def _check_graphics() -> None:
    """Complains where VTK, instead of complaining, would end the process by a segmentation fault.

    Raises:
        RunError: There is neither a display nor a library to draw without one.
    """
    if sys.platform != "linux" or os.environ.get("DISPLAY"):
        return
    for library in ("libEGL.so.1", "libOSMesa.so.8"):
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return
    msg = (
        "cannot draw: no display and no libEGL.so.1; apt-get install libegl1 libgl1-mesa-dri, or see smarticles doctor"
    )
    raise RunError(msg)


@contextmanager
def _quiet_vtk() -> Iterator[None]:
    """Keeps VTK from warning, on standard error, that there is no display."""
    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)
