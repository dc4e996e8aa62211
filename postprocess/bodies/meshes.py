"""Make meshes [m] of the bodies of a run in a frame: links, walls, floor, hooks, strings, forces.

Meshes have the coordinates of the frames, z upwards: a shaken container moves. They have the sizes of the simulation.
A wall without a height in the scene ends above the highest smarticle; walls, plate and strings have no thickness.
"""

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.errors import InputError, nearest
from dem.record.document import Kind
from dem.record.forces import NO_FORCES, RecordedForces, read_forces
from dem.record.frame import Frame, RecordedBars
from dem.record.run import Run, SceneData
from dem.record.series import Series
from postprocess.bodies.fields import Field, link_values
from postprocess.geometry.links import Floats, Vertices, Whole, checked_vertices, link_lengths, plane_frames
from postprocess.measures.entanglement import link_passages
from postprocess.measures.force_chains import strong_contacts
from postprocess.measures.mould import read_tiers

with warnings.catch_warnings():
    # PyVista imports pyplot: see postprocess.report.figures.
    warnings.filterwarnings("ignore", message="Unable to import Axes3D")
    import pyvista as pv


PLATE = "plate_z_m"  #: Series of the height of the plate
_STRAIN, _ARRANGE = "strain", "arrange"


@dataclass(frozen=True, kw_only=True, eq=False)
class ChainStrings:
    """The two strings of a strain test, each from a knot on the chain to an anchor."""

    phase: int  #: Index of the phase in which the strings are tied
    start: float  #: Time at which this phase begins [s]
    speed: float  #: Speed of the moved anchor [m/s]
    from_hinge: float  #: Distance of a knot from the hinge of its barb [m]
    #: (2, 3) anchors at the start of the phase [m]: the fixed anchor at low x, and the anchor that moves along +x
    anchors: Floats = field(repr=False)

    def lines(self, frame: Frame) -> Floats:
        """Return the ends of both strings in a frame, (2, 2, 3) [m]: knot and anchor of each string.

        The string with the fixed anchor comes first. Frames of phases without tied strings give an empty array
        (0, 2, 3).
        """
        if frame.phase != self.phase:
            return np.empty((0, 2, 3))
        ends = self.anchors.copy()
        ends[1, 0] += self.speed * (frame.time - self.start)
        return np.stack([knots(frame.vertices, self.from_hinge), ends], axis=1)


