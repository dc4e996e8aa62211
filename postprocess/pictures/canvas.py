"""Draw the bodies of one or more runs side by side, in parallel projection, by PyVista.

Pictures are drawn at twice their size and scaled down. No display is needed: VTK falls back to EGL.
"""

import ctypes
import math
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np
import pyvista as pv
from matplotlib.colors import Colormap
from matplotlib.font_manager import FontProperties, findfont
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkRenderingCore import vtkTextRenderer

from dem.errors import InputError, RunError, nearest
from dem.record.frame import Frame
from dem.record.frames import read_frames
from dem.record.run import Run, open_run
from postprocess.bodies.colours import PAINTS, ColourScale, colour_field, scalars
from postprocess.bodies.fields import BY_NAME, IDENTITY, Field
from postprocess.bodies.meshes import USUAL, Bodies, at_points, owners, solid
from postprocess.geometry.links import Floats
from postprocess.report import figures

VIEWS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"front": (-90.0, 14.0), "oblique": (-62.0, 34.0), "top": (-90.0, 90.0)}
)  #: Named views: azimuth and elevation of the camera from the centre of the pile [degree]

MILLIMETRE = 1e3  #: Factor from m to mm, the unit of all drawing: VTK's tolerances do not suit a few cm given in m

_OVERSAMPLING = 2
_LEAST_SIZE, _LARGEST_SIZE = 200, 8000  # of a picture [pixel]
_FILL = 0.97  # fraction of the free width or height that bodies take
_EDGE = "#7d8f9f"
_PALE = 0.15  # opacity of smarticles if forces are drawn
# In `Style.unit`: height of the captions, of scale and colour bar, margin, size of title and text.
_HEAD, _FOOT, _MARGIN, _TITLE, _TEXT = 11.5, 10.0, 2.6, 2.5, 1.9
_LEAST_UNIT = 4.4  # so that text stays readable [pixel]
_LETTER = 0.62  # width of a letter over its height
_LIGHTS = ((-0.6, 1.1, 0.85), (0.9, 0.35, 0.32), (0.0, 0.0, 0.25))  # right, up, intensity


@dataclass(frozen=True, kw_only=True, eq=False)
class Style:
    """Style of a picture: coloured field, size and camera."""

    field: Field  #: Field by which smarticles are coloured
    size: tuple[int, int]  #: Width and height of the panel of one run [pixel]
    axes: Floats  #: (3, 3) unit vectors of the camera: right, up, forward

    @classmethod
    def of(cls, runs: Sequence[Run], *, color_by: str | None, size: tuple[int, int], view: str | None) -> Self:
        """Return the style of a picture of runs side by side, with panels of a width and a height [pixel].

        `color_by` is the name or short name of a field, see `colour_field`. `view` is a key of `VIEWS`; by default
        "front", or "top" if the runs are planar. InputError for an unknown field or view, a bad size, or if only some
        of the runs are planar.
        """
        if len({run.manifest.planar for run in runs}) > 1:
            raise InputError("a run in a plane and one in space have no view in common; compare runs of one kind")
        name = view or ("top" if runs[0].manifest.planar else "front")
        if name not in VIEWS:
            raise InputError(f"view: {name!r} is not known; {nearest(name, VIEWS)}")
        if not all(_LEAST_SIZE <= side <= _LARGEST_SIZE for side in size):
            msg = f"size must be {_LEAST_SIZE} to {_LARGEST_SIZE} pixels each way: got {size[0]} x {size[1]}"
            raise InputError(msg)
        return cls(field=colour_field(color_by, runs[0]), size=size, axes=axes_from(*VIEWS[name]))

    @property
    def unit(self) -> float:
        """Unit of text sizes and margins [pixel]: a hundredth of the shorter side, at least `_LEAST_UNIT`."""
        return max(min(self.size) / 100, _LEAST_UNIT)

    def pixel(self, extent: Floats) -> float:
        """Return the side of a pixel [mm] in a picture that shows an extent (2, 2) [mm]."""
        width, height = np.diff(extent, axis=0)[0]
        free = self.size[1] - (_HEAD + _FOOT) * self.unit
        return float(max(width / (_FILL * self.size[0]), height / (_FILL * free))) or 1.0

    def panel(self, image: Image.Image) -> Image.Image:
        """Cut the strips with captions and bars, at the top and the bottom, off a picture."""
        return image.crop((0, round(_HEAD * self.unit), image.width, image.height - round(_FOOT * self.unit)))


