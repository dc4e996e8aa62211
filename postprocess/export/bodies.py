"""True bodies of a run at a time, as meshes in metres: boxes of links, walls, floor, hooks, strings, crossings.

Coordinates are those of the frames, z upwards: a container that is shaken moves. Everything is as large as in the
simulation, but for what has no size there: a wall without a height ends above the highest smarticle, a string has no
thickness, a wall neither.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Self

import numpy as np
import pyvista as pv

from dem.errors import InputError, nearest
from dem.record.forces import NO_FORCES, read_forces
from dem.record.frame import Frame
from dem.record.run import Run
from postprocess.export.fields import Field, link_values
from postprocess.measures.entanglement import link_passages
from postprocess.measures.force_chains import strong_contacts
from postprocess.pictures.canvas import link_boxes
from postprocess.pictures.force_lines import force_lines, force_tubes
from postprocess.pictures.strings import ChainStrings, read_strings
from postprocess.pictures.surroundings import Bounds, Surroundings, read_surroundings

if TYPE_CHECKING:
    pass

KINDS: Mapping[str, str] = MappingProxyType(
    {
        "smarticles": "a box per link, with all fields",
        "wall": "of the container, tiers and ceilings of a mould, or the two of a plane",
        "floor": "of the container",
        "hooks": "the two crosses",
        "strings": "the two of a strain test, as lines",
        "crossings": "on request: a point and a vector for each link that passes through a smarticle's plane",
        "forces": "on request: lines from centre to contact to centre, where the run records forces",
    }
)
"""What can be exported, and what it is."""

ON_REQUEST = ("crossings", "forces")
"""Of these, what is left out unless asked for."""

ROUND = 96
"""Corners of a circle."""


def checked_kinds(wanted: Sequence[str], unwanted: Sequence[str], *, also: Sequence[str] = ()) -> tuple[str, ...]:
    """The kinds to export.

    Args:
        wanted: Besides those that are exported anyway.
        unwanted: To leave out.
        also: What else may be left out.

    Raises:
        InputError: An unknown kind, or nothing is left.
    """
    for name in (*wanted, *(name for name in unwanted if name not in also)):
        if name not in KINDS:
            known = [*KINDS, *(also if name in unwanted else ())]
            msg = f"{name!r} is nothing to export; {nearest(name, known, cutoff=0.5)}"
            raise InputError(msg)
    kept = tuple(kind for kind in KINDS if (kind not in ON_REQUEST or kind in wanted) and kind not in unwanted)
    if not kept:
        msg = "nothing is left to export; leave out less"
        raise InputError(msg)
    return kept


class Bodies:
    """The bodies of one run, frame after frame.

    Args:
        run: The run.
        around: Its container and hooks.
        strings: Of a strain test; None without.
        kinds: Which bodies, keys of `KINDS`.
        fields: What the smarticles carry.
    """

    def __init__(
        self,
        run: Run,
        around: Surroundings,
        strings: ChainStrings | None,
        kinds: Sequence[str],
        fields: Sequence[Field],
    ) -> None:
        self.run = run
        self.kinds = kinds
        self.fields = fields
        self._around = around
        self._strings = strings
        container = run.scene.get("container")
        height = None if container is None else container.get("height_m")
        self._height = None if container is None or height is None else height
        # The wall rests where the floor is at rest, at z = 0, while a shake moves the floor alone.
        self._floor_alone = {index for index, phase in enumerate(run.scene["phases"]) if phase.get("moves") == "floor"}
        self._top = 0.0  # of the highest smarticle above the floor
        self._reach = 0.0  # of the farthest one from the axis
        self._span = math.inf, -math.inf  # of all along x

    @classmethod
    def read(cls, run: Run, kinds: Sequence[str], fields: Sequence[Field]) -> Self:
        """What a run directory tells.

        Raises:
            InputError: Its scene or its series is damaged.
        """
        if "forces" in kinds and not (run.forces is not None):
            msg = f"{run.path}: records no forces; {NO_FORCES}"
            raise InputError(msg)
        return cls(run, read_surroundings(run), read_strings(run) if run.manifest.planar else None, kinds, fields)

    def hold(self, frames: Iterable[Frame]) -> None:
        """Make walls and floor large enough for these frames too."""
        for frame in frames:
            if frame.count == 0:
                continue
            points = frame.vertices.reshape(-1, 3)
            self._top = max(self._top, float(points[:, 2].max()) - frame.floor_z)
            self._reach = max(self._reach, float(np.hypot(points[:, 0], points[:, 1]).max()))
            self._span = min(self._span[0], float(points[:, 0].min())), max(self._span[1], float(points[:, 0].max()))

    def at(self, frame: Frame) -> dict[str, pv.PolyData]:
        """The bodies of a frame by kind, [m]; only those that there are."""
        makers = {
            "smarticles": self._smarticles,
            "wall": self._wall,
            "floor": self._floor,
            "hooks": self._hooks,
            "strings": self._lines,
            "crossings": self._crossings,
            "forces": self._forces,
        }
        made = {kind: makers[kind](frame) for kind in self.kinds}
        return {kind: mesh for kind, mesh in made.items() if mesh is not None and mesh.n_points}

    def _smarticles(self, frame: Frame) -> pv.PolyData:
        run = self.run
        mesh = link_boxes(
            frame.vertices,
            thickness_normal=run.manifest.thickness_normal_m,
            thickness_in_plane=run.manifest.thicknesses_in_plane_m,
        )
        owner = mesh.cell_data.pop("smarticle"), mesh.cell_data.pop("link")
        for field in self.fields:
            values = link_values(field, frame, run)
            if values is not None:
                mesh.cell_data[field.name] = values[owner]
        return mesh

    def _wall(self, frame: Frame) -> pv.PolyData | None:
        run, floor = self.run, frame.floor_z
        if run.manifest.planar:
            if run.manifest.channel_width_m is None:
                return None
            half, (first, last) = run.manifest.channel_width_m / 2, self._span
            return _joined(
                pv.Rectangle([[first, y, floor], [last, y, floor], [last, y, floor + run.manifest.thickness_normal_m]])
                for y in (-half, half)
            )
        raised = self._around.raised(frame.time, frame.phase, self._top_of(frame))
        if raised is None:
            return None
        base = 0.0 if frame.phase in self._floor_alone else floor
        outline = np.array([(radius, 0.0, base + raised + height) for radius, height in self._corners()])
        line = pv.MultipleLines(outline)
        turned: pv.PolyData = line.extrude_rotate(resolution=ROUND, capping=False).triangulate()
        turned.clear_data()
        return turned

    def _corners(self) -> list[tuple[float, float]]:
        """Radius and height above the floor of the corners of the wall from below [m]."""
        if self._around.corners:
            return self._around.corners
        top = self._top + self.run.manifest.middle_length_m if self._height is None else self._height
        return [(self.run.manifest.container_radius_m, 0.0), (self.run.manifest.container_radius_m, top)]

    @staticmethod
    def _top_of(frame: Frame) -> float:
        return float(frame.vertices[..., 2].max(initial=frame.floor_z)) - frame.floor_z

    def _floor(self, frame: Frame) -> pv.PolyData | None:
        if self.run.manifest.planar:
            return None
        radius = max(self.run.manifest.container_radius_m, self._reach)
        floor: pv.PolyData = pv.Disc(center=(0.0, 0.0, frame.floor_z), inner=0, outer=radius, c_res=ROUND).triangulate()
        return floor

    def _hooks(self, frame: Frame) -> pv.PolyData | None:
        hooks = self._around.hooks
        if hooks is None:
            return None
        heights, both = hooks.heights(frame.time), hooks.bars
        crosses = [cross(bars, frame.floor_z + height) for bars, height in zip(both, heights, strict=True)]
        mesh = _joined(crosses)
        mesh.cell_data["hook"] = np.repeat([0, 1], [one.n_cells for one in crosses])
        return mesh

    def _lines(self, frame: Frame) -> pv.PolyData | None:
        if self._strings is None:
            return None
        lines = self._strings.lines(frame)
        if not len(lines):
            return None
        mesh = _joined(pv.MultipleLines(line) for line in lines)
        mesh.clear_data()
        mesh.cell_data["string"] = np.arange(2)
        return mesh

    def _crossings(self, frame: Frame) -> pv.PolyData | None:
        if self.run.manifest.planar or frame.count == 0:
            return None
        found = link_passages(frame.vertices)
        if not len(found.i):
            return None
        along = frame.vertices[found.j, found.link + 1] - frame.vertices[found.j, found.link]
        mesh = pv.PolyData(found.point)
        mesh.point_data["smarticle_id"] = frame.smarticle_ids[found.i]
        mesh.point_data["passing_id"] = frame.smarticle_ids[found.j]
        mesh.point_data["passing_link"] = found.link
        mesh.point_data["direction"] = along / np.linalg.norm(along, axis=1, keepdims=True)
        return mesh

    def _forces(self, frame: Frame) -> pv.PolyData | None:
        forces = read_forces(frame)
        found = forces.contacts
        if not len(found.normal):
            return None
        mesh = force_lines(forces)
        above = np.zeros(len(found.normal), dtype=np.int64)
        if forces.between.any():
            above[forces.between] = strong_contacts(found.normal[forces.between])
        first, second = found.smarticles.T
        values = {
            "first_id": frame.smarticle_ids[first],  # as the field smarticle_id has them
            "second_id": np.where(second < 0, second, frame.smarticle_ids[second]),
            "fixture": found.fixtures,
            "normal_force_N": found.normal,
            "tangential_force_N": found.tangential,
            "force_N": found.forces,
            "strong": above,
        }
        for name, each in values.items():
            mesh.cell_data[name] = each[mesh.cell_data["contact"]]
        return mesh


def cross(bars: Sequence[Bounds], height: float) -> pv.PolyData:
    """One hook, its centre at a height [m]; six quadrilaterals for each bar."""
    return _joined(pv.Box((*bar[:4], height + bar[4], height + bar[5])) for bar in bars)


def solid(kind: str, mesh: pv.PolyData, run: Run) -> pv.PolyData:
    """A body as triangles alone, for files that know nothing else.

    Strings become tubes a fifth of a link thick, crossings arrows a third of w long, forces tubes as thick as a link at
    most, whose thickness is in proportion to the normal force; boxes stay what they are.
    """
    thin = min(run.manifest.thickness_in_plane_m, run.manifest.thickness_normal_m)
    if kind == "strings":
        mesh = mesh.tube(radius=thin / 10, n_sides=8, capping=True)
    if kind == "forces":
        normal = np.asarray(mesh.cell_data["normal_force_N"])
        mesh = force_tubes(mesh, normal, thickest=thin / 2, largest=float(normal.max()))
    if kind == "crossings":
        arrow = pv.Arrow(start=(-0.5, 0.0, 0.0), tip_resolution=8, shaft_resolution=6)
        mesh = mesh.glyph(geom=arrow, orient="direction", scale=False, factor=run.manifest.middle_length_m / 3)
    triangles: pv.PolyData = mesh.triangulate()
    return triangles


def _joined(parts: Iterable[pv.PolyData]) -> pv.PolyData:
    first, *rest = parts
    mesh: pv.PolyData = first.append_polydata(*rest)
    return mesh