class RunBoundaries:
    """Walls and strings of a run and their motion, read from the scene and the series of the run."""

    def __init__(self, run: Run) -> None:
        scene, phases = run.scene, run.scene.get("phases", ())
        series = run.series if run.has_series else None
        #: Radius and top of each tier of a mould, from the lowest [m]; empty for one cylinder
        self.tiers = tuple((tier.radius, tier.top) for tier in read_tiers(run))
        #: Height of the cylinder's wall [m]; None: the wall ends above the highest smarticle
        self.height: float | None = (scene.get("container") or {}).get("height_m")
        #: Indices of phases that move the floor alone; the lower edge of the wall stays at z = 0
        self.floor_alone = frozenset(index for index, phase in enumerate(phases) if phase.get("moves") == "floor")
        #: Index of the phase that removes the wall; None if no phase does
        self.removal = next((phase.index for phase in run.phases if phase.type == "remove-container"), None)
        #: Start [s], end [s] and speed [m/s] of the wall's lifting; None if it disappears at once
        self.lift = None if self.removal is None else _lift(phases[self.removal], _start(run, self.removal, series))
        #: Strings of a strain test, if there is one
        self.strings = _strings(run, series) if run.manifest.planar else None

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Corners of the profile of a mould's wall from the floor up, each (radius, height) [m].

        The list is empty if the container is no mould.
        """
        found = [(self.tiers[0][0], 0.0), self.tiers[0]] if self.tiers else []
        for (_, top), (radius, higher) in pairwise(self.tiers):
            found += [(radius, top), (radius, higher)]
        return found

    def raised(self, time: float, phase: int, top: float) -> float | None:
        """Return the height by which the wall has been lifted at `time` [m]; None if the wall is removed.

        `time` is in [s], `phase` is the index of the phase at this time. The wall counts as removed once it has been
        lifted by more than `top`, the height of the pile's top above the floor [m].
        """
        if self.removal is None or phase < self.removal:
            return 0.0
        if self.lift is None:
            return None
        start, end, speed = self.lift
        raised = speed * (min(max(time, start), end) - start)
        return raised if raised <= top else None


def plate_height(run: Run, time: float) -> float | None:
    """Return the height of the plate's lower face above the floor [m] at a time [s]; None while there is no plate.

    The sample of the series that is nearest in time decides whether there is a plate.
    """
    if not run.has_series or PLATE not in run.series:
        return None
    series = run.series
    height = series[PLATE] - series["container_z_m"]
    there = np.isfinite(height)
    return float(np.interp(time, series.time[there], height[there])) if there[series.nearest(time)] else None


def _start(run: Run, index: int, series: Series | None) -> float | None:
    """Return the time at which the phase `index` starts [s]; None if it is not known.

    If the run does not record this time, it is taken from the last sample of the series before the phase. It is 0 if
    there is no such sample, and not known if the run has no series.
    """
    start = run.phases[index].start_s
    if start is None and series is not None:
        start = float(series.time[series["phase"] < index].max(initial=0.0))
    return start


def _lift(phase: SceneData, start: float | None) -> tuple[float, float, float] | None:
    if phase.get("speed_m_per_s") is None or start is None:
        return None
    return start, start + phase["duration_s"], phase["speed_m_per_s"]


def _cross(length: float, side: float, count: int, height: float) -> pv.PolyData:
    """Return the mesh of a hook: `count` bars along x, and along y, as in `dem.setting.hooks.Cross`.

    Bars end on a circle with the diameter `length`; their cross-section is a square with the side `side`. Their axes
    are at `height`. All are in [m].
    """
    half, bars = side / 2, []
    for k in range(count):
        place = length * ((k + 1) / (count + 1) - 0.5)
        long = math.sqrt((length / 2) ** 2 - place**2)
        for sides in ((-long, long, place - half, place + half), (place - half, place + half, -long, long)):
            bars.append(pv.Box((*sides, height - half, height + half)))
    return joined(bars)


def knots(vertices: Floats, from_hinge: float) -> Floats:
    """Return the points (2, 3) [m] at which strings are tied to both ends of a chain of smarticles.

    `vertices` (N, 4, 3) [m] are those of the smarticles in the order of the chain. One string is tied to the first
    smarticle, the other one to the last, each at the outer barb, at the distance `from_hinge` [m] from the barb's
    hinge. Every second smarticle of a chain is rotated by 180°, so that N decides which barb of the last one is the
    outer one.

    Source: `dem.body.chain.Chain.ties`.
    """
    last = len(vertices) - 1
    points = []
    for smarticle, tip, hinge in ((0, 0, 1), (last, 0, 1) if last % 2 else (last, 3, 2)):
        along = vertices[smarticle, tip] - vertices[smarticle, hinge]
        points.append(vertices[smarticle, hinge] + from_hinge * along / np.linalg.norm(along))
    return np.array(points)


def _strings(run: Run, series: Series | None) -> ChainStrings | None:
    """Return the strings of a run's strain test; None if there is no such phase.

    The anchors follow from the initial layout of the chain; motion of the chain before the test is neglected.

    Source: `dem.body.chain.Chain`, which lays out a chain.
    """
    planned = run.scene["phases"]
    phases = {phase["type"]: phase for phase in planned}
    if _STRAIN not in phases or _ARRANGE not in phases:
        return None
    strain, gap = phases[_STRAIN], phases[_ARRANGE]["gap_m"]
    index = planned.index(strain)
    radius, barb = run.manifest.sphere_diameter_m / 2, run.manifest.barb_length_m
    offset = barb + gap + run.manifest.bulge_m + radius  # distance of the two rows of middle links
    from_hinge = barb - radius if strain.get("tied_at") == "tip" else offset / 2
    reach = (
        (run.manifest.count - 1) * (run.manifest.middle_length_m - 2 * radius - gap) + run.manifest.middle_length_m
    ) / 2
    length = strain["string_length_m"]
    ends = reach + np.sqrt(length**2 - (from_hinge - offset / 2) ** 2)
    return ChainStrings(
        phase=index,
        start=_start(run, index, series) or 0.0,
        speed=strain["speed_m_per_s"],
        from_hinge=from_hinge,
        anchors=np.array([[-ends, 0.0, 0.0], [ends, 0.0, 0.0]]),
    )


KINDS: Mapping[str, str] = MappingProxyType(
    {
        "smarticles": "a box per link, or a box or cylinder per bar of other bodies, with all fields",
        "wall": "wall of the container, tiers and ceilings of a mould, or the two walls of a channel",
        "floor": "floor of the container",
        "hooks": "the two crosses",
        "plate": "the lower face of the plate of a phase compress, while there is a plate",
        "strings": "the two strings of a strain test, as lines",
        "crossings": "on request: a point and a vector for each link that passes through a smarticle's plane",
        "forces": "on request: lines from centre to contact to centre, where the run records forces",
    }
)  #: Kinds of bodies with their descriptions

ON_REQUEST = ("crossings", "forces")
USUAL = tuple(kind for kind in KINDS if kind not in ON_REQUEST)

BOX_POINTS, BOX_FACES = 8, 6
_ROUND = 96  # corners of a circle
_SIDES = 16  # of a cylinder that stands for a round bar
_THINNEST = 0.05  # least thickness of a tube of force over the largest thickness

# Corners of a box (along, in plane, normal), and its faces, counterclockwise seen from outside.
_CORNERS = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) / 2
_FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def checked_kinds(wanted: Sequence[str], unwanted: Sequence[str], *, also: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the kinds of bodies to export: `USUAL` and the wanted kinds, without the unwanted kinds.

    Both may also contain the names in `also`. InputError if a kind is unknown, or none is left.
    """
    for name in (*wanted, *unwanted):
        if name not in KINDS and name not in also:
            raise InputError(f"{name!r} is nothing to export; {nearest(name, [*KINDS, *also], cutoff=0.5)}")
    kept = tuple(kind for kind in KINDS if kind in (*USUAL, *wanted) and kind not in unwanted)
    if not kept:
        raise InputError("nothing to export: all kinds of bodies are left out; leave out less")
    return kept