class Subject:
    """A run to be drawn, with its frames and bodies; InputError if forces are wanted and not recorded."""

    def __init__(self, directory: Path | str, *, forces: bool = False) -> None:
        self.run = open_run(directory)
        kinds = (*USUAL, "forces") if forces else USUAL
        self.bodies = Bodies(self.run, kinds, [BY_NAME[name] for name in IDENTITY], cut=True)
        self.frames = read_frames(directory)

    def extent(self, indices: Iterable[int], axes: Floats) -> Floats:
        """Return lower left and upper right (2, 2) [mm] of the bodies in some frames along the camera's axes."""
        return union([extent(visible_meshes(self.bodies, self.frames[i], axes[2]).values(), axes) for i in indices])

    def values(self, indices: Iterable[int], style: Style) -> list[Floats]:
        """Return the coloured field in each of some frames, a number per link (N, L): of a vector its length."""
        return [scalars(style.field, self.frames[i], self.run) for i in indices]


def axes_from(azimuth: float, elevation: float) -> Floats:
    """Return the unit vectors (3, 3) right, up and forward of a camera by azimuth and elevation [degree]."""
    a, e = math.radians(azimuth), math.radians(elevation)
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    forward = -np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    return np.stack([right, np.cross(right, forward), forward])


def visible_meshes(
    bodies: Bodies, frame: Frame, forward: Floats, *, largest: float | None = None
) -> dict[str, pv.PolyData]:
    """Return the meshes of a frame by kind, [mm] above the floor, with lines as tubes.

    A removed wall has the kind `ghost`. The half of the wall in front, by the direction of view `forward` (3,), is cut
    away, unless this vector is zero. The thickest line has the normal force `largest` [N]; the largest of the frame if
    not given.
    """
    made = bodies.at(frame)
    if "wall" in bodies.kinds and "wall" not in made and bodies.boundaries.removal is not None:
        made["ghost"] = bodies.wall_at(frame.floor_z)
    found = {}
    for kind, mesh in made.items():
        shape = mesh if kind in {"smarticles", "ghost"} else solid(kind, mesh, bodies.run, largest=largest)
        if kind in {"wall", "ghost"} and not bodies.run.manifest.planar and np.hypot(*forward[:2]) > 1e-9:
            shape = shape.clean(tolerance=1e-6).clip(normal=(-forward[0], -forward[1], 0.0), origin=(0.0, 0.0, 0.0))
        found[kind] = shape.translate((0.0, 0.0, -frame.floor_z)).scale(MILLIMETRE)
    return found


def extent(meshes: Iterable[pv.PolyData], axes: Floats) -> Floats:
    """Return the extent of meshes in the plane of the picture: (2, 2) [mm], lower left and upper right."""
    places = np.concatenate([np.asarray(mesh.points) @ axes[:2].T for mesh in meshes])
    return np.stack([places.min(axis=0), places.max(axis=0)])


def union(extents: Sequence[Floats]) -> Floats:
    """Return the smallest extent (2, 2) that contains several extents."""
    return np.stack([np.min(extents, axis=0)[0], np.max(extents, axis=0)[1]])


def add_bodies(plotter: Any, meshes: Mapping[str, pv.PolyData], frame: Frame, colours: NDArray[np.uint8]) -> None:
    """Draw the meshes of a frame in a window of PyVista, in place of all bodies drawn before.

    `meshes` are the meshes by kind, as of `visible_meshes`. `colours` (N, 3, 3) uint8 are the sRGB colours of the
    links.
    """
    pale = "forces" in meshes
    for kind in (*PAINTS, "ghost"):
        for name in (kind, f"{kind} edges"):
            plotter.renderer.remove_actor(name, render=False)
    for kind, mesh in meshes.items():
        options = {"name": kind, "reset_camera": False, "render": False, "culling": False}
        if kind in {"wall", "floor", "ghost"}:
            # Coinciding points would be drawn as edges.
            edges = mesh.clean(tolerance=1e-6).extract_feature_edges(feature_angle=30, manifold_edges=False)
            opacity = 0.3 if kind == "ghost" else 1.0
            line = {"color": _EDGE, "line_width": 1.8 * _OVERSAMPLING, "lighting": False, "opacity": opacity}
            plotter.add_mesh(edges, **(options | line | {"name": f"{kind} edges"}))
        if kind == "smarticles":
            mesh.point_data["colour"] = at_points(mesh, colours[owners(mesh, frame)])
            options |= {"scalars": "colour", "rgb": True, "opacity": _PALE if pale else 1.0, "specular": 0.12}
            # Hidden back faces would take a quarter of a film's time.
            options |= {"culling": not pale and "back", "ambient": 0.22, "diffuse": 0.85, "specular_power": 20}
            # Cylinders are triangles, whose edges are none of the body.
            boxes = mesh.GetPolys().IsHomogeneous() == 4
            options |= {"show_edges": boxes, "edge_color": "#101418", "edge_opacity": 0.55, "line_width": _OVERSAMPLING}
        elif kind != "ghost":
            grazed = kind == "floor"  # light at grazing incidence would leave it black
            options |= {"color": PAINTS[kind].colour, "opacity": PAINTS[kind].opacity, "lighting": kind != "wall"}
            options |= {"ambient": 0.45 if grazed else 0.25, "diffuse": 0.6 if grazed else 0.8}
        if kind != "ghost":
            plotter.add_mesh(mesh, **options)


