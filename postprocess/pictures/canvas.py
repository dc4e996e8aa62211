"""The canvas of a picture: container, lights and smarticles, drawn by VTK. It and `force_lines` alone import PyVista.

The three-dimensional part is drawn at twice its size and scaled down; what stands around it is set by
`postprocess.pictures.page`. No display is needed: VTK falls back to EGL.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from PIL import Image

from dem.errors import InputError
from dem.record.forces import read_forces
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.geometry.links import checked_vertices, link_lengths, plane_frames
from postprocess.pictures.camera import (
    FIELD_OF_VIEW,
    MILLIMETRE,
    Look,
    channel,
    circle,
    fitted_camera,
    millimetres_per_pixel,
    wall_corners,
)
from postprocess.pictures.force_lines import force_lines, force_tubes
from postprocess.pictures.graphics import check_graphics, quiet_vtk
from postprocess.pictures.surroundings import Bounds, Surroundings

with warnings.catch_warnings():
    # PyVista imports pyplot: see postprocess.report.figures.
    warnings.filterwarnings("ignore", message="Unable to import Axes3D")
    import pyvista as pv
    import pyvista.plotting

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

_OVERSAMPLING = 2
_FIXTURE = "#b3261e"  # of hooks and strings
_FORCE = "#a11a2e"
_PALE = 0.15  # opacity of smarticles that let forces be seen
_THICK = 0.8  # radius of the thickest line of force, in the thickness of a link

# Corners of a box (along, in plane, normal) and its faces, seen from outside.
_CORNERS = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) / 2
_FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def link_boxes(
    vertices: ArrayLike, *, thickness_normal: float, thickness_in_plane: float | Sequence[float]
) -> pv.PolyData:
    """The links of all smarticles as one mesh of boxes.

    The section of a straight smarticle, or of one without barbs, is turned about its length by an
    angle that four vertices do not tell: some angle is taken. Links without length have no box.

    Args:
        vertices: (N, 4, 3) [m], barb tip, hinge, hinge, barb tip of each smarticle.
        thickness_normal: t1, along the normal of the smarticle's plane [m].
        thickness_in_plane: t2, in the smarticle's plane [m]; of all links, or of barb 1, middle link and barb 2.

    Returns:
        Six quadrilaterals and eight points per box [m]; cell data `smarticle`, the index into
        `vertices`, and `link`, 0 to 2.

    Raises:
        InputError: Bad vertices or thicknesses.
    """
    vertices = checked_vertices(vertices)
    in_plane = np.broadcast_to(thickness_in_plane, 3)
    if not (thickness_normal > 0 and (in_plane > 0).all()):
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
    edges = np.stack([along, in_plane[link, None] * across, thickness_normal * normal], axis=1)
    points = ((start + end) / 2)[:, None] + np.einsum("ce,bex->bcx", _CORNERS, edges)
    faces: Any = _FACES + 8 * np.arange(len(points))[:, None, None]
    mesh: pv.PolyData = pv.PolyData.from_regular_faces(points.reshape(-1, 3), faces.reshape(-1, 4))
    mesh.cell_data["smarticle"] = np.repeat(smarticle, len(_FACES))
    mesh.cell_data["link"] = np.repeat(link, len(_FACES))
    return mesh


class Canvas:
    """Container, camera and lights of one picture or film; draws frame after frame.

    Args:
        run: The run.
        look: Size and direction.
        surroundings: What is drawn besides smarticles; None: nothing.
        extent: (n, 3) [mm], what the camera has in view.
        axes: (3, 3) rows: right, up and forward from the camera; those of the look if not given.
        quick: Whether to draw as films are: without the shade in corners, which takes most of the time of a still.
        largest_force: Normal force of the thickest line of force [N]; None: no forces are drawn.
    """

    def __init__(
        self,
        run: Run,
        look: Look,
        surroundings: Surroundings | None,
        extent: NDArray[np.float64],
        *,
        axes: NDArray[np.float64] | None = None,
        quick: bool = False,
        largest_force: float | None = None,
    ) -> None:
        self._run = run
        self._largest_force = largest_force
        self._look = look
        self._axes = look.axes if axes is None else axes
        self._surroundings = surroundings
        self._quick = quick
        self._wall: list[Any] = []  # what goes away with the container
        self._ghost: Any = None  # what is left of it then
        self._hooks: list[Any] = []  # the lower and the upper one
        self._boxes: pv.PolyData | None = None
        check_graphics()
        with quiet_vtk():
            width, height = look.panel
            self._plotter: Any = pv.Plotter(
                off_screen=True,
                window_size=[_OVERSAMPLING * width, _OVERSAMPLING * height],
                lighting="none",
            )
            # Drawn larger and scaled down, edges are smooth already.
            self._plotter.disable_anti_aliasing()
            self._pixel = self._build(extent)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._plotter.close()

    @property
    def pixel(self) -> float:
        """How long a pixel of the panel is at half depth [mm]."""
        return self._pixel

    def panel(self, frame: Frame, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The three-dimensional part of a picture.

        Args:
            frame: What to draw.
            colours: (N, 3) of each smarticle, or (N, 3, 3) of each of its links, 0 to 255.

        Returns:
            (height, width, 3) of `Look.panel`.
        """
        colours = colours if colours.ndim == 3 else np.repeat(colours[:, None], 3, axis=1)
        with quiet_vtk():
            self._set_boxes(frame, colours)
            self._move(frame)
            if self._largest_force is not None:
                self._press(frame, self._largest_force)
            self._plotter.render()
            pixels = self._plotter.screenshot(return_img=True)
        return np.asarray(Image.fromarray(pixels).reduce(_OVERSAMPLING))

    def add_plane(self, corners: NDArray[np.float64], colour: str) -> None:
        """Adds a flat see-through patch with corners (n, 3) [mm]."""
        patch = pv.PolyData.from_regular_faces(corners, [list(range(len(corners)))])
        self._plotter.add_mesh(patch, color=colour, opacity=0.25, lighting=False, render=False)

    def _set_boxes(self, frame: Frame, colours: NDArray[np.uint8]) -> None:
        """Puts the boxes where they are in a frame; builds them anew only where there are more or fewer."""
        boxes = link_boxes(
            frame.vertices - [0.0, 0.0, frame.floor_z],
            thickness_normal=self._run.manifest.thickness_normal_m,
            thickness_in_plane=self._run.manifest.thicknesses_in_plane_m,
        )
        boxes.points *= MILLIMETRE
        boxes.cell_data["colour"] = colours[boxes.cell_data["smarticle"], boxes.cell_data["link"]]
        if self._boxes is not None and self._boxes.n_cells == boxes.n_cells:
            self._boxes.points = boxes.points
            self._boxes.cell_data["colour"] = boxes.cell_data["colour"]
            return
        self._boxes = boxes
        self._plotter.add_mesh(
            boxes,
            scalars="colour",
            rgb=True,
            name="smarticles",
            opacity=1.0 if self._largest_force is None else _PALE,
            # Of a closed box nobody sees the faces behind; drawing them took a quarter of a film's time.
            culling=self._largest_force is None and "back",
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

    def _build(self, extent: NDArray[np.float64]) -> float:
        """Builds all but smarticles; returns how long a pixel is [mm]."""
        plotter, axes, around = self._plotter, self._axes, self._surroundings
        plotter.set_background("white")
        if around is not None:
            if self._run.manifest.planar:
                for wall in channel(extent, self._run):
                    self._add_outline(pv.MultipleLines(wall))
            else:
                self._add_container(
                    around, self._run.manifest.container_radius_m * MILLIMETRE, float(extent[:, 2].max())
                )
            if around.hooks is not None:
                look = {"color": _FIXTURE, "ambient": 0.25, "diffuse": 0.8, "render": False}
                self._hooks = [plotter.add_mesh(_cross(bars), **look) for bars in around.hooks.bars]
        width, height = self._look.panel
        position, focus = fitted_camera(extent, axes, width / height)
        self._light(position, focus)
        camera = plotter.camera
        camera.view_angle = FIELD_OF_VIEW
        camera.position = tuple(position)
        camera.focal_point = tuple(focus)
        camera.up = tuple(axes[1])
        distance = float(np.linalg.norm(position - focus))
        reach = float(np.linalg.norm(extent - focus, axis=1).max()) + self._run.manifest.container_radius_m * MILLIMETRE
        camera.clipping_range = (max(distance - reach, distance / 1000), distance + reach)
        if not self._quick:
            plotter.enable_ssao(
                radius=0.6 * self._run.manifest.middle_length_m * MILLIMETRE,
                bias=0.4 * self._run.manifest.thickness_in_plane_m * MILLIMETRE,
                kernel_size=64,
                blur=True,
            )
        return millimetres_per_pixel(position, focus, height)

    def _move(self, frame: Frame) -> None:
        """Puts walls, hooks and strings where they are in a frame."""
        around = self._surroundings
        if around is None:
            return
        top = float(frame.vertices[..., 2].max()) - frame.floor_z
        raised = around.raised(frame.time, frame.phase, top)
        for part in self._wall:
            part.visibility = raised is not None
            part.position = (0.0, 0.0, MILLIMETRE * (raised or 0.0))
        if self._ghost is not None:
            self._ghost.visibility = raised is None
        if around.hooks is not None:
            for hook, height in zip(self._hooks, around.hooks.heights(frame.time), strict=True):
                hook.position = (0.0, 0.0, MILLIMETRE * height)
        if around.strings is not None:
            self._tie((around.strings.lines(frame) - [0.0, 0.0, frame.floor_z]) * MILLIMETRE)

    def _tie(self, strings: NDArray[np.float64]) -> None:
        """Draws strings (n, 2, 3) [mm] as tubes at half height of the links, with a knot at either end."""
        self._plotter.remove_actor("strings", render=False)
        if not len(strings):
            return
        # A string has no thickness in the simulation: here one that is seen.
        thick = max(0.06 * self._run.manifest.thickness_in_plane_m * MILLIMETRE, self._pixel)
        lifted = strings + np.array([0.0, 0.0, self._run.manifest.thickness_normal_m * MILLIMETRE])
        tubes = [pv.Line(*ends).tube(radius=thick) for ends in lifted]
        knots = [pv.Sphere(radius=3 * thick, center=end) for ends in lifted for end in ends]
        mesh = tubes[0].append_polydata(*tubes[1:], *knots)
        self._plotter.add_mesh(mesh, name="strings", color=_FIXTURE, lighting=False, reset_camera=False, render=False)

    def _press(self, frame: Frame, largest: float) -> None:
        """Draws lines of force, the thickest for the largest normal force [N]."""
        self._plotter.remove_actor("forces", render=False)
        forces = read_forces(frame)
        if not len(forces.contacts.normal):
            return
        lines, thickest = force_lines(forces), _THICK * self._run.manifest.thickness_in_plane_m
        normal = forces.contacts.normal[lines.cell_data["contact"]]
        tubes = force_tubes(lines, normal, thickest=thickest, largest=largest)
        tubes.points = (tubes.points - [0.0, 0.0, frame.floor_z]) * MILLIMETRE
        self._plotter.add_mesh(tubes, name="forces", color=_FORCE, ambient=0.35, reset_camera=False, render=False)

    def _add_container(self, around: Surroundings, radius: float, top: float) -> None:
        plotter, forward = self._plotter, self._axes[2]
        floor = pv.Disc(inner=0, outer=radius, c_res=180)
        plotter.add_mesh(floor, color="#e9e9e7", ambient=0.45, diffuse=0.6, render=False)
        corners = wall_corners(top, self._run, around)
        rims = _back_rims(corners, forward)
        if rims is None:
            for outer, height in corners[1:]:
                self._add_outline(pv.MultipleLines(circle(outer, height)))
            return
        outline = _outline(rims)
        self._wall = [
            plotter.add_mesh(_bands(rims), color="#9db4c8", opacity=0.22, lighting=False, render=False),
            self._add_outline(outline),
        ]
        if around.removed is not None:
            self._ghost = self._add_outline(outline, opacity=0.3)
        self._add_outline(pv.MultipleLines(circle(radius, 0.0)))

    def _add_outline(self, lines: pv.PolyData, *, opacity: float = 1.0) -> Any:
        return self._plotter.add_mesh(
            lines,
            opacity=opacity,
            color="#7d8f9f",
            line_width=1.8 * _OVERSAMPLING,
            lighting=False,
            render=False,
        )

    def _light(self, position: NDArray[np.float64], focus: NDArray[np.float64]) -> None:
        right, up, forward = self._axes
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


def _back_rims(corners: Sequence[tuple[float, float]], forward: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The halves (m, n, 3) of a wall's rims that face the camera from behind; None seen from above."""
    if math.hypot(forward[0], forward[1]) < 1e-9:
        return None
    middle = math.atan2(forward[1], forward[0])
    angle = middle + np.linspace(-math.pi / 2, math.pi / 2, 91)
    arc = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    return np.stack([radius * arc + [0.0, 0.0, height] for radius, height in corners])


def _bands(rims: NDArray[np.float64]) -> pv.PolyData:
    """The surface between successive rims (m, n, 3)."""
    count, points = rims.shape[:2]
    first = (points * np.arange(count - 1)[:, None] + np.arange(points - 1)).ravel()
    faces: Any = np.stack([first, first + 1, first + points + 1, first + points], axis=1)
    mesh: pv.PolyData = pv.PolyData.from_regular_faces(rims.reshape(-1, 3), faces)
    return mesh


def _outline(rims: NDArray[np.float64]) -> pv.PolyData:
    """Both edges of a wall, and every rim of it but the lowest, (m, n, 3)."""
    lines = [rims[:, 0], *rims[1:], rims[:, -1]]
    first, *rest = (pv.MultipleLines(line) for line in lines)
    mesh: pv.PolyData = first.append_polydata(*rest)
    return mesh


def _cross(bars: Sequence[Bounds]) -> pv.PolyData:
    """The bars of a hook, centred at the origin [mm]."""
    first, *rest = (pv.Box(tuple(MILLIMETRE * bound for bound in bar)) for bar in bars)
    mesh: pv.PolyData = first.append_polydata(*rest)
    return mesh