class Bodies:
    """Makes the meshes of a run's bodies in its frames.

    `kinds` are keys of `KINDS`; the mesh of the smarticles has the given fields. With `cut` walls end a little above
    the pile, as in pictures. InputError if forces are wanted and not recorded.
    """

    def __init__(
        self, run: Run, kinds: Sequence[str] = USUAL, fields: Sequence[Field] = (), *, cut: bool = False
    ) -> None:
        if "forces" in kinds and run.forces is None:
            raise InputError(f"{run.path}: records no forces; {NO_FORCES}")
        self.run = run
        self.kinds = kinds
        self.boundaries = RunBoundaries(run)
        self._fields = fields
        self._cut = cut
        self._top = 0.0  # height of the highest point above the floor
        self._reach = 0.0  # distance of the farthest point from the axis
        self._span = math.inf, -math.inf  # least and largest x

    def hold(self, frames: Iterable[Frame]) -> None:
        """Enlarge walls and floor so that they hold the smarticles of these frames."""
        for frame in frames:
            if frame.count:
                points = frame.segments.reshape(-1, 3)
                self._top = max(self._top, float(points[:, 2].max()) - frame.floor_z)
                self._reach = max(self._reach, float(np.hypot(points[:, 0], points[:, 1]).max()))
                low, high = float(points[:, 0].min()), float(points[:, 0].max())
                self._span = min(self._span[0], low), max(self._span[1], high)

    def at(self, frame: Frame) -> dict[str, pv.PolyData]:
        """Return the meshes [m] of a frame by kind; kinds without a body are left out."""
        made = {kind: getattr(self, f"_{kind}")(frame) for kind in self.kinds}
        return {kind: mesh for kind, mesh in made.items() if mesh is not None and mesh.n_points}

    def _smarticles(self, frame: Frame) -> pv.PolyData:
        run = self.run
        if frame.bars is not None:
            mesh = bar_meshes(frame.bars, run.manifest.kinds or ())
        else:
            mesh = link_boxes(
                frame.vertices,
                thickness_normal=run.manifest.thickness_normal_m,
                thickness_in_plane=run.manifest.thicknesses_in_plane_m,
            )
        owner = mesh.cell_data.pop("smarticle"), mesh.cell_data.pop("link")
        for each in self._fields:
            values = link_values(each, frame, run)
            if values is not None:
                mesh.cell_data[each.name] = values[owner]
        return mesh

    def _wall(self, frame: Frame) -> pv.PolyData | None:
        run, floor = self.run, frame.floor_z
        if run.manifest.planar:
            if run.manifest.channel_width_m is None:
                return None
            half, (first, last) = run.manifest.channel_width_m / 2, self._span
            return joined(
                pv.Rectangle([[first, y, floor], [last, y, floor], [last, y, floor + run.manifest.thickness_normal_m]])
                for y in (-half, half)
            )
        top = float(frame.segments[..., 2].max(initial=floor)) - floor
        raised = self.boundaries.raised(frame.time, frame.phase, top)
        if raised is None:
            return None
        return self.wall_at((0.0 if frame.phase in self.boundaries.floor_alone else floor) + raised)

    def wall_at(self, base: float) -> pv.PolyData:
        """Return the mesh [m] of the wall of a container whose floor is at the height `base` [m]."""
        corners = self.boundaries.corners
        if not corners:
            height, radius = self.boundaries.height, self.run.manifest.container_radius_m
            top = self._top + self.run.manifest.middle_length_m if height is None else height
            corners = [(radius, 0.0), (radius, top)]
        if self._cut:
            *below, (radius, height) = corners
            margin = self.run.manifest.middle_length_m / 4
            corners = [*below, (radius, min(height, max(4 * margin, self._top + margin, below[-1][1] + margin)))]
        line = pv.MultipleLines(np.array([(radius, 0.0, base + height) for radius, height in corners]))
        wall: pv.PolyData = line.extrude_rotate(resolution=_ROUND, capping=False).triangulate()
        wall.clear_data()
        return wall

    def _floor(self, frame: Frame) -> pv.PolyData | None:
        if self.run.manifest.planar:
            return None
        return self._disc(frame.floor_z)

    def _plate(self, frame: Frame) -> pv.PolyData | None:
        height = plate_height(self.run, frame.time)
        return None if height is None else self._disc(frame.floor_z + height)

    def _disc(self, height: float) -> pv.PolyData:
        """Return a horizontal disc over the whole container and all bodies, at a height [m]."""
        radius = max(self.run.manifest.container_radius_m, self._reach)
        disc: pv.PolyData = pv.Disc(center=(0.0, 0.0, height), inner=0, outer=radius, c_res=_ROUND).triangulate()
        return disc

    def _hooks(self, frame: Frame) -> pv.PolyData | None:
        settings = self.run.scene.get("hooks")
        if settings is None:
            return None
        upper = settings["upper_height_m"]  # without a series its motion is unknown
        if self.run.has_series:
            series = self.run.series
            upper = float(np.interp(frame.time, series.time, series["hook_upper_z_m"] - series["container_z_m"]))
        side, length = settings["side_m"], settings["length_m"]
        # Scenes without these keys have two equal crosses.
        lower_length, count = settings.get("lower_length_m", length), round(settings.get("lower_bars", 1))
        crosses = [
            _cross(lower_length, side, count, frame.floor_z + settings["lower_height_m"]),
            _cross(length, side, 1, frame.floor_z + upper),
        ]
        mesh = joined(crosses)
        mesh.cell_data["hook"] = np.repeat([0, 1], [one.n_cells for one in crosses])
        return mesh

    def _strings(self, frame: Frame) -> pv.PolyData | None:
        lines = () if self.boundaries.strings is None else self.boundaries.strings.lines(frame)
        if not len(lines):
            return None
        mesh = joined(pv.MultipleLines(line) for line in lines)
        mesh.clear_data()
        mesh.cell_data["string"] = np.arange(2)
        return mesh

    def _crossings(self, frame: Frame) -> pv.PolyData | None:
        if self.run.manifest.planar or frame.bars is not None or frame.count == 0:
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
            "first_id": frame.smarticle_ids[first],
            "second_id": np.where(second < 0, second, frame.smarticle_ids[second]),
            "fixture": found.boundaries,
            "normal_force_N": found.normal,
            "tangential_force_N": found.tangential,
            "force_N": found.forces,
            "strong": above,
        }
        for name, each in values.items():
            mesh.cell_data[name] = each[mesh.cell_data["contact"]]
        return mesh