class Canvas:
    """An off-screen window with one panel per run, one camera, one colour scale and one scale bar.

    RunError if this machine lacks the libraries to draw without a display. The extent (2, 2) in the camera's view is in
    [mm]. The link size of `run` sets the range of the shading of corners (ambient occlusion), which takes most of the
    time of a picture and is left out by `quick`. Without `scale` there is no colour bar.
    """

    def __init__(
        self,
        style: Style,
        extent: Floats,
        run: Run,
        *,
        columns: int = 1,
        scale: ColourScale | None = None,
        quick: bool = False,
    ) -> None:
        check_graphics()
        self._style, self._columns = style, columns
        self.size = style.size[0] * columns, style.size[1]
        self.pixel = style.pixel(extent)
        # Captions are higher than the bars below, so the centre is not that of the picture.
        lift = (_HEAD - _FOOT) / 2 * style.unit * self.pixel
        self._centre = extent.mean(axis=0) + np.array([0.0, lift])
        self._reach = 4 * self.pixel * max(self.size)
        with quiet_vtk():
            plotter: Any = pv.Plotter(
                off_screen=True, shape=(1, columns), border=False, lighting="none",
                window_size=[_OVERSAMPLING * side for side in self.size],
            )  # fmt: skip
            self._plotter = plotter
            plotter.disable_anti_aliasing()  # drawn larger and scaled down, edges are smooth already
            plotter.set_background("white")
            vtkTextRenderer.GetInstance().SetDefaultBackend(vtkTextRenderer.FreeType)  # no formulas in names
            for column in range(columns):
                plotter.subplot(0, column)
                for aside, rise, strength in _LIGHTS:
                    lamp = pv.Light(position=(aside, rise, 1.0), intensity=strength, light_type="camera light")
                    plotter.add_light(lamp, only_active=True)
                if not quick:
                    plotter.enable_ssao(
                        radius=0.6 * run.manifest.middle_length_m * MILLIMETRE,
            bias=0.4 * run.manifest.thickness_in_plane_m * MILLIMETRE,
                        kernel_size=64, blur=True,
                    )  # fmt: skip
            self.turn(style.axes)
            if scale is not None and scale.colours is not None:
                self._add_colour_bar(scale, scale.colours)
            self._length = round_length(0.2 * style.size[0] * self.pixel)
            at = self._bar[2] + style.unit, self._bar[3]
            self._write(0, "scale", f"{self._length:g} mm", at, _TEXT)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._plotter.close()

    @property
    def _bar(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of the scale bar [pixel], measured from the lower left of the picture."""
        unit = self._style.unit
        return _MARGIN * unit, (_FOOT / 2 + 0.9) * unit, _MARGIN * unit + self._length / self.pixel, _FOOT / 2 * unit

    def turn(self, axes: Floats) -> None:
        """Turn the camera of all panels to axes (3, 3): right, up, forward."""
        right, up, forward = axes
        focus = self._centre[0] * right + self._centre[1] * up
        for column in range(self._columns):
            self._plotter.subplot(0, column)
            camera = self._plotter.camera
            camera.parallel_projection = True
            camera.parallel_scale = self.pixel * self._style.size[1] / 2
            camera.focal_point, camera.position = tuple(focus), tuple(focus - self._reach * forward)
            camera.up, camera.clipping_range = tuple(up), (self._reach / 1000, 2 * self._reach)

    def show(
        self,
        column: int,
        frame: Frame,
        meshes: Mapping[str, pv.PolyData],
        colours: NDArray[np.uint8],
        caption: Sequence[str] = (),
    ) -> None:
        """Show the meshes of a frame in a panel, with colours of the links, sRGB (N, 3, 3), uint8.

        The first line of the caption is the title.
        """
        with quiet_vtk():
            self._plotter.subplot(0, column)
            add_bodies(self._plotter, meshes, frame, colours)
            unit, down = self._style.unit, self._style.size[1] - 2.0 * self._style.unit
            for number, text in enumerate(caption):
                size = _TEXT if number else _TITLE
                down -= 1.4 * size * unit
                self._write(column, f"line {number}", text, (_MARGIN * unit, down), size, bold=not number)

    def add_patch(self, corners: Floats, colour: str) -> None:
        """Add a translucent polygon with corners (n, 3) [mm]."""
        patch = pv.PolyData.from_regular_faces(corners, [list(range(len(corners)))])
        self._plotter.add_mesh(patch, color=colour, opacity=0.25, lighting=False, reset_camera=False, render=False)

    def image(self) -> Image.Image:
        """Return the picture of all panels."""
        with quiet_vtk():
            self._plotter.render()
            image = Image.fromarray(self._plotter.screenshot(return_img=True)).reduce(_OVERSAMPLING)
        left, top, right, bottom = self._bar
        ImageDraw.Draw(image).rectangle((left, self.size[1] - top, right, self.size[1] - bottom), fill=figures.BLACK)
        return image

    def _write(
        self, column: int, name: str, text: str, at: tuple[float, float], size: float, *, bold: bool = False
    ) -> None:
        """Write a line at a position from the lower left [pixel]; shrink or cut it if it is too long.

        `column` is the number of the run, from the left; `size` is the font size, over `Style.unit`. A new line
        replaces the line with its `name`.
        """
        (x, y), width = at, self._style.size[0]
        text = "".join(letter if letter.isprintable() else "?" for letter in text)
        points, room = size * self._style.unit, (width - x) / _LETTER
        points = min(points, max(room / max(len(text), 1), 0.6 * points))
        if len(text) * points > room:
            text = f"{text[: int(room / points) - 1]}…"
        font = findfont(FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal"))
        colour = figures.BLACK if size == _TITLE or name == "scale" else figures.GREY
        line = pv.Text(text, position=(_OVERSAMPLING * x, _OVERSAMPLING * y))
        line.prop = pv.TextProperty(color=colour, font_size=round(_OVERSAMPLING * points), font_file=font)
        self._plotter.subplot(0, column)
        self._plotter.add_actor(line, name=name, reset_camera=False, render=False)

    def _add_colour_bar(self, scale: ColourScale, colours: Colormap) -> None:
        unit, height = self._style.unit * _OVERSAMPLING, self._style.size[1]
        table = pv.LookupTable(colours, n_values=min(colours.N, 256), scalar_range=(scale.low, scale.high))
        table.annotations = dict(scale.labels)
        mapper = pv.DataSetMapper(pv.PolyData())
        mapper.lookup_table = table
        self._plotter.subplot(0, self._columns - 1)
        self._plotter.add_scalar_bar(
            self._style.field.title, mapper=mapper, vertical=False, n_labels=0, color=figures.BLACK, render=False,
            position_x=0.45, position_y=3.2 * self._style.unit / height, width=0.52,
            height=5.6 * self._style.unit / height,
            title_font_size=round(_TEXT * unit), label_font_size=round(_TEXT * unit), use_opacity=False,
        )  # fmt: skip


def round_length(most: float) -> float:
    """Return the largest of the lengths …, 0.5, 1, 2, 5, 10, … that is at most `most`, which is above 0.

    Example:
        >>> round_length(37.0), round_length(0.6)
        (20.0, 0.5)
    """
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most * (1 + 1e-9))


def check_graphics() -> None:
    """Check that VTK can draw on this machine; without a library it would end by a segmentation fault.

    RunError if there is neither a display nor a library to draw without one.
    """
    if sys.platform != "linux" or os.environ.get("DISPLAY"):
        return
    for library in ("libEGL.so.1", "libOSMesa.so.8"):
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return
    raise RunError(
        "cannot draw: no display and no libEGL.so.1; apt-get install libegl1 libgl1-mesa-dri, or see smarticles doctor"
    )


@contextmanager
def quiet_vtk() -> Iterator[None]:
    """Suppress VTK's warning that there is no display."""
    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)