def link_boxes(
    vertices: Vertices, *, thickness_normal: float, thickness_in_plane: float | Sequence[float]
) -> pv.PolyData:
    """Return the boxes of all links as one mesh [m] of quadrilaterals, six per box.

    The cross-section of a straight smarticle may be turned around its length by any angle, which its vertices do not
    determine; an arbitrary angle is used. Links without length have no box. The mesh has two arrays of cell data:
    `smarticle`, the index into the vertices (N, 4, 3) [m], and `link`, 0 to 2. Thicknesses are t1, along the normal of
    the smarticle's plane, and t2 in it: for all links, or for barb 1, middle link and barb 2 each [m].
    """
    vertices = checked_vertices(vertices)
    in_plane = np.broadcast_to(thickness_in_plane, 3)
    if not (thickness_normal > 0 and (in_plane > 0).all()):
        raise InputError(f"thicknesses must be above 0 m: got {thickness_normal} m, {thickness_in_plane} m")
    lengths = link_lengths(vertices)
    smarticle, link = np.nonzero(lengths > 1e-9 * lengths.sum(axis=1, keepdims=True))
    start, end = vertices[smarticle, link], vertices[smarticle, link + 1]
    along = end - start
    across = np.cross(plane_frames(vertices)[smarticle, 2], along)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    # Perpendicular to the link even if the four vertices are not quite in one plane.
    normal = np.cross(along, across)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    edges = np.stack([along, in_plane[link, None] * across, thickness_normal * normal], axis=1)
    points = ((start + end) / 2)[:, None] + np.einsum("ce,bex->bcx", _CORNERS, edges)
    faces: Any = _FACES + BOX_POINTS * np.arange(len(points))[:, None, None]
    mesh: pv.PolyData = pv.PolyData.from_regular_faces(points.reshape(-1, 3), faces.reshape(-1, 4))
    mesh.cell_data["smarticle"] = np.repeat(smarticle, BOX_FACES)
    mesh.cell_data["link"] = np.repeat(link, BOX_FACES)
    return mesh


def bar_meshes(bars: RecordedBars, kinds: Sequence[Kind]) -> pv.PolyData:
    """Return boxes and cylinders of all bars as one mesh [m].

    `kinds` are the kinds of bodies, with the cross-sections of their bars; `bars.kind` are indices into it. The mesh
    has two arrays of cell data: `smarticle`, the index of the body, and `link`, the number of the bar in its body.
    """
    along = bars.segments[:, 1] - bars.segments[:, 0]
    lengths = np.linalg.norm(along, axis=1, keepdims=True)
    unit = along / lengths
    normal = bars.normals - (bars.normals * unit).sum(axis=1, keepdims=True) * unit
    # Of a round bar any direction across it will do.
    other = np.eye(3)[np.abs(along).argmin(axis=1)]
    other -= (other * unit).sum(axis=1, keepdims=True) * unit
    normal = np.where(np.abs(bars.normals).any(axis=1, keepdims=True), normal, other)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    across, middles = np.cross(normal, unit), bars.segments.mean(axis=1)
    parts = []
    for number, kind in enumerate(kinds):
        own = np.flatnonzero(bars.kind[bars.body] == number)
        size = (1.0, kind.thickness_in_plane_m, kind.thickness_normal_m)
        corners, faces = _prism(_SIDES) if kind.round else (_CORNERS, _FACES)
        edges = np.stack([along[own], size[1] * across[own], size[2] * normal[own]], axis=1)
        points = middles[own, None] + np.einsum("ce,bex->bcx", corners, edges)
        if len(own):
            cells: Any = faces + len(corners) * np.arange(len(own))[:, None, None]
            part: pv.PolyData = pv.PolyData.from_regular_faces(points.reshape(-1, 3), cells.reshape(-1, faces.shape[1]))
            part.cell_data["smarticle"] = np.repeat(bars.body[own], len(faces))
            part.cell_data["link"] = np.repeat(bars.number[own], len(faces))
            parts.append(part)
    return joined(parts)


def _prism(sides: int) -> tuple[Floats, Whole]:
    """Return corners (2 sides, 3) and triangles (n, 3) of a cylinder along x, of unit length and diameter."""
    angles = 2 * math.pi * np.arange(sides) / sides
    disc = np.column_stack([np.cos(angles), np.sin(angles)]) / 2
    corners = np.concatenate([np.column_stack([np.full(sides, x), disc]) for x in (-0.5, 0.5)])
    one = np.arange(sides)
    two = (one + 1) % sides
    walls = [np.column_stack([one, two, one + sides]), np.column_stack([two, two + sides, one + sides])]
    caps = [np.column_stack([0 * one, two, one])[1:-1], np.column_stack([0 * one, one, two])[1:-1] + sides]
    return corners, np.concatenate([*walls, *caps])


def at_points(mesh: pv.PolyData, values: NDArray[Any]) -> NDArray[Any]:
    """Convert values of the cells of a mesh, (C, …), to values of its points, (P, …).

    All cells at a point must have equal values.
    """
    cells = mesh.GetPolys()
    ends, corners = (np.asarray(array) for array in (cells.GetOffsetsArray(), cells.GetConnectivityArray()))
    found = np.empty((mesh.n_points, *values.shape[1:]), dtype=values.dtype)
    found[corners] = np.repeat(values, np.diff(ends), axis=0)
    return found


def owners(mesh: pv.PolyData, frame: Frame) -> tuple[Whole, Whole]:
    """Return the body and the link to which each of the C cells of a mesh belongs.

    Bodies (C,) are indices into the arrays of the frame; links (C,) are numbers from 0. The mesh must have the cell
    data `smarticle_id` and `link`.
    """
    owner, link = (np.asarray(mesh.cell_data[name]) for name in ("smarticle_id", "link"))
    order = np.argsort(frame.smarticle_ids)
    return order[np.searchsorted(frame.smarticle_ids, owner, sorter=order)], link


def force_lines(forces: RecordedForces) -> pv.PolyData:
    """Return a mesh [m] of lines from the smarticles' centres of mass to their contacts.

    A contact between smarticles has two lines, a contact with a boundary has one line. Lines share no points, because
    tubes around a sharp bend would be torn. The cell data `contact` are the indices of the contacts.
    """
    halves = [np.stack([forces.ends[:, k], forces.contacts.points], axis=1) for k in (0, 1)]
    segments = np.concatenate([halves[0], halves[1][forces.between]])
    numbers = np.arange(len(forces.ends))
    lines = np.column_stack([np.full(len(segments), 2), np.arange(2 * len(segments)).reshape(-1, 2)])
    mesh = pv.PolyData(segments.reshape(-1, 3), lines=lines)
    mesh.cell_data["contact"] = np.concatenate([numbers, numbers[forces.between]])
    return mesh


def solid(kind: str, mesh: pv.PolyData, run: Run, *, largest: float | None = None) -> pv.PolyData:
    """Return the mesh of a kind of body as triangles, with solids in place of lines and points.

    Strings become tubes a fifth as thick as a link, and crossings become arrows of length w/3. Forces become tubes with
    a thickness proportional to the normal force. The tube of the force `largest` [N], by default the largest force in
    the mesh, is as thick as a link.
    """
    thin = min(run.manifest.thickness_in_plane_m, run.manifest.thickness_normal_m)
    if kind == "strings":
        mesh = mesh.tube(radius=thin / 10, n_sides=8, capping=True)
    if kind == "forces":
        normal = np.asarray(mesh.cell_data["normal_force_N"])
        relative = np.clip(normal / (largest or float(normal.max())), _THINNEST, 1.0)
        bare = pv.PolyData(mesh.points, lines=mesh.lines)
        bare.point_data["radius"] = np.repeat(thin / 2 * relative, 2)
        mesh = bare.tube(radius=1.0, scalars="radius", absolute=True, n_sides=8, capping=True)
    if kind == "crossings":
        arrow = pv.Arrow(start=(-0.5, 0.0, 0.0), tip_resolution=8, shaft_resolution=6)
        mesh = mesh.glyph(geom=arrow, orient="direction", scale=False, factor=run.manifest.middle_length_m / 3)
    triangles: pv.PolyData = mesh.triangulate()
    return triangles


def joined(parts: Iterable[pv.PolyData]) -> pv.PolyData:
    """Join several meshes into one."""
    first, *rest = parts
    mesh: pv.PolyData = first.append_polydata(*rest)
    return mesh
